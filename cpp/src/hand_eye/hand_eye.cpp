// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "truing/handeye.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/consensus.hpp"
#include "hand_eye/errors.hpp"
#include "hand_eye/images.hpp"
#include "hand_eye/left_out.hpp"
#include "hand_eye/lengths.hpp"
#include "hand_eye/readings.hpp"
#include "hand_eye/refine.hpp"
#include "hand_eye/small_sample.hpp"
#include "hand_eye/words.hpp"
#include "math/constants.hpp"
#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "rooms.hpp"

namespace truing {
using namespace hand_eye;

namespace {

constexpr double kLeastRotation =
    1e-6;                               // [rad] axes about which motions turn less than this do not count, noise or not
constexpr double kOverNoise = 3.0;      // and no less than so many times the noise of the angles
constexpr double kLargestNoise = 0.01;  // [rad] angle noise beyond this is a wrong reading, not noise
constexpr double kDoubtful =
    0.02;  // closures beyond this, rad or fractions of the motion's size, make us try other readings
constexpr double kHopeless = 0.2;    // and beyond this nothing is said
constexpr double kScattered = 0.05;  // [rad] no robot and no camera turn by so much as noise: motions are not to blame
constexpr double kWidest = 0.1;      // standard errors beyond this fraction of the distance, or rad, are not an answer
constexpr double kExact = 1e-8;      // [m], [rad] closures below this are rounding, not noise
constexpr double kBeyondPixels = 3.0;  // times what pixels can tell of a board's orientation: more is not theirs
constexpr double kEvidence = 4.0;      // and in log likelihood over a robot that turns: what says less is the robot's
constexpr double kOtherLens = 1.5;     // times the variance of pixels with the lens that fits them best is said
constexpr double kFinest = 1e-3;       // [px] no camera sees better
constexpr double kCertainLens = 10.0;  // and so many times what noise alone gains by a lens (F ratio)
constexpr double kBentLens = 1.2;  // a lens whose pixels scatter with no more than this times the variance fits as well
constexpr int kRejectRounds = 10;
constexpr double kCertainScale = 4.0;  // standard errors from 1: a factor on the board's lengths is said
constexpr double kLikelyScale = 2.5;   // said where the loop then closes to kScaledCloses of the closure as given
constexpr double kScaledCloses = 0.8;
constexpr double kLeastScale = 0.002;  // and no smaller one
constexpr double kPlainGain =
    16.0;  // over the poses: by how much more plain weights must predict better, as a fraction

// ---- Checks --------------------------------------------------------------------------------------------------------

void check_frame(const Eigen::Isometry3d& T, const char* what, std::size_t i) {
  const auto fail = [&](const std::string& why) {
    throw std::invalid_argument(std::string(what) + " of pose " + std::to_string(i) + " " + why);
  };
  if (!T.matrix().allFinite()) fail("is not finite");
  if ((T.linear() * T.linear().transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-6)
    fail("is not a rotation: its axes are not orthogonal unit vectors");
  if (T.linear().determinant() < 0.0) fail("is left-handed: its determinant is -1");
}

void check(const HandEyePoses& poses) {
  const std::size_t n = poses.T_base_hand.size();
  const auto same = [&](std::size_t count, const char* what) {
    if (count != n)
      throw std::invalid_argument(std::string("there are ") + std::to_string(n) + " hand poses and " +
                                  std::to_string(count) + " " + what);
  };
  same(poses.T_camera_board.size(), "board poses");
  if (!poses.images.empty()) same(poses.images.size(), "images");
  if (!poses.set.empty()) same(poses.set.size(), "entries of set");
  if (!poses.images.empty() && !poses.camera) throw std::invalid_argument("images need a camera model");
  for (std::size_t i = 0; i < n; ++i) {
    check_frame(poses.T_base_hand[i], "the hand", i), check_frame(poses.T_camera_board[i], "the board", i);
    if (poses.images.empty()) continue;
    const BoardImage& image = poses.images[i];
    if (image.points.cols() != image.pixels.cols() || image.points.cols() < 4)
      throw std::invalid_argument("image " + std::to_string(i) + " has " + std::to_string(image.points.cols()) +
                                  " points and " + std::to_string(image.pixels.cols()) +
                                  " pixels; needed are as many of each, 4 or more");
    if (!image.points.allFinite() || !image.pixels.allFinite())
      throw std::invalid_argument("image " + std::to_string(i) + " is not finite");
  }
  for (std::size_t k = 0; k < poses.board_symmetries.size(); ++k)
    check_frame(poses.board_symmetries[k], "board_symmetries", k);
}

Rows rows_of(const HandEyePoses& poses, bool test) {
  Rows rows;
  for (std::size_t i = 0; i < poses.T_base_hand.size(); ++i)
    if ((!poses.set.empty() && poses.set[i] != 0) == test) rows.push_back(i);
  return rows;
}

void check_rows(const HandEyePoses& poses, const Rows& rows) {
  if (rows.size() < 3)
    throw std::invalid_argument("hand-eye needs three poses or more to fit, found " + std::to_string(rows.size()) +
                                ": move the hand to at least three that differ in orientation about two axes");
  const auto equal = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    return (a.matrix() - b.matrix()).norm() < 1e-12;
  };
  if (std::all_of(rows.begin(), rows.end(),
                  [&](std::size_t i) { return equal(poses.T_base_hand[i], poses.T_base_hand[rows[0]]); }))
    throw std::invalid_argument("all hand poses are equal: the robot has not moved, or its pose was not read anew");
  if (std::all_of(rows.begin(), rows.end(),
                  [&](std::size_t i) { return equal(poses.T_camera_board[i], poses.T_camera_board[rows[0]]); }))
    throw std::invalid_argument("all board poses are equal: the camera's result was not read anew");
}

// ---- Degenerate motions --------------------------------------------------------------------------------------------

Eigen::Vector3d with_positive_largest(Eigen::Vector3d d) {
  Eigen::Index k = 0;
  d.cwiseAbs().maxCoeff(&k);
  return d(k) < 0.0 ? Eigen::Vector3d(-d) : d;
}

void refuse(HandEyeResult* result) {
  result->status = HandEyeStatus::not_observable;
  result->message = unobservable_message(result->unobservable);
}

/// Motions without two axes of rotation. Nothing found: the axis, where there is one only.
void look_at_axes(const CameraSolution& all, const HandEyeOptions& options, HandEyeResult* result,
                  std::optional<Eigen::Vector3d>* axis) {
  const double noise = std::max(kLeastRotation, kOverNoise * std::min(all.incongruence, kLargestNoise));
  if (all.principal_rotations(0) < noise) {
    for (int k = 0; k < 3; ++k)
      result->unobservable.push_back(
          unobservable(UnobservableReason::no_rotation, Eigen::Vector3d::Unit(k), options.setup));
    return refuse(result);
  }
  if (all.principal_rotations(1) >= noise) return;
  *axis = with_positive_largest(all.principal_axes.col(0));
  if (options.known_height) return;
  result->unobservable.push_back(unobservable(UnobservableReason::one_axis, **axis, options.setup));
  refuse(result);
}

void look_at_motions(const CameraSolution& solution, HandEyeResult* result) {
  result->singular_values = solution.singular_values;
  result->singular_gap = solution.singular_values(5) / std::max(solution.singular_values(6), 1e-300);
  result->axes_spread = solution.principal_rotations(1) / std::max(solution.principal_rotations(0), 1e-300);
}

/// Directions of the camera's position and orientation that stay too wide to be an answer.
void look_at_errors(const HandEyeOptions& options, double distance, HandEyeResult* result) {
  const auto look = [&](const Eigen::Matrix3d& C, bool rotation, double limit) {
    const SymmetricEigen<3> eigen = symmetric_eigen<3>(C);
    for (int k = 2; k >= 0; --k) {
      const double sigma = std::sqrt(std::max(0.0, eigen.values(k)));
      if (sigma <= limit) continue;
      const Eigen::Vector3d d = with_positive_largest(eigen.vectors.col(k));
      result->unobservable.push_back(unobservable(UnobservableReason::large_error, d, options.setup, rotation, sigma));
    }
  };
  look(result->working_point_covariance, false, kWidest * distance);
  look(result->camera.covariance.bottomRightCorner<3, 3>(), true, kWidest);
  if (!result->unobservable.empty()) refuse(result);
}

// ---- Results -------------------------------------------------------------------------------------------------------

/// The factor on the board's lengths that would close the loop best, beside X and Y.
void find_board_scale(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit, HandEyeResult* result) {
  const OneMore off = one_more_unknown(problem, rows, fit, [&](std::size_t i) {
    Vector6d d;
    d << -problem.B[i].translation(), Eigen::Vector3d::Zero();
    return d;
  });
  if (!std::isfinite(off.value)) return;
  result->board_scale = 1.0 + off.value, result->board_scale_sigma = off.sigma;
}

// ---- The work ------------------------------------------------------------------------------------------------------

struct Work {
  HandEyePoses poses;  // in the reading chosen, boards turned as the agreement has it
  LoopProblem problem;
  Rows fitted, held_out;
  LoopEstimate fit;
  bool lens_stays = false;  // asked to be refined, but poses are not good enough for that
  bool plain = false;       // weights are plain, as what is left is no noise
  bool by_pixels = false;   // the fit is that of pixels, not of boards found from them
};

/// Board poses anew from the pixels, with what they weigh.
void fit_boards(const Camera& camera, Work* work, double* pixel_variance) {
  double sum = 0.0;
  int degrees_of_freedom = 0;
  work->problem.pixel_shape.assign(work->poses.images.size(), Matrix6d::Identity());
  std::vector<double> per_image;
  for (std::size_t i = 0; i < work->poses.images.size(); ++i) {
    const BoardFit fit = fit_board(camera, work->poses.images[i], work->problem.B[i]);
    if (!fit.converged)
      throw std::invalid_argument("the board's pose in image " + std::to_string(i) +
                                  " does not fit its pixels: is it behind the camera?");
    work->problem.B[i] = fit.T_camera_board, work->problem.pixel_shape[i] = fit.shape;
    sum += fit.sum, degrees_of_freedom += fit.degrees_of_freedom;
    per_image.push_back(fit.sum / std::max(1, fit.degrees_of_freedom));
  }
  // The median over images: one with misread corners must not weigh on the others.
  *pixel_variance = std::max(1e-12, degrees_of_freedom > 0 ? median_of(per_image) : sum);
}

LoopNoise noise_asked(const HandEyeOptions& options, const HandEyePoses& poses, const Agreement& agreement) {
  LoopNoise noise;
  const auto variance = [](double a) { return std::max(a * a, 1e-24); };
  const double position = std::max(agreement.position, 1e-9), rotation = std::max(agreement.rotation, 1e-9);
  noise.variance = {variance(0.5 * position), variance(0.3 * rotation), variance(0.3 * rotation), 0.0};
  const bool images = !poses.images.empty();
  const bool position_given =
      std::isfinite(options.hand_position_sigma) && (images || std::isfinite(options.camera_position_sigma));
  if (position_given)
    noise.variance[0] =
        variance(options.hand_position_sigma) + (images ? 0.0 : variance(options.camera_position_sigma)),
    noise.estimate[0] = false;
  if (std::isfinite(options.hand_rotation_sigma))
    noise.variance[1] = variance(options.hand_rotation_sigma), noise.estimate[1] = false;
  if (!images && std::isfinite(options.camera_rotation_sigma))
    noise.variance[2] = variance(options.camera_rotation_sigma), noise.estimate[2] = false;
  return noise;
}

/// Closures of position and rotation, each pose left out, root mean squares.
std::pair<double, double> left_out_closures(const LoopProblem& problem, const Rows& rows, const LoopEstimate& fit) {
  double position = 0.0, rotation = 0.0;
  for (const std::size_t i : rows) {
    const Vector6d e = left_out(loop_row(problem, i, fit.X, fit.Y, fit.noise), fit.covariance);
    position += e.head<3>().squaredNorm(), rotation += e.tail<3>().squaredNorm();
  }
  const double n = static_cast<double>(rows.size());
  return {std::sqrt(position / n), std::sqrt(rotation / n)};
}

/// What noise cannot make, a robot with wrong lengths can: then the noise found has the shape of those errors, and
/// weights by it predict worse than plain ones. Plain weights are taken where they predict clearly better.
void question_noise(const HandEyeOptions& options, Work* work, HandEyeResult* result) {
  const LoopEstimate& fit = work->fit;
  if (!fit.noise.estimate[0] || !fit.noise.estimate[1] || !fit.noise.estimate[2] || !work->problem.pixel_shape.empty())
    return;
  if (work->fitted.size() < 4) return;  // two poses predict no third
  const auto [position, rotation] = left_out_closures(work->problem, work->fitted, fit);
  if (position < kExact && rotation < kExact) return;
  LoopNoise plain;
  plain.estimate = {false, false, false, false};
  plain.variance = {position * position / 3.0, 1e-6 * rotation * rotation, rotation * rotation / 3.0, 0.0};
  LoopEstimate other = refine_loop(work->problem, work->fitted, fit.X, fit.Y, plain, options.max_iterations);
  const auto [plain_position, plain_rotation] = left_out_closures(work->problem, work->fitted, other);
  const double clearly = 1.0 + kPlainGain / static_cast<double>(work->fitted.size());
  if (std::max(position / plain_position, rotation / plain_rotation) < clearly) return;
  const double left = 1.0 - 2.0 / static_cast<double>(work->fitted.size());
  other.noise.variance = {plain_position * plain_position / 3.0 * left, plain.variance[1],
                          plain_rotation * plain_rotation / 3.0 * left, 0.0};
  work->fit = refine_loop(work->problem, work->fitted, other.X, other.Y, other.noise, options.max_iterations);
  work->plain = true;
  warn(result, {HandEyeConcernKind::not_like_noise, plain_position, position});
}

/// Fit, leave out what does not fit, take back what does, until nothing changes.
void fit_and_reject(const HandEyeOptions& options, const Rows& rows, LoopNoise noise, Agreement start, Work* work) {
  Rows agreeing = start.rows;
  for (int round = 0; round < kRejectRounds; ++round) {
    work->fit =
        refine_loop(work->problem, agreeing, round == 0 ? start.X : work->fit.X, round == 0 ? start.Y : work->fit.Y,
                    round == 0 ? noise : work->fit.noise, options.max_iterations);
    work->fitted = agreeing;
    if (work->fit.singular || !options.reject || rows.size() < 6) return;
    Rows next;
    for (const std::size_t i : rows) {
      const bool in = std::binary_search(agreeing.begin(), agreeing.end(), i);
      if (standardised(loop_row(work->problem, i, work->fit.X, work->fit.Y, work->fit.noise), work->fit.covariance,
                       in) <= options.reject_beyond)
        next.push_back(i);
    }
    if (next == agreeing || next.size() < std::max<std::size_t>(4, rows.size() / 2)) return;
    agreeing = next;
  }
}

/// By how much more boards turn about what the loop expects than their pixels can tell.
double scatter_beyond_pixels(const LoopProblem& problem, const Rows& rows, const LoopNoise& noise) {
  std::vector<double> by_pixels;
  for (const std::size_t i : rows)
    by_pixels.push_back(noise.variance[3] * problem.pixel_shape[i].bottomRightCorner<3, 3>().trace() / 3.0);
  return std::sqrt(noise.variance[2] / median_of(by_pixels));
}

/// The same poses where boards turn by no more than their pixels can tell: all else is the robot's.
LoopEstimate fit_by_pixels_noise(const HandEyeOptions& options, const Work& work) {
  LoopNoise noise = work.fit.noise;
  noise.variance[2] = kExact * kExact, noise.estimate[2] = false;
  return refine_loop(work.problem, work.fitted, work.fit.X, work.fit.Y, noise, options.max_iterations);
}

/// Lens, board or shutter are not what was given for the pixels, whose noise then is no measure. A robot that turns
/// looks alike where the board is near the hand: what it explains as well is taken for the robot's.
bool scatters_beyond_pixels(const Work& work, const LoopEstimate& by_pixels) {
  return scatter_beyond_pixels(work.problem, work.fitted, work.fit.noise) >= kBeyondPixels &&
         restricted_likelihood(work.problem, work.fitted, work.fit) >
             restricted_likelihood(work.problem, work.fitted, by_pixels) + kEvidence;
}

/// Pixels and all robot poses at once; the closures then with the camera as found.
void fit_images(const HandEyeOptions& options, Work* work, HandEyeResult* result) {
  const Camera camera = *work->poses.camera;
  const ImageSigmas sigmas{std::sqrt(work->fit.noise.variance[3]), std::sqrt(work->fit.noise.variance[0]),
                           std::sqrt(work->fit.noise.variance[1])};
  const ImageEstimate images =
      refine_images(work->problem, work->poses.images, work->fitted, camera, work->fit.X, work->fit.Y, sigmas,
                    options.refine_camera && !work->lens_stays, options.max_iterations);
  work->fit.X = images.X, work->fit.Y = images.Y, work->fit.covariance = images.covariance;
  result->T_base_hand = images.A;
  result->solver = images.solver;
  if (!options.refine_camera || work->lens_stays) return;
  result->camera_model = images.camera, result->camera_model_sigma = images.camera_sigma;
  work->poses.camera = images.camera;
  double pixel_variance = 0.0;
  fit_boards(images.camera, work, &pixel_variance);
  if (!std::isfinite(options.pixel_sigma)) work->fit.noise.variance[3] = pixel_variance;
}

/// The lens from all poses together, before noise can be known. Where boards scatter beyond their pixels the loop bends
/// it: then the lens that was given stays, if pixels fit it as well.
void refine_lens(const HandEyeOptions& options, Work* work, HandEyeResult* result) {
  const Work before = *work;
  fit_images(options, work, result);
  work->fit =
      refine_loop(work->problem, work->fitted, work->fit.X, work->fit.Y, work->fit.noise, options.max_iterations);
  if (!scatters_beyond_pixels(*work, fit_by_pixels_noise(options, *work)) ||
      before.fit.noise.variance[3] > kBentLens * work->fit.noise.variance[3])
    return;
  *work = before;
  work->lens_stays = true;
  result->camera_model.reset(), result->camera_model_sigma.clear(), result->T_base_hand.clear();
}

double left_out_pixels(const Work& work, const LeftOut& left_out) {
  double squares = 0.0;
  for (const std::size_t i : work.fitted)
    squares += std::pow(left_out.pixels(i, *work.poses.camera, work.poses.images[i]), 2);
  return std::sqrt(squares / static_cast<double>(work.fitted.size()));
}

/// The noise that the fit went by.
LoopNoise weights_of(const Work& work) {
  LoopNoise weights = work.fit.noise;
  if (work.by_pixels)  // what boards scatter beyond their pixels takes no part in that fit
    weights.variance[2] = 0.0, weights.estimate[2] = false;
  if (work.plain) weights.estimate = {true, false, true, false};  // two scatters, of position and rotation
  return weights;
}

void describe_poses(const HandEyeOptions& options, const Agreement& agreement, const Work& work,
                    HandEyeResult* result) {
  const std::size_t n = work.problem.A.size();
  result->residuals.resize(n);
  const double position_noise = std::max(agreement.position, 1e-6), rotation_noise = std::max(agreement.rotation, 1e-6);
  const LoopNoise weights = weights_of(work);
  std::optional<LensData> lens;
  if (result->camera_model) lens.emplace(LensData{*work.poses.camera, work.poses.images});
  const LeftOut left_out(work.problem, work.fitted, work.fit, weights, lens);
  for (std::size_t i = 0; i < n; ++i) {
    HandEyeResidual& r = result->residuals[i];
    const bool fitted = std::binary_search(work.fitted.begin(), work.fitted.end(), i);
    const bool held_out = std::binary_search(work.held_out.begin(), work.held_out.end(), i);
    const Vector6d e = loop_row(work.problem, i, work.fit.X, work.fit.Y, work.fit.noise).e, out = left_out.closure(i);
    r.position = e.head<3>().norm(), r.rotation = e.tail<3>().norm();
    r.position_left_out = out.head<3>().norm(), r.rotation_left_out = out.tail<3>().norm();
    r.distance = left_out.standardised(i);
    r.rejected = !fitted && !held_out;
    if (r.rejected || (held_out && r.distance > options.reject_beyond))
      r.cause = likely_cause(work.problem.A, work.problem.B, options.setup, i, work.fitted, work.fit.X, work.fit.Y,
                             position_noise, rotation_noise);
    if (r.rejected) result->rejected.push_back(i);
    if (work.poses.images.empty()) continue;
    const auto pixels = [&](const Eigen::Isometry3d& A) {
      return pixel_rms(*work.poses.camera, work.poses.images[i],
                       predicted_board(work.fit.X, moving_frames({A}, options.setup)[0], work.fit.Y));
    };
    r.pixels = pixels(work.problem.A[i]);
    r.pixels_corrected = fitted && !result->T_base_hand.empty() ? pixels(result->T_base_hand[i]) : r.pixels;
  }
  result->train = errors_of(result->residuals, work.fitted, false);
  result->left_out = errors_of(result->residuals, work.fitted, true);
  if (!work.poses.images.empty()) result->left_out.pixel_rms = left_out_pixels(work, left_out);
  if (!work.held_out.empty()) result->test = errors_of(result->residuals, work.held_out, true);
}

void describe_noise(const HandEyeOptions& options, const LoopProblem& problem, const LoopNoise& noise,
                    HandEyeResult* result) {
  HandEyeNoise& out = result->noise;
  out.position = std::sqrt(noise.variance[0]), out.hand_rotation = std::sqrt(noise.variance[1]),
  out.camera_rotation = std::sqrt(noise.variance[2]);
  if (!problem.pixel_shape.empty()) out.pixel = std::sqrt(noise.variance[3]);
  out.estimated = noise.estimate[0] || noise.estimate[1] || noise.estimate[2] ||
                  (!problem.pixel_shape.empty() && !std::isfinite(options.pixel_sigma));
}

/// Where noise was given and the data are worse, standard errors grow by what is missing.
void widen(const LoopNoise& noise, const Rows& rows, LoopEstimate* fit, HandEyeResult* result) {
  if (noise.estimate[0] || noise.estimate[1]) return;
  const double degrees_of_freedom = std::max(1.0, 6.0 * static_cast<double>(rows.size()) - 12.0),
               per_degree = fit->chi2 / degrees_of_freedom;
  if (per_degree <= 1.0) return;
  fit->covariance *= per_degree;
  if (per_degree > 1.0 + 5.0 * std::sqrt(2.0 / degrees_of_freedom))  // five standard deviations of chi^2
    warn(result, {HandEyeConcernKind::noise_too_small, std::sqrt(per_degree)});
}

/// [m] root mean square of the closures with the board's lengths times `scale`, fitted anew.
double closure_with_lengths_times(double scale, const HandEyeOptions& options, const Work& work) {
  LoopProblem problem = work.problem;
  problem.B = with_lengths_times(scale, problem.B);
  const LoopEstimate fit =
      refine_loop(problem, work.fitted, work.fit.X, work.fit.Y, work.fit.noise, options.max_iterations);
  double sum = 0.0;
  for (const std::size_t i : work.fitted)
    sum += loop_row(problem, i, fit.X, fit.Y, fit.noise).e.head<3>().squaredNorm();
  return std::sqrt(sum / static_cast<double>(work.fitted.size()));
}

/// A factor that is beyond doubt is said, and one that is likely where it does much for the closure.
void look_at_board_scale(const HandEyeOptions& options, const Work& work, HandEyeResult* result) {
  const double off = std::abs(result->board_scale - 1.0), sigma = result->board_scale_sigma;
  if (!(off > std::max(kLikelyScale * sigma, kLeastScale))) return;
  const bool certain = off > kCertainScale * sigma;
  if (!certain && !(closure_with_lengths_times(result->board_scale, options, work) <
                    kScaledCloses * closure_with_lengths_times(1.0, options, work)))
    return;
  warn(result, {HandEyeConcernKind::board_scale, result->board_scale, sigma});
}

/// Hand and board poses both inverted close the loop as well, with camera and board in each other's place.
void look_behind(const Frames& B, const Rows& rows, HandEyeResult* result) {
  const auto behind = static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](std::size_t i) { return !(B[i].translation().z() > 0.0); }));
  if (behind > rows.size() / 2)
    warn(result, {HandEyeConcernKind::behind_camera, static_cast<double>(behind), static_cast<double>(rows.size())});
}

