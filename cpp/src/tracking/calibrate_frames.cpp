// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Test positions: tracker frame and receiver. Tool from prescribed poses.

#include "truing/tracking/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "math/constants.hpp"
#include "math/direction.hpp"
#include "math/gauss_newton.hpp"
#include "math/linear_algebra.hpp"
#include "math/registration.hpp"
#include "math/rotation.hpp"
#include "math/text.hpp"
#include "rooms.hpp"

namespace truing {
using namespace tracking;

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix12d = Eigen::Matrix<double, 12, 12>;
using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

constexpr double kDegreesOfFreedom = 5.0;  // of the t distribution that errors have
constexpr double kLeastTurn = 0.1;         // [rad] pivot poses that turn less do not show the tool point
constexpr double kExact = 1e-9;            // [m], [rad] errors below this are rounding

// ---- Standstills ----------------------------------------------------------------------------------------------------

template <typename Sample>
void check_times(const std::vector<Sample>& rows, const char* what) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (!std::isfinite(rows[k].t))
      throw std::invalid_argument(std::string(what) + " has a time that is not finite in row " + std::to_string(k));
    if (k > 0 && !(rows[k].t > rows[k - 1].t))
      throw std::invalid_argument(std::string(what) + " goes back in time at row " + std::to_string(k) + ": " +
                                  number(rows[k].t, 9) + " s after " + number(rows[k - 1].t, 9) + " s");
  }
}

bool moved(const Isometry3d& a, const Isometry3d& b, const RestOptions& options) {
  return (a.translation() - b.translation()).norm() > options.moved_by ||
         log_rotation(Quaterniond(a.linear().transpose() * b.linear())).norm() > options.turned_by;
}

/// Mean position and rotation of the tracker's samples with stamps from `start` to `end`.
void average_tracker(const std::vector<PoseSample>& tracker, double start, double end, RestPose* rest) {
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  Matrix3d rotation = Matrix3d::Zero();
  for (const PoseSample& sample : tracker) {
    if (sample.t < start || sample.t > end) continue;
    sum += sample.position;
    squares += sample.position.cwiseAbs2();
    rotation += sample.orientation.normalized().toRotationMatrix();
    ++rest->samples;
  }
  if (rest->samples == 0) return;
  const auto n = static_cast<double>(rest->samples);
  rest->T_tracker_receiver.translation() = sum / n;
  rest->T_tracker_receiver.linear() = nearest_rotation(rotation);
  rest->scatter = std::sqrt(std::max(0.0, (squares / n - (sum / n).cwiseAbs2()).mean()));
}

// ---- Frames ---------------------------------------------------------------------------------------------------------

// What hand-eye found, in the words of this room: the camera is the tracker, the board the receiver, the hand the
// flange.

std::string unobservable_text(const HandEyeResult& found) {
  std::string text;
  for (const Unobservable& u : found.unobservable) {
    if (!text.empty()) text += " ";
    switch (u.reason) {
      case UnobservableReason::no_rotation:
        return "The tracker's position is not observable: the flange moved without turning. Rotate it by 30 deg or "
               "more "
               "about two axes.";
      case UnobservableReason::one_axis:
        text += "The tracker's height along " + direction_name(u.direction, "base") +
                " is not observable; all rotations are about this one axis: rotate about a second one by 30 deg.";
        break;
      case UnobservableReason::large_error:
        text += std::string("The tracker's ") + (u.rotation ? "rotation about " : "position along ") +
                direction_name(u.direction, "base") + " is not observable; its standard error would be " +
                (u.rotation ? degrees(u.sigma) : millimetres(u.sigma)) +
                ": turn the flange further, by 30 deg or more about two axes, or take more positions.";
        break;
      case UnobservableReason::singular:
        text +=
            "The place of tracker and receiver together is not observable; rotate the flange about two axes by 30 "
            "deg or more, and move it.";
        break;
    }
  }
  return text;
}

std::string meaning(const Reading& reading) { return explain_reading(reading.name, {"flange", "tracker", "receiver"}); }

