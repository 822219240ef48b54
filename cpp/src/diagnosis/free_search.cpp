// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/free_search.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "math/batch.hpp"
#include "math/constants.hpp"
#include "math/linear_algebra.hpp"
#include "math/random.hpp"
#include "math/text.hpp"

namespace truing::diagnosis {

Left what_is_left(const Design& design, const Evidence::State& state, std::size_t most) {
  Left out;
  const SomeRows some = some_training_rows(design, most);
  out.at = some.at;
  out.share = static_cast<double>(some.at.size()) / static_cast<double>(std::max<std::size_t>(1, some.of));
  const auto p = static_cast<Eigen::Index>(state.columns.size());
  out.span.resize(static_cast<Eigen::Index>(out.at.size()), p);
  out.residual.resize(out.span.rows());
  for (Eigen::Index k = 0; k < out.span.rows(); ++k) {
    const Eigen::Index i = out.at[static_cast<std::size_t>(k)];
    for (Eigen::Index c = 0; c < p; ++c)
      out.span(k, c) = design.weight[i] * design.x(i, state.columns[static_cast<std::size_t>(c)]);
    out.residual[k] = design.weight[i] * design.y[i];
  }
  Eigen::MatrixXd d = Eigen::MatrixXd::Zero(p, p);
  d.selfadjointView<Eigen::Lower>().rankUpdate(out.span.transpose());
  d.diagonal() += state.precision * out.share + 1e-12 * d.diagonal();
  factorised(std::move(d)).matrixU().solveInPlace<Eigen::OnTheRight>(out.span);
  out.residual -= out.span * (out.span.transpose() * out.residual);
  return out;
}

Evidence::State seen_on(const Left& left, const Evidence& evidence, const Evidence::State& state, double times) {
  Evidence::State out = state;
  out.rss = std::max(left.residual.squaredNorm() * times, 1e-300);
  out.sigma2 = out.rss / evidence.degrees_of_freedom();
  return out;
}

namespace {

/// A free function's columns, before they are multiplied by the site's: sparse, at most four values a row.
struct Trial {
  Explanation what;
  std::vector<int> sites;
};

bool is_direction(const InputColumn& input) { return input.name.rfind("dir", 0) == 0; }
bool is_difference(const InputColumn& input) { return input.name.find('-') != std::string::npos; }
bool is_motion(const InputColumn& input) { return input.name[0] == 'q' && !is_difference(input); }
bool is_time(const InputColumn& input) { return input.name == "time" || input.name == "order"; }

/// Training rows, each once.
std::vector<std::int32_t> training_rows(const Design& design) {
  std::vector<std::int32_t> rows;
  for (std::size_t i = 0; i < design.row.size(); ++i) {
    if (design.fold[i] < design.folds && (i == 0 || design.row[i] != design.row[i - 1])) rows.push_back(design.row[i]);
  }
  return rows;
}

/// Every free function that is tried: so many knots along its inputs as the poses bear.
class TrialMaker {
 public:
  TrialMaker(const Design& design, const std::vector<InputColumn>& inputs, std::size_t clusters,
             const std::vector<int>& only_of)
      : design_(design), inputs_(inputs), rows_(training_rows(design)), only_of_(only_of) {
    knots_of_one_ = clusters >= 150 ? 10 : clusters >= 60 ? 7 : 4;
    const int of_two = clusters >= 150 ? 5 : clusters >= 60 ? 4 : 3;
    for (const InputColumn& input : inputs) {
      fine_.push_back(knots_of(input, rows_, knots_of_one_));
      coarse_.push_back(knots_of(input, rows_, of_two));
    }
  }

  std::vector<Trial> run(const Robot& robot) {
    for (std::size_t joint = 0; joint < robot.joints.size(); ++joint) {
      add_one_input(robot.joints[joint].name, joint);
      if (only_of_.empty()) add_two_inputs(robot.joints[joint].name, joint);
    }
    if (!design_.base_columns.empty()) add_base();
    if (!design_.turning_base_columns.empty()) add_turning_base();
    return std::move(out_);
  }

 private:
  const InputColumn& input(int k) const { return inputs_[static_cast<std::size_t>(k)]; }
  int count() const { return static_cast<int>(inputs_.size()); }
  bool is_wanted(int k) const {
    return only_of_.empty() || std::find(only_of_.begin(), only_of_.end(), k) != only_of_.end();
  }

