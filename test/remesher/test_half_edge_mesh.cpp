// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/border_curves.h"
#include "remesher/half_edge_mesh.h"
#include "remesher/operation_log.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

/// Expects the arrays of the mesh to be consistent with each other.
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
    int met = 0, neighbors = 0;
    mesh.forOutgoing(v, [&](std::int32_t h) { met += mesh.origin[h] == v ? 1 : 0; });
    mesh.forNeighbors(v, [&](std::int32_t) { ++neighbors; });
    ASSERT_EQ(met, corners[v]) << "turning from outgoing must meet all triangles";
    ASSERT_EQ(neighbors, edges[v]);
    ASSERT_EQ(mesh.valence[v], edges[v]);
  }
}

/// Does random operations wherever they are allowed, recorded in several logs in turn; geometry is ignored.
void shake(HalfEdgeMesh& mesh, unsigned seed, int operations, std::vector<OperationLog>& logs)
{
  std::mt19937 random(seed);
  for (int i = 0; i < operations; ++i) {
    const auto h = static_cast<std::int32_t>(random() % static_cast<unsigned>(mesh.halfEdgeCount()));
    if (mesh.origin[h] < 0)
      continue;
    const std::int32_t g = mesh.twin[h], a = mesh.origin[h], b = mesh.target(h);
    OperationLog& log = logs[static_cast<std::size_t>(i) * logs.size() / static_cast<std::size_t>(operations)];
    switch (random() % 4) {
    case 0: {
      const Vector3f middle = .5f * (mesh.positions[a] + mesh.positions[b]), normal = mesh.normals[a];
      const HalfEdgeMesh::Room room = mesh.makeRoom(1);
      log.addSplit(mesh, h, room);
      mesh.split(h, room, middle, normal);
      break;
    }
    case 1:
    case 2: // twice as often, or the mesh would only grow
      if ((g < 0 || !mesh.onBoundary(b)) && mesh.mayCollapse(h)) {
        log.addCollapse(mesh, h);
        mesh.collapse(h);
        mesh.positions[a] = .5f * (mesh.positions[a] + mesh.positions[b]);
        mesh.normals[a] = -mesh.normals[a];
      }
      break;
    default:
      if (g >= 0 && mesh.valence[a] > 3 && mesh.valence[b] > 3 && !mesh.adjacent(mesh.opposite(h), mesh.opposite(g))) {
        log.addFlip(mesh, h);
        mesh.flip(h);
      }
    }
  }
}

void shake(HalfEdgeMesh& mesh, unsigned seed, int operations)
{
  std::vector<OperationLog> logs(1);
  shake(mesh, seed, operations, logs);
}

/// The triangles that were not removed, sorted; each begins with its smallest vertex.
std::vector<Triangle> sortedTriangles(const HalfEdgeMesh& mesh)
{
  std::vector<Triangle> triangles;
  for (std::int32_t t = 0; t < mesh.halfEdgeCount() / 3; ++t)
    if (mesh.origin[3 * t] >= 0) {
      Triangle triangle = mesh.triangle(t);
      std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
      triangles.push_back(triangle);
    }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

} // namespace

TEST(HalfEdgeMesh, MarksWhatOperationsMake)
{
  for (const shapes::Sdf& sdf : {shapes::torus(.6, .25), shapes::plane({.1, .2, 1})}) {
    HalfEdgeMesh mesh(zeroLevel(shapes::field(sdf, 1, 10)), serial);
    EXPECT_EQ(std::count(mesh.changed.begin(), mesh.changed.end(), 0), 0);
    for (unsigned seed = 1; seed <= 8; ++seed) {
      mesh.compact(serial);
      std::fill(mesh.changed.begin(), mesh.changed.end(), std::uint8_t{0});
      const std::vector<Triangle> before = sortedTriangles(mesh);
      shake(mesh, seed, 20);
      for (const Triangle& t : sortedTriangles(mesh))
        EXPECT_TRUE(std::binary_search(before.begin(), before.end(), t) || mesh.changed[t[0]] || mesh.changed[t[1]] ||
                    mesh.changed[t[2]]);
      EXPECT_LT(std::count(mesh.changed.begin(), mesh.changed.end(), 1), 21);
    }
  }
}

