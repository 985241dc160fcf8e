// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/remesher.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "options/validation.h"
#include "remesher/former_vertices.h"
#include "remesher/intersection_watch.h"
#include "remesher/passes.h"
#include "remesher/relaxation.h"
#include "remesher/remeshed_surface.h"
#include "remesher/triangle_surface.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t vertexGrain = 2048;
/// Angle by which the surface may turn along an edge: with more, ears and claws get shorter and edges of the shape
/// blunter with every round; with less, triangles on rough clouds are less even.
constexpr float maxAngle = .8f;

float medianEdge(const RemeshedSurface& surface)
{
  std::vector<float> lengths;
  for (std::int32_t h = 0; h < surface.mesh.halfEdgeCount(); ++h)
    if (surface.mesh.represents(h))
      lengths.push_back(surface.squaredLength(h));
  return std::sqrt(median(std::move(lengths)));
}

/// How many equilateral triangles there would be, all edges as long as their target.
double expectedTriangles(const RemeshedSurface& surface)
{
  double sum = 0;
  for (std::int32_t h = 0; h < surface.mesh.halfEdgeCount(); h += 3) {
    const double target = (surface.targetOf(h) + surface.targetOf(h + 1) + surface.targetOf(h + 2)) / 3;
    sum += .5 * surface.cross(h).norm() / (.25 * std::sqrt(3.0) * target * target);
  }
  return sum;
}

/// Aims at shorter edges if there would be too few triangles to choose from.
void shortenFor(std::int64_t triangles, RemeshedSurface& surface)
{
  constexpr double spare = 1.25;
  const double share = expectedTriangles(surface) / (spare * static_cast<double>(triangles));
  surface.targetEdge *= static_cast<float>(std::min(1.0, std::sqrt(share)));
}

/// A tiny target edge would ask for more half-edges than 32 bits can count.
void checkSize(const RemeshedSurface& surface)
{
  const float target = surface.targetEdge;
  const double triangles = expectedTriangles(surface);
  const double limit = 5e8;
  if (triangles > limit) {
    std::ostringstream message;
    message << "remesher.targetEdge = " << target << " would give about " << triangles << " triangles; at least "
            << target * std::sqrt(triangles / limit) << " is needed";
    throw ResourceLimit(message.str());
  }
}

/// Those of the surface, where that has none those of the triangles.
void setNormals(RemeshedSurface& surface, Execution& execution)
{
  HalfEdgeMesh& mesh = surface.mesh;
  forEachPolling<std::int32_t>(execution, mesh.vertexCount(), vertexGrain, [&](std::int32_t v) {
    Vector3f sum = Vector3f::Zero();
    mesh.forOutgoing(v, [&](std::int32_t h) { sum += surface.cross(h); });
    mesh.normals[v] = surface.level.normalAt(mesh.positions[v], sum.normalized());
  });
}

/// Pins triangles that run against the surface's normals, but for slivers. Sheets are closer to each other there than
/// the field's gradients tell apart: what the passes make of them intersects, so that rounds have to be repeated. Where
/// most of a mesh is such triangles they are not pinned.
void pinFolds(RemeshedSurface& surface)
{
  constexpr double mostPinned = .05;
  HalfEdgeMesh& mesh = surface.mesh;
  std::vector<std::int32_t> folds;
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); h += 3) {
    const TriangleShape shape = surface.shape(h);
    if (!shape.isSliver() && shape.cosine < 0)
      folds.push_back(h / 3);
  }
  if (3 * static_cast<double>(folds.size()) > mostPinned * mesh.halfEdgeCount())
    return;
  for (const std::int32_t t : folds)
    for (const std::int32_t v : mesh.triangle(t))
      mesh.pinned[v] = 1;
}

