// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The prior as an explicit matrix, written down from its definition: the oracle for the matrix-free operator.
#pragma once

#include "solver/linear_system.h"

#include <Eigen/SparseCore>

#include <random>
#include <vector>

namespace oracle {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// Σ over the lattice's edges (i, j) of ½(v_i + v_j) (e_i − e_j)(e_i − e_j)ᵀ.
inline Matrix laplacian(const pcl::mrf::GridSize& size, const Vector& v)
{
  const auto count = static_cast<Eigen::Index>(size.count());
  Eigen::SparseMatrix<double> differences(0, count); // one row per edge, scaled by √ of its weight
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
            const double root = std::sqrt(.5 * (v[i] + v[j]));
            entries.emplace_back(edges, i, root);
            entries.emplace_back(edges, j, -root);
            ++edges;
          }
  differences.resize(edges, count);
  differences.setFromTriplets(entries.begin(), entries.end());
  return Matrix(differences.transpose()) * differences;
}

/// The prior's matrix; `v` empty: voxel weights of 1.
inline Matrix priorMatrix(const pcl::mrf::PriorOperator& prior)
{
  const auto count = static_cast<Eigen::Index>(prior.size.count());
  Vector v = Vector::Ones(count);
  for (std::size_t i = 0; i < prior.voxelWeights.size(); ++i)
    v[static_cast<Eigen::Index>(i)] = prior.voxelWeights[i];
  const Matrix plain = laplacian(prior.size, Vector::Ones(count));
  switch (pcl::mrf::order(prior.kind)) {
  case 1:
    return laplacian(prior.size, v);
  case 2:
    return plain * Matrix(v.asDiagonal() * plain);
  default:
    return plain * Matrix(laplacian(prior.size, v) * plain);
  }
}

inline std::vector<double> randomValues(std::size_t count, double low, double high, unsigned seed)
{
  std::mt19937 random(seed);
  std::vector<double> values(count);
  for (double& value : values)
    value = low + (high - low) * static_cast<double>(random()) / 4294967295.0;
  return values;
}

} // namespace oracle
