// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/remesher.h"

#include "base/loops.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "options/validation.h"
#include "remesher/intersection_watch.h"
#include "remesher/parts.h"
#include "remesher/passes.h"
#include "remesher/piece.h"
#include "remesher/remeshed_surface.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t vertexGrain = 2048;

/// Pins triangles that run against the surface's normals, but for slivers, if they are few. Sheets are closer to each
/// other there than the field's gradients tell apart: what the passes make of them intersects, so that rounds have to
/// be repeated.
void pinFolds(RemeshedSurface& surface)
{
  constexpr double most = .05; // of all triangles
  HalfEdgeMesh& mesh = surface.mesh;
  std::vector<std::int32_t> folds;
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); h += 3)
    if (const TriangleShape shape = surface.shape(h); !shape.isSliver() && shape.cosine < 0)
      folds.push_back(h / 3);
  if (3 * static_cast<double>(folds.size()) > most * mesh.halfEdgeCount())
    return;
  for (const std::int32_t t : folds)
    for (const std::int32_t v : mesh.triangle(t))
      mesh.pinned[v] = 1;
}

/// The piece without vertices that are in no triangle, and all that the passes read of it but for the curves of a whole
/// mesh.
RemeshedSurface prepared(const MeshPiece& piece, const RemeshPlan& plan, const ZeroLevel& level, Execution& execution)
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

/// What vertices are before a pass that moves them.
struct FormerVertices {
  std::vector<Vector3f> positions, normals;
  std::vector<double> places;

  explicit FormerVertices(const HalfEdgeMesh& mesh)
      : positions(mesh.positions), normals(mesh.normals), places(mesh.places)
  {}
};

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
      intersectingBefore_ =
          static_cast<std::int64_t>(watch_.intersectingTriangles(surface_.mesh, {}, execution_).size());
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
    const RemeshSummary resultBefore = surface_.result;
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
    const FormerVertices former(surface_.mesh);
    relax(surface_, execution_);
    return takeBackWhatIntersects(former, watch);
  }

  void fit()
  {
    const FormerVertices former(surface_.mesh);
    fitToSurface(surface_, execution_);
    takeBackWhatIntersects(former, watch_);
  }

  /// Takes vertices of intersecting triangles back to where they were, and what would be a bad triangle then as well,
  /// until no triangles intersect. \return the corners of those that do and did not move
  std::vector<std::int32_t> takeBackWhatIntersects(const FormerVertices& former, const IntersectionWatch& watch)
  {
    HalfEdgeMesh& mesh = surface_.mesh;
    const auto hasMoved = [&](std::int32_t v) { return mesh.positions[v] != former.positions[v]; };
    Poller poll(execution_);
    while (true) {
      const std::vector<std::int32_t> corners = watch.newIntersections(mesh, execution_);
      std::vector<std::int32_t> toReturn;
      std::copy_if(corners.begin(), corners.end(), std::back_inserter(toReturn), hasMoved);
      if (toReturn.empty())
        return corners;
      while (!toReturn.empty()) {
        const std::int32_t v = toReturn.back();
        toReturn.pop_back();
        poll();
        if (!hasMoved(v))
          continue;
        surface_.moveTo(v, {{former.positions[v], former.normals[v]}, former.places.empty() ? -1 : former.places[v]});
        ++surface_.result.refusedOperations;
        mesh.forOutgoing(v, [&](std::int32_t h) {
          if (!surface_.shape(h).sound())
            toReturn.insert(toReturn.end(), {mesh.target(h), mesh.opposite(h)});
        });
      }
    }
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
    HalfEdgeMesh& mesh = surface_.mesh;
    RemeshedPiece piece;
    piece.mesh = mesh.toTriangles();
    piece.intersecting = selfIntersectingTriangles(piece.mesh, execution_);
    if (watch_.place() == IntersectionWatch::Place::expected && !changeableCorners(mesh, piece.intersecting).empty())
      return {};
    piece.sizing = std::move(mesh.sizing);
    piece.numbers = std::move(mesh.numbers);
    piece.places = std::move(mesh.places);
    piece.summary = surface_.result;
    piece.summary.targetEdge = surface_.targetEdge;
    piece.intersectingBefore = intersectingBefore_;
    return piece;
  }

  static constexpr int maxAttempts = 8;

  const RemesherOptions& options_;
  Execution& execution_;
  RemeshedSurface surface_;
  IntersectionWatch watch_, everywhere_;
  std::int64_t intersectingBefore_ = 0;
  /// No triangles that may be changed intersect, as far as they are watched, when a round begins. What intersects in
  /// the input may come apart in the course of the first one.
  bool isClean_ = false;
  bool hasRepeated_ = false; ///< a round: most of those that follow will have to be, too
};

RemeshResult remeshWhole(TriangleMesh mesh, const RemeshPlan& plan, const ZeroLevel& level,
                         const RemesherOptions& options, Execution& execution)
{
  RemeshedPiece piece = remeshPiece({std::move(mesh), plan.sizing, {}, {}}, plan, level, options, execution);
  return {piece.summary, std::move(piece.mesh), piece.intersectingBefore,
          static_cast<std::int64_t>(piece.intersecting.size())};
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

RemeshedPiece remeshPiece(const MeshPiece& piece, const RemeshPlan& plan, const ZeroLevel& level,
                          const RemesherOptions& options, Execution& execution)
{
  const auto runWatching = [&](IntersectionWatch::Place place) {
    return Remesher(prepared(piece, plan, level, execution), options, place, execution).run();
  };
  std::optional<RemeshedPiece> result = runWatching(IntersectionWatch::Place::expected);
  return result ? *std::move(result) : *runWatching(IntersectionWatch::Place::everywhere);
}

RemeshResult remesh(TriangleMesh mesh, const DistanceField& field, const EdgeSizing& sizing,
                    const RemesherOptions& options, Execution& execution, std::int64_t partSize)
{
  validate(options);
  RemeshResult result;
  if (!options.runs() || mesh.triangles.empty()) {
    result.mesh.vertices = std::move(mesh.vertices);
    result.mesh.triangles = std::move(mesh.triangles);
    return result;
  }
  if (field.empty())
    throw InvalidInput("remeshing needs a distance field, and this one is empty");
  const ZeroLevel level(field, .5f * static_cast<float>(field.lattice().spacing));
  RemeshPlan plan = planFor(mesh, sizing, options, execution);
  const bool isWhole =
      partSize <= 0 || options.rounds == 0 ||
      std::max(plan.triangles, static_cast<double>(mesh.triangles.size())) <= static_cast<double>(partSize);
  if (isWhole)
    return remeshWhole(std::move(mesh), plan, level, options, execution);
  RemesherOptions ofRounds = options, ofDecimation = options;
  ofRounds.triangles = 0;
  RemeshPlan ofParts = options.triangles == 0 ? std::move(plan) : plan;
  result = remeshInParts(std::move(mesh), std::move(ofParts), level, ofRounds, partSize, execution);
  if (options.triangles == 0)
    return result;
  // Which collapses cost least is only known for all of the mesh.
  ofDecimation.rounds = 0;
  ofDecimation.fit = false;
  plan.sizing.clear();
  RemeshResult decimated = remeshWhole(std::move(result.mesh), plan, level, ofDecimation, execution);
  result.add(decimated);
  result.mesh = std::move(decimated.mesh);
  result.intersecting = decimated.intersecting;
  return result;
}

} // namespace pcl::mrf
