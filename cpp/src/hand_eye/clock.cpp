// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Two clocks: hand and board turn at the same speed whatever the frames; then the loop closes best.

#include <algorithm>
#include <cmath>
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

constexpr double kAlike = 0.6;        // least correlation of two angular speeds that are of one motion
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

/// Angular speed [rad/s] on a grid from `begin`, by differences over about `step`; NaN outside the record.
std::vector<double> angular_speed(const Record& r, double begin, double step, std::size_t count);

/// Hand's pose at a time between two of its rows; false outside, and in holes.
bool pose_at(const Record& r, double t, double largest_gap, Eigen::Isometry3d* out) {
  const auto after = std::upper_bound(r.time.begin(), r.time.end(), t);
  if (after == r.time.begin() || after == r.time.end()) return false;
  const auto j = static_cast<std::size_t>(after - r.time.begin()), i = j - 1;
  if (r.time[j] - r.time[i] > largest_gap) return false;
  const double share = (t - r.time[i]) / (r.time[j] - r.time[i]);
  out->setIdentity();
  out->linear() =
      Eigen::Quaterniond(r.pose[i].linear()).slerp(share, Eigen::Quaterniond(r.pose[j].linear())).toRotationMatrix();
  out->translation() = (1.0 - share) * r.pose[i].translation() + share * r.pose[j].translation();
  return true;
}

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

}  // namespace

ClockOffset handeye_clock(const std::vector<double>& hand_time, const std::vector<Eigen::Isometry3d>& T_base_hand,
                          const std::vector<double>& camera_time, const std::vector<Eigen::Isometry3d>& T_camera_board,
                          HandEyeSetup setup, double search) {
  const Record hand{hand_time, T_base_hand}, camera{camera_time, T_camera_board};
  check(hand, "the hand's record"), check(camera, "the camera's record");
  if (!(search > 0.0)) throw std::invalid_argument("search must be greater than 0 s");
  ClockOffset out;

  // Both speeds on one grid of the slower clock's step; the hand's grid begins `search` earlier.
  const double step = std::max(median_step(hand_time), median_step(camera_time));
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(search / step));
  const auto count = static_cast<std::size_t>((camera_time.back() - camera_time.front()) / step) + 1;
  const std::vector<double> camera_speed = angular_speed(camera, camera_time.front(), step, count);
  const std::vector<double> hand_speed = angular_speed(hand, camera_time.front() - step * static_cast<double>(reach),
                                                       step, count + 2 * static_cast<std::size_t>(reach));
  const auto known = [](const std::vector<double>& speed) {
    return static_cast<std::size_t>(
        std::count_if(speed.begin(), speed.end(), [](double v) { return std::isfinite(v); }));
  };
  const std::size_t shorter = std::max<std::size_t>(10, std::min(known(camera_speed), known(hand_speed)));
  std::vector<double> peak;
  for (std::ptrdiff_t shift = 0; shift <= 2 * reach; ++shift)
    peak.push_back(correlation(hand_speed, camera_speed, shift, shorter));
  const auto top = std::max_element(peak.begin(), peak.end());
  const std::ptrdiff_t at = top - peak.begin();
  out.offset = step * static_cast<double>(at - reach);
  out.correlation = *top;
  // The next peak: away from this one's own slopes.
  std::ptrdiff_t left = at, right = at;
  while (left > 0 && peak[static_cast<std::size_t>(left - 1)] < peak[static_cast<std::size_t>(left)]) --left;
  while (right + 1 < static_cast<std::ptrdiff_t>(peak.size()) &&
         peak[static_cast<std::size_t>(right + 1)] < peak[static_cast<std::size_t>(right)])
    ++right;
  double next = -1.0;
  for (std::ptrdiff_t k = 0; k < static_cast<std::ptrdiff_t>(peak.size()); ++k)
    if (k < left || k > right) next = std::max(next, peak[static_cast<std::size_t>(k)]);
  if (out.correlation < kAlike || out.correlation - next < kStandsOut) {
    out.message = "the turning of hand and board do not show which times belong together (correlation " +
                  number(out.correlation, 3) + " at " + number(out.offset, 4) + " s, " + number(next, 3) +
                  " elsewhere): turn the hand back and forth, at 1 rad/s or more, unevenly, within " +
                  number(search, 3) + " s of both records' common time";
    return out;
  }

  // The loop closes best: camera, board and offset together.
  const double gap = kGap * median_step(hand_time), nudge = 0.25 * median_step(hand_time);
  const std::size_t stride = std::max<std::size_t>(1, camera_time.size() / kFitted);
  LoopEstimate fit;
  for (int iteration = 0; iteration < 20; ++iteration) {
    LoopProblem problem;
    problem.setup = setup;
    Frames before, after;
    for (std::size_t i = 0; i < camera_time.size(); i += stride) {
      Eigen::Isometry3d A, a, b;
      const double t = camera_time[i] + out.offset;
      if (!pose_at(hand, t, gap, &A) || !pose_at(hand, t - nudge, gap, &a) || !pose_at(hand, t + nudge, gap, &b))
        continue;
      problem.A.push_back(A), problem.B.push_back(T_camera_board[i]), before.push_back(a), after.push_back(b);
    }
    if (problem.A.size() < 10) {
      out.message = "the two records share fewer than 10 poses";
      return out;
    }
    problem.M = moving_frames(problem.A, setup);
    Rows rows(problem.A.size());
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i;
    const Eigen::Isometry3d X = iteration == 0 ? solve_camera(problem.M, problem.B, rows).X : fit.X;
    const Eigen::Isometry3d Y = iteration == 0 ? mean_board(problem.M, problem.B, rows, X) : fit.Y;
    fit = refine_loop(problem, rows, X, Y, iteration == 0 ? LoopNoise{} : fit.noise, 50);
    if (fit.singular) {
      out.message = "camera and board are not observable: turn the hand about two axes";
      return out;
    }
    const Frames M_before = moving_frames(before, setup), M_after = moving_frames(after, setup);
    const OneMore offset = one_more_unknown(problem, rows, fit, [&](std::size_t i) {
      return Vector6d((closure(predicted_board(fit.X, M_after[i], fit.Y), problem.B[i]) -
                       closure(predicted_board(fit.X, M_before[i], fit.Y), problem.B[i])) /
                      (2.0 * nudge));
    });
    if (!std::isfinite(offset.value)) {
      out.message = "the offset cannot be told from where camera and board are: turn the hand back and forth";
      return out;
    }
    const double change = std::clamp(offset.value, -2.0 * step, 2.0 * step);
    out.offset += change, out.sigma = offset.sigma;
    if (std::abs(change) < 1e-3 * out.sigma) break;
  }
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