TEST(HalfEdgeMesh, KeepsItsInvariantsAndTheTopologyUnderRandomOperations)
{
  const std::vector<shapes::Sdf> sdfs = {shapes::sphere(.7), shapes::torus(.6, .25), shapes::plane({.1, .2, 1})};
  for (std::size_t s = 0; s < sdfs.size(); ++s) {
    const TriangleMesh raw = zeroLevel(shapes::field(sdfs[s], 1, 10));
    const std::int64_t euler = measure(raw).eulerCharacteristic;
    HalfEdgeMesh mesh(raw, serial);
    expectConsistent(mesh);
    for (unsigned seed = 1; seed <= 8; ++seed) {
      shake(mesh, seed, 1000);
      expectConsistent(mesh);
      mesh.compact(serial);
      expectConsistent(mesh);
      const MeshStatistics census = measure(mesh.toTriangles());
      ASSERT_EQ(census.nonManifoldEdges + census.nonManifoldVertices, 0);
      ASSERT_EQ(census.eulerCharacteristic, euler);
      ASSERT_EQ(census.boundaryEdges == 0, s < 2);
    }
  }
}

TEST(OperationLog, UndoesWhatStandsOnTheLastOperationsAndNoMore)
{
  for (const shapes::Sdf& sdf : {shapes::torus(.6, .25), shapes::plane({.1, .2, 1})})
    for (unsigned seed = 1; seed <= 8; ++seed) {
      HalfEdgeMesh mesh(zeroLevel(shapes::field(sdf, 1, 10)), serial);
      for (Vector3f& normal : mesh.normals)
        normal = Vector3f::Constant(static_cast<float>(&normal - mesh.normals.data()));
      const HalfEdgeMesh before = mesh;
      std::vector<OperationLog> logs(3);
      shake(mesh, seed, 100, logs);
      std::fill(mesh.changed.begin(), mesh.changed.end(), std::uint8_t{0});

      const HalfEdgeMesh shaken = mesh;
      const OperationLog::Choice choice = OperationLog::lastOn({shaken.halfEdgeCount() / 3 - 1}, logs, mesh);
      ASSERT_FALSE(choice.operations.empty());
      RemeshSummary done;
      OperationLog::undo(choice, logs, mesh, done);
      expectConsistent(mesh);
      const auto isChosen = [&](std::int32_t t) {
        return std::find(choice.triangles.begin(), choice.triangles.end(), t) != choice.triangles.end();
      };
      for (std::int32_t t = 0; t < mesh.halfEdgeCount() / 3; ++t) {
        const Triangle now = mesh.triangle(t);
        bool isSame = now == shaken.triangle(t);
        for (const std::int32_t v : now)
          isSame = isSame && (v < 0 || mesh.positions[v] == shaken.positions[v]);
        EXPECT_TRUE(isSame || isChosen(t)) << "triangle " << t;
        EXPECT_TRUE(isSame || now[0] < 0 || mesh.changed[now[0]] || mesh.changed[now[1]] || mesh.changed[now[2]]);
      }

      std::vector<std::int32_t> all(mesh.halfEdgeCount() / 3);
      std::iota(all.begin(), all.end(), 0);
      std::size_t undone = choice.operations.size();
      for (std::size_t last = 1; last > 0; undone += last) {
        const OperationLog::Choice rest = OperationLog::lastOn(all, logs, mesh);
        last = rest.operations.size();
        OperationLog::undo(rest, logs, mesh, done);
      }
      EXPECT_EQ(done.splits + done.collapses + done.flips, -static_cast<std::int64_t>(undone));
      EXPECT_GT(undone, 2 * choice.operations.size());
      expectConsistent(mesh);
      for (std::int32_t t = 0; t < mesh.halfEdgeCount() / 3; ++t)
        ASSERT_EQ(mesh.triangle(t), 3 * t < before.halfEdgeCount() ? before.triangle(t) : Triangle({-1, -1, -1}));
      for (std::int32_t v = 0; v < before.vertexCount(); ++v) {
        ASSERT_EQ(mesh.positions[v], before.positions[v]);
        ASSERT_EQ(mesh.normals[v], before.normals[v]);
        ASSERT_EQ(mesh.valence[v], before.valence[v]);
        ASSERT_EQ(mesh.sizing[v], before.sizing[v]);
      }
    }
}

