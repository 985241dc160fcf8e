// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/crowded_space.h"

#include "support/cancelling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

using namespace pcl::mrf;
using Eigen::Vector3f;

namespace {

struct Surface {
  std::vector<Vector3f> positions, normals;

  void add(const Vector3f& position, const Vector3f& normal)
  {
    positions.push_back(position);
    normals.push_back(normal);
  }
};

/// Random points of the square [-10, 10]² at a height.
void addSheet(Surface& surface, float z, const Vector3f& normal)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-10, 10);
  for (int n = 0; n < 4000; ++n)
    surface.add({coordinate(random), coordinate(random), z}, normal);
}

double crowdedShare(const Surface& surface, const std::vector<Vector3f>& positions)
{
  Execution execution(2);
  const CrowdedSpace space(surface.positions, surface.normals, 1, execution);
  double count = 0;
  for (const Vector3f& p : positions)
    count += space.contains(p) ? 1 : 0;
  return count / static_cast<double>(positions.size());
}

} // namespace

TEST(CrowdedSpace, ASheetAloneIsNot)
{
  Surface flat;
  addSheet(flat, .3f, {0, 0, 1});
  EXPECT_EQ(crowdedShare(flat, flat.positions), 0);

  // A sphere of seven cells' radius: within the three cells around one, normals are within 23° of their mean.
  Surface sphere;
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int n = 0; n < 8000; ++n) {
    const Vector3f direction = Vector3f(normal(random), normal(random), normal(random)).normalized();
    sphere.add(7 * direction, direction);
  }
  EXPECT_EQ(crowdedShare(sphere, sphere.positions), 0);
}

TEST(CrowdedSpace, SheetsThatFaceEachOtherAreUpToACellAway)
{
  for (const float gap : {.01f, .5f, .99f}) {
    Surface sheets;
    addSheet(sheets, 0, {0, 0, 1});
    addSheet(sheets, gap, {0, 0, -1});
    EXPECT_EQ(crowdedShare(sheets, sheets.positions), 1) << gap;
  }
  Surface apart;
  addSheet(apart, 0, {0, 0, 1});
  addSheet(apart, 3, {0, 0, -1});
  EXPECT_EQ(crowdedShare(apart, apart.positions), 0);
}

TEST(CrowdedSpace, CreasesAreAndWhatIsFarFromThemIsNot)
{
  Surface edge;
  addSheet(edge, 0, {0, 0, 1});
  for (Vector3f& p : edge.positions)
    p.x() = std::abs(p.x());
  const std::size_t count = edge.positions.size();
  for (std::size_t n = 0; n < count; ++n) // the square x = 0 below it
    edge.add({0, edge.positions[n].y(), -edge.positions[n].x()}, {-1, 0, 0});
  Execution execution(1);
  const CrowdedSpace space(edge.positions, edge.normals, 1, execution);
  for (const Vector3f& p : edge.positions) {
    const float distance = std::max(p.x(), -p.z());
    if (distance < .9f) {
      EXPECT_TRUE(space.contains(p)) << p.transpose();
    }
    if (distance > 2.1f) {
      EXPECT_FALSE(space.contains(p)) << p.transpose();
    }
  }
}

TEST(CrowdedSpace, HugeExtentsAndNoPositionsDoNoHarm)
{
  Execution execution(1);
  const CrowdedSpace none({}, {}, 1, execution);
  (void)none.contains({0, 0, 0});
  // More cells than indices: what shares one looks crowded at most.
  const std::vector<Vector3f> positions{{-1e9f, 0, 0}, {0, 0, 0}, {1e9f, 1e9f, 1e9f}};
  const CrowdedSpace space(positions, {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}, 1e-3f, execution);
  for (const Vector3f& p : positions)
    EXPECT_FALSE(space.contains(p));
}

TEST(CrowdedSpace, AsksOnTheWayWhetherToGoOn)
{
  Surface sheets;
  for (int n = 0; n < 10; ++n)
    addSheet(sheets, static_cast<float>(n), {0, 0, 1});
  const auto make = [&](Execution& execution) { CrowdedSpace(sheets.positions, sheets.normals, 1, execution); };
  // Positions are sorted into cells one by one, a tenth of a microsecond each.
  EXPECT_GE(callsDuring(make), static_cast<std::int64_t>(sheets.positions.size()) / 10000);
  expectCancelledWhereverItAsks(make);
}