std::string not_closing_text(const HandEyeResult& found) {
  const std::string given = "The loop does not close as given (median " + millimetres(found.as_given.position_rms) +
                            ", " + degrees(found.as_given.rotation_rms) + ").";
  if (found.readings.empty())
    return given +
           " No other reading of the numbers that was tried closes it: check that every tracker pose belongs to its "
           "flange pose, and how orientations are written.";
  const Reading& best = found.readings.front();
  return given + " It closes to " + millimetres(best.position_rms) + ", " + degrees(best.rotation_rms) + " if " +
         meaning(best) + ".";
}

/// Empty: no concern of trackers. They have no lens to be in front of, no images, and their noise is not given.
std::string concern_text(const HandEyeConcern& concern) {
  if (concern.kind == HandEyeConcernKind::not_like_noise)
    return "What is left does not look like noise of robot and tracker: plain weights predict positions that were left "
           "out better (" +
           millimetres(concern.value) + " for " + millimetres(concern.reference) +
           "). The robot's own kinematics may be off: calibrate it first.";
  if (concern.kind != HandEyeConcernKind::board_scale) return {};
  const double off = concern.value - 1.0;
  return "The loop closes better with the tracker's lengths " + number(100.0 * std::abs(off), 3) + " % " +
         (off > 0.0 ? "longer" : "shorter") + " (standard error " + number(100.0 * concern.reference, 2) +
         " %): check the tracker's scale.";
}

/// Measured minus predicted receiver: position and rotation vector in the tracker frame, T_tracker_base T_base_flange
/// T_flange_receiver.
Vector6d frame_error(const Isometry3d& W, const Isometry3d& F, const Isometry3d& R, const Isometry3d& measured,
                     Matrix6x12* J) {
  const Isometry3d FR = F * R, predicted = W * FR;
  Vector6d e;
  e << measured.translation() - predicted.translation(),
      log_rotation(Quaterniond(measured.linear() * predicted.linear().transpose()));
  const Matrix3d R_tracker_flange = W.linear() * F.linear();
  J->setZero();
  J->block<3, 3>(0, 0).setIdentity();
  J->block<3, 3>(0, 3) = -skew(W.linear() * FR.translation());
  J->block<3, 3>(3, 3).setIdentity();
  J->block<3, 3>(0, 6) = R_tracker_flange;
  J->block<3, 3>(3, 9) = R_tracker_flange;
  return e;
}

void move_frame(const Eigen::Ref<const Vector6d>& d, Isometry3d* T) {
  T->translation() += d.head<3>();
  T->linear() = (exp_rotation(d.tail<3>()) * Quaterniond(T->linear())).normalized().toRotationMatrix();
}

/// Expectation and maximisation in turn: weights of a t distribution from the errors, frames and sigmas from the
/// weights.
struct FramesIteration {
  const std::vector<Isometry3d>& F;
  const std::vector<Isometry3d>& T;
  FramesResult* out;
  std::vector<Vector6d> e;  ///< where the frames are
  std::vector<Matrix6x12> J;

  double count() const { return static_cast<double>(F.size()); }
  /// What the fit leaves of the errors' variance.
  double left() const { return (6.0 * count() - 12.0) / (6.0 * count()); }
  Vector6d weight() const {
    Vector6d weight;
    weight << Vector3d::Constant(std::pow(out->position_sigma, -2)),
        Vector3d::Constant(std::pow(out->rotation_sigma, -2));
    return weight;
  }

  void look() {
    for (std::size_t i = 0; i < F.size(); ++i)
      e[i] = frame_error(out->T_tracker_base.T, F[i], out->T_flange_receiver.T, T[i], &J[i]);
  }
  void set_sigmas() {
    double p = 0.0, r = 0.0;
    for (std::size_t i = 0; i < F.size(); ++i)
      p += out->errors[i].weight * e[i].head<3>().squaredNorm(),
          r += out->errors[i].weight * e[i].tail<3>().squaredNorm();
    out->position_sigma = std::max(kExact, std::sqrt(p / (3.0 * count() * left())));
    out->rotation_sigma = std::max(kExact, std::sqrt(r / (3.0 * count() * left())));
  }

