// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/remesher.h"

#include "base/loops.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "options/validation.h"
#include "remesher/former_vertices.h"
#include "remesher/intersection_watch.h"
#include "remesher/parts.h"
#include "remesher/passes.h"
#include "remesher/piece.h"
#include "remesher/relaxation.h"
#include "remesher/remeshed_surface.h"
#include "remesher/triangle_surface.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t vertexGrain = 2048;

/// Pins triangles that run against the surface's normals, but for slivers. Sheets are closer to each other there than
/// the field's gradients tell apart: what the passes make of them intersects, so that rounds have to be repeated.
void pinFolds(RemeshedSurface& surface)
{
  HalfEdgeMesh& mesh = surface.mesh;
  std::vector<std::int32_t> folds;
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); h += 3)
    if (isFold(surface.shape(h)))
      folds.push_back(h / 3);
  const bool isWhole = mesh.numbers.empty(); // for parts the plan tells
  if (isWhole && 3 * static_cast<double>(folds.size()) > mostFolds * mesh.halfEdgeCount())
    return;
  for (const std::int32_t t : folds)
    for (const std::int32_t v : mesh.triangle(t))
      mesh.pinned[v] = 1;
}

/// The piece without vertices that are in no triangle, and all that the passes read of it but for the curves of a whole
/// mesh.
RemeshedSurface prepared(const MeshPiece& piece, const RemeshPlan& plan, const ReferenceSurface& level,
                         Execution& execution)
{
  RemeshedSurface surface(piece.mesh, level, execution);
  execution.poll();
  surface.targetEdge = plan.targetEdge;
  surface.maxTurn = plan.maxTurn;
  HalfEdgeMesh& mesh = surface.mesh;
  if (!piece.sizing.empty())
    mesh.sizing = piece.sizing;
  if (!piece.numbers.empty()) {
    mesh.numbers = piece.numbers;
    mesh.places = piece.places;
    surface.curves = plan.curves;
    std::transform(mesh.numbers.begin(), mesh.numbers.end(), mesh.pinned.begin(),
                   [](std::int32_t number) { return static_cast<std::uint8_t>(number >= 0 ? 1 : 0); });
  }
  mesh.compact(execution);
  execution.poll();
  setNormals(surface, execution);
  if (plan.pinsFolds)
    pinFolds(surface);
  return surface;
}

/// One remeshing run: the order of the passes.
class Remesher {
public:
  /// \param watched where to look for intersections after each round
  Remesher(RemeshedSurface surface, const RemesherOptions& options, IntersectionWatch::Place watched,
           Execution& execution)
      : options_(options), execution_(execution), surface_(std::move(surface)),
        watch_(watched, surface_.mesh, surface_.targetEdge, execution),
        everywhere_(IntersectionWatch::Place::everywhere, surface_.mesh, surface_.targetEdge, execution)
  {}

  /// \return nothing if triangles intersect where they were not expected to
  std::optional<RemeshedPiece> run()
  {
    if (surface_.mesh.numbers.empty()) {
      surface_.result.intersectingBefore = watch_.countIntersecting(surface_.mesh, execution_);
      partBorders(surface_);
      smoothBorders();
    }
    // The first round makes most of the collapses: what is overlooked there costs all rounds once more.
    for (int round = 0; round < options_.rounds && runRound(round == 0 ? everywhere_ : watch_); ++round)
      if (surface_.mesh.numbers.empty()) // a part is itself a share of what there is to do
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
    surface_.curves = BorderCurves(surface_.mesh, surface_.level.maxStep(), surfaceFinder(surface_.level, poll));
  }

