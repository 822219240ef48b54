// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Where the inertial sensor is on the receiver, gravity, and the offset of the two clocks.

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "math/constants.hpp"
#include "math/gauss_newton.hpp"
#include "math/linear_algebra.hpp"
#include "math/registration.hpp"
#include "math/rotation.hpp"
#include "math/text.hpp"
#include "rooms.hpp"
#include "tracking/inertial_start.hpp"
#include "truing/tracking/calibrate.hpp"

namespace truing {
using namespace tracking;

namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kGravity = 9.80665;
constexpr double kOneMotion = 0.5;  // least correlation of two angular speeds of one motion
constexpr double kMirrored = 0.5;   // of the misfit: a reflection that fits so much better is one
constexpr double kDegrees = 57.295779513082323;
constexpr int kGlobal = 16, kLocal = 9;
enum Global : int { kTurn = 0, kLever = 3, kGyroBias = 6, kAccelBias = 9, kG = 12, kTau = 15 };

using GlobalMatrix = Eigen::Matrix<double, kGlobal, kGlobal>;
using GlobalVector = Eigen::Matrix<double, kGlobal, 1>;

// ---- A start: angular speeds ----------------------------------------------------------------------------------------

// ---- Segments -------------------------------------------------------------------------------------------------------

/// Inertial data integrated from a start, with derivatives by the biases (Forster, Carlone, Dellaert and Scaramuzza
/// 2017, eqs. (32)-(44)).
struct Integral {
  double t = 0.0, since = 0.0;
  Quaterniond R = Quaterniond::Identity();
  Vector3d v = Vector3d::Zero(), p = Vector3d::Zero(), rate = Vector3d::Zero(),
           force = Vector3d::Zero();  // rate and force at t, biases taken away
  Matrix3d R_g = Matrix3d::Zero(), v_g = Matrix3d::Zero(), p_g = Matrix3d::Zero(), v_a = Matrix3d::Zero(),
           p_a = Matrix3d::Zero();

  void advance(const Vector3d& gyro0, const Vector3d& gyro1, const Vector3d& accel0, const Vector3d& accel1,
               double dt) {
    const Vector3d turn = 0.5 * dt * (gyro0 + gyro1);
    const Quaterniond step = exp_rotation(turn), R1 = R * step;
    const Vector3d a0 = R * accel0, a1 = R1 * accel1, a = 0.5 * (a0 + a1);
    const Matrix3d rotation = R.toRotationMatrix(), slope = -rotation * skew(0.5 * (accel0 + accel1)) * R_g;
    p += dt * v + dt * dt / 6.0 * (2.0 * a0 + a1);
    v += dt * a;
    p_g += dt * v_g + 0.5 * dt * dt * slope;
    p_a += dt * v_a - 0.5 * dt * dt * rotation;
    v_g += dt * slope;
    v_a -= dt * rotation;
    R_g = step.conjugate().toRotationMatrix() * R_g - dt * Matrix3d::Identity();
    R = R1;
    rate = gyro1;
    force = accel1;
    t += dt;
    since += dt;
  }
};

struct Unknowns {
  Quaterniond R_receiver_imu = Quaterniond::Identity();
  Vector3d lever = Vector3d::Zero();  // of the inertial sensor in the receiver's frame
  Vector3d gyro_bias = Vector3d::Zero(), accel_bias = Vector3d::Zero(), gravity = Vector3d::Zero();
  double tau = 0.0;
};

struct Segment {
  std::size_t first = 0, last = 0;  // tracker samples [first, last)
  Quaterniond R = Quaterniond::Identity();
  Vector3d p = Vector3d::Zero(), v = Vector3d::Zero();
};

/// What one segment says of what all share, and of its own pose and speed.
struct SegmentSystem {
  BlockSystem<kGlobal, kLocal> block;
  double position = 0.0, rotation = 0.0, samples = 0.0;  // squared errors
};

class Problem {
 public:
  Problem(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker) : imu_(imu), tracker_(tracker) {}

  /// Last inertial sample at or before t, which has one after it; false outside.
  bool before(double t, std::size_t* k) const {
    const auto after =
        std::upper_bound(imu_.begin(), imu_.end(), t, [](double x, const ImuSample& s) { return x < s.t; });
    if (after == imu_.begin() || after == imu_.end()) return false;
    *k = static_cast<std::size_t>(after - imu_.begin()) - 1;
    return true;
  }