/// The other set-up is proposed as a reading, but asked for by the set-up: else frames would have the wrong parents.
void check_reading(const HandEyeOptions& options) {
  if (!scope_of(options.reading).setup) return;
  throw std::invalid_argument("reading '" + options.reading + "' is about the set-up: leave '" + kOtherSetup +
                              "' out, and give the set-up " +
                              (options.setup == HandEyeSetup::eye_in_hand ? "eye-to-hand" : "eye-in-hand"));
}

/// With images the boards are what was found in them.
void check_with_images(const HandEyePoses& poses, const HandEyeOptions& options) {
  if (poses.images.empty()) return;
  if (scope_of(options.reading).board)
    throw std::invalid_argument(
        "reading '" + options.reading +
        "' is about board poses; with images they are found, not read: bring hands and images into order instead");
  if (std::isfinite(options.camera_position_sigma) || std::isfinite(options.camera_rotation_sigma)) {
    throw std::invalid_argument(
        "camera_position_sigma and camera_rotation_sigma are about board poses; with images give pixel_sigma");
  }
}

/// Symmetric boards in the turn that closes the loop, held-out ones too.
void turn_boards(const Agreement& agreement, double size, Work* work, HandEyeResult* result) {
  LoopProblem& problem = work->problem;
  result->symmetry = agreement.symmetry;
  for (const std::size_t i : work->held_out)
    result->symmetry[i] = nearest_symmetry(problem.M, problem.B, work->poses.board_symmetries, agreement, size, i);
  for (std::size_t i = 0; i < problem.B.size(); ++i) {
    if (result->symmetry[i] <= 0) continue;
    const Eigen::Isometry3d& turned = work->poses.board_symmetries[static_cast<std::size_t>(result->symmetry[i] - 1)];
    problem.B[i] = problem.B[i] * turned;
    if (!work->poses.images.empty())
      work->poses.images[i].points = turned.inverse(Eigen::Isometry) * work->poses.images[i].points;
  }
}

