// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "model/frame_change.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "math/constants.hpp"
#include "math/linear_algebra.hpp"
#include "math/text.hpp"

namespace truing::model {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kMostOfOneFrame = 0.1;  ///< of the squares that one frame leaves, at most
constexpr std::size_t kLookedAt = 2000;
constexpr std::size_t kFewestOfAFrame = 8;  ///< rows of a part: a few that stand out are no frame of their own

/// Sums over rows that a frame is fitted by.
struct FrameSums {
  double n = 0.0, squares = 0.0;
  Vector3d p = Vector3d::Zero(), m = Vector3d::Zero();
  Matrix3d products = Matrix3d::Zero();

  void add(const Vector3d& predicted, const Vector3d& measured) {
    n += 1.0;
    squares += predicted.squaredNorm() + measured.squaredNorm();
    p += predicted;
    m += measured;
    products += measured * predicted.transpose();
  }
  FrameSums without(const FrameSums& others) const {
    FrameSums out = *this;
    out.n -= others.n;
    out.squares -= others.squares;
    out.p -= others.p;
    out.m -= others.m;
    out.products -= others.products;
    return out;
  }
};

/// The rigid motion that carries what is predicted to what was measured (Umeyama 1991, eq. 34 to 43).
struct RigidFit {
  Matrix3d R;
  double left;  ///< [m^2] squares
};

RigidFit rigid_fit_of(const FrameSums& sums) {
  const Matrix3d covariance = sums.products - sums.m * sums.p.transpose() / sums.n;
  const double spread = sums.squares - (sums.p.squaredNorm() + sums.m.squaredNorm()) / sums.n;
  const math::SingularValues svd = math::singular_values(covariance);
  Vector3d sign = Vector3d::Ones();
  if ((svd.U * svd.V.transpose()).determinant() < 0.0) sign[2] = -1.0;
  return {svd.U * sign.asDiagonal() * svd.V.transpose(), std::max(0.0, spread - 2.0 * sign.dot(svd.values))};
}

}  // namespace

std::optional<FrameChange> find_frame_change(const Positions& predicted, const Positions& measured,
                                             const std::vector<std::int32_t>& rows) {
  if (rows.size() < 2 * kFewestOfAFrame) return {};
  // Sums about a point amid them lose no digits to how far the instrument stands.
  const Vector3d at_p = predicted.row(rows.front()), at_m = measured.row(rows.front());
  std::vector<FrameSums> before(rows.size() + 1);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    before[k + 1] = before[k];
    before[k + 1].add(predicted.row(rows[k]).transpose() - at_p, measured.row(rows[k]).transpose() - at_m);
  }
  const FrameSums& all = before.back();
  const double together = rigid_fit_of(all).left;
  double least = kMostOfOneFrame * together;
  std::size_t change = 0;
  const auto look = [&](std::size_t first, std::size_t last, std::size_t step) {
    for (std::size_t k = std::max(first, kFewestOfAFrame); k <= std::min(last, rows.size() - kFewestOfAFrame);
         k += step) {
      const double left = rigid_fit_of(before[k]).left + rigid_fit_of(all.without(before[k])).left;
      if (left >= least) continue;
      least = left;
      change = k;
    }
  };
  // Near the change the squares fall towards it from both sides: of many rows some show where to look at each.
  const std::size_t step = 1 + rows.size() / kLookedAt;
  look(0, rows.size(), step);
  if (change > 0 && step > 1) look(change - std::min(change, step), change + step, 1);
  if (change == 0) return {};
  const FrameSums first = before[change], second = all.without(first);
  const Matrix3d R1 = rigid_fit_of(first).R, R2 = rigid_fit_of(second).R;
  const Vector3d middle = all.p / all.n;
  const auto carried = [&](const FrameSums& part, const Matrix3d& R) -> Vector3d {
    return part.m / part.n + R * (middle - part.p / part.n);
  };
  FrameChange out;
  out.row = rows[change];
  out.together = std::sqrt(together / all.n);
  out.apart = std::sqrt(least / all.n);
  out.move = (carried(second, R2) - carried(first, R1)).norm();
  out.turn = Eigen::AngleAxisd(Matrix3d(R2 * R1.transpose())).angle();
  return out;
}

bool has_one_frame(const Measurements& data) { return data.position[0] && !data.distance && data.fixed_point.empty(); }

std::optional<FrameChange> find_frame_change(const Measurements& data, const Positions& off) {
  Positions measured(off.rows(), 3);
  std::vector<std::int32_t> rows;
  for (Eigen::Index row = 0; row < off.rows(); ++row) {
    for (int k = 0; k < 3; ++k)
      measured(row, k) = data.position[static_cast<std::size_t>(k)][static_cast<std::size_t>(row)];
    if (off.row(row).allFinite()) rows.push_back(static_cast<std::int32_t>(row));
  }
  return find_frame_change(measured + off, measured, rows);
}

std::string text_of(const FrameChange& change) {
  return "from row " + std::to_string(change.row + 1) +
         " on everything was measured from another place: the middle of the poses jumps by " +
         math::millimetres(change.move) + ", turned by " + math::number(change.turn / kDegree, 2) + " deg";
}

}  // namespace truing::model
