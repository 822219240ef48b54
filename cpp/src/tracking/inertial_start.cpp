// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tracking/inertial_start.hpp"

#include <algorithm>
#include <cmath>

#include "math/linear_algebra.hpp"
#include "math/rotation.hpp"

namespace truing::tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kStep = 0.01, kSpan = 0.2;  // of the angular speeds that are correlated [s]

/// Mean angular velocity over `kSpan` around times on a grid, in the sensor's own frame; NaN where there is none.
/// shape=(3, count)
Matrix3Xd gyro_means(const std::vector<ImuSample>& imu, double start, Eigen::Index count) {
  Matrix3Xd out = Matrix3Xd::Constant(3, count, std::nan(""));
  std::vector<Vector3d> sum(imu.size(), Vector3d::Zero());  // integral up to every sample
  for (std::size_t k = 1; k < imu.size(); ++k)
    sum[k] = sum[k - 1] + 0.5 * (imu[k].t - imu[k - 1].t) * (imu[k].gyro + imu[k - 1].gyro);
  const auto integral = [&](double t, Vector3d* value) {
    const auto after =
        std::upper_bound(imu.begin(), imu.end(), t, [](double x, const ImuSample& s) { return x < s.t; });
    if (after == imu.begin() || after == imu.end()) return false;
    const auto j = static_cast<std::size_t>(after - imu.begin());
    *value = sum[j - 1] + (t - imu[j - 1].t) / (imu[j].t - imu[j - 1].t) * (sum[j] - sum[j - 1]);
    return true;
  };
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = start + kStep * static_cast<double>(k);
    Vector3d a, b;
    if (integral(t - kSpan / 2.0, &a) && integral(t + kSpan / 2.0, &b)) out.col(k) = (b - a) / kSpan;
  }
  return out;
}

bool orientation_at(const std::vector<PoseSample>& tracker, double t, Quaterniond* out) {
  const auto after =
      std::upper_bound(tracker.begin(), tracker.end(), t, [](double x, const PoseSample& s) { return x < s.t; });
  if (after == tracker.begin() || after == tracker.end() || after->t - (after - 1)->t > kSpan) return false;
  const PoseSample &a = *(after - 1), &b = *after;
  *out = a.orientation.slerp((t - a.t) / (b.t - a.t), b.orientation);
  return true;
}

/// The same of the tracker, by differences, in the receiver's frame.
Matrix3Xd tracker_means(const std::vector<PoseSample>& tracker, double start, Eigen::Index count) {
  Matrix3Xd out = Matrix3Xd::Constant(3, count, std::nan(""));
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = start + kStep * static_cast<double>(k);
    Quaterniond a, b, middle;
    if (!orientation_at(tracker, t - kSpan / 2.0, &a) || !orientation_at(tracker, t + kSpan / 2.0, &b)) continue;
    out.col(k) = log_rotation(a.conjugate() * b) / kSpan;
  }
  return out;
}

/// Columns that both have, the inertial ones taken `shift` steps earlier: t_imu = t_tracker - shift * kStep.
SpeedPairs pairs_at(const Matrix3Xd& imu, const Matrix3Xd& receiver, Eigen::Index shift) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < receiver.cols(); ++k) {
    const Eigen::Index j = k - shift;
    if (j >= 0 && j < imu.cols() && receiver.col(k).allFinite() && imu.col(j).allFinite()) rows.push_back(k);
  }
  SpeedPairs out{Matrix3Xd(3, static_cast<Eigen::Index>(rows.size())),
                 Matrix3Xd(3, static_cast<Eigen::Index>(rows.size()))};
  for (std::size_t n = 0; n < rows.size(); ++n) {
    out.imu.col(static_cast<Eigen::Index>(n)) = imu.col(rows[n] - shift);
    out.receiver.col(static_cast<Eigen::Index>(n)) = receiver.col(rows[n]);
  }
  return out;
}

/// How well one turns into the other by any rotation or reflection: sum of singular values of their covariance over
/// what it would be if they were one motion. Means are taken away, and with them the gyro's bias.
double correlation(const SpeedPairs& pairs, Matrix3d* covariance = nullptr) {
  if (pairs.imu.cols() < 50) return 0.0;
  const Matrix3Xd a = pairs.centred_imu(), b = pairs.centred_receiver();
  const Matrix3d H = b * a.transpose();
  if (covariance) *covariance = H;
  const double scale = std::sqrt(a.squaredNorm() * b.squaredNorm());
  return scale > 0.0 ? singular_values(H).values.sum() / scale : 0.0;
}

}  // namespace

SpeedAlignment align_speeds(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker, double search) {
  const double start = std::max(imu.front().t, tracker.front().t) - search,
               end = std::min(imu.back().t, tracker.back().t) + search;
  const auto count = static_cast<Eigen::Index>(std::max(0.0, (end - start) / kStep));
  const Matrix3Xd gyro = gyro_means(imu, start, count), turn = tracker_means(tracker, start, count);
  SpeedAlignment out;
  Eigen::Index shift = 0;
  const auto look = [&](Eigen::Index k) {
    const double here = correlation(pairs_at(gyro, turn, k));
    if (here > out.correlation) out.correlation = here, shift = k;
  };
  const auto most = static_cast<Eigen::Index>(search / kStep);
  for (Eigen::Index k = -most; k <= most; k += 2) look(k);
  const Eigen::Index coarse = shift;
  look(coarse - 1);
  if (shift == coarse) look(coarse + 1);
  out.clock_offset = kStep * static_cast<double>(shift);
  out.pairs = pairs_at(gyro, turn, shift);
  correlation(out.pairs, &out.covariance);
  return out;
}

}  // namespace truing::tracking
