// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/orders.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <memory>

#include "math/batch.hpp"
#include "math/constants.hpp"
#include "math/random.hpp"
#include "math/statistics.hpp"
#include "model/effects/traits.hpp"

namespace truing::diagnosis {
namespace {

constexpr std::size_t kOrdersAtATime = 16;
constexpr double kWaves = 2.0;      // at least, in a joint's travel: of less, any bent curve is a part
constexpr double kOneAngle = 3e-4;  // angles that lie closer are one [rad]: a tenth of a radian of the shortest wave
constexpr double kJointIsIn = 3.0;  // nats that a joint must win to be among those that share an order
constexpr std::size_t kMostOthers = 6;
constexpr double kInvisible = 1e-6;  // share of a wave beyond the state's columns, that rounding may have made
constexpr double kScales[] = {1.0, 0.1, 0.01, 0.001};  // of kLargest: sizes that a wave may have

/// Waves that differ by less in order are one peak: the first zero of sin(x) / x over the travel, halved.
double width_of(const Sampling& sampling) { return kPi / sampling.travel; }

/// Cosine and sine of an order at a joint: their Gram and right side, beyond the state's columns.
struct Wave {
  double cc = 0.0, cs = 0.0, ss = 0.0, c = 0.0, s = 0.0;

  /// Of the sum of squares, with so much added to the Gram's diagonal.
  double fall(double ridge) const {
    const double a = cc + ridge, b = ss + ridge;
    return (b * c * c - 2.0 * cs * c * s + a * s * s) / (a * b - cs * cs);
  }
  /// Plain least squares, for all that rounding leaves of it.
  double fall() const { return cc + ss > 0.0 ? fall(1e-9 * (cc + ss)) : 0.0; }
};

/// Log Bayes factor of a wave, with the state as it is seen, where noise is `background` times that of the state.
double nats_of(const Wave& wave, const Evidence::State& seen, double freedom, double background) {
  const double rss = seen.rss * background;
  double best = 0.0;
  if (wave.fall() < 2.0 * seen.sigma2 * background) return best;  // an everyday chi-squared of two degrees of freedom
  for (const double scale : kScales) {
    double sigma2 = seen.sigma2 * background, value = 0.0;
    for (int round = 0; round < 2; ++round) {
      const double ridge = sigma2 / (scale * scale * kLargest * kLargest);
      const double less = std::min(wave.fall(ridge), rss * (1.0 - 1e-9));
      const double determinant = (wave.cc + ridge) * (wave.ss + ridge) - wave.cs * wave.cs;
      value = -0.5 * freedom * std::log1p(-less / rss) + std::log(ridge) - 0.5 * std::log(determinant);
      sigma2 = (rss - less) / freedom;
    }
    best = std::max(best, value);
  }
  return best;
}

/// Times the state's noise, what is left has around every order: an order has to stand out from what its neighbours
/// have, or any curve with corners would be one. The median over the neighbours (that of a chi-squared of two degrees
/// of freedom is 2 log 2), and of it one half: the other may be lines of this and other joints that are still to be
/// found.
std::vector<double> backgrounds(const std::vector<Wave>& waves, double sigma2, double step, double width) {
  constexpr double kAround = 40.0, kWidths = 12.0;  // orders on either side, at least; and in widths of a peak
  constexpr std::size_t kEvery = 8;                 // of the orders has a median of its own
  const auto around = static_cast<std::size_t>(std::max(kAround, kWidths * width) / step);
  constexpr double kBroad = 0.5;  // part of the median that is taken for broad
  std::vector<double> squares, out(waves.size());
  for (const Wave& wave : waves) squares.push_back(wave.fall() / sigma2);
  for (std::size_t k = 0; k < waves.size(); ++k) {
    if (k % kEvery != 0) {
      out[k] = out[k - 1];
      continue;
    }
    const std::size_t first = k > around ? k - around : 0, last = std::min(squares.size(), k + around + 1);
    const auto from = squares.begin() + static_cast<std::ptrdiff_t>(first),
               to = squares.begin() + static_cast<std::ptrdiff_t>(last);
    out[k] = std::max(1.0, kBroad * median_of(std::vector<double>(from, to)) / (2.0 * std::log(2.0)));
  }
  return out;
}

/// What is left, seen through one joint: values of one row go together, for they have one angle.
class JointView {
 public:
  JointView(const Design& design, const Left& left, const InputColumn& input, std::size_t joint, double times)
      : times_(times) {
    const auto p = left.span.cols();
    const auto [angle, row_of] = angles_of(design, left, input);
    angle_ = Eigen::Map<const Eigen::ArrayXd>(angle.data(), static_cast<Eigen::Index>(angle.size()));
    right_.setZero(angle_.size(), p + 1);
    squares_.setZero(angle_.size());
    for (std::size_t n = 0; n < left.at.size(); ++n) {
      const Eigen::Index i = left.at[n], row = row_of[n], at = static_cast<Eigen::Index>(n);
      const double d = design.weight[i] * design.x(i, design.joint_column[joint][0]);
      right_.row(row).head(p) += d * left.span.row(at);
      right_(row, p) += d * left.residual[at];
      squares_[row] += d * d;
    }
  }

