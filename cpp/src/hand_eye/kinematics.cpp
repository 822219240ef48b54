// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Hand-eye as identification: the robot's tool is the camera, measured in the frame of the board, or the board,
/// measured in that of the camera.

#include <cmath>
#include <numeric>
#include <stdexcept>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/errors.hpp"
#include "hand_eye/refine.hpp"
#include "math/frame.hpp"
#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing {
using namespace hand_eye;

namespace {

/// What identify is given: joints and poses as columns that this owns.
struct Table {
  Eigen::MatrixXd joints, position, orientation;
  Measurements measurements;
};

Column column(const Eigen::MatrixXd& m, Eigen::Index k) { return {m.col(k).data(), 1}; }

/// T_measurement_target of every pose. With the camera on the hand the target is a point where boards are, carried by
/// the camera: errors of the camera's view are small there, not at the camera.
void fill(const Eigen::MatrixXd& reading, const HandEyePoses& poses, const Frames& T_measurement_target, Table* table) {
  const auto n = static_cast<Eigen::Index>(T_measurement_target.size());
  table->joints = reading;
  table->position.resize(n, 3), table->orientation.resize(n, 4);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Isometry3d& T = T_measurement_target[static_cast<std::size_t>(i)];
    const Eigen::Quaterniond q(T.linear());
    table->position.row(i) = T.translation().transpose();
    table->orientation.row(i) << q.w(), q.x(), q.y(), q.z();
  }
  Measurements& m = table->measurements;
  m.rows = static_cast<std::size_t>(n);
  for (Eigen::Index k = 0; k < reading.cols(); ++k) m.joints.push_back(column(table->joints, k));
  for (Eigen::Index k = 0; k < 3; ++k) m.position[static_cast<std::size_t>(k)] = column(table->position, k);
  for (Eigen::Index k = 0; k < 4; ++k) m.orientation[static_cast<std::size_t>(k)] = column(table->orientation, k);
  m.set = poses.set.empty() ? std::vector<std::int8_t>(m.rows, 0) : poses.set;
}

/// Covariance of a frame's position and rotation vector; zero for what was held, absent where nothing of it was fitted.
Matrix6d frame_covariance(const Identification& found, const std::string& frame) {
  const char* const suffixes[6] = {".x", ".y", ".z", ".rx", ".ry", ".rz"};
  Eigen::Index at[6] = {-1, -1, -1, -1, -1, -1};
  Eigen::Index fitted = 0;
  for (const Parameter& p : found.parameters) {
    if (p.frozen) continue;
    for (int k = 0; k < 6; ++k)
      if (p.name == frame + suffixes[k]) at[k] = fitted;
    ++fitted;
  }
  Matrix6d C = Matrix6d::Zero();
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b)
      if (at[a] >= 0 && at[b] >= 0) C(a, b) = found.covariance(at[a], at[b]);
  return C;
}

/// T moved by d gives T F moved by this times d.
Matrix6d through(const Eigen::Isometry3d& T, const Eigen::Isometry3d& F) {
  Matrix6d J = Matrix6d::Identity();
  J.topRightCorner<3, 3>() = -cross_matrix(T.linear() * F.translation());
  return J;
}

/// T moved by d gives F T moved by this times d.
Matrix6d turned(const Eigen::Isometry3d& F) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = F.linear();
  return J;
}

/// T moved by d gives T^-1 moved by this times d.
Matrix6d inverted(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear().transpose();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = -R;
  J.topRightCorner<3, 3>() = -R * cross_matrix(T.translation());
  return J;
}

/// Where to start: hand-eye alone. A robot that is off is no reason to leave poses out.
HandEyeResult start_of(const HandEyePoses& poses, HandEyeOptions options) {
  options.reject = false;
  options.known_height.reset();
  HandEyeResult start = handeye(poses, options);
  if (start.status == HandEyeStatus::not_observable || start.status == HandEyeStatus::not_closing)
    throw std::invalid_argument(start.message);
  return start;
}

/// The robot whose tool is the camera, carried on to where boards are, or the board; and its base in the other's frame.
Robot nominal_robot(const Robot& robot, const HandEyeResult& start, const Eigen::Isometry3d& at_board, bool in_hand) {
  Robot out = robot;
  out.targets.resize(1);
  const Eigen::Isometry3d T_last_flange = robot.targets[0].T_last_target;
  out.targets[0].T_last_target = in_hand ? T_last_flange * start.camera.T * at_board : T_last_flange * start.board.T;
  out.T_measurement_base = (in_hand ? start.board.T : start.camera.T).inverse(Eigen::Isometry);
  out.anchor.reset();
  return out;
}

/// Both kinds of error weigh by what they turn out to be: 1 rad counts as the ratio of the two.
Identification identify_weighed(const Robot& nominal, const Measurements& measurements, IdentifyOptions options) {
  Identification found = identify(nominal, measurements, options);
  options.rotation_length = found.train.after.rms / found.train.after.rotation_rms;
  if (options.rotation_length > 0.0 && std::isfinite(options.rotation_length))
    found = identify(nominal, measurements, options);
  return found;
}