/// What is given of the noise, and a first idea of what is not.
LoopNoise noise_to_start_with(const HandEyeOptions& options, const Agreement& agreement, Work* work,
                              HandEyeResult* result) {
  LoopNoise noise = noise_asked(options, work->poses, agreement);
  if (work->poses.images.empty()) {
    if (std::isfinite(options.hand_position_sigma) != std::isfinite(options.camera_position_sigma))
      warn(result, {HandEyeConcernKind::noise_of_one_side});
    return noise;
  }
  fit_boards(*work->poses.camera, work,
             &noise.variance[3]);  // what pixels scatter about their own board says more than the loop
  if (std::isfinite(options.pixel_sigma)) noise.variance[3] = options.pixel_sigma * options.pixel_sigma;
  if (!noise.estimate[0] && !noise.estimate[1])
    noise.variance[2] = kExact * kExact, noise.estimate[2] = false;  // all is given
  return noise;
}

/// From the closed form on: as it is, or refined without the poses that do not fit.
void fit_poses(const HandEyeOptions& options, const Rows& rows, const LoopNoise& noise, const Agreement& agreement,
               Work* work, HandEyeResult* result) {
  Agreement start = agreement;
  std::sort(start.rows.begin(), start.rows.end());
  if (options.method == HandEyeMethod::closed_form) {
    work->fitted = start.rows;
    work->fit = refine_loop(work->problem, work->fitted, start.X, start.Y, noise,
                            options.max_iterations);  // for the noise and what it makes of the result
    work->fit.X = start.X, work->fit.Y = start.Y;
    result->solver = {"closed form", 0, true, "one solution"};
    return;
  }
  result->solver.name = "gauss-newton";
  fit_and_reject(options, rows, noise, start, work);
  if (!work->fit.singular) question_noise(options, work, result);
  result->solver.iterations = work->fit.iterations, result->solver.converged = work->fit.converged;
  result->solver.stopped_because =
      work->fit.converged ? "the step is small beside its standard errors" : "the limit of iterations";
}

