// SPDX-License-Identifier: BSD-3-Clause
#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl::mrf {
namespace {

constexpr double degenerateQuality = 1e-6;

/// The positions of a triangle's corners in double precision.
struct Corners {
  Eigen::Vector3d a, b, c;

  Corners(const Eigen::Vector3f& first, const Eigen::Vector3f& second, const Eigen::Vector3f& third)
      : a(first.cast<double>()), b(second.cast<double>()), c(third.cast<double>())
  {}

  Corners(const TriangleMesh& mesh, const Triangle& t)
      : Corners(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])
  {}

  double area() const { return (b - a).cross(c - a).norm() / 2; }
  double volume() const { return a.dot(b.cross(c)) / 6; }

  /// With the area A, the sides' product p and half their sum s: inradius A/s, circumradius p/(4A).
  double quality() const
  {
    const double sideA = (b - c).norm(), sideB = (c - a).norm(), sideC = (a - b).norm(), twice = 2 * area();
    const double value = 4 * twice * twice / ((sideA + sideB + sideC) * sideA * sideB * sideC);
    return std::isfinite(value) ? std::min(value, 1.) : 0;
  }
};

/// What is summed over triangles.
struct TriangleSums {
  double area = 0, squaredArea = 0, volume = 0, quality = 0, minQuality = 1;
  std::int64_t degenerate = 0;

  void add(const TriangleMesh& mesh, std::size_t t)
  {
    double triangleQuality = 0;
    if (hasValidIndices(mesh, t)) {
      const Corners corners(mesh, mesh.triangles[t]);
      const double triangleArea = corners.area();
      if (std::isfinite(triangleArea)) {
        area += triangleArea;
        volume += corners.volume();
        squaredArea += triangleArea * triangleArea;
        triangleQuality = corners.quality();
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

/// Those of all parts, added in their order.
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

/// What is summed over vertices. An edge counts at its smaller vertex.
struct VertexSums {
  std::int64_t edges = 0, finiteEdges = 0, boundaryEdges = 0, nonManifoldEdges = 0, nonManifoldVertices = 0;
  double lengths = 0, shortest = std::numeric_limits<double>::infinity(), longest = 0;
  std::array<std::int64_t, 16> valences{};
  std::vector<std::int32_t> boundarySides;
  std::vector<std::array<std::int32_t, 2>> boundaryJoins; ///< sides of the boundary that continue in each other
  std::vector<CornerFan> separate;

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
    append(separate, other.separate);
  }
};

/// Collects the sums of a range of vertices.
class VertexCensus {
public:
  VertexCensus(const TriangleMesh& mesh, const VertexCorners& corners, EdgeConnectivity& connectivity, VertexSums& sums)
      : mesh_(mesh), corners_(corners), connectivity_(connectivity), sums_(sums)
  {}

  void count(std::int32_t vertex)
  {
    ring_.set(mesh_, corners_, vertex);
    if (ring_.isClosedFan()) {
      countValence(ring_.size());
      for (std::int32_t i = 0; i < ring_.size(); ++i)
        if (ring_.following(i) > vertex)
          countEdge(vertex, ring_.following(i));
    } else {
      ring_.findEdges();
      countValence(static_cast<std::int32_t>(ring_.edges().size()));
      countEdges(vertex);
      joinBoundary();
    }
    connectivity_.note(vertex, ring_, sums_.separate);
  }

private:
  void countValence(std::int32_t edges) { ++sums_.valences[std::min(edges, 15)]; }

  void countEdge(std::int32_t from, std::int32_t to)
  {
    const auto position = [&](std::int32_t v) { return mesh_.vertices[v].cast<double>(); };
    ++sums_.edges;
    const double length = (position(from) - position(to)).norm();
    if (!std::isfinite(length))
      return;
    ++sums_.finiteEdges;
    sums_.lengths += length;
    sums_.shortest = std::min(sums_.shortest, length);
    sums_.longest = std::max(sums_.longest, length);
  }

  void countEdges(std::int32_t vertex)
  {
    bool isCrowded = false;
    for (const Ring::Edge& edge : ring_.edges()) {
      isCrowded = isCrowded || edge.sides() > 2;
      if (edge.to() < vertex)
        continue;
      countEdge(vertex, edge.to());
      const bool agree = edge.sides() == 2 && edge.begin->isOutgoing == edge.begin[1].isOutgoing;
      sums_.boundaryEdges += edge.sides() == 1 ? 1 : 0;
      sums_.nonManifoldEdges += edge.sides() > 2 || agree ? 1 : 0;
      if (edge.sides() == 1)
        sums_.boundarySides.push_back(ring_.sideNumber(*edge.begin));
    }
    sums_.nonManifoldVertices += ring_.joinFans(false) > 1 || isCrowded ? 1 : 0;
  }

  /// A boundary side continues in the one that ends the same fan. \pre the fans over edges with two sides are joined
  void joinBoundary()
  {
    constexpr std::int32_t none = -1;
    sideOfFan_.assign(ring_.size(), none);
    for (const Ring::Edge& edge : ring_.edges()) {
      if (edge.sides() != 1)
        continue;
      const std::int32_t side = ring_.sideNumber(*edge.begin);
      std::int32_t& other = sideOfFan_[ring_.fan(edge.begin->at)];
      if (other == none)
        other = side;
      else
        sums_.boundaryJoins.push_back({other, side});
    }
  }

  const TriangleMesh& mesh_;
  const VertexCorners& corners_;
  EdgeConnectivity& connectivity_;
  VertexSums& sums_;
  Ring ring_;
  std::vector<std::int32_t> sideOfFan_;
};

VertexSums countVertices(const TriangleMesh& mesh, EdgeConnectivity& connectivity, Execution& execution)
{
  const VertexCorners corners = groupCorners(mesh);
  return total(partsOf<VertexSums, std::int32_t>(execution, mesh.vertices.size(), qualityGrain,
                                                 [&](VertexSums& part, std::int32_t begin, std::int32_t end) {
                                                   VertexCensus census(mesh, corners, connectivity, part);
                                                   for (std::int32_t v = begin; v < end; ++v)
                                                     census.count(v);
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
  return Corners(a, b, c).quality();
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

  EdgeConnectivity connectivity(mesh.vertices.size());
  VertexSums sums = countVertices(mesh, connectivity, execution);
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
  statistics.components = connectivity.components(mesh, {}, std::move(sums.separate), execution, componentOfTriangle);
  const auto faces = std::count_if(componentOfTriangle.begin(), componentOfTriangle.end(),
                                   [](std::int32_t component) { return component >= 0; });
  statistics.eulerCharacteristic = statistics.vertices - statistics.unusedVertices - statistics.edges + faces;
  return statistics;
}

} // namespace pcl::mrf
