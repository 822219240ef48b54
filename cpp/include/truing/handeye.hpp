// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "truing/common/uncertain_frame.hpp"
#include "truing/identify.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// Where the camera is. `hand` is the flange, `parent` the frame that carries the camera.
enum class HandEyeSetup {
  eye_in_hand,  ///< camera on the hand, board in the cell:  T_base_hand T_hand_camera T_camera_board = T_base_board
  eye_to_hand,  ///< camera in the cell, board on the hand:  T_base_hand T_hand_board = T_base_camera T_camera_board
};

enum class HandEyeMethod {
  refined,      ///< maximum likelihood: what was measured, robot poses and board poses (or pixels), each with its noise
  closed_form,  ///< dual quaternions and one SVD alone (Daniilidis 1999)
};

/// A pinhole camera with lens distortion k1 k2 p1 p2 k3 (plumb bob, as OpenCV counts them). Focal lengths and centre in
/// pixels.
struct Camera {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  std::array<double, 5> distortion{};
};

/// Pixel of a point in the camera frame [m]; z looks out of the lens, x to the right, y down.
Eigen::Vector2d project(const Camera& camera, const Eigen::Vector3d& point);

/// What one image shows: points of the board and where they were seen.
struct BoardImage {
  Eigen::Matrix3Xd points;  ///< in the board frame [m]
  Eigen::Matrix2Xd pixels;  ///< shape=(2, points)
};

/// One entry per robot pose. Messages count poses from 0.
struct HandEyePoses {
  std::vector<Eigen::Isometry3d> T_base_hand;     ///< as the controller reports it
  std::vector<Eigen::Isometry3d> T_camera_board;  ///< as the camera sees it
  std::vector<BoardImage> images;  ///< empty, or what T_camera_board was found from: then pixels are what was measured
  std::optional<Camera> camera;    ///< needed with images
  std::vector<std::int8_t> set;    ///< 0 fit, 1 held out; empty: all fit
  /// Turns of the board after which it looks the same, T_board_turned without the identity: an image may have been read
  /// in any of them.
  std::vector<Eigen::Isometry3d> board_symmetries;
};

constexpr double kEstimate = std::numeric_limits<double>::quiet_NaN();  ///< a noise that is to be found from the data

