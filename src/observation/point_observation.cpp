// SPDX-License-Identifier: BSD-3-Clause
#include "observation/point_observation.h"

#include "base/loops.h"
#include "base/spatial_sort.h"
#include "field/prior.h"
#include "observation/observation.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numeric>

namespace pcl::mrf {
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

/// Voxel side, in spacings of the points, above which the finest level merges its samples as well.
constexpr float mergedFrom = 10;

/// Samples per piece of parallel work.
constexpr std::size_t sampleGrain = 1 << 14;

Eigen::Array3i cubeOf(const PointSample& sample, float side)
{
  const Eigen::Vector3f position = sample.position / side;
  return {floorOf(position.x()), floorOf(position.y()), floorOf(position.z())};
}

/// Min distance of a sample from the last voxel centers of a coarser lattice, voxels. Beyond them a cell has no voxels.
constexpr float fromBorder = 1e-3f;

/// Makes samples of points one by one: all samples of a large cloud together take more memory than its points.
auto samplesOf(const PointsOnLattice& seen)
{
  return [&seen](std::size_t n) -> PointSample {
    const auto& [points, lattice, spacing, axes, chosen, firstPlane] = seen;
    const std::size_t i = chosen ? (*chosen)[n] : n;
    const float mass = points.confidence(i) * relativePrecision(points.deviation(i), points.typicalDeviation) *
                       (points.spacings.empty() ? 1 : relativeArea(points.spacings[i], spacing));
    Eigen::Vector3f position = lattice.toVoxels(axes.toStored(points.positions[i])).cast<float>();
    position.z() -= static_cast<float>(firstPlane);
    return {position, axes.toStored(points.normals[i]), mass};
  };
}

/// Bounding box of the cubes in which samples lie.
template <typename SampleAt>
Eigen::AlignedBox3i bounds(std::size_t count, const SampleAt& sampleAt, float side, Execution& execution)
{
  using Box = Eigen::AlignedBox3i;
  Box result;
  for (const Box& piece : partsOf<Box>(execution, count, sampleGrain, [&](Box&own, std::size_t begin, std::size_t end) {
         for (std::size_t s = begin; s < end; ++s)
           own.extend(cubeOf(sampleAt(s), side).matrix());
       }))
    result.extend(piece);
  return result;
}

/// The order of samples by the cubes in which they lie: z, then y, then x. Samples of one cube keep their order.
struct CubeOrder {
  SortKeys keys; ///< the same for the same cube
  std::vector<std::uint32_t> order;

