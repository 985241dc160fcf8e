#include "support/lattice_matrix.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/solver.h>

#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace pcl::mrf;

namespace {

const Prior allPriors[] = {Prior::membrane, Prior::thinPlate, Prior::triharmonic};
const Energy allEnergies[] = {Energy::joint, Energy::weighted};

PriorOptions priorOptions(Prior prior, Energy energy = Energy::joint, float beta = .99f)
{
  PriorOptions options;
  options.prior = prior;
  options.energy = energy;
  options.beta = beta;
  return options;
}

/// Distances to a sphere of radius 0.3 of the grid within 1.5 voxels of it, but for a cap of 37° around +z: a hole.
Observation observeSphere(GridSize size, double shift = 0, double scale = 1)
{
  Observation observation;
  observation.lattice.size = size;
  const double radius = .3 * std::max({size.x, size.y, size.z});
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const Eigen::Vector3d p = Eigen::Vector3d(x, y, z) - .5 * Eigen::Vector3d(size.x - 1, size.y - 1, size.z - 1);
        const double distance = p.norm() - radius;
        if (std::abs(distance) < 1.5 && p.z() <= .8 * p.norm()) {
          observation.voxels.push_back(size.index(x, y, z));
          observation.distances.push_back(static_cast<float>(scale * distance + shift));
          observation.confidences.push_back(static_cast<float>(1 - distance * distance / 2.3));
        }
      }
  return observation;
}

oracle::Matrix systemMatrix(const LinearSystem<double>& system)
{
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  system.data->appendEntries(entries);
  oracle::Matrix data(static_cast<Eigen::Index>(system.size().count()),
                      static_cast<Eigen::Index>(system.size().count()));
  data.setFromTriplets(entries.begin(), entries.end());
  return oracle::priorMatrix(system.prior) + data;
}

Eigen::Map<const oracle::Vector> asVector(const std::vector<double>& values)
{
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

std::vector<double> directSolution(const LinearSystem<double>& system)
{
  const Eigen::SimplicialLDLT<oracle::Matrix> factor(systemMatrix(system));
  EXPECT_EQ(factor.info(), Eigen::Success);
  const oracle::Vector solution = factor.solve(asVector(system.data->rightHandSide()));
  return {solution.data(), solution.data() + solution.size()};
}

/// ‖a − b‖ / ‖b‖
template <typename A, typename B>
double relativeDifference(const std::vector<A>& a, const std::vector<B>& b)
{
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
    norm += std::pow(static_cast<double>(b[i]), 2);
  }
  return std::sqrt(difference / norm);
}

template <typename Real>
std::vector<Real> zeros(const LinearSystem<Real>& system)
{
  return std::vector<Real>(static_cast<std::size_t>(system.size().count()));
}

SolverOptions solverOptions(SolverMethod method, double tolerance = 1e-4, int maxIterations = 0)
{
  SolverOptions options;
  options.method = method;
  options.residualTolerance = tolerance;
  options.changeTolerance = method == SolverMethod::icm ? tolerance : 0;
  options.maxIterations = maxIterations;
  return options;
}

