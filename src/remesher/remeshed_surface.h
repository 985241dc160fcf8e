// SPDX-License-Identifier: BSD-3-Clause
/// The state that the passes of the remesher share.
#pragma once

#include "mesh/triangle_shape.h"
#include "remesher/border_curves.h"
#include "remesher/half_edge_mesh.h"
#include "remesher/operation_log.h"
#include "remesher/remesher.h"
#include "remesher/zero_level.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <limits>
#include <vector>

namespace pcl::mrf {

constexpr float squared(float value)
{
  return value * value;
}

/// Where a vertex is or may move to.
struct Site {
  Corner corner;
  double place = -1; ///< on the border's curve; −1 off the border
};

/// The mesh during remeshing, the surface and the border curves that it follows, and the operations so far.
struct RemeshedSurface {
  HalfEdgeMesh mesh;
  const ZeroLevel& level;
  BorderCurves curves;                                    ///< of the input's borders
  float targetEdge = 0;                                   ///< target edge length where the sizing is 1, cloud's unit
  float maxTurn = std::numeric_limits<float>::infinity(); ///< max TriangleShape::turn of new triangles
  DistanceWeight weightAt;                                ///< for decimation
  RemeshSummary result;                                   ///< counts so far
  std::vector<OperationLog> logs;                         ///< operations since the mesh was compacted, in order

  /// \param surface must outlive this
  RemeshedSurface(const TriangleMesh& triangles, const ZeroLevel& surface, Execution& execution)
      : mesh(triangles, execution), level(surface)
  {}

  Corner corner(std::int32_t vertex) const { return {mesh.positions[vertex], mesh.normals[vertex]}; }

  Site site(std::int32_t vertex) const { return {corner(vertex), mesh.places.empty() ? -1 : mesh.places[vertex]}; }

  void moveTo(std::int32_t vertex, const Site& site)
  {
    mesh.positions[vertex] = site.corner.position;
    mesh.normals[vertex] = site.corner.normal;
    mesh.changed[vertex] = 1;
    if (!mesh.places.empty())
      mesh.places[vertex] = site.place;
  }

  TriangleShape shape(std::int32_t h) const
  {
    return TriangleShape(corner(mesh.origin[h]), corner(mesh.target(h)), corner(mesh.opposite(h)));
  }

  bool mayReplace(const TriangleShape& former, const TriangleShape& next) const
  {
    return next.mayReplace(former, maxTurn);
  }
  /// A quick test, mostly true: `next` may replace the triangle of h whatever its shape. If false, use mayReplace().
  bool isFineFor(std::int32_t h, const TriangleShape& next) const
  {
    return next.sound() && next.turn <= maxTurn && next.turnsLittle(cross(h));
  }

  /// The half-edge of an edge whose target is removed if its ends are merged: the end on the border is kept.
  std::int32_t towardsWhatGoes(std::int32_t edge) const
  {
    return mesh.twin[edge] >= 0 && mesh.onBoundary(mesh.target(edge)) ? mesh.twin[edge] : edge;
  }

  /// Merges the target of h into its origin, at a site. \pre HalfEdgeMesh::mayCollapse(h)
  void merge(std::int32_t h, const Site& site, OperationLog& log)
  {
    const std::int32_t kept = mesh.origin[h];
    log.addCollapse(mesh, h);
    mesh.collapse(h);
    moveTo(kept, site);
  }

  /// True if moving a vertex there spoils none of its triangles.
  bool mayMove(std::int32_t vertex, const Corner& moved) const
  {
    bool fits = true;
    mesh.forOutgoing(vertex, [&](std::int32_t h) {
      if (!fits)
        return;
      const TriangleShape next(moved, corner(mesh.target(h)), corner(mesh.opposite(h)));
      fits = isFineFor(h, next) || mayReplace(shape(h), next);
    });
    return fits;
  }

  /// Normal of the triangle of h; its length is twice the area. Reads positions only, so vertex normals may be missing.
  Eigen::Vector3f cross(std::int32_t h) const
  {
    const Eigen::Vector3f& a = mesh.positions[mesh.origin[h]];
    return (mesh.positions[mesh.target(h)] - a).cross(mesh.positions[mesh.opposite(h)] - a);
  }

  /// Target edge length at a vertex, between two vertices, and of an edge, cloud's unit.
  float targetAt(std::int32_t v) const { return targetEdge * mesh.sizing[v]; }
  float targetBetween(std::int32_t v, std::int32_t w) const { return .5f * (targetAt(v) + targetAt(w)); }
  float targetOf(std::int32_t h) const { return targetBetween(mesh.origin[h], mesh.target(h)); }

  float squaredLength(std::int32_t h) const
  {
    return (mesh.positions[mesh.target(h)] - mesh.positions[mesh.origin[h]]).squaredNorm();
  }

  /// True if the border from one vertex over a site to another vertex is within half of maxStep from its curve.
  bool followsBorder(std::int32_t previous, const Site& site, std::int32_t next) const
  {
    const Eigen::Vector3f& position = site.corner.position;
    const float distance = .5f * level.maxStep();
    return curves.isNear(mesh.places[previous], site.place, mesh.positions[previous], position, distance) &&
           curves.isNear(site.place, mesh.places[next], position, mesh.positions[next], distance);
  }
};

} // namespace pcl::mrf
