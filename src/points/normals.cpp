// SPDX-License-Identifier: BSD-3-Clause
#include "points/normals.h"

#include "options/validation.h"
#include "points/local_plane.h"
#include "points/pcl_search.h"

#ifdef _OPENMP // compiled here, because loading PCL's library of all features takes .03 s at every start
#include <omp.h>
#include <pcl/features/impl/normal_3d.hpp>
#include <pcl/features/impl/normal_3d_omp.hpp>
#endif
#include <pcl/features/normal_3d_omp.h>

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

namespace pcl::mrf {
namespace {

/// If a radius holds too few points for a plane, this number of nearest points is taken, the point itself included.
constexpr int minNeighbors = 12;

/// Max points in a neighborhood. One that stands for more consists of every fourth, sixteenth, ... point, to limit the
/// cost. maxUnderNoise is for noisy points, whose noise many points average; otherwise only the extent matters.
constexpr std::size_t maxToGrow = 32, maxUnderNoise = 128;

/// Points that the widest neighborhood stands for. Rings of a lidar lie up to some fifty points apart.
constexpr std::size_t widestNeighborhood = 1 << 14;

/// Points per piece of parallel work.
constexpr std::int64_t normalGrain = 1024;

/// The paper's max share of the smallest eigenvalue in the sum. Points above it, or farther than l̄ off, are noise.
constexpr double maxThirdEigenvalue = .1f;

/// Writes planes into the estimates.
struct Estimates {
  const NormalOptions& options;
  float spacing;
  NormalEstimates result;