std::vector<SolverMethod> availableMethods()
{
  std::vector<SolverMethod> methods = {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg};
  if (hasCholesky())
    methods.push_back(SolverMethod::cholesky);
  return methods;
}

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

  std::unique_ptr<DataTerm<Real>> coarsened(Prior prior) const override
  {
    // Lumped: constants, which the coarse grid is there for, see the row sums.
    std::vector<Real> sums(diagonal_.size());
    for (Eigen::Index j = 0; j < matrix_.outerSize(); ++j)
      for (typename Eigen::SparseMatrix<Real>::InnerIterator entry(matrix_, j); entry; ++entry)
        sums[static_cast<std::size_t>(entry.row())] += entry.value();
    for (Real& sum : sums)
      sum = std::max(sum, Real(0));
    return makeDiagonalDataTerm(size_, sums, sums)->coarsened(prior);
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

TEST(Solver, allMethodsGiveTheDirectSolution)
{
  Execution execution;
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors)
      for (const GridSize& size : {GridSize{8, 7, 6}, GridSize{9, 1, 8}, GridSize{13, 11, 10}, GridSize{30, 1, 29}}) {
        const auto system = assemble<double>(observeSphere(size), priorOptions(prior, energyKind, .9f));
        const auto expected = directSolution(system);
        for (const SolverMethod method : availableMethods()) {
          SCOPED_TRACE(testing::Message()
                       << "method " << static_cast<int>(method) << ", k = " << order(prior) << ", energy "
                       << static_cast<int>(energyKind) << ", " << size.x << " x " << size.y << " x " << size.z);
          const bool isIcm = method == SolverMethod::icm;
          if (isIcm && size.count() > 400)
            continue; // it would take ten thousands of sweeps to settle to this precision
          auto d = zeros(system);
          const SolveReport report =
              solve(system, solverOptions(method, isIcm ? 1e-9 : 1e-13, isIcm ? 100000 : 20000), 1, d, execution);
          EXPECT_TRUE(report.converged);
          EXPECT_EQ(report.method, method);
          // ICM's slowest modes still move when its step per sweep is 1e-9.
          EXPECT_LE(relativeDifference(d, expected), isIcm ? 1e-5 : 1e-8);
        }
      }
}

TEST(Solver, allMethodsAgreeInFloat)
{
  Execution execution;
  for (const Prior prior : allPriors) {
    const GridSize size{8, 7, 6};
    const auto expected = directSolution(assemble<double>(observeSphere(size), priorOptions(prior)));
    const auto system = assemble<float>(observeSphere(size), priorOptions(prior));
    for (const SolverMethod method : availableMethods()) {
      auto d = zeros(system);
      solve(system, solverOptions(method, 1e-6, 3000), 1, d, execution);
      // Single precision: the residual stops at about 1e-7 of terms that are up to 12^k times larger than what is left
      // of them, and the hole's modes are determined by that rest.
      EXPECT_LE(relativeDifference(d, expected), prior == Prior::triharmonic ? 1e-3 : 1e-4)
          << "method " << static_cast<int>(method) << ", k = " << order(prior);
    }
  }
}

TEST(Solver, manufacturedSolution)
{
  Execution execution(2);
  for (const Prior prior : allPriors) {
    const GridSize size{33, 32, 31};
    const auto count = static_cast<std::size_t>(size.count());
    const auto weights = oracle::randomValues(count, .5, 50, 21);
    // Any field, and the targets that make it the solution: P x + w (x − t) = 0.
    std::vector<double> field(count), targets(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = static_cast<double>(i);
      field[i] = std::sin(.3 * at) + std::cos(.01 * at);
    }
    LinearSystem<double> system;
    system.prior = {size, prior, {}};
    std::vector<double> bent(count);
    apply(system.prior, field.data(), bent.data(), execution);
    for (std::size_t i = 0; i < count; ++i)
      targets[i] = field[i] + bent[i] / weights[i];
    system.data = makeDiagonalDataTerm(size, weights, targets);
    EXPECT_LE(relativeResidual(system, field, execution), 1e-13);
    std::vector<double> d(count);
    EXPECT_TRUE(solve(system, solverOptions(SolverMethod::multigrid, 1e-12), 1, d, execution).converged);
    EXPECT_LE(relativeDifference(d, field), 1e-9); // the tolerance times a condition below 12³ / 0.5
  }
}

