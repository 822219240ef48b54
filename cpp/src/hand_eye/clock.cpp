// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Two clocks: hand and board turn alike, but for one turn between their frames; then the loop closes best.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/refine.hpp"
#include "math/frame.hpp"
#include "math/linear_algebra.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing {
using namespace hand_eye;

namespace {

constexpr double kSure = 10.0;    // [log of likelihood] by which one offset must be more likely than others
constexpr double kModel = 0.003;  // share of the velocities' squares that is no noise: lag, bending, times that jitter
constexpr double kNoiseShare = 0.1;     // velocities are smoothed until noise is no more of their squares
constexpr double kWiden = 1.4;          // from window to window
constexpr double kLongestWindow = 2.0;  // [s] before and after
constexpr double kWindows = 12.0;       // at least so many in the camera's record
constexpr double kCloses = 0.2;         // of the turning's rms: a loop that stays open further is not one motion's
constexpr std::size_t kFitted = 400;    // camera poses in the fit
constexpr double kGap = 5.0;            // median steps: holes in the hand's record that are not bridged

struct Record {
  const std::vector<double>& time;
  const Frames& pose;
};

void check(const Record& r, const char* what) {
  const auto fail = [&](const std::string& text) { throw std::invalid_argument(std::string(what) + " " + text); };
  if (r.time.size() != r.pose.size())
    fail("has " + std::to_string(r.time.size()) + " times and " + std::to_string(r.pose.size()) + " poses");
  if (r.time.size() < 10) fail("has " + std::to_string(r.time.size()) + " poses; a clock offset needs 10 or more");
  for (std::size_t i = 0; i < r.time.size(); ++i) {
    if (!std::isfinite(r.time[i]) || !r.pose[i].matrix().allFinite()) fail("is not finite in row " + std::to_string(i));
    if (i > 0 && !(r.time[i] > r.time[i - 1]))
      fail("goes back in time at row " + std::to_string(i) + ": " + number(r.time[i], 9) + " s after " +
           number(r.time[i - 1], 9) + " s");
  }
}

double median_step(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i) steps.push_back(time[i] - time[i - 1]);
  return median_of(steps);
}

/// Hand's pose at a time between two of its rows; false outside, and in holes.
bool pose_at(const Record& r, double t, double largest_gap, Eigen::Isometry3d* out) {
  const auto after = std::upper_bound(r.time.begin(), r.time.end(), t);
  if (after == r.time.begin() || after == r.time.end()) return false;
  const auto j = static_cast<std::size_t>(after - r.time.begin()), i = j - 1;
  if (r.time[j] - r.time[i] > largest_gap) return false;
  const double fraction = (t - r.time[i]) / (r.time[j] - r.time[i]);
  out->setIdentity();
  out->linear() =
      Eigen::Quaterniond(r.pose[i].linear()).slerp(fraction, Eigen::Quaterniond(r.pose[j].linear())).toRotationMatrix();
  out->translation() = (1.0 - fraction) * r.pose[i].translation() + fraction * r.pose[j].translation();
  return true;
}

// ---- A start: angular velocities -----------------------------------------------------------------------------------

/// Angular velocities [rad/s] on a grid; NaN where they are not known. From frame to frame they differ by one turn.
using Velocities = std::vector<Eigen::Vector3d>;