  std::vector<Wave> waves(double first, double step, std::size_t count) const {
    std::vector<Wave> out;
    for (std::size_t k = 0; k < count; k += kOrdersAtATime)
      add_waves(first + static_cast<double>(k) * step, step, std::min(kOrdersAtATime, count - k), &out);
    return out;
  }

 private:
  /// Waves of orders follow from each other: z(k + h) = z(k) z(h).
  void add_waves(double first, double step, std::size_t count, std::vector<Wave>* out) const {
    const auto p = right_.cols() - 1;
    Eigen::MatrixXd waves(angle_.size(), static_cast<Eigen::Index>(2 * count));
    const Eigen::ArrayXd cos_step = (angle_ * step).cos(), sin_step = (angle_ * step).sin();
    Eigen::ArrayXd c = (angle_ * first).cos(), s = (angle_ * first).sin(), next(angle_.size());
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(count); ++k) {
      waves.col(2 * k) = c;
      waves.col(2 * k + 1) = s;
      next = c * cos_step - s * sin_step;
      s = s * cos_step + c * sin_step;
      c = next;
    }
    const Eigen::MatrixXd sums = right_.transpose() * waves;
    const double all = squares_.sum();
    for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(count); ++k) {
      const auto cosine = waves.col(2 * k).array(), sine = waves.col(2 * k + 1).array();
      const double cc = (cosine.square() * squares_).sum(), cs = (cosine * sine * squares_).sum();
      const auto u = sums.col(2 * k).head(p), v = sums.col(2 * k + 1).head(p);
      const double seen = all - u.squaredNorm() - v.squaredNorm();
      if (!(seen > kInvisible * all)) {
        out->emplace_back();
        continue;
      }
      out->push_back({times_ * (cc - u.squaredNorm()), times_ * (cs - u.dot(v)), times_ * (all - cc - v.squaredNorm()),
                      times_ * sums(p, 2 * k), times_ * sums(p, 2 * k + 1)});
    }
  }

  struct Angles {
    std::vector<double> angle;         ///< of every row
    std::vector<Eigen::Index> row_of;  ///< of every value
  };
  static Angles angles_of(const Design& design, const Left& left, const InputColumn& input) {
    Angles out;
    std::int32_t last = -1;
    for (const Eigen::Index i : left.at) {
      const std::int32_t row = design.row[static_cast<std::size_t>(i)];
      if (row != last) out.angle.push_back(input.values[static_cast<std::size_t>(row)]);
      last = row;
      out.row_of.push_back(static_cast<Eigen::Index>(out.angle.size()) - 1);
    }
    return out;
  }

  double times_;  ///< a value counts for
  Eigen::ArrayXd angle_;
  Eigen::MatrixXd right_;   ///< what the state spans and the residual, times the joint's column: a row each
  Eigen::ArrayXd squares_;  ///< of the joint's column
};

const InputColumn* motion_of_joint(const std::vector<InputColumn>& inputs, std::size_t joint) {
  const std::string name = input_name(Driver::angle, joint);
  const auto found =
      std::find_if(inputs.begin(), inputs.end(), [&](const InputColumn& input) { return input.name == name; });
  return found == inputs.end() ? nullptr : &*found;
}