  void add_one_input(const std::string& site, std::size_t joint) {
    for (int a = 0; a < count(); ++a) {
      if (!input(a).constant && is_wanted(a)) add(site, design_.joint_column[joint], {a});
    }
  }

  /// Any two joints; this joint's own motion, direction or torque with anything else; its direction with the load.
  void add_two_inputs(const std::string& site, std::size_t joint) {
    for (int a = 0; a < count(); ++a) {
      if (input(a).constant) continue;
      for (int b = 0; b < count(); ++b) {
        const bool go_together = is_motion(input(a)) ? b != a && goes_with(a, b, static_cast<int>(joint))
                                                     : is_load_from_a_side(a, b, static_cast<int>(joint));
        if (go_together) add(site, design_.joint_column[joint], {a, b});
      }
    }
  }

  /// Belts and gears with friction give way by the side that the joint came from and by the load.
  bool is_load_from_a_side(int a, int b, int joint) const {
    const InputColumn& load = input(b);
    if (!is_direction(input(a)) || input(a).joint != joint || load.constant) return false;
    return load.name == "payload" || (is_torque(load) && load.joint == joint);
  }

  bool goes_with(int a, int b, int joint) const {
    const InputColumn &first = input(a), &second = input(b);
    if (second.constant || is_torque(second) || is_difference(second) || is_time(second)) return false;
    if (is_motion(second)) return b > a;
    return is_direction(second) ? second.joint == joint : first.joint == joint;
  }

  /// The base: functions of one input, that are not slow drifts.
  void add_base() {
    for (int a = 0; a < count(); ++a) {
      if (input(a).constant || is_torque(input(a)) || is_time(input(a)) || !is_wanted(a)) continue;
      fine_[static_cast<std::size_t>(a)] = knots_of(input(a), rows_, std::min(knots_of_one_, 5));
      add("base", design_.base_columns, {a});
    }
  }

  /// The base towards the arm: what leans under a load does so on the side on which the arm holds it. It tilts, or
  /// moves in any way.
  void add_turning_base() {
    TurningBase tilting = design_.turning_base;
    tilting.coordinates = {3, 4};
    for (int a = 0; a < count(); ++a) {
      const InputColumn& of = input(a);
      const bool is_its_angle = a == design_.turning_base.angle;
      if (of.constant || is_its_angle || is_direction(of) || is_difference(of) || is_time(of) || !is_wanted(a))
        continue;
      for (const TurningBase& base : {tilting, design_.turning_base}) {
        std::vector<int> columns;
        for (const int k : base.coordinates)
          columns.push_back(design_.turning_base_columns[static_cast<std::size_t>(k)]);
        add("base", columns, {a}, base);
      }
    }
  }

  void add(const std::string& site, const std::vector<int>& columns, const std::vector<int>& which,
           const TurningBase& turning = {}) {
    Trial trial;
    trial.what.turning = turning;
    trial.what.kind = Explanation::Kind::free;
    trial.what.effect = kNoEffect;
    trial.what.site = site;
    if (site != "base") trial.what.joints = {site};
    trial.what.inputs = which;
    std::string name = "free." + site + (turning.angle < 0 ? "" : columns.size() == 2 ? ".tilting" : ".turning");
    for (const int k : which) {
      trial.what.knots.push_back((which.size() > 1 ? coarse_ : fine_)[static_cast<std::size_t>(k)]);
      if (trial.what.knots.back().size() < 2) return;
      name += "." + input(k).name;
    }
    std::size_t parameters = columns.size();
    for (const std::vector<double>& knots : trial.what.knots) parameters *= knots.size();
    for (std::size_t k = 0; k < parameters; ++k) trial.what.parameters.push_back(name + "." + std::to_string(k + 1));
    trial.sites = columns;
    out_.push_back(std::move(trial));
  }

