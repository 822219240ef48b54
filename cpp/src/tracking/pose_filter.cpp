// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "tracking/pose_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/constants.hpp"
#include "math/linear_algebra.hpp"

namespace truing::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMark = 0.1;              // beliefs are kept at least so often, and forward kinematics is taken in [s]
constexpr double kSwayTime = 20.0;         // over which the size of the sway is averaged [s]
constexpr double kScaleTime = 2.0;         // over which motion goes one way [s]
constexpr double kClockFrom = 1.0;         // after the start, the clock is estimated [s]
constexpr double kReflected = 0.5;         // longest burst of reflected signals [s]
constexpr double kLargestFlangeGap = 0.1;  // between the two readings that one is interpolated from [s]

std::int64_t power_of_two(double at_least) {
  std::int64_t n = 16;
  while (static_cast<double>(n) < at_least) n *= 2;
  return n;
}

void symmetrise(Covariance* P) {
  for (int j = 0; j < kStates; ++j) {
    for (int i = 0; i < j; ++i) (*P)(i, j) = (*P)(j, i) = 0.5 * ((*P)(i, j) + (*P)(j, i));
  }
}

/// x <- x (+) delta, Solà eq. (283) with a global orientation error.
void inject(const Eigen::Matrix<double, kStates, 1>& delta, Nominal* x) {
  x->p += delta.segment<3>(kP);
  x->v += delta.segment<3>(kV);
  x->q = (exp_rotation(delta.segment<3>(kTheta)) * x->q).normalized();
  x->gyro_bias += delta.segment<3>(kGyroBias);
  x->accel_bias += delta.segment<3>(kAccelBias);
  x->clock += delta[kClock];
  x->drift += delta[kDrift];
  x->slow_p += delta.segment<3>(kSlowP);
  x->slow_theta += delta.segment<3>(kSlowTheta);
}

/// Kalman update with innovation r = measured minus predicted; false and no change if its normalised square is above
/// `gate`. Solà eqs. (274)-(276). PHt: P H'. S: H P H' + R. Before `clock_from` the clock is considered and not
/// estimated (Schmidt 1966): how much lateness matters goes with the speed, and until that is known the product of the
/// two would settle on a wrong pair.
template <int N>
bool fuse(const Eigen::Matrix<double, kStates, N>& PHt, const Eigen::Matrix<double, N, N>& S,
          const Eigen::Matrix<double, N, 1>& r, double gate, Belief* belief, double* nis,
          Eigen::Matrix<double, kStates, 1>* moved = nullptr) {
  const Cholesky<N> factor = cholesky<N>(S);
  const Eigen::Matrix<double, N, 1> weighted = solve_factored<N, 1>(factor, r);
  *nis = r.dot(weighted);
  if (!(*nis <= gate)) return false;
  const Eigen::Matrix<double, N, kStates> half = whitened<N, kStates>(factor, PHt.transpose());
  Eigen::Matrix<double, kStates, 1> change = PHt * weighted;
  const Eigen::Matrix2d clock = belief->P.block<2, 2>(kClock, kClock);
  belief->P.noalias() -= half.transpose() * half;
  if (belief->t < belief->clock_from) {
    change.segment<2>(kClock).setZero();
    belief->P.block<2, 2>(kClock, kClock) = clock;
  }
  inject(change, &belief->x);
  if (moved) *moved = change;
  symmetrise(&belief->P);
  return true;
}

}  // namespace

PoseFilter::PoseFilter(const TrackSetup& setup, const FilterOptions& options) : setup_(setup), options_(options) {
  T_imu_receiver_ = setup.T_flange_imu.inverse() * setup.T_flange_receiver;
  T_imu_flange_ = setup.T_flange_imu.inverse();
  T_base_tracker_ = setup.T_tracker_base.inverse();
  const double seconds = options.window + options.future_limit + 0.5;
  imu_.resize(static_cast<std::size_t>(power_of_two(seconds * options.highest_imu_rate)));
  imu_mask_ = static_cast<std::int64_t>(imu_.size()) - 1;
  flange_.resize(static_cast<std::size_t>(power_of_two(seconds * 1000.0)));
  flange_mask_ = static_cast<std::int64_t>(flange_.size()) - 1;
  marks_ = static_cast<int>((seconds + options.restart_gap) / kMark) + 8;
  const auto events =
      static_cast<std::size_t>(seconds * options.highest_pose_rate + 8.0) + static_cast<std::size_t>(marks_);
  events_.resize(events);
  order_.reserve(events);
  free_.reserve(events);
  for (std::size_t k = events; k-- > 0;) free_.push_back(static_cast<int>(k));
  grades_.resize(events);
  place_.fill(setup.clock_offset);
  place_second_.fill(std::numeric_limits<std::int64_t>::min());
  changed_ = kInfinity;
}

// ---- Samples come in ------------------------------------------------------------------------------------------------

