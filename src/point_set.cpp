#include <pcl/surface/mrf/point_set.h>

#include "select_values.h"

namespace pcl {
namespace mrf {
PointSet select(const PointSet& points, const std::vector<std::uint8_t>& keep)
{
  PointSet kept;
  kept.positions = selectValues(points.positions, keep);
  kept.normals = selectValues(points.normals, keep);
  kept.confidences = selectValues(points.confidences, keep);
  kept.views = selectValues(points.views, keep);
  kept.origins = selectValues(points.origins, keep);
  kept.sensors = points.sensors;
  kept.offset = points.offset;
  return kept;
}

OrientedPoints select(const OrientedPoints& points, const std::vector<std::uint8_t>& keep)
{
  OrientedPoints kept;
  kept.positions = selectValues(points.positions, keep);
  kept.normals = selectValues(points.normals, keep);
  kept.confidences = selectValues(points.confidences, keep);
  kept.origins = selectValues(points.origins, keep);
  kept.offset = points.offset;
  return kept;
}

BoundingBox boundingBox(const std::vector<Eigen::Vector3f>& positions)
{
  BoundingBox box;
  if (positions.empty())
    return box;
  box.lower = box.upper = positions.front();
  for (const Eigen::Vector3f& position : positions) {
    box.lower = box.lower.cwiseMin(position);
    box.upper = box.upper.cwiseMax(position);
  }
  return box;
}

} // namespace mrf
} // namespace pcl