/// The poses in the reading that is asked for, as the refinement sees them.
Work read_poses(const HandEyePoses& given, const HandEyeOptions& options) {
  Work work;
  work.poses = given;
  apply_reading(options.reading, &work.poses.T_base_hand, &work.poses.T_camera_board);
  work.held_out = rows_of(given, true);
  work.problem.setup = options.setup;
  work.problem.A = work.poses.T_base_hand;
  work.problem.M = moving_frames(work.problem.A, options.setup);
  work.problem.B = work.poses.T_camera_board;
  return work;
}

Eigen::Vector3d mean_position(const Frames& frames, const Rows& rows) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t i : rows) mean += frames[i].translation() / static_cast<double>(rows.size());
  return mean;
}

/// Readings that would close the loop. With images boards were found, not read: only their order may be wrong.
std::vector<Reading> other_readings(const HandEyeOptions& options, const Work& work, const Rows& rows,
                                    const Agreement& agreement) {
  if (!options.recognise) return {};
  std::vector<Reading> readings =
      find_readings(work.problem.A, work.problem.B, options.setup, rows, agreement.position, agreement.rotation);
  if (work.poses.images.empty()) return readings;
  const auto impossible = [](const Reading& reading) {
    const ReadingScope scope = scope_of(reading.name);
    return scope.board && !scope.rows;
  };
  readings.erase(std::remove_if(readings.begin(), readings.end(), impossible), readings.end());
  return readings;
}

