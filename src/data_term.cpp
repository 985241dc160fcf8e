#include <pcl/surface/mrf/data_term.h>

#include "linear_system.h"
#include "prior_pipeline.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

template <typename Real>
class DiagonalDataTerm final : public DataTerm<Real> {
public:
  DiagonalDataTerm(GridSize size, std::vector<Real> weights, std::vector<Real> rightHandSide)
      : size_(size), weights_(std::move(weights)), rightHandSide_(std::move(rightHandSide))
  {}

  GridSize size() const override { return size_; }

  void addPlaneProduct(int z, const Real*, const Real* centre, const Real*, Real* y) const override
  {
    const std::int64_t plane = size_.planeCount();
    kernels::addProduct(plane, weights_.data() + plane * z, centre, y);
  }

  const std::vector<Real>& rightHandSide() const override { return rightHandSide_; }
  const std::vector<Real>& diagonal() const override { return weights_; }
  Real spectralBound() const override { return 1; }
  bool isDiagonal() const override { return true; }

  std::unique_ptr<DataTerm<Real>> coarsened(Prior prior, Execution&) const override
  {
    const Real scale = static_cast<Real>(1 << (2 * order(prior)));
    return std::make_unique<DiagonalDataTerm>(size_.coarsened(), meanOfChildren(size_, weights_, scale),
                                              std::vector<Real>());
  }

  void appendEntries(std::vector<Eigen::Triplet<double, std::int64_t>>& entries) const override
  {
    for (std::size_t i = 0; i < weights_.size(); ++i)
      if (weights_[i] != 0)
        entries.emplace_back(static_cast<std::int64_t>(i), static_cast<std::int64_t>(i),
                             static_cast<double>(weights_[i]));
  }

private:
  GridSize size_;
  std::vector<Real> weights_, rightHandSide_;
};

/// Runs body(z, plane z of P x + C x) over all planes; planes are independent of each other.
template <typename Real, typename TargetOf, typename Body>
void forEachProductPlane(const LinearSystem<Real>& system, const Real* x, Execution& execution,
                         const TargetOf& targetOf, const Body& body)
{
  const GridSize size = system.size();
  const std::int64_t plane = size.planeCount();
  const auto planeOf = [&](int z) { return x + plane * z; };
  execution.forRange(size.z, slabThickness(size, execution.threads()), [&](std::int64_t begin, std::int64_t end) {
    PriorPipeline<Real> pipeline(system.prior);
    pipeline.restart(static_cast<int>(begin));
    for (int z = static_cast<int>(begin); z < end; ++z) {
      Real* target = targetOf(z);
      pipeline.produce(z, planeOf, target);
      system.data->addPlaneProduct(z, planeOf(std::max(z - 1, 0)), planeOf(z), planeOf(std::min(z + 1, size.z - 1)),
                                   target);
      body(z, target);
    }
  });
}

double inOrder(const std::vector<double>& parts)
{
  double total = 0;
  for (const double part : parts)
    total += part;
  return total;
}

} // namespace

template <typename Real>
void DataTerm<Real>::addProduct(const Real* x, Real* y, int zBegin, int zEnd) const
{
  const GridSize grid = size();
  const auto plane = [&](int z) { return x + grid.planeCount() * z; };
  for (int z = zBegin; z < zEnd; ++z)
    addPlaneProduct(z, plane(std::max(z - 1, 0)), plane(z), plane(std::min(z + 1, grid.z - 1)),
                    y + grid.planeCount() * z);
}

template <typename Real>
std::unique_ptr<DataTerm<Real>> makeDiagonalDataTerm(GridSize size, std::vector<Real> weights,
                                                     const std::vector<Real>& targets)
{
  if (weights.size() != static_cast<std::size_t>(size.count()) || targets.size() != weights.size())
    throw std::invalid_argument("makeDiagonalDataTerm: needs one weight and one target per voxel");
  std::vector<Real> rightHandSide(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i)
    rightHandSide[i] = weights[i] * targets[i];
  return std::make_unique<DiagonalDataTerm<Real>>(size, std::move(weights), std::move(rightHandSide));
}

double dataWeight(double confidence, double beta)
{
  const double a = std::clamp(confidence * beta, 0.0, 1 - 1e-6);
  return a / (1 - a);
}

template <typename Real>
LinearSystem<Real> assemble(const Observation& observation, const PriorOptions& options)
{
  validate(options);
  const GridSize size = observation.lattice.size;
  const auto count = static_cast<std::size_t>(size.count());
  if (observation.distances.size() != observation.voxels.size() ||
      observation.confidences.size() != observation.voxels.size())
    throw std::invalid_argument("assemble: the observation's arrays differ in length");

  const bool weighted = options.energy == Energy::weighted;
  const double centre = centreCoefficient(options.prior);
  LinearSystem<Real> system;
  system.prior.size = size;
  system.prior.prior = options.prior;
  if (weighted)
    system.prior.voxelWeights.assign(count, Real(1));
  std::vector<Real> weights(count, Real(0)), targets(count, Real(0));
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
    if (voxel >= count)
      throw std::invalid_argument("assemble: an observed voxel is outside the lattice");
    const double w = dataWeight(static_cast<double>(observation.confidences[n]), static_cast<double>(options.beta));
    const double a = w / (1 + w);
    weights[voxel] = static_cast<Real>(centre * (weighted ? a : w));
    targets[voxel] = static_cast<Real>(observation.distances[n]);
    if (weighted)
      system.prior.voxelWeights[voxel] = static_cast<Real>(1 - a);
  }
  system.data = makeDiagonalDataTerm(size, std::move(weights), targets);
  return system;
}

