// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "tracking/watch.hpp"

#include <algorithm>
#include <cmath>

#include "math/linear_algebra.hpp"

namespace truing::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kClip = 6.0;  // length that one whitened innovation counts with at most: an outlier alone is no shift
constexpr double kSpreadTime = 300.0;  // over which the spread of the averages is learned [s]
constexpr double kWarmUp = 10.0;       // after a start, and while the filter settles on a shift, nothing is flagged [s]
constexpr double kPart = 0.8;          // thresholds of equal probability: three degrees of freedom against six
constexpr int kBehind = 8;             // samples that an onset and a jump are judged by
constexpr int kLasting = 4;            // newest samples that have to show a jump still
constexpr double kGone = 25.0;  // whitened squares by which these are nearer to no jump: it was a burst of outliers
constexpr double kStaticTime = 30.0;  // over which the deviation from forward kinematics is averaged [s]
constexpr double kCorrelation = 1.0;  // time of that deviation [s]
constexpr double kSure = 5.0;         // logarithm of odds

Vector6d log_frame(const Isometry3d& T) {
  Vector6d out;
  out << T.translation(), log_rotation(Quaterniond(T.linear()));
  return out;
}

}  // namespace

ShiftWatch::ShiftWatch(const TrackSetup& setup, const WatchOptions& options) : setup_(setup), options_(options) {
  rows_.resize(1024);
}

void ShiftWatch::restart() {
  forget();
  quiet_ = 0.0;
}

void ShiftWatch::forget() {
  for (Average& average : averages_) average.mean.setZero();
  level_ = 0.0;
  pending_ = 0;
}

/// Position only: rotations of zero, and the statistic has three degrees of freedom in six.
void ShiftWatch::push(const PoseGrade& grade, const Isometry3d* T_base_flange) {
  const double seconds = count_ > 0 ? std::clamp(grade.t - row(count_ - 1).t, 0.0, 0.1) : 0.0;
  if (count_ > 0 && grade.t - row(count_ - 1).t > options_.forget) restart();
  Row& now = rows_[static_cast<std::size_t>(count_) % rows_.size()];
  ++count_;
  now.t = grade.t;
  now.innovation = grade.innovation;
  now.noise = grade.noise;
  now.T_base_receiver = grade.T_base_receiver;
  now.has_flange = T_base_flange != nullptr && grade.dimensions == 6;
  if (now.has_flange) now.T_base_flange = *T_base_flange;
  // Fraction of an innovation that is left after it was fused: R S^-1.
  const Cholesky<6> factor = cholesky<6>(grade.S);
  now.kept = Matrix6d::Identity();
  if (grade.reacquired)
    now.kept.setZero();  // widened by all that it disagreed by
  else if (grade.accepted)
    now.kept -= solve_factored<6, 6>(factor, grade.S - Matrix6d(grade.R.asDiagonal())).transpose();
  now.u = whitened<6, 1>(factor, grade.innovation);
  now.weight = grade.S.diagonal().cwiseInverse();
  if (now.u.norm() > kClip) now.u *= kClip / now.u.norm();
  rejected_ = grade.accepted ? 0 : rejected_ + 1;
  quiet_ += seconds;
  average(rejected_ == 1 || rejected_ == 2 ? Vector6d(Vector6d::Zero()) : now.u,
          seconds);  // outliers come one by one, a shift stays
  if (comparing_)
    compare(now);
  else if (pending_ == 0)
    learn_deviation(now);
  const bool after_effect = shift_.count > 0 && grade.t - shift_.t < options_.compare;
  if (pending_ > 0) {
    // Judged by samples after it, and not while the filter refuses them: then either they come back, or it follows.
    ++back_;
    pending_ = rejected_ > 0 ? std::max(pending_, kLasting) : pending_ - 1;
    if (pending_ == 0) flag();
  } else if (level_ > 1.0 && quiet_ > kWarmUp && !after_effect) {
    pending_ = kBehind;
  }
}

/// Averages of whitened innovations over four lengths. Each would be chi-square distributed with six degrees of freedom
/// if the filter knew all; how far from that it is, is learned, and the statistic divided by it. Position and rotation
/// are looked at alone as well: most shifts are one.
void ShiftWatch::average(const Vector6d& u, double seconds) {
  level_ = 0.0;
  for (std::size_t s = 0; s < kScales; ++s) {
    Average& a = averages_[s];
    a.mean += (u - a.mean) / kSamples[s];
    const double square =
        (2.0 * kSamples[s] - 1.0) * a.mean.squaredNorm();  // variance of an exponential average: 1 / (2 n - 1)
    const double part =
        (2.0 * kSamples[s] - 1.0) * std::max(a.mean.head<3>().squaredNorm(), a.mean.tail<3>().squaredNorm());
    const double level = std::max(square, part / kPart) / (options_.threshold * std::max(1.0, a.spread));
    if (level > level_) {
      level_ = level;
      if (pending_ == 0) back_ = static_cast<std::int64_t>(3.0 * kSamples[s]) + 2 * kBehind;
    }
    a.spread += seconds / kSpreadTime * (std::min(square, 4.0 * 6.0) / 6.0 - a.spread);
  }
}

/// The receiver against where forward kinematics has it, in the latter's axes.
Vector6d ShiftWatch::deviation_of_receiver(const Row& row) const {
  return log_frame((row.T_base_flange * setup_.T_flange_receiver).inverse() * row.T_base_receiver);
}