  Integral start_at(double t, const Unknowns& x, std::size_t k) const {
    Integral out;
    out.t = t;
    sample(k, t, x, &out.rate, &out.force);
    return out;
  }

  /// On to t, sample by sample.
  void advance(double t, const Unknowns& x, std::size_t* k, Integral* integral) const {
    while (integral->t < t) {
      const double next = std::min(t, imu_[*k + 1].t), dt = next - integral->t;
      Vector3d gyro, accel;
      sample(*k, next, x, &gyro, &accel);
      const Vector3d gyro0 = integral->rate, accel0 = integral->force;
      integral->advance(gyro0, gyro, accel0, accel, dt);
      integral->t = next;
      if (next == imu_[*k + 1].t && *k + 2 < imu_.size())
        ++*k;
      else if (next < t)
        return;
    }
  }

  SegmentSystem look(const Unknowns& x, const Segment& s, double position_weight, double rotation_weight) const {
    SegmentSystem out;
    std::size_t k = 0;
    const double start = tracker_[s.first].t - x.tau;
    if (!before(start, &k)) return out;
    Integral I = start_at(start, x, k);
    for (std::size_t n = s.first; n < s.last; ++n) {
      const PoseSample& sample = tracker_[n];
      advance(sample.t - x.tau, x, &k, &I);
      const double dt = I.since;
      const Matrix3d R0 = s.R.toRotationMatrix(), R_ti = (s.R * I.R).toRotationMatrix(),
                     R_tr = R_ti * x.R_receiver_imu.conjugate().toRotationMatrix();
      const Vector3d arm = R_tr * x.lever;  // from the receiver to the inertial sensor
      const Vector3d turned = s.R * I.p, velocity = s.v + dt * x.gravity + s.R * I.v, rate = R_ti * I.rate;
      Vector6d e;
      e << sample.position - (s.p + dt * s.v + 0.5 * dt * dt * x.gravity + turned - arm),
          log_rotation(sample.orientation * Quaterniond(R_tr).conjugate());
      const Matrix3d by_gyro = R_ti * I.R_g;  // rotation vector of the receiver, tracker's axes
      Eigen::Matrix<double, 6, kGlobal> G = Eigen::Matrix<double, 6, kGlobal>::Zero();
      G.block<3, 3>(0, kTurn) = -skew(arm) * R_tr;
      G.block<3, 3>(3, kTurn) = -R_tr;
      G.block<3, 3>(0, kLever) = -R_tr;
      G.block<3, 3>(0, kGyroBias) = R0 * I.p_g + skew(arm) * by_gyro;
      G.block<3, 3>(3, kGyroBias) = by_gyro;
      G.block<3, 3>(0, kAccelBias) = R0 * I.p_a;
      G.block<3, 3>(0, kG) = 0.5 * dt * dt * Matrix3d::Identity();
      // The start moves along with the offset: its pose and speed are free, so only what changes since then counts.
      G.block<3, 1>(0, kTau) = -(velocity - rate.cross(arm));
      G.block<3, 1>(3, kTau) = -rate;
      Eigen::Matrix<double, 6, kLocal> L = Eigen::Matrix<double, 6, kLocal>::Zero();
      L.block<3, 3>(0, 0) = -skew(turned - arm);
      L.block<3, 3>(3, 0) = Matrix3d::Identity();
      L.block<3, 3>(0, 3) = Matrix3d::Identity();
      L.block<3, 3>(0, 6) = dt * Matrix3d::Identity();
      Vector6d weight;
      weight << Vector3d::Constant(position_weight), Vector3d::Constant(rotation_weight);
      out.block.add<6>(G, L, -e, weight);
      out.position += e.head<3>().squaredNorm();
      out.rotation += e.tail<3>().squaredNorm();
      out.samples += 1.0;
    }
    return out;
  }

 private:
  void sample(std::size_t k, double t, const Unknowns& x, Vector3d* gyro, Vector3d* accel) const {
    const ImuSample &a = imu_[k], &b = imu_[k + 1];
    const double fraction = (t - a.t) / (b.t - a.t);
    *gyro = a.gyro + fraction * (b.gyro - a.gyro) - x.gyro_bias;
    *accel = a.accel + fraction * (b.accel - a.accel) - x.accel_bias;
  }