TEST(Solver, halvesAWaveOfTheSmoothingLength)
{
  // A long bar, fully observed: cos(θ(i + ½)) is an eigenvector of L under clamped borders.
  Execution execution;
  const GridSize size{240, 1, 1};
  for (const Prior prior : allPriors) {
    const int k = order(prior);
    const double theta = M_PI * 10 / size.x; // wavelength 48 voxels
    // c_k w = θ^(2k), so that the smoothing length is 1/θ voxels.
    const double w = std::pow(theta, 2 * k) / centreCoefficient(prior);
    const PriorOptions options = priorOptions(prior, Energy::joint, static_cast<float>(w / (1 + w)));
    EXPECT_NEAR(smoothingLength(options, .5), .5 / theta, 1e-5);
    Observation observation;
    observation.lattice.size = size;
    for (int i = 0; i < size.x; ++i) {
      observation.voxels.push_back(i);
      observation.distances.push_back(static_cast<float>(std::cos(theta * (i + .5))));
      observation.confidences.push_back(1);
    }
    const auto system = assemble<double>(observation, options);
    auto d = zeros(system);
    solve(system, solverOptions(SolverMethod::multigrid, 1e-9, 1000), 1, d, execution);
    // The lattice's 2 − 2 cos θ differs from θ² by θ²/12 = .15 %.
    for (int i = 0; i < size.x; ++i)
      ASSERT_NEAR(d[static_cast<std::size_t>(i)], .5 * std::cos(theta * (i + .5)), .002);
  }
}

TEST(Solver, smoothingLengthScalesWithTheVoxel)
{
  const PriorOptions options = priorOptions(Prior::thinPlate);
  EXPECT_DOUBLE_EQ(smoothingLength(options, 3), 3 * smoothingLength(options, 1));
  EXPECT_NEAR(smoothingLength(options, 1), std::pow(42 * 99., -.25), 1e-4);
}

TEST(Solver, followsShiftAndScaleOfTheDistances)
{
  Execution execution;
  const GridSize size{24, 22, 20};
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto plain = assemble<double>(observeSphere(size), priorOptions(prior, energyKind));
      const auto moved = assemble<double>(observeSphere(size, 100, 1000), priorOptions(prior, energyKind));
      auto d = zeros(plain), e = zeros(moved);
      solve(plain, solverOptions(SolverMethod::multigrid, 1e-11), 1, d, execution);
      solve(moved, solverOptions(SolverMethod::multigrid, 1e-11), 1, e, execution);
      for (double& value : d)
        value = 1000 * value + 100;
      EXPECT_LE(relativeDifference(e, d), 1e-6); // the distances are stored in single precision
    }
}

TEST(Solver, floatAgreesWithDouble)
{
  Execution execution(2);
  const GridSize size{40, 40, 40};
  for (const Prior prior : allPriors) {
    const auto exact = assemble<double>(observeSphere(size), priorOptions(prior));
    const auto single = assemble<float>(observeSphere(size), priorOptions(prior));
    auto d = zeros(exact);
    auto f = zeros(single);
    solve(exact, solverOptions(SolverMethod::multigrid, 1e-9), 1, d, execution);
    EXPECT_TRUE(solve(single, solverOptions(SolverMethod::multigrid, 1e-6), 1, f, execution).converged);
    // What is left of the residual moves the hole most; 1e-3 of the field's RMS of about 10 voxels is .01 voxel.
    EXPECT_LE(relativeDifference(f, d), 1e-3) << "k = " << order(prior);
  }
}

TEST(Solver, sameBytesForAnyNumberOfThreads)
{
  const GridSize size{53, 47, 44}; // above the size that is cut into slabs
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto system = assemble<float>(observeSphere(size), priorOptions(prior, energyKind));
      for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg, SolverMethod::icm}) {
        if (method == SolverMethod::icm && energyKind == Energy::weighted && prior != Prior::membrane)
          continue; // an explicit matrix of this size takes too long here; the sweep is the same
        const SolverOptions options = solverOptions(method, 1e-9, method == SolverMethod::icm ? 1 : 2);
        std::vector<float> first;
        std::vector<double> firstHistory;
        for (const int threads : {1, 2, 4, 11}) { // 11: slabs thinner than the smoother's reach
          Execution execution(threads);
          auto d = zeros(system);
          const SolveReport report = solve(system, options, 1, d, execution);
          if (first.empty()) {
            first = d;
            firstHistory = report.history;
          }
          EXPECT_EQ(d, first) << "method " << static_cast<int>(method) << ", " << threads << " threads";
          EXPECT_EQ(report.history, firstHistory);
        }
      }
    }
}

