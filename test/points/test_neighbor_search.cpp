// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/neighbor_search.h>

#include "support/clouds.h"
#include "support/random.h"
#include "support/threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

using pcl::mrf::Execution;
using pcl::mrf::makeKdTree;
using pcl::mrf::makePointBins;
using pcl::mrf::NeighborBatch;
using pcl::mrf::Neighbors;
using pcl::mrf::NeighborSearch;

namespace {

using Positions = std::vector<Eigen::Vector3f>;

/// A cloud to search in, named by what makes it hard.
struct Cloud {
  std::string name;
  std::function<Positions()> make;
};

Positions onSphere(std::size_t count, float radius, unsigned seed)
{
  clouds::Random random(seed);
  Positions positions(count);
  for (Eigen::Vector3f& position : positions)
    position = radius * random.direction().cast<float>();
  return positions;
}

Positions inCube(std::size_t count, float half, unsigned seed)
{
  clouds::Random random(seed);
  Positions positions(count);
  for (Eigen::Vector3f& position : positions)
    position = half * random.inCube().cast<float>();
  return positions;
}

Positions joined(Positions positions, const Positions& more, const Eigen::Vector3f& offset = Eigen::Vector3f::Zero())
{
  for (const Eigen::Vector3f& position : more)
    positions.push_back(position + offset);
  return positions;
}

const Cloud hardClouds[] = {
    {"surface", [] { return onSphere(3000, 1, 1); }},
    {"volume", [] { return inCube(2000, 1, 2); }},
    {"one",
     [] {
       return Positions{{1, 2, 3}};
     }},
    {"three",
     [] {
       return Positions{{1, 2, 3}, {1, 2, 4}, {5, 2, 3}};
     }},
    {"coincident", [] { return Positions(500, Eigen::Vector3f(1, 2, 3)); }},
    {"collinear",
     [] {
       Positions positions;
       for (int i = 0; i < 1000; ++i)
         positions.emplace_back(static_cast<float>(i * i % 1009), 0.f, 0.f);
       return positions;
     }},
    {"lattice", [] { return clouds::lattice(40, .25f).positions; }}, // all distances tie
    {"half of them duplicates",
     [] {
       const Positions once = onSphere(1000, 1, 3);
       return joined(joined(once, once), Positions(300, once.front()));
     }},
    {"far outliers",
     [] {
       return joined(joined(onSphere(2000, 1, 4), onSphere(20, 1000, 5)), {{1e9f, 0, 0}, {0, -3e18f, 1}});
     }},
    {"most in one place", [] { return joined(inCube(200, 1, 6), onSphere(1800, 1e-5f, 7)); }},
    {"two densities",
     [] {
       return joined(onSphere(1000, 1, 8), onSphere(990, 1e-3f, 9), {1, 0, 0});
     }},
    {"clusters of all sizes",
     [] {
       Positions all;
       for (int scale = 0; scale < 12; ++scale)
         all = joined(all, inCube(150, std::ldexp(1.f, -2 * scale), static_cast<unsigned>(10 + scale)), {1, 1, 1});
       return all;
     }},
    {"far from the origin",
     [] {
       return joined({}, onSphere(2000, 1, 11), {3e4f, -2e4f, 1e5f});
     }},
    {"tiny", [] { return onSphere(500, 1e-18f, 12); }},
    {"squares without full precision", [] { return onSphere(500, 1e-20f, 13); }},
    {"squares of few bits", [] { return onSphere(500, 4e-22f, 14); }},
    {"squares that are zero", [] { return onSphere(500, 1e-30f, 15); }},
    {"coordinates without full precision", [] { return onSphere(500, 1e-40f, 16); }},
};

class HardClouds : public testing::TestWithParam<Cloud> {};

/// Neighbors by brute force; among equal distances those with smaller indices.
Neighbors bruteForce(const Positions& positions, const Eigen::Vector3f& query, std::size_t k, float limit)
{
  std::vector<std::pair<float, int>> all;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const float dx = query.x() - positions[i].x(), dy = query.y() - positions[i].y(), dz = query.z() - positions[i].z();
    const float squared = dx * dx + dy * dy + dz * dz;
    if (squared < limit)
      all.emplace_back(squared, static_cast<int>(i));
  }
  std::sort(all.begin(), all.end());
  all.resize(std::min(k, all.size()));
  Neighbors result;
  for (const auto& [distance, index] : all) {
    result.indices.push_back(index);
    result.squaredDistances.push_back(distance);
  }
  return result;
}