void refuse_open_loop(const HandEyeOptions& options, const Agreement& agreement, HandEyeResult* result) {
  result->status = HandEyeStatus::not_closing;
  result->as_given = {"", "", agreement.position, agreement.rotation, false};
  result->message = not_closing_message(*result, options.setup);
}

/// Centimetres for millimetres and the like: the factor, where the loop closes with it.
void try_board_lengths(const Work& work, const Rows& rows, const Agreement& agreement, double size,
                       HandEyeResult* result) {
  const double factor = factor_on_lengths(work.problem.M, work.problem.B, rows);
  if (!std::isfinite(factor)) return;
  const Agreement other = find_agreement(work.problem.M, with_lengths_times(factor, work.problem.B), rows,
                                         work.poses.board_symmetries, CameraSolver{}, {true, 200});
  if (other.position < kDoubtful * size && other.position < kDoubtful * agreement.position &&
      other.rotation < kLargestNoise)
    result->board_scale = factor;
}

/// False: there is no answer, and the result says why. `angles_differ`: hand and board turn by different angles.
bool closes(const HandEyeOptions& options, const Work& work, const Rows& rows, const Agreement& agreement, double size,
            bool angles_differ, HandEyeResult* result) {
  const double open = std::hypot(agreement.position / size, agreement.rotation);
  if ((result->unobservable.empty() || angles_differ) && open > kDoubtful)
    result->readings = other_readings(options, work, rows, agreement);
  if (!result->readings.empty())
    result->unobservable.clear();  // in another reading they may be seen
  else if (!result->unobservable.empty())
    return false;
  if (result->readings.empty() && !(open > kHopeless)) return true;
  if (result->readings.empty()) try_board_lengths(work, rows, agreement, size, result);
  refuse_open_loop(options, agreement, result);
  return false;
}