/// In increasing order, each once.
std::vector<double> distinct_angles(const Design& design, const InputColumn& input) {
  std::vector<double> out;
  for (std::size_t i = 0; i < design.row.size(); ++i) {
    if (design.fold[i] < design.folds && (i == 0 || design.row[i] != design.row[i - 1]))
      out.push_back(input.values[static_cast<std::size_t>(design.row[i])]);
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end(), [](double a, double b) { return b - a < kOneAngle; }), out.end());
  return out;
}

/// The smallest t at which |mean of exp(i t q)| is one again: cos and sin of k q and of (t - k) q are then the same on
/// these angles, as are those of (t + k) q. 0: there is none up to the sum of two orders. Of many angles some are
/// drawn: every n-th of an even grid would be a coarser grid.
double repeat_of(const std::vector<double>& angles, double travel) {
  constexpr std::size_t kEnough = 128;
  constexpr double kTheSame = 0.98;
  Random random(1);
  const double step = kPi / (8.0 * travel), first = 4.0 * kPi / travel;
  Eigen::ArrayXcd wave(static_cast<Eigen::Index>(std::min(kEnough, angles.size()))), turn(wave.size());
  for (Eigen::Index n = 0; n < wave.size(); ++n) {
    const std::size_t at = angles.size() > kEnough ? random.below(angles.size()) : static_cast<std::size_t>(n);
    const double angle = angles[at] - angles.front();
    wave[n] = std::polar(1.0, first * angle);
    turn[n] = std::polar(1.0, step * angle);
  }
  double last = 0.0;
  for (double t = first; t <= 2.0 * kHighestOrder; t += step, wave *= turn) {
    const double now = std::abs(wave.mean());
    if (last > kTheSame && now < last) return t - step;
    last = now;
  }
  return 0.0;
}

bool is_scanned(const Sampling& sampling) {
  return sampling.angles > kFewAngles && sampling.lowest <= kHighestOrder && sampling.travel <= kMostTravel;
}

double log_sum(double a, double b) {
  const double larger = std::max(a, b);
  return larger + std::log1p(std::exp(std::min(a, b) - larger));
}

}  // namespace

std::vector<Sampling> samplings(const Design& design, const std::vector<InputColumn>& inputs, const Robot& robot) {
  std::vector<Sampling> out;
  for (std::size_t joint = 0; joint < robot.joints.size(); ++joint) {
    const InputColumn* motion = motion_of_joint(inputs, joint);
    const Joint& of = robot.joints[joint];
    if (!motion || motion->constant || of.type != JointType::revolute || of.passive() ||
        design.joint_column[joint].empty())
      continue;
    const std::vector<double> angles = distinct_angles(design, *motion);
    if (angles.size() < 2) continue;
    Sampling one;
    one.joint = joint;
    one.angles = angles.size();
    one.travel = angles.back() - angles.front();
    one.lowest = std::max(kLowestOrder, kWaves * kTwoPi / one.travel);
    one.repeats = one.travel > kMostTravel ? 0.0 : repeat_of(angles, one.travel);
    out.push_back(one);
  }
  return out;
}

OrderScan::OrderScan(const Design& design, const Evidence& evidence, const Evidence::State& state,
                     const std::vector<InputColumn>& inputs, const std::vector<Sampling>& samplings,
                     double design_effect, int threads, std::size_t most_values) {
  double travel = 0.0;
  for (const Sampling& sampling : samplings) {
    if (is_scanned(sampling)) travel = std::max(travel, sampling.travel);
  }
  // Between two orders of the scan no more than a fifth of a wave's square is lost; and halves of integers are in it.
  double step = 0.5;
  while (step * travel > 4.0) step *= 0.5;
  for (double order = kLowestOrder; order <= kHighestOrder; order += step) orders_.push_back(order);
  const Left left = what_is_left(design, state, most_values);
  if (left.at.empty()) return;
  const double times = 1.0 / (left.share * design_effect);
  const Evidence::State seen = seen_on(left, evidence, state, times);
  const double freedom = evidence.degrees_of_freedom();
  for (const Sampling& sampling : samplings) {
    if (is_scanned(sampling)) joints_.push_back({sampling, {}, {}, {}});
  }
  const auto scan = [&](std::size_t j) {
    AtJoint& one = joints_[j];
    const Sampling& sampling = one.sampling;
    const auto view = std::make_shared<const JointView>(design, left, *motion_of_joint(inputs, sampling.joint),
                                                        sampling.joint, times);
    const std::vector<Wave> waves = view->waves(orders_[0], step, orders_.size());
    const std::vector<double> background = backgrounds(waves, seen.sigma2, step, width_of(sampling));
    for (std::size_t k = 0; k < waves.size(); ++k) {
      one.nats.push_back(nats_of(waves[k], seen, freedom, background[k]));
      one.in_noise.push_back(nats_of(waves[k], seen, freedom, 1.0));
    }
    one.between = [=, first = orders_[0]](double from, double apart, std::size_t count) {
      const double at = std::clamp((from - first) / step, 0.0, static_cast<double>(background.size() - 1));
      std::vector<double> nats;
      for (const Wave& wave : view->waves(from, apart, count))
        nats.push_back(nats_of(wave, seen, freedom, background[static_cast<std::size_t>(at)]));
      return nats;
    };
    for (std::size_t k = 0; k < orders_.size() && orders_[k] < sampling.lowest; ++k) one.nats[k] = 0.0;
  };
  math::for_each_on_threads(joints_.size(), threads, {}, scan, 1);
}

