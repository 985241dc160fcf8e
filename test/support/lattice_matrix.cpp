// SPDX-License-Identifier: BSD-3-Clause
#include "support/lattice_matrix.h"
#include "field/prior.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace oracle {

Matrix laplacian(const pcl::mrf::GridSize& size)
{
  const auto count = static_cast<Eigen::Index>(size.count());
  Eigen::SparseMatrix<double> differences(0, count); // one row per edge
  std::vector<Eigen::Triplet<double>> entries;
  int edges = 0;
  const int steps[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        for (const auto& step : steps)
          if (size.contains(x + step[0], y + step[1], z + step[2])) {
            const auto i = static_cast<int>(size.index(x, y, z));
            const auto j = static_cast<int>(size.index(x + step[0], y + step[1], z + step[2]));
            entries.emplace_back(edges, i, 1);
            entries.emplace_back(edges, j, -1);
            ++edges;
          }
  differences.resize(edges, count);
  differences.setFromTriplets(entries.begin(), entries.end());
  return Matrix(differences.transpose()) * differences;
}

Matrix priorMatrix(const pcl::mrf::GridSize& size, pcl::mrf::Prior prior)
{
  const Matrix single = laplacian(size);
  Matrix power = single;
  for (int k = 1; k < order(prior); ++k)
    power = (power * single).pruned();
  return power;
}

Vector solved(const Matrix& matrix, const Vector& rightHandSide)
{
  const Eigen::SimplicialLDLT<Matrix> factor(matrix);
  EXPECT_EQ(factor.info(), Eigen::Success);
  return factor.solve(rightHandSide);
}

Spectrum spectrumOf(const Eigen::MatrixXd& matrix)
{
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  EXPECT_EQ(solver.info(), Eigen::Success);
  return {solver.eigenvalues(), solver.eigenvectors().col(0)};
}

bool isPositiveDefinite(const Eigen::MatrixXd& matrix)
{
  return Eigen::LLT<Eigen::MatrixXd>(matrix).info() == Eigen::Success;
}

std::vector<double> randomValues(std::size_t count, double low, double high, unsigned seed)
{
  std::mt19937 random(seed);
  std::vector<double> values(count);
  for (double& value : values)
    value = low + (high - low) * static_cast<double>(random()) / 4294967295.0;
  return values;
}

} // namespace oracle
