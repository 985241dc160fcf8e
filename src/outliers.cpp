#include "select_values.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/outliers.h>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Mean distance from each point to its k nearest others; 0 for a point that has none.
std::vector<float> meanNeighbourDistances(const PointSet& points, const NeighbourSearch& search, int k,
                                          Execution& execution)
{
  std::vector<float> means(points.size(), 0);
  search.forEachPosition(points.positions, k + 1, NeighbourSearch::Answer::distances, execution,
                         [&](const NeighbourBatch& batch) {
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
  // PCL reads past the end of its results when there are fewer neighbours than it was told to average over.
  filter.setMeanK(std::min(options.statisticalNeighbours, static_cast<int>(points.size()) - 1));
  filter.setStddevMulThresh(options.statisticalDeviations);
  Indices kept;
  filter.filter(kept);

  std::vector<std::uint8_t> keep(points.size(), 0);
  for (const index_t index : kept)
    keep[static_cast<std::size_t>(index)] = 1;
  return keep;
}

/// \param means distances to the neighbours, for the spacing criterion
OutlierResult drop(const PointSet& points, const std::vector<float>& means, const OutlierOptions& options,
                   Execution& execution)
{
  OutlierResult result;
  result.keep.assign(points.size(), 1);
  if (points.size() < 2)
    return result;
  if (options.spacing) {
    result.keep = keptBySpacing(means, options, execution);
    result.droppedBySpacing = std::count(result.keep.begin(), result.keep.end(), std::uint8_t{0});
  }
  if (options.statistical) {
    execution.poll();
    const std::vector<std::uint8_t> keep = keptByStatistics(points, options);
    for (std::size_t i = 0; i < keep.size(); ++i)
      if (result.keep[i] && !keep[i]) {
        result.keep[i] = 0;
        ++result.droppedByStatistics;
      }
  }
  return result;
}

template <typename Value>
[[noreturn]] void refuse(const char* name, Value value, const char* range)
{
  std::ostringstream text;
  text << "outliers." << name << " = " << value << " is outside its range " << range;
  throw InvalidOption(text.str());
}

} // namespace

void validate(const OutlierOptions& options)
{
  if (options.spacingNeighbours < 1 || options.spacingNeighbours > 1000)
    refuse("spacingNeighbours", options.spacingNeighbours, "1..1000");
  if (!(options.spacingFactor > 1) || !std::isfinite(options.spacingFactor))
    refuse("spacingFactor", options.spacingFactor, "> 1 (set spacing = false to keep all points)");
  if (options.statisticalNeighbours < 1 || options.statisticalNeighbours > 1000)
    refuse("statisticalNeighbours", options.statisticalNeighbours, "1..1000");
  if (!(options.statisticalDeviations > 0) || !std::isfinite(options.statisticalDeviations))
    refuse("statisticalDeviations", options.statisticalDeviations, "> 0 (set statistical = false to keep all points)");
}

OutlierResult findOutliers(const PointSet& points, const NeighbourSearch& search, const OutlierOptions& options,
                           Execution& execution)
{
  validate(options);
  if (!options.spacing || points.size() < 2)
    return drop(points, {}, options, execution);
  return drop(points, meanNeighbourDistances(points, search, options.spacingNeighbours, execution), options, execution);
}

OutlierResult findOutliers(const PointSet& points, const NeighbourDistances& distances, const OutlierOptions& options,
                           Execution& execution)
{
  validate(options);
  if (options.spacing && options.spacingNeighbours != measuredNeighbours)
    refuse("spacingNeighbours", options.spacingNeighbours, "8, which the distances were measured for");
  return drop(points, distances.mean, options, execution);
}

} // namespace mrf
} // namespace pcl
