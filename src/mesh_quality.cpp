#include "mesh_topology.h"

#include <pcl/surface/mrf/mesh_quality.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace {

constexpr double degenerateQuality = 1e-6;

/// The positions of a triangle's corners in double precision.
struct Corners {
  Eigen::Vector3d a, b, c;

  Corners(const Eigen::Vector3f& first, const Eigen::Vector3f& second, const Eigen::Vector3f& third)
      : a(first.cast<double>()), b(second.cast<double>()), c(third.cast<double>())
  {}

  Corners(const TriangleMesh& mesh, const Triangle& t)
      : Corners(mesh.vertices[static_cast<std::size_t>(t[0])], mesh.vertices[static_cast<std::size_t>(t[1])],
                mesh.vertices[static_cast<std::size_t>(t[2])])
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

constexpr std::int64_t grain = 16384;

/// Sums of type Sums over `count` items, chunk by chunk, added in their order.
template <typename Sums, typename Body>
Sums sumUp(std::size_t count, Execution& execution, const Body& body)
{
  std::vector<Sums> partial((count + grain - 1) / grain);
  execution.forRange(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
    Sums& sums = partial[static_cast<std::size_t>(begin / grain)];
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      body(sums, i);
  });
  Sums total;
  for (const Sums& sums : partial)
    total.add(sums);
  return total;
}

void measureTriangles(const TriangleMesh& mesh, MeshStatistics& statistics, Execution& execution)
{
  if (mesh.triangles.empty())
    return;
  const auto sums = sumUp<TriangleSums>(mesh.triangles.size(), execution,
                                        [&](TriangleSums& partial, std::size_t t) { partial.add(mesh, t); });
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

/// Lengths, valences and kinds of edges. \return per vertex, whether more than two triangles meet at one of its edges
std::vector<std::uint8_t> measureEdges(const TriangleMesh& mesh, const EdgeSides& edges, MeshStatistics& statistics)
{
  std::vector<std::uint8_t> crowded(mesh.vertices.size(), 0);
  std::vector<std::int32_t> valence(mesh.vertices.size(), 0);
  double lengths = 0, shortest = std::numeric_limits<double>::infinity();
  std::int64_t finiteEdges = 0;
  for (std::size_t e = 0; e < edges.count(); ++e) {
    const std::int32_t side = edges.side(e, 0), sides = edges.sidesOf(e);
    const auto from = static_cast<std::size_t>(vertexAt(mesh, side));
    const auto to = static_cast<std::size_t>(vertexAt(mesh, nextCorner(side)));
    ++valence[from];
    ++valence[to];
    if (sides > 2)
      crowded[from] = crowded[to] = 1;
    const bool agree = sides == 2 && vertexAt(mesh, edges.side(e, 1)) == vertexAt(mesh, side);
    statistics.boundaryEdges += sides == 1 ? 1 : 0;
    statistics.nonManifoldEdges += sides > 2 || agree ? 1 : 0;
    const double length = (mesh.vertices[from].cast<double>() - mesh.vertices[to].cast<double>()).norm();
    if (!std::isfinite(length))
      continue;
    ++finiteEdges;
    lengths += length;
    shortest = std::min(shortest, length);
    statistics.maxEdge = std::max(statistics.maxEdge, length);
  }
  statistics.edges = static_cast<std::int64_t>(edges.count());
  if (finiteEdges > 0) {
    statistics.meanEdge = lengths / static_cast<double>(finiteEdges);
    statistics.minEdge = shortest;
  }
  for (const std::int32_t edgesAtVertex : valence) {
    ++statistics.valences[static_cast<std::size_t>(std::min(edgesAtVertex, 15))];
    statistics.unusedVertices += edgesAtVertex == 0 ? 1 : 0;
  }
  return crowded;
}

/// Vertices whose triangles fall into more than one fan, or that an edge with more than two triangles ends in.
std::int64_t countNonManifoldVertices(const TriangleMesh& mesh, DisjointSets& fans, std::vector<std::uint8_t> bad)
{
  std::vector<std::int32_t> fanOf(mesh.vertices.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!hasValidIndices(mesh, t))
      continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto v = static_cast<std::size_t>(mesh.triangles[t][c]);
      const std::int32_t fan = fans.find(static_cast<std::int32_t>(3 * t + c));
      if (fanOf[v] == -1)
        fanOf[v] = fan;
      else if (fanOf[v] != fan)
        bad[v] = 1;
    }
  }
  return std::count(bad.begin(), bad.end(), 1);
}

/// A boundary side continues in the one that ends the same fan.
std::int64_t countBoundaryLoops(const TriangleMesh& mesh, const EdgeSides& edges, DisjointSets& fans)
{
  DisjointSets loops(3 * mesh.triangles.size());
  std::vector<std::int32_t> sideOfFan(3 * mesh.triangles.size(), -1), boundary;
  for (std::size_t e = 0; e < edges.count(); ++e) {
    if (edges.sidesOf(e) != 1)
      continue;
    const std::int32_t side = edges.side(e, 0);
    boundary.push_back(side);
    for (const std::int32_t corner : {side, nextCorner(side)}) {
      std::int32_t& other = sideOfFan[static_cast<std::size_t>(fans.find(corner))];
      if (other == -1)
        other = side;
      else
        loops.unite(other, side);
    }
  }
  return std::count_if(boundary.begin(), boundary.end(), [&](std::int32_t side) { return loops.find(side) == side; });
}

std::int32_t numberComponents(const TriangleMesh& mesh, const EdgeSides& edges,
                              std::vector<std::int32_t>& componentOfTriangle)
{
  DisjointSets sets = groupTriangles(edges, std::vector<std::uint8_t>(mesh.triangles.size(), 1));
  std::int32_t components = 0;
  componentOfTriangle.assign(mesh.triangles.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!hasValidIndices(mesh, t))
      continue;
    // The representative is the first triangle of its component.
    const auto first = static_cast<std::size_t>(sets.find(static_cast<std::int32_t>(t)));
    componentOfTriangle[t] = first == t ? components++ : componentOfTriangle[first];
  }
  return components;
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

  const EdgeSides edges = groupSides(mesh);
  const std::vector<std::uint8_t> crowded = measureEdges(mesh, edges, statistics);
  DisjointSets fans = groupFans(mesh, edges);
  statistics.nonManifoldVertices = countNonManifoldVertices(mesh, fans, crowded);
  statistics.boundaryLoops = countBoundaryLoops(mesh, edges, fans);
  std::vector<std::int32_t> componentOfTriangle;
  statistics.components = numberComponents(mesh, edges, componentOfTriangle);
  const auto faces = std::count_if(componentOfTriangle.begin(), componentOfTriangle.end(),
                                   [](std::int32_t component) { return component >= 0; });
  statistics.eulerCharacteristic = statistics.vertices - statistics.unusedVertices - statistics.edges + faces;
  return statistics;
}

std::int32_t connectedComponents(const TriangleMesh& mesh, std::vector<std::int32_t>& componentOfTriangle)
{
  return numberComponents(mesh, groupSides(mesh), componentOfTriangle);
}

} // namespace mrf
} // namespace pcl
