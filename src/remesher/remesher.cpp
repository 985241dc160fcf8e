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
#include <optional>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t vertexGrain = 2048;

/// Pins triangles that face against the surface's normals, except slivers, if they are few. Sheets are too close there
/// for the field's gradient to tell them apart: triangles that the passes make of them intersect, and must be undone.
void pinFolds(RemeshedSurface& surface)
{
  constexpr double maxShare = .05; // of all triangles
  HalfEdgeMesh& mesh = surface.mesh;
  std::vector<std::int32_t> folds;
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); h += 3)
    if (const TriangleShape shape = surface.shape(h); !shape.isSliver() && shape.cosine < 0)
      folds.push_back(h / 3);
  if (3 * static_cast<double>(folds.size()) > maxShare * mesh.halfEdgeCount())
    return;
  for (const std::int32_t t : folds)
    for (const std::int32_t v : mesh.triangle(t))
      mesh.pinned[v] = 1;
}

/// The piece as the passes read it, without unused vertices. Only the curves of a whole mesh are not set yet.
RemeshedSurface prepared(const MeshPiece& piece, const RemeshPlan& plan, const ZeroLevel& level, Execution& execution)
{
  RemeshedSurface surface(piece.mesh, level, execution);
  execution.poll();
  surface.targetEdge = plan.targetEdge;
  surface.maxTurn = plan.maxTurn;
  surface.weightAt = plan.weightAt;
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

/// The sites of the vertices before a pass that moves them.
using FormerSites = std::vector<Site>;

FormerSites sitesOf(const RemeshedSurface& surface)
{
  FormerSites sites(surface.mesh.positions.size());
  for (std::int32_t v = 0; v < surface.mesh.vertexCount(); ++v)
    sites[v] = surface.site(v);
  return sites;
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
      intersectingBefore_ =
          static_cast<std::int64_t>(watch_.intersectingTriangles(surface_.mesh, {}, execution_).size());
      partBorders(surface_);
      smoothBorders();
    }
    // The first round makes most of the collapses: an intersection overlooked there would repeat all rounds.
    for (int round = 0; round < options_.rounds; ++round) {
      if (!runRound(round == 0 ? everywhere_ : watch_))
        return {};
      if (surface_.mesh.numbers.empty()) // the progress of parts is counted in parts
        execution_.progress(static_cast<double>(round + 1) / options_.rounds);
    }
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

  /// One round of all passes. \return false if triangles intersect where they were not expected to
  bool runRound(const IntersectionWatch& watch)
  {
    splitLongEdges(surface_, execution_);
    collapseShortEdges(surface_, execution_);
    flipEdges(surface_, execution_);
    FormerSites former = sitesOf(surface_);
    relax(surface_, execution_);
    const std::vector<std::int32_t> left = takeBackWhatIntersects(former, watch);
    if (!left.empty() && watch.place() == IntersectionWatch::Place::expected)
      return false;
    for (const std::int32_t t : left) // they intersected in the input
      for (const std::int32_t v : surface_.mesh.triangle(t))
        surface_.mesh.pinned[v] = 1;
    compact();
    return true;
  }

  void compact()
  {
    surface_.logs.clear();
    undone_.clear();
    surface_.mesh.compact(execution_);
    execution_.poll();
  }

  void fit()
  {
    FormerSites former = sitesOf(surface_);
    fitToSurface(surface_, execution_);
    takeBackWhatIntersects(former, watch_);
  }

  /// Moves the vertices of intersecting triangles back, and undoes the operations on triangles that still intersect,
  /// until none does. \return intersecting triangles that neither has changed
  std::vector<std::int32_t> takeBackWhatIntersects(FormerSites& former, const IntersectionWatch& watch)
  {
    HalfEdgeMesh& mesh = surface_.mesh;
    while (true) {
      std::vector<std::int32_t> triangles = watch.newIntersections(mesh, execution_);
      if (takeBack(cornersOf(triangles), former))
        continue;
      const OperationLog::Choice choice = OperationLog::lastOn(triangles, surface_.logs, mesh);
      if (choice.operations.empty())
        return triangles;
      undo(choice, former);
    }
  }

  void undo(const OperationLog::Choice& choice, FormerSites& former)
  {
    takeBack(cornersOf(choice.triangles), former);
    OperationLog::undo(choice, surface_.logs, surface_.mesh, surface_.result);
    surface_.result.refusedOperations += static_cast<std::int64_t>(choice.operations.size());
    const std::vector<std::int32_t> corners = cornersOf(choice.triangles);
    undone_.insert(undone_.end(), corners.begin(), corners.end());
    for (const std::int32_t v : corners)
      former[v] = surface_.site(v);
    std::vector<std::int32_t> around;
    for (const std::int32_t v : corners)
      addCornersOfBad(v, around);
    takeBack(std::move(around), former);
  }

  /// Corners of those of the triangles that have not been removed.
  std::vector<std::int32_t> cornersOf(const std::vector<std::int32_t>& triangles) const
  {
    std::vector<std::int32_t> corners;
    for (const std::int32_t t : triangles)
      for (const std::int32_t v : surface_.mesh.triangle(t))
        if (v >= 0)
          corners.push_back(v);
    return corners;
  }

  void addCornersOfBad(std::int32_t v, std::vector<std::int32_t>& corners) const
  {
    surface_.mesh.forOutgoing(v, [&](std::int32_t h) {
      if (!surface_.shape(h).sound())
        corners.insert(corners.end(), {surface_.mesh.target(h), surface_.mesh.opposite(h)});
    });
  }

  /// Moves vertices back to where they were, and the other corners of triangles that are bad then.
  /// \return false if none had moved
  bool takeBack(std::vector<std::int32_t> toReturn, const FormerSites& former)
  {
    bool hasMoved = false;
    Poller poll(execution_);
    while (!toReturn.empty()) {
      const std::int32_t v = toReturn.back();
      toReturn.pop_back();
      poll();
      if (surface_.mesh.positions[v] == former[v].corner.position)
        continue;
      hasMoved = true;
      surface_.moveTo(v, former[v]);
      ++surface_.result.refusedOperations;
      addCornersOfBad(v, toReturn);
    }
    return hasMoved;
  }

  /// Decimates. The triangles get too large to know where they may intersect, so the whole mesh is searched.
  void reduce()
  {
    for (int attempt = 0; attempt < maxAttempts; ++attempt) {
      decimate(surface_, options_.triangles, execution_);
      FormerSites former = sitesOf(surface_);
      takeBackWhatIntersects(former, everywhere_);
      const bool isDone = undone_.empty();
      for (const std::int32_t v : undone_) // else the next attempt would fail in the same way
        surface_.mesh.pinned[v] = 1;
      compact();
      if (isDone)
        return;
    }
  }

  std::optional<RemeshedPiece> finished()
  {
    HalfEdgeMesh& mesh = surface_.mesh;
    RemeshedPiece piece;
    piece.mesh = mesh.toTriangles();
    piece.intersecting = selfIntersectingTriangles(piece.mesh, execution_);
    if (watch_.place() == IntersectionWatch::Place::expected && !changeable(mesh, piece.intersecting).empty())
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
  std::vector<std::int32_t> undone_; ///< corners of triangles restored by undo() since the mesh was compacted
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
                    const RemesherOptions& options, Execution& execution, std::int64_t partSize,
                    const DistanceWeight& weightAt)
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
  RemeshPlan plan = planFor(mesh, field, sizing, options, execution);
  plan.weightAt = weightAt;
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
  // Which collapses cost least is only known for the whole mesh.
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
