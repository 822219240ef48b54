// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "tracking/deviation.hpp"

#include <algorithm>
#include <cmath>

#include "math/constants.hpp"

namespace truing::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kColoured =
    4.0;  // innovations come from another filter and resemble their neighbours: so many say as much as one
constexpr double kStillLearning = 2.0;  // a variance that falls by more until a prediction is graded is still settling
constexpr double kChord = 0.02;         // frames are extrapolated by their speed over so long [s]

}  // namespace

// ---- Planned frames -------------------------------------------------------------------------------------------------

Outcome FrameBuffer::push(double t, const Isometry3d& T) {
  if (!std::isfinite(t) || !T.matrix().allFinite()) return Outcome::not_finite;
  if (count_ > 0 && t == newest()) return Outcome::duplicate;
  if (count_ > 0 && t < newest()) return Outcome::backwards;
  Row& next = rows_[static_cast<std::size_t>(count_) % rows_.size()];
  next.t = t;
  next.p = T.translation();
  next.q = Quaterniond(T.linear());
  ++count_;
  return Outcome::accepted;
}

bool FrameBuffer::at(double t, PlanPoint* out, double extrapolate) const {
  if (count_ - first() < 4 || t < row(first()).t || t > newest() + extrapolate) return false;
  // The sample at or before t, with one before it and two after where there are.
  std::int64_t low = first(), high = count_ - 1;
  while (high - low > 1) {
    const std::int64_t middle = (low + high) / 2;
    (row(middle).t <= t ? low : high) = middle;
  }
  const std::int64_t start = std::clamp(low - 1, first(), count_ - 4);
  const double beyond = std::max(0.0, t - newest());  // at constant velocity from the newest sample
  const double at = t - beyond;
  const Row& center = row(low);
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero(), a = Vector3d::Zero(), turn = Vector3d::Zero(),
           turn_rate = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const Row& r = row(start + i);
    double x[3], scale = 1.0;
    for (int j = 0, n = 0; j < 4; ++j) {
      if (j == i) continue;
      x[n++] = at - row(start + j).t;
      scale *= r.t - row(start + j).t;
    }
    const double weight = x[0] * x[1] * x[2] / scale, slope = (x[0] * x[1] + x[0] * x[2] + x[1] * x[2]) / scale,
                 bend = 2.0 * (x[0] + x[1] + x[2]) / scale;
    p += weight * r.p;
    v += slope * r.p;
    a += bend * r.p;
    const Vector3d angle = log_rotation(center.q.conjugate() * r.q);
    turn += weight * angle;
    turn_rate += slope * angle;
  }
  out->rate = turn_rate - 0.5 * turn.cross(turn_rate);  // right Jacobian to first order, Solà eq. (143)
  if (beyond > 0.0) {  // the slope of a cubic at its end is mostly what stamps jitter: a chord is steadier
    std::int64_t old = count_ - 2;
    while (old > first() && newest() - row(old).t < kChord) --old;
    const Row &last = row(count_ - 1), &before = row(old);
    v = (last.p - before.p) / (last.t - before.t);
    out->rate = log_rotation(before.q.conjugate() * last.q) / (last.t - before.t);
  }
  out->T.translation() = p + beyond * v;
  out->T.linear() = (center.q * exp_rotation(turn) * exp_rotation(beyond * out->rate)).toRotationMatrix();
  out->velocity = v;
  out->acceleration = beyond > 0.0 ? Vector3d::Zero() : a;
  return true;
}

// ---- Slow part and damped modes -------------------------------------------------------------------------------------

OscillatorStep oscillator_step(double omega, double damping, double dt) {
  OscillatorStep out;
  if (omega == 0.0) {
    out.transition << 1.0, dt, 0.0, 1.0;
    out.input << 0.5 * dt * dt, dt;
    return out;
  }
  const double damped = omega * std::sqrt(1.0 - damping * damping), decay = std::exp(-damping * omega * dt);
  const double c = decay * std::cos(damped * dt), s = decay * std::sin(damped * dt) / damped;
  out.transition << c + damping * omega * s, s, -omega * omega * s, c - damping * omega * s;
  out.input << (1.0 - out.transition(0, 0)) / (omega * omega), s;
  return out;
}

ModalFilter::ModalFilter(const ModalModel& model) : parts(1 + model.count) {
  P.setZero(states(), states());
  P(0, 0) = 1e-2;
  P(1, 1) = 1e-4;
  for (int k = 1; k < parts; ++k) {
    const auto m = static_cast<std::size_t>(k);
    omega[m] = kTwoPi * model.frequency[m - 1];
    damping[m] = model.damping[m - 1];
    P(2 * k, 2 * k) = 1e-4;
    P(2 * k + 1, 2 * k + 1) = 1e-4 * omega[m] * omega[m];
  }
}