TEST(Multigrid, convergesAtTheExpectedRateWhateverTheSize)
{
  Execution execution(2);
  const struct {
    Prior prior;
    int degree;
    double factor;
  } expected[] = {{Prior::membrane, 2, .3}, {Prior::thinPlate, 5, .5}, {Prior::triharmonic, 10, .8}};
  for (const auto& [prior, degree, factor] : expected)
    for (const int side : {16, 32, 64}) {
      const auto system = assemble<double>(observeSphere({side, side, side}), priorOptions(prior));
      SolverOptions options = solverOptions(SolverMethod::multigrid, 1e-6);
      options.smootherDegree = degree;
      auto d = zeros(system);
      const SolveReport report = solve(system, options, 1, d, execution);
      ASSERT_TRUE(report.converged);
      ASSERT_EQ(static_cast<int>(report.history.size()), report.iterations);
      // From zero, so the residual was 1 before the first iteration.
      EXPECT_LT(std::pow(report.relativeResidual, 1. / report.iterations), factor)
          << "k = " << order(prior) << ", " << side;
    }
}

TEST(Multigrid, convergesForTheWeightedEnergy)
{
  Execution execution(2);
  for (const Prior prior : allPriors)
    for (const int side : {16, 33}) {
      const auto system = assemble<double>(observeSphere({side, side, side}), priorOptions(prior, Energy::weighted));
      auto d = zeros(system);
      const SolveReport report = solve(system, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution);
      EXPECT_TRUE(report.converged);
      EXPECT_LE(report.iterations, 60) << "k = " << order(prior); // hundreds without the coarse grids
    }
}

TEST(Multigrid, aGoodGuessSavesIterations)
{
  Execution execution;
  const auto system = assemble<double>(observeSphere({32, 32, 32}), priorOptions(Prior::thinPlate));
  auto d = zeros(system);
  const int cold = solve(system, solverOptions(SolverMethod::multigrid, 1e-8), 1, d, execution).iterations;
  for (double& value : d)
    value *= 1.0001;
  const int warm = solve(system, solverOptions(SolverMethod::multigrid, 1e-8), 1, d, execution).iterations;
  EXPECT_LT(warm, cold);
  const SolveReport again = solve(system, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution);
  EXPECT_EQ(again.iterations, 0);
  EXPECT_TRUE(again.converged);
}

TEST(Multigrid, tinyWeightsStayDefinite)
{
  Execution execution;
  for (const Prior prior : allPriors)
    for (const float beta : {1e-3f, 1e-6f, 1e-12f, 1e-30f}) {
      Observation observation;
      observation.lattice.size = {20, 18, 16};
      observation.voxels = {2000, 3000};
      observation.distances = {1, 1};
      observation.confidences = {1, 1};
      const auto single = assemble<float>(observation, priorOptions(prior, Energy::joint, beta));
      auto f = zeros(single);
      // Rounding may keep it from the tolerance, but it must not fail or blow up.
      ASSERT_NO_THROW(solve(single, solverOptions(SolverMethod::multigrid), 1, f, execution)) << beta;
      EXPECT_LE(*std::max_element(f.begin(), f.end()), 2.f) << "k = " << order(prior) << ", beta = " << beta;
      EXPECT_GE(*std::min_element(f.begin(), f.end()), -1.f) << "k = " << order(prior) << ", beta = " << beta;
      if (beta >= 1e-6f) {
        const auto exact = assemble<double>(observation, priorOptions(prior, Energy::joint, beta));
        auto d = zeros(exact);
        EXPECT_TRUE(solve(exact, solverOptions(SolverMethod::multigrid, 1e-6), 1, d, execution).converged);
        // Equal observations are met exactly by the constant, which the prior does not penalise.
        for (const double value : d)
          ASSERT_NEAR(value, 1, 1e-3);
      }
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
    for (const SolverMethod method : availableMethods()) {
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
    const auto coarse = fine->coarsened(prior);
    const double scale = std::pow(4.0, order(prior));
    EXPECT_EQ(coarse->size(), (GridSize{2, 1, 1}));
    ASSERT_EQ(coarse->diagonal().size(), 2u);
    EXPECT_DOUBLE_EQ(coarse->diagonal()[0], scale * (1 + 3 + 7 + 9) / 4);
    EXPECT_DOUBLE_EQ(coarse->diagonal()[1], scale * (5 + 11) / 2);
  }
}

TEST(Icm, everySweepLowersTheEnergy)
{
  Execution execution;
  const GridSize size{15, 14, 13};
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      const auto system = assemble<double>(observeSphere(size), priorOptions(prior, energyKind));
      auto d = oracle::randomValues(static_cast<std::size_t>(size.count()), -5, 5, 9);
      SolverOptions options = solverOptions(SolverMethod::icm, 1e-4, 40);
      options.changeTolerance = 0;
      double last = energy(system, d, execution);
      const SolveReport report = solve(system, options, 1, d, execution);
      ASSERT_EQ(report.history.size(), 40u);
      EXPECT_EQ(report.iterations, 40);
      for (const double value : report.history) {
        EXPECT_LT(value, last);
        last = value;
      }
      EXPECT_DOUBLE_EQ(last, energy(system, d, execution));
    }
}

