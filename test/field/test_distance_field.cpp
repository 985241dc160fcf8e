// SPDX-License-Identifier: BSD-3-Clause
#include "field/field_sampler.h"

#include "field/field_contents.h"
#include "support/bands.h"
#include "support/shapes.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

using namespace pcl::mrf;

namespace {

/// A field that trilinear interpolation and central differences reproduce exactly, on a lattice off the origin.
DistanceField linearField(const Eigen::Vector3f& slope)
{
  const Lattice lattice{{6, 5, 7}, {10, -20, 3}, .25};
  std::vector<float> distances, confidences;
  shapes::forVoxels(lattice.size, [&](int i, int j, int k) {
    distances.push_back(slope.dot(lattice.position(i, j, k)));
    confidences.push_back(static_cast<float>(i) / 5);
  });
  return {lattice, distances, confidences};
}

} // namespace

TEST(DistanceField, InterpolatesLinearFunctionsExactly)
{
  const Eigen::Vector3f slope(1, -2, .5f);
  const DistanceField field = linearField(slope);
  for (const Eigen::Vector3f& x :
       {Eigen::Vector3f(10.1f, -19.7f, 3.3f), Eigen::Vector3f(11.2f, -19.01f, 4.4f), Eigen::Vector3f(10, -20, 3)}) {
    EXPECT_NEAR(field.sampleDistance(x), slope.dot(x), 1e-5);  // values up to 50 in single precision
    EXPECT_LT((field.sampleGradient(x) - slope).norm(), 1e-4); // differences of such values over .25
  }
}

TEST(DistanceField, IsClampedToItsLatticeAndKnowsItsCells)
{
  const DistanceField field = linearField({1, 0, 0});
  EXPECT_NEAR(field.sampleDistance({0, -20, 3}), 10, 1e-5);
  EXPECT_NEAR(field.sampleDistance({100, 0, 100}), 11.25, 1e-5);
  EXPECT_TRUE(field.hasCell(0, 0, 0));
  EXPECT_TRUE(field.hasCell(4, 3, 5));
  EXPECT_FALSE(field.hasCell(5, 3, 5));
  EXPECT_FALSE(field.hasCell(4, 4, 5));
  EXPECT_FALSE(field.hasCell(4, 3, 6));
  EXPECT_FALSE(field.hasCell(-1, 0, 0));
}

TEST(DistanceField, IsReadFromTheBandThatStoresAPosition)
{
  std::mt19937 random(3);
  std::normal_distribution<float> noise;
  const DistanceField field = bands::nested(random, [&](const Eigen::Vector3f&) { return noise(random); });
  const Eigen::Vector3f at(3.1f, 4.2f, 28.3f); // outside of both boxes
  const DistanceField* coarse = field.coarserBand()->coarserBand();
  ASSERT_NE(coarse, nullptr);
  EXPECT_EQ(coarse->coarserBand(), nullptr);
  EXPECT_FALSE(field.hasCell(3, 4, 28));
  EXPECT_EQ(field.sampleDistance(at), coarse->sampleDistance(at));
  EXPECT_EQ(field.sampleGradient(at), coarse->sampleGradient(at));
  EXPECT_EQ(field.distance(3, 4, 28), coarse->sampleDistance({3, 4, 28}));
  EXPECT_TRUE(field.hasCell(15, 15, 15));
  EXPECT_EQ(field.sampleDistance({15, 15, 15}), field.distance(15, 15, 15));
  // For another process as well.
  Execution execution(1);
  const Eigen::AlignedBox3d box(Eigen::Vector3d(2, 3, 10), Eigen::Vector3d(20, 20, 30));
  const DistanceField part = FieldContents::toField(FieldContents::of(field, box, execution));
  std::uniform_real_distribution<double> share(0, 1);
  for (int n = 0; n < 1000; ++n) {
    const Eigen::Vector3d inside =
        box.min() + Eigen::Vector3d(share(random), share(random), share(random)).cwiseProduct(box.sizes());
    const Eigen::Vector3f x = inside.cast<float>();
    ASSERT_EQ(part.sampleDistance(x), field.sampleDistance(x));
    ASSERT_EQ(part.sampleGradient(x), field.sampleGradient(x));
  }
}

TEST(DistanceField, SamplerGivesWhatTheFieldDoes)
{
  // A walk in small steps, so that it stays in cells; over the border and from piece to piece.
  const DistanceField sphere = shapes::field(shapes::sphere(1), 1.5, 12);
  Lattice elsewhere = sphere.lattice();
  elsewhere.origin.x() += 4;
  std::vector<float> distances;
  for (std::int64_t n = 0; n < elsewhere.size.count(); ++n)
    distances.push_back(static_cast<float>(n % 7));
  const DistanceField field = DistanceField::ofPieces({sphere, DistanceField(elsewhere, distances, {})});
  FieldSampler sampler(field);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> offset(-.05f, .05f);
  for (int n = 0; n < 4000; ++n) {
    const Eigen::Vector3f x(-2 + .002f * static_cast<float>(n), 1 + offset(random), offset(random));
    Eigen::Vector3f gradient, expectedGradient;
    const float distance = sampler.sampleDistance(x, gradient);
    EXPECT_EQ(distance, field.sampleDistance(x, expectedGradient));
    EXPECT_EQ(distance, field.sampleDistance(x));
    EXPECT_EQ(gradient, expectedGradient);
  }
}

TEST(DistanceField, RefusesArraysThatDoNotFit)
{
  EXPECT_THROW(DistanceField({{2, 2, 2}}, std::vector<float>(7), std::vector<float>(8)), std::invalid_argument);
  EXPECT_THROW(DistanceField({{1, 2, 2}}, std::vector<float>(4), std::vector<float>(4)), std::invalid_argument);
}
