// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/uncertainty_evidence.h"

#include "base/loops.h"
#include "field/field_sampler.h"
#include "levels/level_memory.h"
#include "levels/multiscale.h"
#include "mesh/vertex_fields.h"
#include "solver/grids.h"
#include "uncertainty/plausible_surfaces.h"
#include "uncertainty/posterior_draws.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace pcl::mrf {
namespace {

/// Voxels of the grid of the draws: a number per point, within limits. Eight draws and a solution then take a third of
/// the time of the rest of a run.
constexpr double voxelsPerPoint = 4, minVoxels = 1 << 15, maxVoxels = 1 << 18;

/// Steps of conjugate gradients for a draw.
constexpr int stepsOfDraw = 3;

constexpr std::int64_t evidenceGrain = 1024;

/// The finest level's voxel size, or larger if the number of voxels would exceed its limit.
float voxelSizeOfDraws(const BoundingBox& volume, std::size_t points, const MultiscaleOptions& options)
{
  const double max = std::clamp(voxelsPerPoint * static_cast<double>(points), minVoxels, maxVoxels);
  const Eigen::Array3d extent = (volume.upper - volume.lower).cast<double>().array();
  double side = options.voxelSize;
  while ((extent / side + 2 * resolvedPadding(options)).prod() > max)
    side *= 1.02;
  return static_cast<float>(side);
}

/// A cloud on a grid of this voxel size, solved everywhere.
WholeLevel coarseLevel(const OrientedPoints& points, const BoundingBox& volume, float spacing,
                       const ResolvedOptions& options, Execution& execution)
{
  const float voxelSize = voxelSizeOfDraws(volume, points.size(), options.multiscale);
  std::vector<Lattice> lattices =
      planLevels(volume, voxelSize, workloadOf(points.size(), spacing, options.prior), options.multiscale);
  constexpr float mergedFrom = 2; // spacings: a cell of this size holds about one point
  const std::vector<PointSample> samples = voxelSize > mergedFrom * spacing
                                               ? toMergedSamples({points, lattices.back(), spacing}, .5f, execution)
                                               : toSamples({points, lattices.back(), spacing}, execution);
  const bool isFinest = !(voxelSize > options.multiscale.voxelSize);
  return WholeLevel(std::move(lattices), samples,
                    levelWeights(options.prior.kind, options.observation, spacing, voxelSize, isFinest),
                    options.prior.kind, execution);
}

/// The mean of the posterior.
DistanceField meanOf(const WholeLevel& level, Execution& execution)
{
  std::vector<float> values(level.lattice().size.count(), 0);
  SolverOptions solver;
  solver.changeTolerance = 2e-3;
  level.solve(solver, values, execution);
  return DistanceField(level.lattice(), std::move(values), {});
}

/// Draws from the posterior for data of variance 1, minus its mean.
std::vector<DistanceField> drawsOf(const WholeLevel& level, int count, std::uint64_t seed, Execution& execution)
{
  const auto scale = static_cast<float>(std::sqrt(level.weights().value));
  std::vector<DistanceField> result(count);
  // Each draw on one thread, because several threads gain little on levels of this size.
  execution.forRange(count, 1, [&](std::int64_t n, std::int64_t) {
    Execution serial(1);
    std::vector<float> draw = drawOfPosterior(level.grids(), level.lattice().size, level.prior(),
                                              NormalDraws(seed, static_cast<std::uint64_t>(n)), stepsOfDraw, serial);
    for (float& value : draw)
      value *= scale;
    result[n] = DistanceField(level.lattice(), std::move(draw), {});
  });
  return result;
}

/// The variance of the draws at a place.
float varianceOf(const std::vector<DistanceField>& draws, const Eigen::Vector3f& at)
{
  float sum = 0;
  for (const DistanceField& draw : draws) {
    const float value = draw.sampleDistance(at);
    sum += value * value;
  }
  return sum / static_cast<float>(draws.size());
}

/// Moves a place to the zero level; a step is at most `max` long.
Eigen::Vector3f projected(const DistanceField& field, Eigen::Vector3f at, float max)
{
  constexpr int steps = 2;
  for (int step = 0; step < steps; ++step) {
    Eigen::Vector3f gradient;
    const float distance = field.sampleDistance(at, gradient);
    const float length = gradient.norm();
    if (length > 0)
      at -= std::clamp(distance / slopeWithin(vertexSlope, gradient), -max, max) / length * gradient;
  }
  return at;
}

/// Radii of the discs, in radii of the widest opening.
constexpr float radii[] = {1, .71f, .5f};

/// For each radius: maximum number of discs, maximum share of the points in them, and number of places that are tried.
constexpr std::size_t maxPatches = 16;
constexpr double maxShareOfPoints = 1. / 36;
constexpr int attempts = 160;

/// Minimum distance between discs, and from a disc's center to openings, in radii (of two discs: in their sum).
constexpr float apart = 1.3f;

/// The points within the radius of a point that are on its sheet. Points that face away are on another sheet.
std::vector<std::uint32_t> pointsOfDisc(const OrientedPoints& points, const NeighborSearch& search, std::size_t center,
                                        float radius, Neighbors& found)
{
  std::vector<std::uint32_t> inside;
  search.within(points.positions[center], radius, found);
  for (const int i : found.indices)
    if (points.normals[i].dot(points.normals[center]) > 0)
      inside.push_back(static_cast<std::uint32_t>(i));
  return inside;
}

/// The openings of a surface.
struct Openings {
  std::vector<Eigen::Vector3f> vertices; ///< of the mesh, without support
  float largest = 0;                     ///< largest distance from a vertex to its nearest point, cloud's unit
};

/// Chooses discs as wide as the widest opening and narrower ones, down to half of that, apart from each other and from
/// the openings; at most a twelfth of the points in all. No discs if even one of the narrowest has too many points.
/// \param narrowest minimum radius, cloud's unit: the points around a narrower disc would support the surface in it
/// The result depends on the points alone. Cost: a few hundred searches.
std::vector<Patch> choosePatches(const OrientedPoints& points, const NeighborSearch& search, const Openings& openings,
                                 float narrowest, Execution& execution)
{
  std::vector<Patch> patches;
  if (openings.vertices.empty() || points.size() == 0)
    return patches;
  const std::unique_ptr<NeighborSearch> nearOpenings = makePointBins();
  nearOpenings->setPoints(openings.vertices, execution);
  const auto max = static_cast<std::size_t>(maxShareOfPoints * static_cast<double>(points.size()));
  std::mt19937 random(1);
  Neighbors found;
  float last = 0;
  for (const float share : radii) {
    const float radius = std::max(share * openings.largest, narrowest);
    if (radius == last)
      break;
    last = radius;
    std::size_t left = max, count = 0;
    const auto isFree = [&](const Eigen::Vector3f& center) {
      nearOpenings->nearest(center, 1, found);
      return std::sqrt(found.squaredDistances.front()) > apart * radius &&
             std::all_of(patches.begin(), patches.end(), [&](const Patch& other) {
               return (other.center - center).norm() > apart * (radius + other.radius);
             });
    };
    for (int attempt = 0; attempt < attempts && count < maxPatches; ++attempt) {
      const std::size_t center = random() % points.size();
      if (!isFree(points.positions[center]))
        continue;
      std::vector<std::uint32_t> inside = pointsOfDisc(points, search, center, radius, found);
      if (inside.size() > left)
        continue;
      left -= inside.size();
      ++count;
      patches.push_back({points.positions[center], radius, std::move(inside)});
    }
    execution.poll();
  }
  return patches;
}

/// Gathers the evidence of a piece.
class Gathering {
public:
  Gathering(const MeshedPiece& meshed, float spacing, const ResolvedOptions& options, std::uint64_t seed,
            Execution& execution)
      : piece_(meshed.piece), field_(meshed.field), spacing_(spacing), options_(options), mesh_(meshed.mesh),
        vertices_(meshed.vertices), seed_(seed), execution_(execution),
        support_(*piece_.points, *piece_.search, options.observation.maxDistance, spacing)
  {}

