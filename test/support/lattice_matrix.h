// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The prior as an explicit matrix, written down from its definition: the oracle for the matrix-free operator.
#pragma once

#include <pcl/surface/mrf/lattice.h>
#include <pcl/surface/mrf/options.h>

#include <Eigen/SparseCore>

#include <vector>

namespace oracle {

using Matrix = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;

/// L: Σ over the lattice's edges (i, j) of (e_i − e_j)(e_i − e_j)ᵀ.
Matrix laplacian(const pcl::mrf::GridSize& size);

/// L^k
Matrix priorMatrix(const pcl::mrf::GridSize& size, pcl::mrf::Prior prior);

/// The solution of a symmetric positive definite system, by a factorization.
Vector solved(const Matrix& matrix, const Vector& rightHandSide);

/// The eigenvalues of a symmetric matrix, ascending, and the eigenvector of the first.
struct Spectrum {
  Vector values, first;
};
Spectrum spectrumOf(const Eigen::MatrixXd& matrix);

bool isPositiveDefinite(const Eigen::MatrixXd& matrix);

std::vector<double> randomValues(std::size_t count, double low, double high, unsigned seed);

} // namespace oracle