/// From `begin`: slopes of the rotation vectors within `window` before and after; NaN where rows are not on both sides.
Velocities angular_velocity(const Record& r, double begin, double step, std::size_t count, double window) {
  Velocities out(count, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  // Rows that lie on the window's ends by a rounded stamp are within it.
  const double reach = window + 0.5 * median_step(r.time);
  for (std::size_t k = 0; k < count; ++k) {
    const double t = begin + step * static_cast<double>(k);
    const auto first = std::lower_bound(r.time.begin(), r.time.end(), t - reach) - r.time.begin();
    const auto end = std::upper_bound(r.time.begin(), r.time.end(), t + reach) - r.time.begin();
    const auto from = static_cast<std::size_t>(first), to = static_cast<std::size_t>(end);
    if (to < from + 2 || r.time[from] > t - 0.5 * window || r.time[to - 1] < t + 0.5 * window) continue;
    const Eigen::Matrix3d middle = r.pose[(from + to) / 2].linear().transpose();
    double mean = 0.0;
    for (std::size_t i = from; i < to; ++i) mean += (r.time[i] - t) / static_cast<double>(to - from);
    double squares = 0.0;
    Eigen::Vector3d products = Eigen::Vector3d::Zero();
    for (std::size_t i = from; i < to; ++i) {
      const double off = r.time[i] - t - mean;
      squares += off * off, products += off * vector_from_rotation(r.pose[i].linear() * middle);
    }
    out[k] = products / squares;
  }
  return out;
}

/// Noise of the orientations [rad], per component, by third differences, which motion hardly reaches: the variance of
/// one is 1 + 9 + 9 + 1 times theirs, and the median of a sum of three squares 2.366 times their variance.
double orientation_noise(const Record& r) {
  std::vector<double> squares;
  const auto turn = [&](std::size_t i) {
    return vector_from_rotation(r.pose[i + 1].linear() * r.pose[i].linear().transpose());
  };
  for (std::size_t i = 0; i + 3 < r.time.size(); ++i)
    squares.push_back((turn(i + 2) - 2.0 * turn(i + 1) + turn(i)).squaredNorm());
  return std::sqrt(median_of(squares) / 2.366 / 20.0);
}

std::size_t known(const Velocities& v) {
  return static_cast<std::size_t>(
      std::count_if(v.begin(), v.end(), [](const Eigen::Vector3d& x) { return x.allFinite(); }));
}

/// Is noise of orientations a small share of velocities within this window? It makes of a slope of m rows the variance
/// 12 noise^2 / (step^2 m (m^2 - 1)).
bool is_quiet(const Record& r, double noise, const Velocities& v, double window) {
  const double step = median_step(r.time), rows = std::max(2.0, 2.0 * std::floor(window / step + 1e-6) + 1.0);
  double squares = 0.0;
  for (const Eigen::Vector3d& x : v)
    if (x.allFinite()) squares += x.squaredNorm() / static_cast<double>(known(v));
  return 3.0 * 12.0 * noise * noise / (step * step * rows * (rows * rows - 1.0)) <= kNoiseShare * squares;
}

/// Both on one grid of the slower clock's step; the hand's begins `reach` steps earlier.
struct Motions {
  Velocities hand, camera;
  double window;  ///< [s] before and after
};

/// Smoothed until noise is a small share of either, or as far as the record allows.
Motions smoothed_motions(const Record& hand, const Record& camera, double step, std::size_t reach) {
  const double begin = camera.time.front(), length = camera.time.back() - begin;
  const auto count = static_cast<std::size_t>(length / step) + 1;
  const double hand_noise = orientation_noise(hand), camera_noise = orientation_noise(camera);
  const double longest = std::max(step, std::min(kLongestWindow, 0.5 * length / kWindows));
  Motions out;
  for (double steps = 1.0;; steps = std::ceil(kWiden * steps)) {
    out.window = steps * step;
    out.camera = angular_velocity(camera, begin, step, count, out.window);
    out.hand = angular_velocity(hand, begin - step * static_cast<double>(reach), step, count + 2 * reach, out.window);
    if (out.window >= longest ||
        (is_quiet(camera, camera_noise, out.camera, out.window) && is_quiet(hand, hand_noise, out.hand, out.window)))
      return out;
  }
}

/// Correlation of hand[k + shift] with camera[k], turned as fits best (Umeyama 1991), where both are known; 0 where
/// that is less than two fifths of the shorter.
double correlation(const Motions& motions, std::size_t shift, std::size_t shorter) {
  double n = 0.0, hands = 0.0, cameras = 0.0;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < motions.camera.size(); ++k) {
    const Eigen::Vector3d &x = motions.hand[k + shift], &y = motions.camera[k];
    if (!x.allFinite() || !y.allFinite()) continue;
    n += 1.0, hands += x.squaredNorm(), cameras += y.squaredNorm(), products.noalias() += y * x.transpose();
  }
  if (!(n >= 0.4 * static_cast<double>(shorter) && hands > 0.0 && cameras > 0.0)) return 0.0;
  const SingularValues s = singular_values(products);
  const double mirrored = s.U.determinant() * s.V.determinant() < 0.0 ? -1.0 : 1.0;
  return (s.values(0) + s.values(1) + mirrored * s.values(2)) / std::sqrt(hands * cameras);
}

