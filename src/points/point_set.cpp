// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/point_set.h>

#include "base/select_values.h"

#include <pcl/surface/mrf/exceptions.h>

namespace pcl::mrf {
namespace {

/// \param which flags or indices \param selected may be `points` itself
template <typename Which>
void selectArrays(const PointArrays& points, const Which& which, PointArrays& selected)
{
  selected.positions = selectValues(points.positions, which);
  selected.normals = selectValues(points.normals, which);
  selected.confidences = selectValues(points.confidences, which);
  selected.deviations = selectValues(points.deviations, which);
  selected.views = selectValues(points.views, which);
  selected.spacings = selectValues(points.spacings, which);
  selected.origins = selectValues(points.origins, which);
  selected.sensors = points.sensors;
  selected.offset = points.offset;
}

} // namespace

PointSet select(PointSet points, const std::vector<std::uint8_t>& keep)
{
  points.gathered = points.wholeSize();
  selectArrays(points, keep, points);
  return points;
}

OrientedPoints select(OrientedPoints points, const std::vector<std::uint8_t>& keep)
{
  selectArrays(points, keep, points);
  return points;
}

OrientedPoints select(const OrientedPoints& points, const std::vector<std::uint32_t>& indices)
{
  OrientedPoints selected;
  selectArrays(points, indices, selected);
  selected.typicalDeviation = points.typicalDeviation;
  return selected;
}

BoundingBox boundingBox(const std::vector<Eigen::Vector3f>& positions)
{
  BoundingBox box;
  if (positions.empty())
    return box;
  // Four points at a time: twelve floats make whole vectors.
  using Four = Eigen::Array<float, 12, 1>;
  Four lower = positions.front().array().replicate<4, 1>(), upper = lower;
  const std::size_t whole = positions.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    const Eigen::Map<const Four> four(positions[i].data());
    lower = lower.min(four);
    upper = upper.max(four);
  }
  for (std::size_t i = whole; i < positions.size(); ++i) {
    lower.head<3>() = lower.head<3>().min(positions[i].array());
    upper.head<3>() = upper.head<3>().max(positions[i].array());
  }
  const auto points = [](const Four& four) { return Eigen::Map<const Eigen::Matrix<float, 3, 4>>(four.data()); };
  box.lower = points(lower).rowwise().minCoeff();
  box.upper = points(upper).rowwise().maxCoeff();
  return box;
}

} // namespace pcl::mrf