  const std::vector<ImuSample>& imu_;
  const std::vector<PoseSample>& tracker_;
};

// ---- Checks ---------------------------------------------------------------------------------------------------------

void check(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker) {
  const auto fail = [](const std::string& what, std::size_t row) {
    throw std::invalid_argument(what + " in row " + std::to_string(row));
  };
  if (imu.size() < 100)
    throw std::invalid_argument("the inertial record has " + std::to_string(imu.size()) +
                                " samples; 100 or more are needed");
  if (tracker.size() < 50)
    throw std::invalid_argument("the tracker's record has " + std::to_string(tracker.size()) +
                                " samples; 50 or more are needed");
  for (std::size_t k = 0; k < imu.size(); ++k) {
    if (!std::isfinite(imu[k].t) || !imu[k].gyro.allFinite() || !imu[k].accel.allFinite())
      fail("the inertial record is not finite", k);
    if (k > 0 && !(imu[k].t > imu[k - 1].t)) fail("the inertial record goes back in time", k);
  }
  for (std::size_t k = 0; k < tracker.size(); ++k) {
    if (!std::isfinite(tracker[k].t) || !tracker[k].position.allFinite() ||
        !tracker[k].orientation.coeffs().allFinite())
      fail("the tracker's record is not finite", k);
    if (k > 0 && !(tracker[k].t > tracker[k - 1].t)) fail("the tracker's record goes back in time", k);
    if (std::abs(tracker[k].orientation.norm() - 1.0) > 1e-3) fail("the tracker's record has no unit quaternion", k);
  }
}

std::string axis_of(const Vector3d& up) {
  Eigen::Index k = 0;
  up.cwiseAbs().maxCoeff(&k);
  return std::string(up[k] > 0.0 ? "+" : "-") + "xyz"[k];
}

/// Tracker samples in runs of `seconds`, without gaps and inside the inertial record for offsets near `tau`.
std::vector<Segment> segments_of(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker, double tau,
                                 double seconds) {
  std::vector<Segment> out;
  const double margin = 0.1;
  for (std::size_t i = 0; i < tracker.size();) {
    Segment s;
    s.first = i;
    std::size_t j = i;
    while (j < tracker.size() && tracker[j].t < tracker[i].t + seconds &&
           (j == i || tracker[j].t - tracker[j - 1].t < 0.25 * seconds))
      ++j;
    s.last = j;
    i = j;
    const double from = tracker[s.first].t - tau, to = tracker[s.last - 1].t - tau;
    if (to - from < 0.5 * seconds || s.last - s.first < 8 || from < imu.front().t + margin ||
        to > imu.back().t - margin)
      continue;
    out.push_back(s);
  }
  return out;
}

std::string advice_for(double sigma, double rotation_sigma, double wanted, double samples, const Vector3d& rate,
                       const Vector3d& wobble) {
  // The offset is known by rotation as sigma_rotation / (rate * sqrt(samples)): the rate at which that is what is
  // wanted, twice to be sure.
  const double needed =
      std::max(2.0 * rotation_sigma / (wanted * std::sqrt(samples)), 1.5 * wobble.norm() * sigma / wanted);
  std::string text = "rotate faster than " + number(std::ceil(10.0 * needed) / 10.0, 2) +
                     " rad/s to and fro about two axes; the offset would be known to " + number(1e3 * wanted, 2) +
                     " ms";
  if (rate[1] < 0.2 * rate[0]) text += " (now nearly all rotation is about one axis)";
  return text;
}

}  // namespace

bool InertialOptions::is_valid(std::string* error) const {
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(clock_search >= 0.0 && clock_search <= 60.0)) return no("clock_search must be from 0 to 60 s");
  if (!(clock_wanted > 0.0)) return no("clock_wanted must be above 0 s");
  if (!(segment >= 0.5 && segment <= 20.0)) return no("segment must be from 0.5 to 20 s");
  if (!(gyro_bias > 0.0 && accel_bias > 0.0)) return no("biases must have standard deviations above 0");
  if (max_iterations < 1) return no("max_iterations must be at least 1");
  return true;
}

