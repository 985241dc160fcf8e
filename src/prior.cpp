#include <pcl/surface/mrf/prior.h>

#include "linear_system.h"
#include "prior_pipeline.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

using Matrix = Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>;

/// L_v, or L where `weights` is null.
template <typename Real>
Matrix laplacianMatrix(const GridSize& size, const std::vector<Real>* weights)
{
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  entries.reserve(static_cast<std::size_t>(size.count()) * 12);
  const auto weightOf = [&](std::int64_t i) {
    return weights ? static_cast<double>((*weights)[static_cast<std::size_t>(i)]) : 1.0;
  };
  const auto addEdge = [&](std::int64_t i, std::int64_t j) {
    const double weight = .5 * (weightOf(i) + weightOf(j));
    entries.emplace_back(i, i, weight);
    entries.emplace_back(j, j, weight);
    entries.emplace_back(i, j, -weight);
    entries.emplace_back(j, i, -weight);
  };
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x) {
        const std::int64_t i = size.index(x, y, z);
        if (x + 1 < size.x)
          addEdge(i, i + 1);
        if (y + 1 < size.y)
          addEdge(i, i + size.x);
        if (z + 1 < size.z)
          addEdge(i, i + size.planeCount());
      }
  Matrix matrix(size.count(), size.count());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

} // namespace

void validate(const PriorOptions& options)
{
  const int k = order(options.prior);
  if (k < 1 || k > 3)
    throw InvalidOption("prior is of order " + std::to_string(k) + "; it must be 1, 2 or 3");
  if (!(options.beta >= 0 && options.beta < 1))
    throw InvalidOption("beta is " + std::to_string(options.beta) + "; it must be at least 0 and below 1");
  if (options.energy != Energy::joint && options.energy != Energy::weighted)
    throw InvalidOption("energy is " + std::to_string(static_cast<int>(options.energy)) +
                        "; it must be joint or weighted");
}

double smoothingLength(const PriorOptions& options, double voxelSize)
{
  const double beta = options.beta;
  const double balance = centreCoefficient(options.prior) * beta / (1 - beta);
  return voxelSize * std::pow(balance, -.5 / order(options.prior));
}

template <typename Real>
void apply(const PriorOperator<Real>& prior, const Real* x, Real* y, Execution& execution)
{
  const auto plane = static_cast<std::size_t>(prior.size.planeCount());
  if (!prior.voxelWeights.empty() && prior.voxelWeights.size() != static_cast<std::size_t>(prior.size.count()))
    throw std::invalid_argument("apply: voxelWeights must be empty or hold one value per voxel");
  execution.forRange(prior.size.z, slabThickness(prior.size, execution.threads()),
                     [&](std::int64_t begin, std::int64_t end) {
                       PriorPipeline<Real> pipeline(prior);
                       pipeline.restart(static_cast<int>(begin));
                       for (int z = static_cast<int>(begin); z < end; ++z)
                         pipeline.produce(
                             z, [&](int at) { return x + plane * static_cast<std::size_t>(at); },
                             y + plane * static_cast<std::size_t>(z));
                     });
}

template <typename Real>
Matrix priorMatrix(const PriorOperator<Real>& prior)
{
  const std::vector<Real>* none = nullptr;
  const Matrix laplacian = laplacianMatrix(prior.size, none);
  const int k = order(prior.prior);
  if (prior.voxelWeights.empty()) {
    Matrix matrix = laplacian;
    for (int power = 1; power < k; ++power)
      matrix = Matrix(laplacian * matrix);
    return matrix;
  }
  if (k == 2) {
    Matrix scaled = laplacian;
    for (std::int64_t column = 0; column < scaled.outerSize(); ++column)
      for (Matrix::InnerIterator entry(scaled, column); entry; ++entry)
        entry.valueRef() *= static_cast<double>(prior.voxelWeights[static_cast<std::size_t>(entry.row())]);
    return Matrix(laplacian * scaled);
  }
  const Matrix weighted = laplacianMatrix(prior.size, &prior.voxelWeights);
  return k == 1 ? weighted : Matrix(laplacian * Matrix(weighted * laplacian));
}

template void apply(const PriorOperator<float>&, const float*, float*, Execution&);
template void apply(const PriorOperator<double>&, const double*, double*, Execution&);
template Matrix priorMatrix(const PriorOperator<float>&);
template Matrix priorMatrix(const PriorOperator<double>&);

} // namespace mrf
} // namespace pcl
