// SPDX-License-Identifier: BSD-3-Clause
#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace pcl::mrf {
namespace {

constexpr double degenerateQuality = 1e-6;

/// 2 · inradius / circumradius. With the area A, the sides' product p and half their sum s, these are A/s and p/(4A).
inline double qualityOf(const TriangleCorners& t)
{
  const double sideA = (t.b - t.c).norm(), sideB = (t.c - t.a).norm(), sideC = (t.a - t.b).norm(), twice = 2 * t.area();
  const double value = 4 * twice * twice / ((sideA + sideB + sideC) * sideA * sideB * sideC);
  return std::isfinite(value) ? std::min(value, 1.) : 0;
}

/// Sums over triangles.
struct TriangleSums {
  double area = 0, squaredArea = 0, volume = 0, quality = 0, minQuality = 1;
  std::int64_t degenerate = 0;

  void add(const TriangleMesh& mesh, std::size_t t)
  {
    double triangleQuality = 0;
    if (hasValidIndices(mesh, t)) {
      const TriangleCorners corners(mesh, mesh.triangles[t]);
      const double triangleArea = corners.area();
      if (std::isfinite(triangleArea)) {
        area += triangleArea;
        volume += corners.a.dot(corners.b.cross(corners.c)) / 6;
        squaredArea += triangleArea * triangleArea;
        triangleQuality = qualityOf(corners);
      }
    }
    quality += triangleQuality;
    minQuality = std::min(minQuality, triangleQuality);
    degenerate += triangleQuality < degenerateQuality ? 1 : 0;
  }

  void add(const TriangleSums& other)
  {
    area += other.area;
    squaredArea += other.squaredArea;
    volume += other.volume;
    quality += other.quality;
    minQuality = std::min(minQuality, other.minQuality);
    degenerate += other.degenerate;
  }
};

constexpr std::int64_t qualityGrain = 16384;

/// The sum of all parts, added in order.
template <typename Sums>
Sums total(const std::vector<Sums>& parts)
{
  Sums result;
  for (const Sums& part : parts)
    result.add(part);
  return result;
}

void measureTriangles(const TriangleMesh& mesh, MeshStatistics& statistics, Execution& execution)
{
  if (mesh.triangles.empty())
    return;
  const auto sums = total(partsOf<TriangleSums>(execution, mesh.triangles.size(), qualityGrain,
                                                [&](TriangleSums& part, std::size_t begin, std::size_t end) {
                                                  for (std::size_t t = begin; t < end; ++t)
                                                    part.add(mesh, t);
                                                }));
  const auto count = static_cast<double>(mesh.triangles.size());
  statistics.area = sums.area;
  statistics.volume = sums.volume;
  statistics.degenerateTriangles = sums.degenerate;
  statistics.minQuality = sums.minQuality;
  statistics.meanQuality = sums.quality / count;
  const double meanArea = sums.area / count;
  if (meanArea > 0)
    statistics.areaDeviation = std::sqrt(std::max(sums.squaredArea / count - meanArea * meanArea, 0.)) / meanArea;
}

/// Sums over vertices. An edge counts at the vertex with the smaller index.
struct VertexSums {
  std::int64_t edges = 0, finiteEdges = 0, boundaryEdges = 0, nonManifoldEdges = 0, nonManifoldVertices = 0;
  double lengths = 0, shortest = std::numeric_limits<double>::infinity(), longest = 0;
  std::array<std::int64_t, 16> valences{};
  std::vector<std::int32_t> boundarySides;
  std::vector<std::array<std::int32_t, 2>> boundaryJoins; ///< pairs of boundary sides that share a vertex

