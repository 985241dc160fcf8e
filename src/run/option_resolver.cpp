// SPDX-License-Identifier: BSD-3-Clause
#include "run/option_resolver.h"

#include "base/cell_hash.h"
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "options/noise_law.h"
#include "options/stage_timer.h"
#include "orientation/orientation.h"
#include "pilot/hold_out.h"
#include "points/normals.h"
#include "trimming/trimming.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace pcl::mrf {
namespace {

/// ℓ in voxels, at least, where it is automatic: positions that pull harder bend the field within a cell.
constexpr float minSmoothingOfFinest = .15f;

/// Under noise that neighbors share, voxels and edges in ℓ of the median point. Where points are close, weights make ℓ
/// shorter: of a room near objects have half of it.
constexpr double voxelsUnderNoise = .6;
constexpr float edgesUnderNoise = 1.1f;

/// Levels of more voxels are then solved near the surface only: without points it is no better for more.
constexpr std::int64_t denseUnderNoise = 800000;

void derive(float& length, float automatic)
{
  if (length == 0)
    length = automatic;
}

/// A surface should take at most this many faces of voxels for each point. Its area is taken for that of the cells of
/// voxelsPerCell voxels a side that hold at least pointsOfCell points: stray points do not count.
constexpr double facesPerPoint = 7, voxelsPerCell = 64;
constexpr int pointsOfCell = 8;

/// Automatic voxels become larger by at most this factor to that end.
constexpr float maxEnlargement = 2;

/// The smallest automatic voxel size. It is larger than usual where points lie unevenly, as in a lidar's revolution:
/// most of its surface lies where points are many times as far apart as the median spacing. \param side the usual voxel
/// size
float minVoxelSize(const std::vector<Eigen::Vector3f>& positions, float side)
{
  CellHash cells(boundingBox(positions).lower.cast<double>(), voxelsPerCell * side);
  std::vector<int> held;
  for (const Eigen::Vector3f& position : positions) {
    const std::uint32_t cell = cells.add(cells.cellOf(position));
    held.resize(cells.size());
    ++held[cell];
  }
  const auto covered = std::count_if(held.begin(), held.end(), [](int points) { return points >= pointsOfCell; });
  const double faces = static_cast<double>(covered - 1) * // a cloud within one cell is not spread
                       voxelsPerCell * voxelsPerCell;
  const double excess = faces / (facesPerPoint * static_cast<double>(positions.size()));
  return excess > 1 ? std::min(static_cast<float>(std::sqrt(excess)), maxEnlargement) * side : side;
}

/// Takes ℓ, and an automatic weight of the normals, from the data.
void chooseSmoothing(HoldOut& holdOut, ObservationOptions& observation, Report& report, Execution& execution)
{
  const StageTimer timer("smoothing length", report, execution);
  report.smoothing = holdOut.chooseSmoothing();
  observation.smoothing = static_cast<float>(report.noise.lengthening * report.smoothing.smoothing);
  // Normals estimated from the points are no evidence of their own, and held-out points had their part in them: on 6 of
  // 32 noisy scans these then weighed more, and the surface was .98 to 2.5 times as far from the truth.
  if (observation.gradientWeight == 0 && !report.normalsEstimated)
    observation.gradientWeight = holdOut.chooseGradientWeight(report.smoothing.smoothing, report.smoothing.noise);
}

/// Takes the coarsest voxels that the data bear, none finer than ℓ: what a band sees does not hold a field that is
/// smoother than its voxels.
void chooseResolution(HoldOut& holdOut, Options& options, Report& report, Execution& execution)
{
  const StageTimer timer("resolution", report, execution);
  report.resolution = holdOut.chooseResolution(options.observation.smoothing, options.observation.gradientWeight,
                                               report.smoothing.noise);
  options.multiscale.voxelSize =
      std::max(static_cast<float>(report.resolution.voxelSize), options.observation.smoothing);
}

} // namespace

