// SPDX-License-Identifier: BSD-3-Clause
#include "points/sampling_density.h"

#include "base/loops.h"
#include "base/select_values.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

namespace pcl::mrf {
namespace {

/// Points per piece of parallel work.
constexpr std::int64_t densityGrain = 1 << 14;

std::vector<Eigen::Vector3f> distinct(std::vector<Eigen::Vector3f> positions)
{
  std::sort(positions.begin(), positions.end(), [](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  });
  positions.erase(std::unique(positions.begin(), positions.end()), positions.end());
  return positions;
}

} // namespace

NeighborDistances measureNeighbors(const PointSet& points, const NeighborSearch& search, Execution& execution)
{
  const std::vector<Eigen::Vector3f>& positions = points.positions;
  NeighborDistances distances;
  distances.nearest.resize(positions.size());
  distances.eighth.resize(positions.size());
  distances.mean.resize(positions.size());
  std::atomic<bool> hasCoincident{false};
  const auto isCoincident = [&](std::size_t i) {
    // Positions are compared, because squared distances in tiny clouds may underflow to zero.
    Neighbors found;
    const int number = search.nearest(positions[i], 2, found);
    return std::any_of(found.indices.begin(), found.indices.begin() + number, [&](int index) {
      const std::size_t j = index;
      return j != i && positions[j] == positions[i];
    });
  };
  search.forEachPosition(
      positions, measuredNeighbors + 1, NeighborSearch::Answer::distances, execution, [&](const NeighborBatch& batch) {
        for (std::size_t q = 0; q < batch.size; ++q) {
          const std::size_t i = batch.positions[q];
          const float* squared = batch.squaredDistances + q * batch.k; // the first is the point itself
          double total = 0;
          int others = 0;
          for (int n = 1; n <= measuredNeighbors && std::isfinite(squared[n]); ++n, ++others)
            total += std::sqrt(squared[n]);
          distances.nearest[i] = std::sqrt(squared[1]);
          distances.eighth[i] = std::sqrt(squared[measuredNeighbors]);
          distances.mean[i] = others > 0 ? static_cast<float>(total / others) : 0;
          if (squared[1] == 0 && isCoincident(i))
            hasCoincident = true;
        }
      });
  distances.hasCoincident = hasCoincident;
  return distances;
}

std::vector<float> localSpacings(const PointSet& points, const NeighborDistances& distances, Execution& execution)
{
  if (distances.eighth.size() <= measuredNeighbors)
    return {};
  // One point's distance is off by about a fifth. Most points next to it in memory are close, and take no search.
  constexpr std::size_t reach = 8;
  const std::size_t count = points.size();
  std::vector<float> spacings(count);
  forEach(execution, count, densityGrain, [&](std::size_t i) {
    const float limit = distances.eighth[i] * distances.eighth[i];
    float sum = 0, found = 0;
    for (std::size_t j = i - std::min(i, reach); j < std::min(i + reach + 1, count); ++j)
      if ((points.positions[j] - points.positions[i]).squaredNorm() <= limit) {
        sum += distances.eighth[j];
        ++found;
      }
    spacings[i] = nearestToEighth * (found > 0 ? sum / found : distances.eighth[i]);
  });
  return spacings;
}

SamplingDensity estimateSamplingDensity(const PointSet& points, const NeighborDistances& distances,
                                        Execution& execution, LengthUnit unit)
{
  if (points.size() < 2)
    throw InvalidInput("the points have " + std::to_string(points.size()) +
                       " distinct positions, a sampling density needs at least 2");
  if (distances.hasCoincident) {
    // Duplicates are rare, because gathering drops them. Searching the distinct positions is simpler than looking past
    // duplicates, and stays cheap however many there are.
    PointSet once;
    once.positions = distinct(points.positions);
    const std::unique_ptr<NeighborSearch> search = makePointBins();
    search->setPoints(once.positions, execution);
    return estimateSamplingDensity(once, measureNeighbors(once, *search, execution), execution, unit);
  }

  const std::vector<float>& nearest = distances.nearest;
  const auto count = static_cast<std::int64_t>(nearest.size());
  const auto sumOf = [&](auto&& term) {
    return sumOver(execution, count, densityGrain, [&](std::size_t i) { return term(double{nearest[i]}); });
  };
  const double mean = sumOf([](double distance) { return distance; }) / static_cast<double>(count);
  const double variance =
      sumOf([&](double distance) { return (distance - mean) * (distance - mean); }) / static_cast<double>(count);

  SamplingDensity density;
  density.nearestMean = static_cast<float>(mean);
  density.nearestDeviation = static_cast<float>(std::sqrt(variance));
  if (count > measuredNeighbors)
    density.eighthMedian = median(distances.eighth);
  const bool isByDensity = unit == LengthUnit::density && density.eighthMedian > 0;
  density.spacing = isByDensity ? nearestToEighth * density.eighthMedian : density.nearestMean;
  if (!(density.spacing > 0) || !std::isfinite(density.spacing))
    throw InvalidInput("the points' spacing is " + std::to_string(density.spacing) +
                       ", beyond the range of single precision; scale the cloud towards unit size");
  return density;
}

double growthOfNeighbors(const std::vector<Eigen::Vector3f>& positions, const NeighborSearch& search,
                         Execution& execution)
{
  constexpr double onSurfaces = 2;
  constexpr std::size_t minPoints = 1024, asked = 64, factor = 8;
  if (positions.size() < minPoints)
    return onSurfaces;
  // Enough points to see past the noise, and far fewer than all.
  const std::size_t few = std::clamp<std::size_t>(positions.size() / 256, 16, 128);
  std::vector<float> growths(asked);
  forEach(execution, asked, 1, [&](std::size_t n) {
    Neighbors found;
    search.nearest(positions[n * positions.size() / asked], static_cast<int>(factor * few) + 1, found);
    const float ratio = found.squaredDistances.back() / found.squaredDistances[few];
    growths[n] = std::isfinite(ratio) && ratio > 1 ? 2 * std::log(static_cast<float>(factor)) / std::log(ratio) : 0;
  });
  return median(std::move(growths));
}

} // namespace pcl::mrf