struct HandEyeOptions {
  HandEyeSetup setup = HandEyeSetup::eye_in_hand;
  HandEyeMethod method = HandEyeMethod::refined;
  // Standard deviations of one component. What is not given is estimated. Position noise of hand and board poses adds
  // up: give both, or neither.
  double hand_position_sigma = kEstimate;    ///< [m] of the reported robot pose
  double hand_rotation_sigma = kEstimate;    ///< [rad]
  double camera_position_sigma = kEstimate;  ///< [m] of the board pose; without images
  double camera_rotation_sigma = kEstimate;  ///< [rad]
  double pixel_sigma = kEstimate;            ///< [px] with images
  bool refine_camera = false;                ///< with images: focal lengths, centre and distortion are found as well
  std::optional<Eigen::Vector3d>
      working_point;  ///< in the camera frame [m]: where accuracy is asked for; absent: mean of the board positions
  /// Where all rotation axes are parallel: the camera's coordinate along that axis, in the frame that carries the
  /// camera [m].
  std::optional<double> known_height;
  double known_height_sigma = 0.0;  ///< [m]
  bool reject = true;               ///< find poses that do not fit the others, list them, go on without
  double reject_beyond = 3.0;       ///< poses whose root mean square of six standardised residuals is larger
  bool recognise =
      true;  ///< where the loop does not close: try other readings of the same numbers, and name the one that closes
  std::string reading;  ///< use the poses in this other reading, a name of `handeye_readings`; empty: as given
  int max_iterations = 50;

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// How far a pose is from closing the loop: seen minus predicted board pose, lengths of the vectors.
struct HandEyeResidual {
  double position = 0.0;  ///< [m]
  double rotation = 0.0;  ///< [rad]
  double position_left_out =
      0.0;  ///< [m] when the pose is left out of the fit (held-out poses: the same as `position`)
  double rotation_left_out = 0.0;       ///< [rad]
  double pixels = kEstimate;            ///< rms [px] with the robot pose as reported; NaN without images
  double pixels_corrected = kEstimate;  ///< rms [px] with the robot pose as found
  double distance = 0.0;                ///< root mean square of its six standardised residuals; about 1
  bool rejected = false;
  std::string cause;  ///< of a rejected pose: what it looks like
};

struct HandEyeErrors {
  double position_rms = kEstimate, position_mean = kEstimate, position_p95 = kEstimate,
         position_max = kEstimate;  ///< [m]
  double rotation_rms = kEstimate;  ///< [rad]
  double pixel_rms = kEstimate;     ///< [px] NaN without images
  std::size_t n = 0;
};

/// Why the motions cannot show it.
enum class UnobservableReason {
  no_rotation,  ///< the hand moved without turning
  one_axis,     ///< all rotations are about one axis: the camera's coordinate along it
  large_error,  ///< the standard error is too large to be an answer
  singular,     ///< camera and board can move together without opening the loop
};

/// What the motions cannot show.
struct Unobservable {
  UnobservableReason reason = UnobservableReason::singular;
  std::string what;                                     ///< "the camera's position along base z"
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< unit vector in the frame that carries the camera
  bool rotation = false;                                ///< about the direction, not along it
  double sigma = kEstimate;                             ///< [m] or [rad]; infinite: not at all
  std::string advice;                                   ///< what to do
};

/// Another reading of the numbers: what it would mean, and how well the loop then closes.
struct Reading {
  std::string name;           ///< to be given as HandEyeOptions::reading; empty: as given
  std::string explanation;    ///< "hand poses are base in hand (inverted)"
  double position_rms = 0.0;  ///< [m] median closure
  double rotation_rms = 0.0;  ///< [rad]
};

/// What a warning is about.
enum class HandEyeConcernKind {
  not_like_noise,     ///< plain weights predict poses left out to `value`, the noise that was found to `reference` [m]
  beyond_pixels,      ///< boards scatter by `value` [rad], `reference` times what their pixels can tell
  noise_of_one_side,  ///< position noise was given of hand or board alone: it was not used
  noise_too_small,    ///< poses scatter by `value` times the noise that was given
  board_scale,        ///< the loop closes best with lengths of board poses times `value`, standard error `reference`
  behind_camera,      ///< `value` of `reference` boards are not in front of the camera
};
struct HandEyeConcern {
  HandEyeConcernKind kind;
  double value = kEstimate, reference = kEstimate;
};

enum class HandEyeStatus {
  done,
  not_observable,  ///< `unobservable` says which directions, and what to do
  not_closing,     ///< the loop does not close; `readings` has the one that does, if any
  not_converged,
};

/// Standard deviations of one component, as given or as found. Position noise of hand and board poses adds up: data see
/// the sum alone.
struct HandEyeNoise {
  double position = 0.0;               ///< [m] of hand and board pose together; with images of the hand alone
  double hand_rotation = 0.0;          ///< [rad]
  double camera_rotation = kEstimate;  ///< [rad] of board poses; with images what is beyond their pixels' noise
  double pixel = kEstimate;            ///< [px] with images
  bool estimated = false;              ///< any of them
};

struct HandEyeResult {
  HandEyeStatus status = HandEyeStatus::done;
  std::string message;  ///< one sentence
  /// What the user should know or do: a board of another size, a robot that is off, noise given too small …
  std::vector<std::string> warnings;
  std::vector<HandEyeConcern> concerns;  ///< what each warning is about: for programs, which must not go by its text
  UncertainFrame
      camera;  ///< T_parent_camera: in the hand (eye in hand) or in the base. Only with status done or not_converged
  UncertainFrame board;  ///< T_parent_board: in the base (eye in hand) or in the hand
  Eigen::Vector3d working_point = Eigen::Vector3d::Zero();  ///< in the camera frame [m]
  Eigen::Matrix3d working_point_covariance =
      Eigen::Matrix3d::Zero();  ///< of that point in the frame that carries the camera [m^2]
  HandEyeNoise noise;
  std::vector<HandEyeResidual> residuals;  ///< one per pose
  HandEyeErrors train, left_out;      ///< poses fitted; the same, each predicted without itself. Without rejected ones
  std::optional<HandEyeErrors> test;  ///< held-out poses, all of them
  std::vector<std::size_t> rejected;
  std::vector<Unobservable> unobservable;
  Eigen::Matrix<double, 8, 1> singular_values =
      Eigen::Matrix<double, 8, 1>::Zero();  ///< of the motions' equations, lengths in units of `length_scale`
  double singular_gap = 0.0;                ///< sixth over seventh: how clearly two null vectors stand out
  double axes_spread = 0.0;  ///< second over first principal rotation of the motions: 0 one axis, 1 two equal
  double board_scale = 1.0,
         board_scale_sigma = kEstimate;        ///< factor on the board's lengths that would fit best; 1: as given
  Reading as_given;                            ///< closure of the poses as they are; not_closing only
  std::vector<Reading> readings;               ///< other readings that close, best first; not_closing only
  std::vector<int> symmetry;                   ///< per pose: which of board_symmetries (1 …) it was read in; 0 as given
  std::optional<Camera> camera_model;          ///< as refined
  std::vector<double> camera_model_sigma;      ///< of fx fy cx cy k1 k2 p1 p2 k3
  std::vector<Eigen::Isometry3d> T_base_hand;  ///< robot poses as found, of fitted poses; as reported elsewhere
  SolverSummary solver;
};

/// Finds where the camera is, from poses of the hand and of a board that the camera sees.
///
/// Dual quaternions of the motions, one SVD (Daniilidis 1999), a deterministic search for the poses that agree, then
/// maximum likelihood with both noises. Throws std::invalid_argument on data that cannot be used: fewer than three
/// poses, unequal lengths, values that are not finite. Whatever the data cannot answer is a status with a message,
/// never a number.
HandEyeResult handeye(const HandEyePoses& poses, const HandEyeOptions& options = {});

/// The dual-quaternion solution alone, in its parts.
struct ClosedForm {
  Eigen::Isometry3d T_parent_camera = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_parent_board = Eigen::Isometry3d::Identity();
  Eigen::Matrix<double, 8, 1> singular_values = Eigen::Matrix<double, 8, 1>::Zero();
  double length_scale = 1.0;  ///< [m] the unit of length in the equations
  double residual = 0.0;      ///< of the unit dual quaternion in the equations, per motion
  double axes_spread = 0.0;   ///< as in HandEyeResult
  double rotation = 0.0;      ///< [rad] rms angle of the motions
  std::size_t motions = 0;
};

/// Takes the poses as they are: whether the loop closes with them is for `handeye` to say, with
/// HandEyeMethod::closed_form. Throws std::invalid_argument as `handeye` does, and where the motions do not show the
/// camera's position (one axis of rotation, or none).
ClosedForm handeye_closed_form(const HandEyePoses& poses, HandEyeSetup setup);

/// All readings that `handeye` tries, in the order tried; closures are not set.
std::vector<Reading> handeye_readings();

/// What hand, camera and board are called: with a tracker instead of a camera they have other names.
struct HandEyeNouns {
  std::string hand = "hand", camera = "camera", board = "board";
};

/// What a reading would mean, or several joined by "+". Throws std::invalid_argument that lists the names there are.
std::string explain_reading(const std::string& name, const HandEyeNouns& nouns = {});

/// A robot pose that would help.
struct NextHandPose {
  Eigen::Isometry3d T_base_hand = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_camera_board = Eigen::Isometry3d::Identity();  ///< what the camera is expected to see
  double working_point_sigma = 0.0;  ///< [m] standard error of the working point per axis (rms over three), this pose
                                     ///< and those before it measured
};

struct HandEyePlanOptions {
  int poses = 5;
  int candidates = 400;              ///< tried for each
  double tilt = 0.7853981633974483;  ///< [rad] the board is seen at no more than this from its normal, beyond what was
                                     ///< seen (45 deg)
  double reach = 0.15;               ///< [m] hands stay this close to a measured one
  std::uint64_t seed = 0;
};

/// Poses, one after the other, that shrink the covariance of the working point most. Board in view is judged by the
/// camera model where there is one, else by the directions in which boards were seen.
std::vector<NextHandPose> handeye_plan(const HandEyePoses& poses, const HandEyeResult& result,
                                       const HandEyeOptions& options = {}, const HandEyePlanOptions& plan = {});

/// Two records of the same motion by two clocks.
struct ClockOffset {
  double offset = 0.0;       ///< [s] t_hand = t_camera + offset
  double sigma = 0.0;        ///< [s]
  double correlation = 0.0;  ///< of the two angular speeds at that offset
  bool found = false;
  std::string message;                         ///< why not, or how sure
  std::vector<std::size_t> rows;               ///< camera rows inside the hand's record
  std::vector<Eigen::Isometry3d> T_base_hand;  ///< hand poses at the times of those rows
};

/// Angular speeds of hand and board are equal whatever the frames; the offset makes them agree, then the loop closes
/// best. Times in s, increasing. Throws std::invalid_argument.
ClockOffset handeye_clock(const std::vector<double>& hand_time, const std::vector<Eigen::Isometry3d>& T_base_hand,
                          const std::vector<double>& camera_time, const std::vector<Eigen::Isometry3d>& T_camera_board,
                          HandEyeSetup setup, double search = 10.0);

/// Hand-eye, board mount and the robot's own parameters in one problem.
struct HandEyeKinematics {
  Identification identification;  ///< of the robot whose tool is the camera (eye in hand) or the board, measured in the
                                  ///< frame of the other
  Robot robot;                    ///< calibrated, its tool the flange as given, its base the origin
  UncertainFrame camera, board;   ///< as in HandEyeResult, for the calibrated robot
  Eigen::Vector3d working_point = Eigen::Vector3d::Zero();             ///< in the camera frame [m]
  Eigen::Matrix3d working_point_covariance = Eigen::Matrix3d::Zero();  ///< [m^2]
  HandEyeErrors train_before, train_after;  ///< closures with the robot as it was, base and tool fitted, and as found
  std::optional<HandEyeErrors> test_before, test_after;
  std::vector<HandEyeResidual> residuals;  ///< with the robot as found; nothing is left out
};

/// `reading`: driven joints in chain order [rad | m], shape=(poses, driven joints). The hand is the robot's tool as
/// given: T_base_hand of `poses` is not used but to start from. `fit` as for `identify`; base and tool stand for camera
/// and board. Errors are taken at the board, where 1 rad counts as fit.rotation_length first, and then as the length by
/// which the two kinds of error turn out to differ. Throws std::invalid_argument as `handeye` and `identify` do.
HandEyeKinematics handeye_with_kinematics(
    const Robot& robot, const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& reading,
    const HandEyePoses& poses, const HandEyeOptions& options = {}, const IdentifyOptions& fit = {});

}  // namespace truing
