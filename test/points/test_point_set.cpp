// SPDX-License-Identifier: BSD-3-Clause
// Some points of a set keep all that was known of them, and of the set.
#include <pcl/surface/mrf/point_set.h>

#include <gtest/gtest.h>

using namespace pcl::mrf;

namespace {

/// Five points of which every array tells the number.
template <typename Points>
Points numbered()
{
  Points points;
  for (int n = 0; n < 5; ++n) {
    points.positions.emplace_back(static_cast<float>(n), 0, 0);
    points.normals.emplace_back(0, static_cast<float>(n), 0);
    points.confidences.push_back(.1f * static_cast<float>(n));
    points.spacings.push_back(static_cast<float>(10 + n));
    points.origins.push_back(static_cast<std::uint32_t>(100 + n));
  }
  points.offset = {7, 8, 9};
  return points;
}

template <typename Points>
void expectNumbers(const Points& points, const std::vector<int>& numbers)
{
  const auto all = numbered<Points>();
  ASSERT_EQ(points.size(), numbers.size());
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const auto at = static_cast<std::size_t>(numbers[n]);
    EXPECT_EQ(points.positions[n], all.positions[at]);
    EXPECT_EQ(points.normals[n], all.normals[at]);
    EXPECT_EQ(points.confidences[n], all.confidences[at]);
    EXPECT_EQ(points.spacings[n], all.spacings[at]);
    EXPECT_EQ(points.origins[n], all.origins[at]);
  }
  EXPECT_EQ(points.offset, all.offset);
}

} // namespace

TEST(Select, keepsAllArraysAndWhatIsKnownOfTheSet)
{
  auto points = numbered<PointSet>();
  points.views = {0, 1, 0, 1, 1};
  points.sensors = {{1, 2, 3}, {4, 5, 6}};
  points.resolution = .25f;
  points.hasSensorOrigin = true;
  points.hadOnlyZeroNormals = true;
  const PointSet kept = select(points, {0, 1, 1, 0, 1});
  expectNumbers(kept, {1, 2, 4});
  EXPECT_EQ(kept.views, (std::vector<std::int32_t>{1, 0, 1}));
  EXPECT_EQ(kept.sensors, points.sensors);
  EXPECT_EQ(kept.resolution, points.resolution);
  EXPECT_TRUE(kept.hasSensorOrigin);
  EXPECT_TRUE(kept.hadOnlyZeroNormals);
}

TEST(Select, takesOrientedPointsByFlagsAndByIndices)
{
  const auto points = numbered<OrientedPoints>();
  expectNumbers(select(points, std::vector<std::uint8_t>{0, 1, 1, 0, 1}), {1, 2, 4});
  expectNumbers(select(points, std::vector<std::uint32_t>{4, 0, 2}), {4, 0, 2});
}

TEST(Select, leavesArraysEmptyThatAreNotKnown)
{
  OrientedPoints points;
  points.positions.resize(3);
  const OrientedPoints kept = select(points, std::vector<std::uint32_t>{2, 1});
  EXPECT_EQ(kept.size(), 2u);
  EXPECT_TRUE(kept.normals.empty() && kept.confidences.empty() && kept.spacings.empty() && kept.origins.empty());
}
