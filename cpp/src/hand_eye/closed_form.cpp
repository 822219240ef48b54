// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/closed_form.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/registration.hpp"

namespace truing::hand_eye {
namespace {

constexpr std::size_t kAllPairs = 64;    // poses up to which every pair is a motion
constexpr std::size_t kPartners = 12;    // of a pose, beyond that
constexpr std::size_t kCandidates = 36;  // that the partners are chosen from
constexpr double kNearHalfTurn = 0.1;    // |cos(angle / 2)| below which noise may turn the sign of a motion's real part

double real_part(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return a.coeffs().dot(b.coeffs());
}  // of a b*

void flip(DualQuaternion* a) {
  a->real.coeffs() *= -1.0;
  a->dual.coeffs() *= -1.0;
}

/// Both signs of a quaternion are the same rotation. B's are chosen so that motions of hand and camera have real parts
/// of one sign: from a pose whose sign is settled to the next that is not half a turn away.
void align_signs(const std::vector<DualQuaternion>& M, std::vector<DualQuaternion>* B) {
  const std::size_t n = M.size();
  std::vector<std::size_t> settled{0}, open(n - 1);
  std::iota(open.begin(), open.end(), std::size_t{1});
  for (double enough = kNearHalfTurn; !open.empty(); enough *= 0.1) {
    for (std::size_t from = 0; from < settled.size() && !open.empty(); ++from) {
      const std::size_t j = settled[from];
      const auto rest = std::stable_partition(open.begin(), open.end(), [&](std::size_t i) {
        return std::min(std::abs(real_part(M[i].real, M[j].real)), std::abs(real_part((*B)[i].real, (*B)[j].real))) <=
               enough;
      });
      for (auto i = rest; i != open.end(); ++i) {
        if (real_part(M[*i].real, M[j].real) * real_part((*B)[*i].real, (*B)[j].real) < 0.0) flip(&(*B)[*i]);
        settled.push_back(*i);
      }
      open.erase(rest, open.end());
    }
    if (enough < 1e-12) break;  // half turns without noise: either sign
  }
}

/// An order of the poses that depends on what the camera saw alone, not on theirs, nor on the base frame.
std::vector<std::size_t> canonical_order(const Screws& s) {
  std::vector<std::size_t> order(s.B.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    const Eigen::Vector4d q = s.B[i].real.coeffs(), d = s.B[i].dual.coeffs();
    const double sign = q(3) < 0.0 ? -1.0 : 1.0;
    return std::array<double, 7>{sign * q(0), sign * q(1), sign * q(2), sign * d(0),
                                 sign * d(1), sign * d(2), sign * d(3)};
  };
  std::vector<std::array<double, 7>> keys(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) keys[i] = key(i);
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  return order;
}

/// S^T S of a motion without forming S.
void add_motion(const Screws& s, std::size_t i, std::size_t j, MotionSums* sums) {
  const DualQuaternion a = s.M[i] * conjugate(s.M[j]), b = s.B[i] * conjugate(s.B[j]);
  const Eigen::Vector3d d = a.real.vec() - b.real.vec(), u = a.real.vec() + b.real.vec();
  const Eigen::Vector3d dd = a.dual.vec() - b.dual.vec(), du = a.dual.vec() + b.dual.vec();
  // K = [0, -d^T; d, [u]x], K' likewise:  S = [K 0; K' K].
  const auto product = [](const Eigen::Vector3d& d1, const Eigen::Vector3d& u1, const Eigen::Vector3d& d2,
                          const Eigen::Vector3d& u2) {
    Eigen::Matrix4d k;  // K1^T K2
    k(0, 0) = d1.dot(d2);
    k.block<1, 3>(0, 1) = d1.cross(u2).transpose();
    k.block<3, 1>(1, 0) = d2.cross(u1);
    k.block<3, 3>(1, 1) = d1 * d2.transpose() + u1.dot(u2) * Eigen::Matrix3d::Identity() - u2 * u1.transpose();
    return k;
  };
  const Eigen::Matrix4d kk = product(d, u, d, u), pk = product(dd, du, d, u), pp = product(dd, du, dd, du);
  sums->normal.topLeftCorner<4, 4>() += kk + pp;
  sums->normal.topRightCorner<4, 4>() += pk;
  sums->normal.bottomLeftCorner<4, 4>() += pk.transpose();
  sums->normal.bottomRightCorner<4, 4>() += kk;
  sums->axes += a.real.vec() * a.real.vec().transpose();
  const double angles =
      std::atan2(a.real.vec().norm(), std::abs(a.real.w())) - std::atan2(b.real.vec().norm(), std::abs(b.real.w()));
  sums->incongruence += 4.0 * angles * angles;
  ++sums->motions;
}

Eigen::Isometry3d scaled(Eigen::Isometry3d T, const Eigen::Vector3d& center, double length) {
  T.translation() = (T.translation() - center) / length;
  return T;
}

}  // namespace

Frames moving_frames(const Frames& T_base_hand, HandEyeSetup setup) {
  if (setup == HandEyeSetup::eye_to_hand) return T_base_hand;
  Frames out;
  out.reserve(T_base_hand.size());
  for (const Eigen::Isometry3d& T : T_base_hand) out.push_back(T.inverse(Eigen::Isometry));
  return out;
}

Vector6d closure(const Eigen::Isometry3d& predicted, const Eigen::Isometry3d& seen) {
  Vector6d e;
  e.head<3>() = predicted.translation() - seen.translation();
  e.tail<3>() = vector_from_rotation(predicted.linear() * seen.linear().transpose());
  return e;
}

Pivot find_pivot(const Frames& poses, const Rows& rows) {
  // p = mean of R_i^T (c - t_i) put in:  (n^2 I - S S^T) c = n sum t - S sum R^T t,  S = sum of R_i.
  const double n = static_cast<double>(rows.size());
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  Eigen::Vector3d t = Eigen::Vector3d::Zero(), Rt = Eigen::Vector3d::Zero();
  for (const std::size_t i : rows) {
    S += poses[i].linear();
    t += poses[i].translation();
    Rt += poses[i].linear().transpose() * poses[i].translation();
  }
  S /= n, t /= n, Rt /= n;
  // Along an axis that nothing turns about, the mean position.
  Pivot out;
  out.center =
      t + shortest_solution(Eigen::Matrix3d::Identity() - S * S.transpose(), S * (S.transpose() * t - Rt), 1e-6);
  const Eigen::Vector3d p = S.transpose() * out.center - Rt;
  double sum = 0.0;
  for (const std::size_t i : rows) sum += (poses[i] * p - out.center).squaredNorm();
  out.spread = std::sqrt(sum / n);
  return out;
}

Screws make_screws(const Frames& M, const Frames& B, const Rows& rows) {
  const Pivot pivot_M = find_pivot(M, rows), pivot_B = find_pivot(B, rows);
  Screws out;
  out.center_M = pivot_M.center, out.center_B = pivot_B.center;
  // Rotations of 1 rad weigh as much as moves of this length. Boards that only turn about a point give no length of
  // their own.
  double distance = 0.0;
  for (const std::size_t i : rows) distance += (B[i].translation() - pivot_B.center).squaredNorm();
  distance = std::sqrt(distance / static_cast<double>(rows.size()));
  out.length = std::hypot(std::hypot(pivot_M.spread, pivot_B.spread), distance);
  if (!(out.length > 0.0)) out.length = 1.0;
  out.M.reserve(rows.size()), out.B.reserve(rows.size());
  for (const std::size_t i : rows) {
    out.M.push_back(dual_quaternion(scaled(M[i], out.center_M, out.length)));
    out.B.push_back(dual_quaternion(scaled(B[i], out.center_B, out.length)));
  }
  align_signs(out.M, &out.B);
  return out;
}

Eigen::Matrix<double, 8, 8> motion_factor(const DualQuaternion& a, const DualQuaternion& b) {
  const auto block = [](const Eigen::Vector3d& d, const Eigen::Vector3d& u) {
    Eigen::Matrix4d k;
    k << 0.0, -d.transpose(), d, cross_matrix(u);
    return k;
  };
  Eigen::Matrix<double, 8, 8> S = Eigen::Matrix<double, 8, 8>::Zero();
  S.topLeftCorner<4, 4>() = S.bottomRightCorner<4, 4>() =
      block(a.real.vec() - b.real.vec(), a.real.vec() + b.real.vec());
  S.bottomLeftCorner<4, 4>() = block(a.dual.vec() - b.dual.vec(), a.dual.vec() + b.dual.vec());
  return S;
}

MotionSums sum_motions(const Screws& screws) {
  const std::size_t n = screws.M.size();
  const std::vector<std::size_t> order = canonical_order(screws);
  MotionSums sums;
  if (n <= kAllPairs) {
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = i + 1; j < n; ++j) add_motion(screws, order[i], order[j], &sums);
    return sums;
  }
  std::array<std::pair<double, std::size_t>, kCandidates> candidates;  // |cos(angle / 2)|, place in the order
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < kCandidates; ++k) {
      const std::size_t j =
          (i + 1 + k * (n / 2) / kCandidates) % n;  // half of them: the other half meets us from there
      candidates[k] = {std::abs(real_part(screws.M[order[i]].real, screws.M[order[j]].real)), j};
    }
    std::nth_element(candidates.begin(), candidates.begin() + kPartners, candidates.end());
    for (std::size_t k = 0; k < kPartners; ++k) add_motion(screws, order[i], order[candidates[k].second], &sums);
  }
  return sums;
}