  NormalSystem<12> system() {
    const Vector6d weight = this->weight();
    NormalSystem<12> system{Matrix12d::Zero(), Vector12d::Zero(), 0.0};
    for (std::size_t i = 0; i < F.size(); ++i) {
      const double d = e[i].dot(weight.cwiseProduct(e[i]));
      out->errors[i].weight = (kDegreesOfFreedom + 6.0) / (kDegreesOfFreedom + d);
      system.gram += out->errors[i].weight * J[i].transpose() * weight.asDiagonal() * J[i];
      system.gradient -= out->errors[i].weight * J[i].transpose() * weight.cwiseProduct(e[i]);
      system.cost += out->errors[i].weight * d;
    }
    return system;
  }
  void move(const Vector12d& step) {
    move_frame(step.head<6>(), &out->T_tracker_base.T);
    move_frame(step.tail<6>(), &out->T_flange_receiver.T);
  }
  bool settled(const NormalSystem<12>& at, const Vector12d& step) {
    look();
    const double before = out->position_sigma;
    set_sigmas();
    return step.norm() < 1e-11 ||
           (step.dot(at.gram * step) < 1e-12 && std::abs(out->position_sigma / before - 1.0) < 1e-8);
  }
};

/// Covariance of an M-estimate (Huber 1981, eq. (6.5) of chapter 7): psi = w e, its variance over the square of its
/// mean slope. Sets what every position counted, too.
Matrix12d covariance_of(const FramesIteration& fit, std::vector<PositionError>* errors) {
  const Vector6d weight = fit.weight();
  const double n = fit.count();
  double psi = 0.0, slope = 0.0;
  Matrix12d information = Matrix12d::Zero();
  for (std::size_t i = 0; i < fit.F.size(); ++i) {
    const Vector6d& e = fit.e[i];
    const double d = e.dot(weight.cwiseProduct(e)), w = (kDegreesOfFreedom + 6.0) / (kDegreesOfFreedom + d);
    psi += w * w * d / (6.0 * n * fit.left());
    slope += (w - 2.0 / 6.0 * w * d / (kDegreesOfFreedom + d)) / n;
    information += fit.J[i].transpose() * weight.asDiagonal() * fit.J[i];
    (*errors)[i] = {e.head<3>().norm(), e.tail<3>().norm(), w};
  }
  return psi / (slope * slope) * inverse_symmetric<Eigen::Dynamic>(information);
}

void refine_frames(const std::vector<Isometry3d>& F, const std::vector<Isometry3d>& T, FramesResult* out) {
  FramesIteration fit{F, T, out, std::vector<Vector6d>(F.size()), std::vector<Matrix6x12>(F.size())};
  fit.look();
  fit.set_sigmas();
  const Iterations ended = gauss_newton(&fit, 200);
  out->iterations = ended.steps;
  out->status = converged(ended.reason) ? CalibrationStatus::done : CalibrationStatus::not_converged;
  if (ended.reason == StopReason::singular) return;
  const Matrix12d covariance = covariance_of(fit, &out->errors);
  out->T_tracker_base.covariance = covariance.topLeftCorner<6, 6>();
  out->T_flange_receiver.covariance = covariance.bottomRightCorner<6, 6>();
}

}  // namespace

const char* name(CalibrationStatus status) {
  static const char* const names[] = {"done", "not_observable", "not_consistent", "not_converged"};
  return names[static_cast<std::size_t>(status)];
}