  PieceEvidence run(std::vector<Evidence>& evidence)
  {
    measureDistances(evidence);
    leaveOut(evidence);
    const WholeLevel level = coarseLevel(left_, piece_.volume, spacing_, options_, execution_);
    result_.voxelSize = level.lattice().spacing;
    result_.voxels = level.lattice().size.count();
    const DistanceField coarse = meanOf(level, execution_);
    result_.draws = drawsOf(level, numberOfDraws(options_.uncertainty), seed_, execution_);
    forVertices([&](std::size_t v, Neighbors&) {
      const Eigen::Vector3f& at = mesh_.vertices[v];
      const float slope = slopeWithin(vertexSlope, field_.sampleGradient(at));
      Eigen::Vector3f gradient;
      const float change = coarse.sampleDistance(at, gradient) / slopeWithin(vertexSlope, gradient);
      evidence[v].variance = varianceOf(result_.draws, at) / (slope * slope);
      evidence[v].change = change * change;
      evidence[v].isInPatch = isInPatch(at);
    });
    measureFillings(coarse);
    measurePairs(coarse);
    return std::move(result_);
  }

private:
  template <typename Body>
  void forVertices(const Body& body)
  {
    execution_.forRange(vertices_.size(), evidenceGrain, [&](std::int64_t begin, std::int64_t end) {
      Neighbors scratch;
      for (std::int64_t n = begin; n < end; ++n)
        body(static_cast<std::size_t>(vertices_[n]), scratch);
    });
  }

