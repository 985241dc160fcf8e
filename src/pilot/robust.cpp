// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/robust.h"

#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "base/select_values.h"
#include "field/field_sampler.h"
#include "levels/multiscale.h"
#include "observation/point_observation.h"
#include "points/reach.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

/// One solve: the scale c of the weights after it, in standard deviations of the residuals, and ℓ in voxels. In the
/// first solve all points count; in the last one only those within the noise count, and the field follows details.
struct Step {
  float scale, smoothing;
};
constexpr Step steps[] = {{64, 1}, {16, .7f}, {8, .5f}, {6, .3f}, {6, .2f}};

constexpr float minWeight = 1e-4f;

/// Neighbors are in one component if their distance is at most this many local spacings of both.
constexpr float componentReach = 3;
constexpr int componentNeighbors = 16;
/// A component with fewer points, or a smaller share of them, has only minWeight in the field: alone in free space, it
/// would get a bubble of its own even at a low weight. True pieces behind occluders are lost by that.
constexpr double minComponentPoints = 50, minComponentShare = .0015;

/// Flags of the points in small components. The largest component never counts as small.
std::vector<std::uint8_t> inSmallComponents(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                            Execution& execution)
{
  if (points.size() == 0)
    return {};
  const Reach reach =
      points.spacings.empty() ? Reach(componentReach * spacing) : Reach(points.spacings, componentReach);
  DisjointSets joined(points.size());
  search.forEachPosition(points.positions, componentNeighbors + 1, NeighborSearch::Answer::indicesAndDistances,
                         execution, [&](const NeighborBatch& batch) {
                           for (std::size_t q = 0; q < batch.size; ++q)
                             for (std::size_t n = q * batch.k; n < (q + 1) * batch.k; ++n)
                               if (reach.joins(batch.positions[q], batch.indices[n], batch.squaredDistances[n]))
                                 joined.join(static_cast<std::uint32_t>(batch.positions[q]),
                                             static_cast<std::uint32_t>(batch.indices[n]));
                         });
  const auto sizes = joined.sizes(execution);
  const double largest = *std::max_element(sizes.begin(), sizes.end());
  const double min =
      std::min(largest, std::max(minComponentPoints, minComponentShare * static_cast<double>(points.size())));
  std::vector<std::uint8_t> result(points.size());
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = sizes[joined.find(static_cast<std::uint32_t>(i))] < min ? 1 : 0;
  return result;
}

/// First-order distances |d|/‖∇d‖ of the points from the zero level.
std::vector<float> residuals(const std::vector<Eigen::Vector3f>& positions, const DistanceField& field,
                             Execution& execution)
{
  std::vector<float> result(positions.size());
  forEach(execution, positions.size(), 4096, [&](std::size_t i) {
    result[i] =
        std::abs(field.sampleDistance(positions[i])) / slopeWithin(robustSlope, field.sampleGradient(positions[i]));
  });
  return result;
}

/// Standard deviation of the Gaussian whose absolute values have the same median as these.
float deviation(const std::vector<float>& absolute)
{
  return static_cast<float>(deviationPerMedian) * median(absolute);
}

} // namespace

std::vector<std::uint8_t> keptByField(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      double voxelSize, std::size_t maxMemory, Execution& execution)
{
  const auto side = static_cast<float>(2 * voxelSize);
  Options options;
  options.prior.kind = Prior::thinPlate;
  options.multiscale.voxelSize = side;
  options.multiscale.maxMemory = maxMemory;

  OrientedPoints weighted = points;
  weighted.confidences.resize(points.size());
  const std::vector<std::uint8_t> isSmall = inSmallComponents(points, search, spacing, execution);
  std::vector<float> errors(points.size(), 0), weights(points.size(), 1);
  for (const Step& step : steps) {
    options.observation.smoothing = step.smoothing * side;
    for (std::size_t i = 0; i < points.size(); ++i)
      weighted.confidences[i] = (isSmall[i] ? minWeight : weights[i]) * points.confidence(i);
    const DistanceField field =
        regularize({&weighted, &search, boundingBox(points.positions)}, spacing, options, execution).field;
    errors = residuals(points.positions, field, execution);
    // Residuals below a tenth of a voxel are errors of the grid, not of the points.
    const float limit = step.scale * std::max(deviation(errors), .1f * side);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float ratio = limit * limit / (limit * limit + errors[i] * errors[i]);
      weights[i] = std::max(ratio * ratio, minWeight);
    }
  }
  // On three clean scans, a limit of half a voxel drops details; one of .7 keeps clusters near the surface.
  const float limit = std::max(5 * deviation(errors), .55f * side);
  std::vector<std::uint8_t> keep(points.size());
  std::transform(errors.begin(), errors.end(), keep.begin(),
                 [&](float error) { return static_cast<std::uint8_t>(error <= limit ? 1 : 0); });
  return keep;
}

} // namespace pcl::mrf
