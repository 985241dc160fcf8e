// SPDX-License-Identifier: BSD-3-Clause
// Parts of the point stages: sorting in space, joining sets by several threads, cells, medians, boxes, the best tree.
#include "base/cell_hash.h"
#include "base/disjoint_sets.h"
#include "base/select_values.h"
#include "base/spatial_sort.h"
#include "orientation/orientation_graph.h"
#include "points/gathering.h"
#include "support/clouds.h"
#include "support/random.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/reconstruction.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>
#include <numeric>
#include <random>
#include <tuple>
#include <utility>

using namespace pcl::mrf;

namespace {

/// A number of points that gives every pass several pieces of parallel work.
constexpr std::size_t many = 150000;

struct Gathered {
  PointSet points;
  PointCounts counts;
};

Gathered gathered(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals = {},
                  int threads = 1)
{
  Execution execution(threads);
  Gathered result;
  result.points = gather(clouds::raw(positions, normals), {}, result.counts, execution);
  return result;
}

} // namespace

TEST(SortByKey, ByTheUpperHalfAlone)
{
  std::mt19937_64 random(1);
  std::vector<std::uint64_t> values(many);
  for (std::uint64_t& value : values)
    value = random() & 0x000000ffffffffff;
  std::vector<std::uint64_t> expected = values;
  std::stable_sort(expected.begin(), expected.end(),
                   [](std::uint64_t a, std::uint64_t b) { return a >> 32 < b >> 32; });
  Execution execution(3);
  sortByUpperHalf(values, execution);
  EXPECT_EQ(values, expected);
}

TEST(Gather, NeighborsInSpaceAreNeighborsInMemory)
{
  const PointSet square = clouds::randomSquare(many, 1);
  const PointSet points = gathered(square.positions).points;
  ASSERT_EQ(points.size(), many);
  double length = 0;
  for (std::size_t n = 1; n < points.size(); ++n)
    length += (points.positions[n] - points.positions[n - 1]).norm();
  // In steps of about the distance between the points, 2/√n; shuffled ones are 1 apart.
  EXPECT_LT(length / many, 4 / std::sqrt(static_cast<double>(many)));
  for (std::size_t n = 0; n < points.size(); ++n)
    ASSERT_LT((points.positions[n].cast<double>() + points.offset - square.positions[points.origins[n]].cast<double>())
                  .norm(),
              1e-6);
}

TEST(Gather, SequenceDependsNeitherOnTheOrderOfTheInputNorOnThreads)
{
  PointSet square = clouds::randomSquare(many, 1);
  for (const bool withFar : {false, true}) {
    // A far point puts all others into few cells of the curve: their runs cross the pieces of parallel work.
    if (withFar)
      clouds::append(square, {3e6f, 0, 0}, Eigen::Vector3f::UnitZ());
    const PointSet expected = gathered(square.positions, square.normals).points;
    EXPECT_EQ(expected.size(), square.size());
    const PointSet shuffled = clouds::reordered(square, clouds::shuffledOrder(square.size()));
    EXPECT_EQ(gathered(shuffled.positions, shuffled.normals, 3).points.positions, expected.positions);
    const PointSet parallel = gathered(square.positions, square.normals, 3).points;
    EXPECT_EQ(parallel.positions, expected.positions);
    EXPECT_EQ(parallel.origins, expected.origins);
  }
}

TEST(Gather, OfEqualPositionsTheFirstIsKept)
{
  PointSet points = clouds::randomSquare(300, 1);
  // In one cell of the curve with others that are not equal, and far away, so that all of them are.
  for (int repetition = 1; repetition < 4; ++repetition)
    for (std::size_t i = 0; i < 300; i += static_cast<std::size_t>(repetition))
      clouds::append(points, points.positions[i], Eigen::Vector3f::UnitX());
  for (const float far : {0.f, 1e12f}) {
    if (far > 0)
      clouds::append(points, {far, 0, 0}, Eigen::Vector3f::UnitZ());
    const Gathered result = gathered(points.positions, points.normals);
    EXPECT_EQ(result.points.size(), far > 0 ? 301u : 300u);
    EXPECT_EQ(result.counts.duplicates, 300 + 150 + 100);
    for (const Eigen::Vector3f& normal : result.points.normals)
      EXPECT_EQ(normal, Eigen::Vector3f::UnitZ());
  }
}

TEST(DisjointSets, JoinedByManyThreadsAsByOne)
{
  constexpr std::uint32_t count = 20000;
  std::mt19937 random(1);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joins(count);
  for (auto& [a, b] : joins) {
    a = static_cast<std::uint32_t>(random() % count);
    b = static_cast<std::uint32_t>(random() % count);
  }
  // The smallest element of each set, by repeated relaxation.
  std::vector<std::uint32_t> labels(count);
  std::iota(labels.begin(), labels.end(), 0u);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : joins)
      if (labels[a] != labels[b]) {
        labels[a] = labels[b] = std::min(labels[a], labels[b]);
        changed = true;
      }
  }
  std::vector<std::uint32_t> expectedSizes(count, 0);
  for (const std::uint32_t label : labels)
    ++expectedSizes[label];
  for (const int threads : {1, 4}) {
    DisjointSets points(count);
    Execution execution(threads);
    execution.forRange(count, 16, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t n = begin; n < end; ++n)
        points.join(joins[static_cast<std::size_t>(n)].first, joins[static_cast<std::size_t>(n)].second);
    });
    const auto sizes = points.sizes(execution);
    EXPECT_EQ(expectedSizes[points.largest(execution)], *std::max_element(expectedSizes.begin(), expectedSizes.end()));
    for (std::uint32_t i = 0; i < count; ++i) {
      ASSERT_EQ(points.find(i), labels[i]);
      ASSERT_EQ(sizes[i], expectedSizes[i]);
    }
  }
}