  void measureDistances(std::vector<Evidence>& evidence)
  {
    forVertices([&](std::size_t v, Neighbors& nearest) {
      const float distance = describePlace(mesh_.vertices[v], nearest, evidence[v]);
      if (mesh_.confidences[v] > 0)
        evidence[v].offset = offsetFrom(nearest, v);
      else
        evidence[v].distance = distance;
    });
  }

  /// Sets reach, spacing and noise. \param nearest receives the nearest points \return the distance to the first
  float describePlace(const Eigen::Vector3f& at, Neighbors& nearest, Evidence& e) const
  {
    if (piece_.search->nearest(at, nearestPoints, nearest) < 1)
      return 0;
    const float distance = std::sqrt(nearest.squaredDistances.front());
    const std::size_t point = nearest.indices.front();
    e.reach = distance / support_.reach(point);
    if (!piece_.points->spacings.empty())
      e.spacing = piece_.points->spacings[point] / spacing_;
    if (piece_.points->typicalDeviation > 0)
      e.noise = piece_.points->deviation(point) / piece_.points->typicalDeviation;
    return distance;
  }

  /// The signed mean distance of a vertex from its nearest points, along the mean of both normals: that is exact on an
  /// arc, while a plane's error grows with the square of the distance.
  float offsetFrom(const Neighbors& nearest, std::size_t v) const
  {
    const OrientedPoints& points = *piece_.points;
    float sum = 0;
    for (const int index : nearest.indices) {
      const std::size_t p = index;
      sum += (mesh_.normals[v] + points.normals[p]).dot(mesh_.vertices[v] - points.positions[p]) / 2;
    }
    return nearest.indices.empty() ? 0 : sum / static_cast<float>(nearest.indices.size());
  }