void ModalFilter::steps(double dt, ModalSteps* out) const {
  for (std::size_t k = 0; k < static_cast<std::size_t>(parts); ++k)
    (*out)[k] = oscillator_step(omega[k], damping[k], dt);
}

void ModalFilter::predict_covariance(const ModalSteps& steps, double dt, const DeviationOptions& options) {
  for (int k = 0; k < parts; ++k) {
    const Eigen::Matrix2d& F = steps[static_cast<std::size_t>(k)].transition;
    const Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, kModalStates> x = P.row(2 * k),
                                                                                     v = P.row(2 * k + 1);
    P.row(2 * k) = F(0, 0) * x + F(0, 1) * v;
    P.row(2 * k + 1) = F(1, 0) * x + F(1, 1) * v;
  }
  for (int k = 0; k < parts; ++k) {
    const Eigen::Matrix2d& F = steps[static_cast<std::size_t>(k)].transition;
    const ModalVector x = P.col(2 * k), v = P.col(2 * k + 1);
    P.col(2 * k) = F(0, 0) * x + F(0, 1) * v;
    P.col(2 * k + 1) = F(1, 0) * x + F(1, 1) * v;
    const double noise = k == 0 ? options.slow_noise : options.mode_noise, q = noise * noise * dt;
    P(2 * k, 2 * k) += q * dt * dt / 3.0;
    P(2 * k, 2 * k + 1) += q * dt / 2.0;
    P(2 * k + 1, 2 * k) += q * dt / 2.0;
    P(2 * k + 1, 2 * k + 1) += q;
  }
}

double ModalFilter::observe(int first, double variance, ModalVector* gain) {
  ModalVector Ph = P.col(first);
  for (int k = first + 2; k < states(); k += 2) Ph += P.col(k);
  double s = variance;
  for (int k = first; k < states(); k += 2) s += Ph[k];
  *gain = Ph / s;
  P.noalias() -= *gain * Ph.transpose();
  return s;
}

FrequencyTracker::FrequencyTracker(const ModalFilter& filter, double sigma) {
  for (int k = 1; k < filter.parts; ++k) {
    const auto m = static_cast<std::size_t>(k);
    sensitivity[m].setZero(filter.states(), 3);
    P(k - 1, k - 1) = std::pow(sigma * filter.omega[m], 2);
  }
}

// ---- The deviation, step by step ------------------------------------------------------------------------------------

Deviation deviation_of(const Motion& motion, const PlanPoint& plan) {
  const Matrix3d back = plan.T.linear().transpose();
  Deviation out;
  out.d.head<3>() = back * (motion.x.p - plan.T.translation());
  out.d.tail<3>() = log_rotation(Quaterniond(plan.T.linear()).conjugate() * motion.x.q);
  out.rate.head<3>() = back * (motion.x.v - plan.velocity) - plan.rate.cross(out.d.head<3>());
  out.rate.tail<3>() = back * motion.rate - plan.rate;
  out.acceleration.head<3>() = back * (motion.acceleration - plan.acceleration);
  return out;
}

Isometry3d deviated(const Isometry3d& T, const Vector6d& d) {
  Isometry3d out = Isometry3d::Identity();
  out.translation() = T * Vector3d(d.head<3>());
  out.linear() = T.linear() * exp_rotation(d.tail<3>()).toRotationMatrix();
  return out;
}

DeviationModel::DeviationModel(const TrackSetup& setup, const DeviationOptions& options, const ModalModel& modes)
    : setup_(setup), options_(options), modes_(modes), plan_(4096), flange_(512) {
  T_tool_imu_ = setup.T_flange_tool.inverse() * setup.T_flange_imu;
  T_flange_imu_ = setup.T_flange_imu;
  ticks_.resize(256);
  guesses_.resize(256);
  rows_.resize(256);
  for (Tick& tick : ticks_) tick.X.setZero(2 + 2 * modes.count, 6);
}

/// The model starts anew with other modes; plan and recordings stay.
void DeviationModel::set_modes(const ModalModel& modes) {
  modes_ = modes;
  tick_count_ = settled_ = 0;
  grades_ = {};
  for (Guess& guess : guesses_) guess.made = false;
}

Outcome DeviationModel::push_plan(double t, const Isometry3d& T_base_tool, double now) {
  // The arm is where the plan was `actuator_lag` ago: the plan, in the sensor's clock, so much later.
  const double at = t - setup_.controller_clock_offset + setup_.actuator_lag;
  if (now > -1e299 && at > now + options_.plan_limit) return Outcome::future;
  return plan_.push(at, T_base_tool * T_tool_imu_);
}

