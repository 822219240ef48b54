// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/lengths.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/registration.hpp"

namespace truing::hand_eye {
namespace {

constexpr std::size_t kMostPoses = 40;  // all pairs of so many are motions enough

/// Axis times twice the sine of the angle: without a jump at half a turn.
Eigen::Vector3d turn_of(const Eigen::Matrix3d& R) {
  const Eigen::Matrix3d S = R - R.transpose();
  return {S(2, 1), S(0, 2), S(1, 0)};
}

using Motions = std::vector<std::pair<Eigen::Isometry3d, Eigen::Isometry3d>>;

Motions motions_of(const Frames& M, const Frames& B, const Rows& rows) {
  Motions out;
  const std::size_t stride = (rows.size() + kMostPoses - 1) / kMostPoses;
  for (std::size_t k = 0; k < rows.size(); k += stride)
    for (std::size_t l = k + stride; l < rows.size(); l += stride) {
      const std::size_t i = rows[k], j = rows[l];
      out.emplace_back(M[i] * M[j].inverse(Eigen::Isometry), B[i] * B[j].inverse(Eigen::Isometry));
    }
  return out;
}

}  // namespace

Frames with_lengths_times(double factor, Frames boards) {
  for (Eigen::Isometry3d& T : boards) T.translation() *= factor;
  return boards;
}

double factor_on_lengths(const Frames& M, const Frames& B, const Rows& rows) {
  const Motions motions = motions_of(M, B, rows);
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  for (const auto& [a, b] : motions) turns += turn_of(a.linear()) * turn_of(b.linear()).transpose();
  const Eigen::Matrix3d R = nearest_rotation(turns);
  // (R_a - I) t - s R t_b = -t_a
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const auto& [a, b] : motions) {
    Eigen::Matrix<double, 3, 4> J;
    J << a.linear() - Eigen::Matrix3d::Identity(), -R * b.translation();
    normal += J.transpose() * J, right -= J.transpose() * a.translation();
  }
  const Eigen::Vector4d unit = unit_scale<4>(normal);
  const Eigen::MatrixXd scaled = unit.asDiagonal() * normal * unit.asDiagonal();
  const double factor = unit(3) * solve_symmetric<Eigen::Dynamic, 1>(scaled, unit.cwiseProduct(right))(3);
  return factor > 0.0 ? factor : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace truing::hand_eye