/// Where the two motions agree best.
struct Peak {
  double step;         ///< of the grid [s]
  double offset;       ///< [s]
  double correlation;  ///< there
  double next;         ///< the largest one that is no neighbour
  bool certain;        ///< one motion, and no other offset shows it as well
};

/// The largest value beyond the neighbours of the one `at`, those that are above `level` or lie on its slopes; 0: there
/// is none.
double next_peak(const std::vector<double>& values, std::size_t at, double level) {
  std::size_t left = at, right = at;
  while (left > 0 && (values[left - 1] >= level || values[left - 1] < values[left])) --left;
  while (right + 1 < values.size() && (values[right + 1] >= level || values[right + 1] < values[right])) ++right;
  double next = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (k < left || k > right) next = std::max(next, values[k]);
  return next;
}

/// The logarithm of the likelihood of two motions with a correlation is -n/2 log(1 - correlation^2), up to a constant:
/// n counts what windows that do not overlap hold, three components each less the turn that was fitted.
Peak find_peak(const Record& hand, const Record& camera, double search) {
  const double step = std::max(median_step(hand.time), median_step(camera.time));
  const auto reach = static_cast<std::size_t>(std::ceil(search / step));
  const Motions motions = smoothed_motions(hand, camera, step, reach);
  const std::size_t shorter = std::max<std::size_t>(10, std::min(known(motions.camera), known(motions.hand)));
  std::vector<double> values;
  for (std::size_t shift = 0; shift <= 2 * reach; ++shift) values.push_back(correlation(motions, shift, shorter));
  const auto at = static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  const auto left = [](double c) { return std::max(0.0, 1.0 - c * c) + kModel; };
  const double windows = step * static_cast<double>(shorter) / (2.0 * motions.window);
  const double half = 0.5 * std::max(1e-3, 3.0 * windows - 3.0), best = left(values[at]);
  const double level = std::sqrt(std::max(0.0, 1.0 + kModel - best * std::exp(kSure / half)));
  const double next = next_peak(values, at, level);
  return {step, step * (static_cast<double>(at) - static_cast<double>(reach)), values[at], next,
          half * std::log(left(next) / best) > kSure};
}

// ---- The loop closes best ------------------------------------------------------------------------------------------

/// Camera poses with the hand's at an offset, and a little before and after.
struct Paired {
  LoopProblem problem;
  Frames before, after;  ///< moving frames
  double nudge;          ///< by so much [s]
  Rows rows;
};

Paired pair_at(const Record& hand, const Record& camera, HandEyeSetup setup, double offset, double gap) {
  const std::size_t stride = std::max<std::size_t>(1, camera.time.size() / kFitted);
  Paired out;
  out.nudge = 0.25 * median_step(hand.time);
  out.problem.setup = setup;
  Frames before, after;
  for (std::size_t i = 0; i < camera.time.size(); i += stride) {
    Eigen::Isometry3d A, a, b;
    const double t = camera.time[i] + offset;
    if (!pose_at(hand, t, gap, &A) || !pose_at(hand, t - out.nudge, gap, &a) || !pose_at(hand, t + out.nudge, gap, &b))
      continue;
    out.problem.A.push_back(A), out.problem.B.push_back(camera.pose[i]), before.push_back(a), after.push_back(b);
  }
  out.problem.M = moving_frames(out.problem.A, setup);
  out.before = moving_frames(before, setup), out.after = moving_frames(after, setup);
  out.rows.resize(out.problem.A.size());
  std::iota(out.rows.begin(), out.rows.end(), std::size_t{0});
  return out;
}

/// By how much the offset would have to change, with its standard error.
OneMore offset_change(const Paired& pairs, const LoopEstimate& fit) {
  const LoopProblem& problem = pairs.problem;
  return one_more_unknown(problem, pairs.rows, fit, [&](std::size_t i) {
    return Vector6d((closure(predicted_board(fit.X, pairs.after[i], fit.Y), problem.B[i]) -
                     closure(predicted_board(fit.X, pairs.before[i], fit.Y), problem.B[i])) /
                    (2.0 * pairs.nudge));
  });
}