/// The lens as given, beside that which fits the pixels best when every board is where they have it.
void look_at_given_lens(const Work& work, HandEyeResult* result) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(kLens, kLens);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(kLens);
  double sum = 0.0, degrees_of_freedom = 0.0;
  for (const std::size_t i : work.fitted) {
    const BoardImage& image = work.poses.images[i];
    const LensShare share = lens_share(*work.poses.camera, image, work.problem.B[i]);
    gram += share.gram, gradient += share.gradient;
    const double count = 2.0 * static_cast<double>(image.pixels.cols());
    sum += count * std::pow(pixel_rms(*work.poses.camera, image, work.problem.B[i]), 2);
    degrees_of_freedom += count - 6.0;
  }
  const Eigen::VectorXd unit = unit_scale<Eigen::Dynamic>(gram);
  const Eigen::VectorXd scaled = unit.cwiseProduct(gradient);
  const double gain =
      scaled.dot(solve_symmetric<Eigen::Dynamic, 1>(unit.asDiagonal() * gram * unit.asDiagonal(), scaled));
  const double given = sum / degrees_of_freedom, best = (sum - gain) / (degrees_of_freedom - kLens);
  if (given > kFinest * kFinest && given > kOtherLens * best && gain > kCertainLens * kLens * best)
    warn(result, {HandEyeConcernKind::other_lens, std::sqrt(given), std::sqrt(best)});
}

