// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Eigenvalues of linear_algebra.hpp: a file of their own, for they take as long to compile as the rest.

#include <Eigen/Eigenvalues>

#include "math/linear_algebra.hpp"

namespace truing::math {

template <int N>
SymmetricEigen<N> symmetric_eigen(const Matrix<N>& A) {
  const Eigen::SelfAdjointEigenSolver<Matrix<N>> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template SymmetricEigen<3> symmetric_eigen<3>(const Matrix<3>&);
template SymmetricEigen<Eigen::Dynamic> symmetric_eigen<Eigen::Dynamic>(const Matrix<Eigen::Dynamic>&);

Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A) { return A.eigenvalues(); }

}  // namespace truing::math