Outcome PoseFilter::push_imu(const ImuSample& sample) {
  const auto count = [&](Outcome outcome) {
    ++counters_.imu[static_cast<std::size_t>(outcome)];
    return outcome;
  };
  if (!std::isfinite(sample.t) || !sample.gyro.allFinite() || !sample.accel.allFinite())
    return count(Outcome::not_finite);
  Outcome outcome = Outcome::accepted;
  double extra_gyro = 0.0, extra_accel = 0.0;
  if (imu_count_ > 0) {
    const ImuRow& last = imu(imu_count_ - 1);
    const double dt = sample.t - last.t;
    if (dt == 0.0) return count(Outcome::duplicate);
    if (dt < 0.0) return count(Outcome::backwards);
    if (dt > options_.restart_gap) {
      outcome = Outcome::accepted_restart;
      initialised_ = false;
      imu_count_ = 0;
      cached_ = -1;
      flange_count_ = 0;
      for (int slot : order_) free_.push_back(slot);
      order_.clear();
      dirty_ = 0;
      changed_ = -kInfinity;
    } else {
      extra_gyro = last.extra_gyro;
      extra_accel = last.extra_accel;
      const bool saturated = sample.gyro.cwiseAbs().maxCoeff() >= options_.gyro_range ||
                             sample.accel.cwiseAbs().maxCoeff() >= options_.accel_range;
      if (dt > options_.largest_gap) outcome = Outcome::accepted_gap;
      if (saturated) outcome = Outcome::accepted_saturated;
      if (outcome != Outcome::accepted) {  // what was hidden is taken to be constant over the gap
        extra_gyro += std::pow((saturated ? options_.gyro_range : options_.gap_rate) * dt, 2);
        extra_accel += std::pow(options_.gap_acceleration * dt, 2);
      }
    }
  }
  if (imu_count_ - (initialised_ ? imu_before(base_.t) : std::max<std::int64_t>(0, imu_count_ - 8)) >= imu_mask_ - 1)
    update();
  ImuRow& row = imu(imu_count_++);
  row.t = sample.t;
  row.gyro = sample.gyro;
  row.accel = sample.accel;
  row.extra_gyro = extra_gyro;
  row.extra_accel = extra_accel;
  return count(outcome);
}

Outcome PoseFilter::push_pose(const PoseSample& sample) {
  const auto count = [&](Outcome outcome) {
    ++counters_.pose[static_cast<std::size_t>(outcome)];
    return outcome;
  };
  if (!std::isfinite(sample.t) || !sample.position.allFinite() || !sample.orientation.coeffs().allFinite())
    return count(Outcome::not_finite);
  Quaterniond orientation = sample.orientation;
  if (sample.has_orientation()) {
    if (std::abs(orientation.norm() - 1.0) > 1e-3) return count(Outcome::not_unit);
    orientation.normalize();
  }
  if (sample.position == last_pushed_.position && sample.orientation.coeffs() == last_pushed_.orientation.coeffs() &&
      sample.t != last_pushed_.t) {
    if (++frozen_ >= options_.frozen_after) return count(Outcome::frozen);
  } else {
    frozen_ = 0;
  }
  Event event;
  event.kind = Kind::pose;
  event.stamp = sample.t;
  event.place = place_of(sample.t);
  event.t = event.stamp - event.place;
  event.has_orientation = sample.has_orientation();
  Isometry3d T_tracker_receiver = Isometry3d::Identity();
  T_tracker_receiver.translation() = sample.position;
  if (event.has_orientation) T_tracker_receiver.linear() = orientation.toRotationMatrix();
  event.T_base_receiver = T_base_tracker_ * T_tracker_receiver;
  const Outcome outcome = insert(event);
  if (outcome == Outcome::accepted) last_pushed_ = sample;
  return count(outcome);
}

Outcome PoseFilter::push_flange(double t, const Isometry3d& T_base_flange) {
  const auto count = [&](Outcome outcome) {
    ++counters_.joints[static_cast<std::size_t>(outcome)];
    return outcome;
  };
  if (!std::isfinite(t) || !T_base_flange.matrix().allFinite()) return count(Outcome::not_finite);
  if (imu_count_ > 0 && t > newest_imu() + options_.future_limit) return count(Outcome::future);
  if (imu_count_ > 0 && t < newest_imu() - options_.window) return count(Outcome::too_late);
  std::int64_t k = flange_count_;
  while (k > 0 && k > flange_count_ - flange_mask_ && flange(k - 1).t >= t) {
    if (flange(k - 1).t == t) return count(Outcome::duplicate);
    --k;
  }
  for (std::int64_t i = flange_count_; i > k; --i) flange(i) = flange(i - 1);
  flange(k) = {t, T_base_flange};
  ++flange_count_;
  // Marks between the neighbours of the new reading see another interpolation now.
  const double from = k > 0 ? flange(k - 1).t : t, to = k + 1 < flange_count_ ? flange(k + 1).t : t;
  for (int e = first_event_after(from - 1e-12); e < event_count() && event(e).t <= to; ++e) {
    if (event(e).kind == Kind::mark) {
      set_dirty(e);
      break;
    }
  }
  return count(Outcome::accepted);
}

