// SPDX-License-Identifier: BSD-3-Clause
// The hot loops exist for several instruction sets, which give the same bytes in each loop and for a whole mesh.
#include "base/multiversioning.h"
#include "base/vector_kernels.h"
#include "solver/grid_solver.h"
#include "support/contract.h"
#include "support/linear_systems.h"

#include <cstring>
#include <random>

using pcl::mrf::InstructionSet;
using pcl::mrf::widestInstructionSet;

namespace {

/// The instruction sets that this processor has.
std::vector<InstructionSet> available()
{
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512})
    if (set <= widestInstructionSet(""))
      sets.push_back(set);
  return sets;
}

/// Restores the instruction set after each test.
class InstructionSets : public testing::Test {
protected:
  void TearDown() override { pcl::mrf::instructionSet = before_; }

private:
  InstructionSet before_ = pcl::mrf::instructionSet;
};

template <typename Real>
std::vector<Real> values(std::size_t count, unsigned seed)
{
  std::mt19937 random(seed);
  std::vector<Real> result(count);
  for (Real& value : result) // of many sizes, so that another order or precision of the sums shows
    value =
        static_cast<Real>((static_cast<double>(random()) - 2147483648.0) * std::pow(2., double(random() % 20) - 40));
  return result;
}

/// The results of all loops over vectors, concatenated.
template <typename Real>
std::vector<Real> vectorResults()
{
  using namespace pcl::mrf::kernels;
  constexpr std::int64_t count = 407; // no multiple of any vector
  const std::vector<Real> a = values<Real>(count, 1), b = values<Real>(count, 2);
  std::vector<Real> all = values<Real>(count, 7);
  scaleAndAdd(count, Real(.7), a.data(), all.data());
  const double sum = dot(count, a.data(), b.data());
  all.resize(all.size() + sizeof(double) / sizeof(Real));
  std::memcpy(&*(all.end() - sizeof(double) / sizeof(Real)), &sum, sizeof(double));
  return all;
}

/// The results of a level's grids for points on a sphere, or for the voxels near it. They use every loop of the
/// smoother, the transfers and the data.
std::vector<float> gridResults(bool atPoints)
{
  const systems::SphereLevel level({21, 18, 19}, pcl::mrf::Prior::triharmonic, atPoints);
  std::vector<float> field(level.size().count(), 0);
  pcl::mrf::Execution execution(1);
  solveOnGrids({level.grids, level.prior, level.grids.front().voxels}, {3}, {}, 1, field.data(), execution);
  return field;
}

template <typename Real>
bool sameBytes(const std::vector<Real>& a, const std::vector<Real>& b)
{
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Real)) == 0;
}

} // namespace

TEST_F(InstructionSets, EnvironmentLimitsThem)
{
  EXPECT_EQ(widestInstructionSet("baseline"), InstructionSet::baseline);
  EXPECT_LE(widestInstructionSet("avx2"), InstructionSet::avx2);
  EXPECT_EQ(widestInstructionSet("avx512"), widestInstructionSet(""));
  const char* limit = std::getenv("MRF_SIMD");
  EXPECT_EQ(pcl::mrf::instructionSet, widestInstructionSet(limit != nullptr ? limit : ""));
}

TEST_F(InstructionSets, LoopsOfTheSolverGiveTheSameBytes)
{
  pcl::mrf::instructionSet = InstructionSet::baseline;
  const std::vector<float> singles = vectorResults<float>(), ofPoints = gridResults(true),
                           ofVoxels = gridResults(false);
  const std::vector<double> doubles = vectorResults<double>();
  for (const InstructionSet set : available()) {
    pcl::mrf::instructionSet = set;
    EXPECT_TRUE(sameBytes(vectorResults<float>(), singles)) << static_cast<int>(set);
    EXPECT_TRUE(sameBytes(vectorResults<double>(), doubles)) << static_cast<int>(set);
    EXPECT_TRUE(sameBytes(gridResults(true), ofPoints)) << static_cast<int>(set);
    EXPECT_TRUE(sameBytes(gridResults(false), ofVoxels)) << static_cast<int>(set);
  }
}

TEST_F(InstructionSets, MeshesAreTheSameBytes)
{
  pcl::mrf::Options options;
  options.multiscale.denseVoxels = 1000; // in bands from the second level on
  pcl::mrf::TriangleMesh first;
  for (const InstructionSet set : available()) {
    pcl::mrf::instructionSet = set;
    contract::OnSphere mrf;
    mrf.setOptions(options);
    const pcl::mrf::TriangleMesh mesh = contract::run(mrf);
    ASSERT_GT(mesh.triangles.size(), 500u);
    if (first.triangles.empty())
      first = mesh;
    EXPECT_TRUE(conversion::sameBytes(mesh, first)) << static_cast<int>(set);
  }
}
