// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Eigenvalues and singular values of linear_algebra.hpp: a file of their own, for they take as long to compile as the
// rest.

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

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

SingularValues singular_values(const Eigen::Matrix3d& A) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

ThinSingularValues thin_singular_values(const Eigen::MatrixXd& A) {
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace truing::math
