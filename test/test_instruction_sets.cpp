// The hot loops exist for several instruction sets: each gives the same bytes, loop by loop and as a whole mesh.
#include "support/contract.h"

#include "instruction_set.h"
#include "nearest_kernels.h"
#include "plane_kernels.h"

#include <cstring>
#include <random>

using pcl::mrf::InstructionSet;
using pcl::mrf::widestInstructionSet;

namespace {

/// Those that this processor has.
std::vector<InstructionSet> available()
{
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512})
    if (set <= widestInstructionSet(""))
      sets.push_back(set);
  return sets;
}

/// Leaves the set as it was.
class Restore : public testing::Test {
protected:
  void TearDown() override { setInstructionSet(before_); }

private:
  InstructionSet before_ = pcl::mrf::instructionSet();
};

class InstructionSets : public Restore {};

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

/// Results of all loops of the planes, one after the other.
template <typename Real>
std::vector<Real> planeResults()
{
  using namespace pcl::mrf::kernels;
  constexpr int nx = 37, ny = 11; // no multiple of any vector
  constexpr std::int64_t count = nx * ny;
  const std::vector<Real> a = values<Real>(count, 1), b = values<Real>(count, 2), c = values<Real>(count, 3),
                          d = values<Real>(count, 4), e = values<Real>(count, 5), f = values<Real>(count, 6);
  std::vector<Real> all;
  const auto run = [&](const auto& kernel) {
    std::vector<Real> x = values<Real>(count, 7), y = values<Real>(count, 8);
    kernel(x.data(), y.data());
    all.insert(all.end(), x.begin(), x.end());
    all.insert(all.end(), y.begin(), y.end());
  };
  const Real g = Real(.7), h = Real(-1.3);
  run([&](Real* x, Real*) { laplacian(nx, ny, a.data(), b.data(), c.data(), x); });
  run([&](Real* x, Real*) {
    weightedLaplacian(nx, ny, a.data(), b.data(), c.data(), d.data(), e.data(), f.data(), x);
  });
  run([&](Real* x, Real*) { multiply(count, a.data(), x); });
  run([&](Real* x, Real*) { addProduct(count, a.data(), b.data(), x); });
  run([&](Real* x, Real* y) { smoothZero(count, g, a.data(), b.data(), x, y); });
  run([&](Real* x, Real* y) { smoothFirst(count, g, a.data(), b.data(), c.data(), x, y); });
  run([&](Real* x, Real* y) { smooth(count, g, h, a.data(), b.data(), c.data(), x, y); });
  run([&](Real* x, Real*) { residual(count, a.data(), b.data(), x); });
  run([&](Real* x, Real*) { blend(count, a.data(), b.data(), x); });
  run([&](Real* x, Real*) { prolongRow(nx, a.data(), b.data(), x); });
  run([&](Real* x, Real*) { restrictRow(nx, g, a.data(), x); });
  run([&](Real* x, Real*) { combine(count, a.data(), g, b.data(), h, c.data(), g, d.data(), h, x); });
  run([&](Real* x, Real*) { addScaled(count, g, a.data(), x); });
  run([&](Real* x, Real*) { scaleAndAdd(count, g, a.data(), x); });
  const double sum = dot(count, a.data(), b.data());
  all.resize(all.size() + sizeof(double) / sizeof(Real));
  std::memcpy(&*(all.end() - sizeof(double) / sizeof(Real)), &sum, sizeof(double));
  return all;
}

std::vector<float> nearestResults()
{
  using namespace pcl::mrf::kernels;
  const std::vector<float> candidates = values<float>(3 * 101, 1), queries = values<float>(3 * queryLanes, 2);
  const float *cx = candidates.data(), *cy = cx + 101, *cz = cy + 101;
  std::vector<float> all;
  for (const std::size_t k : {std::size_t{1}, std::size_t{5}, std::size_t{9}, mostNearest}) {
    std::vector<float> result(k * queryLanes);
    nearestDistances(101, cx, cy, cz, queries.data(), queries.data() + queryLanes, queries.data() + 2 * queryLanes, k,
                     result.data());
    all.insert(all.end(), result.begin(), result.end());
  }
  std::vector<float> distancesOfOne(101);
  distances(101, cx, cy, cz, .1f, .2f, .3f, distancesOfOne.data());
  all.insert(all.end(), distancesOfOne.begin(), distancesOfOne.end());
  return all;
}

template <typename Real>
bool sameBytes(const std::vector<Real>& a, const std::vector<Real>& b)
{
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Real)) == 0;
}

/// Runs the whole method with each set. \param levelsInBands true: in bands from the second level on
void expectSameMesh(bool levelsInBands, const pcl::mrf::Options& given)
{
  pcl::mrf::Options options = given;
  if (levelsInBands)
    options.multiscale.denseVoxels = 1000;
  pcl::mrf::TriangleMesh first;
  for (const InstructionSet set : available()) {
    setInstructionSet(set);
    contract::Mrf mrf;
    mrf.setOptions(options);
    mrf.setInputCloud(contract::sphereCloud());
    const pcl::mrf::TriangleMesh mesh = contract::run(mrf);
    ASSERT_GT(mesh.triangles.size(), 500u);
    if (first.triangles.empty())
      first = mesh;
    else
      EXPECT_TRUE(conversion::sameBytes(mesh, first)) << static_cast<int>(set);
  }
}

} // namespace

TEST_F(InstructionSets, EnvironmentLimitsThem)
{
  EXPECT_EQ(widestInstructionSet("baseline"), InstructionSet::baseline);
  EXPECT_LE(widestInstructionSet("avx2"), InstructionSet::avx2);
  EXPECT_EQ(widestInstructionSet("avx512"), widestInstructionSet(""));
  const char* limit = std::getenv("MRF_SIMD");
  EXPECT_EQ(pcl::mrf::instructionSet(), widestInstructionSet(limit != nullptr ? limit : ""));
}

TEST_F(InstructionSets, LoopsOfPlanesGiveTheSameBytes)
{
  setInstructionSet(InstructionSet::baseline);
  const std::vector<float> singles = planeResults<float>();
  const std::vector<double> doubles = planeResults<double>();
  for (const InstructionSet set : available()) {
    setInstructionSet(set);
    EXPECT_TRUE(sameBytes(planeResults<float>(), singles)) << static_cast<int>(set);
    EXPECT_TRUE(sameBytes(planeResults<double>(), doubles)) << static_cast<int>(set);
  }
}

TEST_F(InstructionSets, DistancesToNearestPointsAreTheSameBytes)
{
  setInstructionSet(InstructionSet::baseline);
  const std::vector<float> results = nearestResults();
  for (const InstructionSet set : available()) {
    setInstructionSet(set);
    EXPECT_TRUE(sameBytes(nearestResults(), results)) << static_cast<int>(set);
  }
}

TEST_F(InstructionSets, MeshesAreTheSameBytes)
{
  pcl::mrf::Options options;
  expectSameMesh(false, options);
  expectSameMesh(true, options);
  options.observation.estimate = pcl::mrf::Estimate::plane;
  expectSameMesh(true, options);
  options.prior.prior = pcl::mrf::Prior::membrane;
  options.prior.energy = pcl::mrf::Energy::weighted;
  expectSameMesh(false, options);
  options.solver.method = pcl::mrf::SolverMethod::cg;
  expectSameMesh(false, options);
}
