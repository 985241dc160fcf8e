#include "half_edge_mesh.h"

#include "support/shapes.h"

#include <pcl/surface/mrf/mesh_quality.h>
#include <pcl/surface/mrf/polygonizer.h>

#include <gtest/gtest.h>

#include <random>
#include <vector>

using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

TriangleMesh zeroLevel(const DistanceField& field)
{
  Execution execution(1);
  return polygonize(field, {}, execution);
}

/// All that the arrays promise each other.
void expectConsistent(const HalfEdgeMesh& mesh)
{
  std::vector<int> corners(mesh.positions.size(), 0), edges(mesh.positions.size(), 0);
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); ++h) {
    const std::int32_t v = mesh.origin[h], twin = mesh.twin[h];
    if (v < 0)
      continue;
    ASSERT_GE(mesh.target(h), 0);
    ASSERT_NE(v, mesh.target(h));
    ++corners[v];
    if (twin >= 0) {
      ASSERT_EQ(mesh.twin[twin], h);
      ASSERT_EQ(mesh.origin[twin], mesh.target(h));
      ASSERT_EQ(mesh.target(twin), v);
    }
    if (mesh.represents(h)) {
      ++edges[v];
      ++edges[mesh.target(h)];
    }
  }
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v) {
    if (mesh.outgoing[v] < 0) {
      ASSERT_EQ(corners[v], 0);
      continue;
    }
    ASSERT_EQ(mesh.origin[mesh.outgoing[v]], v);
    int met = 0, neighbours = 0;
    mesh.forOutgoing(v, [&](std::int32_t h) { met += mesh.origin[h] == v ? 1 : 0; });
    mesh.forNeighbours(v, [&](std::int32_t) { ++neighbours; });
    ASSERT_EQ(met, corners[v]) << "turning from outgoing must meet all triangles";
    ASSERT_EQ(neighbours, edges[v]);
    ASSERT_EQ(mesh.valence[v], edges[v]);
  }
}

/// Operations in random order wherever they are allowed; geometry plays no part.
void shake(HalfEdgeMesh& mesh, unsigned seed, int operations)
{
  std::mt19937 random(seed);
  for (int i = 0; i < operations; ++i) {
    const auto h = static_cast<std::int32_t>(random() % static_cast<unsigned>(mesh.halfEdgeCount()));
    if (mesh.origin[h] < 0)
      continue;
    const std::int32_t g = mesh.twin[h], a = mesh.origin[h], b = mesh.target(h);
    switch (random() % 4) {
    case 0:
      mesh.split(h, .5f * (mesh.positions[a] + mesh.positions[b]), mesh.normals[a]);
      break;
    case 1:
    case 2: // twice as often, or the mesh would only grow
      if (g >= 0 && !mesh.onBoundary(b) && mesh.mayCollapse(h))
        mesh.collapse(h);
      break;
    default:
      if (g >= 0 && mesh.valence[a] > 3 && mesh.valence[b] > 3 && !mesh.adjacent(mesh.opposite(h), mesh.opposite(g)))
        mesh.flip(h);
    }
  }
}

} // namespace

TEST(HalfEdgeMesh, KeepsItsInvariantsAndTheTopologyUnderRandomOperations)
{
  const std::vector<shapes::Sdf> sdfs = {shapes::sphere(.7), shapes::torus(.6, .25), shapes::plane({.1, .2, 1})};
  for (std::size_t s = 0; s < sdfs.size(); ++s) {
    const TriangleMesh raw = zeroLevel(shapes::field(sdfs[s], 1, 10));
    const std::int64_t euler = measure(raw).eulerCharacteristic;
    HalfEdgeMesh mesh(raw);
    expectConsistent(mesh);
    for (unsigned seed = 1; seed <= 8; ++seed) {
      shake(mesh, seed, 1000);
      expectConsistent(mesh);
      mesh.compact();
      expectConsistent(mesh);
      const MeshStatistics census = measure(mesh.toTriangles());
      ASSERT_EQ(census.nonManifoldEdges + census.nonManifoldVertices, 0);
      ASSERT_EQ(census.eulerCharacteristic, euler);
      ASSERT_EQ(census.boundaryEdges == 0, s < 2);
    }
  }
}

TEST(HalfEdgeMesh, CollapsesATetrahedronNoFurther)
{
  // An octahedron, down to the smallest closed surface.
  TriangleMesh octahedron;
  octahedron.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  HalfEdgeMesh mesh(octahedron);
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); ++h)
    if (mesh.origin[h] >= 0 && mesh.mayCollapse(h))
      mesh.collapse(h);
  expectConsistent(mesh);
  mesh.compact();
  const MeshStatistics census = measure(mesh.toTriangles());
  EXPECT_EQ(census.triangles, 4);
  EXPECT_EQ(census.vertices, 4);
  EXPECT_EQ(census.nonManifoldEdges + census.nonManifoldVertices, 0);
}

TEST(HalfEdgeMesh, KeepsTheOrderOfAnUntouchedMesh)
{
  const TriangleMesh raw = zeroLevel(shapes::field(shapes::sphere(.7), 1, 10));
  HalfEdgeMesh mesh(raw);
  mesh.compact();
  EXPECT_EQ(mesh.toTriangles().triangles, raw.triangles);
}
