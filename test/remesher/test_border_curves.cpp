// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/border_curves.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

Execution serial(1);

constexpr int count = 60;
constexpr float tooth = .03f, radius = 1, maxShift = .05f;

/// A disc around its middle at x, its border with teeth: every other vertex is that much farther out.
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
