// SPDX-License-Identifier: BSD-3-Clause
#include "observation/observation.h"

#include "base/loops.h"
#include "observation/point_observation.h"
#include "options/confidence.h"
#include "options/validation.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl::mrf {
namespace {

/// Planes of the lattice per piece of parallel work.
constexpr int slabPlanes = 8;

/// Lowers the squared distances (in voxels) of the planes [zBegin, zEnd) to those of one point within `reach` voxels.
void splat(const Eigen::Vector3d& center, double reach, const GridSize& size, int zBegin, int zEnd, float* squared)
{
  // Clamped first: a reach of any size may not overflow an index.
  const auto lower = [&](double c, double first) { return static_cast<int>(std::max(std::ceil(c - reach), first)); };
  const auto upper = [&](double c, double last) { return static_cast<int>(std::min(std::floor(c + reach), last)); };
  const int x0 = lower(center.x(), 0), x1 = upper(center.x(), size.x - 1);
  const int y0 = lower(center.y(), 0), y1 = upper(center.y(), size.y - 1);
  const int z0 = lower(center.z(), zBegin), z1 = upper(center.z(), zEnd - 1);
  for (int z = z0; z <= z1; ++z)
    for (int y = y0; y <= y1; ++y) {
      const double dz = z - center.z(), dy = y - center.y();
      const auto across = static_cast<float>(dz * dz + dy * dy);
      float* row = squared + size.index(0, y, z - zBegin);
      for (int x = x0; x <= x1; ++x) {
        const float dx = static_cast<float>(x - center.x());
        row[x] = std::min(row[x], across + dx * dx);
      }
    }
}

struct ObservedVoxels {
  std::vector<std::int64_t> voxels;
  std::vector<float> nearest; ///< distance to the nearest point / dEmax, [0, 1)
};

/// All voxels closer than maxDistance to a point. They are marked around each point: empty space takes no query.
ObservedVoxels findObserved(const OrientedPoints& points, const Lattice& lattice, float maxDistance,
                            Execution& execution)
{
  const GridSize size = lattice.size;
  const double reach = maxDistance / lattice.spacing;
  const auto limit = static_cast<float>(reach * reach);
  const int slabs = (size.z + slabPlanes - 1) / slabPlanes;
  std::vector<ObservedVoxels> found(slabs);

  forEach<int>(execution, slabs, 1, [&](int slab) {
    const int zBegin = slab * slabPlanes, zEnd = std::min(zBegin + slabPlanes, size.z);
    std::vector<float> squared(size.planeCount() * (zEnd - zBegin), limit);
    for (const Eigen::Vector3f& position : points.positions)
      splat(lattice.toVoxels(position), reach, size, zBegin, zEnd, squared.data());

    ObservedVoxels& mine = found[slab];
    const std::int64_t offset = size.index(0, 0, zBegin);
    for (std::size_t v = 0; v < squared.size(); ++v)
      if (squared[v] < limit) {
        mine.voxels.push_back(offset + static_cast<std::int64_t>(v));
        mine.nearest.push_back(std::sqrt(squared[v] / limit));
      }
  });

  ObservedVoxels all;
  for (const ObservedVoxels& piece : found) {
    all.voxels.insert(all.voxels.end(), piece.voxels.begin(), piece.voxels.end());
    all.nearest.insert(all.nearest.end(), piece.nearest.begin(), piece.nearest.end());
  }
  return all;
}

float median(std::vector<float>& values)
{
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1)
    return *middle;
  return .5f * (*middle + *std::max_element(values.begin(), middle));
}

/// Estimates d° at one position from the points found near it.
class Estimator {
public:
  Estimator(const OrientedPoints& points, ObservationKind kind, float spacing)
      : points_(points), kind_(kind), halfInverseVariance_(.5f / (.75f * spacing * .75f * spacing))
  {}

  float operator()(const Eigen::Vector3f& x, const std::vector<int>& neighbors)
  {
    projected_.clear();
    for (const int j : neighbors)
      projected_.push_back(normal(j).dot(x - position(j)));

    switch (kind_) {
    case ObservationKind::points: // excluded by the precondition of observe
    case ObservationKind::nearest:
      return projected_.front();
    case ObservationKind::median:
      return median(projected_);
    case ObservationKind::mean:
      weights_.clear();
      for (const int j : neighbors)
        weights_.push_back(confidence(j));
      break;
    case ObservationKind::plane:
      setTangentialWeights(x, neighbors);
      break;
    case ObservationKind::trapezoid:
      setTangentialWeights(x, neighbors);
      turnNormalsToMean(x, neighbors);
      break;
    }
    float sum = 0, total = 0;
    for (std::size_t j = 0; j < projected_.size(); ++j) {
      sum += weights_[j] * projected_[j];
      total += weights_[j];
    }
    return sum / total;
  }

private:
  const Eigen::Vector3f& position(int j) const { return points_.positions[j]; }
  const Eigen::Vector3f& normal(int j) const { return points_.normals[j]; }
  float confidence(int j) const { return points_.confidence(j); }

