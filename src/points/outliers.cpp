// SPDX-License-Identifier: BSD-3-Clause
#include "base/select_values.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/outliers.h>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Mean distance from each point to its k nearest others; 0 for a point that has none.
std::vector<float> meanNeighborDistances(const PointSet& points, const NeighborSearch& search, int k,
                                         Execution& execution)
{
  std::vector<float> means(points.size(), 0);
  search.forEachPosition(points.positions, k + 1, NeighborSearch::Answer::distances, execution,
                         [&](const NeighborBatch& batch) {
                           for (std::size_t q = 0; q < batch.size; ++q) {
                             // The first is the point itself.
                             const float* squared = batch.squaredDistances + q * batch.k;
                             double total = 0;
                             int others = 0;
                             for (int n = 1; n <= k && std::isfinite(squared[n]); ++n, ++others)
                               total += std::sqrt(squared[n]);
                             if (others > 0)
                               means[batch.positions[q]] = static_cast<float>(total / others);
                           }
                         });
  return means;
}

/// Neighbors of which so many have to agree with a point.
constexpr int minCoherent = 5;

/// Cosines between normals, and sines between an edge and the tangent planes at its ends, of one surface.
/// Looser ones keep distant outliers, whose estimated normals resemble those of the others they were estimated from: 22
/// of 276 on a noisy head with a sine of .5, 13 with this; tighter ones drop lone points of range scans.
constexpr float minCosine = .7f, maxSine = .35f;

/// Whether a surface goes through a point with a normal and its neighbors.
bool hasCoherentNormals(const PointSet& points, std::size_t i, const Neighbors& found)
{
  const Eigen::Vector3f& normal = points.normals[i];
  int coherent = 0;
  for (const int index : found.indices) {
    const auto j = static_cast<std::size_t>(index);
    const Eigen::Vector3f edge = points.positions[j] - points.positions[i];
    const Eigen::Vector3f& other = points.normals[j];
    const float limit = maxSine * edge.norm();
    if (j != i && std::abs(normal.dot(other)) >= minCosine && std::abs(edge.dot(normal)) <= limit &&
        std::abs(edge.dot(other)) <= limit)
      ++coherent;
  }
  return coherent >= minCoherent;
}

/// The same where there is no normal: whether the directions to the neighbors lie in a plane, and not all on one side.
bool liesAmidPlane(const PointSet& points, std::size_t i, const Neighbors& found)
{
  // Of random directions the third axis has a tenth and more, and their mean a length of .35; at a straight border of
  // a surface the mean has .64, and from far away nearly 1.
  constexpr double flat = .03, oneSided = .8;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;
  for (const int index : found.indices) {
    const Eigen::Vector3d edge =
        (points.positions[static_cast<std::size_t>(index)] - points.positions[i]).cast<double>();
    const double length = edge.norm();
    if (!(length > 0))
      continue;
    sum += edge / length;
    squares += edge * edge.transpose() / (length * length);
    ++count;
  }
  if (count < 3 || sum.norm() > oneSided * count)
    return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares, Eigen::EigenvaluesOnly);
  return axes.eigenvalues()[0] <= flat * count;
}

/// The quantile of values that are not negative.
float quantile(std::vector<float> values, double share)
{
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// \param means distances to the neighbors
std::vector<std::uint8_t> keptByNeighbors(const PointSet& points, const std::vector<float>& means,
                                          const NeighborSearch& search, float factor, Execution& execution)
{
  std::vector<std::uint8_t> keep(points.size(), 1);
  const float everywhere = factor * median(means, execution);
  if (!(everywhere > 0)) // most points coincide with others: it measures nothing
    return keep;
  // A point closer to its neighbors than this is not far beside anything: no others are looked at.
  const float closest = factor * quantile(means, .05);
  execution.forRange(static_cast<std::int64_t>(keep.size()), 4096, [&](std::int64_t begin, std::int64_t end) {
    Neighbors found;
    std::vector<float> around;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      if (!(means[i] > closest))
        continue;
      search.nearest(points.positions[i], measuredNeighbors + 1, found);
      around.clear();
      for (const int j : found.indices)
        if (static_cast<std::size_t>(j) != i)
          around.push_back(means[static_cast<std::size_t>(j)]);
      if (around.empty() || (means[i] <= everywhere && means[i] <= factor * median(around)))
        continue;
      const bool hasNormal = !points.normals.empty() && !points.normals[i].isZero();
      keep[i] = (hasNormal ? hasCoherentNormals(points, i, found) : liesAmidPlane(points, i, found)) ? 1 : 0;
    }
  });
  return keep;
}

