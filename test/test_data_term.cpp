#include "support/linear_systems.h"

#include <pcl/surface/mrf/data_term.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace pcl::mrf;
using namespace systems;

namespace {

/// Observes the field and its gradient at points between the voxels: C = Σ ρ (ccᵀ + g² GᵀG) couples the 8 voxels of a
/// cell.
template <typename Real>
class PointDataTerm final : public DataTerm<Real> {
public:
  PointDataTerm(GridSize size, int points, unsigned seed) : size_(size)
  {
    std::mt19937 random(seed);
    const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
    matrix_.resize(static_cast<Eigen::Index>(size.count()), static_cast<Eigen::Index>(size.count()));
    rightHandSide_.assign(static_cast<std::size_t>(size.count()), 0);
    std::vector<Eigen::Triplet<Real>> entries;
    for (int n = 0; n < points; ++n) {
      const int corner[3] = {static_cast<int>(uniform() * (size.x - 1)), static_cast<int>(uniform() * (size.y - 1)),
                             static_cast<int>(uniform() * (size.z - 1))};
      const double u[3] = {uniform(), uniform(), uniform()};
      const double value = uniform() - .5;
      // Four functionals of the cell's 8 values: the interpolated value and the gradient's components.
      for (int functional = 0; functional < 4; ++functional) {
        double weights[8];
        int voxels[8];
        for (int c = 0; c < 8; ++c) {
          double weight = 1;
          for (int axis = 0; axis < 3; ++axis) {
            const bool upper = (c >> axis) & 1;
            weight *= functional == axis + 1 ? (upper ? 1 : -1) : (upper ? u[axis] : 1 - u[axis]);
          }
          weights[c] = weight;
          voxels[c] =
              static_cast<int>(size.index(corner[0] + (c & 1), corner[1] + ((c >> 1) & 1), corner[2] + (c >> 2)));
        }
        const double scale = functional == 0 ? 100 : 10;
        for (int a = 0; a < 8; ++a) {
          rightHandSide_[static_cast<std::size_t>(voxels[a])] += static_cast<Real>(scale * weights[a] * value);
          for (int b = 0; b < 8; ++b)
            entries.emplace_back(voxels[a], voxels[b], static_cast<Real>(scale * weights[a] * weights[b]));
        }
      }
    }
    matrix_.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index i = 0; i < matrix_.rows(); ++i)
      diagonal_.push_back(matrix_.coeff(i, i));
  }

  GridSize size() const override { return size_; }

  void addPlaneProduct(int z, const Real* below, const Real* centre, const Real* above, Real* y) const override
  {
    const std::int64_t plane = size_.planeCount();
    for (std::int64_t i = 0; i < plane; ++i)
      for (typename Eigen::SparseMatrix<Real>::InnerIterator entry(matrix_, static_cast<Eigen::Index>(plane * z + i));
           entry; ++entry) {
        const std::int64_t offset = entry.row() - plane * z;
        const Real x = offset < 0 ? below[offset + plane] : offset < plane ? centre[offset] : above[offset - plane];
        y[i] += entry.value() * x;
      }
  }

  const std::vector<Real>& rightHandSide() const override { return rightHandSide_; }
  const std::vector<Real>& diagonal() const override { return diagonal_; }
  Real spectralBound() const override { return 8; } // eight voxels per functional
  bool isDiagonal() const override { return false; }

  std::unique_ptr<DataTerm<Real>> coarsened(Prior prior, Execution& execution) const override
  {
    // Lumped: constants, which the coarse grid is there for, see the row sums.
    std::vector<Real> sums(diagonal_.size());
    for (Eigen::Index j = 0; j < matrix_.outerSize(); ++j)
      for (typename Eigen::SparseMatrix<Real>::InnerIterator entry(matrix_, j); entry; ++entry)
        sums[static_cast<std::size_t>(entry.row())] += entry.value();
    for (Real& sum : sums)
      sum = std::max(sum, Real(0));
    return makeDiagonalDataTerm(size_, sums, sums)->coarsened(prior, execution);
  }

  void appendEntries(std::vector<Eigen::Triplet<double, std::int64_t>>& entries) const override
  {
    for (Eigen::Index j = 0; j < matrix_.outerSize(); ++j)
      for (typename Eigen::SparseMatrix<Real>::InnerIterator entry(matrix_, j); entry; ++entry)
        entries.emplace_back(entry.row(), entry.col(), static_cast<double>(entry.value()));
  }

private:
  GridSize size_;
  Eigen::SparseMatrix<Real> matrix_;
  std::vector<Real> rightHandSide_, diagonal_;
};

} // namespace

