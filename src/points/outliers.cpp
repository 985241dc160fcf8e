// SPDX-License-Identifier: BSD-3-Clause
#include "points/outliers.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "points/local_plane.h"
#include "points/pcl_search.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/filters/impl/filter.hpp> // compiled here, so that PCL's library of filters need not be loaded
#include <pcl/filters/impl/filter_indices.hpp>
#include <pcl/filters/impl/statistical_outlier_removal.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <mutex>
#include <numeric>

namespace pcl::mrf {
namespace {

/// A point is far if it is more than this factor times as far from its neighbors as they are from theirs (median). A
/// factor of 2 drops 1 to 3 % of real clouds.
constexpr float aloneFactor = 2.7f;

/// Parameters of PCL's filter: setMeanK and setStddevMulThresh.
constexpr int statisticalNeighbors = 8;
constexpr double statisticalDeviations = 3;

/// A far point stays if at least minCoherent of its neighbors are on one surface with it, and at least minStaying of
/// these stay themselves: among outliers, some lie on one plane by chance.
constexpr std::size_t minCoherent = 5;
constexpr std::ptrdiff_t minStaying = 3;

/// Two points are on one surface if the cosine between their normals is at least coherentCosine, and the sine between
/// the edge that joins them and the tangent planes at its ends is at most maxSine.
constexpr float coherentCosine = .7f, maxSine = .35f;

/// Finds the neighbors that are on one surface with a point.
class Coherence {
public:
  Coherence(const PointSet& points, const NeighborSearch& search) : points_(points), search_(search) {}

  /// \return those of the neighbors, in their order; all of them if the points around point i lie on a line
  std::vector<std::uint32_t> coherent(std::uint32_t i, const std::vector<int>& neighbors)
  {
    std::vector<std::uint32_t> result;
    const Eigen::Vector3f normal = normalAt(i);
    for (const int neighbor : neighbors) {
      const auto j = static_cast<std::uint32_t>(neighbor);
      const Eigen::Vector3f edge = points_.positions[j] - points_.positions[i];
      const float limit = maxSine * edge.norm();
      if (j == i || std::abs(edge.dot(normal)) > limit)
        continue;
      if (!normal.isZero()) {
        const Eigen::Vector3f other = normalAt(j);
        if (std::abs(normal.dot(other)) < coherentCosine || std::abs(edge.dot(other)) > limit)
          continue;
      }
      result.push_back(j);
    }
    return result;
  }

private:
  /// The point's normal or, if it has none, that of the plane through the points around it.
  Eigen::Vector3f normalAt(std::uint32_t i)
  {
    if (!points_.normals.empty() && !points_.normals[i].isZero())
      return points_.normals[i];
    const Eigen::Vector3f& position = points_.positions[i];
    const auto number = static_cast<std::size_t>(search_.nearest(position, nearestNeighbors, around_));
    return fitPlane(points_.positions, around_.indices.data(), number, position).normal.cast<float>();
  }