void DeviationModel::push_flange(double t, const Isometry3d& T_base_flange) {
  flange_.push(t, T_base_flange * T_flange_imu_);
}

bool DeviationModel::reference_at(double t, PlanPoint* out, double extrapolate) const {
  return plan_.empty() ? flange_.at(t, out, extrapolate) : plan_.at(t, out, 0.0);
}

/// Planned acceleration at t in the planned frame; without a plan, nothing is known of it.
Vector3d DeviationModel::push_at(double t) const {
  PlanPoint point;
  if (plan_.empty() || !plan_.at(t, &point)) return Vector3d::Zero();
  return point.T.linear().transpose() * point.acceleration;
}

void DeviationModel::update(const PoseFilter& filter, double changed) {
  if (!filter.initialised()) return;
  const double newest = plan_.empty() ? std::min(filter.newest_imu(), flange_.newest()) : filter.newest_imu();
  if (tick_count_ == 0 || changed < -1e299) {
    tick_count_ = settled_ = 0;
    first_index_ = static_cast<std::int64_t>(std::ceil(filter.window_start() / options_.period));
    for (Guess& guess : guesses_) guess.made = false;
  }
  const std::int64_t done = tick_count_;
  std::int64_t k = tick_count_;
  const std::int64_t oldest =
      std::max<std::int64_t>(settled_, tick_count_ - static_cast<std::int64_t>(ticks_.size()) + 1);
  while (k > oldest && tick(k - 1).t >= changed) --k;
  for (;; ++k) {
    const double t = static_cast<double>(first_index_ + k) * options_.period;
    if (t > newest) break;
    tick(k).t = t;
    run(k, filter);
    tick_count_ = std::max(tick_count_, k + 1);
    if (k >= done) {
      guess(k, t);
      settle(t, std::max(filter.newest_pose(), filter.window_start() + 2.0 * options_.period));
    }
  }
  choose(filter);
}

void DeviationModel::run(std::int64_t k, const PoseFilter& filter) {
  Tick& now = tick(k);
  const double t = now.t;
  if (k == 0) {
    now.filter = ModalFilter(modes_);
    now.frequencies = FrequencyTracker(now.filter, options_.frequency_sigma);
    now.X.setZero(now.filter.states(), 6);
  } else {
    const Tick& before = tick(k - 1);
    now.filter = before.filter;
    now.X = before.X;
    now.mean = before.mean;
    ModalSteps steps;
    now.filter.steps(options_.period, &steps);
    const Forces forces = forces_of(before.push);
    now.frequencies = before.frequencies;
    now.frequencies.step(steps, now.filter, before.X, forces, options_.period, options_.frequency_walk);
    step_state<6>(steps, now.filter.parts, forces, &now.X);
    now.filter.predict_covariance(steps, options_.period, options_);
  }
  PlanPoint plan;
  now.observed = reference_at(t, &plan) && t >= filter.window_start() && t <= filter.newest_imu();
  if (!now.observed) {
    now.push.setZero();
    return;
  }
  now.push = push_at(t + options_.period / 2.0);
  now.z = deviation_of(filter.motion_at(t), plan);

  double position_variance = 0.0, velocity_variance = 0.0, age = 0.0;
  filter.sigmas_at(t, &position_variance, &velocity_variance, &age);
  now.velocity_variance = velocity_variance;
  position_variance = std::max(position_variance, options_.position_noise * options_.position_noise);
  velocity_variance = std::max(velocity_variance, options_.velocity_noise * options_.velocity_noise);
  ModalVector gain;
  if (k == 0) now.X.row(0) = now.z.d.transpose(), now.mean = now.z.d;
  const bool tracked = options_.frequency_sigma > 0.0 && age < kCoastingAge;
  now.frequencies.change.setZero();
  for (int first = 0; first < 2; ++first) {
    const Eigen::Matrix<double, 1, 6> e = (first == 0 ? now.z.d : now.z.rate).transpose() - sum_of<6>(now.X, first);
    const double variance = now.filter.observe(first, first == 0 ? position_variance : velocity_variance, &gain);
    now.X += gain * e;
    if (tracked) now.frequencies.observe(first, e.head<3>(), variance, gain, now.filter.parts);
  }
  if (tracked) {
    for (int m = 1; m < now.filter.parts; ++m) {
      const auto i = static_cast<std::size_t>(m);
      const double nominal = kTwoPi * modes_.frequency[i - 1];
      now.filter.omega[i] =
          std::clamp(now.filter.omega[i] + now.frequencies.change[m - 1], nominal * (1.0 - options_.frequency_range),
                     nominal * (1.0 + options_.frequency_range));
    }
  }
  if (age < kCoastingAge) now.mean += options_.period / options_.static_time * (now.z.d - now.mean);
}