/// The mesh without vertices that are in no triangle, and all that the passes read of it but for the borders' curves.
RemeshedSurface prepared(const TriangleMesh& mesh, const ReferenceSurface& level, const EdgeSizing& sizing,
                         const RemesherOptions& options, Execution& execution)
{
  RemeshedSurface surface(mesh, level, execution);
  execution.poll();
  const float median = medianEdge(surface);
  surface.targetEdge = options.targetEdge > 0 ? options.targetEdge : median;
  if (!sizing.empty() && options.targetEdge == 0) {
    surface.mesh.sizing = sizing;
    limitGrowth(surface.mesh, surface.targetEdge, execution);
  }
  // Edges that are to be longer than they are have to pass by details.
  surface.maxTurn = squared(maxAngle * std::max(1.f, surface.targetEdge / median));
  if (options.triangles > 0)
    shortenFor(options.triangles, surface);
  checkSize(surface);
  execution.poll();
  surface.mesh.compact(execution);
  execution.poll();
  setNormals(surface, execution);
  if (surface.targetEdge <= median) // small triangles must not stay among large ones
    pinFolds(surface);
  return surface;
}

/// One remeshing run: the order of the passes.
class Remesher {
public:
  /// \param watched where to look for intersections after each round
  Remesher(const TriangleMesh& mesh, const ReferenceSurface& level, const EdgeSizing& sizing,
           const RemesherOptions& options, IntersectionWatch::Place watched, Execution& execution)
      : options_(options), execution_(execution), surface_(prepared(mesh, level, sizing, options, execution)),
        watch_(watched, surface_.mesh, surface_.targetEdge, execution)
  {}

  /// \return nothing if triangles intersect where they were not expected to
  std::optional<RemeshResult> run()
  {
    surface_.result.intersectingBefore = watch_.countIntersecting(surface_.mesh, execution_);
    partBorders(surface_);
    smoothBorders();
    for (int round = 0; round < options_.rounds && runRound(); ++round)
      execution_.progress(static_cast<double>(round + 1) / options_.rounds);
    if (options_.fit)
      fit();
    if (options_.triangles > 0)
      reduce();
    return finished();
  }

private:
  void smoothBorders()
  {
    Poller poll(execution_);
    surface_.curves = BorderCurves(surface_.mesh, surface_.level.maxStep(), [&](Vector3f& position) {
      poll();
      const std::optional<Corner> reached = surface_.level.trace(position);
      if (reached)
        position = reached->position;
      return reached.has_value();
    });
  }

  /// One round of all passes. Moves that made triangles intersect are taken back. \return false if no round can be made
  /// any more
  bool runRound()
  {
    return runRepeatedly([this] { return runPasses(); });
  }

  /// Runs a change of the mesh, once more where it made triangles intersect, with what is around them left as it was.
  /// \param change returns corners of triangles that intersect \return false if nothing but the mesh as it was is left
  template <typename Change>
  bool runRepeatedly(const Change& change)
  {
    const HalfEdgeMesh before = surface_.mesh;
    const RemeshResult resultBefore = surface_.result;
    std::vector<std::uint8_t> pinned = before.pinned;
    float radius = .5f * surface_.targetEdge;
    for (int attempt = 0; attempt < maxAttempts; ++attempt, radius *= 2) {
      const std::vector<std::int32_t> intersecting = change();
      isClean_ = isClean_ || intersecting.empty();
      hasRepeated_ = hasRepeated_ || !intersecting.empty();
      if (intersecting.empty())
        return true; // what was pinned stays so: the next round would run into the same trouble
      std::vector<Vector3f> centers;
      centers.reserve(intersecting.size());
      for (const std::int32_t v : intersecting)
        centers.push_back(surface_.mesh.positions[v]);
      pinAround(centers, radius, before.positions, pinned);
      surface_.mesh = before;
      surface_.mesh.pinned = pinned;
      const std::int64_t refusals = surface_.result.refusedOperations;
      surface_.result = resultBefore;
      surface_.result.refusedOperations = refusals;
    }
    return false;
  }

  /// \return corners of triangles that intersect
  std::vector<std::int32_t> runPasses()
  {
    splitLongEdges(surface_, execution_);
    collapseShortEdges(surface_, execution_);
    flipEdges(surface_, execution_);
    surface_.mesh.compact(execution_);
    execution_.poll();
    if (isClean_ && hasRepeated_) {
      // Nothing moved yet that could be taken back: the round is to be repeated anyway, better before the rest of it.
      std::vector<std::int32_t> intersecting = watch_.newIntersections(surface_.mesh, execution_);
      if (!intersecting.empty())
        return intersecting;
    }
    FormerVertices former(surface_);
    Relaxation(surface_, execution_).moveAll();
    return former.takeBackWhatIntersects(watch_, execution_);
  }

