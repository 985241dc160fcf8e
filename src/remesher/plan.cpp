// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/plan.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "mesh/mesh_topology.h"
#include "remesher/passes.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t planGrainOfVertices = 2048, planGrainOfTriangles = 16384;
/// Angle by which the surface may turn along an edge: with more, ears and claws get shorter and edges of the shape
/// blunter with every round; with less, triangles on rough clouds are less even.
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
      execution, mesh.vertices.size(), planGrainOfVertices,
      [&](std::uint8_t& fault, std::int32_t begin, std::int32_t end) {
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

float medianEdge(const TriangleMesh& mesh, const std::vector<std::int32_t>& nextOnBorder)
{
  std::vector<float> lengths;
  lengths.reserve(3 * mesh.triangles.size() / 2);
  for (const Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::int32_t v = t[i], w = t[(i + 1) % 3];
      if (v < w || nextOnBorder[v] == w)
        lengths.push_back((mesh.vertices[w] - mesh.vertices[v]).squaredNorm());
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

/// Aims at shorter edges if there would be too few triangles to choose from.
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
  if (plan.triangles > limit) {
    std::ostringstream message;
    message << "remesher.targetEdge = " << plan.targetEdge << " would give about " << plan.triangles
            << " triangles; at least " << plan.targetEdge * std::sqrt(plan.triangles / limit) << " is needed";
    throw ResourceLimit(message.str());
  }
}

} // namespace

bool hasFewFolds(const TriangleMesh& mesh, const ReferenceSurface& level, Execution& execution)
{
  const VertexCorners corners = groupCorners(mesh);
  std::vector<Vector3f> normals(mesh.vertices.size(), Vector3f::Zero());
  forEachPolling<std::int32_t>(execution, mesh.vertices.size(), planGrainOfVertices, [&](std::int32_t v) {
    Vector3f sum = Vector3f::Zero();
    for (std::int32_t n = corners.begin[v]; n < corners.begin[v + 1]; ++n) {
      const Triangle& t = mesh.triangles[corners.corners[n] / 3];
      sum += (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    }
    if (corners.begin[v] < corners.begin[v + 1])
      normals[v] = level.normalAt(mesh.vertices[v], sum.normalized());
  });
  const auto folds =
      partsOf<std::int64_t>(execution, mesh.triangles.size(), planGrainOfTriangles,
                            [&](std::int64_t& count, std::size_t begin, std::size_t end) {
                              for (std::size_t t = begin; t < end; ++t) {
                                const auto corner = [&](std::size_t i) -> Corner {
                                  return {mesh.vertices[mesh.triangles[t][i]], normals[mesh.triangles[t][i]]};
                                };
                                count += isFold(TriangleShape(corner(0), corner(1), corner(2))) ? 1 : 0;
                              }
                            });
  const auto count = static_cast<double>(std::accumulate(folds.begin(), folds.end(), std::int64_t{0}));
  return count <= mostFolds * static_cast<double>(mesh.triangles.size());
}

RemeshPlan planFor(const TriangleMesh& mesh, const EdgeSizing& sizing, const RemesherOptions& options,
                   Execution& execution)
{
  RemeshPlan plan;
  const VertexCorners corners = groupCorners(mesh);
  execution.poll();
  plan.nextOnBorder = bordersOf(mesh, corners, execution);
  const float median = medianEdge(mesh, plan.nextOnBorder);
  execution.poll();
  plan.targetEdge = options.targetEdge > 0 ? options.targetEdge : median;
  if (!sizing.empty() && options.targetEdge == 0) {
    plan.sizing = sizing;
    limitGrowth(mesh, corners, plan.targetEdge, plan.sizing, execution);
  }
  // Edges that are to be longer than they are have to pass by details.
  plan.maxTurn = squared(maxAngle * std::max(1.f, plan.targetEdge / median));
  if (options.triangles > 0)
    shortenFor(options.triangles, mesh, plan);
  plan.triangles = expectedTriangles(mesh, plan);
  checkSize(plan);
  execution.poll();
  // Small triangles must not stay among large ones.
  plan.pinsFolds = plan.targetEdge <= median;
  return plan;
}

} // namespace pcl::mrf