TEST(CellHash, NumbersCellsAsAMapDoes)
{
  clouds::Random random(5);
  CellHash hash({-2, -2, -2}, .25);
  std::map<std::array<std::int64_t, 3>, std::uint32_t> expected;
  for (int n = 0; n < 20000; ++n) {
    const Eigen::Vector3f position = 3 * random.inCube().cast<float>();
    const CellHash::Cell cell = hash.cellOf(position);
    const Eigen::Array3d corner = -2 + .25 * cell.cast<double>();
    // What is before the first cells counts as theirs.
    ASSERT_TRUE(
        ((position.cast<double>().array().max(-2) >= corner) && (position.cast<double>().array() < corner + .25))
            .all());
    const auto number = static_cast<std::uint32_t>(expected.size());
    const auto known = expected.try_emplace({cell.x(), cell.y(), cell.z()}, number).first->second;
    ASSERT_EQ(hash.find(cell), known == number ? CellHash::none : known);
    ASSERT_EQ(hash.add(cell), known);
    ASSERT_EQ(hash.find(cell), known);
    ASSERT_TRUE((hash[known] == cell).all());
  }
  EXPECT_EQ(hash.size(), expected.size());
  EXPECT_EQ(hash.find({1000, 0, 0}), CellHash::none);
  EXPECT_EQ(hash.find({-1, 0, 0}), CellHash::none);
  EXPECT_TRUE((hash.cellOf({1e30f, 0, -1e30f}) == CellHash::Cell(CellHash::end - 1, 8, 0)).all());
  int around = 0;
  CellHash::forEachAround({1, 1, 1}, [&](const CellHash::Cell& cell) { around += (cell <= 2).all() ? 1 : 0; });
  EXPECT_EQ(around, 27);
}

TEST(Quantile, IsTheValueThatItsShareComesBefore)
{
  EXPECT_EQ(quantile(std::vector<float>{3, 1, 2, 5, 4}, .5), 3);
  EXPECT_EQ(quantile(std::vector<double>{3, 1, 2, 5, 4}, .99), 4);
  EXPECT_EQ(quantile(std::vector<double>{3, 1, 2, 5, 4}, 1), 5);
  EXPECT_EQ(valueAt(std::vector<int>{3, 1, 2}, 0), 1);
}

TEST(BoundingBox, HoldsEveryPoint)
{
  clouds::Random random(4);
  std::vector<Eigen::Vector3f> points;
  Eigen::Vector3f lower = Eigen::Vector3f::Constant(2), upper = -lower;
  for (int n = 0; n < 11; ++n) { // with every remainder of four
    points.push_back(random.inCube().cast<float>());
    lower = lower.cwiseMin(points.back());
    upper = upper.cwiseMax(points.back());
    const BoundingBox box = boundingBox(points);
    EXPECT_EQ(box.lower, lower);
    EXPECT_EQ(box.upper, upper);
  }
}

TEST(OrientationGraph, BestTreeIsThatOfAllEdgesSorted)
{
  // More edges than one portion, so that those of later ones are filtered; random normals, so that no qualities tie.
  PointSet points = clouds::randomSquare(30000, 1);
  clouds::Random random(2);
  for (Eigen::Vector3f& n : points.normals)
    n = random.direction().cast<float>();
  Execution execution(3);
  const auto search = clouds::searchOf(points);
  std::vector<Edge> edges;
  std::mutex mutex;
  const OrientationGraph graph(
      points, points.normals, *search, Reach(.05f), .9f,
      [&](const Edge& edge) {
        const std::lock_guard<std::mutex> lock(mutex);
        edges.push_back(edge);
      },
      execution);
  const auto isUsed = [](const Edge& edge, SignedForest& forest) {
    // Depends on what was joined before, as the real one does.
    return edge.withinAngle || forest.size(edge.a) > 100 || forest.size(edge.b) < 1000;
  };
  SignedForest tree = graph.bestTree(isUsed, execution);

  std::sort(edges.begin(), edges.end(), [](const Edge& e, const Edge& f) {
    return std::make_tuple(1 - e.quality, e.a, e.b) < std::make_tuple(1 - f.quality, f.a, f.b);
  });
  SignedForest expected(points.size());
  for (const Edge& edge : edges)
    if (isUsed(edge, expected))
      expected.join(edge.a, edge.b, edge.opposite);
  std::size_t trees = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(tree.root(i), expected.root(i));
    ASSERT_EQ(tree.isFlipped(i), expected.isFlipped(i));
    trees += tree.root(i) == i;
  }
  EXPECT_LT(trees, points.size() / 10) << "the test has trees to compare";
}

namespace {

/// Five points; every array holds the number of each point.
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