template <typename Real>
std::vector<Real> meanOfChildren(const GridSize& size, const std::vector<Real>& values, Real scale)
{
  const GridSize coarse = size.coarsened();
  std::vector<Real> result(static_cast<std::size_t>(coarse.count()));
  auto out = result.begin();
  for (int z = 0; z < coarse.z; ++z)
    for (int y = 0; y < coarse.y; ++y)
      for (int x = 0; x < coarse.x; ++x) {
        Real sum = 0;
        int children = 0;
        for (int c = 2 * z; c < std::min(2 * z + 2, size.z); ++c)
          for (int b = 2 * y; b < std::min(2 * y + 2, size.y); ++b)
            for (int a = 2 * x; a < std::min(2 * x + 2, size.x); ++a, ++children)
              sum += values[static_cast<std::size_t>(size.index(a, b, c))];
        *out++ = scale * sum / static_cast<Real>(children);
      }
  return result;
}

int slabThickness(const GridSize& size, int threads)
{
  if (size.count() < serialVoxels || threads == 1)
    return size.z;
  return (size.z + threads - 1) / threads;
}

template <typename Real>
void applySystem(const LinearSystem<Real>& system, const Real* x, Real* y, Execution& execution)
{
  const std::int64_t plane = system.size().planeCount();
  forEachProductPlane(
      system, x, execution, [&](int z) { return y + plane * z; }, [](int, Real*) {});
}

template <typename Real>
double applySystemAndDot(const LinearSystem<Real>& system, const Real* x, Real* y, Execution& execution)
{
  const std::int64_t plane = system.size().planeCount();
  std::vector<double> parts(static_cast<std::size_t>(system.size().z));
  forEachProductPlane(
      system, x, execution, [&](int z) { return y + plane * z; },
      [&](int z, Real* product) { parts[static_cast<std::size_t>(z)] = kernels::dot(plane, x + plane * z, product); });
  return inOrder(parts);
}

template <typename Real>
double systemResidual(const LinearSystem<Real>& system, const Real* b, const Real* x, Real* r, Execution& execution)
{
  const std::int64_t plane = system.size().planeCount();
  std::vector<double> parts(static_cast<std::size_t>(system.size().z));
  forEachProductPlane(
      system, x, execution, [&](int z) { return r + plane * z; },
      [&](int z, Real* product) {
        for (std::int64_t i = 0; i < plane; ++i)
          product[i] = b[plane * z + i] - product[i];
        parts[static_cast<std::size_t>(z)] = kernels::dot(plane, product, product);
      });
  return inOrder(parts);
}

template <typename Real>
double dotProduct(std::size_t count, const Real* x, const Real* y, Execution& execution)
{
  return execution.sum(static_cast<std::int64_t>(count), sumGrain, [&](std::int64_t begin, std::int64_t end) {
    return kernels::dot(end - begin, x + begin, y + begin);
  });
}

template <typename Real>
Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> systemMatrix(const LinearSystem<Real>& system)
{
  const std::int64_t count = system.size().count();
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  system.data->appendEntries(entries);
  Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> data(count, count);
  data.setFromTriplets(entries.begin(), entries.end());
  return priorMatrix(system.prior) + data;
}

#define MRF_INSTANTIATE(Real)                                                                                          \
  template class DataTerm<Real>;                                                                                       \
  template std::unique_ptr<DataTerm<Real>> makeDiagonalDataTerm(GridSize, std::vector<Real>,                           \
                                                                const std::vector<Real>&);                             \
  template LinearSystem<Real> assemble(const Observation&, const PriorOptions&);                                       \
  template std::vector<Real> meanOfChildren(const GridSize&, const std::vector<Real>&, Real);                          \
  template void applySystem(const LinearSystem<Real>&, const Real*, Real*, Execution&);                                \
  template double applySystemAndDot(const LinearSystem<Real>&, const Real*, Real*, Execution&);                        \
  template double systemResidual(const LinearSystem<Real>&, const Real*, const Real*, Real*, Execution&);              \
  template double dotProduct(std::size_t, const Real*, const Real*, Execution&);                                       \
  template Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> systemMatrix(const LinearSystem<Real>&);

MRF_INSTANTIATE(float)
MRF_INSTANTIATE(double)
#undef MRF_INSTANTIATE

} // namespace mrf
} // namespace pcl