double OrderScan::chance_of(const OrderAt& order) {
  const double sizes = std::pow(static_cast<double>(std::size(kScales)), static_cast<double>(order.joints.size()));
  return std::min(1.0, sizes * std::exp(-order.score));
}

/// Of every order, before the data: any may be; those that a gear makes are likelier; and those that a gear of this
/// robot makes likelier again.
std::vector<double> OrderScan::log_prior(const std::vector<OrderAt>& known) const {
  std::vector<double> out(orders_.size(), kOtherOrders / static_cast<double>(orders_.size()));
  const double step = orders_[1] - orders_[0];
  const auto add = [&](double order, double probability) {
    const auto k = static_cast<std::size_t>(std::lround((order - orders_[0]) / step));
    if (order >= kLowestOrder && k < out.size()) out[k] += probability;
  };
  for (const LikelyOrder& likely : likely_orders()) add(likely.order, (1.0 - kOtherOrders) * likely.probability);
  if (!known.empty()) {
    for (double& probability : out) probability *= 0.5;
    std::vector<double> related;
    for (const OrderAt& one : known) {
      related.push_back(one.order);
      for (const double other : related_orders(one.order)) related.push_back(other);
    }
    std::sort(related.begin(), related.end());
    related.erase(std::unique(related.begin(), related.end()), related.end());
    for (const double order : related) add(order, 0.5 / static_cast<double>(related.size()));
  }
  for (double& probability : out) probability = std::log(probability);
  return out;
}

/// An order at the joints `at` of the scan: its peak as a whole, and others that fit about as well.
OrderAt OrderScan::described(const std::vector<double>& prior, const std::vector<std::size_t>& at, std::size_t order,
                             double cost) const {
  OrderAt out;
  out.order = out.low = out.high = orders_[order];
  out.tried = orders_.size();
  std::vector<double> nats(orders_.size(), 0.0);
  double width = 1e300, in_noise = 0.0;
  for (const std::size_t j : at) {
    out.joints.push_back(joints_[j].sampling.joint);
    width = std::min(width, width_of(joints_[j].sampling));
    in_noise += joints_[j].in_noise[order];
    for (std::size_t k = 0; k < nats.size(); ++k) nats[k] += joints_[j].nats[k];
  }
  out.nats = nats[order];
  const auto near = [&](std::size_t k) { return std::abs(orders_[k] - orders_[order]) <= 2.0 * width; };
  double peak = -1e300;
  for (std::size_t k = 0; k < nats.size(); ++k) {
    if (!near(k)) continue;
    peak = log_sum(peak, prior[k] + nats[k]);
    if (nats[k] < nats[order] - kAsWell) continue;
    out.low = std::min(out.low, orders_[k]);
    out.high = std::max(out.high, orders_[k]);
  }
  out.score = peak - cost;
  out.in_noise = out.score + in_noise - out.nats;
  std::vector<std::pair<double, double>> others;
  for (std::size_t k = 1; k + 1 < nats.size(); ++k) {
    const double value = prior[k] + nats[k];
    const bool is_peak = value >= prior[k - 1] + nats[k - 1] && value > prior[k + 1] + nats[k + 1];
    if (is_peak && !near(k) && nats[k] > nats[order] - kAsWell) others.emplace_back(-value, orders_[k]);
  }
  std::sort(others.begin(), others.end());
  for (std::size_t k = 0; k < std::min(others.size(), kMostOthers); ++k) out.stands_for.push_back(others[k].second);
  return out;
}