/// The clock offset with which a stamp is placed. It must not depend on when the sample arrives: the stamps of a second
/// are placed with the estimate from well before that second, when nothing can change it any more. What the estimate
/// has moved since is in the measurement function.
double PoseFilter::place_of(double stamp) {
  const auto second = static_cast<std::int64_t>(std::floor(stamp - setup_.clock_offset));
  const auto slot = static_cast<std::size_t>(((second % kPlaces) + kPlaces) % kPlaces);
  return place_second_[slot] == second ? place_[slot] : setup_.clock_offset;
}

int PoseFilter::first_event_after(double t) const {
  return static_cast<int>(
      std::upper_bound(order_.begin(), order_.end(), t,
                       [&](double x, int slot) { return x < events_[static_cast<std::size_t>(slot)].t; }) -
      order_.begin());
}

Outcome PoseFilter::insert(const Event& event) {
  if (imu_count_ > 0) {
    if (event.t > newest_imu() + options_.future_limit) return Outcome::future;
    if (event.t < newest_imu() - options_.window) return Outcome::too_late;
  }
  if (initialised_ && event.t < base_.t) {
    if (!base_is_first_pose_) return Outcome::too_late;
    initialised_ = false;  // an earlier first sample: start again from it
  }
  int k = first_event_after(event.t);
  for (int i = k - 1; i >= 0 && this->event(i).t == event.t; --i) {
    if (this->event(i).kind == event.kind) return Outcome::duplicate;
    if (event.kind == Kind::mark) k = i;  // on one stamp marks come first
  }
  if (event.kind == Kind::pose && static_cast<int>(free_.size()) <= marks_) {  // places for marks are kept
    make_room();
    if (initialised_ && event.t < base_.t) return Outcome::too_late;
    k = first_event_after(event.t);
  }
  const int slot = free_.back();
  free_.pop_back();
  events_[static_cast<std::size_t>(slot)] = event;
  order_.insert(order_.begin() + k, slot);
  set_dirty(k);
  return Outcome::accepted;
}

/// More samples than the options speak of, or no inertial data: the window begins later.
void PoseFilter::make_room() {
  update();
  if (static_cast<int>(free_.size()) > marks_) return;
  if (dirty_ > 0) return settle(1);
  free_.push_back(order_.front());
  order_.erase(order_.begin());
}

void PoseFilter::set_dirty(int k) { dirty_ = std::min(dirty_, k); }

// ---- The window is worked off ---------------------------------------------------------------------------------------

/// Last inertial sample at or before t; -1: none.
std::int64_t PoseFilter::imu_before(double t) const {
  std::int64_t low = std::max<std::int64_t>(0, imu_count_ - imu_mask_ - 1), high = imu_count_ - 1;
  if (high < low || imu(low).t > t) return -1;
  if (imu(high).t <= t) return high;
  while (high - low > 1) {
    const std::int64_t middle = (low + high) / 2;
    (imu(middle).t <= t ? low : high) = middle;
  }
  return low;
}

/// Inertial data at t between samples k and k + 1.
void PoseFilter::imu_between(std::int64_t k, double t, Vector3d* gyro, Vector3d* accel) const {
  const ImuRow& a = imu(k);
  if (t == a.t || k + 1 >= imu_count_) {
    *gyro = a.gyro;
    *accel = a.accel;
    return;
  }
  const ImuRow& b = imu(k + 1);
  const double fraction = (t - a.t) / (b.t - a.t);
  *gyro = a.gyro + fraction * (b.gyro - a.gyro);
  *accel = a.accel + fraction * (b.accel - a.accel);
}

/// From t0 to t1, both between inertial samples k and k + 1, which are taken to be joined by straight lines. Midpoint
/// rule for the orientation (Solà eq. (223)), Simpson-like weights for what acceleration in the base frame does to
/// position.
void PoseFilter::integrate(Nominal* x, std::int64_t k, double t0, double t1) const {
  Vector3d gyro0, gyro1, accel0, accel1;
  imu_between(k, t0, &gyro0, &accel0);
  if (t1 == imu(k + 1).t) {
    gyro1 = imu(k + 1).gyro;
    accel1 = imu(k + 1).accel;
  } else {
    imu_between(k, t1, &gyro1, &accel1);
  }
  const double dt = t1 - t0;
  const Quaterniond q1 = x->q * exp_rotation((0.5 * (gyro0 + gyro1) - x->gyro_bias) * dt);
  const Vector3d a0 = x->q * (accel0 - x->accel_bias) + setup_.gravity,
                 a1 = q1 * (accel1 - x->accel_bias) + setup_.gravity;
  x->p += dt * x->v + dt * dt / 6.0 * (2.0 * a0 + a1);
  x->v += dt / 2.0 * (a0 + a1);
  x->q = q1;
}