  const PointSet& points_;
  const NeighborSearch& search_;
  Neighbors around_;
};

/// Numbers of nearest other points among which a surface is looked for, however far away they are.
constexpr std::array<int, 4> scales = {16, 32, 64, 128};

/// Whether a surface goes through the point: at one of the scales, its nearest points lie in a layer with it. A thicker
/// layer is enough if the number of points grows with the distance about as on a surface, where 128 points reach 4
/// times as far as 8. In a volume they reach 2.5 times as far.
bool isOnSurface(const PointSet& points, const NeighborSearch& search, std::uint32_t i, Neighbors& around)
{
  constexpr float growth = 2.8f * 2.8f;        // min growth of the squared distance from 8 to 128 points
  constexpr double thin = .15, thicker = .35;  // max thickness, in lengths of the layer
  constexpr double within = 2.5, beside = 1.7; // max offset of the point, in deviations of the layer: across, along
  const Eigen::Vector3f& position = points.positions[i];
  const int found = search.nearest(position, scales.back() + 1, around);
  const bool grows = found > scales.back() &&
                     around.squaredDistances[scales.back()] > growth * around.squaredDistances[measuredNeighbors];
  return std::any_of(scales.begin(), scales.end(), [&](int scale) {
    if (found <= scale)
      return false;
    Eigen::Matrix3Xd relative(3, scale);
    for (int n = 0; n < scale; ++n) // the nearest is the point itself, or lies where it does
      relative.col(n) = (points.positions[around.indices[static_cast<std::size_t>(n) + 1]] - position).cast<double>();
    const Eigen::Vector3d middle = relative.rowwise().mean();
    relative.colwise() -= middle;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(relative * relative.transpose() / scale);
    const Eigen::Array3d lengths = axes.eigenvalues().array().max(0).sqrt(),
                         offsets = (axes.eigenvectors().transpose() * middle).array().abs();
    return lengths[0] < (grows ? thicker : thin) * lengths[2] && offsets[0] <= within * lengths[0] &&
           offsets.tail<2>().matrix().norm() <= beside * lengths.tail<2>().matrix().norm();
  });
}

/// A point far from its neighbors, and the neighbors that are on one surface with it.
struct FarPoint {
  std::uint32_t index;
  std::vector<std::uint32_t> coherent;
  bool isOnSurface; ///< at one of the scales
};

/// Points whose mean distance to their neighbors exceeds `factor` times the median of these neighbors', or of all
/// points'; in any order. \param means mean distance of each point to its neighbors
std::vector<FarPoint> findFar(const PointSet& points, const std::vector<float>& means, const NeighborSearch& search,
                              float factor, Execution& execution)
{
  std::vector<FarPoint> far;
  const float everywhere = factor * median(means);
  if (!(everywhere > 0)) // most points coincide with others: distances measure nothing
    return far;
  // Points closer to their neighbors than this are not far: their neighbors are not searched.
  const float closest = factor * quantile(means, .05);
  std::mutex mutex;
  forRangePolling(execution, means.size(), 4096, [&](std::uint32_t begin, std::uint32_t end) {
    Neighbors found;
    std::vector<float> around;
    std::vector<FarPoint> here;
    Coherence coherence(points, search);
    for (std::uint32_t i = begin; i < end; ++i) {
      if (!(means[i] > closest))
        continue;
      search.nearest(points.positions[i], measuredNeighbors + 1, found);
      around.clear();
      for (const int j : found.indices)
        if (static_cast<std::uint32_t>(j) != i)
          around.push_back(means[j]);
      if (!around.empty() && (means[i] > everywhere || means[i] > factor * median(around)))
        here.push_back({i, coherence.coherent(i, found.indices), isOnSurface(points, search, i, found)});
    }
    const std::lock_guard<std::mutex> lock(mutex);
    std::move(here.begin(), here.end(), std::back_inserter(far));
  });
  return far;
}

/// \param means mean distance of each point to its neighbors
std::vector<std::uint8_t> keptByNeighbors(const PointSet& points, const std::vector<float>& means,
                                          const NeighborSearch& search, float factor, Execution& execution)
{
  const std::vector<FarPoint> far = findFar(points, means, search, factor, execution);
  std::vector<std::uint8_t> agrees(points.size(), 1);
  for (const FarPoint& point : far)
    agrees[point.index] = point.isOnSurface || point.coherent.size() >= minCoherent ? 1 : 0;
  std::vector<std::uint8_t> keep = agrees;
  for (const FarPoint& point : far) {
    const auto staying =
        std::count_if(point.coherent.begin(), point.coherent.end(), [&](std::uint32_t j) { return agrees[j] != 0; });
    if (!point.isOnSurface && staying < minStaying)
      keep[point.index] = 0;
  }
  return keep;
}

std::vector<std::uint8_t> keptByStatistics(const PointSet& points)
{
  StatisticalOutlierRemoval<PointXYZ> filter(true); // searches by FLANN
  filter.setInputCloud(toPclCloud(points.positions));
  // PCL would make indices itself, but goes on without any if there is no memory for them.
  auto indices = std::make_shared<Indices>(points.size());
  std::iota(indices->begin(), indices->end(), 0);
  filter.setIndices(indices);
  // PCL reads past the end of its results when there are fewer neighbors than it was told to average over.
  filter.setMeanK(std::min(statisticalNeighbors, static_cast<int>(points.size()) - 1));
  filter.setStddevMulThresh(statisticalDeviations);
  Indices kept;
  filter.filter(kept);

  std::vector<std::uint8_t> keep(points.size(), 0);
  for (const index_t index : kept)
    keep[index] = 1;
  return keep;
}

} // namespace

OutlierResult findOutliers(const PointSet& points, const NeighborDistances& distances, const NeighborSearch& search,
                           const OutlierOptions& options, Execution& execution)
{
  OutlierResult result;
  result.keep.assign(points.size(), 1);
  if (points.size() < 2)
    return result;
  const auto dropOthers = [&](const std::vector<std::uint8_t>& kept) {
    return dropWhere(
        result.keep, [&](std::size_t i) { return !kept[i]; }, execution);
  };
  if (options.alone)
    result.droppedAlone = dropOthers(keptByNeighbors(points, distances.mean, search, aloneFactor, execution));
  execution.poll();
  if (options.statistical)
    result.droppedByStatistics = dropOthers(keptByStatistics(points));
  return result;
}

} // namespace pcl::mrf