/// Camera and board from the tool and the base that were identified.
void find_frames(const Identification& found, const Eigen::Isometry3d& T_last_flange, const Eigen::Isometry3d& at_board,
                 bool in_hand, HandEyeKinematics* out) {
  const Eigen::Isometry3d T_flange_target =
      T_last_flange.inverse(Eigen::Isometry) * found.robot.targets[0].T_last_target;
  const Eigen::Isometry3d T_base_measurement = found.robot.T_measurement_base.inverse(Eigen::Isometry);
  const Matrix6d at_flange = turned(T_last_flange.inverse(Eigen::Isometry)),
                 from_base = inverted(found.robot.T_measurement_base);
  UncertainFrame on_hand{T_flange_target * at_board.inverse(Eigen::Isometry), Matrix6d::Zero()},
      in_base{T_base_measurement, Matrix6d::Zero()};
  const Matrix6d J = through(T_flange_target, at_board.inverse(Eigen::Isometry)) * at_flange;
  on_hand.covariance = J * frame_covariance(found, found.robot.targets[0].name) * J.transpose();
  in_base.covariance = from_base * frame_covariance(found, "base") * from_base.transpose();
  out->camera = in_hand ? on_hand : in_base;
  out->board = in_hand ? in_base : on_hand;
}

/// Closures with a robot, by what it predicts; `at_board` as above, identity for the board on the hand.
std::vector<HandEyeResidual> closures(const Robot& model, const Measurements& measurements, const HandEyePoses& poses,
                                      const Eigen::Isometry3d& at_board, bool in_hand) {
  const Prediction predicted = predict(model, measurements);
  std::vector<HandEyeResidual> residuals(poses.T_camera_board.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Quaterniond(predicted.orientation(row, 0), predicted.orientation(row, 1),
                                    predicted.orientation(row, 2), predicted.orientation(row, 3))
                     .toRotationMatrix();
    T.translation() = predicted.position.row(row).transpose();
    if (in_hand) T = at_board * T.inverse(Eigen::Isometry);  // the board in the camera
    const Vector6d e = closure(T, poses.T_camera_board[i]);
    residuals[i].position = residuals[i].position_left_out = e.head<3>().norm();
    residuals[i].rotation = residuals[i].rotation_left_out = e.tail<3>().norm();
  }
  return residuals;
}

}  // namespace

HandEyeKinematics handeye_with_kinematics(
    const Robot& robot, const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& reading,
    const HandEyePoses& poses, const HandEyeOptions& options, const IdentifyOptions& fit) {
  if (static_cast<std::size_t>(reading.rows()) != poses.T_camera_board.size())
    throw std::invalid_argument("there are " + std::to_string(reading.rows()) + " rows of joints and " +
                                std::to_string(poses.T_camera_board.size()) + " poses");
  if (robot.targets.empty())
    throw std::invalid_argument("the robot has no tool: give the flange, identity if it is the last link's frame");
  const bool in_hand = options.setup == HandEyeSetup::eye_in_hand;
  const HandEyeResult start = start_of(poses, options);
  Eigen::Isometry3d at_board = Eigen::Isometry3d::Identity();  // from the camera to where boards are
  if (in_hand) at_board.translation() = start.working_point;
  Frames measured;
  for (const Eigen::Isometry3d& B : poses.T_camera_board)
    measured.push_back(in_hand ? B.inverse(Eigen::Isometry) * at_board : B);
  Table table;
  fill(reading, poses, measured, &table);

  HandEyeKinematics out;
  out.working_point = start.working_point;
  out.identification = identify_weighed(nominal_robot(robot, start, at_board, in_hand), table.measurements, fit);
  const Identification& found = out.identification;
  find_frames(found, robot.targets[0].T_last_target, at_board, in_hand, &out);
  out.working_point_covariance = at_working_point(out.camera, out.working_point);

  Rows train, test;
  for (std::size_t i = 0; i < measured.size(); ++i) (table.measurements.set[i] != 0 ? test : train).push_back(i);
  const std::vector<HandEyeResidual> before = closures(found.before, table.measurements, poses, at_board, in_hand);
  out.residuals = closures(found.robot, table.measurements, poses, at_board, in_hand);
  for (const std::size_t i : found.rejected_rows) out.residuals[i].rejected = true;
  out.train_before = errors_of(before, train, false), out.train_after = errors_of(out.residuals, train, false);
  if (!test.empty())
    out.test_before = errors_of(before, test, false), out.test_after = errors_of(out.residuals, test, false);

  out.robot = found.robot;
  out.robot.targets = robot.targets;
  out.robot.T_measurement_base = Eigen::Isometry3d::Identity();
  return out;
}

}  // namespace truing