Vector8d unit_combination(const Vector8d& v7, const Vector8d& v8) {
  const auto u1 = v7.head<4>(), w1 = v7.tail<4>(), u2 = v8.head<4>(), w2 = v8.tail<4>();
  // eq. (33): l1^2 u1.u1 + 2 l1 l2 u1.u2 + l2^2 u2.u2 = 1;  eq. (34): l1^2 u1.w1 + l1 l2 (u1.w2 + u2.w1) + l2^2 u2.w2 =
  // 0.
  const double a = u1.dot(w1), b = u1.dot(w2) + u2.dot(w1), c = u2.dot(w2);
  // The ratio l1 : l2 as (x, y), so that neither is divided by: a x^2 + b x y + c y^2 = 0. Noise can make the
  // discriminant negative.
  const double root = std::sqrt(std::max(b * b - 4.0 * a * c, 0.0));
  const double q = -0.5 * (b + (b < 0.0 ? -root : root));
  const std::array<Eigen::Vector2d, 2> ratios{Eigen::Vector2d(q, a), Eigen::Vector2d(c, q)};
  Vector8d best = Vector8d::Zero();
  double largest = 0.0;
  for (const Eigen::Vector2d& ratio : ratios) {  // of the two roots, the one with the larger l1^2 u1.u1 + ..., eq. (35)
    if (!(ratio.norm() > 0.0)) continue;
    const Eigen::Vector2d r = ratio.normalized();
    const double norm = (r.x() * u1 + r.y() * u2).squaredNorm();
    if (norm > largest) largest = norm, best = (r.x() * v7 + r.y() * v8) / std::sqrt(norm);
  }
  if (largest == 0.0) best = v7 / std::max(u1.norm(), 1e-300);
  return best;
}