TEST(HalfEdgeMesh, CollapsesATetrahedronNoFurther)
{
  // An octahedron, down to the smallest closed surface.
  TriangleMesh octahedron;
  octahedron.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  HalfEdgeMesh mesh(octahedron, serial);
  for (std::int32_t h = 0; h < mesh.halfEdgeCount(); ++h)
    if (mesh.origin[h] >= 0 && mesh.mayCollapse(h))
      mesh.collapse(h);
  expectConsistent(mesh);
  mesh.compact(serial);
  const MeshStatistics census = measure(mesh.toTriangles());
  EXPECT_EQ(census.triangles, 4);
  EXPECT_EQ(census.vertices, 4);
  EXPECT_EQ(census.nonManifoldEdges + census.nonManifoldVertices, 0);
}

TEST(HalfEdgeMesh, CollapsesBordersToThreeEdgesAndNoFurther)
{
  // Two rings of six vertices around nothing: a disc with a hole.
  TriangleMesh ring;
  for (const float radius : {1.f, 2.f})
    for (int n = 0; n < 6; ++n) {
      const double angle = M_PI / 3 * n;
      ring.vertices.push_back(radius *
                              Vector3f(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0));
    }
  for (int n = 0; n < 6; ++n) {
    const int next = (n + 1) % 6;
    ring.triangles.push_back({n, n + 6, next});
    ring.triangles.push_back({next, n + 6, next + 6});
  }
  for (const bool isHole : {true, false}) {
    SCOPED_TRACE(isHole);
    HalfEdgeMesh mesh(ring, serial);
    if (!isHole) {
      TriangleMesh disc = ring;
      disc.vertices.push_back({0, 0, 0});
      for (int n = 0; n < 6; ++n)
        disc.triangles.push_back({12, n, (n + 1) % 6});
      mesh = HalfEdgeMesh(disc, serial);
    }
    for (int pass = 0; pass < 3; ++pass)
      for (std::int32_t h = 0; h < mesh.halfEdgeCount(); ++h) {
        if (mesh.origin[h] < 0)
          continue;
        if ((mesh.twin[h] < 0 || !mesh.onBoundary(mesh.target(h))) && mesh.mayCollapse(h))
          mesh.collapse(h);
      }
    expectConsistent(mesh);
    mesh.compact(serial);
    const MeshStatistics census = measure(mesh.toTriangles());
    EXPECT_EQ(census.nonManifoldEdges + census.nonManifoldVertices, 0);
    EXPECT_EQ(census.eulerCharacteristic, isHole ? 0 : 1);
    EXPECT_EQ(census.boundaryLoops, isHole ? 2 : 1);
    EXPECT_EQ(census.boundaryEdges, isHole ? 6 : 3);
    EXPECT_EQ(census.triangles, isHole ? 6 : 3) << "around the vertex in the middle";
  }
}

TEST(HalfEdgeMesh, CompactingRenumbersAlongACurveAndNoMore)
{
  const TriangleMesh raw = zeroLevel(shapes::field(shapes::sphere(.7), 1, 20));
  const auto sortedCorners = [](const TriangleMesh& mesh) {
    auto result = cornersOf(mesh);
    std::sort(result.begin(), result.end());
    return result;
  };
  std::vector<std::vector<Triangle>> triangles;
  for (const int threads : {1, 2, 4}) {
    Execution execution(threads);
    HalfEdgeMesh mesh(raw, serial);
    mesh.compact(execution);
    expectConsistent(mesh);
    EXPECT_EQ(sortedCorners(mesh.toTriangles()), sortedCorners(raw));
    triangles.push_back(mesh.toTriangles().triangles);
    EXPECT_EQ(triangles.back(), triangles.front());
    // Once in that order, nothing changes any more, and room for splits that were not made goes.
    mesh.makeRoom(3);
    mesh.compact(execution);
    EXPECT_EQ(mesh.positions.size(), raw.vertices.size());
    EXPECT_EQ(mesh.origin.size(), 3 * raw.triangles.size());
    EXPECT_EQ(mesh.toTriangles().triangles, triangles.back());

    // Cut in four, the sphere has about 4 · 2 · 2r/h edges that cross a cut if the parts are compact; in random order
    // three quarters of all edges would.
    const std::int32_t quarter = (mesh.vertexCount() + 3) / 4;
    std::int64_t crossing = 0;
    for (std::int32_t h = 0; h < mesh.halfEdgeCount(); ++h)
      crossing += mesh.represents(h) && mesh.origin[h] / quarter != mesh.target(h) / quarter ? 1 : 0;
    EXPECT_LT(crossing, mesh.halfEdgeCount() / 2 / 8);
  }
}