constexpr float noLimit = std::numeric_limits<float>::infinity();
constexpr std::size_t all = std::numeric_limits<std::size_t>::max();

void expectEqual(const Neighbors& found, const Neighbors& expected)
{
  EXPECT_EQ(found.indices, expected.indices);
  EXPECT_EQ(found.squaredDistances, expected.squaredDistances);
}

/// Queries at some of the positions, and beside, between and far from them.
Positions queriesFor(const Positions& positions)
{
  Positions queries;
  clouds::Random random(99);
  for (int n = 0; n < 60; ++n) {
    const Eigen::Vector3f &p = positions[random.index(positions.size())],
                          &q = positions[random.index(positions.size())];
    const Eigen::Vector3f aside = random.inCube().cast<float>();
    queries.insert(queries.end(), {p, .5f * p + .5f * q, p + .01f * aside, p + 10 * aside});
  }
  queries.emplace_back(1e12f, -1e12f, 0.f);
  return queries;
}

} // namespace

TEST_P(HardClouds, QueriesAgreeWithBruteForce)
{
  const Positions positions = GetParam().make();
  const auto bins = makePointBins(), tree = makeKdTree();
  bins->setPoints(positions);
  tree->setPoints(positions);
  Neighbors found;
  // Of radii from a few neighbors up to the whole cloud, however it is scaled.
  for (const Eigen::Vector3f& query : queriesFor(positions))
    for (const int k : {1, 2, 4, 9, 13, 40, 200, static_cast<int>(positions.size())}) {
      SCOPED_TRACE(k);
      const Neighbors expected = bruteForce(positions, query, static_cast<std::size_t>(k), noLimit);
      EXPECT_EQ(bins->nearest(query, k, found), static_cast<int>(expected.indices.size()));
      expectEqual(found, expected);
      if (k == 9) { // which of equals at the last distance the kd-tree finds is left to it
        EXPECT_EQ(tree->nearest(query, k, found), static_cast<int>(expected.indices.size()));
        EXPECT_EQ(found.squaredDistances, expected.squaredDistances);
      }
      const float radius = 1.2f * std::sqrt(expected.squaredDistances.back());
      if (radius > 0 && std::isfinite(radius * radius)) {
        const Neighbors inside = bruteForce(positions, query, all, static_cast<float>(double{radius} * radius));
        EXPECT_EQ(bins->within(query, radius, found), static_cast<int>(inside.indices.size()));
        expectEqual(found, inside);
        if (k == 9) {
          tree->within(query, radius, found);
          expectEqual(found, inside);
        }
      }
      if (testing::Test::HasFailure())
        return;
    }
}

TEST_P(HardClouds, AllPositionsAtOnceAgreeWithSingleQueries)
{
  const Positions positions = GetParam().make();
  const auto bins = makePointBins();
  Execution execution(2);
  bins->setPoints(positions, execution);
  for (const int k : {1, 5, 9, 13, 20})
    for (const auto answer : {NeighborSearch::Answer::distances, NeighborSearch::Answer::indicesAndDistances}) {
      SCOPED_TRACE(k);
      std::vector<Neighbors> answers(positions.size());
      bins->forEachPosition(positions, k, answer, execution, [&](const NeighborBatch& batch) {
        for (std::size_t q = 0; q < batch.size; ++q) {
          Neighbors& own = answers[batch.positions[q]];
          for (std::size_t n = 0; n < batch.k && std::isfinite(batch.squaredDistances[q * batch.k + n]); ++n) {
            own.squaredDistances.push_back(batch.squaredDistances[q * batch.k + n]);
            if (batch.indices)
              own.indices.push_back(static_cast<int>(batch.indices[q * batch.k + n]));
          }
        }
      });
      Neighbors expected;
      for (std::size_t i = 0; i < positions.size(); ++i) {
        bins->nearest(positions[i], k, expected);
        // Of a far outlier the distances overflow, and an infinite one is none.
        while (!expected.squaredDistances.empty() && !std::isfinite(expected.squaredDistances.back())) {
          expected.squaredDistances.pop_back();
          expected.indices.pop_back();
        }
        ASSERT_EQ(answers[i].squaredDistances, expected.squaredDistances) << "point " << i;
        if (answer == NeighborSearch::Answer::indicesAndDistances) {
          ASSERT_EQ(answers[i].indices, expected.indices) << "point " << i;
        }
      }
    }
}

