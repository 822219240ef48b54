// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Products of linear_algebra.hpp: a file of their own, for they take as long to compile as the solvers.

#include "math/linear_algebra.hpp"

namespace truing::math {

template <int N, int M>
Matrix<N> carried(const Matrix<N, M>& J, const Matrix<M>& A) {
  return J * A * J.transpose();
}

template <int N>
Matrix<N> scaled_both(const Vector<N>& s, const Matrix<N>& A) {
  return s.asDiagonal() * A * s.asDiagonal();
}

constexpr int X = Eigen::Dynamic;

template Matrix<6> carried<6, 12>(const Matrix<6, 12>&, const Matrix<12>&);
template Matrix<X> carried<X, X>(const Matrix<X>&, const Matrix<X>&);

template Matrix<6> scaled_both<6>(const Vector<6>&, const Matrix<6>&);
template Matrix<12> scaled_both<12>(const Vector<12>&, const Matrix<12>&);
template Matrix<X> scaled_both<X>(const Vector<X>&, const Matrix<X>&);

}  // namespace truing::math
