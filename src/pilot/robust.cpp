// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/robust.h"

#include "base/select_values.h"
#include "observation/point_observation.h"

#include <pcl/surface/mrf/multiscale.h>

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// One solve: the scale c of the weights after it, in standard deviations of the residuals, and ℓ in voxels. At first
/// all points count and clusters get no bubble of their own; at last those within the noise do, and details are
/// followed.
struct Step {
  float scale, smoothing;
};
constexpr Step steps[] = {{64, 1}, {16, .7f}, {8, .5f}, {6, .3f}, {6, .2f}};

constexpr float minSlope = .3f; ///< of the field, which is 1 but for noise and creases
constexpr float minWeight = 1e-4f;

/// First-order distances of the points from the zero level.
std::vector<float> residuals(const std::vector<Eigen::Vector3f>& positions, const DistanceField& field,
                             Execution& execution)
{
  std::vector<float> result(positions.size());
  execution.forRange(static_cast<std::int64_t>(positions.size()), 4096, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      result[i] = std::abs(field.sampleDistance(positions[i])) /
                  std::clamp(field.sampleGradient(positions[i]).norm(), minSlope, 1.f);
  });
  return result;
}

/// Standard deviation of a Gaussian with the median of these absolute values.
float deviation(const std::vector<float>& absolute)
{
  return 1.4826f * median(absolute);
}

} // namespace

std::vector<std::uint8_t> keptByField(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      double voxelSize, std::size_t maxMemory, Execution& execution)
{
  const auto side = static_cast<float>(2 * voxelSize);
  PriorOptions prior;
  prior.kind = Prior::thinPlate;
  ObservationOptions observation;
  MultiscaleOptions multiscale;
  multiscale.voxelSize = side;
  multiscale.maxMemory = maxMemory;
  const BoundingBox box = boundingBox(points.positions);

  OrientedPoints weighted = points;
  weighted.confidences.resize(points.size());
  std::vector<float> errors(points.size(), 0), weights(points.size(), 1);
  for (const Step& step : steps) {
    observation.smoothing = step.smoothing * side;
    for (std::size_t i = 0; i < points.size(); ++i)
      weighted.confidences[i] = weights[i] * points.confidence(i);
    const DistanceField field =
        regularize(weighted, search, spacing, box, observation, prior, {}, multiscale, execution).field;
    errors = residuals(points.positions, field, execution);
    // Beneath a tenth of a voxel residuals are the grid's, not the points'.
    const float limit = step.scale * std::max(deviation(errors), .1f * side);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float ratio = limit * limit / (limit * limit + errors[i] * errors[i]);
      weights[i] = std::max(ratio * ratio, minWeight);
    }
  }
  // Measured on three clean scans: half a voxel drops details, .7 keeps clusters near the surface.
  const float limit = std::max(5 * deviation(errors), .55f * side);
  std::vector<std::uint8_t> keep(points.size());
  std::transform(errors.begin(), errors.end(), keep.begin(),
                 [&](float error) { return static_cast<std::uint8_t>(error <= limit ? 1 : 0); });
  return keep;
}

} // namespace mrf
} // namespace pcl