namespace {

constexpr int count = 60;
constexpr float tooth = .03f, radius = 1, maxShift = .05f;

/// Appends a disc centered at x with a toothed border: every other vertex is farther out.
void appendDisc(TriangleMesh& mesh, float x)
{
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.push_back({x, 0, 0});
  for (int n = 0; n < count; ++n) {
    const auto angle = static_cast<float>(2 * M_PI * n / count);
    const float r = radius + (n % 2 == 0 ? tooth : -tooth);
    mesh.vertices.push_back({x + r * std::cos(angle), r * std::sin(angle), 0});
    mesh.triangles.push_back({first, first + 1 + n, first + 1 + (n + 1) % count});
  }
}

bool leave(Vector3f&)
{
  return true;
}

} // namespace

TEST(BorderCurves, TeethGoAndTheCourseStays)
{
  TriangleMesh discs;
  appendDisc(discs, 0);
  appendDisc(discs, 5);
  HalfEdgeMesh mesh(discs, serial);
  const BorderCurves curves(mesh, maxShift, leave);
  double place = -1;
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v) {
    const bool isMiddle = v % (count + 1) == 0;
    EXPECT_EQ(mesh.places[v] < 0, isMiddle);
    if (isMiddle)
      continue;
    EXPECT_GT(mesh.places[v], place) << "ascending along the loops";
    place = mesh.places[v];
    const Vector3f p = curves.at(place);
    const float off = (p - Vector3f(v > count ? 5 : 0, 0, 0)).norm() - radius;
    // Alternating teeth vanish in one step, and a circle of 60 edges keeps its radius to some thousandths.
    EXPECT_LT(std::abs(off), .005f);
    EXPECT_LE((p - mesh.positions[v]).norm(), 1.0001f * maxShift);
  }
}

TEST(BorderCurves, NoVertexMovesFartherThanItMay)
{
  TriangleMesh disc;
  appendDisc(disc, 0);
  HalfEdgeMesh mesh(disc, serial);
  const BorderCurves curves(mesh, .01f, leave);
  for (std::int32_t v = 1; v < mesh.vertexCount(); ++v)
    EXPECT_NEAR((curves.at(mesh.places[v]) - mesh.positions[v]).norm(), .01f, 1e-5f);
}

TEST(BorderCurves, PlacesGoAroundTheLoop)
{
  TriangleMesh discs;
  appendDisc(discs, 0);
  appendDisc(discs, 5);
  HalfEdgeMesh mesh(discs, serial);
  const BorderCurves curves(mesh, maxShift, leave);
  for (const std::int32_t first : {1, count + 2}) {
    // From the last vertex of a loop to its second one, over the first.
    const double from = mesh.places[first + count - 1], over = mesh.places[first], to = mesh.places[first + 1];
    const double share = curves.share(from, over, to);
    EXPECT_NEAR(share, .5, .01);
    EXPECT_LT((curves.at(curves.between(from, to, share)) - curves.at(over)).norm(), 1e-4f);
    const Vector3f start = curves.at(from), end = curves.at(to);
    const float sagitta = (.5f * (start + end) - curves.at(over)).norm();
    EXPECT_TRUE(curves.isNear(from, to, start, end, 1.01f * sagitta));
    EXPECT_FALSE(curves.isNear(from, to, start, end, .99f * sagitta));
    // The rest of the loop is as far away as the disc is wide.
    EXPECT_FALSE(curves.isNear(to, from, end, start, radius));
    EXPECT_TRUE(curves.isNear(to, from, end, start, 2 * radius));
  }
}

TEST(BorderCurves, ClosedMeshesHaveNone)
{
  TriangleMesh tetrahedron;
  tetrahedron.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  HalfEdgeMesh mesh(tetrahedron, serial);
  const BorderCurves curves(mesh, maxShift, leave);
  EXPECT_TRUE(mesh.places.empty());
}