void ShiftWatch::learn_deviation(const Row& row) {
  if (!row.has_flange) return;
  const double seconds = count_ > 1 ? std::clamp(row.t - this->row(count_ - 2).t, 0.0, 0.1) : 0.0;
  const Vector6d d = deviation_of_receiver(row);
  if (learned_ == 0.0) mean_ = d;
  learned_ += seconds;
  const double fraction = seconds / std::min(kStaticTime, learned_ + 1e-3);
  const Vector6d off = d - mean_;
  mean_ += fraction * off;
  variance_ += fraction * (off.cwiseAbs2() - variance_);
}

/// Where the sum of the following innovations is longest, as far back as the average that has flagged it remembers.
std::int64_t ShiftWatch::find_onset() const {
  const std::int64_t oldest =
      std::max({std::int64_t{0}, count_ - back_, count_ - static_cast<std::int64_t>(rows_.size()) + 1});
  std::int64_t best = count_ - 1;
  double longest = 0.0;
  for (std::int64_t k = count_ - 1; k >= oldest; --k) {
    Vector6d sum = Vector6d::Zero();
    for (std::int64_t i = k; i < std::min(count_, k + kBehind); ++i) sum += row(i).u;
    if (sum.squaredNorm() > longest) {
      longest = sum.squaredNorm();
      best = k;
    }
  }
  // Where samples count with no more than they may, all sums are alike: the first of them.
  while (best > oldest && row(best - 1).u.dot(row(best).u) > 0.5 * kClip * kClip) --best;
  return best;
}

/// Least squares from the innovations after the onset: each sees what those before it have left, the product of R S^-1.
Vector6d ShiftWatch::find_jump(std::int64_t onset) const {
  Matrix6d left = Matrix6d::Identity(), normal = 1e-9 * Matrix6d::Identity();
  Vector6d right = Vector6d::Zero();
  for (std::int64_t k = onset; k < std::min(count_, onset + kBehind); ++k) {
    normal += left.transpose() * left;
    right += left.transpose() * row(k).innovation;
    left = row(k).kept * left;
  }
  return solve_symmetric<6, 1>(normal, right);
}

/// Whether the newest samples still see what the updates have left of the jump: a station that was moved stays there,
/// reflected signals come back.
bool ShiftWatch::lasts(std::int64_t onset, const Vector6d& jump) const {
  Vector6d left = jump;
  double nearer = 0.0;
  for (std::int64_t k = onset; k < count_; ++k) {
    if (k >= count_ - kLasting) {
      const Vector6d weight = row(k).weight;
      nearer += weight.dot((row(k).innovation - left).cwiseAbs2() - row(k).innovation.cwiseAbs2());
    }
    left = row(k).kept * left;
  }
  return nearer < kGone;
}

void ShiftWatch::flag() {
  const std::int64_t onset = find_onset();
  const Row& first = row(onset);
  const Vector6d jump = find_jump(onset);
  const double position = jump.head<3>().norm(), rotation = jump.tail<3>().norm();
  if (!lasts(onset, jump)) return forget();
  if (position < options_.least * first.noise[0] && rotation < options_.least * first.noise[1]) {
    restart();  // what is smaller than the noise of a sample is no jump: the filter does not know all
    return;
  }
  shift_.count += 1;
  shift_.position_noise = first.noise[0];
  shift_.rotation_noise = first.noise[1];
  shift_.t = first.t;
  shift_.flagged = row(count_ - 1).t;
  shift_.jump = jump;
  shift_.cause = ShiftCause::station_or_receiver;
  shift_.odds = 0.0;
  restart();
  // What was measured is the expected receiver, moved by the jump: once seen as a motion of the base, once as one of
  // the receiver.
  Isometry3d expected = first.T_base_receiver;
  expected.translation() -= jump.head<3>();
  expected.linear() = exp_rotation(-jump.tail<3>()).toRotationMatrix() * first.T_base_receiver.linear();
  station_ = first.T_base_receiver * expected.inverse();
  receiver_ = expected.inverse() * first.T_base_receiver;
  comparing_ = learned_ > 5.0;
}

/// A shifted station moves all that is measured by one motion of the base, a slipped receiver by one motion on the
/// flange. Which of them leaves the deviation from forward kinematics nearest to what it was before? Logarithm of the
/// odds, samples within `kCorrelation` counting as one.
void ShiftWatch::compare(const Row& row) {
  if (!row.has_flange) return;
  const Isometry3d T_base_expected = row.T_base_flange * setup_.T_flange_receiver;
  const Vector6d d = deviation_of_receiver(row) - mean_;
  const Vector6d by_station = d - log_frame(T_base_expected.inverse() * station_ * T_base_expected),
                 by_receiver = d - log_frame(receiver_);
  const double seconds = std::clamp(row.t - this->row(count_ - 2).t, 0.0, 0.1);
  const Vector6d weight = (variance_.array() + 1e-12).inverse();
  shift_.odds += 0.5 * seconds / kCorrelation * weight.dot(by_receiver.cwiseAbs2() - by_station.cwiseAbs2());
  shift_.cause = shift_.odds > kSure    ? ShiftCause::station
                 : shift_.odds < -kSure ? ShiftCause::receiver
                                        : ShiftCause::station_or_receiver;
  if (row.t - shift_.t > options_.compare) {
    comparing_ = false;  // the arm's deviation is learned anew, with the shift in it
    learned_ = 0.0;
    variance_.setZero();
  }
}

}  // namespace truing::tracking