std::vector<RestPose> find_rests(const std::vector<FrameSample>& flange, const std::vector<PoseSample>& tracker,
                                 const RestOptions& options) {
  check_times(flange, "the record of the joints");
  check_times(tracker, "the record of the tracker");
  std::vector<RestPose> out;
  for (std::size_t i = 0; i < flange.size();) {
    std::size_t j = i + 1;
    while (j < flange.size() && !moved(flange[i].T_base_frame, flange[j].T_base_frame, options)) ++j;
    RestPose rest;
    rest.start = flange[i].t + options.margin;
    rest.end = flange[j - 1].t - options.margin;
    if (rest.end - rest.start < options.least) {
      ++i;
      continue;
    }
    rest.T_base_flange = flange[(i + j) / 2].T_base_frame;
    average_tracker(tracker, rest.start + options.clock_offset, rest.end + options.clock_offset, &rest);
    if (rest.samples > 0) out.push_back(rest);
    i = j;
  }
  return out;
}

FramesResult calibrate_frames(const std::vector<Isometry3d>& T_base_flange,
                              const std::vector<Isometry3d>& T_tracker_receiver) {
  HandEyePoses poses;
  poses.T_base_hand = T_base_flange;
  poses.T_camera_board = T_tracker_receiver;
  HandEyeOptions options;
  options.setup = HandEyeSetup::eye_to_hand;
  HandEyeResult start = handeye(poses, options);
  const auto is_of_setup = [](const Reading& r) { return r.other_setup; };
  start.readings.erase(std::remove_if(start.readings.begin(), start.readings.end(), is_of_setup),
                       start.readings.end());  // a tracker does not ride on the flange
  FramesResult out;
  for (const HandEyeConcern& concern : start.concerns) {
    const std::string text = concern_text(concern);
    if (!text.empty()) out.warnings.push_back(text);
  }
  if (start.status == HandEyeStatus::not_observable) {
    out.status = CalibrationStatus::not_observable;
    out.message = unobservable_text(start);
    return out;
  }
  if (start.status == HandEyeStatus::not_closing) {
    out.status = CalibrationStatus::not_consistent;
    out.message = not_closing_text(start);
    for (const Reading& reading : start.readings) out.warnings.push_back("the frames agree if " + meaning(reading));
    return out;
  }
  out.T_tracker_base.T = start.camera.T.inverse();
  out.T_flange_receiver.T = start.board.T;
  out.errors.resize(T_base_flange.size());
  refine_frames(T_base_flange, T_tracker_receiver, &out);
  if (out.status == CalibrationStatus::not_converged)
    out.message = "The refinement did not come to an end: look for test positions that are far off.";
  else
    out.message = "Tracker frame and receiver are known from " + std::to_string(T_base_flange.size()) +
                  " positions; usual error " + number(1e3 * out.position_sigma, 3) + " mm, " +
                  number(out.rotation_sigma / kDegree, 3) + " deg.";
  return out;
}

// ---- Tool -----------------------------------------------------------------------------------------------------------