/// Nominal state to t, remembered at every inertial sample on the way; then the covariance in one step.
void PoseFilter::propagate(Belief* belief, double t) {
  if (t <= belief->t) return;
  Nominal x = belief->x;
  double now = belief->t;
  for (std::int64_t k = imu_before(now); k + 1 < imu_count_ && now < t; ++k) {
    const double next = std::min(imu(k + 1).t, t);
    integrate(&x, k, now, next);
    now = next;
    if (now == imu(k + 1).t) {
      ImuRow& row = imu(k + 1);
      row.p = x.p;
      row.v = x.v;
      row.q = x.q;
      cached_ = k + 1;
    }
  }
  x.q.normalize();
  x.clock += x.drift * (t - belief->t);
  transition(*belief, x, t, &belief->P);
  belief->x = x;
  belief->t = t;
}

/// Variance that gaps and saturation have added until t.
double PoseFilter::extra(double t, bool gyro) const {
  const std::int64_t k = imu_before(t);
  const ImuRow& a = imu(k);
  const double at_a = gyro ? a.extra_gyro : a.extra_accel;
  if (k + 1 >= imu_count_) return at_a;
  const ImuRow& b = imu(k + 1);
  return at_a + (t - a.t) / (b.t - a.t) * ((gyro ? b.extra_gyro : b.extra_accel) - at_a);
}

/// P <- F P F' + Q over the segment from `from` to `to_x` at t. With global orientation errors (Solà section 7.2, eqs.
/// (309)-(315), integrated instead of taken per sample) F holds the first and second integral of specific force in the
/// base frame, which the nominal states give.
void PoseFilter::transition(const Belief& from, const Nominal& to_x, double t, Covariance* P) const {
  const double dt = t - from.t;
  const Vector3d dv = to_x.v - from.x.v - dt * setup_.gravity;
  const Vector3d dp = to_x.p - from.x.p - dt * from.x.v - 0.5 * dt * dt * setup_.gravity;
  const Matrix3d R = 0.5 * (from.x.q.toRotationMatrix() + to_x.q.toRotationMatrix());  // mean over the segment
  const Matrix3d skew_dp = skew(dp), skew_dv = skew(dv);
  const Matrix3d p_theta = -skew_dp, v_theta = -skew_dv, theta_bias = -dt * R;
  const Matrix3d p_gyro = dt * dt / 6.0 * skew_dv * R, v_gyro = 0.5 * dt * skew_dv * R;
  const Matrix3d p_accel = -0.5 * dt * dt * R, v_accel = -dt * R;

  Covariance& M = *P;
  // Rows first, M = F P. The columns of what stays the same are then final, and mirrored.
  M.middleRows<3>(kP) += dt * M.middleRows<3>(kV) + p_theta * M.middleRows<3>(kTheta) +
                         p_gyro * M.middleRows<3>(kGyroBias) + p_accel * M.middleRows<3>(kAccelBias);
  M.middleRows<3>(kV) +=
      v_theta * M.middleRows<3>(kTheta) + v_gyro * M.middleRows<3>(kGyroBias) + v_accel * M.middleRows<3>(kAccelBias);
  M.middleRows<3>(kTheta) += theta_bias * M.middleRows<3>(kGyroBias);
  // Then the columns of position, velocity and orientation, P = M F'.
  auto top = M.topRows<9>();
  top.middleCols<3>(kP) += dt * top.middleCols<3>(kV) + top.middleCols<3>(kTheta) * p_theta.transpose() +
                           top.middleCols<3>(kGyroBias) * p_gyro.transpose() +
                           top.middleCols<3>(kAccelBias) * p_accel.transpose();
  top.middleCols<3>(kV) += top.middleCols<3>(kTheta) * v_theta.transpose() +
                           top.middleCols<3>(kGyroBias) * v_gyro.transpose() +
                           top.middleCols<3>(kAccelBias) * v_accel.transpose();
  top.middleCols<3>(kTheta) += top.middleCols<3>(kGyroBias) * theta_bias.transpose();
  M.bottomLeftCorner<kStates - 9, 9>() = M.topRightCorner<9, kStates - 9>().transpose();
  M.row(kClock) += dt * M.row(kDrift);
  M.col(kClock) += dt * M.col(kDrift);

  const FilterOptions& o = options_;
  // Scale errors: of what moved, correlated over `kScaleTime`.
  const double turn = 4.0 * (to_x.q * from.x.q.conjugate()).vec().squaredNorm(),
               speed_up = (to_x.v - from.x.v).squaredNorm();
  const double scale = o.imu_scale * o.imu_scale * kScaleTime / dt;
  const double accel = from.noise.accel_factor() * (o.accel_noise * o.accel_noise * dt + scale * speed_up) +
                       extra(t, false) - extra(from.t, false);
  const double gyro = from.noise.gyro_factor() * (o.gyro_noise * o.gyro_noise * dt + scale * turn) + extra(t, true) -
                      extra(from.t, true);
  for (int i = 0; i < 3; ++i) {
    M(kP + i, kP + i) += accel * dt * dt / 3.0;
    M(kP + i, kV + i) += accel * dt / 2.0;
    M(kV + i, kP + i) += accel * dt / 2.0;
    M(kV + i, kV + i) += accel;
    M(kTheta + i, kTheta + i) += gyro;
    M(kGyroBias + i, kGyroBias + i) += from.noise.gyro_factor() * o.gyro_bias_walk * o.gyro_bias_walk * dt;
    M(kAccelBias + i, kAccelBias + i) += from.noise.accel_factor() * o.accel_bias_walk * o.accel_bias_walk * dt;
    M(kSlowP + i, kSlowP + i) += o.slow_position_walk * o.slow_position_walk * dt;
    M(kSlowTheta + i, kSlowTheta + i) += o.slow_rotation_walk * o.slow_rotation_walk * dt;
  }
  if (setup_.clock_offset_sigma > 0.0) {
    M(kClock, kClock) += o.clock_walk * o.clock_walk * dt;
    M(kDrift, kDrift) += o.clock_drift_walk * o.clock_drift_walk * dt;
  }
}

