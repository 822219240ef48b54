// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Order analysis (Brandt, Noise and vibration analysis, 2011, chapter 12): a spectrum over the joint's angle in place
// of time, in which what turns with the joint, or a whole number of times as fast, is a line at every speed.

#include "dynamics/orders.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include <unsupported/Eigen/FFT>

#include "math/batch.hpp"
#include "math/constants.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index kAngleTurns = 2;      ///< of the joint that the angle is taken over: orders are halves
constexpr Index kBinsPerTurn = 1024;  ///< four for a wave of the highest order
constexpr double kLeastOrder = 6.0;   ///< lower ones are laws of the joint's angle, which the catalogue has
constexpr double kMostOrder = 256.0;
constexpr std::size_t kClasses = 14;    ///< of rows, by the highest order that the low-pass leaves in them
constexpr double kLeastRows = 0.15;     ///< of a joint's rows that show an order
constexpr double kNearLine = 1.5;       ///< orders beside a line that are part of it
constexpr double kChance = 0.003;       ///< that a joint without such waves has a line
constexpr double kLeastShare = 0.005;   ///< of what is left: less is nothing to look for
constexpr std::size_t kMostOrders = 3;  ///< of a joint

/// The highest order that rows of each class show.
std::array<double, kClasses> orders_of_classes() {
  std::array<double, kClasses> out{};
  for (std::size_t c = 0; c < out.size(); ++c)
    out[c] = kLeastOrder * std::pow(kMostOrder / kLeastOrder, static_cast<double>(c) / (kClasses - 1.0));
  return out;
}

/// Of this joint's errors, sums by its angle, with and without the sign of its motion.
class AngleSums {
 public:
  void add(double angle, double speed, double error, double cutoff) {
    squares_ += error * error;
    ++rows_;
    lower_ = std::min(lower_, angle);
    upper_ = std::max(upper_, angle);
    const double shown = kTwoPi * cutoff / std::abs(speed);
    const auto above = std::upper_bound(shown_.begin(), shown_.end(), shown);
    if (above == shown_.begin()) return;
    Class& one = classes_[static_cast<std::size_t>(above - shown_.begin() - 1)];
    const double turns = angle / (kTwoPi * kAngleTurns);
    const auto bin = std::min<Index>(static_cast<Index>((turns - std::floor(turns)) * kAngleBins), kAngleBins - 1);
    if (one.rows == 0.0) one.sums.fill(std::vector<double>(kAngleBins, 0.0));
    ++one.rows;
    one.sums[0][static_cast<std::size_t>(bin)] += error;
    one.sums[1][static_cast<std::size_t>(bin)] += speed > 0.0 ? error : -error;
  }

  double rows() const { return rows_; }
  double squares() const { return squares_; }
  double travel() const { return rows_ > 0.0 ? upper_ - lower_ : 0.0; }

  /// |sum of error exp(-i order angle)|, by order, over rows that show it; `rows`: how many.
  VectorXd lines(std::size_t with_direction, VectorXd* rows) const {
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(kOrders);
    *rows = VectorXd::Zero(kOrders);
    Eigen::FFT<double> transform;
    std::vector<std::complex<double>> spectrum;
    for (std::size_t c = 0; c < kClasses; ++c) {
      const Class& one = classes_[c];
      if (one.rows == 0.0) continue;
      const Index shown = std::min(kOrders, static_cast<Index>(kAngleTurns * shown_[c] + 1e-9) + 1);
      transform.fwd(spectrum, one.sums[with_direction]);
      sum.head(shown) += Eigen::Map<const Eigen::VectorXcd>(spectrum.data(), shown);
      rows->head(shown).array() += one.rows;
    }
    return sum.cwiseAbs();
  }

  static constexpr Index kAngleBins = kAngleTurns * kBinsPerTurn;
  static constexpr Index kOrders =
      static_cast<Index>(kMostOrder) * kAngleTurns;  ///< from 0 in steps of 1 / kAngleTurns

 private:
  struct Class {
    double rows = 0.0;
    std::array<std::vector<double>, 2> sums;
  };
  std::array<double, kClasses> shown_ = orders_of_classes();
  std::array<Class, kClasses> classes_;
  double rows_ = 0.0, squares_ = 0.0;
  double lower_ = std::numeric_limits<double>::infinity(), upper_ = -lower_;
};

/// A line of the spectrum.
struct Line {
  TorqueOrder order;
  double above = 0.0;  ///< squares, to those around it
};

/// The spectrum of a joint's errors over its angle.
struct Spectrum {
  VectorXd power;  ///< squares of the sums, for a row that shows the order
  VectorXd rows;   ///< that show it
  double least_rows = 0.0;
  double near = 0.0;  ///< orders that a way of this length tells apart
};

