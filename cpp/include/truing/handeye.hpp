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
  /// T_base_hand T_hand_camera T_camera_board = T_base_board
  eye_in_hand,  ///< "eye-in-hand": camera on the hand, board in the cell
  /// T_base_hand T_hand_board = T_base_camera T_camera_board
  eye_to_hand,  ///< "eye-to-hand": camera in the cell, board on the hand
};

enum class HandEyeMethod {
  refined,      ///< maximum likelihood: what was measured, robot poses and board poses (or pixels), each with its noise
  closed_form,  ///< "closed-form": dual quaternions and one SVD alone (Daniilidis 1999)
};

/// A pinhole camera with lens distortion k1 k2 p1 p2 k3 (plumb bob, as OpenCV counts them). Focal lengths and centre in
/// pixels.
struct Camera {
  int width = 0, height = 0;                      ///< [px]
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [px]
  std::array<double, 5> distortion{};             ///< k1 k2 p1 p2 k3
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

/// How `handeye` works. Sigmas are standard deviations of one component; those that are not given are estimated.
struct HandEyeOptions {
  HandEyeSetup setup = HandEyeSetup::eye_in_hand;  ///< where the camera is
  HandEyeMethod method = HandEyeMethod::refined;   ///< how the frames are found
  /// [m] of the reported robot positions. Position noise of hand and board poses adds up: give both, or neither.
  double hand_position_sigma = kEstimate;
  double hand_rotation_sigma = kEstimate;    ///< [rad] of the reported robot rotations
  double camera_position_sigma = kEstimate;  ///< [m] of the board's positions, without images
  double camera_rotation_sigma = kEstimate;  ///< [rad] of the board's rotations, without images
  double pixel_sigma = kEstimate;            ///< [px] of the board's points, with images
  bool refine_camera = false;                ///< with images: focal lengths, centre and distortion are found as well
  /// shape=(3,) [m] in the camera frame: where accuracy is asked for; not given: the mean of the board's positions.
  std::optional<Eigen::Vector3d> working_point;
  /// [m] where all rotation axes are parallel: the camera's coordinate along that axis, in the frame that carries the
  /// camera.
  std::optional<double> known_height;
  double known_height_sigma = 0.0;  ///< [m] standard deviation of `known_height`
  bool reject = true;               ///< find poses that do not fit the others, list them, go on without
  double reject_beyond = 3.0;       ///< poses whose root mean square of six standardised residuals is larger
  /// Where the loop does not close: try other readings of the same numbers, and name the one that closes.
  bool recognise = true;
  std::string reading;  ///< use the poses in this other reading, a name of `handeye_readings`; empty: as given
  /// The fit stops here at the latest: which noise is whose may take hundreds of short steps to find from few poses.
  int max_iterations = 1000;

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

/// How far a pose is from closing the loop: seen minus predicted board pose.
struct HandEyeResidual {
  double position = 0.0;  ///< [m] length
  double rotation = 0.0;  ///< [rad] angle
  /// [m] when the pose is left out of the fit, of the lens too where that was found from the images (held-out poses:
  /// the same as `position`). NaN where the other poses do not hold the answer.
  double position_left_out = 0.0;
  double rotation_left_out = 0.0;       ///< [rad] likewise
  double pixels = kEstimate;            ///< [px] rms with the robot pose as reported; NaN without images
  double pixels_corrected = kEstimate;  ///< [px] rms with the robot pose as found; NaN without images
  double distance = 0.0;                ///< root mean square of its six standardised residuals; about 1
  bool rejected = false;                ///< left out of the fit
  std::string cause;                    ///< of a rejected pose: what it looks like
};

/// Closure of the loop over a set of poses.
struct HandEyeErrors {
  double position_rms = kEstimate;   ///< [m]
  double position_mean = kEstimate;  ///< [m]
  double position_p95 = kEstimate;   ///< [m] 95th percentile
  double position_max = kEstimate;   ///< [m]
  double rotation_rms = kEstimate;   ///< [rad]
  double pixel_rms = kEstimate;      ///< [px] NaN without images
  std::size_t n = 0;                 ///< number of poses
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
  UnobservableReason reason = UnobservableReason::singular;  ///< why, for programs
  std::string what;                                          ///< in words: "the camera's position along base z"
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();       ///< shape=(3,): unit vector in the frame with the camera
  bool rotation = false;                                     ///< about the direction, not along it
  double sigma = kEstimate;                                  ///< [m] or [rad]; infinite: not at all
  std::string advice;                                        ///< what to do
};

/// Another reading of the numbers: what it would mean, and how well the loop then closes.
struct Reading {
  /// To be given as `reading`; empty: as given. "other-setup": the set-up is to be given as the other one.
  std::string name;
  std::string explanation;    ///< in words: 'hand poses are base in hand (inverted)'
  double position_rms = 0.0;  ///< [m] median closure
  double rotation_rms = 0.0;  ///< [rad]
  bool other_setup = false;   ///< it is about the set-up: camera and board are in each other's place
};

/// What a warning is about.
enum class HandEyeConcernKind {
  not_like_noise,     ///< plain weights predict poses left out to `value`, the noise that was found to `reference` [m]
  beyond_pixels,      ///< boards scatter by `value` [rad], `reference` times what their pixels can tell
  noise_of_one_side,  ///< position noise was given of hand or board alone: it was not used
  noise_too_small,    ///< poses scatter by `value` times the noise that was given
  board_scale,        ///< the loop closes best with lengths of board poses times `value`, standard error `reference`
  other_lens,         ///< pixels scatter by `value` [px] with the lens as given, by `reference` with one that fits them
  behind_camera,      ///< `value` of `reference` boards are not in front of the camera
};
/// What a warning is about, with its numbers.
struct HandEyeConcern {
  HandEyeConcernKind kind;       ///< what it is
  double value = kEstimate;      ///< as `kind` says
  double reference = kEstimate;  ///< as `kind` says
};

enum class HandEyeStatus {
  done,
  not_observable,  ///< "not observable": `unobservable` says which directions, and what to do
  not_closing,     ///< "not closing": the loop does not close; `readings` has the one that does, if any
  not_converged,   ///< "not converged"
};

/// Standard deviations of one component, as given or as found. Position noise of hand and board poses adds up: data see
/// the sum alone.
struct HandEyeNoise {
  double position = 0.0;               ///< [m] of hand and board pose together; with images of the hand alone
  double hand_rotation = 0.0;          ///< [rad]
  double camera_rotation = kEstimate;  ///< [rad] of board poses; with images what is beyond their pixels' noise
  double pixel = kEstimate;            ///< [px] NaN without images
  bool estimated = false;              ///< any of them was estimated from the data
};

/// What `handeye` found.
struct HandEyeResult {
  HandEyeStatus status = HandEyeStatus::done;  ///< whether there is a result, and why not
  std::string message;                         ///< one sentence
  /// What to know or do: a board of another size, a robot that is off, noise given too small …
  std::vector<std::string> warnings;
  std::vector<HandEyeConcern> concerns;  ///< what each warning is about, for programs, which must not go by its text
  /// T_parent_camera, in the hand (eye in hand) or in the base; only with status `done` or `not converged`.
  UncertainFrame camera;
  UncertainFrame board;  ///< T_parent_board, in the base (eye in hand) or in the hand
  /// shape=(6,): an interval of `camera` is its standard error times the quantile of Student's t of so many degrees of
  /// freedom, in the order of its covariance; infinite: the noise was given, and the quantile is the normal one.
  Eigen::Matrix<double, 6, 1> camera_degrees_of_freedom =
      Eigen::Matrix<double, 6, 1>::Constant(std::numeric_limits<double>::infinity());
  /// shape=(6,): the same of `board`
  Eigen::Matrix<double, 6, 1> board_degrees_of_freedom =
      Eigen::Matrix<double, 6, 1>::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d working_point = Eigen::Vector3d::Zero();  ///< shape=(3,) [m] in the camera frame
  /// shape=(3, 3) [m^2] of that point in the frame that carries the camera.
  Eigen::Matrix3d working_point_covariance = Eigen::Matrix3d::Zero();
  HandEyeNoise noise;                      ///< as given or estimated
  std::vector<HandEyeResidual> residuals;  ///< one per pose
  HandEyeErrors train;                     ///< poses fitted, without rejected ones
  HandEyeErrors left_out;                  ///< the same, each predicted without itself; NaN where one cannot be
  std::optional<HandEyeErrors> test;       ///< held-out poses, all of them, if any
  std::vector<std::size_t> rejected;       ///< poses (counted from 0) that do not fit the others
  std::vector<Unobservable> unobservable;  ///< what the motions cannot show
  /// shape=(8,), of the motions' equations, descending, lengths in units of the closed form's `length_scale`.
  Eigen::Matrix<double, 8, 1> singular_values = Eigen::Matrix<double, 8, 1>::Zero();
  double singular_gap = 0.0;  ///< sixth over seventh singular value: how clearly two null vectors stand out
  double axes_spread = 0.0;   ///< second over first principal rotation of the motions: 0 one axis, 1 two alike
  /// Factor on the board's lengths that would fit best; 1: as given. With status `not closing` the loop closes with it.
  double board_scale = 1.0;
  double board_scale_sigma = kEstimate;    ///< standard error of `board_scale`; NaN: not known
  Reading as_given;                        ///< closure of the poses as they are; with status `not closing` alone
  std::vector<Reading> readings;           ///< other readings that close, best first; with status `not closing` alone
  std::vector<int> symmetry;               ///< per pose: which of board_symmetries (1 …) it was read in; 0: as given
  std::optional<Camera> camera_model;      ///< as refined, if it was
  std::vector<double> camera_model_sigma;  ///< standard errors of fx fy cx cy [px] k1 k2 p1 p2 k3
  std::vector<Eigen::Isometry3d> T_base_hand;  ///< shape=(n, 4, 4): fitted poses as found, others as reported
  SolverSummary solver;                        ///< how the solver ended
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
  /// shape=(4, 4): in the hand (eye in hand) or in the base.
  Eigen::Isometry3d T_parent_camera = Eigen::Isometry3d::Identity();
  /// shape=(4, 4): in the base (eye in hand) or in the hand.
  Eigen::Isometry3d T_parent_board = Eigen::Isometry3d::Identity();
  /// shape=(8,), descending; of exact data the last two are 0.
  Eigen::Matrix<double, 8, 1> singular_values = Eigen::Matrix<double, 8, 1>::Zero();
  double length_scale = 1.0;  ///< [m] the unit of length in the equations
  double residual = 0.0;      ///< of the unit dual quaternion in the equations, per motion
  double axes_spread = 0.0;   ///< second over first principal rotation of the motions: 0 one axis, 1 two alike
  double rotation = 0.0;      ///< [rad] rms angle of the motions
  std::size_t motions = 0;    ///< number of motions used
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
  Eigen::Isometry3d T_base_hand = Eigen::Isometry3d::Identity();  ///< shape=(4, 4)
  Eigen::Isometry3d T_camera_board =
      Eigen::Isometry3d::Identity();  ///< shape=(4, 4): what the camera is expected to see
  /// [m] standard error of the working point per axis (rms over three), with this pose and those before it measured.
  double working_point_sigma = 0.0;
};

/// How `handeye_plan` chooses.
struct HandEyePlanOptions {
  int count = 5;         ///< number of poses
  int candidates = 400;  ///< candidates tried for each
  /// [rad] the board is seen at no more than this from its normal, beyond what was seen (45 deg).
  double tilt = 0.7853981633974483;
  double reach = 0.15;     ///< [m] hands stay this close to a measured one
  std::uint64_t seed = 0;  ///< of the candidates
};

/// Poses, one after the other, that shrink the covariance of the working point most. Board in view is judged by the
/// camera model where there is one, else by the directions in which boards were seen.
std::vector<NextHandPose> handeye_plan(const HandEyePoses& poses, const HandEyeResult& result,
                                       const HandEyeOptions& options = {}, const HandEyePlanOptions& plan = {});

/// Two records of the same motion by two clocks.
struct ClockOffset {
  double offset = 0.0;                         ///< [s] t_hand = t_camera + offset
  double sigma = 0.0;                          ///< [s]
  double correlation = 0.0;                    ///< of the two angular velocities, smoothed, at that offset
  bool found = false;                          ///< false: `message` says why
  std::string message;                         ///< why not, or how sure
  std::vector<std::size_t> rows;               ///< camera rows (counted from 0) inside the hand's record
  std::vector<Eigen::Isometry3d> T_base_hand;  ///< shape=(rows, 4, 4): hand poses at the times of those rows
};

/// Angular velocities of hand and board differ by one turn, that between their frames: they are smoothed until noise is
/// a small share, then the offset is looked for at which they agree, and that at which the loop closes best. Not found
/// where other offsets are nearly as likely, or the loop stays open. Times in s, increasing. Throws
/// std::invalid_argument.
ClockOffset handeye_clock(const std::vector<double>& hand_time, const std::vector<Eigen::Isometry3d>& T_base_hand,
                          const std::vector<double>& camera_time, const std::vector<Eigen::Isometry3d>& T_camera_board,
                          HandEyeSetup setup, double search = 10.0);

/// What `handeye_with_kinematics` found: hand-eye, board mount and the robot's own parameters.
struct HandEyeKinematics {
  /// Of the robot whose tool is the camera (eye in hand) or the board, measured in the frame of the other.
  Identification identification;
  /// Calibrated, its tool the flange as given, its base the origin; part of this result: copy it before changing it.
  Robot robot;
  UncertainFrame camera;                                    ///< as in `HandEyeResult`, of the calibrated robot
  UncertainFrame board;                                     ///< as in `HandEyeResult`, of the calibrated robot
  Eigen::Vector3d working_point = Eigen::Vector3d::Zero();  ///< shape=(3,) [m] in the camera frame
  /// shape=(3, 3) [m^2] of that point in the frame that carries the camera.
  Eigen::Matrix3d working_point_covariance = Eigen::Matrix3d::Zero();
  HandEyeErrors train_before;                ///< closure with the robot as it was, base and tool fitted
  HandEyeErrors train_after;                 ///< closure with the calibrated robot
  std::optional<HandEyeErrors> test_before;  ///< the same of held-out poses, if any
  std::optional<HandEyeErrors> test_after;   ///< the same of held-out poses, if any
  std::vector<HandEyeResidual> residuals;    ///< one per pose, with the calibrated robot; none is left out
};

/// `reading`: driven joints in chain order [rad | m], shape=(poses, driven joints). The hand is the robot's tool as
/// given: T_base_hand of `poses` is not used but to start from. `fit` as for `identify`; base and tool stand for camera
/// and board. Errors are taken at the board, where 1 rad counts as fit.rotation_length first, and then as the length by
/// which the two kinds of error turn out to differ. Throws std::invalid_argument as `handeye` and `identify` do.
HandEyeKinematics handeye_with_kinematics(
    const Robot& robot, const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>& reading,
    const HandEyePoses& poses, const HandEyeOptions& options = {}, const IdentifyOptions& fit = {});

}  // namespace truing