/// Pixels are what was measured, where they scatter as they say.
void use_images(const HandEyeOptions& options, Work* work, HandEyeResult* result) {
  if (options.refine_camera)
    refine_lens(options, work, result);
  else
    look_at_given_lens(*work, result);
  const LoopEstimate by_pixels = fit_by_pixels_noise(options, *work);
  if (scatters_beyond_pixels(*work, by_pixels)) {  // the loop's own noise stands
    const LoopNoise& noise = work->fit.noise;
    warn(result, {HandEyeConcernKind::beyond_pixels, std::sqrt(noise.variance[2]),
                  scatter_beyond_pixels(work->problem, work->fitted, noise)});
    return;
  }
  work->by_pixels = true;
  work->fit = by_pixels;  // hands turn by all that pixels do not explain
  fit_images(options, work, result);
}

/// What was found, how well it is known and what is odd about it.
void describe(const HandEyeOptions& options, const Agreement& agreement, double size, const Work& work,
              HandEyeResult* result) {
  const SmallSample sample = small_sample(work.problem, work.fitted, work.fit, weights_of(work));
  result->camera = {work.fit.X, sample.covariance.topLeftCorner<6, 6>()};
  result->board = {work.fit.Y, sample.covariance.bottomRightCorner<6, 6>()};
  result->camera_degrees_of_freedom = sample.degrees_of_freedom.head<6>();
  result->board_degrees_of_freedom = sample.degrees_of_freedom.tail<6>();
  result->working_point_covariance = at_working_point(result->camera, result->working_point);
  describe_noise(options, work.problem, work.fit.noise, result);
  describe_poses(options, agreement, work, result);
  find_board_scale(work.problem, work.fitted, work.fit, result);
  look_at_board_scale(options, work, result);
  look_behind(work.problem.B, work.fitted, result);
  look_at_errors(options, std::max(result->working_point.norm(), size), result);
  if (result->status == HandEyeStatus::not_observable && agreement.rotation > kScattered) {
    result->unobservable.clear();
    refuse_open_loop(options, agreement, result);
  }
  if (result->status != HandEyeStatus::done) return;
  const std::string poses = std::to_string(work.fitted.size()) + " poses";
  const std::string error =
      millimetres(std::sqrt(result->working_point_covariance.trace() / 3.0)) + " standard error per axis.";
  if (result->solver.converged) {
    result->message = "Camera found from " + poses + "; at the working point " + error;
    return;
  }
  result->status = HandEyeStatus::not_converged;
  result->message = "The fit to " + poses + " did not come to an end in " + std::to_string(result->solver.iterations) +
                    " iterations; where it stands, at the working point " + error;
}

}  // namespace