  void fit()
  {
    FormerVertices former(surface_);
    fitToSurface(surface_, execution_);
    former.takeBackWhatIntersects(watch_, execution_);
  }

  /// Its triangles are too large to know where they may intersect.
  void reduce()
  {
    const IntersectionWatch everywhere(IntersectionWatch::Place::everywhere, surface_.mesh, surface_.targetEdge,
                                       execution_);
    runRepeatedly([&] {
      decimate(surface_, options_.triangles, execution_);
      return everywhere.newIntersections(surface_.mesh, execution_);
    });
  }

  std::optional<RemeshResult> finished()
  {
    RemeshResult result = surface_.result;
    result.mesh = surface_.mesh.toTriangles();
    result.targetEdge = surface_.targetEdge;
    const std::vector<std::int32_t> intersecting = selfIntersectingTriangles(result.mesh, execution_);
    result.intersecting = static_cast<std::int64_t>(intersecting.size());
    const bool isExpected = watch_.place() == IntersectionWatch::Place::everywhere ||
                            changeableCorners(surface_.mesh, intersecting).empty();
    return isExpected ? std::optional<RemeshResult>(std::move(result)) : std::nullopt;
  }

  static constexpr int maxAttempts = 8;

  const RemesherOptions& options_;
  Execution& execution_;
  RemeshedSurface surface_;
  IntersectionWatch watch_;
  /// No triangles that may be changed intersect, as far as they are watched, when a round begins. What intersects in
  /// the input may come apart in the course of the first one.
  bool isClean_ = false;
  bool hasRepeated_ = false; ///< a round: most of those that follow will have to be, too
};

RemeshResult remeshOn(const ReferenceSurface& level, const TriangleMesh& mesh, const EdgeSizing& sizing,
                      const RemesherOptions& options, Execution& execution)
{
  using Place = IntersectionWatch::Place;
  std::optional<RemeshResult> result = Remesher(mesh, level, sizing, options, Place::expected, execution).run();
  return result ? *std::move(result) : *Remesher(mesh, level, sizing, options, Place::everywhere, execution).run();
}

/// What no rounds leave.
RemeshResult unchanged(const TriangleMesh& mesh)
{
  RemeshResult result;
  result.mesh.vertices = mesh.vertices;
  result.mesh.triangles = mesh.triangles;
  return result;
}

void requireSizing(const EdgeSizing& sizing, const TriangleMesh& mesh)
{
  if (!sizing.empty() && sizing.size() != mesh.vertices.size())
    throw std::invalid_argument("remesh: " + std::to_string(sizing.size()) + " sizes for " +
                                std::to_string(mesh.vertices.size()) + " vertices");
  if (std::any_of(sizing.begin(), sizing.end(), [](float size) { return !(size >= 1 && std::isfinite(size)); }))
    throw std::invalid_argument("remesh: sizes must be 1 or more, and finite");
}

} // namespace

RemeshResult remesh(const TriangleMesh& mesh, const DistanceField& field, const EdgeSizing& sizing,
                    const RemesherOptions& options, Execution& execution)
{
  validate(options);
  requireSizing(sizing, mesh);
  if (!options.runs() || mesh.triangles.empty())
    return unchanged(mesh);
  if (field.empty())
    throw InvalidInput("remeshing needs a distance field, and this one is empty");
  return remeshOn(ZeroLevel(field, .5f * static_cast<float>(field.lattice().spacing)), mesh, sizing, options,
                  execution);
}

RemeshResult remesh(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options,
                    Execution& execution)
{
  return remesh(mesh, field, {}, options, execution);
}

RemeshResult remesh(const TriangleMesh& mesh, const RemesherOptions& options, Execution& execution)
{
  validate(options);
  if (!options.runs() || mesh.triangles.empty())
    return unchanged(mesh);
  const float edge = std::max(medianEdge(mesh), options.targetEdge);
  return remeshOn(TriangleSurface(mesh, .5f * edge), mesh, {}, options, execution);
}

} // namespace mrf
} // namespace pcl