/// And after a rest, of which a second one changes nothing, nor does waking what is awake.
TEST_P(HardClouds, WhatIsLeftAfterDroppingPoints)
{
  const Positions positions = GetParam().make();
  const auto bins = makePointBins();
  Execution execution(2);
  // One in nine, all of a few cells with them; and most.
  for (const bool most : {false, true}) {
    bins->setPoints(positions, execution);
    bins->wake(positions, execution);
    bins->rest();
    bins->rest();
    bins->wake(positions, execution);
    std::vector<std::uint8_t> keep(positions.size());
    Positions left;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const bool isOutside = positions[i].x() < positions.front().x() || positions.size() < 100;
      keep[i] = most ? i % 9 == 0 : i % 9 != 0 || isOutside;
      if (keep[i])
        left.push_back(positions[i]);
    }
    bins->dropPoints(left, keep, execution);
    Neighbors found;
    for (const Eigen::Vector3f& query : queriesFor(left)) {
      bins->nearest(query, 9, found);
      expectEqual(found, bruteForce(left, query, 9, noLimit));
      if (testing::Test::HasFailure())
        return;
    }
    std::size_t answered = 0;
    bins->forEachPosition(left, 3, NeighborSearch::Answer::indicesAndDistances, serial,
                          [&](const NeighborBatch& batch) {
                            answered += batch.size;
                            for (std::size_t q = 0; q < batch.size; ++q) {
                              const Neighbors expected = bruteForce(left, left[batch.positions[q]], 3, noLimit);
                              for (std::size_t n = 0; n < expected.indices.size(); ++n)
                                ASSERT_EQ(batch.squaredDistances[3 * q + n], expected.squaredDistances[n]);
                            }
                          });
    EXPECT_EQ(answered, left.size());
  }
}

INSTANTIATE_TEST_SUITE_P(NeighborSearch, HardClouds, testing::ValuesIn(hardClouds), [](const auto& test) {
  std::string name = test.param.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

TEST(NeighborSearch, SameAnswersForAnyNumberOfThreads)
{
  // Enough for several pieces of work in every pass.
  const Positions positions = onSphere(70000, 1, 1);
  const auto indicesWith = [&](int threads) {
    Execution execution(threads);
    const auto bins = makePointBins();
    bins->setPoints(positions, execution);
    std::vector<std::uint32_t> indices(5 * positions.size());
    bins->forEachPosition(positions, 5, NeighborSearch::Answer::indicesAndDistances, execution,
                          [&](const NeighborBatch& batch) {
                            for (std::size_t q = 0; q < batch.size; ++q)
                              std::copy_n(batch.indices + 5 * q, 5, indices.begin() + 5 * batch.positions[q]);
                          });
    return indices;
  };
  sameOnAnyThreads(indicesWith);
}

TEST(NeighborSearch, NoPointsNoAnswers)
{
  const auto bins = makePointBins();
  Neighbors found;
  for (const Positions& positions : {Positions{}, Positions{{1, 2, 3}}}) {
    bins->setPoints(positions);
    EXPECT_EQ(bins->nearest({0, 0, 0}, 0, found), 0);
    EXPECT_EQ(bins->within({0, 0, 0}, 0, found), 0);
    EXPECT_EQ(bins->nearest({std::nanf(""), 0, 0}, 1, found), 0);
    EXPECT_TRUE(found.indices.empty());
  }
  // From one point to none.
  bins->setPoints({});
  EXPECT_EQ(bins->nearest({0, 0, 0}, 3, found), 0);
  EXPECT_EQ(bins->within({0, 0, 0}, 3, found), 0);
  bins->forEachPosition({}, 3, NeighborSearch::Answer::distances, serial, [](const NeighborBatch&) { ADD_FAILURE(); });
}