TEST(Icm, oneSweepMinimisesOverALoneVoxel)
{
  Execution execution;
  for (const Prior prior : allPriors) {
    LinearSystem<double> system;
    system.prior = {{1, 1, 1}, prior, {}};
    system.data = makeDiagonalDataTerm<double>({1, 1, 1}, {2.5}, {-3});
    std::vector<double> d = {40};
    solve(system, solverOptions(SolverMethod::icm, 1e-4, 1), 1, d, execution);
    EXPECT_DOUBLE_EQ(d[0], -3);
  }
}

TEST(Icm, theSeedDecidesTheVisitingOrder)
{
  Execution execution;
  const auto system = assemble<double>(observeSphere({9, 8, 7}), priorOptions(Prior::thinPlate));
  const auto run = [&](std::uint64_t seed, int sweeps) {
    SolverOptions options = solverOptions(SolverMethod::icm, 1e-9, sweeps);
    options.seed = seed;
    auto d = zeros(system);
    solve(system, options, 1, d, execution);
    return d;
  };
  EXPECT_EQ(run(1, 3), run(1, 3));
  EXPECT_NE(run(1, 3), run(2, 3));
  EXPECT_LE(relativeDifference(run(1, 100000), run(2, 100000)), 1e-5); // both have settled
}

TEST(Icm, stopsOnTheChangeInVoxelSides)
{
  Execution execution;
  const auto plain = assemble<double>(observeSphere({14, 13, 12}), priorOptions(Prior::membrane));
  const auto metres = assemble<double>(observeSphere({14, 13, 12}, 0, 1024), priorOptions(Prior::membrane));
  auto d = zeros(plain), e = zeros(metres);
  const SolveReport first = solve(plain, solverOptions(SolverMethod::icm, 1e-3), 1, d, execution);
  const SolveReport second = solve(metres, solverOptions(SolverMethod::icm, 1e-3), 1024, e, execution);
  EXPECT_TRUE(first.converged);
  EXPECT_EQ(first.iterations, second.iterations);
}

TEST(Solver, refusesWhatIsNotDetermined)
{
  Execution execution;
  Observation none;
  none.lattice.size = {8, 8, 8};
  for (const SolverMethod method : availableMethods()) {
    const auto unobserved = assemble<float>(none, priorOptions(Prior::membrane));
    auto d = zeros(unobserved);
    EXPECT_THROW(solve(unobserved, solverOptions(method), 1, d, execution), SolverFailure);
    const auto weightless = assemble<float>(observeSphere({8, 8, 8}), priorOptions(Prior::membrane, Energy::joint, 0));
    EXPECT_THROW(solve(weightless, solverOptions(method), 1, d, execution), SolverFailure);

    const auto system = assemble<float>(observeSphere({8, 8, 8}), priorOptions(Prior::thinPlate));
    if (method != SolverMethod::cholesky) { // which needs no guess
      auto bad = zeros(system);
      bad[100] = std::numeric_limits<float>::quiet_NaN();
      EXPECT_THROW(solve(system, solverOptions(method, 1e-4, 5), 1, bad, execution), SolverFailure)
          << static_cast<int>(method);
    }
  }
}