  /// Weights are relative to the largest Gaussian, because far from the surface all of them would underflow.
  void setTangentialWeights(const Eigen::Vector3f& x, const std::vector<int>& neighbors)
  {
    weights_.clear();
    float closest = std::numeric_limits<float>::max();
    for (std::size_t j = 0; j < neighbors.size(); ++j) {
      const float squared = (x - position(neighbors[j])).squaredNorm() - projected_[j] * projected_[j];
      weights_.push_back(squared);
      closest = std::min(closest, squared);
    }
    for (std::size_t j = 0; j < neighbors.size(); ++j)
      weights_[j] = confidence(neighbors[j]) * std::exp((closest - weights_[j]) * halfInverseVariance_);
  }

  /// On a circle, the mean of a chord's end tangents is along it: ½ (n_j + n̄) removes the curvature's share of δ_j.
  void turnNormalsToMean(const Eigen::Vector3f& x, const std::vector<int>& neighbors)
  {
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (std::size_t j = 0; j < neighbors.size(); ++j)
      mean += weights_[j] * normal(neighbors[j]);
    mean.normalize();
    for (std::size_t j = 0; j < neighbors.size(); ++j)
      projected_[j] = .5f * (normal(neighbors[j]) + mean).dot(x - position(neighbors[j]));
  }

  const OrientedPoints& points_;
  ObservationKind kind_;
  float halfInverseVariance_;
  std::vector<float> projected_, weights_;
};

} // namespace

float resolvedMaxDistance(const ObservationOptions& options, float spacing, float voxelSize)
{
  if (options.maxDistance > 0)
    return options.maxDistance;
  const bool isPapers = options.kind == ObservationKind::median || options.kind == ObservationKind::mean ||
                        options.kind == ObservationKind::nearest;
  const float reach = (isPapers ? 3.f : 3.25f) * spacing;
  return !options.atPoints() ? std::max(reach, 1.5f * voxelSize) : reach;
}

float resolvedSmoothing(const ObservationOptions& options, float spacing)
{
  if (options.smoothing > 0)
    return options.smoothing;
  const double noise = static_cast<double>(options.noise);
  const double forStrong = 1.7 * spacing * std::pow(noise / spacing, .6); // src/method.md, "Noise"
  return static_cast<float>(std::max(forStrong, smoothingForNoise(noise, spacing)));
}

Observation observe(const OrientedPoints& points, const NeighborSearch& search, const Lattice& lattice, float spacing,
                    float maxDistance, const ObservationOptions& options, Execution& execution)
{
  validate(options);
  ObservedVoxels observed = findObserved(points, lattice, maxDistance, execution);

  Observation result;
  result.lattice = lattice;
  result.voxels = std::move(observed.voxels);
  result.distances.resize(result.voxels.size());
  result.confidences.resize(result.voxels.size());

  const int neighbors = options.kind == ObservationKind::nearest ? 1 : options.neighbors;
  execution.forRange(result.voxels.size(), 4096, [&](std::size_t begin, std::size_t end) {
    Neighbors found;
    Estimator estimator(points, options.kind, spacing);
    for (std::size_t v = begin; v < end; ++v) {
      const Eigen::Array3i voxel = lattice.size.voxel(result.voxels[v]);
      const Eigen::Vector3f x = lattice.position(voxel.x(), voxel.y(), voxel.z());
      search.nearest(x, neighbors, found);
      result.distances[v] = estimator(x, found.indices);

      const float t = observed.nearest[v];
      float confidence = confidenceAt(t, options.confidenceShape);
      if (!points.confidences.empty()) {
        float mean = 0;
        for (const int j : found.indices)
          mean += points.confidence(j);
        confidence *= mean / static_cast<float>(found.indices.size());
      }
      result.confidences[v] = confidence;
    }
  });
  return result;
}

} // namespace pcl::mrf