  void leaveOut(const std::vector<Evidence>& evidence)
  {
    Openings openings;
    for (const std::int32_t v : vertices_)
      if (evidence[v].distance > 0) {
        openings.vertices.push_back(mesh_.vertices[v]);
        openings.largest = std::max(openings.largest, evidence[v].distance);
      }
    const float narrowest = 1.5f * options_.observation.maxDistance;
    result_.patches = choosePatches(*piece_.points, *piece_.search, openings, narrowest, execution_);
    std::vector<std::uint8_t> keep(piece_.points->size(), 1);
    for (const Patch& patch : result_.patches)
      for (const std::uint32_t p : patch.points)
        keep[p] = 0;
    left_ = select(*piece_.points, keep);
  }

  bool isInPatch(const Eigen::Vector3f& at) const
  {
    return std::any_of(result_.patches.begin(), result_.patches.end(), [&](const Patch& patch) {
      return (patch.center - at).norm() < patch.radius + .5f * options_.observation.maxDistance;
    });
  }

  /// Finds places on the fillings of the discs, and their distances from the planes of the points that were left out.
  void measureFillings(const DistanceField& coarse)
  {
    if (result_.patches.empty())
      return;
    const std::unique_ptr<NeighborSearch> searchLeft = makePointBins();
    searchLeft->setPoints(left_.positions, execution_);
    std::vector<std::vector<FilledPlace>> places(result_.patches.size());
    execution_.forRange(result_.patches.size(), 1, [&](std::int64_t n, std::int64_t) {
      Neighbors nearest;
      const Patch& patch = result_.patches[n];
      for (const std::uint32_t p : patch.points) {
        const Eigen::Vector3f at = projected(coarse, piece_.points->positions[p], patch.radius);
        searchLeft->nearest(at, 1, nearest);
        const float distance = std::sqrt(nearest.squaredDistances.front());
        if (distance < options_.observation.maxDistance) // the other points support this place
          continue;
        const float slope = slopeWithin(vertexSlope, coarse.sampleGradient(at));
        places[n].push_back({varianceOf(result_.draws, at) / (slope * slope), distanceToPoints(at, nearest), distance,
                             static_cast<std::int32_t>(n)});
      }
    });
    result_.filled = joined(std::move(places));
  }

  /// The mean signed distance from the tangent planes of the nearest points.
  float distanceToPoints(const Eigen::Vector3f& at, Neighbors& nearest) const
  {
    const int found = piece_.search->nearest(at, nearestPoints, nearest);
    float sum = 0;
    for (const int i : nearest.indices) {
      const std::size_t p = i;
      sum += piece_.points->normals[p].dot(at - piece_.points->positions[p]);
    }
    return sum / static_cast<float>(std::max(found, 1));
  }

  void measurePairs(const DistanceField& coarse)
  {
    Neighbors nearest;
    for (const HeldOutPair& pair : holdOutPairs(*piece_.points, *piece_.search, spacing_, options_, execution_)) {
      Evidence evidence;
      describePlace(pair.position, nearest, evidence);
      Eigen::Vector3f gradient;
      const float distance = coarse.sampleDistance(pair.position, gradient), slope = slopeWithin(vertexSlope, gradient);
      evidence.variance = varianceOf(result_.draws, pair.position) / (slope * slope);
      evidence.change = distance * distance / (slope * slope);
      if (isInPatch(pair.position))
        continue;
      result_.pairs.push_back(pair);
      result_.atPairs.push_back(evidence);
    }
  }

  const SolvedPiece& piece_;
  const DistanceField& field_;
  const float spacing_;
  const ResolvedOptions& options_;
  const TriangleMesh& mesh_;
  const std::vector<std::int32_t>& vertices_;
  const std::uint64_t seed_;
  Execution& execution_;
  const Support support_;
  OrientedPoints left_;
  PieceEvidence result_;
};

} // namespace

PieceEvidence gatherEvidence(const MeshedPiece& meshed, float spacing, const ResolvedOptions& options,
                             std::uint64_t seed, std::vector<Evidence>& evidence, Execution& execution)
{
  return Gathering(meshed, spacing, options, seed, execution).run(evidence);
}

} // namespace pcl::mrf