  const Design& design_;
  const std::vector<InputColumn>& inputs_;
  const std::vector<std::int32_t> rows_;
  const std::vector<int>& only_of_;
  int knots_of_one_;
  std::vector<std::vector<double>> fine_, coarse_;  // knots of functions of one input, and of two
  std::vector<Trial> out_;
};

/// X^T v of a trial's columns for every column v of `right`, and X^T X, without ever storing X.
struct Sums {
  Eigen::MatrixXd xx;     ///< shape (k, k)
  Eigen::MatrixXd right;  ///< shape (k, columns of right)
};

/// Some columns of the design, times other columns: values of one row go together, for its inputs are one.
struct SiteView {
  std::vector<std::int32_t> rows;
  Design::Rows products;  ///< of two sites, summed over a row's values: shape (rows, sites * sites)
  Design::Rows right;     ///< of a site with every column: shape (rows * sites, columns of right)
};

SiteView view_of(const std::vector<int>& sites, const Design& design, const std::vector<Eigen::Index>& at,
                 const Design::Rows& right) {
  SiteView out;
  for (const Eigen::Index i : at) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (out.rows.empty() || out.rows.back() != row) out.rows.push_back(row);
  }
  const auto rows = static_cast<Eigen::Index>(out.rows.size()), count = static_cast<Eigen::Index>(sites.size());
  out.products = Design::Rows::Zero(rows, count * count);
  out.right = Design::Rows::Zero(rows * count, right.cols());
  Eigen::VectorXd d(count);
  Eigen::Index r = 0;
  for (std::size_t n = 0; n < at.size(); ++n) {
    if (out.rows[static_cast<std::size_t>(r)] != design.row[static_cast<std::size_t>(at[n])]) ++r;
    for (Eigen::Index s = 0; s < count; ++s)
      d[s] = design.weight[at[n]] * design.x(at[n], sites[static_cast<std::size_t>(s)]);
    for (Eigen::Index s = 0; s < count; ++s) {
      out.products.row(r).segment(s * count, count) += d[s] * d.transpose();
      out.right.row(r * count + s) += d[s] * right.row(static_cast<Eigen::Index>(n));
    }
  }
  return out;
}

Sums sums_of(const Trial& trial, const std::vector<InputColumn>& inputs, const SiteView& view) {
  const auto k1 = static_cast<Eigen::Index>(trial.what.knots[0].size());
  const auto k2 = trial.what.knots.size() > 1 ? static_cast<Eigen::Index>(trial.what.knots[1].size()) : 1;
  const auto sites = static_cast<Eigen::Index>(trial.sites.size());
  const Eigen::Index per_site = k1 * k2, k = per_site * sites;
  Sums out;
  out.xx = Eigen::MatrixXd::Zero(k, k);
  Design::Rows sums = Design::Rows::Zero(k, view.right.cols());
  std::vector<double> first(static_cast<std::size_t>(k1)), second(static_cast<std::size_t>(k2), 1.0);
  std::vector<std::pair<Eigen::Index, double>> hats;
  for (std::size_t n = 0; n < view.rows.size(); ++n) {
    const auto row = static_cast<std::size_t>(view.rows[n]);
    hats_at(trial.what.knots[0], inputs[static_cast<std::size_t>(trial.what.inputs[0])].values[row], first.data());
    if (k2 > 1)
      hats_at(trial.what.knots[1], inputs[static_cast<std::size_t>(trial.what.inputs[1])].values[row], second.data());
    hats.clear();
    for (Eigen::Index a = 0; a < k1; ++a) {
      for (Eigen::Index b = 0; b < k2; ++b) {
        const double value = first[static_cast<std::size_t>(a)] * second[static_cast<std::size_t>(b)];
        if (value != 0.0) hats.emplace_back(a * k2 + b, value);
      }
    }
    const auto r = static_cast<Eigen::Index>(n);
    for (Eigen::Index s = 0; s < sites; ++s) {
      for (const auto& [a, x] : hats) {
        for (Eigen::Index t = 0; t < sites; ++t) {
          const double times = x * view.products(r, s * sites + t);
          for (const auto& [b, z] : hats) out.xx(s * per_site + a, t * per_site + b) += times * z;
        }
        sums.row(s * per_site + a) += x * view.right.row(r * sites + s);
      }
    }
  }
  out.right = sums;
  return out;
}

std::vector<std::int32_t> clusters_of(const Design& design, const std::vector<Eigen::Index>& at) {
  std::vector<std::int32_t> out;
  for (const Eigen::Index i : at) out.push_back(design.cluster[static_cast<std::size_t>(i)]);
  return out;
}

/// In increasing order.
std::vector<std::int32_t> distinct(std::vector<std::int32_t> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// Slots of the right-hand sides: what the state spans, the residual, then sign-flipped residuals.
Design::Rows right_sides(const Design& design, const Left& left, int flips, std::uint64_t seed) {
  const Eigen::Index p = left.span.cols();
  Design::Rows out(left.span.rows(), p + 1 + flips);
  out.leftCols(p) = left.span;
  out.col(p) = left.residual;
  Random random(seed);
  const std::vector<std::int32_t> clusters = clusters_of(design, left.at), known = distinct(clusters);
  Eigen::MatrixXd flipped(left.residual.size(), flips);
  for (Eigen::Index f = 0; f < flipped.cols(); ++f) {
    std::vector<double> sign(known.size());
    for (double& s : sign) s = random.next() & 1u ? 1.0 : -1.0;
    for (Eigen::Index n = 0; n < flipped.rows(); ++n) {
      const auto c =
          std::lower_bound(known.begin(), known.end(), clusters[static_cast<std::size_t>(n)]) - known.begin();
      flipped(n, f) = sign[static_cast<std::size_t>(c)] * left.residual[n];
    }
  }
  // A fit would have taken its share of this noise, too.
  flipped -= left.span * (left.span.transpose() * flipped);
  // Projected twice, it has become shorter than what it is compared with.
  for (Eigen::Index f = 0; f < flipped.cols(); ++f)
    out.col(p + 1 + f) = flipped.col(f) * (left.residual.norm() / std::max(flipped.col(f).norm(), 1e-300));
  return out;
}

constexpr std::size_t kTrialsAtATime = 4;                 ///< that a thread takes
constexpr double kScalesOfChance[] = {0.1, 0.01, 0.001};  ///< of functions: the same for the data and for random signs

/// Scores of residuals, each the largest of any scale. `seen`: X^T v of each; `a`: X^T X beyond the state.
std::vector<double> scores_of(const Evidence& evidence, const Evidence::State& state, const Eigen::MatrixXd& a,
                              const Eigen::MatrixXd& seen, double cost) {
  std::vector<double> out(static_cast<std::size_t>(seen.cols()), -1e300);
  for (const double scale : kScalesOfChance) {
    Eigen::MatrixXd m = a;
    const double ridge = state.sigma2 / std::pow(scale * kLargest, 2.0);
    m.diagonal().array() += ridge;
    const Eigen::LLT<Eigen::MatrixXd> factor = factorised(std::move(m));
    const double determinants =
        static_cast<double>(a.rows()) * std::log(ridge) - 2.0 * factor.matrixLLT().diagonal().array().log().sum();
    Eigen::MatrixXd half = seen;
    factor.matrixL().solveInPlace(half);
    for (std::size_t f = 0; f < out.size(); ++f) {
      const double fall = std::min(half.col(static_cast<Eigen::Index>(f)).squaredNorm(), 0.999 * state.rss);
      const double score =
          -0.5 * evidence.degrees_of_freedom() * std::log1p(-fall / state.rss) + 0.5 * determinants - cost;
      out[f] = std::max(out[f], score);
    }
  }
  return out;
}

/// Of every column the largest.
std::vector<double> largest_of(const std::vector<std::vector<double>>& scores) {
  std::vector<double> out = scores[0];
  for (const std::vector<double>& of_one : scores) {
    for (std::size_t f = 0; f < out.size(); ++f) out[f] = std::max(out[f], of_one[f]);
  }
  return out;
}

/// How often a score is as high as the first, which is the data's own: that one counted in, this is uniform for noise.
double chance_of(const std::vector<double>& largest) {
  const auto above = std::count_if(largest.begin(), largest.end(), [&](double score) { return score >= largest[0]; });
  return static_cast<double>(above) / static_cast<double>(largest.size());
}

}  // namespace

FreeScan scan_free(const Design& design, const Evidence& evidence, const Evidence::State& state,
                   const std::vector<InputColumn>& inputs, const Robot& robot, double design_effect,
                   const FreeScanOptions& options) {
  const Left left = what_is_left(design, state, options.most_values);
  const std::vector<Trial> trials =
      TrialMaker(design, inputs, distinct(clusters_of(design, left.at)).size(), options.only_of).run(robot);
  const Eigen::Index p = left.span.cols();
  const Design::Rows right = right_sides(design, left, options.flips, options.seed);
  const double times = 1.0 / (left.share * design_effect);
  const Evidence::State seen = seen_on(left, evidence, state, times);
  const double cost = std::log(static_cast<double>(std::max<std::size_t>(1, trials.size())));
  std::map<std::vector<int>, SiteView> views;  // by the columns that a function moves
  for (const Trial& trial : trials) {
    if (views.count(trial.sites) == 0) views.emplace(trial.sites, view_of(trial.sites, design, left.at, right));
  }
  FreeScan out;
  out.tried = trials.size();
  out.best.resize(trials.size());
  std::vector<std::vector<double>> scores(trials.size());  // of a trial: the data's own, then those of the flips
  math::for_each_on_threads(
      trials.size(), options.threads, {},
      [&](std::size_t at) {
        const Trial& trial = trials[at];
        const Sums sums = sums_of(trial, inputs, views.at(trial.sites));
        const Eigen::Index k = sums.xx.rows();
        const auto spanned = sums.right.leftCols(p);
        Eigen::MatrixXd a = (sums.xx - spanned * spanned.transpose()) * times;
        a.diagonal() += 1e-9 * times * sums.xx.diagonal();
        const Eigen::VectorXd prior = Eigen::VectorXd::Constant(k, kLargest);
        out.best[at] = {trial.what, trial.sites, evidence.gain_of(seen, a, sums.right.col(p) * times, prior, cost)};
        if (options.flips > 0)
          scores[at] = scores_of(evidence, seen, a, sums.right.rightCols(options.flips + 1) * times, cost);
      },
      kTrialsAtATime);
  if (!trials.empty() && options.flips > 0) out.p = chance_of(largest_of(scores));
  std::sort(out.best.begin(), out.best.end(),
            [](const FreeGain& a, const FreeGain& b) { return a.gain.score > b.gain.score; });
  if (out.best.size() > 200) out.best.resize(200);
  return out;
}

SomeRows some_training_rows(const Design& design, std::size_t most) {
  SomeRows out;
  for (const std::int32_t fold : design.fold) out.of += fold < design.folds ? 1 : 0;
  int folds = design.folds;
  while (folds > 2 && out.of * static_cast<std::size_t>(folds) / static_cast<std::size_t>(design.folds) > most) --folds;
  for (std::size_t i = 0; i < design.fold.size(); ++i) {
    if (design.fold[i] < folds && design.weight[static_cast<Eigen::Index>(i)] > 0.0)
      out.at.push_back(static_cast<Eigen::Index>(i));
  }
  return out;
}

// --- what a curve looks like -----------------------------------------------------------------------------------------

namespace {

/// Sum of squares that the columns leave of what single poses say.
double left_by(const Curve& curve, const std::vector<std::vector<double>>& columns) {
  const auto n = static_cast<Eigen::Index>(curve.samples.size());
  Eigen::MatrixXd x(n, static_cast<Eigen::Index>(columns.size()));
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    y[i] = curve.samples[static_cast<std::size_t>(i)][1];
    for (Eigen::Index c = 0; c < x.cols(); ++c)
      x(i, c) = columns[static_cast<std::size_t>(c)][static_cast<std::size_t>(i)];
  }
  Eigen::MatrixXd xx = x.transpose() * x;
  xx.diagonal() *= 1.0 + 1e-12;
  return std::max(0.0,
                  y.squaredNorm() - (x.transpose() * y).dot(solve_symmetric<Eigen::Dynamic, 1>(xx, x.transpose() * y)));
}

/// A shape fitted to a curve.
struct FittedShape {
  double left;  ///< sum of squares
  double parameters;
  std::string text;
};

template <typename Function>
std::vector<double> values_of(const Curve& curve, const Function& f) {
  std::vector<double> out;
  for (const auto& sample : curve.samples) out.push_back(f(sample[0]));
  return out;
}

/// Of a constant and of functions of the input.
template <typename... Functions>
double left_by_functions(const Curve& curve, const Functions&... f) {
  return left_by(curve, {std::vector<double>(curve.samples.size(), 1.0), values_of(curve, f)...});
}

std::string with_unit(const Curve& curve, double value) {
  return curve.input + " = " + number(value, 3) + (curve.input_unit.empty() ? "" : " " + curve.input_unit);
}

/// Steps, corners and bumps.
std::vector<FittedShape> local_shapes(const Curve& curve) {
  std::vector<FittedShape> out;
  const std::size_t n = curve.samples.size(), stride = std::max<std::size_t>(1, n / 80);
  for (std::size_t k = stride; k < n; k += stride) {
    const double at = 0.5 * (curve.samples[k - 1][0] + curve.samples[k][0]);
    out.push_back({left_by_functions(curve, [at](double x) { return x > at ? 1.0 : 0.0; }), 3,
                   "a step at " + with_unit(curve, at)});
    if (k <= 3 * stride || k + 3 * stride >= n) continue;
    const double corner = curve.samples[k][0];
    out.push_back({left_by_functions(curve, [corner](double x) { return std::max(0.0, x - corner); }), 3.5,
                   "flat, then rising from " + with_unit(curve, corner)});
    out.push_back({left_by_functions(curve, [corner](double x) { return std::abs(x - corner); }), 3.5,
                   "a corner at " + with_unit(curve, corner)});
  }
  const double span = curve.samples.back()[0] - curve.samples.front()[0];
  for (std::size_t k = 1; k + 1 < curve.points.size(); ++k) {
    const double at = curve.points[k][0];
    for (const double width : {0.08, 0.15, 0.25}) {
      const auto bump = [&](double x) { return std::exp(-0.5 * std::pow((x - at) / (width * span), 2.0)); };
      out.push_back({left_by_functions(curve, bump), 4, "a bump at " + with_unit(curve, at)});
    }
  }
  return out;
}

/// Lines, parabolas and, of an angle, waves.
std::vector<FittedShape> smooth_shapes(const Curve& curve) {
  const auto itself = [](double x) { return x; };
  std::vector<FittedShape> out;
  out.push_back({left_by_functions(curve, itself), 2, "linear in " + curve.input});
  out.push_back({left_by_functions(curve, itself, [](double x) { return x * x; }), 3, "quadratic in " + curve.input});
  for (int k = 1; k < 8 && curve.input[0] == 'q'; ++k) {
    const double left =
        left_by_functions(curve, [k](double x) { return std::cos(k * x); }, [k](double x) { return std::sin(k * x); });
    out.push_back({left, 3.5, "a wave of " + std::to_string(k) + " per turn of " + curve.input});
  }
  return out;
}

/// What a function with the curve's knots leaves.
double left_by_hats(const Curve& curve) {
  std::vector<double> knots;
  for (const auto& point : curve.points) knots.push_back(point[0]);
  std::vector<std::vector<double>> hats(knots.size(), std::vector<double>(curve.samples.size()));
  std::vector<double> values(knots.size());
  for (std::size_t i = 0; i < curve.samples.size(); ++i) {
    hats_at(knots, curve.samples[i][0], values.data());
    for (std::size_t k = 0; k < knots.size(); ++k) hats[k][i] = values[k];
  }
  return left_by(curve, hats);
}

/// The plainest of some shapes.
struct PlainShape {
  std::string text;
  double share = 0.0;  ///< of what a free curve explains of the single poses' values
};

PlainShape plainest(const Curve& curve, const std::vector<FittedShape>& shapes) {
  // What the free curve leaves is noise: chi-squared and two for each parameter (Akaike 1974).
  const std::size_t n = curve.samples.size();
  const double whole = left_by_functions(curve), noise = left_by_hats(curve),
               unit2 = std::max(noise / std::max(1.0, static_cast<double>(n - std::min(n - 1, curve.points.size()))),
                                1e-300);
  const auto best = std::min_element(shapes.begin(), shapes.end(), [unit2](const FittedShape& a, const FittedShape& b) {
    return a.left / unit2 + 2.0 * a.parameters < b.left / unit2 + 2.0 * b.parameters;
  });
  return {best->text, (whole - best->left) / std::max(whole - noise, 1e-300)};
}

}  // namespace

std::string shape_of(const Curve& curve) {
  constexpr double kMost = 0.75;  ///< of what a free curve explains, that a shape must explain
  if (curve.points.size() < 2 || curve.samples.size() < 8) return "";
  if (curve.points.size() <= 3) return "different levels of " + curve.input;
  std::vector<FittedShape> shapes = smooth_shapes(curve), local = local_shapes(curve);
  shapes.insert(shapes.end(), local.begin(), local.end());
  const PlainShape best = plainest(curve, shapes);
  return best.share < kMost ? "no simple shape in " + curve.input : best.text;
}

double share_of_local_shape(const Curve& curve) {
  if (curve.points.size() <= 3 || curve.samples.size() < 8) return 0.0;
  return plainest(curve, local_shapes(curve)).share;
}

}  // namespace truing::diagnosis
