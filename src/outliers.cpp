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

/// Points per piece of parallel work: a few milliseconds of queries.
constexpr std::int64_t grain = 1024;

/// Mean distance from each point to its k nearest others; 0 for a point that has none.
std::vector<float> meanNeighbourDistances(const PointSet& points, const NeighbourSearch& search, int k,
                                          Execution& execution)
{
  std::vector<float> means(points.size(), 0);
  execution.forRange(static_cast<std::int64_t>(points.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    Neighbours found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const int number = search.nearest(points.positions[i], k + 1, found);
      // The point itself is among them, at distance 0.
      double total = 0;
      for (int n = 0; n < number; ++n)
        total += std::sqrt(found.squaredDistances[static_cast<std::size_t>(n)]);
      if (number > 1)
        means[i] = static_cast<float>(total / (number - 1));
    }
  });
  return means;
}

std::vector<std::uint8_t> keptBySpacing(const PointSet& points, const NeighbourSearch& search,
                                        const OutlierOptions& options, Execution& execution)
{
  const std::vector<float> means = meanNeighbourDistances(points, search, options.spacingNeighbours, execution);
  std::vector<float> sorted = means;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::vector<std::uint8_t> keep(points.size(), 1);
  // A median of 0 means that most points coincide with others: it measures nothing.
  if (*middle > 0)
    for (std::size_t i = 0; i < keep.size(); ++i)
      keep[i] = means[i] <= options.spacingFactor * *middle;
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
  OutlierResult result;
  result.keep.assign(points.size(), 1);
  if (points.size() < 2)
    return result;
  if (options.spacing) {
    result.keep = keptBySpacing(points, search, options, execution);
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

} // namespace mrf
} // namespace pcl
