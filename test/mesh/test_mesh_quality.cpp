// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <random>

using namespace meshes;
using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

/// The corners 0, x, y, z of the unit cube, oriented outward.
TriangleMesh tetrahedron(const Vector3f& offset = Vector3f::Zero())
{
  TriangleMesh mesh;
  mesh.vertices = {offset, offset + Vector3f::UnitX(), offset + Vector3f::UnitY(), offset + Vector3f::UnitZ()};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

/// A torus of m × n vertices, all of valence 6.
TriangleMesh torus(int m, int n, double majorRadius, double minorRadius)
{
  TriangleMesh mesh;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < m; ++i) {
      const double u = 2 * M_PI * i / m, v = 2 * M_PI * j / n, r = majorRadius + minorRadius * std::cos(v);
      mesh.vertices.push_back(
          Eigen::Vector3d(r * std::cos(u), r * std::sin(u), minorRadius * std::sin(v)).cast<float>());
      const std::int32_t a = i + m * j, b = (i + 1) % m + m * j, c = (i + 1) % m + m * ((j + 1) % n),
                         d = i + m * ((j + 1) % n);
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  return mesh;
}

bool has(const Triangle& t, std::int32_t v)
{
  return std::find(t.begin(), t.end(), v) != t.end();
}

/// The number of connected sets of triangles, joined across edges (v, w) with isJoint(v, w), by repeated relabeling.
template <typename IsJoint>
std::int64_t joinedOver(const TriangleMesh& mesh, const IsJoint& isJoint)
{
  std::vector<std::size_t> label(mesh.triangles.size());
  std::iota(label.begin(), label.end(), std::size_t{0});
  for (std::size_t round = 0; round < label.size(); ++round)
    for (std::size_t s = 0; s < label.size(); ++s)
      for (std::size_t t = 0; t < label.size(); ++t)
        for (const std::int32_t v : mesh.triangles[s])
          for (const std::int32_t w : mesh.triangles[s])
            if (v < w && has(mesh.triangles[t], v) && has(mesh.triangles[t], w) && isJoint(v, w))
              label[s] = label[t] = std::min(label[s], label[t]);
  std::sort(label.begin(), label.end());
  return std::unique(label.begin(), label.end()) - label.begin();
}

std::int64_t sidesOn(const TriangleMesh& mesh, std::int32_t v, std::int32_t w)
{
  return std::count_if(mesh.triangles.begin(), mesh.triangles.end(),
                       [&](const Triangle& t) { return has(t, v) && has(t, w); });
}

bool isNonManifold(const TriangleMesh& mesh, std::int32_t vertex)
{
  TriangleMesh around;
  std::copy_if(mesh.triangles.begin(), mesh.triangles.end(), std::back_inserter(around.triangles),
               [&](const Triangle& t) { return has(t, vertex); });
  for (std::int32_t w = 0; w < static_cast<std::int32_t>(mesh.vertices.size()); ++w)
    if (w != vertex && sidesOn(mesh, vertex, w) > 2)
      return true;
  const auto endsHere = [&](std::int32_t v, std::int32_t w) {
    return (v == vertex || w == vertex) && sidesOn(mesh, v, w) == 2;
  };
  return joinedOver(around, endsHere) > 1;
}

TEST(TriangleQuality, isTwiceTheRatioOfTheRadii)
{
  const Vector3f o(0, 0, 0);
  EXPECT_NEAR(triangleQuality(o, {1, 0, 0}, {.5f, std::sqrt(.75f), 0}), 1, 1e-6); // equilateral, to float's rounding
  // Sides 3, 4, 5: inradius 1, circumradius 5/2.
  EXPECT_NEAR(triangleQuality(o, {3, 0, 0}, {0, 4, 0}), .8, 1e-12);
  EXPECT_NEAR(triangleQuality({3e-12f, 0, 0}, {0, 4e-12f, 0}, o), .8, 1e-6);
  EXPECT_NEAR(triangleQuality({3e12f, 0, 0}, {0, 4e12f, 0}, o), .8, 1e-6);
  EXPECT_EQ(triangleQuality(o, {1, 1, 1}, {2, 2, 2}), 0);
  EXPECT_EQ(triangleQuality(o, o, {1, 0, 0}), 0);
  EXPECT_EQ(triangleQuality(o, o, o), 0);
  EXPECT_EQ(triangleQuality(o, {1, 0, 0}, {0, std::numeric_limits<float>::quiet_NaN(), 0}), 0);
  EXPECT_EQ(triangleQuality(o, {1, 0, 0}, {0, std::numeric_limits<float>::infinity(), 0}), 0);
}

TEST(MeshQuality, tetrahedron)
{
  const MeshStatistics s = measure(tetrahedron({10, -20, 5}));
  EXPECT_EQ(s.vertices, 4);
  EXPECT_EQ(s.triangles, 4);
  EXPECT_EQ(s.edges, 6);
  EXPECT_EQ(s.components, 1);
  EXPECT_TRUE(s.closed());
  EXPECT_TRUE(s.manifold());
  EXPECT_EQ(s.boundaryLoops, 0);
  EXPECT_EQ(s.degenerateTriangles, 0);
  EXPECT_EQ(s.eulerCharacteristic, 2);
  EXPECT_NEAR(s.volume, 1. / 6, 1e-12);
  const double large = std::sqrt(3.) / 2;
  EXPECT_NEAR(s.area, 1.5 + large, 1e-12);
  EXPECT_NEAR(s.meanEdge, (1 + std::sqrt(2.)) / 2, 1e-12);
  EXPECT_NEAR(s.minEdge, 1, 1e-12);
  EXPECT_NEAR(s.maxEdge, std::sqrt(2.), 1e-12);
  const double right = 2 * (std::sqrt(2.) - 1); // 2 r / R = 2 (1 − √½) / √½
  EXPECT_NEAR(s.minQuality, right, 1e-12);
  EXPECT_NEAR(s.meanQuality, (3 * right + 1) / 4, 1e-12);
  const double mean = (1.5 + large) / 4;
  EXPECT_NEAR(s.areaDeviation, std::sqrt((3 * std::pow(.5 - mean, 2) + std::pow(large - mean, 2)) / 4) / mean, 1e-12);
  EXPECT_EQ(s.valences[3], 4);
  EXPECT_EQ(s.regularShare(), 0);
}

TEST(MeshQuality, torusWholeAndCut)
{
  const MeshStatistics s = measure(torus(60, 40, 2, .5));
  EXPECT_TRUE(s.closed() && s.manifold());
  EXPECT_EQ(s.components, 1);
  EXPECT_EQ(s.eulerCharacteristic, 0);
  EXPECT_EQ(s.valences[6], 60 * 40);
  EXPECT_EQ(s.regularShare(), 1);
  // Inscribed polygons of 60 and 40 corners lose about (2π/n)²/6 each.
  const double loss = std::pow(2 * M_PI / 60, 2) / 6 + std::pow(2 * M_PI / 40, 2) / 6;
  EXPECT_NEAR(s.volume / (2 * M_PI * M_PI * 2 * .25), 1 - loss, .3 * loss);

  TriangleMesh tube = torus(12, 9, 2, .5);
  // Without the triangles between two neighboring rows of vertices the torus is an open tube.
  tube.triangles.erase(tube.triangles.begin(), tube.triangles.begin() + 24);
  const MeshStatistics open = measure(tube);
  EXPECT_TRUE(open.manifold());
  EXPECT_EQ(open.boundaryEdges, 24);
  EXPECT_EQ(open.boundaryLoops, 2);
  EXPECT_EQ(open.eulerCharacteristic, 0);
}

TEST(MeshQuality, anyIndicesAndPositionsAreSurvived)
{
  const float nan = std::numeric_limits<float>::quiet_NaN();
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.emplace_back(nan, 0.f, 0.f);
  mesh.triangles.push_back({0, 1, 99});
  mesh.triangles.push_back({-1, 1, 2});
  mesh.triangles.push_back({2, 2, 3});
  mesh.triangles.push_back({std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(), 0});
  MeshStatistics s = measure(mesh);
  EXPECT_EQ(s.triangles, 8);
  EXPECT_EQ(s.degenerateTriangles, 4);
  EXPECT_EQ(s.minQuality, 0);
  EXPECT_EQ(s.eulerCharacteristic, 2); // of the rest
  EXPECT_EQ(s.components, 1);
  EXPECT_TRUE(s.manifold() && s.closed());
  EXPECT_NEAR(s.volume, 1. / 6, 1e-12);
  std::vector<std::int32_t> component;
  bool isTorn;
  EXPECT_EQ(groupTriangles(mesh, {}, serial, component, isTorn), 1);
  EXPECT_EQ(component, (std::vector<std::int32_t>{0, 0, 0, 0, -1, -1, -1, -1}));

  mesh.triangles.push_back({0, 1, 4}); // a vertex that is not finite
  s = measure(mesh);
  EXPECT_EQ(s.degenerateTriangles, 5);
  EXPECT_TRUE(std::isfinite(s.area) && std::isfinite(s.volume) && std::isfinite(s.meanEdge) &&
              std::isfinite(s.maxEdge));
  EXPECT_TRUE(std::isfinite(s.meanQuality) && std::isfinite(s.areaDeviation));

  s = measure(TriangleMesh());
  EXPECT_EQ(s.triangles + s.vertices + s.edges + s.components + s.boundaryLoops, 0);
  EXPECT_EQ(s.minQuality, 0);
  EXPECT_EQ(s.regularShare(), 0);
}

TEST(MeshQuality, randomSoupsAgreeWithCountingByHand)
{
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int32_t> vertex(0, 11);
  for (int trial = 0; trial < 50; ++trial) {
    TriangleMesh mesh;
    for (int v = 0; v < 12; ++v)
      mesh.vertices.push_back(Vector3f::Random());
    while (mesh.triangles.size() < 10) {
      const Triangle t{vertex(random), vertex(random), vertex(random)};
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        mesh.triangles.push_back(t);
    }
    std::int64_t edges = 0, boundary = 0, nonManifold = 0;
    for (std::int32_t a = 0; a < 12; ++a)
      for (std::int32_t b = a + 1; b < 12; ++b) {
        int forward = 0, backward = 0;
        for (const Triangle& t : mesh.triangles)
          for (std::size_t c = 0; c < 3; ++c) {
            forward += t[c] == a && t[(c + 1) % 3] == b ? 1 : 0;
            backward += t[c] == b && t[(c + 1) % 3] == a ? 1 : 0;
          }
        edges += forward + backward > 0 ? 1 : 0;
        boundary += forward + backward == 1 ? 1 : 0;
        nonManifold += forward > 1 || backward > 1 ? 1 : 0;
      }
    const MeshStatistics s = measure(mesh);
    EXPECT_EQ(s.edges, edges);
    EXPECT_EQ(s.boundaryEdges, boundary);
    EXPECT_EQ(s.nonManifoldEdges, nonManifold);
    EXPECT_EQ(std::accumulate(s.valences.begin(), s.valences.end(), std::int64_t{0}), 12);
    EXPECT_EQ(s.components, joinedOver(mesh, [](int, int) { return true; }));
    std::int64_t nonManifoldVertices = 0;
    for (std::int32_t v = 0; v < 12; ++v)
      nonManifoldVertices += isNonManifold(mesh, v) ? 1 : 0;
    EXPECT_EQ(s.nonManifoldVertices, nonManifoldVertices);
  }
}

TEST(MeshQuality, componentsAreNumberedByTheirFirstTriangle)
{
  TriangleMesh mesh = tetrahedron();
  append(mesh, torus(5, 4, 2, .5));
  append(mesh, tetrahedron({9, 9, 9}));
  std::vector<Triangle> interleaved;
  for (std::size_t n = 0; n < 4; ++n) // of the last tetrahedron, of the torus, of the first one
    for (const std::size_t first : {std::size_t{44}, std::size_t{4}, std::size_t{0}})
      interleaved.push_back(mesh.triangles[first + n]);
  mesh.triangles = interleaved;
  std::vector<std::int32_t> component;
  bool isTorn;
  EXPECT_EQ(groupTriangles(mesh, {}, serial, component, isTorn), 3);
  EXPECT_EQ(component, (std::vector<std::int32_t>{0, 1, 2, 0, 1, 2, 0, 1, 2, 0, 1, 2}));
}

TEST(MeshQuality, ringsDoNotDependOnHowManyVerticesAreGroupedAtATime)
{
  const TriangleMesh mesh = torus(9, 7, 2, .5);
  std::vector<std::uint8_t> isMember(mesh.triangles.size(), 1);
  isMember[5] = isMember[80] = 0;
  const auto corners = [&](std::size_t atATime) {
    std::vector<std::int32_t> seen;
    const auto parts = partsOfRings<std::vector<std::int32_t>>(
        mesh, isMember, serial,
        [](std::vector<std::int32_t>& part, const Ring& ring, std::int32_t vertex) {
          part.push_back(-vertex);
          for (std::int32_t i = 0; i < ring.size(); ++i)
            part.push_back(ring.corner(i));
        },
        atATime);
    for (const std::vector<std::int32_t>& part : parts)
      seen.insert(seen.end(), part.begin(), part.end());
    return seen;
  };
  const std::vector<std::int32_t> all = corners(63);
  EXPECT_EQ(all.size(), 63u + 3 * (126 - 2));
  for (const std::size_t atATime : {1, 10, 62})
    EXPECT_EQ(corners(atATime), all) << atATime;
}

TEST(MeshQuality, doesNotDependOnTheNumberOfThreads)
{
  // More vertices than one range has, with a boundary, several components and torn vertices.
  TriangleMesh mesh = zeroLevel(shapes::field(shapes::torus(.6, .25), 1, 90));
  ASSERT_GT(mesh.vertices.size(), 16384u);
  std::vector<std::uint8_t> keep(mesh.triangles.size());
  std::mt19937 random(3);
  for (std::uint8_t& flag : keep)
    flag = std::bernoulli_distribution(.6)(random) ? 1 : 0;
  mesh = select(mesh, keep);
  const MeshStatistics one = measure(mesh);
  EXPECT_GT(one.components, 100);
  EXPECT_GT(one.boundaryLoops, 100);
  EXPECT_GT(one.nonManifoldVertices, 100);
  for (const int threads : {2, 4}) {
    Execution parallel(threads);
    expectSame(one, measure(mesh, parallel));
  }
}

} // namespace
