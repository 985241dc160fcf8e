// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/watertight.h"

#include "mesh/winding_number.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

constexpr int voxels = 60;
constexpr double halfSide = 1.5, voxelSize = 2 * halfSide / (voxels - 1);

Execution execution(2);

/// The part of the zero level of a field that is below a height.
TriangleMesh below(float height, const DistanceField& field)
{
  return meshes::selectWhere(polygonize(field, execution), [=](const Vector3f& p) { return p.z() < height; });
}

/// The values of a field at its voxels, times a factor.
std::vector<float> distancesOf(const DistanceField& field, float factor)
{
  std::vector<float> distances;
  shapes::forVoxels(field.lattice().size,
                    [&](int x, int y, int z) { distances.push_back(factor * field.distance(x, y, z)); });
  return distances;
}

struct Closed {
  TriangleMesh mesh;
  MeshStatistics statistics;
  float top = -std::numeric_limits<float>::infinity();
};

Closed close(const TriangleMesh& mesh, const DistanceField& field)
{
  Closed result;
  result.mesh = polygonize(closeOpenings(mesh, field, execution), execution);
  result.statistics = measure(result.mesh);
  EXPECT_TRUE(result.statistics.closed());
  EXPECT_TRUE(result.statistics.manifold());
  for (const Vector3f& vertex : result.mesh.vertices)
    result.top = std::max(result.top, vertex.z());
  return result;
}

/// Volume of the part of the unit ball below a height.
double volumeBelow(double height)
{
  return M_PI * (1 + height) * (1 + height) * (2 - height) / 3;
}

} // namespace

TEST(WindingNumber, CountsHowOftenASurfaceWindsAround)
{
  const TriangleMesh sphere = polygonize(shapes::field(shapes::sphere(1), halfSide, voxels), execution);
  const WindingNumber winding(sphere, execution);
  for (const Vector3f& inside : {Vector3f(0, 0, 0), Vector3f(.5f, -.6f, .4f), Vector3f(0, 0, .99f)})
    EXPECT_NEAR(winding.at(inside), 1, .02);
  for (const Vector3f& outside : {Vector3f(0, 0, 1.01f), Vector3f(5, 1, -2), Vector3f(1.2f, 0, 0)})
    EXPECT_NEAR(winding.at(outside), 0, .02);
}

TEST(WindingNumber, IsAHalfInThePlaneOfAnOpening)
{
  const TriangleMesh bowl = below(.3f, shapes::field(shapes::sphere(1), halfSide, voxels));
  const WindingNumber winding(bowl, execution);
  for (const float x : {0.f, .4f, -.7f})
    EXPECT_NEAR(winding.at({x, 0, .3f + static_cast<float>(voxelSize) / 2}), .5,
                .06); // where the triangles end is known to a voxel
}

TEST(Watertight, APlaneOpeningIsClosedByItsPlane)
{
  const DistanceField ball = shapes::field(shapes::sphere(1), halfSide, voxels);
  for (const float height : {-.5f, 0.f, .7f}) {
    SCOPED_TRACE(height);
    const Closed closed = close(below(height, ball), ball);
    EXPECT_EQ(closed.statistics.components, 1);
    EXPECT_EQ(closed.statistics.eulerCharacteristic, 2);
    EXPECT_NEAR(closed.top, height, 1.5 * voxelSize);
    EXPECT_NEAR(closed.statistics.volume, volumeBelow(height), M_PI * (1 - height * height) * voxelSize);
  }
}

TEST(Watertight, WhatIsGivenStaysAsItIs)
{
  const DistanceField ball = shapes::field(shapes::sphere(1), halfSide, voxels);
  const TriangleMesh bowl = below(.3f, ball);
  const Closed closed = close(bowl, ball);
  const auto onSphere = [](const Vector3f& v) { return v.z() < .2f; };
  std::size_t given = 0, kept = 0;
  for (const Vector3f& vertex : bowl.vertices)
    given += onSphere(vertex);
  for (const Vector3f& vertex : closed.mesh.vertices)
    if (onSphere(vertex)) {
      ++kept;
      EXPECT_NEAR(vertex.norm(), 1, .003);
    }
  EXPECT_EQ(kept, given);
}

TEST(Watertight, OfAHollowTheHollowIsOutside)
{
  const DistanceField ball = shapes::field(shapes::sphere(1), halfSide, voxels);
  const DistanceField hollow(ball.lattice(), distancesOf(ball, -1), {});
  const Closed closed = close(below(.7f, hollow), hollow);
  EXPECT_EQ(closed.statistics.components, 1);
  EXPECT_NEAR(closed.statistics.volume, -volumeBelow(.7), M_PI * (1 - .7 * .7) * voxelSize);
}

TEST(Watertight, ASheetGetsABack)
{
  const shapes::Sdf floor = [](const Eigen::Vector3d& x) { return x.z() - .1 * std::sin(5 * x.x()); };
  const DistanceField field = shapes::field(floor, halfSide, voxels);
  const TriangleMesh sheet = polygonize(field, execution); // which ends at the lattice
  const Closed closed = close(sheet, field);
  EXPECT_EQ(closed.statistics.components, 1);
  EXPECT_GT(closed.statistics.volume, 0);
  EXPECT_LT(closed.statistics.volume, 4 * halfSide * halfSide * (.1 + 3 * voxelSize));
}

TEST(Watertight, PiecesAreClosedEachByItself)
{
  const DistanceField ball = shapes::field(shapes::sphere(1), halfSide, voxels);
  Lattice elsewhere = ball.lattice();
  elsewhere.origin.x() += 20;
  const DistanceField both = DistanceField::ofPieces({ball, DistanceField(elsewhere, distancesOf(ball, 1), {})});
  const Closed closed = close(below(0, both), both);
  EXPECT_EQ(closed.statistics.components, 2);
  EXPECT_NEAR(closed.statistics.volume, 2 * volumeBelow(0), 2 * M_PI * voxelSize);
}

TEST(Watertight, DoesNotDependOnThreads)
{
  const DistanceField ball = shapes::field(shapes::sphere(1), halfSide, voxels);
  const TriangleMesh bowl = below(.3f, ball);
  sameOnAnyThreads([&](int threads) {
    Execution some(threads);
    const TriangleMesh mesh = polygonize(closeOpenings(bowl, ball, some), some);
    return std::make_pair(mesh.vertices, mesh.triangles);
  });
}