DeviationModel::Forces DeviationModel::forces_of(const Vector3d& push) const {
  Forces forces = Forces::Zero();
  for (std::size_t k = 0; k < static_cast<std::size_t>(modes_.count); ++k)
    forces.row(static_cast<Eigen::Index>(k + 1)) = (modes_.gain[k] * push).transpose();
  return forces;
}

/// Derivative of a step's transition with respect to omega, its decay left as it is.
Eigen::Matrix2d slope_of(double omega, double damping, double dt) {
  const double decay = std::exp(-damping * omega * dt), c = decay * std::cos(omega * dt),
               s = decay * std::sin(omega * dt);
  Eigen::Matrix2d out;
  out << -dt * s, (dt * c - s / omega) / omega, -s - omega * dt * c, -dt * s;
  return out;
}

/// How the state depends on every frequency, over a step: the recursive prediction error method (Ljung 1999,
/// section 11.2) on the modes' frequencies. A mode turns about its equilibrium under the plan's acceleration, which is
/// taken to stay.
void FrequencyTracker::step(const ModalSteps& steps, const ModalFilter& filter, const ModalState<6>& before,
                            const Eigen::Matrix<double, kParts, 6>& forces, double dt, double walk) {
  Eigen::Matrix<double, kParts, 3> none = Eigen::Matrix<double, kParts, 3>::Zero();
  for (int k = 1; k < filter.parts; ++k) {
    const auto m = static_cast<std::size_t>(k);
    ModalState<3>& S = sensitivity[m];
    step_state<3>(steps, filter.parts, none, &S);
    const Eigen::Matrix2d slope = slope_of(filter.omega[m], filter.damping[m], dt);
    const Eigen::Matrix<double, 1, 3> x = before.row(2 * k).head<3>() -
                                          forces.row(k).head<3>() / (filter.omega[m] * filter.omega[m]),
                                      v = before.row(2 * k + 1).head<3>();
    S.row(2 * k) += slope(0, 0) * x + slope(0, 1) * v;
    S.row(2 * k + 1) += slope(1, 0) * x + slope(1, 1) * v;
    P(k - 1, k - 1) += walk * walk * filter.omega[m] * filter.omega[m] * dt;
  }
}

/// Innovations e of displacement (first = 0) or speed (first = 1), of variance `variance`, say how wrong the
/// frequencies are; `gain` is the state's.
void FrequencyTracker::observe(int first, const Eigen::Matrix<double, 1, 3>& e, double variance,
                               const ModalVector& gain, int parts) {
  Eigen::Matrix<double, ModalModel::kMost, 3> slopes = Eigen::Matrix<double, ModalModel::kMost, 3>::Zero();
  for (int k = 1; k < parts; ++k) {
    ModalState<3>& S = sensitivity[static_cast<std::size_t>(k)];
    slopes.row(k - 1) = sum_of<3>(S, first);
    S -= gain * slopes.row(k - 1);
  }
  const double limit = 3.0 * std::sqrt(variance);  // what is further out is no noise, and no frequency either
  for (int c = 0; c < 3; ++c) {
    const Eigen::Matrix<double, ModalModel::kMost, 1> slope = slopes.col(c), Ps = P * slope;
    const double s = slope.dot(Ps) + kColoured * variance;
    change += Ps / s * (std::clamp(e[c], -limit, limit) - slope.dot(change));
    P -= Ps * Ps.transpose() / s;
  }
}

bool DeviationModel::predict(Predictor predictor, double from, const Deviation& now, double t, Vector6d* d) const {
  if (tick_count_ == 0) return false;
  const Tick& last = tick(tick_count_ - 1);
  const double h = t - from;
  switch (predictor) {
    case Predictor::slow:
      *d = last.mean;
      return true;
    case Predictor::acceleration:
      *d = now.d + h * now.rate + 0.5 * h * h * now.acceleration;
      return true;
    case Predictor::modes:
      break;
  }
  if (last.filter.parts == 1) return false;
  // From the newest step to `from`, then on to t in steps of the period: what the model adds in between is added to the
  // deviation now.
  ModalState<6> X = last.X;
  ModalSteps steps;
  double at = last.t, step = 0.0;
  const auto advance = [&](double until) {
    while (at < until - 1e-9) {
      const double dt = std::min(options_.period, until - at);
      if (std::abs(dt - step) > 1e-12) last.filter.steps(step = dt, &steps);
      step_state<6>(steps, last.filter.parts, forces_of(push_at(at + dt / 2.0)), &X);
      at += dt;
    }
  };
  advance(from);
  const Eigen::Matrix<double, 1, 6> start = displacement_of<6>(X), speed = speed_of<6>(X);
  advance(t);
  *d = now.d + (displacement_of<6>(X) - start - h * speed).transpose() + h * now.rate;
  return true;
}

