// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Decompositions and large products of matrices, compiled once: each is hundreds of Eigen's templates, and a file that
// asks Eigen for one compiles for many seconds longer. The sizes that inner loops use stand at the end of
// linear_algebra.cpp, cholesky.cpp, eigenvalues.cpp and products.cpp, and Eigen::Dynamic for all others.

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "rooms.hpp"

namespace truing::math {

template <int N, int M = N>
using Matrix = Eigen::Matrix<double, N, M>;
template <int N>
using Vector = Eigen::Matrix<double, N, 1>;

/// A = V diag(values) V^T, values ascending.
template <int N>
struct SymmetricEigen {
  Vector<N> values;
  Matrix<N> vectors;
};
template <int N>
SymmetricEigen<N> symmetric_eigen(const Matrix<N>& A);

/// A^-1 b of a symmetric A, by L D L^T with pivots: A may be semidefinite, or a little indefinite by rounding.
template <int N, int M>
Matrix<N, M> solve_symmetric(const Matrix<N>& A, const Matrix<N, M>& b);
template <int N>
Matrix<N> inverse_symmetric(const Matrix<N>& A);

/// A^-1 b of a positive definite A, by L L^T.
template <int N, int M>
Matrix<N, M> solve_definite(const Matrix<N>& A, const Matrix<N, M>& b);

/// A = L L^T, for who needs both A^-1 b and L^-1 b.
template <int N>
using Cholesky = Eigen::LLT<Matrix<N>>;
template <int N>
Cholesky<N> cholesky(const Matrix<N>& A);
template <int N, int M>
Matrix<N, M> solve_factored(const Cholesky<N>& factor, const Matrix<N, M>& b);
template <int N, int M>
Matrix<N, M> whitened(const Cholesky<N>& factor, const Matrix<N, M>& b);

/// A^-1 b of a square A, by L U with pivots.
template <int N>
Vector<N> solve_square(const Matrix<N>& A, const Vector<N>& b);

/// Least squares |A x - b|, by Q R with pivots.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b);
/// The shortest x with A x = b of a symmetric A, where eigenvalues below `threshold` of the largest are nought.
Eigen::Vector3d shortest_solution(const Eigen::Matrix3d& A, const Eigen::Vector3d& b, double threshold);

/// A = U diag(values) V^T, values descending.
struct SingularValues {
  Eigen::Matrix3d U;
  Eigen::Vector3d values;
  Eigen::Matrix3d V;
};
SingularValues singular_values(const Eigen::Matrix3d& A);

/// The same of a large matrix; U and V have as many columns as there are values.
struct ThinSingularValues {
  Eigen::MatrixXd U;
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
ThinSingularValues thin_singular_values(const Eigen::MatrixXd& A);

/// Of a square matrix that need not be symmetric.
Eigen::VectorXcd eigenvalues(const Eigen::MatrixXd& A);

/// J A J^T.
template <int N, int M>
Matrix<N> carried(const Matrix<N, M>& J, const Matrix<M>& A);

/// 1 / sqrt of the diagonal: scales a matrix of squares to a unit diagonal. 1 for a column that is zero throughout.
template <int N>
Vector<N> unit_scale(const Matrix<N>& A) {
  Vector<N> scale = A.diagonal();
  for (double& s : scale) s = s > 0.0 ? 1.0 / std::sqrt(s) : 1.0;
  return scale;
}
/// diag(s) A diag(s).
template <int N>
Matrix<N> scaled_both(const Vector<N>& s, const Matrix<N>& A);

}  // namespace truing::math