/// What gears of one ratio do not make lies between the orders of the scan.
void OrderScan::refine(const std::vector<std::size_t>& at, double prior, OrderAt* out) const {
  constexpr int kParts = 10;
  const double step = (orders_[1] - orders_[0]) / kParts, first = out->order - kParts * step;
  std::vector<double> nats(2 * kParts + 1, 0.0);
  for (const std::size_t j : at) {
    const std::vector<double> here = joints_[j].between(first, step, nats.size());
    for (std::size_t k = 0; k < nats.size(); ++k) nats[k] += here[k];
  }
  const auto best = static_cast<std::size_t>(std::max_element(nats.begin(), nats.end()) - nats.begin());
  const double anywhere = std::log(kOtherOrders / static_cast<double>(orders_.size() * kParts));
  const double gain = anywhere + nats[best] - prior - out->nats;
  if (!(gain > 0.0)) return;
  out->order = std::round((first + static_cast<double>(best) * step) / step) * step;
  out->order = std::round(1e6 * out->order) / 1e6;
  out->nats = nats[best];
  out->score += gain;
}

/// Of the joints: at one of them, or at each of them or not, as by a coin.
double OrderScan::search_cost(std::size_t joints) const {
  const auto all = static_cast<double>(joints_.size());
  return joints == 1 ? std::log(2.0 * all) : (1.0 + all) * std::log(2.0);
}

OrderAt OrderScan::best(const std::vector<OrderAt>& known, const std::vector<OrderAt>& passed_over) const {
  if (joints_.empty()) return {};
  const std::vector<double> prior = log_prior(known);
  const double cost_of_one = search_cost(1), cost_of_several = search_cost(2);
  const auto is_in = [&](const std::vector<OrderAt>& orders, std::size_t j, double order) {
    return std::any_of(orders.begin(), orders.end(), [&](const OrderAt& one) {
      const bool here = std::find(one.joints.begin(), one.joints.end(), joints_[j].sampling.joint) != one.joints.end();
      return here && std::abs(one.order - order) <= width_of(joints_[j].sampling);
    });
  };
  double best = -1e300, cost = 0.0;
  std::size_t best_order = 0;
  std::vector<std::size_t> best_at;
  for (std::size_t k = 0; k < orders_.size(); ++k) {
    std::vector<std::size_t> several;
    double together = 0.0;
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const double nats = joints_[j].nats[k];
      if (!(nats > 0.0) || is_in(known, j, orders_[k]) || is_in(passed_over, j, orders_[k])) continue;
      if (prior[k] + nats - cost_of_one > best) {
        best = prior[k] + nats - cost_of_one;
        cost = cost_of_one;
        best_order = k;
        best_at = {j};
      }
      if (!(nats > kJointIsIn)) continue;
      several.push_back(j);
      together += nats;
    }
    if (several.size() > 1 && prior[k] + together - cost_of_several > best) {
      best = prior[k] + together - cost_of_several;
      cost = cost_of_several;
      best_order = k;
      best_at = several;
    }
  }
  if (best_at.empty()) return {};
  OrderAt out = described(prior, best_at, best_order, cost);
  refine(best_at, prior[best_order], &out);
  return out;
}

OrderAt OrderScan::again(const OrderAt& one, const std::vector<OrderAt>& known) const {
  const std::vector<double> prior = log_prior(known);
  std::vector<std::size_t> at;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const std::size_t joint = joints_[j].sampling.joint;
    if (std::find(one.joints.begin(), one.joints.end(), joint) != one.joints.end()) at.push_back(j);
  }
  double best = -1e300;
  std::size_t order = 0;
  for (std::size_t k = 0; k < orders_.size(); ++k) {
    if (orders_[k] < one.low || orders_[k] > one.high) continue;
    double value = prior[k];
    for (const std::size_t j : at) value += joints_[j].nats[k];
    if (value <= best) continue;
    best = value;
    order = k;
  }
  if (at.size() != one.joints.size() || best == -1e300) return one;
  OrderAt out = described(prior, at, order, search_cost(at.size()));
  refine(at, prior[order], &out);
  return out;
}

}  // namespace truing::diagnosis