/// What every predictor says for the nominal horizon after step k, kept until its time has come.
void DeviationModel::guess(std::int64_t k, double) {
  const Tick& last = tick(k);
  if (!last.observed) return;
  const auto ahead = static_cast<std::int64_t>(std::llround(options_.horizon / options_.period));
  Guess& guess = guesses_[static_cast<std::size_t>(k + ahead) % guesses_.size()];
  guess.t = static_cast<double>(first_index_ + k + ahead) * options_.period;
  guess.made = true;
  guess.velocity_variance = last.velocity_variance;
  for (int p = 0; p < kPredictors; ++p) {
    auto& d = guess.d[static_cast<std::size_t>(p)];
    if (!predict(static_cast<Predictor>(p), last.t, last.z, guess.t, &d)) d.setConstant(1.0);
  }
}

/// Steps that no late sample will change: their guesses are graded, and they become rows for identification. A tracker
/// that is later than `settle_time` is waited for: `seen` is the time up to which its samples have come. What was
/// guessed while the filter itself was still settling says nothing of the predictors.
void DeviationModel::settle(double now, double seen) {
  const double known = tick(tick_count_ - 1).velocity_variance;
  for (; settled_ < tick_count_ && tick(settled_).t < std::min(now - options_.settle_time, seen); ++settled_) {
    const Tick& done = tick(settled_);
    if (!done.observed) continue;
    if (row_count_ < static_cast<int>(rows_.size()))
      rows_[static_cast<std::size_t>(row_count_++)] = {done.t, done.z.d, done.z.rate, done.push};
    Guess& guess = guesses_[static_cast<std::size_t>(settled_) % guesses_.size()];
    if (!guess.made || std::abs(guess.t - done.t) > 0.5 * options_.period) continue;
    guess.made = false;
    if (guess.velocity_variance > kStillLearning * known) continue;
    for (int p = 0; p < kPredictors; ++p) {
      Grade& grade = grades_[static_cast<std::size_t>(p)];
      const Vector6d error = guess.d[static_cast<std::size_t>(p)] - done.z.d;
      const double fraction = options_.period / std::min(options_.grade_time, grade.seconds + options_.period);
      grade.mean_square += fraction * (error.cwiseAbs2() - grade.mean_square);
      grade.seconds += options_.period;
    }
  }
}

/// The best graded one, if it is clearly better than the one in use; before there are grades, the one that the filter
/// expects less of: sway, or what the speed is uncertain by over the horizon.
void DeviationModel::choose(const PoseFilter& filter) {
  const auto error = [&](Predictor p) { return grade(p).head<3>().sum(); };
  if (evidence(Predictor::acceleration) < 0.1) {
    if (tick_count_ == 0) return;
    const double moved = options_.horizon * options_.horizon * tick(tick_count_ - 1).velocity_variance;
    best_ = moved < filter.sway_variance().head<3>().mean() ? Predictor::acceleration : Predictor::slow;
    return;
  }
  for (Predictor p : {Predictor::slow, Predictor::acceleration, Predictor::modes}) {
    if (p == Predictor::modes && (modes_.count == 0 || evidence(p) < options_.least_evidence)) continue;
    if (p != best_ && error(p) < 0.9 * error(best_)) best_ = p;
  }
}

Vector6d DeviationModel::slow() const {
  return tick_count_ == 0 ? Vector6d(Vector6d::Zero()) : tick(tick_count_ - 1).mean;
}

std::array<double, ModalModel::kMost> DeviationModel::frequencies() const {
  std::array<double, ModalModel::kMost> out{};
  for (std::size_t m = 0; m < static_cast<std::size_t>(modes_.count); ++m)
    out[m] = tick_count_ == 0 ? modes_.frequency[m] : tick(tick_count_ - 1).filter.omega[m + 1] / kTwoPi;
  return out;
}

int DeviationModel::take_rows(DeviationRow* out, int capacity) {
  const int n = std::min(capacity, row_count_);
  std::copy(rows_.begin(), rows_.begin() + n, out);
  std::move(rows_.begin() + n, rows_.begin() + row_count_, rows_.begin());
  row_count_ -= n;
  return n;
}

}  // namespace truing::tracking
