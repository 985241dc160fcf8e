// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/piece.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "base/text.h"
#include "mesh/mesh_topology.h"
#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t planGrain = 2048;
/// Max angle, in radians, by which the surface may turn along an edge. With more, ears and claws get shorter and sharp
/// edges of the shape blunter with every round; with less, triangles on rough clouds are less even.
constexpr float maxAngle = .8f;

/// \see RemeshPlan::nextOnBorder \throw InvalidInput
std::vector<std::int32_t> bordersOf(const TriangleMesh& mesh, const VertexCorners& corners, Execution& execution)
{
  bool isFaulty = false;
  for (std::size_t t = 0; t < mesh.triangles.size() && !isFaulty; ++t)
    isFaulty = !hasValidIndices(mesh, t) || std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(),
                                                        [&](std::int32_t v) { return !mesh.vertices[v].allFinite(); });
  std::vector<std::int32_t> next(mesh.vertices.size(), -1);
  const auto faults = partsOf<std::uint8_t, std::int32_t>(
      execution, mesh.vertices.size(), planGrain, [&](std::uint8_t& fault, std::int32_t begin, std::int32_t end) {
        Ring ring;
        for (std::int32_t v = begin; v < end; ++v) {
          ring.set(mesh, corners, v);
          if (ring.size() == 0 || ring.isClosedFan())
            continue;
          ring.findEdges();
          bool isFan = ring.joinFans(false) == 1;
          for (const Ring::Edge& edge : ring.edges()) {
            isFan = isFan && edge.sides() <= 2 &&
                    (edge.sides() < 2 || edge.begin[0].isOutgoing != edge.begin[1].isOutgoing);
            if (edge.sides() == 1 && edge.begin->isOutgoing)
              next[v] = edge.to();
          }
          fault |= isFan ? 0 : 1;
        }
      });
  if (isFaulty || std::count(faults.begin(), faults.end(), 0) < static_cast<std::ptrdiff_t>(faults.size()))
    HalfEdgeMesh(mesh, execution); // throws, and tells what is wrong
  return next;
}

/// The median edge length if all voxels had the finest size.
float medianEdge(const TriangleMesh& mesh, const std::vector<std::int32_t>& nextOnBorder, const DistanceField& field,
                 Execution& execution)
{
  const double side = field.lattice().spacing;
  std::vector<float> shares(mesh.vertices.size()); // finest to local voxel side, squared
  forEachPolling<std::int32_t>(execution, mesh.vertices.size(), planGrain, [&](std::int32_t v) {
    shares[v] = squared(static_cast<float>(side / field.voxelSide(mesh.vertices[v])));
  });
  std::vector<float> lengths;
  lengths.reserve(3 * mesh.triangles.size() / 2);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t v = t[i], w = t[(i + 1) % 3];
      if (v < w || nextOnBorder[v] == w)
        lengths.push_back(shares[v] * (mesh.vertices[w] - mesh.vertices[v]).squaredNorm());
    }
  return std::sqrt(median(std::move(lengths)));
}

double expectedTriangles(const TriangleMesh& mesh, const RemeshPlan& plan)
{
  const auto targetOf = [&](std::int32_t v, std::int32_t w) {
    const auto targetAt = [&](std::int32_t vertex) {
      return plan.targetEdge * (plan.sizing.empty() ? 1 : plan.sizing[vertex]);
    };
    return .5f * (targetAt(v) + targetAt(w));
  };
  double sum = 0;
  for (const Triangle& t : mesh.triangles) {
    const double target = (targetOf(t[0], t[1]) + targetOf(t[1], t[2]) + targetOf(t[2], t[0])) / 3;
    const Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    sum += .5 * (b - a).cross(c - a).norm() / (.25 * std::sqrt(3.0) * target * target);
  }
  return sum;
}

/// Max growth of the sizing along the surface, per target edge length.
constexpr float steepestGrowth = .2f;