TEST(Assemble, weightsAndTargetsOfBothEnergies)
{
  Observation observation;
  observation.lattice.size = {3, 2, 2};
  observation.voxels = {1, 7};
  observation.distances = {.5f, -2.f};
  observation.confidences = {1.f, .25f};
  for (const Prior prior : allPriors) {
    const double c = centreCoefficient(prior);
    const auto joint = assemble<double>(observation, priorOptions(prior, Energy::joint, .8f));
    const auto weighted = assemble<double>(observation, priorOptions(prior, Energy::weighted, .8f));
    EXPECT_TRUE(joint.prior.voxelWeights.empty());
    for (std::size_t i = 0; i < 12; ++i) {
      const double a = i == 1 ? .8 : i == 7 ? .2 : 0;
      const double target = i == 1 ? .5 : i == 7 ? -2 : 0;
      // β = .8 is not representable in single precision.
      EXPECT_NEAR(joint.data->diagonal()[i], c * a / (1 - a), 1e-6 * c * 4);
      EXPECT_NEAR(joint.data->rightHandSide()[i], c * a / (1 - a) * target, 1e-6 * c * 4);
      EXPECT_NEAR(weighted.data->diagonal()[i], c * a, 1e-6 * c);
      EXPECT_NEAR(weighted.data->rightHandSide()[i], c * a * target, 1e-6 * c);
      EXPECT_NEAR(weighted.prior.voxelWeights[i], 1 - a, 1e-6);
    }
  }
  // α β = 1 would be an infinite weight.
  observation.confidences = {1.f, 1.f};
  const auto strong =
      assemble<double>(observation, priorOptions(Prior::membrane, Energy::joint, std::nextafter(1.f, 0.f)));
  EXPECT_NEAR(strong.data->diagonal()[1], 6e6, 10);
}

TEST(Assemble, matrixFreeSystemIsTheExplicitMatrix)
{
  Execution execution;
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{9, 8, 7}, GridSize{10, 1, 10}, GridSize{2, 10, 9}}) {
        const auto system = assemble<double>(observeSphere(size), priorOptions(prior, energyKind));
        const auto x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 11);
        const auto matrix = systemMatrix(system);
        const auto b = asVector(system.data->rightHandSide());
        const oracle::Vector product = matrix * asVector(x);
        // Rounding of a sum of a few hundred terms.
        EXPECT_NEAR(relativeResidual(system, x, execution), (b - product).norm() / b.norm(), 1e-11);
        const double expected =
            (.5 * asVector(x).dot(product) - b.dot(asVector(x))) / static_cast<double>(size.count());
        EXPECT_NEAR(energy(system, x, execution), expected, 1e-11 * std::abs(expected));
      }
}

TEST(DataTerm, blocksThatCoupleVoxelsWorkWithEveryMethod)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    const GridSize size{11, 12, 9};
    LinearSystem<double> system;
    system.prior = {size, prior, {}};
    system.data = std::make_unique<PointDataTerm<double>>(size, 150, 4);
    const auto x = oracle::randomValues(static_cast<std::size_t>(size.count()), -1, 1, 2);
    const oracle::Vector residual = asVector(system.data->rightHandSide()) - systemMatrix(system) * asVector(x);
    EXPECT_NEAR(relativeResidual(system, x, execution), residual.norm() / asVector(system.data->rightHandSide()).norm(),
                1e-11);

    const auto expected = directSolution(system);
    for (const SolverMethod method : allMethods) {
      const bool isIcm = method == SolverMethod::icm;
      auto d = zeros(system);
      EXPECT_TRUE(solve(system, solverOptions(method, isIcm ? 1e-9 : 1e-12, 50000), 1, d, execution).converged);
      EXPECT_LE(relativeDifference(d, expected), isIcm ? 1e-5 : 1e-8)
          << "method " << static_cast<int>(method) << ", k = " << order(prior);
    }
  }
}

TEST(DataTerm, blocksGiveTheSameBytesForAnyNumberOfThreads)
{
  const GridSize size{51, 46, 45};
  for (const Prior prior : {Prior::membrane, Prior::triharmonic}) {
    LinearSystem<float> system;
    system.prior = {size, prior, {}};
    system.data = std::make_unique<PointDataTerm<float>>(size, 3000, 4);
    std::vector<float> first;
    for (const int threads : {1, 2, 5}) {
      Execution execution(threads);
      auto d = zeros(system);
      solve(system, solverOptions(SolverMethod::multigrid, 1e-9, 2), 1, d, execution);
      if (first.empty())
        first = d;
      EXPECT_EQ(d, first) << threads;
    }
  }
}

TEST(DataTerm, coarsenedWeightsAreScaledMeansOfTheChildren)
{
  const GridSize size{3, 2, 1};
  const std::vector<double> weights = {1, 3, 5, 7, 9, 11};
  const auto fine = makeDiagonalDataTerm(size, weights, weights);
  for (const Prior prior : allPriors) {
    Execution execution(1);
    const auto coarse = fine->coarsened(prior, execution);
    const double scale = std::pow(4.0, order(prior));
    EXPECT_EQ(coarse->size(), (GridSize{2, 1, 1}));
    ASSERT_EQ(coarse->diagonal().size(), 2u);
    EXPECT_DOUBLE_EQ(coarse->diagonal()[0], scale * (1 + 3 + 7 + 9) / 4);
    EXPECT_DOUBLE_EQ(coarse->diagonal()[1], scale * (5 + 11) / 2);
  }
}