  void set(std::size_t i, const Plane& plane)
  {
    result.normals[i] = plane.normal.cast<float>();
    if (options.noiseCriteria)
      result.isNoise[i] = plane.thirdShare > maxThirdEigenvalue || plane.distance > spacing ? 1 : 0;
  }
};

/// Number of neighbors that were found: those with a finite distance come first.
std::size_t numberFound(const float* squared, std::size_t k)
{
  return static_cast<std::size_t>(std::find_if(squared, squared + k, [](float s) { return !std::isfinite(s); }) -
                                  squared);
}

/// Distance of a point from the plane through the mean of its neighbors, with the given normal.
double distanceFromMean(const PointArrays& points, const NeighborSearch& search, std::size_t i, float radius,
                        const Eigen::Vector3d& normal, Neighbors& found)
{
  search.within(points.positions[i], radius, found);
  double sum = 0;
  for (const int neighbor : found.indices)
    sum += normal.dot((points.positions[neighbor] - points.positions[i]).cast<double>());
  return std::abs(sum) / static_cast<double>(found.indices.size());
}

/// Points per call of PCL's estimation, some tenths of a second. The run can be cancelled between calls.
constexpr std::size_t pointsPerPoll = 1 << 15;

/// Fits planes to the neighbors within one radius for all points, as in the paper, by pcl::NormalEstimationOMP.
void fitWithin(const PointArrays& points, const NeighborSearch& search, float radius, Estimates& estimates,
               Execution& execution)
{
  NormalEstimationOMP<PointXYZ, Normal> estimation(static_cast<unsigned int>(execution.threads()));
  const auto lent = std::make_shared<SearchForPcl>(search);
  estimation.setInputCloud(toPclCloud(points.positions));
  estimation.setSearchMethod(lent);
  estimation.setRadiusSearch(radius);
  for (std::size_t first = 0; first < points.size(); first += pointsPerPoll) {
    const auto indices = std::make_shared<Indices>(std::min(pointsPerPoll, points.size() - first));
    std::iota(indices->begin(), indices->end(), static_cast<index_t>(first));
    estimation.setIndices(indices);
    PointCloud<Normal> normals;
    estimation.compute(normals);
    lent->rethrow();
    execution.forRange(normals.size(), normalGrain, [&](std::size_t begin, std::size_t end) {
      Neighbors found;
      for (std::size_t n = begin; n < end; ++n) {
        const std::size_t i = first + n;
        const Eigen::Vector3f& position = points.positions[i];
        Plane plane;
        if (isFinite(normals[n])) {
          plane.normal = normals[n].getNormalVector3fMap().cast<double>();
          plane.thirdShare = normals[n].curvature;
          if (estimates.options.noiseCriteria) // PCL does not return the plane's distance from the origin
            plane.distance = distanceFromMean(points, search, i, radius, plane.normal, found);
        } else if (!estimates.options.noiseCriteria) {
          const auto number = static_cast<std::size_t>(search.nearest(position, minNeighbors, found));
          plane = fitPlane(points.positions, found.indices.data(), number, position);
        }
        estimates.set(i, plane);
      }
    });
    execution.poll();
  }
}

/// Number of points that a neighborhood needs under noise. Its radius is at least 4 σ, so that it is flat, and at least
/// 3.6 √(σ s), where the normal of a disc of points s apart is off by 5° (its variance is 4 σ² s² / π r⁴).
std::size_t sizeUnderNoise(double noise, double eighthDistance)
{
  if (!(noise > 0) || !(eighthDistance > 0))
    return nearestNeighbors;
  constexpr auto pi = static_cast<double>(EIGEN_PI);
  // Noise spreads points above and below the ball around the eight nearest, which holds this share of them.
  const double share = std::min(1.0, 4 / (3 * std::sqrt(2 * pi)) * eighthDistance / noise);
  const double squaredSpacing = share * pi / 8 * eighthDistance * eighthDistance;
  const double squaredRadius = std::max(16 * noise * noise, 13 * noise * std::sqrt(squaredSpacing));
  return static_cast<std::size_t>(std::clamp<double>(pi * squaredRadius / squaredSpacing, nearestNeighbors,
                                                     static_cast<double>(widestNeighborhood)));
}

/// A point that needs a larger neighborhood than its nearest points.
struct Growing {
  std::uint32_t point = 0;
  std::size_t size = 0; ///< points that the next neighborhood stands for
  Plane best;
};

/// Fits planes to the nearest points of each point. Points that need more are added to `growing`, in their order.
/// \param asked indices of the points; empty: all
void fitNearest(const PointArrays& points, const NeighborSearch& search, float noise, Estimates& estimates,
                const std::vector<std::uint32_t>& asked, std::vector<Growing>& growing, Execution& execution)
{
  constexpr std::size_t eighth = 8;
  std::vector<std::uint16_t> sizes(points.size(), 0);
  const auto fit = [&](std::size_t i, const auto* neighbors, const float* squared, std::size_t number) {
    const Plane plane = fitPlane(points.positions, neighbors, number, points.positions[i]);
    estimates.set(i, plane);
    const float own = points.deviations.empty() ? noise : points.deviations[i];
    std::size_t size = number > eighth ? sizeUnderNoise(own, std::sqrt(squared[eighth])) : 0;
    if (size <= nearestNeighbors)
      size = !plane.isSound() ? nearestNeighbors : plane.isFlat() ? 0 : 2 * nearestNeighbors;
    sizes[i] = static_cast<std::uint16_t>(size);
  };
  if (asked.empty())
    search.forEachPosition(points.positions, nearestNeighbors, NeighborSearch::Answer::indicesAndDistances, execution,
                           [&](const NeighborBatch& batch) {
                             for (std::size_t q = 0; q < batch.size; ++q) {
                               const float* squared = batch.squaredDistances + q * batch.k;
                               fit(batch.positions[q], batch.indices + q * batch.k, squared,
                                   numberFound(squared, batch.k));
                             }
                           });
  else
    execution.forRange(asked.size(), normalGrain, [&](std::size_t begin, std::size_t end) {
      Neighbors found;
      for (std::size_t n = begin; n < end; ++n) {
        const int number = search.nearest(points.positions[asked[n]], nearestNeighbors, found);
        fit(asked[n], found.indices.data(), found.squaredDistances.data(), static_cast<std::size_t>(number));
      }
    });
  for (std::uint32_t i = 0; i < sizes.size(); ++i)
    if (sizes[i] > 0)
      growing.push_back({i, sizes[i], {}});
}

/// Doubles neighborhoods until their planes are sound. If none of a point's planes is sound, it gets the one with the
/// largest ratio of second to first eigenvalue.
void grow(const PointArrays& points, const NeighborSearch& search, float noise, std::vector<Growing>& growing,
          Estimates& estimates, Execution& execution)
{
  const std::size_t max = noise > 0 || !points.deviations.empty() ? maxUnderNoise : maxToGrow;
  const std::size_t widest = std::min(widestNeighborhood, points.size());
  std::vector<Eigen::Vector3f> thinned;
  std::unique_ptr<NeighborSearch> thinnedSearch;
  for (std::size_t share = 1; !growing.empty() && share * nearestNeighbors / 2 < widest; share *= 4) {
    if (share > 1) {
      thinned.clear();
      for (std::size_t i = 0; i < points.size(); i += share)
        thinned.push_back(points.positions[i]);
      thinnedSearch = makePointBins();
      thinnedSearch->setPoints(thinned, execution);
    }
    const std::vector<Eigen::Vector3f>& positions = share > 1 ? thinned : points.positions;
    const NeighborSearch& own = share > 1 ? *thinnedSearch : search;
    execution.forRange(growing.size(), normalGrain, [&](std::size_t begin, std::size_t end) {
      Neighbors found;
      for (std::size_t n = begin; n < end; ++n) {
        Growing& now = growing[n];
        const Eigen::Vector3f& position = points.positions[now.point];
        for (; now.size <= share * max && !now.best.isSound(); now.size *= 2) {
          const auto number =
              static_cast<std::size_t>(own.nearest(position, static_cast<int>(now.size / share), found));
          const Plane plane = fitPlane(positions, found.indices.data(), number, position);
          if (plane.secondToFirst > now.best.secondToFirst)
            now.best = plane;
          if (now.size >= widest)
            break;
        }
        if (now.best.secondToFirst > 0)
          estimates.set(now.point, now.best);
      }
    });
    execution.poll();
    const auto isDone = [&](const Growing& now) { return now.best.isSound() || now.size >= widest; };
    growing.erase(std::remove_if(growing.begin(), growing.end(), isDone), growing.end());
  }
}

} // namespace

float resolvedRadius(const NormalOptions& options, float spacing)
{
  return options.radius == 0 && options.noiseCriteria ? 2.5f * spacing : options.radius;
}

NormalEstimates estimateNormals(const PointArrays& points, const NeighborSearch& search, float spacing,
                                const NormalOptions& options, Execution& execution, float noise,
                                const std::vector<std::uint32_t>& asked)
{
  validate(options);
  Estimates estimates{options, spacing, {}};
  estimates.result.normals.assign(points.size(), Eigen::Vector3f::Zero());
  estimates.result.isNoise.assign(points.size(), 0);
  const float radius = resolvedRadius(options, spacing);
  if (radius > 0) {
    fitWithin(points, search, radius, estimates, execution);
    return std::move(estimates.result);
  }
  std::vector<Growing> growing;
  fitNearest(points, search, noise, estimates, asked, growing, execution);
  execution.poll();
  grow(points, search, noise, growing, estimates, execution);
  return std::move(estimates.result);
}

} // namespace pcl::mrf