Motion PoseFilter::motion_of(const Nominal& x, std::int64_t k, double t) const {
  Motion out;
  out.t = t;
  out.x = x;
  Vector3d gyro, accel;
  imu_between(k, t, &gyro, &accel);
  out.rate = x.q * (gyro - x.gyro_bias);
  out.acceleration = x.q * (accel - x.accel_bias) + setup_.gravity;
  return out;
}

/// The receiver where it was `late` before the place of the sample, late = clock offset now minus that of the placing;
/// to second order.
void PoseFilter::measure_pose(Event* event, Belief* belief) const {
  const Motion motion = motion_of(belief->x, imu_before(belief->t), belief->t);
  const double late = belief->x.clock - event->place;
  const Vector3d lever = belief->x.q * T_imu_receiver_.translation();
  const Vector3d velocity = belief->x.v + motion.rate.cross(lever);
  const Vector3d acceleration = motion.acceleration + motion.rate.cross(motion.rate.cross(lever));
  const Vector3d predicted = belief->x.p + lever - late * velocity + 0.5 * late * late * acceleration;
  const Quaterniond predicted_q =
      exp_rotation(-late * motion.rate) * belief->x.q * Quaterniond(T_imu_receiver_.linear());

  // H = [I, -late I, -[lever]x, 0, 0, -velocity + late acceleration; 0, 0, I, 0, 0, -rate], as P H' and H P H' + R.
  const Matrix3d lever_x = skew(lever);
  Vector6d clock_column;
  clock_column << -velocity + late * acceleration, -motion.rate;
  const auto times_H = [&](const auto& M) {  // M H' for any M with kStates columns
    Eigen::Matrix<double, std::decay_t<decltype(M)>::RowsAtCompileTime, 6> out;
    out.template leftCols<3>() =
        M.template middleCols<3>(kP) - late * M.template middleCols<3>(kV) + M.template middleCols<3>(kTheta) * lever_x;
    out.template rightCols<3>() = M.template middleCols<3>(kTheta);
    out += M.col(kClock) * clock_column.transpose();
    return out;
  };
  const Eigen::Matrix<double, kStates, 6> PHt = times_H(belief->P);
  const Eigen::Matrix<double, 6, kStates> HP = PHt.transpose();
  Matrix6d S = times_H(HP);
  Vector6d r = Vector6d::Zero();
  r.head<3>() = event->T_base_receiver.translation() - predicted;
  if (event->has_orientation)
    r.tail<3>() = log_rotation(Quaterniond(event->T_base_receiver.linear()) * predicted_q.conjugate());
  Vector6d R;
  R << Vector3d::Constant(belief->noise.position_variance()), Vector3d::Constant(belief->noise.rotation_variance());
  S.diagonal() += R;

  PoseGrade& grade = event->grade;
  grade.t = event->t;
  grade.dimensions = event->has_orientation ? 6 : 3;
  grade.innovation = r;
  grade.S = S;
  grade.R = R;
  grade.noise = belief->noise.white();
  grade.T_base_receiver = event->T_base_receiver;
  grade.reacquired = false;
  Eigen::Matrix<double, kStates, 1> moved = Eigen::Matrix<double, kStates, 1>::Zero();
  // The gate is that of the noise before both sensors' were scaled down together: errors that are not white come in
  // bursts, and what was a good sample before they were made to fit on average is one still.
  const double position_scale = R[0] / (grade.noise[0] * grade.noise[0]),
               rotation_scale = R[3] / (grade.noise[1] * grade.noise[1]);
  const double gate = options_.gate / std::min({1.0, position_scale, rotation_scale});
  grade.accepted = event->has_orientation ? fuse<6>(PHt, S, r, gate, belief, &grade.nis, &moved)
                                          : fuse<3>(PHt.leftCols<3>(), S.topLeftCorner<3, 3>(), r.head<3>(), gate,
                                                    belief, &grade.nis, &moved);
  if (!grade.accepted && belief->rejected + 1 >= options_.reacquire_after &&
      belief->t - belief->last_pose > kReflected) {
    // Either side may be wrong by now: speed and biases are known no better than at the start.
    const FilterOptions& o = options_;
    const auto widen = [&](int place, double variance) { belief->P.diagonal().segment<3>(place).array() += variance; };
    widen(kP, r.head<3>().squaredNorm());
    widen(kTheta, r.tail<3>().squaredNorm());
    widen(kV, 0.25);
    widen(kGyroBias, o.gyro_bias * o.gyro_bias);
    widen(kAccelBias, o.accel_bias * o.accel_bias);
    belief->rejected = 0;
    const PoseGrade before = grade;  // the grade keeps what the disagreement was
    measure_pose(event, belief);
    const bool taken = grade.accepted;
    grade = before;
    grade.accepted = grade.reacquired = taken;
    return;
  }
  const Correction correction{times_H(moved.transpose()).transpose(), moved.segment<3>(kV)};
  belief->noise.push(event->t, r, S.diagonal(), event->has_orientation, correction, options_);
  belief->rejected = grade.accepted ? 0 : belief->rejected + 1;
  if (grade.accepted) belief->last_pose = belief->t;
}