namespace {

// ---- What shows before any fit --------------------------------------------------------------------------------------

/// Why the records cannot be used.
struct Refusal {
  CalibrationStatus status;
  std::string message;
};

/// Units of the accelerometer that show by themselves: the median of its lengths, which a boom that accelerates by half
/// of gravity between its stops does not move by as much.
std::optional<Refusal> look_at_force(const std::vector<ImuSample>& imu) {
  std::vector<double> lengths;
  for (const ImuSample& sample : imu) lengths.push_back(sample.accel.norm());
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  const double force = *middle;
  const std::string found =
      "The accelerometer's median is " + number(force, 3) + " m/s^2 where 9.81 is expected at rest: ";
  const auto refusal = [&](const char* what) { return Refusal{CalibrationStatus::not_consistent, found + what}; };
  if (force > 0.7 && force < 1.4) return refusal("it seems to be in g; multiply by 9.80665.");
  if (force > 700.0 && force < 1400.0) return refusal("it seems to be in mg; multiply by 0.00980665.");
  return {};
}

/// What is left of the specific force when it is averaged in the tracker's axes: gravity, however the arm accelerates,
/// for over a recording the speeds gained and lost make nothing.
std::optional<Refusal> look_at_gravity(const Vector3d& mean) {
  const double force = mean.norm();
  if (force > 8.0 && force < 12.0) return {};
  return Refusal{CalibrationStatus::not_consistent,
                 "The accelerometer's mean in the tracker's axes, in which accelerations cancel, is " +
                     number(force, 3) +
                     " m/s^2 where 9.81 is expected: check its unit, and that gravity was not taken away."};
}

/// Units of the gyro: how much faster it turns than the tracker.
std::optional<Refusal> look_at_speed(const SpeedPairs& pairs) {
  const double ratio = std::sqrt(pairs.centred_imu().squaredNorm() / pairs.centred_receiver().squaredNorm());
  const auto as_degrees = [](double times) { return times > 0.6 * kDegrees && times < 1.6 * kDegrees; };
  if (as_degrees(ratio))
    return Refusal{
        CalibrationStatus::not_consistent,
        "The gyro turns " + number(ratio, 3) + " times as fast as the tracker: it is in deg/s and was read as rad/s."};
  if (as_degrees(1.0 / ratio))
    return Refusal{CalibrationStatus::not_consistent,
                   "The gyro turns " + number(1.0 / ratio, 3) +
                       " times more slowly than the tracker: it is in rad/s and was read as deg/s."};
  return {};
}

/// Handedness of the frames, and about how many axes they turn.
std::optional<Refusal> look_at_axes(const Matrix3d& covariance) {
  const SingularValues svd = singular_values(covariance);
  const Vector3d& singular = svd.values;
  const bool reflected = (svd.U * svd.V.transpose()).determinant() < 0.0;
  if (reflected && singular[2] > (1.0 - kMirrored) * 0.5 * singular[1])
    return Refusal{
        CalibrationStatus::not_consistent,
        "Gyro and tracker agree as mirror images: one of the two records is in a left-handed frame (an axis with the "
        "wrong sign, or two axes swapped)."};
  if (singular[1] < 0.02 * singular[0])
    return Refusal{
        CalibrationStatus::not_observable,
        "The motion turns about one axis only: the inertial sensor's orientation and lever arm do not show. Rotate by "
        "30 deg or more about a second axis."};
  return {};
}

std::optional<Refusal> look_at_motion(const SpeedAlignment& aligned) {
  if (aligned.correlation < kOneMotion)
    return Refusal{CalibrationStatus::not_observable,
                   "The two records show no common rotation (correlation " + number(aligned.correlation, 2) +
                       "): do they belong together? Rotate by 30 deg or more about two axes while recording."};
  if (const auto refusal = look_at_speed(aligned.pairs)) return refusal;
  return look_at_axes(aligned.covariance);
}

/// Rms about the three principal axes, descending [rad/s].
Vector3d rotation_rate(const SpeedPairs& pairs) {
  const Matrix3Xd centred = pairs.centred_receiver();
  const Matrix3d covariance = centred * centred.transpose() / static_cast<double>(centred.cols());
  return symmetric_eigen<3>(covariance).values.reverse().cwiseMax(0.0).cwiseSqrt();
}

// ---- The fit --------------------------------------------------------------------------------------------------------

Unknowns start_of(const SpeedAlignment& aligned) {
  const SpeedPairs& pairs = aligned.pairs;
  Unknowns x;
  x.tau = aligned.clock_offset;
  x.R_receiver_imu = Quaterniond(nearest_rotation(aligned.covariance));
  x.gyro_bias = pairs.imu.rowwise().mean() - x.R_receiver_imu.conjugate() * Vector3d(pairs.receiver.rowwise().mean());
  return x;
}

/// Mean of the specific force in the tracker's axes; it points up.
Vector3d mean_force(const Problem& problem, const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker,
                    const Unknowns& x) {
  Vector3d sum = Vector3d::Zero();
  double count = 0.0;
  for (const PoseSample& sample : tracker) {
    std::size_t k = 0;
    if (!problem.before(sample.t - x.tau, &k)) continue;
    sum += sample.orientation * (x.R_receiver_imu * imu[k].accel);
    count += 1.0;
  }
  return sum / std::max(1.0, count);
}

void start_segments(const std::vector<PoseSample>& tracker, const Unknowns& x, std::vector<Segment>* segments) {
  for (Segment& s : *segments) {
    const PoseSample &a = tracker[s.first], &b = tracker[s.last - 1];
    s.R = a.orientation * x.R_receiver_imu;
    s.p = a.position;
    s.v = (b.position - a.position) / (b.t - a.t);
  }
}

GlobalVector prior_weight(const InertialOptions& options) {
  GlobalVector weight = GlobalVector::Zero();
  weight.segment<3>(kGyroBias).setConstant(std::pow(options.gyro_bias, -2));
  weight.segment<3>(kAccelBias).setConstant(std::pow(options.accel_bias, -2));
  return weight;
}

/// Errors of all segments together.
struct Squares {
  double position = 0.0, rotation = 0.0, samples = 0.0;
};

/// The iteration and where it stands: every segment's pose and speed are solved for in it and put back.
struct Fit {
  const Problem& problem;
  const GlobalVector prior;  ///< weights of the biases before any data
  Unknowns x;
  std::vector<Segment> segments;
  std::vector<SegmentSystem> systems;               ///< of every segment, at the last step
  std::vector<NormalSystem<kGlobal>> shared;        ///< what they say of what all share
  GlobalMatrix information = GlobalMatrix::Zero();  ///< of all together, with the priors
  Squares squares;
  double position_sigma = 1e-2, rotation_sigma = 1e-2;
  double position_rms = 0.0, rotation_rms = 0.0;
  int steps = 0;