/// Lowers the sizing of a mesh until target edge lengths grow by at most a fifth of the distance along the surface, so
/// that triangles between short and long edges stay nearly equilateral. \param targetEdge length where the sizing is 1
void limitGrowth(const TriangleMesh& mesh, const VertexCorners& corners, float targetEdge, EdgeSizing& sizing,
                 Execution& execution)
{
  const auto limitFrom = [&](std::int32_t v, std::int32_t w) {
    return sizing[v] + steepestGrowth * (mesh.vertices[w] - mesh.vertices[v]).norm() / targetEdge;
  };
  const auto forNeighbors = [&](std::int32_t v, const auto& body) {
    for (std::int32_t n = corners.begin[v]; n < corners.begin[v + 1]; ++n)
      for (const std::int32_t w : mesh.triangles[corners.corners[n] / 3])
        if (w != v)
          body(w);
  };
  // Dijkstra's shortest paths, with the sizing as the distance, starting at the vertices that limit a neighbor.
  using Entry = std::pair<float, std::int32_t>;
  std::vector<Entry> entries;
  Poller poll(execution);
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(sizing.size()); ++v) {
    poll();
    bool limits = false;
    forNeighbors(v, [&](std::int32_t w) { limits = limits || sizing[w] > limitFrom(v, w); });
    if (limits)
      entries.emplace_back(sizing[v], v);
  }
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue(std::greater<>(), std::move(entries));
  while (!queue.empty()) {
    poll();
    const auto [size, v] = queue.top();
    queue.pop();
    if (size > sizing[v])
      continue; // it was lowered since
    forNeighbors(v, [&, v = v](std::int32_t w) {
      const float limit = limitFrom(v, w);
      if (sizing[w] > limit) {
        sizing[w] = limit;
        queue.emplace(limit, w);
      }
    });
  }
}

/// Shortens the target edge if decimation would have too few triangles to choose from.
void shortenFor(std::int64_t triangles, const TriangleMesh& mesh, RemeshPlan& plan)
{
  constexpr double spare = 1.25;
  const double share = expectedTriangles(mesh, plan) / (spare * static_cast<double>(triangles));
  plan.targetEdge *= static_cast<float>(std::min(1.0, std::sqrt(share)));
}

/// A tiny target edge would ask for more half-edges than 32 bits can count.
void checkSize(const RemeshPlan& plan)
{
  const double limit = 5e8;
  if (plan.triangles > limit)
    throw ResourceLimit(textOf(6, "remesher.targetEdge = ", plan.targetEdge, " would give about ", plan.triangles,
                               " triangles; at least ", plan.targetEdge * std::sqrt(plan.triangles / limit),
                               " is needed"));
}

} // namespace

RemeshPlan planFor(const TriangleMesh& mesh, const DistanceField& field, const EdgeSizing& sizing,
                   const RemesherOptions& options, Execution& execution)
{
  RemeshPlan plan;
  const VertexCorners corners = groupCorners(mesh);
  execution.poll();
  plan.nextOnBorder = bordersOf(mesh, corners, execution);
  const float median = medianEdge(mesh, plan.nextOnBorder, field, execution);
  execution.poll();
  plan.targetEdge = options.targetEdge > 0 ? options.targetEdge : median;
  if (!sizing.empty() && options.targetEdge == 0) {
    plan.sizing = sizing;
    limitGrowth(mesh, corners, plan.targetEdge, plan.sizing, execution);
  }
  // Edges that are longer than those of the mesh have to skip details.
  plan.maxTurn = squared(maxAngle * std::max(1.f, plan.targetEdge / median));
  if (options.triangles > 0)
    shortenFor(options.triangles, mesh, plan);
  plan.triangles = expectedTriangles(mesh, plan);
  checkSize(plan);
  execution.poll();
  // If edges get longer, small pinned triangles must not stay among large ones.
  plan.pinsFolds = plan.targetEdge <= median;
  return plan;
}

} // namespace pcl::mrf