bool PoseFilter::flange_at(double t, Isometry3d* T_base_flange) const {
  std::int64_t k = flange_count_;
  const std::int64_t oldest = std::max<std::int64_t>(0, flange_count_ - flange_mask_ - 1);
  while (k > oldest && flange(k - 1).t > t) --k;
  if (k == oldest) return false;
  const FlangeRow& a = flange(k - 1);
  if (a.t == t) {
    *T_base_flange = a.T_base_flange;
    return true;
  }
  if (k == flange_count_) return false;
  const FlangeRow& b = flange(k);
  if (b.t - a.t > kLargestFlangeGap) return false;
  *T_base_flange = between(a.T_base_flange, b.T_base_flange, (t - a.t) / (b.t - a.t));
  return true;
}

/// Forward kinematics: flange = fk * Exp(slow) * sway. Sway is no white noise: samples within its correlation time
/// count as one.
void PoseFilter::measure_flange(double t, Belief* belief) const {
  Isometry3d fk;
  if (!flange_at(t, &fk)) return;
  const Vector3d lever = belief->x.q * T_imu_flange_.translation();
  const Quaterniond fk_q(fk.linear());
  // H = [I, 0, -[lever]x, 0, 0, 0, 0, -R_fk, 0; 0, 0, I, 0, 0, 0, 0, 0, -R_fk]
  const Matrix3d lever_x = skew(lever), fk_t = fk.linear().transpose();
  const auto times_H = [&](const auto& M) {
    Eigen::Matrix<double, std::decay_t<decltype(M)>::RowsAtCompileTime, 6> out;
    out.template leftCols<3>() = M.template middleCols<3>(kP) + M.template middleCols<3>(kTheta) * lever_x -
                                 M.template middleCols<3>(kSlowP) * fk_t;
    out.template rightCols<3>() = M.template middleCols<3>(kTheta) - M.template middleCols<3>(kSlowTheta) * fk_t;
    return out;
  };
  const Eigen::Matrix<double, kStates, 6> PHt = times_H(belief->P);
  const Eigen::Matrix<double, 6, kStates> HP = PHt.transpose();
  Matrix6d S = times_H(HP);
  Vector6d r;
  r.head<3>() = fk.translation() + fk.linear() * belief->x.slow_p - belief->x.p - lever;
  r.tail<3>() = log_rotation(fk_q * exp_rotation(belief->x.slow_theta) *
                             (belief->x.q * Quaterniond(T_imu_flange_.linear())).conjugate());
  if (t - belief->last_pose < kCoastingAge) {
    Vector6d sway;
    sway << fk_t * r.head<3>(), fk_t * r.tail<3>();
    learn_sway(sway, belief);
  }
  const double repeats = std::max(1.0, options_.sway_correlation / kMark);
  S.topLeftCorner<3, 3>() += repeats * fk.linear() * belief->sway.head<3>().asDiagonal() * fk_t;
  S.bottomRightCorner<3, 3>() += repeats * fk.linear() * belief->sway.tail<3>().asDiagonal() * fk_t;
  double nis = 0.0;
  fuse<6>(PHt, S, r, kInfinity, belief, &nis);
}

/// The arm shows how much it sways while the tracker is there; never taken to be less than half of what was given.
void PoseFilter::learn_sway(const Vector6d& sway, Belief* belief) const {
  const double p = 0.5 * options_.sway_position, r = 0.5 * options_.sway_rotation;
  Vector6d least;
  least << Vector3d::Constant(p * p), Vector3d::Constant(r * r);
  belief->sway = (belief->sway + kMark / kSwayTime * (sway.cwiseAbs2() - belief->sway)).cwiseMax(least);
}

void PoseFilter::add_marks() {
  for (; next_mark_ <= newest_imu(); next_mark_ = std::round(next_mark_ / kMark + 1.0) * kMark) {
    Event mark;
    mark.t = next_mark_;
    insert(mark);
  }
}