TEST(Solver, zeroDistancesGiveTheZeroField)
{
  Execution execution;
  const auto system = assemble<double>(observeSphere({8, 8, 8}, 0, 0), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : availableMethods()) {
    std::vector<double> d(static_cast<std::size_t>(system.size().count()), 3);
    solve(system, solverOptions(method, 1e-9, 20000), 1, d, execution);
    for (const double value : d)
      ASSERT_NEAR(value, 0, 1e-4) << static_cast<int>(method);
  }
}

TEST(Cholesky, refusesAFactorAboveTheLimit)
{
  Execution execution;
  const auto system = assemble<float>(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  auto d = zeros(system);
  SolverOptions options = solverOptions(SolverMethod::cholesky);
  if (!hasCholesky()) {
    EXPECT_THROW(solve(system, options, 1, d, execution), InvalidOption);
    return;
  }
  options.maxFactorBytes = 3 << 20;
  try {
    solve(system, options, 1, d, execution);
    FAIL() << "accepted";
  } catch (const ResourceLimit& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("4096 unknowns"), std::string::npos) << message;
    EXPECT_NE(message.find("(3 MiB)"), std::string::npos) << message;
    EXPECT_NE(message.find("multigrid"), std::string::npos) << message;
  }
  options.maxFactorBytes = std::size_t{1} << 30;
  EXPECT_TRUE(solve(system, options, 1, d, execution).converged);
}

TEST(Solver, optionLimits)
{
  const auto refused = [](auto&& change) {
    SolverOptions options;
    change(options);
    try {
      validate(options);
    } catch (const InvalidOption& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_NO_THROW(validate(SolverOptions()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value : {0., 1., -1., nan})
    EXPECT_NE(refused([&](SolverOptions& o) { o.residualTolerance = value; }).find("residualTolerance"),
              std::string::npos);
  for (const double value : {-1e-3, nan, std::numeric_limits<double>::infinity()})
    EXPECT_NE(refused([&](SolverOptions& o) { o.changeTolerance = value; }).find("changeTolerance"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.maxIterations = -1; }).find("maxIterations"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.smootherDegree = 51; }).find("smootherDegree"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.smootherDegree = -1; }).find("smootherDegree"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.maxFactorBytes = 0; }).find("maxFactorBytes"), std::string::npos);
  EXPECT_NE(refused([](SolverOptions& o) { o.method = static_cast<SolverMethod>(9); }).find("method"),
            std::string::npos);
}

TEST(Solver, respectsTheNumberOfIterations)
{
  Execution execution;
  const auto system = assemble<float>(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::icm, SolverMethod::cg}) {
    auto d = zeros(system);
    const SolveReport report = solve(system, solverOptions(method, 1e-9, 3), 1, d, execution);
    EXPECT_EQ(report.iterations, 3);
    EXPECT_EQ(report.history.size(), 3u);
    EXPECT_FALSE(report.converged);
    EXPECT_DOUBLE_EQ(report.relativeResidual, relativeResidual(system, d, execution));
  }
}

TEST(Solver, canBeCancelled)
{
  const auto system = assemble<float>(observeSphere({16, 16, 16}), priorOptions(Prior::triharmonic));
  for (const SolverMethod method : availableMethods()) {
    double last = 0;
    Execution execution(2, [&](const std::string&, double fraction) {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
      last = fraction;
      return false;
    });
    auto d = zeros(system);
    EXPECT_THROW(solve(system, solverOptions(method), 1, d, execution), Cancelled) << static_cast<int>(method);
  }
}