  void add(const VertexSums& other)
  {
    edges += other.edges;
    finiteEdges += other.finiteEdges;
    boundaryEdges += other.boundaryEdges;
    nonManifoldEdges += other.nonManifoldEdges;
    nonManifoldVertices += other.nonManifoldVertices;
    lengths += other.lengths;
    shortest = std::min(shortest, other.shortest);
    longest = std::max(longest, other.longest);
    for (std::size_t n = 0; n < valences.size(); ++n)
      valences[n] += other.valences[n];
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(boundarySides, other.boundarySides);
    append(boundaryJoins, other.boundaryJoins);
  }
};

void countEdge(const TriangleMesh& mesh, std::int32_t from, std::int32_t to, VertexSums& sums)
{
  ++sums.edges;
  const double length = (mesh.vertices[from].cast<double>() - mesh.vertices[to].cast<double>()).norm();
  if (!std::isfinite(length))
    return;
  ++sums.finiteEdges;
  sums.lengths += length;
  sums.shortest = std::min(sums.shortest, length);
  sums.longest = std::max(sums.longest, length);
}

/// Counts the edges of a vertex that is on the boundary or not manifold. Joins its fans over edges with two sides.
void countEdges(const TriangleMesh& mesh, std::int32_t vertex, Ring& ring, VertexSums& sums)
{
  bool isCrowded = false;
  for (const Ring::Edge& edge : ring.edges()) {
    isCrowded = isCrowded || edge.sides() > 2;
    if (edge.to() < vertex)
      continue;
    countEdge(mesh, vertex, edge.to(), sums);
    const bool agree = edge.sides() == 2 && edge.begin->isOutgoing == edge.begin[1].isOutgoing;
    sums.boundaryEdges += edge.sides() == 1 ? 1 : 0;
    sums.nonManifoldEdges += edge.sides() > 2 || agree ? 1 : 0;
    if (edge.sides() == 1)
      sums.boundarySides.push_back(ring.sideNumber(*edge.begin));
  }
  sums.nonManifoldVertices += ring.joinFans(false) > 1 || isCrowded ? 1 : 0;
}

/// Joins the two boundary sides of each fan to a loop. \pre the fans over edges with two sides are joined
void joinBoundary(const Ring& ring, VertexSums& sums)
{
  std::map<std::int32_t, std::int32_t> sideOfFan;
  for (const Ring::Edge& edge : ring.edges()) {
    if (edge.sides() != 1)
      continue;
    const std::int32_t side = ring.sideNumber(*edge.begin);
    const auto [other, isFirst] = sideOfFan.try_emplace(ring.fan(edge.begin->at), side);
    if (!isFirst)
      sums.boundaryJoins.push_back({other->second, side});
  }
}

/// \param triangles will be joined over shared edges
VertexSums countVertices(const TriangleMesh& mesh, DisjointSets& triangles, Execution& execution)
{
  return total(partsOfRings<VertexSums>(mesh, {}, execution, [&](VertexSums& sums, Ring& ring, std::int32_t vertex) {
    const auto countValence = [&](std::size_t edges) { ++sums.valences[std::min<std::size_t>(edges, 15)]; };
    if (ring.isClosedFan()) {
      countValence(static_cast<std::size_t>(ring.size()));
      for (std::int32_t i = 0; i < ring.size(); ++i)
        if (ring.following(i) > vertex)
          countEdge(mesh, vertex, ring.following(i), sums);
    } else {
      ring.findEdges();
      countValence(ring.edges().size());
      countEdges(mesh, vertex, ring, sums);
      joinBoundary(ring, sums);
    }
    joinTriangles(ring, triangles);
  }));
}

std::int64_t countLoops(std::vector<std::int32_t> sides, const std::vector<std::array<std::int32_t, 2>>& joins)
{
  std::sort(sides.begin(), sides.end());
  DisjointSets loops(sides.size());
  const auto numberOf = [&](std::int32_t side) {
    return static_cast<std::uint32_t>(std::lower_bound(sides.begin(), sides.end(), side) - sides.begin());
  };
  for (const auto& join : joins)
    loops.join(numberOf(join[0]), numberOf(join[1]));
  std::int64_t count = 0;
  for (std::uint32_t n = 0; n < sides.size(); ++n)
    count += loops.find(n) == n ? 1 : 0;
  return count;
}

} // namespace

double triangleQuality(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c)
{
  return qualityOf({a, b, c});
}

MeshStatistics measure(const TriangleMesh& mesh)
{
  Execution serial(1);
  return measure(mesh, serial);
}

MeshStatistics measure(const TriangleMesh& mesh, Execution& execution)
{
  MeshStatistics statistics;
  statistics.vertices = static_cast<std::int64_t>(mesh.vertices.size());
  statistics.triangles = static_cast<std::int64_t>(mesh.triangles.size());
  measureTriangles(mesh, statistics, execution);

  DisjointSets triangles(mesh.triangles.size());
  VertexSums sums = countVertices(mesh, triangles, execution);
  statistics.edges = sums.edges;
  statistics.boundaryEdges = sums.boundaryEdges;
  statistics.nonManifoldEdges = sums.nonManifoldEdges;
  statistics.nonManifoldVertices = sums.nonManifoldVertices;
  statistics.valences = sums.valences;
  statistics.unusedVertices = sums.valences[0];
  if (sums.finiteEdges > 0) {
    statistics.meanEdge = sums.lengths / static_cast<double>(sums.finiteEdges);
    statistics.minEdge = sums.shortest;
    statistics.maxEdge = sums.longest;
  }
  statistics.boundaryLoops = countLoops(std::move(sums.boundarySides), sums.boundaryJoins);
  std::vector<std::int32_t> componentOfTriangle;
  statistics.components = numberComponents(mesh, {}, triangles, execution, componentOfTriangle);
  const auto faces = std::count_if(componentOfTriangle.begin(), componentOfTriangle.end(),
                                   [](std::int32_t component) { return component >= 0; });
  statistics.eulerCharacteristic = statistics.vertices - statistics.unusedVertices - statistics.edges + faces;
  return statistics;
}

} // namespace pcl::mrf