CameraSolution solve_camera(const Frames& M, const Frames& B, const Rows& rows) {
  const Screws screws = make_screws(M, B, rows);
  const MotionSums sums = sum_motions(screws);
  const double count = static_cast<double>(sums.motions);
  CameraSolution out;
  out.motions = sums.motions, out.length = screws.length;
  out.incongruence = std::sqrt(sums.incongruence / count);

  const SymmetricEigen<3> axes = symmetric_eigen<3>(sums.axes / count);
  for (int k = 0; k < 3; ++k) {
    out.principal_rotations(k) = 2.0 * std::asin(std::min(1.0, std::sqrt(std::max(0.0, axes.values(2 - k)))));
    out.principal_axes.col(k) = axes.vectors.col(2 - k);
  }

  const auto svd = symmetric_eigen<Eigen::Dynamic>(sums.normal / count);  // singular values are its roots
  out.singular_values = svd.values.cwiseMax(0.0).cwiseSqrt().reverse();
  const Vector8d x = unit_combination(svd.vectors.col(1), svd.vectors.col(0));
  out.residual = std::sqrt(std::max(0.0, x.dot(sums.normal * x) / count));

  DualQuaternion q;
  q.real = Eigen::Quaterniond(x(0), x(1), x(2), x(3)).normalized();
  q.dual = Eigen::Quaterniond(x(4), x(5), x(6), x(7));
  out.X = frame(q);
  out.X.translation() = screws.length * out.X.translation() + screws.center_M - out.X.linear() * screws.center_B;
  return out;
}