  Fit(const Problem& p, const InertialOptions& options) : problem(p), prior(prior_weight(options)) {}
  NormalSystem<kGlobal> system();
  void move(const GlobalVector& step);
  bool settled(const NormalSystem<kGlobal>& at, const GlobalVector& step);
};

NormalSystem<kGlobal> Fit::system() {
  NormalSystem<kGlobal> out{prior.asDiagonal(), GlobalVector::Zero(), 0.0};
  out.gradient.segment<3>(kGyroBias) = prior[kGyroBias] * x.gyro_bias;
  out.gradient.segment<3>(kAccelBias) = prior[kAccelBias] * x.accel_bias;
  squares = {};
  for (std::size_t n = 0; n < segments.size(); ++n) {
    SegmentSystem& s = systems[n];
    s = problem.look(x, segments[n], std::pow(position_sigma, -2), std::pow(rotation_sigma, -2));
    if (s.samples == 0.0) continue;
    shared[n] = eliminate(s.block);
    out.gram += shared[n].gram;
    out.gradient += shared[n].gradient;
    out.cost += shared[n].cost;
    squares.position += s.position, squares.rotation += s.rotation, squares.samples += s.samples;
  }
  if (squares.samples == 0.0) out.gradient.setConstant(kNaN);  // the records no longer overlap: there is no step
  information = out.gram;
  return out;
}

void Fit::move(const GlobalVector& step) {
  for (std::size_t n = 0; n < segments.size(); ++n) {
    if (systems[n].samples == 0.0) continue;
    const Eigen::Matrix<double, kLocal, 1> own = recover(systems[n].block, step);
    Segment& s = segments[n];
    s.R = (exp_rotation(own.head<3>()) * s.R).normalized();
    s.p += own.segment<3>(3);
    s.v += own.tail<3>();
  }
  x.R_receiver_imu = (exp_rotation(step.segment<3>(kTurn)) * x.R_receiver_imu).normalized();
  x.lever += step.segment<3>(kLever);
  x.gyro_bias += step.segment<3>(kGyroBias);
  x.accel_bias += step.segment<3>(kAccelBias);
  x.gravity += step.segment<3>(kG);
  x.tau += std::clamp(step[kTau], -0.05, 0.05);
}

/// Both kinds of error weigh by what they turn out to be.
bool Fit::settled(const NormalSystem<kGlobal>& at, const GlobalVector& step) {
  position_rms = std::sqrt(squares.position / (3.0 * squares.samples));
  rotation_rms = std::sqrt(squares.rotation / (3.0 * squares.samples));
  const double before_p = position_sigma, before_r = rotation_sigma;
  position_sigma = std::max(1e-8, position_rms);
  rotation_sigma = std::max(1e-8, rotation_rms);
  const bool same =
      std::abs(position_sigma / before_p - 1.0) < 1e-4 && std::abs(rotation_sigma / before_r - 1.0) < 1e-4;
  return ++steps > 2 && same && step.dot(at.gram * step) < 1e-4;
}

/// Sandwich (Huber 1967): segments are independent of each other, what is inside one need not be. Each with its own
/// pull on the result taken out (jackknife; MacKinnon and White 1985, HC3).
GlobalMatrix covariance_of(const Fit& fit) {
  const GlobalMatrix inverse = inverse_symmetric<Eigen::Dynamic>(fit.information);
  GlobalMatrix B = fit.prior.asDiagonal();
  for (std::size_t n = 0; n < fit.segments.size(); ++n) {
    if (fit.systems[n].samples == 0.0) continue;
    const NormalSystem<kGlobal>& own = fit.shared[n];
    const GlobalVector alone =
        solve_square<Eigen::Dynamic>(GlobalMatrix::Identity() - own.gram * inverse, own.gradient);
    B += alone * alone.transpose();
  }
  const GlobalMatrix sandwich = inverse * B * inverse;
  // With few segments the sandwich is itself uncertain: never below what plain least squares says.
  GlobalMatrix covariance = sandwich;
  for (int i = 0; i < kGlobal; ++i) {
    if (sandwich(i, i) >= inverse(i, i)) continue;
    const double factor = std::sqrt(inverse(i, i) / sandwich(i, i));
    covariance.row(i) *= factor;
    covariance.col(i) *= factor;
  }
  return covariance;
}

// ---- The result -----------------------------------------------------------------------------------------------------

void set_values(const Unknowns& x, const GlobalMatrix& covariance, InertialResult* out) {
  out->T_receiver_imu.T.linear() = x.R_receiver_imu.toRotationMatrix();
  out->T_receiver_imu.T.translation() = x.lever;
  out->T_receiver_imu.covariance << covariance.block<3, 3>(kLever, kLever), covariance.block<3, 3>(kLever, kTurn),
      covariance.block<3, 3>(kTurn, kLever), covariance.block<3, 3>(kTurn, kTurn);
  out->gravity = x.gravity;
  out->gravity_covariance = covariance.block<3, 3>(kG, kG);
  out->tracker_up = axis_of(-x.gravity);
  out->clock_offset = x.tau;
  out->clock_offset_sigma = std::sqrt(covariance(kTau, kTau));
  out->gyro_bias = x.gyro_bias;
  out->accel_bias = x.accel_bias;
  out->gyro_bias_sigma = std::sqrt(covariance.diagonal().segment<3>(kGyroBias).mean());
  out->accel_bias_sigma = std::sqrt(covariance.diagonal().segment<3>(kAccelBias).mean());
}

void set_words(const Fit& fit, const InertialOptions& options, InertialResult* out) {
  out->rich_enough = out->clock_offset_sigma <= options.clock_wanted;
  out->message = "Clock offset " + number(1e3 * out->clock_offset, 4) + " ms, standard error " +
                 number(1e3 * out->clock_offset_sigma, 2) + " ms.";
  if (!out->rich_enough)
    out->advice = advice_for(out->clock_offset_sigma, fit.rotation_sigma, options.clock_wanted, fit.squares.samples,
                             out->rotation_rate, out->rotation_rate);
  if (out->tracker_up != "+z") out->warnings.push_back("the tracker's axis " + out->tracker_up + " points up, not +z");
  const double steep = std::acos(std::clamp((-out->gravity).normalized().cwiseAbs().maxCoeff(), 0.0, 1.0));
  if (steep > 5.0 / kDegrees)
    out->warnings.push_back("gravity is " + number(steep * kDegrees, 3) +
                            " deg from the tracker's nearest axis: the tracker is tilted, which does no harm");
}

InertialResult refused(const Refusal& refusal) {
  InertialResult out;
  out.status = refusal.status;
  out.message = refusal.message;
  return out;
}

/// The numbers as they are given.
InertialResult fit_as_given(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker,
                            const InertialOptions& options) {
  if (const auto refusal = look_at_force(imu)) return refused(*refusal);
  const SpeedAlignment aligned = align_speeds(imu, tracker, options.clock_search);
  if (const auto refusal = look_at_motion(aligned)) return refused(*refusal);

  const Problem problem(imu, tracker);
  Fit fit(problem, options);
  fit.x = start_of(aligned);
  fit.segments = segments_of(imu, tracker, fit.x.tau, options.segment);
  if (fit.segments.size() < 5)
    return refused({CalibrationStatus::not_observable,
                    "The records overlap for " + std::to_string(fit.segments.size()) + " segments of " +
                        number(options.segment, 3) + " s; 5 or more are needed: record for longer."});
  const Vector3d up = mean_force(problem, imu, tracker, fit.x);
  if (const auto refusal = look_at_gravity(up)) return refused(*refusal);
  fit.x.gravity = -kGravity * up.normalized();
  start_segments(tracker, fit.x, &fit.segments);
  fit.systems.resize(fit.segments.size());
  fit.shared.resize(fit.segments.size());
  const Iterations ended = gauss_newton(&fit, options.max_iterations);

  InertialResult out;
  out.rotation_rate = rotation_rate(aligned.pairs);
  out.position_rms = fit.position_rms;
  out.rotation_rms = fit.rotation_rms;
  out.iterations = ended.steps;
  if (!converged(ended.reason)) {
    out.status = CalibrationStatus::not_converged;
    out.message = "The fit did not come to an end: do the two records belong together?";
    return out;
  }
  const double size = fit.x.gravity.norm();
  if (size < 0.9 * kGravity || size > 1.1 * kGravity)
    return refused({CalibrationStatus::not_consistent,
                    "Gravity comes out as " + number(size, 4) +
                        " m/s^2: the tracker's positions or the accelerometer have another unit than was read."});
  set_values(fit.x, covariance_of(fit), &out);
  set_words(fit, options, &out);
  return out;
}

bool convincing(const InertialResult& r) {
  return r.status == CalibrationStatus::done && r.position_rms < 0.01 && r.rotation_rms < 0.02;
}

/// Other readings of the tracker's numbers.
struct TrackerReading {
  const char* message;
  double scale;
  bool mirrored;
};
constexpr TrackerReading kReadings[] = {
    {"Inertial sensor and tracker agree if the tracker's positions are in mm, and were read as m.", 1e-3, false},
    {"Inertial sensor and tracker agree if the tracker's positions are in m, and were read as mm.", 1e3, false},
    {"Inertial sensor and tracker agree if the specific force has the other sign (it points up at rest), or if one of "
     "the two has a left-handed frame: an axis has the wrong sign, or two axes are swapped.",
     1.0, true},
};

std::vector<PoseSample> read_as(const TrackerReading& reading, std::vector<PoseSample> tracker) {
  for (PoseSample& sample : tracker) {
    sample.position *= reading.scale;
    if (!reading.mirrored) continue;
    sample.position.y() *= -1.0;
    sample.orientation =
        Quaterniond(sample.orientation.w(), -sample.orientation.x(), sample.orientation.y(), -sample.orientation.z());
  }
  return tracker;
}

}  // namespace

InertialResult calibrate_inertial(const std::vector<ImuSample>& imu, const std::vector<PoseSample>& tracker,
                                  const InertialOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("InertialOptions: " + error);
  check(imu, tracker);
  const InertialResult as_given = fit_as_given(imu, tracker, options);
  const bool usual =
      as_given.status == CalibrationStatus::done && as_given.position_rms < 3e-3 && as_given.rotation_rms < 5e-3;
  if (usual || as_given.status == CalibrationStatus::not_observable) return as_given;
  for (const TrackerReading& reading : kReadings) {
    const InertialResult other = fit_as_given(imu, read_as(reading, tracker), options);
    if (convincing(other) && !(convincing(as_given) && other.position_rms > 0.5 * as_given.position_rms))
      return refused({CalibrationStatus::not_consistent, reading.message});
  }
  return as_given;
}

}  // namespace truing
