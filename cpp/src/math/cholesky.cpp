// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// L L^T of linear_algebra.hpp: a file of its own, for it takes as long to compile as the rest.

#include <Eigen/Cholesky>

#include "math/linear_algebra.hpp"

namespace truing::math {

template <int N, int M>
Matrix<N, M> solve_definite(const Matrix<N>& A, const Matrix<N, M>& b) {
  return A.llt().solve(b);
}

template <int N>
Cholesky<N> cholesky(const Matrix<N>& A) {
  return A.llt();
}

template <int N, int M>
Matrix<N, M> solve_factored(const Cholesky<N>& factor, const Matrix<N, M>& b) {
  return factor.solve(b);
}

template <int N, int M>
Matrix<N, M> whitened(const Cholesky<N>& factor, const Matrix<N, M>& b) {
  return factor.matrixL().solve(b);
}

// ---- Sizes in use ---------------------------------------------------------------------------------------------------

constexpr int X = Eigen::Dynamic;

template Matrix<6> solve_definite<6, 6>(const Matrix<6>&, const Matrix<6>&);
template Matrix<6, 12> solve_definite<6, 12>(const Matrix<6>&, const Matrix<6, 12>&);
template Matrix<6, 13> solve_definite<6, 13>(const Matrix<6>&, const Matrix<6, 13>&);
template Matrix<X, 1> solve_definite<X, 1>(const Matrix<X>&, const Matrix<X, 1>&);

template Cholesky<3> cholesky<3>(const Matrix<3>&);
template Cholesky<6> cholesky<6>(const Matrix<6>&);
template Matrix<3, 1> solve_factored<3, 1>(const Cholesky<3>&, const Matrix<3, 1>&);
template Matrix<6, 1> solve_factored<6, 1>(const Cholesky<6>&, const Matrix<6, 1>&);
template Matrix<6> solve_factored<6, 6>(const Cholesky<6>&, const Matrix<6>&);
template Matrix<6, 1> whitened<6, 1>(const Cholesky<6>&, const Matrix<6, 1>&);
template Matrix<3, 23> whitened<3, 23>(const Cholesky<3>&, const Matrix<3, 23>&);
template Matrix<6, 23> whitened<6, 23>(const Cholesky<6>&, const Matrix<6, 23>&);

}  // namespace truing::math