std::vector<std::uint8_t> keptBySpacing(const std::vector<float>& means, const OutlierOptions& options,
                                        Execution& execution)
{
  std::vector<std::uint8_t> keep(means.size(), 1);
  const float middle = median(means, execution);
  if (middle > 0) // else most points coincide with others: it measures nothing
    for (std::size_t i = 0; i < keep.size(); ++i)
      keep[i] = means[i] <= options.spacingFactor * middle;
  return keep;
}

std::vector<std::uint8_t> keptByStatistics(const PointSet& points, const OutlierOptions& options)
{
  auto cloud = std::make_shared<PointCloud<PointXYZ>>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& position : points.positions)
    cloud->push_back(PointXYZ(position.x(), position.y(), position.z()));

  StatisticalOutlierRemoval<PointXYZ> filter(true);
  filter.setInputCloud(cloud);
  // Left to itself PCL goes on without any if there is no memory for them.
  auto indices = std::make_shared<Indices>(points.size());
  std::iota(indices->begin(), indices->end(), 0);
  filter.setIndices(indices);
  // PCL reads past the end of its results when there are fewer neighbors than it was told to average over.
  filter.setMeanK(std::min(options.statisticalNeighbors, static_cast<int>(points.size()) - 1));
  filter.setStddevMulThresh(options.statisticalDeviations);
  Indices kept;
  filter.filter(kept);

  std::vector<std::uint8_t> keep(points.size(), 0);
  for (const index_t index : kept)
    keep[static_cast<std::size_t>(index)] = 1;
  return keep;
}

/// Clears the flags that another criterion has cleared. \return how many
std::int64_t intersect(std::vector<std::uint8_t>& keep, const std::vector<std::uint8_t>& other)
{
  std::int64_t dropped = 0;
  for (std::size_t i = 0; i < keep.size(); ++i)
    if (keep[i] && !other[i]) {
      keep[i] = 0;
      ++dropped;
    }
  return dropped;
}

} // namespace

OutlierResult findOutliers(const PointSet& points, const NeighborSearch& search, const OutlierOptions& options,
                           Execution& execution)
{
  return findOutliers(
      points, options.alone && points.size() > 1 ? measureNeighbors(points, search, execution) : NeighborDistances(),
      search, options, execution);
}

OutlierResult findOutliers(const PointSet& points, const NeighborDistances& distances, const NeighborSearch& search,
                           const OutlierOptions& options, Execution& execution)
{
  validate(options);
  OutlierResult result;
  result.keep.assign(points.size(), 1);
  if (points.size() < 2)
    return result;
  if (options.alone)
    result.droppedAlone =
        intersect(result.keep, keptByNeighbors(points, distances.mean, search, options.aloneFactor, execution));
  if (options.spacing) {
    const bool isMeasured = options.spacingNeighbors == measuredNeighbors && !distances.mean.empty();
    result.droppedBySpacing =
        intersect(result.keep,
                  keptBySpacing(isMeasured ? distances.mean
                                           : meanNeighborDistances(points, search, options.spacingNeighbors, execution),
                                options, execution));
  }
  execution.poll();
  if (options.statistical)
    result.droppedByStatistics = intersect(result.keep, keptByStatistics(points, options));
  return result;
}

} // namespace mrf
} // namespace pcl
