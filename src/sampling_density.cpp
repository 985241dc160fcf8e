#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/sampling_density.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace pcl {
namespace mrf {
namespace {

/// Points per piece of parallel work: a few milliseconds of queries.
constexpr std::int64_t grain = 1024;

constexpr int eighth = 8;

/// On a uniformly sampled surface the mean nearest distance is this share of the distance to the 8th neighbour.
constexpr float nearestToEighth = 0.313f;

struct NeighbourDistances {
  std::vector<float> nearest; ///< distance to the closest other point, infinite without one
  std::vector<float> eighth;  ///< distance to the 8th other point, infinite without one
  bool hasDuplicates = false;
};

NeighbourDistances measure(const std::vector<Eigen::Vector3f>& positions, const NeighbourSearch& search,
                           Execution& execution)
{
  const auto count = static_cast<std::int64_t>(positions.size());
  NeighbourDistances distances;
  distances.nearest.assign(positions.size(), std::numeric_limits<float>::infinity());
  distances.eighth = distances.nearest;
  std::vector<std::uint8_t> isDuplicate(positions.size(), 0);
  execution.forRange(count, grain, [&](std::int64_t begin, std::int64_t end) {
    Neighbours found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const int number = search.nearest(positions[i], eighth + 1, found);
      int others = 0;
      for (int n = 0; n < number; ++n) {
        const auto j = static_cast<std::size_t>(found.indices[static_cast<std::size_t>(n)]);
        if (j == i)
          continue;
        ++others;
        const float distance = std::sqrt(found.squaredDistances[static_cast<std::size_t>(n)]);
        if (others == 1) {
          distances.nearest[i] = distance;
          isDuplicate[i] = positions[j] == positions[i];
        }
        if (others == eighth)
          distances.eighth[i] = distance;
      }
    }
  });
  distances.hasDuplicates = std::find(isDuplicate.begin(), isDuplicate.end(), std::uint8_t{1}) != isDuplicate.end();
  return distances;
}

std::vector<Eigen::Vector3f> distinct(std::vector<Eigen::Vector3f> positions)
{
  std::sort(positions.begin(), positions.end(), [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  return positions;
}

void requireTwo(std::size_t count)
{
  if (count < 2)
    throw InvalidInput("the points have " + std::to_string(count) +
                       " distinct positions, a sampling density needs at least 2");
}

float median(std::vector<float> values)
{
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

} // namespace

SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighbourSearch& search, Execution& execution)
{
  requireTwo(points.size());
  NeighbourDistances distances = measure(points.positions, search, execution);
  if (distances.hasDuplicates) {
    // Rare, because gathering drops them: a tree of the distinct positions is simpler than looking past duplicates,
    // and stays cheap however many of them coincide.
    const std::vector<Eigen::Vector3f> positions = distinct(points.positions);
    requireTwo(positions.size());
    const std::unique_ptr<NeighbourSearch> tree = makeKdTree();
    tree->setPoints(positions);
    distances = measure(positions, *tree, execution);
  }

  const std::vector<float>& nearest = distances.nearest;
  const auto count = static_cast<std::int64_t>(nearest.size());
  const auto sumOf = [&](auto&& term) {
    return execution.sum(count, 16 * grain, [&](std::int64_t begin, std::int64_t end) {
      double total = 0;
      for (std::int64_t i = begin; i < end; ++i)
        total += term(double{nearest[static_cast<std::size_t>(i)]});
      return total;
    });
  };
  const double mean = sumOf([](double distance) { return distance; }) / static_cast<double>(count);
  const double variance =
      sumOf([&](double distance) { return (distance - mean) * (distance - mean); }) / static_cast<double>(count);

  SamplingDensity density;
  density.nearestMean = static_cast<float>(mean);
  density.nearestDeviation = static_cast<float>(std::sqrt(variance));
  if (count > eighth)
    density.eighthMedian = median(std::move(distances.eighth));
  density.spacing = std::max(density.nearestMean, nearestToEighth * density.eighthMedian);
  if (!(density.spacing > 0) || !std::isfinite(density.spacing))
    throw InvalidInput("the points' spacing is " + std::to_string(density.spacing) +
                       ", beyond the range of single precision; scale the cloud towards unit size");
  return density;
}

} // namespace mrf
} // namespace pcl