ToolResult calibrate_tool(const ToolPoses& poses) {
  const std::size_t n = poses.pivot.size();
  if (n < 3)
    throw std::invalid_argument("the tool point needs three pivot poses or more, found " + std::to_string(n) +
                                ": put the tip on one point in at least three orientations");
  if (poses.orientation.size() != poses.prescribed.size())
    throw std::invalid_argument("there are " + std::to_string(poses.orientation.size()) + " orientation poses and " +
                                std::to_string(poses.prescribed.size()) + " prescribed orientations");
  ToolResult out;
  // R_i t + p_i = c: linear in tool point t and fixed point c.
  Eigen::MatrixXd A(3 * n, 6);
  Eigen::VectorXd b(3 * n);
  Matrix3d mean = Matrix3d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    if (!poses.pivot[i].matrix().allFinite())
      throw std::invalid_argument("pivot pose " + std::to_string(i) + " is not finite");
    A.block<3, 3>(row, 0) = poses.pivot[i].linear();
    A.block<3, 3>(row, 3) = -Matrix3d::Identity();
    b.segment<3>(row) = -poses.pivot[i].translation();
    mean += poses.pivot[i].linear() / static_cast<double>(n);
  }
  // What the poses turn by: the normal matrix of t alone is n (I - mean^T mean), zero along an axis they all share.
  const SymmetricEigen<3> spread = symmetric_eigen<3>(Matrix3d::Identity() - mean.transpose() * mean);
  if (spread.values[0] < kLeastTurn * kLeastTurn) {
    out.status = CalibrationStatus::not_observable;
    const Vector3d axis = spread.vectors.col(0);
    out.message = "The tool point is not observable along flange (" + number(axis.x(), 2) + ", " + number(axis.y(), 2) +
                  ", " + number(axis.z(), 2) +
                  "): tilt the tool by 30 deg or more about two axes while its tip stays on the point.";
    return out;
  }
  const Eigen::Matrix<double, 6, 6> normal = A.transpose() * A;
  const Vector6d x = solve_symmetric<6, 1>(normal, A.transpose() * b);
  const Eigen::VectorXd e = A * x - b;
  out.T_flange_tool.T.translation() = x.head<3>();
  out.point = x.tail<3>();
  const double variance = e.squaredNorm() / std::max(1.0, 3.0 * static_cast<double>(n) - 6.0);
  out.T_flange_tool.covariance.topLeftCorner<3, 3>() = variance * inverse_symmetric<6>(normal).topLeftCorner<3, 3>();
  for (std::size_t i = 0; i < n; ++i) out.pivot_error.push_back(e.segment<3>(static_cast<Eigen::Index>(3 * i)).norm());

  const std::size_t m = poses.orientation.size();
  if (m > 0) {
    Matrix3d sum = Matrix3d::Zero();
    for (std::size_t i = 0; i < m; ++i) sum += poses.orientation[i].linear().transpose() * poses.prescribed[i];
    const Matrix3d R = nearest_rotation(sum);
    out.T_flange_tool.T.linear() = R;
    double squares = 0.0;
    for (std::size_t i = 0; i < m; ++i) {
      const double angle =
          log_rotation(Quaterniond(R.transpose() * poses.orientation[i].linear().transpose() * poses.prescribed[i]))
              .norm();
      out.orientation_error.push_back(angle);
      squares += angle * angle;
    }
    // A single pose shows no scatter: then the covariance of the orientation is not known, and left zero.
    if (m > 1)
      out.T_flange_tool.covariance.bottomRightCorner<3, 3>() =
          squares / (3.0 * static_cast<double>(m - 1)) / static_cast<double>(m) * Matrix3d::Identity();
  }
  out.message = "The tool point is known from " + std::to_string(n) + " poses; scatter " +
                number(1e3 * std::sqrt(variance), 3) + " mm.";
  return out;
}

// ---- All together ---------------------------------------------------------------------------------------------------

TrackSetup assemble_setup(const FramesResult& frames, const ToolResult& tool, const InertialResult& inertial,
                          std::vector<std::string>* notes) {
  TrackSetup out;
  out.T_tracker_base = frames.T_tracker_base.T;
  out.T_flange_receiver = frames.T_flange_receiver.T;
  out.T_flange_tool = tool.T_flange_tool.T;
  out.T_flange_imu = frames.T_flange_receiver.T * inertial.T_receiver_imu.T;
  out.gravity = frames.T_tracker_base.T.linear().transpose() * inertial.gravity;
  out.clock_offset = inertial.clock_offset;
  out.clock_offset_sigma = inertial.clock_offset_sigma;
  out.gyro_bias = inertial.gyro_bias;
  out.accel_bias = inertial.accel_bias;
  out.gyro_bias_sigma = inertial.gyro_bias_sigma;
  out.accel_bias_sigma = inertial.accel_bias_sigma;
  if (notes) {
    const double tilt = std::acos(std::clamp(-out.gravity.z() / out.gravity.norm(), -1.0, 1.0));
    if (tilt > kDegree)
      notes->push_back(
          "gravity is " + number(tilt / kDegree, 3) +
          " deg from the base's -z: the base is not level, or its z does not point up; gravity as measured is used");
    if (inertial.tracker_up != "+z")
      notes->push_back("the tracker's axis " + inertial.tracker_up + " points up, not +z");
  }
  return out;
}

}  // namespace truing
