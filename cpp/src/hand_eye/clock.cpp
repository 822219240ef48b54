// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Two clocks: hand and board turn at the same speed whatever the frames; then the loop closes best.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "hand_eye/closed_form.hpp"
#include "hand_eye/refine.hpp"
#include "math/frame.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "rooms.hpp"
#include "truing/handeye.hpp"

namespace truing {
using namespace hand_eye;

namespace {

constexpr double kOneMotion = 0.6;    // least correlation of two angular speeds that are of one motion
constexpr double kStandsOut = 0.05;   // by which it must exceed the next peak
constexpr std::size_t kFitted = 400;  // camera poses in the fit
constexpr double kGap = 5.0;          // median steps: holes in the hand's record that are not bridged

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

/// Angular speed [rad/s] on a grid from `begin`, by differences over about `step`; NaN outside the record.
std::vector<double> angular_speed(const Record& r, double begin, double step, std::size_t count) {
  std::vector<double> out(count, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t k = 0; k < count; ++k) {
    const double t = begin + step * static_cast<double>(k);
    Eigen::Isometry3d a, b;
    if (pose_at(r, t - step, 1e300, &a) && pose_at(r, t + step, 1e300, &b))
      out[k] = vector_from_rotation(b.linear() * a.linear().transpose()).norm() / (2.0 * step);
  }
  return out;
}

/// Correlation of hand[k + shift] with camera[k] where both are; -1 where that is less than two fifths of the shorter.
double correlation(const std::vector<double>& hand, const std::vector<double>& camera, std::ptrdiff_t shift,
                   std::size_t shorter) {
  double n = 0.0, a = 0.0, b = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t k = 0; k < camera.size(); ++k) {
    const std::ptrdiff_t j = static_cast<std::ptrdiff_t>(k) + shift;
    if (j < 0 || j >= static_cast<std::ptrdiff_t>(hand.size())) continue;
    const double x = hand[static_cast<std::size_t>(j)], y = camera[k];
    if (!std::isfinite(x) || !std::isfinite(y)) continue;
    n += 1.0, a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
  }
  const double spread = std::sqrt(std::max(0.0, aa - a * a / n) * std::max(0.0, bb - b * b / n));
  return n >= 0.4 * static_cast<double>(shorter) && spread > 0.0 ? (ab - a * b / n) / spread : -1.0;
}

// ---- A start: angular speeds ---------------------------------------------------------------------------------------

/// Where the angular speeds of the two records agree best.
struct Peak {
  double step;         ///< of the grid [s]
  double offset;       ///< [s]
  double correlation;  ///< there
  double next;         ///< the largest one away from its slopes
};

std::size_t known(const std::vector<double>& speed) {
  return static_cast<std::size_t>(std::count_if(speed.begin(), speed.end(), [](double v) { return std::isfinite(v); }));
}

/// The largest value that is not on the slopes of the one `at`; -1: there is none.
double next_peak(const std::vector<double>& values, std::size_t at) {
  std::size_t left = at, right = at;
  while (left > 0 && values[left - 1] < values[left]) --left;
  while (right + 1 < values.size() && values[right + 1] < values[right]) ++right;
  double next = -1.0;
  for (std::size_t k = 0; k < values.size(); ++k)
    if (k < left || k > right) next = std::max(next, values[k]);
  return next;
}

/// Both speeds on one grid of the slower clock's step; the hand's grid begins `search` earlier.
Peak find_peak(const Record& hand, const Record& camera, double search) {
  const double step = std::max(median_step(hand.time), median_step(camera.time));
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(search / step));
  const auto count = static_cast<std::size_t>((camera.time.back() - camera.time.front()) / step) + 1;
  const std::vector<double> camera_speed = angular_speed(camera, camera.time.front(), step, count);
  const std::vector<double> hand_speed = angular_speed(hand, camera.time.front() - step * static_cast<double>(reach),
                                                       step, count + 2 * static_cast<std::size_t>(reach));
  const std::size_t shorter = std::max<std::size_t>(10, std::min(known(camera_speed), known(hand_speed)));
  std::vector<double> values;
  for (std::ptrdiff_t shift = 0; shift <= 2 * reach; ++shift)
    values.push_back(correlation(hand_speed, camera_speed, shift, shorter));
  const std::ptrdiff_t at = std::max_element(values.begin(), values.end()) - values.begin();
  return {step, step * static_cast<double>(at - reach), values[static_cast<std::size_t>(at)],
          next_peak(values, static_cast<std::size_t>(at))};
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

/// Camera, board and offset together, from the offset on; `step` bounds its changes. Empty, or why there is no answer.
std::string close_loop(const Record& hand, const Record& camera, HandEyeSetup setup, double step, double gap,
                       ClockOffset* out) {
  LoopEstimate fit;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const Paired pairs = pair_at(hand, camera, setup, out->offset, gap);
    const LoopProblem& problem = pairs.problem;
    if (problem.A.size() < 10) return "the two records share fewer than 10 poses";
    const Eigen::Isometry3d X = iteration == 0 ? solve_camera(problem.M, problem.B, pairs.rows).X : fit.X;
    const Eigen::Isometry3d Y = iteration == 0 ? mean_board(problem.M, problem.B, pairs.rows, X) : fit.Y;
    fit = refine_loop(problem, pairs.rows, X, Y, iteration == 0 ? LoopNoise{} : fit.noise, 50);
    if (fit.singular) return "camera and board are not observable: turn the hand about two axes";
    const OneMore offset = offset_change(pairs, fit);
    if (!std::isfinite(offset.value))
      return "the offset cannot be told from where camera and board are: turn the hand back and forth";
    const double change = std::clamp(offset.value, -2.0 * step, 2.0 * step);
    out->offset += change, out->sigma = offset.sigma;
    if (std::abs(change) < 1e-3 * out->sigma) break;
  }
  return {};
}

}  // namespace

ClockOffset handeye_clock(const std::vector<double>& hand_time, const std::vector<Eigen::Isometry3d>& T_base_hand,
                          const std::vector<double>& camera_time, const std::vector<Eigen::Isometry3d>& T_camera_board,
                          HandEyeSetup setup, double search) {
  const Record hand{hand_time, T_base_hand}, camera{camera_time, T_camera_board};
  check(hand, "the hand's record"), check(camera, "the camera's record");
  if (!(search > 0.0)) throw std::invalid_argument("search must be greater than 0 s");
  const Peak peak = find_peak(hand, camera, search);
  ClockOffset out;
  out.offset = peak.offset;
  out.correlation = peak.correlation;
  if (peak.correlation < kOneMotion || peak.correlation - peak.next < kStandsOut) {
    out.message = "the turning of hand and board do not show which times belong together (correlation " +
                  number(out.correlation, 3) + " at " + number(out.offset, 4) + " s, " + number(peak.next, 3) +
                  " elsewhere): turn the hand back and forth, at 1 rad/s or more, unevenly, within " +
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