  /// One round of all passes. Moves that made triangles intersect are taken back. \return false if no round can be made
  /// any more
  bool runRound(const IntersectionWatch& watch)
  {
    return runRepeatedly([&] { return runPasses(watch); });
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
  std::vector<std::int32_t> runPasses(const IntersectionWatch& watch)
  {
    splitLongEdges(surface_, execution_);
    collapseShortEdges(surface_, execution_);
    flipEdges(surface_, execution_);
    surface_.mesh.compact(execution_);
    execution_.poll();
    if (isClean_ && hasRepeated_) {
      // Nothing moved yet that could be taken back: the round is to be repeated anyway, better before the rest of it.
      std::vector<std::int32_t> intersecting = watch.newIntersections(surface_.mesh, execution_);
      if (!intersecting.empty())
        return intersecting;
    }
    FormerVertices former(surface_);
    Relaxation(surface_, execution_).moveAll();
    return former.takeBackWhatIntersects(watch, execution_);
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
    runRepeatedly([&] {
      decimate(surface_, options_.triangles, execution_);
      return everywhere_.newIntersections(surface_.mesh, execution_);
    });
  }

  std::optional<RemeshedPiece> finished()
  {
    RemeshedPiece piece{{}, surface_.result, selfIntersectingTriangles(surface_.mesh.toTriangles(), execution_)};
    piece.result.targetEdge = surface_.targetEdge;
    piece.result.intersecting = static_cast<std::int64_t>(piece.intersecting.size());
    if (watch_.place() == IntersectionWatch::Place::expected &&
        !changeableCorners(surface_.mesh, piece.intersecting).empty())
      return {};
    piece.mesh = std::move(surface_.mesh);
    return piece;
  }

  static constexpr int maxAttempts = 8;

  const RemesherOptions& options_;
  Execution& execution_;
  RemeshedSurface surface_;
  IntersectionWatch watch_, everywhere_;
  /// No triangles that may be changed intersect, as far as they are watched, when a round begins. What intersects in
  /// the input may come apart in the course of the first one.
  bool isClean_ = false;
  bool hasRepeated_ = false; ///< a round: most of those that follow will have to be, too
};

RemeshResult remeshWhole(const TriangleMesh& mesh, const RemeshPlan& plan, const ReferenceSurface& level,
                         const RemesherOptions& options, Execution& execution)
{
  RemeshedPiece piece = remeshPiece({mesh, plan.sizing, {}, {}}, plan, level, options, execution);
  piece.result.mesh = piece.mesh.toTriangles();
  return std::move(piece.result);
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

void setNormals(RemeshedSurface& surface, Execution& execution)
{
  HalfEdgeMesh& mesh = surface.mesh;
  forEachPolling<std::int32_t>(execution, mesh.vertexCount(), vertexGrain, [&](std::int32_t v) {
    Vector3f sum = Vector3f::Zero();
    mesh.forOutgoing(v, [&](std::int32_t h) { sum += surface.cross(h); });
    mesh.normals[v] = surface.level.normalAt(mesh.positions[v], sum.normalized());
  });
}

RemeshedPiece remeshPiece(const MeshPiece& piece, const RemeshPlan& plan, const ReferenceSurface& level,
                          const RemesherOptions& options, Execution& execution)
{
  const auto runWatching = [&](IntersectionWatch::Place place) {
    return Remesher(prepared(piece, plan, level, execution), options, place, execution).run();
  };
  std::optional<RemeshedPiece> result = runWatching(IntersectionWatch::Place::expected);
  return result ? *std::move(result) : *runWatching(IntersectionWatch::Place::everywhere);
}

RemeshResult remesh(TriangleMesh mesh, const DistanceField& field, const EdgeSizing& sizing,
                    const RemesherOptions& options, Execution& execution, const RemeshParts& parts)
{
  validate(options);
  requireSizing(sizing, mesh);
  if (!options.runs() || mesh.triangles.empty())
    return unchanged(mesh);
  if (field.empty())
    throw InvalidInput("remeshing needs a distance field, and this one is empty");
  const ZeroLevel level(field, .5f * static_cast<float>(field.lattice().spacing));
  RemeshPlan plan = planFor(mesh, sizing, options, execution);
  const bool isWhole =
      parts.triangles <= 0 || options.rounds == 0 ||
      std::max(plan.triangles, static_cast<double>(mesh.triangles.size())) <= static_cast<double>(parts.triangles);
  if (isWhole)
    return remeshWhole(mesh, plan, level, options, execution);
  RemesherOptions ofRounds = options, ofDecimation = options;
  ofRounds.triangles = 0;
  RemeshPlan ofParts = options.triangles == 0 ? std::move(plan) : plan;
  RemeshResult result = remeshInParts(std::move(mesh), std::move(ofParts), level, ofRounds, parts, execution);
  if (options.triangles == 0)
    return result;
  // Which collapses cost least is only known for all of the mesh.
  ofDecimation.rounds = 0;
  ofDecimation.fit = false;
  plan.sizing.clear();
  RemeshResult decimated = remeshWhole(result.mesh, plan, level, ofDecimation, execution);
  result.add(decimated);
  result.mesh = std::move(decimated.mesh);
  result.intersecting = decimated.intersecting;
  return result;
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
  const TriangleSurface level(mesh, .5f * edge);
  return remeshWhole(mesh, planFor(mesh, {}, options, execution), level, options, execution);
}

} // namespace pcl::mrf
