// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "math/linear_algebra.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>

namespace truing::math {

template <int N, int M>
Matrix<N, M> solve_symmetric(const Matrix<N>& A, const Matrix<N, M>& b) {
  return A.ldlt().solve(b);
}

template <int N>
Matrix<N> inverse_symmetric(const Matrix<N>& A) {
  return solve_symmetric<N, N>(A, Matrix<N>::Identity(A.rows(), A.cols()));
}

template <int N>
Vector<N> solve_square(const Matrix<N>& A, const Vector<N>& b) {
  return A.partialPivLu().solve(b);
}

Eigen::MatrixXd least_squares(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

Eigen::Vector3d shortest_solution(const Eigen::Matrix3d& A, const Eigen::Vector3d& b, double threshold) {
  const SymmetricEigen<3> eigen = symmetric_eigen<3>(A);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (eigen.values(k) > threshold * eigen.values(2))
      x += eigen.vectors.col(k).dot(b) / eigen.values(k) * eigen.vectors.col(k);
  }
  return x;
}

// ---- Sizes in use ---------------------------------------------------------------------------------------------------

constexpr int X = Eigen::Dynamic;

template Matrix<3, 1> solve_symmetric<3, 1>(const Matrix<3>&, const Matrix<3, 1>&);
template Matrix<5, 1> solve_symmetric<5, 1>(const Matrix<5>&, const Matrix<5, 1>&);
template Matrix<6, 1> solve_symmetric<6, 1>(const Matrix<6>&, const Matrix<6, 1>&);
template Matrix<6, 12> solve_symmetric<6, 12>(const Matrix<6>&, const Matrix<6, 12>&);
template Matrix<X, 1> solve_symmetric<X, 1>(const Matrix<X>&, const Matrix<X, 1>&);
template Matrix<X, X> solve_symmetric<X, X>(const Matrix<X>&, const Matrix<X, X>&);
template Matrix<6> inverse_symmetric<6>(const Matrix<6>&);
template Matrix<X> inverse_symmetric<X>(const Matrix<X>&);

template Vector<6> solve_square<6>(const Matrix<6>&, const Vector<6>&);
template Vector<X> solve_square<X>(const Matrix<X>&, const Vector<X>&);

}  // namespace truing::math