/// A sample without orientation needs the encoders': they turn the sensor about the vertical, its own data do not.
bool PoseFilter::can_start_from(const Event& event) const {
  Isometry3d fk;
  return event.kind == Kind::pose && (event.has_orientation || flange_at(event.t, &fk));
}

/// So broad that the first sample itself decides. Without an orientation that of forward kinematics is taken, as
/// uncertain as its slow deviation and the sway; gravity and motion show the rest.
void PoseFilter::start_from(const Event& first) {
  Isometry3d T_base_imu = first.T_base_receiver * T_imu_receiver_.inverse(), fk = Isometry3d::Identity();
  if (!first.has_orientation && flange_at(first.t, &fk)) {
    T_base_imu.linear() = (fk * T_imu_flange_.inverse()).linear();
    T_base_imu.translation() =
        first.T_base_receiver.translation() - T_base_imu.linear() * T_imu_receiver_.translation();
  }
  base_ = Belief();
  base_.t = first.t;
  base_.clock_from = first.t + kClockFrom;
  base_.noise = NoiseEstimate(options_);
  base_.sway << Vector3d::Constant(options_.sway_position * options_.sway_position),
      Vector3d::Constant(options_.sway_rotation * options_.sway_rotation);
  base_.x.p = T_base_imu.translation();
  base_.x.q = Quaterniond(T_base_imu.linear());
  base_.x.clock = setup_.clock_offset;
  const FilterOptions& o = options_;
  const auto set = [&](int place, int n, double sigma) {
    base_.P.diagonal().segment(place, n).setConstant(sigma * sigma);
  };
  // A bias that was calibrated has changed since: switched off and on, warmed up. Never less is known than of any
  // sensor.
  const auto start_bias = [&](const Vector3d& known, double sigma, double change, int place, double unknown,
                              Vector3d* bias) {
    if (sigma > 0.0) *bias = known;
    set(place, 3, sigma > 0.0 ? std::min(unknown, std::hypot(sigma, change)) : unknown);
  };
  set(kP, 3, 100.0 * o.position_sigma);
  set(kV, 3, 1.0);
  set(kTheta, 3, 100.0 * o.rotation_sigma);
  start_bias(setup_.gyro_bias, setup_.gyro_bias_sigma, o.gyro_bias_change, kGyroBias, o.gyro_bias, &base_.x.gyro_bias);
  start_bias(setup_.accel_bias, setup_.accel_bias_sigma, o.accel_bias_change, kAccelBias, o.accel_bias,
             &base_.x.accel_bias);
  set(kClock, 1, setup_.clock_offset_sigma);
  set(kDrift, 1, setup_.clock_offset_sigma > 0.0 ? o.clock_drift : 0.0);
  set(kSlowP, 3, o.slow_position);
  set(kSlowTheta, 3, o.slow_rotation);
  if (!first.has_orientation) {
    set(kTheta, 3, std::hypot(o.slow_rotation, o.sway_rotation));
    const Matrix3d shared = o.slow_rotation * o.slow_rotation * fk.linear();
    base_.P.block<3, 3>(kTheta, kSlowTheta) = shared;
    base_.P.block<3, 3>(kSlowTheta, kTheta) = shared.transpose();
  }
  // Marks stand where they would if this had been the first sample from the beginning.
  std::size_t kept = 0;
  for (int slot : order_) {
    const Event& e = events_[static_cast<std::size_t>(slot)];
    if (e.kind == Kind::mark || e.t < first.t)
      free_.push_back(slot);
    else
      order_[kept++] = slot;
  }
  order_.resize(kept);
  next_mark_ = std::ceil(first.t / kMark) * kMark;
  initialised_ = base_is_first_pose_ = true;
  dirty_ = 0;
  cached_ = imu_before(first.t);
  changed_ = -kInfinity;
}

void PoseFilter::update() {
  if (imu_count_ < 2) return;
  if (!initialised_) {
    const double oldest = imu(std::max<std::int64_t>(0, imu_count_ - imu_mask_ - 1)).t;
    // The first sample with an orientation; where there is none, the first that the encoders give one for.
    const auto first_that = [&](const auto& serves) {
      int k = 0;
      while (k < event_count() && !(event(k).t >= oldest && serves(event(k)))) ++k;
      return k;
    };
    int first = first_that([](const Event& e) { return e.kind == Kind::pose && e.has_orientation; });
    if (first == event_count()) first = first_that([&](const Event& e) { return can_start_from(e); });
    if (first == event_count() || event(first).t > newest_imu()) return;
    const Event copy = event(first);
    start_from(copy);
  }
  add_marks();
  if (dirty_ < event_count() && event(dirty_).t <= newest_imu()) {
    changed_ = std::min(changed_, event(dirty_).t);
    Belief belief = dirty_ == 0 ? base_ : event(dirty_ - 1).after;
    cached_ = std::min(cached_, imu_before(event(dirty_).t));
    for (; dirty_ < event_count() && event(dirty_).t <= newest_imu(); ++dirty_) {
      Event& e = event(dirty_);
      propagate(&belief, e.t);
      if (e.kind == Kind::pose)
        measure_pose(&e, &belief);
      else
        measure_flange(e.t, &belief);
      e.after = belief;
    }
  }
  // Nominal states from the last event to the newest inertial sample.
  const Belief& last = dirty_ == 0 ? base_ : event(dirty_ - 1).after;
  Nominal x = last.x;
  double now = last.t;
  std::int64_t k = imu_before(now);
  if (cached_ > k) {
    const ImuRow& row = imu(cached_);
    x.p = row.p;
    x.v = row.v;
    x.q = row.q;
    now = row.t;
    k = cached_;
  }
  for (; k + 1 < imu_count_; ++k) {
    ImuRow& row = imu(k + 1);
    integrate(&x, k, now, row.t);
    now = row.t;
    row.p = x.p;
    row.v = x.v;
    row.q = x.q;
    cached_ = k + 1;
  }
  trim();
}