bool HandEyeOptions::is_valid(std::string* error) const {
  const auto fail = [&](const std::string& text) {
    if (error) *error = text;
    return false;
  };
  for (const auto& [value, name] : {std::pair<double, const char*>{hand_position_sigma, "hand_position_sigma"},
                                    {hand_rotation_sigma, "hand_rotation_sigma"},
                                    {camera_position_sigma, "camera_position_sigma"},
                                    {camera_rotation_sigma, "camera_rotation_sigma"},
                                    {pixel_sigma, "pixel_sigma"}})
    if (std::isinf(value) || value <= 0.0)
      return fail(std::string(name) + " must be greater than 0; leave it out to have it estimated");
  if (!(reject_beyond > 1.0)) return fail("reject_beyond must be greater than 1");
  if (max_iterations < 1) return fail("max_iterations must be 1 or more");
  if (!(known_height_sigma >= 0.0)) return fail("known_height_sigma must be 0 or more");
  if (known_height && !std::isfinite(*known_height)) return fail("known_height must be finite");
  if (working_point && !working_point->allFinite()) return fail("working_point must be finite");
  return true;
}

HandEyeResult handeye(const HandEyePoses& given, const HandEyeOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument(error);
  check(given);
  check_reading(options);
  check_with_images(given, options);
  Work work = read_poses(given, options);
  const Rows rows = rows_of(given, false);
  check_rows(work.poses, rows);

  HandEyeResult result;
  const CameraSolution all = solve_camera(work.problem.M, work.problem.B, rows);
  look_at_motions(all, &result);
  result.working_point = options.working_point ? *options.working_point : mean_position(work.problem.B, rows);
  std::optional<Eigen::Vector3d> axis;
  look_at_axes(all, options, &result, &axis);
  const CameraSolver solve = axis ? CameraSolver{*axis, options.known_height.value_or(0.0)} : CameraSolver{};
  const Agreement agreement =
      find_agreement(work.problem.M, work.problem.B, rows, work.poses.board_symmetries, solve, {options.reject, 200});
  const double size = make_screws(work.problem.M, work.problem.B, agreement.rows).length;
  if (!closes(options, work, rows, agreement, size, all.incongruence > kLargestNoise, &result)) return result;

  turn_boards(agreement, size, &work, &result);
  // Of poses that agree: bad ones blur it.
  look_at_motions(solve_camera(work.problem.M, work.problem.B, agreement.rows), &result);
  const LoopNoise noise = noise_to_start_with(options, agreement, &work, &result);
  if (axis)
    work.problem.known =
        LoopProblem::Known{*axis, options.known_height.value_or(0.0), std::max(options.known_height_sigma, 1e-7)};
  fit_poses(options, rows, noise, agreement, &work, &result);
  if (work.fit.singular) {
    result.unobservable.push_back(unobservable(UnobservableReason::singular, Eigen::Vector3d::Zero(), options.setup));
    refuse(&result);
    return result;
  }
  widen(noise, work.fitted, &work.fit, &result);
  if (!work.poses.images.empty() && options.method == HandEyeMethod::refined) use_images(options, &work, &result);
  describe(options, agreement, size, work, &result);
  return result;
}

ClosedForm handeye_closed_form(const HandEyePoses& poses, HandEyeSetup setup) {
  check(poses);
  const Rows rows = rows_of(poses, false);
  check_rows(poses, rows);
  const Frames M = moving_frames(poses.T_base_hand, setup);
  const CameraSolution solution = solve_camera(M, poses.T_camera_board, rows);
  HandEyeOptions options;
  options.setup = setup;
  HandEyeResult seen;
  std::optional<Eigen::Vector3d> axis;
  look_at_axes(solution, options, &seen, &axis);
  if (!seen.unobservable.empty()) throw std::invalid_argument(seen.message);
  ClosedForm out;
  out.T_parent_camera = solution.X;
  out.T_parent_board = mean_board(M, poses.T_camera_board, rows, solution.X);
  out.singular_values = solution.singular_values;
  out.length_scale = solution.length, out.residual = solution.residual;
  out.axes_spread = solution.principal_rotations(1) / std::max(solution.principal_rotations(0), 1e-300);
  out.rotation = solution.principal_rotations.norm();
  out.motions = solution.motions;
  return out;
}

}  // namespace truing
