// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"
#include "mesh/self_intersection.h"
#include "mesh/vertex_fields.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace pcl::mrf {
namespace {

/// Max move of a vertex along an edge, as a share of the edge, so that no triangle vanishes.
constexpr float maxShareOfEdge = .8f;

/// When a vertex moves: min cosine of the angle by which a triangle turns (60°), and min ratio of its new to old area.
constexpr float minTurn = .5f, minShrink = .1f;

class BorderTightener {
public:
  BorderTightener(TriangleMesh& mesh, const Support& support) : mesh_(mesh), support_(support), before_(mesh.vertices)
  {}

  std::int64_t run(Execution& execution)
  {
    const std::vector<std::uint8_t> isNear = findRing();
    corners_ = groupCorners(mesh_, isNear);
    measureMargins(execution);
    for (const std::int32_t v : border_)
      if (margins_[v] < 0)
        pull(v);
    takeBackWhatIntersects(isNear, execution);
    return std::count_if(border_.begin(), border_.end(), [&](std::int32_t v) { return hasMoved(v); });
  }

private:
  /// Finds the border's vertices. \return flags of the triangles around them
  std::vector<std::uint8_t> findRing()
  {
    const VertexCorners corners = groupCorners(mesh_);
    std::vector<std::uint8_t> isBorder(mesh_.vertices.size(), 0), isNear(mesh_.triangles.size(), 0);
    Ring ring;
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      ring.set(mesh_, corners, static_cast<std::int32_t>(v));
      if (ring.isClosedFan())
        continue;
      ring.findEdges();
      const auto endsMesh = [](const Ring::Edge& edge) { return edge.sides() == 1; };
      if (std::any_of(ring.edges().begin(), ring.edges().end(), endsMesh)) {
        border_.push_back(static_cast<std::int32_t>(v));
        for (std::int32_t n = 0; n < ring.size(); ++n)
          isNear[ring.corner(n) / 3] = 1;
      }
    }
    return isNear;
  }

  /// Measures the margins of all corners of these triangles.
  void measureMargins(Execution& execution)
  {
    std::vector<std::int32_t> vertices;
    margins_.assign(mesh_.vertices.size(), 0);
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v)
      if (corners_.begin[v] < corners_.begin[v + 1])
        vertices.push_back(static_cast<std::int32_t>(v));
    execution.forRange(vertices.size(), 1024, [&](std::size_t begin, std::size_t end) {
      Neighbors nearest;
      for (std::size_t n = begin; n < end; ++n)
        margins_[vertices[n]] = support_.margin(mesh_.vertices[vertices[n]], nearest);
    });
  }

  /// The neighbor in whose direction support is closest; the vertex itself if no neighbor has support.
  std::int32_t nearestWithSupport(std::int32_t vertex) const
  {
    std::int32_t best = vertex;
    float distance = std::numeric_limits<float>::infinity();
    for (std::int32_t c = corners_.begin[vertex]; c < corners_.begin[vertex + 1]; ++c)
      for (const std::int32_t other : mesh_.triangles[corners_.corners[c] / 3]) {
        if (!(margins_[other] > 0))
          continue;
        const float length = (mesh_.vertices[other] - mesh_.vertices[vertex]).norm();
        const float begins = length * share(vertex, other);
        if (begins < distance || (begins == distance && other < best)) {
          distance = begins;
          best = other;
        }
      }
    return best;
  }

  /// Share of the way between two vertices at which support begins, if the margin is linear.
  float share(std::int32_t without, std::int32_t with) const
  {
    return margins_[without] / (margins_[without] - margins_[with]);
  }

  void pull(std::int32_t vertex)
  {
    const std::int32_t goal = nearestWithSupport(vertex);
    if (goal == vertex)
      return;
    const Eigen::Vector3f start = mesh_.vertices[vertex], way = mesh_.vertices[goal] - start;
    constexpr int tries = 6;
    float part = std::min(share(vertex, goal), maxShareOfEdge);
    for (int n = 0; n < tries; ++n, part *= .8f) {
      const Eigen::Vector3f position = start + part * way;
      if (!keepsTriangles(vertex, position))
        continue;
      mesh_.vertices[vertex] = position;
      margins_[vertex] = 0;
      return;
    }
  }

  bool keepsTriangles(std::int32_t vertex, const Eigen::Vector3f& position) const
  {
    for (std::int32_t c = corners_.begin[vertex]; c < corners_.begin[vertex + 1]; ++c) {
      const Triangle& t = mesh_.triangles[corners_.corners[c] / 3];
      const std::size_t corner = corners_.corners[c] % 3;
      const Eigen::Vector3f &b = mesh_.vertices[t[(corner + 1) % 3]], &d = mesh_.vertices[t[(corner + 2) % 3]];
      const Eigen::Vector3f before = (b - mesh_.vertices[vertex]).cross(d - mesh_.vertices[vertex]);
      const Eigen::Vector3f after = (b - position).cross(d - position);
      const float lengths = before.norm() * after.norm();
      if (!(before.dot(after) > minTurn * lengths) || !(after.norm() > minShrink * before.norm()))
        return false;
    }
    return true;
  }

  bool hasMoved(std::int32_t vertex) const { return mesh_.vertices[vertex] != before_[vertex]; }

  /// Moves vertices back until no triangles at the border intersect, but for those that did so before.
  void takeBackWhatIntersects(const std::vector<std::uint8_t>& isNear, Execution& execution)
  {
    TriangleMesh ring;
    for (std::size_t t = 0; t < isNear.size(); ++t)
      if (isNear[t])
        ring.triangles.push_back(mesh_.triangles[t]);
    bool isTakenBack = true;
    while (isTakenBack) {
      isTakenBack = false;
      ring.vertices.swap(mesh_.vertices);
      const std::vector<std::int32_t> intersecting = selfIntersectingTriangles(ring, execution);
      ring.vertices.swap(mesh_.vertices);
      for (const std::int32_t t : intersecting)
        for (const std::int32_t v : ring.triangles[t])
          if (hasMoved(v)) {
            mesh_.vertices[v] = before_[v];
            isTakenBack = true;
          }
    }
  }

  TriangleMesh& mesh_;
  const Support& support_;
  const std::vector<Eigen::Vector3f> before_;
  VertexCorners corners_; ///< of the triangles around the border
  std::vector<std::int32_t> border_;
  std::vector<float> margins_; ///< by vertex
};

} // namespace

std::int64_t tightenBorders(TriangleMesh& mesh, const Support& support, Execution& execution)
{
  return BorderTightener(mesh, support).run(execution);
}

} // namespace pcl::mrf
