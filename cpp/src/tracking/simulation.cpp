// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/tracking/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "math/constants.hpp"
#include "math/random.hpp"
#include "math/rotation.hpp"
#include "rooms.hpp"

namespace truing {
using namespace tracking;

namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGrid = 1e-3;       // of the truth [s]
constexpr double kMargin = 0.1;      // the truth begins so long before t = 0 and ends so long after [s]
constexpr double kRampUp = 2.0;      // of a gentle motion [s]
constexpr double kUncommon = 0.025;  // what a sample that is overtaken takes longer [s]

Vector3d normal3(Random* random, double sigma) {
  const double x = random->normal(), y = random->normal(), z = random->normal();
  return sigma * Vector3d(x, y, z);
}

// ---- Commanded joint motion ----------------------------------------------------------------------------------------

/// 0 before 0, 1 after 1, two continuous derivatives.
double smooth_step(double x) {
  const double s = std::clamp(x, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
}

/// A move of length one from rest to rest with limited jerk: seven phases of constant jerk (jerk, hold, jerk, cruise,
/// and the same back).
struct JerkLimitedMove {
  double jerk_time, hold_time, cruise_time;
  double duration() const { return 4.0 * jerk_time + 2.0 * hold_time + cruise_time; }

  double at(double t) const {
    const double phases[7] = {jerk_time, hold_time, jerk_time, cruise_time, jerk_time, hold_time, jerk_time};
    const double signs[7] = {1, 0, -1, 0, -1, 0, 1};
    const double top = jerk_time * (jerk_time + hold_time);  // speed per jerk
    const double jerk = 1.0 / (top * (2.0 * jerk_time + hold_time + cruise_time));
    double x = 0.0, v = 0.0, a = 0.0;
    for (int k = 0; k < 7 && t > 0.0; ++k) {
      const double s = std::min(t, phases[k]), j = signs[k] * jerk;
      x += s * (v + s * (a / 2.0 + s * j / 6.0));
      v += s * (a + s * j / 2.0);
      a += s * j;
      t -= s;
    }
    return x;
  }
};

/// Commanded joint readings over time.
class JointMotion {
 public:
  JointMotion(const Robot& robot, const StreamSimulationOptions& options, Random* random) : motion_(options.motion) {
    const std::size_t dof = robot.driven_count();
    center_.setZero(static_cast<Eigen::Index>(dof));
    range_.setZero(static_cast<Eigen::Index>(dof));
    const std::vector<std::size_t> driven = robot.driven_joints();
    for (std::size_t k = 0; k < dof; ++k) {
      const Joint& joint = robot.joints[driven[k]];
      const auto i = static_cast<Eigen::Index>(k);
      const bool limited = std::isfinite(joint.lower) && std::isfinite(joint.upper);
      center_[i] = limited ? (joint.lower + joint.upper) / 2.0 : 0.0;
      range_[i] =
          limited ? std::min(0.4 * (joint.upper - joint.lower), joint.type == JointType::revolute ? 0.5 : 1.0) : 0.5;
      for (int w = 0; w < 3; ++w) waves_.push_back({random->uniform(0.02, 0.2), random->uniform(0.0, kTwoPi), i});
    }
    if (motion_ == SimulatedMotion::stop_and_go) draw_moves(options.seconds + 2.0, random);
    if (motion_ != SimulatedMotion::still) scale_to(robot, options);
  }

  VectorXd at(double t) const {
    VectorXd q = center_;
    if (motion_ == SimulatedMotion::gentle) {
      for (const Wave& wave : waves_) {
        q[wave.joint] +=
            scale_ * range_[wave.joint] * smooth_step(t / kRampUp) * std::sin(kTwoPi * wave.frequency * t + wave.phase);
      }
    } else if (motion_ == SimulatedMotion::stop_and_go) {
      const auto next =
          std::upper_bound(moves_.begin(), moves_.end(), t, [](double x, const Move& move) { return x < move.start; });
      if (next == moves_.begin()) return q + scale_ * moves_.front().from;
      const Move& move = *(next - 1);
      q += scale_ * (move.from + move.profile.at(t - move.start) * (move.to - move.from));
    }
    return q;
  }

  const VectorXd& center() const { return center_; }

 private:
  struct Wave {
    double frequency, phase;
    Eigen::Index joint;
  };
  struct Move {
    double start;
    VectorXd from, to;
    JerkLimitedMove profile;
  };

  void draw_moves(double seconds, Random* random) {
    VectorXd from = VectorXd::Zero(center_.size());
    for (double start = 1.0; start < seconds;) {
      Move move{start, from, from, {0.12, random->uniform(0.15, 0.35), random->uniform(0.2, 0.6)}};
      for (Eigen::Index k = 0; k < from.size(); ++k) move.to[k] = range_[k] * random->uniform(-1.0, 1.0);
      start += move.profile.duration() + random->uniform(0.8, 1.6);
      from = move.to;
      moves_.push_back(move);
    }
  }

  /// The tip moves as fast as was asked for: rms of a gentle motion, highest speed of the other.
  void scale_to(const Robot& robot, const StreamSimulationOptions& options) {
    for (int pass = 0; pass < 3; ++pass) {
      double sum = 0.0, highest = 0.0, count = 0.0;
      for (double t = kRampUp; t < kRampUp + 60.0; t += 0.05) {
        const double h = 1e-3;
        const Vector3d v = (forward_kinematics(robot, at(t + h)).rbegin()[1].translation() -
                            forward_kinematics(robot, at(t)).rbegin()[1].translation()) /
                           h;
        sum += v.squaredNorm();
        highest = std::max(highest, v.norm());
        count += 1.0;
      }
      const double speed = motion_ == SimulatedMotion::gentle ? std::sqrt(sum / count) : highest;
      if (speed > 0.0) scale_ *= options.tip_speed / speed;
    }
  }

  SimulatedMotion motion_;
  VectorXd center_, range_;
  std::vector<Wave> waves_;
  std::vector<Move> moves_;
  double scale_ = 0.1;
};

// ---- The arm that sways ---------------------------------------------------------------------------------------------

struct RigidPose {
  Isometry3d T_base_flange;
  Eigen::Matrix3d R_base_first;  // frame after the first joint, which turns with it
};

RigidPose rigid_pose(const Robot& robot, const VectorXd& q) {
  const std::vector<Isometry3d> frames = forward_kinematics(robot, q);
  const Isometry3d T_base_measurement = robot.T_measurement_base.inverse();
  return {T_base_measurement * frames[robot.joints.size() - 1], (T_base_measurement * frames.front()).linear()};
}

double reach_of(const RigidPose& pose) { return pose.T_base_flange.translation().head<2>().norm(); }

/// One mode's oscillator and the gust (Ornstein and Uhlenbeck) that pushes it.
struct Oscillator {
  double q = 0.0, v = 0.0, gust = 0.0;

  void step(const FlexibleMode& mode, double omega, double force0, double force1, double force2, double h) {
    const auto acceleration = [&](double x, double y, double force) {
      return force + gust - 2.0 * mode.damping * omega * y - omega * omega * x;
    };
    const double a1 = acceleration(q, v, force0), v2 = v + h / 2.0 * a1;
    const double a2 = acceleration(q + h / 2.0 * v, v2, force1), v3 = v + h / 2.0 * a2;
    const double a3 = acceleration(q + h / 2.0 * v2, v3, force1), v4 = v + h * a3;
    const double a4 = acceleration(q + h * v3, v4, force2);
    q += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
};

void make_truth(const Robot& robot, const StreamSimulationOptions& options, const JointMotion& motion, Random* random,
                SimulatedStreams* out) {
  const double half = kGrid / 2.0;
  const auto steps = static_cast<std::size_t>(std::ceil((options.seconds + 2.0 * kMargin) / kGrid));
  out->grid = kGrid;
  out->grid_start = -kMargin;
  // Rigid poses every half step, one before and one after, so that their second difference is the tip's acceleration.
  // With all joints at zero the frame after the first joint stands as the base does, whatever the robot's convention
  // makes of its axes.
  const Eigen::Matrix3d R_first_rest =
      rigid_pose(robot, VectorXd::Zero(motion.center().size())).R_base_first.transpose();
  const auto rigid_at = [&](std::size_t k) {
    RigidPose pose =
        rigid_pose(robot, motion.at(out->grid_start + (static_cast<double>(k) - 1.0) * half - options.actuator_lag));
    pose.R_base_first = pose.R_base_first * R_first_rest;
    return pose;
  };
  RigidPose rigid[4] = {rigid_at(0), rigid_at(1), rigid_at(2), rigid_at(3)};
  const auto push_of = [&](const FlexibleMode& mode, int k, double reach) {
    const Vector3d a = (rigid[k + 1].T_base_flange.translation() - 2.0 * rigid[k].T_base_flange.translation() +
                        rigid[k - 1].T_base_flange.translation()) /
                       (half * half);
    return -mode.participation.dot(rigid[k].R_base_first.transpose() * (a - robot.gravity)) * reach;
  };

  const double reference = reach_of(rigid_pose(robot, motion.center()));
  const double corner = kTwoPi * options.gust_corner;
  const auto omega_of = [&](const FlexibleMode& mode, double reach) {
    return kTwoPi * mode.frequency * std::pow(reach, -options.reach_exponent);
  };
  const auto gust_density = [&](const FlexibleMode& mode) {  // of the white force that would make `gust` of sway
    const double omega = kTwoPi * mode.frequency;
    return mode.gust * std::sqrt(4.0 * mode.damping * omega * omega * omega);
  };
  std::vector<Oscillator> oscillators(out->modes.size());
  const double reach_start = reach_of(rigid[1]) / reference;
  for (std::size_t m = 0; m < out->modes.size(); ++m) {
    const double omega = omega_of(out->modes[m], reach_start);
    oscillators[m].q = push_of(out->modes[m], 1, reach_start) / (omega * omega) + out->modes[m].gust * random->normal();
    oscillators[m].v = omega * out->modes[m].gust * random->normal();
    oscillators[m].gust = gust_density(out->modes[m]) * std::sqrt(corner / 2.0) * random->normal();
  }

  out->true_position.reserve(steps + 1);
  out->true_orientation.reserve(steps + 1);
  for (std::size_t k = 0; k <= steps; ++k) {
    Vector3d shift = Vector3d::Zero(), turn = Vector3d::Zero();
    for (std::size_t m = 0; m < oscillators.size(); ++m) {
      shift += oscillators[m].q * out->modes[m].direction;
      turn += oscillators[m].q * out->modes[m].rotation;
    }
    const Quaterniond slew(rigid[1].R_base_first);
    out->true_position.push_back(rigid[1].T_base_flange.translation() + slew * shift);
    out->true_orientation.push_back(
        (slew * exp_rotation(turn) * slew.conjugate() * Quaterniond(rigid[1].T_base_flange.linear())).normalized());

    // The step to the next row needs forces at its start, middle and end.
    const double reach = reach_of(rigid[1]) / reference;
    double start[16], middle[16];
    for (std::size_t m = 0; m < oscillators.size(); ++m) {
      start[m] = push_of(out->modes[m], 1, reach);
      middle[m] = push_of(out->modes[m], 2, reach);
    }
    const RigidPose ahead = rigid_at(2 * k + 4);
    rigid[0] = rigid[1], rigid[1] = rigid[2], rigid[2] = rigid[3], rigid[3] = ahead;
    for (std::size_t m = 0; m < oscillators.size(); ++m) {
      oscillators[m].step(out->modes[m], omega_of(out->modes[m], reach), start[m], middle[m],
                          push_of(out->modes[m], 2, reach), kGrid);
      const double keep = std::exp(-corner * kGrid);
      oscillators[m].gust = keep * oscillators[m].gust + gust_density(out->modes[m]) *
                                                             std::sqrt(corner / 2.0 * (1.0 - keep * keep)) *
                                                             random->normal();
    }
    rigid[0] = rigid[1], rigid[1] = rigid[2], rigid[2] = rigid[3], rigid[3] = rigid_at(2 * k + 5);
  }
}

// ---- The sensors ----------------------------------------------------------------------------------------------------

void measure_imu(const Robot& robot, const StreamSimulationOptions& options, Random* random, SimulatedStreams* out) {
  const double dt = 1.0 / options.imu_rate, h = kGrid;
  const ImuErrors& errors = options.imu;
  Vector3d gyro_bias = normal3(random, errors.gyro_bias), accel_bias = normal3(random, errors.accel_bias);
  const Vector3d gyro_scale = normal3(random, errors.gyro_scale), accel_scale = normal3(random, errors.accel_scale);
  const auto count = static_cast<std::size_t>(options.seconds * options.imu_rate);
  out->imu.reserve(count + 1);
  for (std::size_t k = 0; k <= count; ++k) {
    ImuSample sample;
    sample.t = static_cast<double>(k) * dt;
    sample.arrival = sample.t + 3e-4;
    const Isometry3d before = out->flange_at(sample.t - h) * out->setup.T_flange_imu,
                     now = out->flange_at(sample.t) * out->setup.T_flange_imu,
                     after = out->flange_at(sample.t + h) * out->setup.T_flange_imu;
    const Vector3d rate = log_rotation(Quaterniond(before.linear().transpose() * after.linear())) / (2.0 * h);
    const Vector3d acceleration = (after.translation() - 2.0 * now.translation() + before.translation()) / (h * h);
    const Vector3d force = now.linear().transpose() * (acceleration - robot.gravity);
    sample.gyro = rate + gyro_scale.cwiseProduct(rate) + gyro_bias + normal3(random, errors.gyro_noise / std::sqrt(dt));
    sample.accel =
        force + accel_scale.cwiseProduct(force) + accel_bias + normal3(random, errors.accel_noise / std::sqrt(dt));
    gyro_bias += normal3(random, errors.gyro_bias_walk * std::sqrt(dt));
    accel_bias += normal3(random, errors.accel_bias_walk * std::sqrt(dt));
    out->imu.push_back(sample);
  }
}

void measure_tracker(const StreamSimulationOptions& options, Random* random, SimulatedStreams* out) {
  const TrackerErrors& errors = options.tracker;
  const auto count = static_cast<std::size_t>(options.seconds * options.tracker_rate);
  const double first = random->uniform(0.0, 1.0 / options.tracker_rate);
  for (std::size_t k = 0; k < count; ++k) {
    const double t = first + static_cast<double>(k) / options.tracker_rate;
    // Every sample draws its numbers whether it arrives or not, so that a dropout leaves the others as they were.
    const Vector3d position_noise = normal3(random, errors.position_noise),
                   rotation_noise = normal3(random, errors.rotation_noise);
    const double delay = std::max(1e-3, errors.latency + errors.latency_jitter * random->normal()) +
                         (random->uniform(0.0, 1.0) < errors.out_of_order ? kUncommon : 0.0);
    bool lost = random->uniform(0.0, 1.0) < errors.lost;
    for (const Dropout& dropout : options.dropouts)
      lost = lost || (t >= dropout.start && t < dropout.start + dropout.seconds);
    if (lost) continue;
    Isometry3d T_tracker_receiver = out->setup.T_tracker_base * out->flange_at(t) * out->setup.T_flange_receiver;
    for (const StationShift& shift : options.shifts) {
      if (t >= shift.start) T_tracker_receiver = shift.T_old_new.inverse() * T_tracker_receiver;
    }
    PoseSample sample;
    sample.t = t * (1.0 + errors.clock_drift) + errors.clock_offset;
    sample.arrival = t + delay;
    sample.position = T_tracker_receiver.translation() + position_noise;
    sample.orientation = Quaterniond(T_tracker_receiver.linear()) * exp_rotation(rotation_noise);
    out->tracker.push_back(sample);
  }
  std::stable_sort(out->tracker.begin(), out->tracker.end(),
                   [](const PoseSample& a, const PoseSample& b) { return a.arrival < b.arrival; });
}

void read_joints(const Robot& robot, const StreamSimulationOptions& options, const JointMotion& motion, Random* random,
                 SimulatedStreams* out) {
  const auto count = static_cast<std::size_t>(options.seconds * options.joint_rate);
  out->joints.resize(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(robot.driven_count()));
  for (std::size_t k = 0; k < count; ++k) {
    const double t = static_cast<double>(k) / options.joint_rate;
    VectorXd q = motion.at(t - options.actuator_lag);
    for (Eigen::Index j = 0; j < q.size(); ++j) q[j] += options.joint_noise * random->normal();
    out->joints.row(static_cast<Eigen::Index>(k)) = q.transpose();
    out->joints_t.push_back(t);
    out->joints_arrival.push_back(t + 1e-3);
    out->flange.push_back({t, t + 1e-3, rigid_pose(robot, q).T_base_flange});
  }
}

void write_plan(const Robot& robot, const StreamSimulationOptions& options, const JointMotion& motion,
                SimulatedStreams* out) {
  const auto count = static_cast<std::size_t>((options.seconds + options.plan_ahead + kMargin) * options.plan_rate);
  for (std::size_t k = 0; k < count; ++k) {
    const double t = static_cast<double>(k) / options.plan_rate - kMargin;
    out->plan.push_back(
        {t, t - options.plan_ahead, rigid_pose(robot, motion.at(t)).T_base_flange * out->setup.T_flange_tool});
  }
}

TrackSetup default_setup() {
  TrackSetup setup;
  setup.T_tracker_base = frame_from_xyz_rpy({9.0, -4.0, 1.2}, {0.01, -0.02, 2.1});
  setup.T_flange_receiver = frame_from_xyz_rpy({0.15, 0.10, 0.20}, {0.3, -0.2, 1.0});
  setup.T_flange_imu = frame_from_xyz_rpy({0.05, -0.06, 0.10}, {-0.1, 0.2, -0.7});
  setup.T_flange_tool = frame_from_xyz_rpy({0.30, 0.0, -0.40}, {0.0, 0.0, 0.0});
  return setup;
}

}  // namespace

bool StreamSimulationOptions::is_valid(std::string* error) const {
  const auto no = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(seconds > 0.0 && seconds <= 7200.0))
    return no("seconds must be above 0 and at most 7200: simulate longer times in parts");
  if (!(imu_rate > 0.0 && tracker_rate > 0.0 && joint_rate > 0.0 && plan_rate > 0.0))
    return no("rates must be above 0");
  if (!(tip_speed > 0.0 && plan_ahead >= 0.0 && actuator_lag >= 0.0))
    return no("tip_speed must be above 0, plan_ahead and actuator_lag not below");
  if (modes.size() > 16) return no("at most 16 modes");
  for (const FlexibleMode& mode : modes) {
    if (!(mode.frequency > 0.0 && mode.frequency < 50.0 && mode.damping > 0.0 && mode.damping < 1.0))
      return no("modes: frequency between 0 and 50 Hz, damping between 0 and 1");
  }
  if (!(frequency_spread >= 0.0 && frequency_spread < 0.5)) return no("frequency_spread must be from 0 to below 0.5");
  return true;
}

Robot large_boom() {
  const auto joint = [](const char* name, const Vector3d& origin, const Vector3d& axis, double center, double range) {
    Joint out;
    out.name = name;
    out.T_parent_joint.translation() = origin;
    out.axis = axis;
    out.lower = center - range;
    out.upper = center + range;
    return out;
  };
  Robot robot;
  robot.name = "large_boom";
  robot.convention = Convention::urdf;
  robot.joints = {joint("slew", {0.0, 0.0, 1.5}, Vector3d::UnitZ(), 0.0, 2.5),
                  joint("luff", {0.5, 0.0, 0.6}, -Vector3d::UnitY(), 0.6, 0.5),
                  joint("elbow", {6.5, 0.0, 0.0}, -Vector3d::UnitY(), -0.85, 0.6),
                  joint("level", {5.5, 0.0, 0.0}, -Vector3d::UnitY(), 0.25, 0.4)};
  robot.targets = {{"tool", Isometry3d::Identity()}};
  return robot;
}

std::vector<FlexibleMode> large_boom_modes() {
  std::vector<FlexibleMode> modes(4);
  modes[0] = {0.60, 0.020, Vector3d::UnitY(), {0.0, 0.0, 0.10}, {0.0, 0.60, 0.0}, 3.0e-3};
  modes[1] = {1.40, 0.015, {0.25, 0.0, 0.97}, {0.0, -0.12, 0.0}, {0.12, 0.0, 0.50}, 3.5e-3};
  modes[2] = {3.20, 0.015, {0.0, 0.95, 0.1}, {0.15, 0.0, 0.25}, {0.0, 0.35, 0.03}, 9.0e-4};
  modes[3] = {6.30, 0.020, {0.15, 0.05, 0.98}, {0.02, -0.30, 0.0}, {0.05, 0.0, 0.25}, 3.0e-4};
  return modes;
}

Isometry3d SimulatedStreams::flange_at(double t) const {
  // Cubic through four rows (Lagrange), orientations as rotation vectors from the second one.
  const double position = (t - grid_start) / grid;
  const auto last = static_cast<double>(true_position.size()) - 3.0;
  const double row = std::clamp(std::floor(position + 1e-9), 1.0, last);
  const auto k = static_cast<std::size_t>(row);
  const double x = position - row;
  Isometry3d out = Isometry3d::Identity();
  if (std::abs(x) < 1e-6) {
    out.linear() = true_orientation[k].toRotationMatrix();
    out.translation() = true_position[k];
    return out;
  }
  const double weight[4] = {-x * (x - 1.0) * (x - 2.0) / 6.0, (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
                            -(x + 1.0) * x * (x - 2.0) / 2.0, (x + 1.0) * x * (x - 1.0) / 6.0};
  Vector3d p = Vector3d::Zero(), turn = Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    p += weight[i] * true_position[k + i - 1];
    turn += weight[i] * log_rotation(true_orientation[k].conjugate() * true_orientation[k + i - 1]);
  }
  out.linear() = (true_orientation[k] * exp_rotation(turn)).toRotationMatrix();
  out.translation() = p;
  return out;
}

SimulatedStreams simulate_streams(const Robot& robot, const StreamSimulationOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("StreamSimulationOptions: " + error);
  validate(robot);
  Random random(options.seed), noise(options.seed ^ 0x5deece66dull);  // the arm, and its sensors
  SimulatedStreams out;
  out.setup = options.setup ? *options.setup : default_setup();
  out.setup.gravity = robot.gravity;
  out.setup.clock_offset = options.tracker.clock_offset;
  out.setup.actuator_lag = options.actuator_lag;
  out.modes = options.modes.empty() ? large_boom_modes() : options.modes;
  for (FlexibleMode& mode : out.modes)
    mode.frequency *= 1.0 + random.uniform(-options.frequency_spread, options.frequency_spread);
  const JointMotion motion(robot, options, &random);
  make_truth(robot, options, motion, &random, &out);
  measure_imu(robot, options, &noise, &out);
  measure_tracker(options, &noise, &out);
  read_joints(robot, options, motion, &noise, &out);
  write_plan(robot, options, motion, &out);
  return out;
}

}  // namespace truing