/// Rms angle by which the loop stays open, over that of the camera poses about their mean.
double open_share(const Paired& pairs, const LoopEstimate& fit) {
  const LoopProblem& problem = pairs.problem;
  double open = 0.0, turned = 0.0;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Isometry3d& B : problem.B) sum += B.linear();
  const SingularValues s = singular_values(sum);
  const double mirrored = s.U.determinant() * s.V.determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d mean = s.U * Eigen::Vector3d(1.0, 1.0, mirrored).asDiagonal() * s.V.transpose();
  for (const std::size_t i : pairs.rows) {
    open += closure(predicted_board(fit.X, problem.M[i], fit.Y), problem.B[i]).tail<3>().squaredNorm();
    turned += vector_from_rotation(problem.B[i].linear() * mean.transpose()).squaredNorm();
  }
  return std::sqrt(open / std::max(turned, 1e-300));
}

/// Camera, board and offset together, from the offset on; `step` bounds its changes. Empty, or why there is no answer.
std::string close_loop(const Record& hand, const Record& camera, HandEyeSetup setup, double step, double gap,
                       ClockOffset* out) {
  LoopEstimate fit;
  double closing = 0.0;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Paired pairs = pair_at(hand, camera, setup, out->offset, gap);
    const LoopProblem& problem = pairs.problem;
    if (problem.A.size() < 10) return "the two records share fewer than 10 poses";
    const Eigen::Isometry3d X = iteration == 0 ? solve_camera(problem.M, problem.B, pairs.rows).X : fit.X;
    const Eigen::Isometry3d Y = iteration == 0 ? mean_board(problem.M, problem.B, pairs.rows, X) : fit.Y;
    fit = refine_loop(problem, pairs.rows, X, Y, iteration == 0 ? LoopNoise{} : fit.noise, 50);
    if (fit.singular) return "camera and board are not observable: turn the hand about two axes";
    closing = open_share(pairs, fit);
    const OneMore offset = offset_change(pairs, fit);
    if (!std::isfinite(offset.value))
      return "the offset cannot be told from where camera and board are: turn the hand back and forth";
    const double change = std::clamp(offset.value, -2.0 * step, 2.0 * step);
    out->offset += change, out->sigma = offset.sigma;
    if (std::abs(change) < 1e-3 * out->sigma) break;
  }
  if (!(closing > kCloses)) return {};
  return "at the offset where hand and board turn alike, " + number(out->offset, 4) + " s, the loop stays open by " +
         number(100.0 * closing, 2) + " % of what they turn: are both records of one motion, and the set-up as told?";
}

}  // namespace

ClockOffset handeye_clock(const std::vector<double>& hand_time, const std::vector<Eigen::Isometry3d>& T_base_hand,
                          const std::vector<double>& camera_time, const std::vector<Eigen::Isometry3d>& T_camera_board,
                          HandEyeSetup setup, double search) {
  const Record hand{hand_time, T_base_hand}, camera{camera_time, T_camera_board};
  check(hand, "the hand's record"), check(camera, "the camera's record");
  if (!(search > 0.0)) throw std::invalid_argument("search must be greater than 0 s");
  const Frames moving = moving_frames(T_base_hand, setup);
  const Peak peak = find_peak({hand_time, moving}, camera, search);
  ClockOffset out;
  out.offset = peak.offset;
  out.correlation = peak.correlation;
  if (!peak.certain) {
    out.message =
        "the turning of hand and board does not show which times belong together (correlation of their smoothed "
        "angular velocities " +
        number(out.correlation, 3) + " at " + number(out.offset, 4) + " s, " + number(peak.next, 3) +
        " elsewhere): turn the hand back and forth about several axes, unevenly and for longer, within " +
        number(search, 3) + " s of both records' common time";
    return out;
  }
  const double gap = kGap * median_step(hand_time);
  out.message = close_loop(hand, camera, setup, peak.step, gap, &out);
  if (!out.message.empty()) return out;
  out.found = true;
  out.message =
      "hand time = camera time + " + number(out.offset, 5) + " s, standard error " + number(out.sigma, 2) + " s";
  for (std::size_t i = 0; i < camera_time.size(); ++i) {
    Eigen::Isometry3d A;
    if (!pose_at(hand, camera_time[i] + out.offset, gap, &A)) continue;
    out.rows.push_back(i), out.T_base_hand.push_back(A);
  }
  return out;
}

}  // namespace truing