/// What is older than the window is settled: its belief becomes the one to start from.
void PoseFilter::trim() {
  const double start = newest_imu() - options_.window;
  int settled = 0;
  while (settled < dirty_ && event(settled).t < start) ++settled;
  if (settled > 0) settle(settled);
}

/// The first `settled` events leave the window.
void PoseFilter::settle(int settled) {
  for (int k = 0; k < settled; ++k) {
    Event& e = event(k);
    const double before = k == 0 ? base_.t : event(k - 1).t;
    const double clock = k == 0 ? base_.x.clock : event(k - 1).after.x.clock;
    // Seconds that end in between: the stamps of a later second will be placed with the estimate of this moment.
    const auto ahead = static_cast<std::int64_t>(std::ceil(options_.window)) + 2;
    for (auto second = static_cast<std::int64_t>(std::floor(before)) + 1;
         second <= static_cast<std::int64_t>(std::floor(e.t)); ++second) {
      const auto slot = static_cast<std::size_t>((((second + ahead) % kPlaces) + kPlaces) % kPlaces);
      place_[slot] = clock;
      place_second_[slot] = second + ahead;
    }
    if (e.kind == Kind::pose) {
      if (!e.grade.accepted) ++counters_.outliers;
      if (e.grade.reacquired) ++counters_.reacquired;
      if (grade_count_ < static_cast<int>(grades_.size())) grades_[static_cast<std::size_t>(grade_count_++)] = e.grade;
    }
    free_.push_back(order_[static_cast<std::size_t>(k)]);
  }
  base_ = event(settled - 1).after;
  base_is_first_pose_ = false;
  order_.erase(order_.begin(), order_.begin() + settled);
  dirty_ -= settled;
}

// ---- What is known --------------------------------------------------------------------------------------------------

Motion PoseFilter::motion_at(double t) const {
  const int k = std::min(first_event_after(t), dirty_) - 1;
  const Belief& belief = k < 0 ? base_ : event(k).after;
  const std::int64_t i = imu_before(t);
  Nominal x = belief.x;
  double now = belief.t;
  std::int64_t row = imu_before(now);
  if (i >= 0 && i <= cached_ && imu(i).t > now) {
    x.p = imu(i).p;
    x.v = imu(i).v;
    x.q = imu(i).q;
    now = imu(i).t;
    row = i;
  }
  for (; now < t && row + 1 < imu_count_; ++row) {
    const double next = std::min(imu(row + 1).t, t);
    integrate(&x, row, now, next);
    now = next;
  }
  x.clock += x.drift * (t - belief.t);
  return motion_of(x, std::max<std::int64_t>(i, 0), t);
}

Belief PoseFilter::belief_at(double t) const {
  const int k = std::min(first_event_after(t), dirty_) - 1;
  Belief out = k < 0 ? base_ : event(k).after;
  if (t <= out.t) return out;
  const Motion motion = motion_at(t);
  transition(out, motion.x, t, &out.P);
  out.x = motion.x;
  out.t = t;
  return out;
}

void PoseFilter::sigmas_at(double t, double* position_variance, double* velocity_variance, double* pose_age) const {
  const int k = std::min(first_event_after(t), dirty_) - 1;
  const Belief& belief = k < 0 ? base_ : event(k).after;
  *position_variance = belief.P.diagonal().segment<3>(kP).mean();
  *velocity_variance = belief.P.diagonal().segment<3>(kV).mean();
  *pose_age = t - belief.last_pose;
}

double PoseFilter::changed_since() {
  const double out = changed_;
  changed_ = kInfinity;
  return out;
}

int PoseFilter::take_grades(PoseGrade* out, int capacity) {
  const int n = std::min(capacity, grade_count_);
  std::copy(grades_.begin(), grades_.begin() + n, out);
  std::move(grades_.begin() + n, grades_.begin() + grade_count_, grades_.begin());
  grade_count_ -= n;
  return n;
}

}  // namespace truing::tracking