Eigen::Isometry3d solve_camera_one_axis(const Frames& M, const Frames& B, const Rows& rows, const Eigen::Vector3d& axis,
                                        double height) {
  // The camera's view of the axis: the rotation vectors of its motions, with the sign of the hand's.
  const Screws screws = make_screws(M, B, rows);
  Eigen::Vector3d seen = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Eigen::Quaterniond a = screws.M[i].real * screws.M[0].real.conjugate(),
                             b = screws.B[i].real * screws.B[0].real.conjugate();
    seen += a.vec().dot(axis) * b.vec();
  }
  const Eigen::Quaterniond tilt = least_rotation(seen, axis);  // X's rotation but for a turn about the axis
  // In the plane across it, (I - R_a) t + z tilt t_b - t_a = 0 with the turn z and the position t as complex numbers:
  // linear in both.
  const Eigen::Vector3d e1 = axis.unitOrthogonal(), e2 = axis.cross(e1);
  Eigen::MatrixXd A(2 * (rows.size() - 1), 4);
  Eigen::VectorXd rhs(A.rows());
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Eigen::Isometry3d a = M[rows[i]] * M[rows[0]].inverse(Eigen::Isometry),
                            b = B[rows[i]] * B[rows[0]].inverse(Eigen::Isometry);
    const Eigen::Vector3d moved = tilt * b.translation();
    const Eigen::Vector2d tb(e1.dot(moved), e2.dot(moved)), ta(e1.dot(a.translation()), e2.dot(a.translation()));
    const double angle = std::atan2(e2.dot(a.linear() * e1), e1.dot(a.linear() * e1));
    // X b = a X: z tb + t = e^{i angle} t + ta
    const auto row = static_cast<Eigen::Index>(2 * (i - 1));
    A.row(row) << tb.x(), -tb.y(), 1.0 - std::cos(angle), std::sin(angle);
    A.row(row + 1) << tb.y(), tb.x(), -std::sin(angle), 1.0 - std::cos(angle);
    rhs.segment<2>(row) = ta;
  }
  const Eigen::Vector4d z = least_squares(A, rhs);
  const double turn = std::atan2(z(1), z(0));
  // The position again, now with a turn that is one.
  const Eigen::VectorXd rest = rhs - A.leftCols<2>() * Eigen::Vector2d(std::cos(turn), std::sin(turn));
  const Eigen::Vector2d t = least_squares(A.rightCols<2>(), rest);
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = (Eigen::AngleAxisd(turn, axis) * tilt).toRotationMatrix();
  X.translation() = t.x() * e1 + t.y() * e2 + height * axis;
  return X;
}

Eigen::Isometry3d mean_board(const Frames& M, const Frames& B, const Rows& rows, const Eigen::Isometry3d& X) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (const std::size_t i : rows) {
    const Eigen::Isometry3d Y = M[i].inverse(Eigen::Isometry) * X * B[i];
    sum += Y.linear();
    position += Y.translation();
  }
  Eigen::Isometry3d Y = Eigen::Isometry3d::Identity();
  Y.linear() = nearest_rotation(sum);
  Y.translation() = position / static_cast<double>(rows.size());
  return Y;
}

}  // namespace truing::hand_eye
