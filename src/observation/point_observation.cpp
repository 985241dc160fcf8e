// SPDX-License-Identifier: BSD-3-Clause
#include "observation/point_observation.h"

#include "base/floor.h"
#include "base/loops.h"
#include "base/spatial_sort.h"
#include "field/prior.h"
#include "observation/observation.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace pcl {
namespace mrf {
namespace {

/// The weighted mean of samples.
class SampleMean {
public:
  void add(const PointSample& sample)
  {
    position_ += sample.weight * sample.position.cast<double>();
    normal_ += sample.weight * sample.normal.cast<double>();
    weight_ += sample.weight;
  }

  PointSample sample() const
  {
    return {(position_ / weight_).cast<float>(), (normal_ / weight_).cast<float>(), static_cast<float>(weight_)};
  }

private:
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero(), normal_ = Eigen::Vector3d::Zero();
  double weight_ = 0;
};

/// Samples per piece of parallel work.
constexpr std::size_t sampleGrain = 1 << 14;

Eigen::Array3i cubeOf(const PointSample& sample, float side)
{
  const Eigen::Vector3f position = sample.position / side;
  return {floorOf(position.x()), floorOf(position.y()), floorOf(position.z())};
}

struct CubeBounds {
  Eigen::Array3i lower = Eigen::Array3i::Constant(std::numeric_limits<int>::max()), upper = -lower;

  void include(const CubeBounds& other)
  {
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
};

/// Of the cubes that samples lie in.
CubeBounds bounds(const std::vector<PointSample>& samples, float side, Execution& execution)
{
  CubeBounds result;
  for (const CubeBounds& piece : partsOf<CubeBounds>(execution, samples.size(), sampleGrain,
                                                     [&](CubeBounds&own, std::size_t begin, std::size_t end) {
                                                       for (std::size_t s = begin; s < end; ++s) {
                                                         const Eigen::Array3i cube = cubeOf(samples[s], side);
                                                         own.include({cube, cube});
                                                       }
                                                     }))
    result.include(piece);
  return result;
}

/// Samples in the order of the cubes they lie in: z, then y, then x; those of a cube in the order given.
struct CubeOrder {
  SortKeys keys; ///< the same for the same cube
  std::vector<std::uint32_t> order;

  CubeOrder(const std::vector<PointSample>& samples, float side, Execution& execution)
      : keys(samples.size()), order(samples.size())
  {
    if (samples.empty())
      return;
    const CubeBounds range = bounds(samples, side, execution);
    const Eigen::Array<std::uint64_t, 3, 1> size = (range.upper - range.lower + 1).cast<std::uint64_t>();
    forEach(execution, samples.size(), sampleGrain, [&](std::size_t s) {
      const Eigen::Array<std::uint64_t, 3, 1> cube = (cubeOf(samples[s], side) - range.lower).cast<std::uint64_t>();
      keys[s] = cube.x() + size.x() * (cube.y() + size.y() * cube.z());
      order[s] = static_cast<std::uint32_t>(s);
    });
    sortByKey(keys, order, execution);
  }
};

} // namespace

std::vector<PointSample> toSamples(const OrientedPoints& points, const Lattice& lattice, float spacing,
                                   Execution& execution)
{
  std::vector<PointSample> samples(points.size());
  forEach(execution, samples.size(), sampleGrain, [&](std::size_t i) {
    const float mass = points.confidence(i) * relativePrecision(points.deviation(i), points.typicalDeviation) *
                       (points.spacings.empty() ? 1 : relativeArea(points.spacings[i], spacing));
    samples[i] = {lattice.toVoxels(points.positions[i]).cast<float>(), points.normals[i], mass};
  });
  return samples;
}

std::vector<PointSample> merge(const std::vector<PointSample>& samples, float side, Execution& execution)
{
  const CubeOrder cubes(samples, side, execution);
  const SortKeys& keys = cubes.keys;
  const auto isFirst = [&](std::size_t n) { return n == 0 || keys[n] != keys[n - 1]; };
  // Where the merged samples of each piece of work begin: those whose cube begins in it.
  const std::size_t pieces = (samples.size() + sampleGrain - 1) / sampleGrain;
  std::vector<std::size_t> begins(pieces + 1, 0);
  const auto forPieces = [&](const auto& body) {
    execution.forRange(samples.size(), sampleGrain, [&](std::int64_t begin, std::int64_t end) {
      body(static_cast<std::size_t>(begin) / sampleGrain, static_cast<std::size_t>(begin),
           static_cast<std::size_t>(end));
    });
  };
  forPieces([&](std::size_t piece, std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      begins[piece + 1] += isFirst(n) ? 1 : 0;
  });
  std::partial_sum(begins.begin(), begins.end(), begins.begin());

  std::vector<PointSample> merged(begins.back());
  forPieces([&](std::size_t piece, std::size_t begin, std::size_t end) {
    std::size_t out = begins[piece];
    for (std::size_t n = begin; n < end; ++n) {
      if (!isFirst(n))
        continue;
      const PointSample& first = samples[cubes.order[n]];
      if (n + 1 == keys.size() || keys[n + 1] != keys[n]) {
        merged[out++] = first;
        continue;
      }
      SampleMean mean;
      for (std::size_t m = n; m < keys.size() && keys[m] == keys[n]; ++m)
        mean.add(samples[cubes.order[m]]);
      merged[out] = mean.sample();
      // Rounding must not move the mean into the next cube.
      const Eigen::Array3f lower = side * cubeOf(first, side).cast<float>();
      for (int axis = 0; axis < 3; ++axis)
        merged[out].position[axis] =
            std::clamp(merged[out].position[axis], lower[axis], std::nextafter(lower[axis] + side, lower[axis]));
      ++out;
    }
  });
  return merged;
}

std::vector<PointSample> sortedByCells(const std::vector<PointSample>& samples, Execution& execution)
{
  const std::vector<std::uint32_t> order = CubeOrder(samples, 1, execution).order;
  std::vector<PointSample> sorted(samples.size());
  forEach(execution, samples.size(), sampleGrain, [&](std::size_t n) { sorted[n] = samples[order[n]]; });
  return sorted;
}

PointWeights pointWeights(Prior prior, double smoothing, double spacing, double voxelSize, double gradientWeight)
{
  const double pointsPerFace = std::pow(voxelSize / spacing, 2) / 4;
  const double tau = pointsPerFace * std::pow(smoothing / voxelSize, 2 * order(prior) - 1);
  return {1 / tau, gradientWeight * std::pow(smoothing / voxelSize, 2) / tau};
}

double levelSmoothing(const ObservationOptions& options, float spacing, double voxelSize, bool isFinest)
{
  const double smoothing = resolvedSmoothing(options, spacing);
  return isFinest ? smoothing : std::max(smoothing, minSmoothing * voxelSize);
}

PointWeights levelWeights(Prior prior, const ObservationOptions& options, float spacing, double voxelSize,
                          bool isFinest)
{
  return pointWeights(prior, levelSmoothing(options, spacing, voxelSize, isFinest), spacing, voxelSize,
                      resolvedGradientWeight(options));
}

double shortestSmoothing(double spacing)
{
  return .5 * spacing;
}

double smoothingForNoise(double noise, double spacing)
{
  return std::max(shortestSmoothing(spacing), 1.5 * spacing * std::pow(noise / spacing, .4));
}

} // namespace mrf
} // namespace pcl