  template <typename SampleAt>
  CubeOrder(std::size_t count, const SampleAt& sampleAt, float side, Execution& execution) : keys(count), order(count)
  {
    if (count == 0)
      return;
    const Eigen::AlignedBox3i range = bounds(count, sampleAt, side, execution);
    const Eigen::Array<std::uint64_t, 3, 1> size = (range.sizes().array() + 1).cast<std::uint64_t>();
    forEach(execution, count, sampleGrain, [&](std::size_t s) {
      const Eigen::Array3i own = cubeOf(sampleAt(s), side) - range.min().array();
      const Eigen::Array<std::uint64_t, 3, 1> cube = own.cast<std::uint64_t>();
      keys[s] = cube.x() + size.x() * (cube.y() + size.y() * cube.z());
      order[s] = static_cast<std::uint32_t>(s);
    });
    sortByKey(keys, order, execution);
  }
};

template <typename SampleAt>
std::vector<PointSample> mergedSamples(std::size_t count, const SampleAt& sampleAt, float side, Execution& execution)
{
  const CubeOrder cubes(count, sampleAt, side, execution);
  const SortKeys& keys = cubes.keys;
  const auto isFirst = [&](std::size_t n) { return n == 0 || keys[n] != keys[n - 1]; };
  // Where the merged samples of each piece of work begin in the result. A piece merges the cubes that begin in it.
  const std::size_t pieces = (count + sampleGrain - 1) / sampleGrain;
  std::vector<std::size_t> begins(pieces + 1, 0);
  const auto forPieces = [&](const auto& body) {
    execution.forRange(count, sampleGrain, [&](std::int64_t begin, std::int64_t end) {
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
      const PointSample first = sampleAt(cubes.order[n]);
      if (n + 1 == keys.size() || keys[n + 1] != keys[n]) {
        merged[out++] = first;
        continue;
      }
      SampleMean mean;
      for (std::size_t m = n; m < keys.size() && keys[m] == keys[n]; ++m)
        mean.add(sampleAt(cubes.order[m]));
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

template <typename SampleAt>
std::vector<PointSample> samplesByCells(std::size_t count, const SampleAt& sampleAt, Execution& execution)
{
  const std::vector<std::uint32_t> order = CubeOrder(count, sampleAt, 1, execution).order;
  std::vector<PointSample> sorted(count);
  forEach(execution, count, sampleGrain, [&](std::size_t n) { sorted[n] = sampleAt(order[n]); });
  return sorted;
}

auto placeIn(const std::vector<PointSample>& samples)
{
  return [&samples](std::size_t s) -> const PointSample& { return samples[s]; };
}

/// Converts samples of a lattice to voxels of a coarser one, one by one.
template <typename SampleAt>
auto onCoarser(const SampleAt& sampleAt, const Lattice& fine, const Lattice& coarse)
{
  const auto ratio = static_cast<float>(fine.spacing / coarse.spacing);
  const Eigen::Vector3f shift = ((fine.origin - coarse.origin) / coarse.spacing).cast<float>();
  const Eigen::Array3f last =
      Eigen::Array3i(coarse.size.x, coarse.size.y, coarse.size.z).cast<float>() - (1 + fromBorder);
  return [=](std::size_t s) -> PointSample {
    const PointSample& sample = sampleAt(s);
    const Eigen::Vector3f position = (ratio * sample.position + shift).array().min(last).max(0).matrix();
    return {position, sample.normal, sample.weight};
  };
}

/// Merged samples. Those of a large cloud are merged piece by piece first, because the sorted order of all samples
/// takes as much memory as the points.
template <typename SampleAt>
std::vector<PointSample> mergedInPieces(std::size_t count, const SampleAt& sampleAt, float side, Execution& execution)
{
  constexpr std::size_t pieceSize = std::size_t{1} << 22;
  if (count <= pieceSize)
    return mergedSamples(count, sampleAt, side, execution);
  std::vector<PointSample> parts;
  for (std::size_t begin = 0; begin < count; begin += pieceSize) {
    const std::vector<PointSample> piece = mergedSamples(
        std::min(pieceSize, count - begin), [&](std::size_t s) -> PointSample { return sampleAt(begin + s); }, side,
        execution);
    parts.insert(parts.end(), piece.begin(), piece.end());
  }
  return mergedSamples(parts.size(), placeIn(parts), side, execution);
}

} // namespace

std::vector<PointSample> toSamples(const PointsOnLattice& seen, Execution& execution)
{
  const auto sampleAt = samplesOf(seen);
  std::vector<PointSample> samples(seen.size());
  forEach(execution, samples.size(), sampleGrain, [&](std::size_t n) { samples[n] = sampleAt(n); });
  return samples;
}

std::vector<PointSample> toMergedSamples(const PointsOnLattice& seen, float side, Execution& execution)
{
  return mergedInPieces(seen.size(), samplesOf(seen), side, execution);
}

std::vector<PointSample> samplesOfFinest(const PointsOnLattice& seen, Execution& execution)
{
  return seen.lattice.spacing > mergedFrom * seen.spacing ? toMergedSamples(seen, 1, execution)
                                                          : samplesByCells(seen.size(), samplesOf(seen), execution);
}

std::vector<PointSample> merge(const std::vector<PointSample>& samples, float side, Execution& execution)
{
  return mergedSamples(samples.size(), placeIn(samples), side, execution);
}

std::vector<PointSample> coarsened(const std::vector<PointSample>& samples, const Lattice& fine, const Lattice& coarse,
                                   float side, Execution& execution)
{
  return mergedSamples(samples.size(), onCoarser(placeIn(samples), fine, coarse), side, execution);
}

std::vector<PointSample> toCoarsenedSamples(const PointsOnLattice& seen, const Lattice& coarse, float side,
                                            Execution& execution)
{
  return mergedInPieces(seen.size(), onCoarser(samplesOf(seen), seen.lattice, coarse), side, execution);
}

std::vector<PointSample> sortedByCells(const std::vector<PointSample>& samples, Execution& execution)
{
  return samplesByCells(samples.size(), placeIn(samples), execution);
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

} // namespace pcl::mrf