/// What the squares of an order are to the mean of those around it, and to how many of these.
std::pair<double, double> above_those_around(const Spectrum& of, Index at) {
  const Index first = 7 * at / 10, end = std::min<Index>(of.power.size(), 7 * at / 5);
  double sum = 0.0, count = 0.0;
  for (Index k = first; k < end; ++k) {
    if (static_cast<double>(std::abs(k - at)) <= kAngleTurns * of.near || of.rows[k] < of.least_rows) continue;
    sum += of.power[k];
    ++count;
  }
  return {sum > 0.0 ? of.power[at] * count / sum : 0.0, count / (kAngleTurns * of.near)};
}

/// That the squares of a line of noise alone are so far above the mean of so many (Thomson, Spectrum estimation and
/// harmonic analysis, Proc. IEEE 70, 1982: an F ratio of 2 and 2 m degrees of freedom).
double chance_of(double above, double around) { return std::pow(1.0 + above / around, -around); }

void add_lines(const AngleSums& sums, bool with_direction, std::vector<Line>* out) {
  Spectrum of;
  const VectorXd size = sums.lines(with_direction ? 1 : 0, &of.rows);
  of.power = size.array().square() / of.rows.array().max(1.0);
  of.least_rows = kLeastRows * sums.rows();
  of.near = std::max(kNearLine, kTwoPi / sums.travel());
  const double asked = 2.0 * (kMostOrder - kLeastOrder) / of.near;
  for (auto k = static_cast<Index>(kAngleTurns * kLeastOrder); k + 1 < of.power.size(); ++k) {
    const bool top = of.power[k] >= of.power[k - 1] && of.power[k] >= of.power[k + 1];
    if (!top || of.rows[k] < of.least_rows) continue;
    const auto [above, around] = above_those_around(of, k);
    const double share = 2.0 * of.power[k] / sums.squares();
    if (around <= 0.0 || asked * chance_of(above, around) > kChance || share < kLeastShare) continue;
    out->push_back(
        {{"", static_cast<double>(k) / kAngleTurns, with_direction, 2.0 * size[k] / of.rows[k], share}, above});
  }
}

/// Lines beside a stronger one are its own: of a short way, or of a wave that comes and goes.
std::vector<TorqueOrder> strongest(std::vector<Line> lines) {
  constexpr double kBeside = 6.0;
  std::stable_sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.above > b.above; });
  std::vector<TorqueOrder> out;
  for (const Line& line : lines) {
    const bool beside = std::any_of(out.begin(), out.end(), [&](const TorqueOrder& stronger) {
      return std::abs(stronger.order - line.order.order) < kBeside;
    });
    if (!beside && out.size() < kMostOrders) out.push_back(line.order);
  }
  return out;
}

}  // namespace

std::vector<TorqueOrder> orders_left(const Problem& problem, const TorqueModel& model) {
  const Robot& robot = problem.robot;
  const double cutoff = problem.tiles.options().cutoff;
  const Eigen::VectorXd at_rest = speeds_at_rest(robot);
  std::vector<AngleSums> sums(robot.driven_count());
  std::vector<std::pair<const Tile*, Eigen::MatrixXd>> lot(Tiles::kTogether);
  const auto add = [&](const Tile& tile, const Eigen::MatrixXd& errors) {
    for (Index i = 0; i < tile.count; ++i) {
      const Index fine = (tile.first + i) * tile.stride;
      for (Index j = 0; j < errors.cols(); ++j) {
        const double speed = tile.motion.qd(fine, j);
        if (tile.moving(i, j) == 0.0 || std::isnan(errors(i, j)) || std::abs(speed) < at_rest[j]) continue;
        sums[static_cast<std::size_t>(j)].add(tile.motion.q(fine, j), speed, errors(i, j), cutoff);
      }
    }
  };
  problem.tiles.for_each(
      [](std::size_t) { return true; },
      [&](Tile& tile, std::size_t k) { lot[k] = {&tile, tile.measured - kept_torque(model, &tile)}; },
      [&](std::size_t k) { add(*lot[k].first, lot[k].second); });

  const std::vector<std::size_t> driven = robot.driven_joints();
  std::vector<std::vector<TorqueOrder>> found(sums.size());
  const auto look = [&](std::size_t j) {
    if (robot.joints[driven[j]].type != JointType::revolute) return;
    std::vector<Line> lines;
    for (const bool with_direction : {false, true}) add_lines(sums[j], with_direction, &lines);
    found[j] = strongest(std::move(lines));
    for (TorqueOrder& one : found[j]) one.joint = robot.joints[driven[j]].name;
  };
  math::for_each_on_threads(sums.size(), problem.tiles.threads(), {}, look, 1);
  std::vector<TorqueOrder> out;
  for (const std::vector<TorqueOrder>& of_joint : found) out.insert(out.end(), of_joint.begin(), of_joint.end());
  return out;
}

}  // namespace truing::dynamics