bool choosesSmoothing(const Options& options)
{
  return options.observation.atPoints() && options.observation.smoothing == 0 &&
         constantNoise(options.observation) == 0;
}

bool mayAskForNoise(const Options& options)
{
  const ObservationOptions& observation = options.observation;
  return observation.atPoints() && observation.noiseModel != "none";
}

bool choosesResolution(const Options& options)
{
  return options.observation.atPoints() && options.multiscale.voxelSize == 0 &&
         options.multiscale.quality == Quality::normal;
}

OptionResolver::OptionResolver(const Options& requested, const SamplingDensity& density)
    : requested_(requested), options_(requested), spacing_(density.spacing)
{
  derive(options_.multiscale.voxelSize, spacingsPerVoxel(requested.multiscale.quality) * spacing_);
  derive(options_.observation.maxDistance,
         resolvedMaxDistance(requested.observation, spacing_, options_.multiscale.voxelSize));
  options_.orientation.neighborDistance = resolvedNeighborDistance(requested.orientation, density);
  options_.normals.radius = resolvedRadius(requested.normals, spacing_);
}

void OptionResolver::chooseByData(const OrientedPoints& points, const NeighborSearch& search, Report& report,
                                  Execution& execution)
{
  ObservationOptions& observation = options_.observation;
  if (!observation.atPoints())
    return;
  std::unique_ptr<HoldOut> holdOut;
  if (choosesSmoothing(requested_) || choosesResolution(requested_))
    holdOut = makeHoldOut(points, search, spacing_, options_.multiscale.voxelSize, options_.prior.kind, observation,
                          execution);
  if (choosesSmoothing(requested_))
    chooseSmoothing(*holdOut, observation, report, execution);
  observation.smoothing = resolvedSmoothing(observation, spacing_);
  observation.gradientWeight = resolvedGradientWeight(observation);
  if (choosesResolution(requested_)) {
    const float min = minVoxelSize(points.positions, options_.multiscale.voxelSize);
    chooseResolution(*holdOut, options_, report, execution);
    options_.multiscale.voxelSize = std::max(options_.multiscale.voxelSize, min);
    observation.maxDistance = resolvedMaxDistance(requested_.observation, spacing_, options_.multiscale.voxelSize);
  }
  if (requested_.observation.smoothing == 0)
    observation.smoothing = std::max(observation.smoothing, minSmoothingOfFinest * options_.multiscale.voxelSize);
}

void OptionResolver::knowNoise(double deviation)
{
  requested_.observation.noise = options_.observation.noise = static_cast<float>(deviation);
}

void OptionResolver::followNoise(const NoiseModel& noise)
{
  ObservationOptions& observation = options_.observation;
  MultiscaleOptions& multiscale = options_.multiscale;
  observation.smoothing = static_cast<float>(noise.smoothing);
  observation.gradientWeight = resolvedGradientWeight(observation);
  if (requested_.multiscale.voxelSize == 0) {
    const float quality = spacingsPerVoxel(multiscale.quality) / spacingsPerVoxel(Quality::normal);
    multiscale.voxelSize = quality * static_cast<float>(voxelsUnderNoise * noise.smoothing);
    observation.maxDistance = resolvedMaxDistance(requested_.observation, spacing_, multiscale.voxelSize);
  }
  derive(options_.remesher.targetEdge, edgesUnderNoise * static_cast<float>(noise.smoothing));
  if (multiscale.denseVoxels == 0)
    multiscale.denseVoxels = denseUnderNoise;
}

void OptionResolver::limitTrimming(float diagonal)
{
  // In this order: an automatic gap follows a hole that was given.
  options_.trimming.maxGap = resolvedMaxGap(requested_.trimming, diagonal);
  options_.trimming.maxHole = resolvedMaxHole(requested_.trimming, diagonal);
}

ResolvedOptions OptionResolver::resolved() const
{
  Options options = options_;
  options.multiscale.padding = resolvedPadding(options.multiscale);
  return ResolvedOptions(options, requested_);
}

} // namespace pcl::mrf
