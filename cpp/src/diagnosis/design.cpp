// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/design.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include <Eigen/Geometry>

#include "diagnosis/linearise.hpp"
#include "diagnosis/rows.hpp"
#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "math/constants.hpp"
#include "math/random.hpp"
#include "model/effects/traits.hpp"
#include "model/gravity.hpp"
#include "model/model.hpp"

namespace truing::diagnosis {
namespace {

using Kind = Explanation::Kind;
constexpr int kFolds = 12;
constexpr int kTestFolds = 8;

double root_mean_square(const std::vector<double>& values, const std::vector<std::int32_t>& rows) {
  double sum = 0.0;
  for (const std::int32_t row : rows)
    sum += values[static_cast<std::size_t>(row)] * values[static_cast<std::size_t>(row)];
  return std::sqrt(sum / std::max<double>(1.0, static_cast<double>(rows.size())));
}

/// From axes that turn with the arm to the fixed ones, where the joint that turns it stands at `angle`.
Eigen::Matrix3d turn_of(const TurningBase& base, double angle) {
  return Eigen::AngleAxisd(angle, base.axes.col(2)) * base.axes;
}

/// Approach directions of the joint that an input belongs to; absent: they were not recorded.
Column direction_beside(const Robot& robot, const Measurements& data, const InputColumn& input) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  const auto number = static_cast<std::size_t>(
      std::find(driven.begin(), driven.end(), static_cast<std::size_t>(input.joint)) - driven.begin());
  return number < data.direction.size() ? data.direction[number] : Column{};
}

/// Effects that the candidates ask for, each once.
std::vector<EffectRequest> requests_of(const Candidates& candidates) {
  std::vector<EffectRequest> requests;
  std::set<std::pair<std::string, std::string>> asked;
  for (const Explanation& e : candidates.named) {
    for (const EffectRequest& request : e.requests) {
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        requests.push_back(request);
    }
  }
  return requests;
}

/// A parameter that is unknown in any case: base, anchor, targets, fixed points.
bool is_nuisance(const ParameterInfo& info, const Content& content) {
  switch (info.role) {
    case Role::base:
      return content.frame;
    case Role::anchor:
      return content.distance;
    case Role::point:
      return content.point[static_cast<std::size_t>(info.owner)];
    case Role::target:
      return (info.rotation ? content.target_rotation : content.target)[static_cast<std::size_t>(info.owner)];
    default:
      return false;
  }
}

/// Fills a design, step by step.
class Designer {
 public:
  Designer(const DesignTask& task, Design* out)
      : task_(task),
        out_(*out),
        model_(make_model(task.at, task.data, requests_of(out->candidates), task.options.own_effects)),
        bases_(make_bases(model_, task.data, links_as_drawn(task.at, task.nominal))),
        segments_(make_segments(task.data, task.rows)),
        content_(content_of(model_, segments_)) {}

  void fill() {
    choose_core();
    linearise_core();
    name_core();
    add_products();
    add_turning_base();
    draw_folds();
    out_.weight = Eigen::VectorXd::Ones(out_.x.rows());
  }

 private:
  static bool is_form(const Explanation& e) { return !e.constants.empty(); }
  static bool grows(const Explanation& e) { return e.law_test == LawTest::times_the_lengths; }
  static bool is_product(const Explanation& e) {
    return e.kind == Kind::drift || e.kind == Kind::law || e.kind == Kind::free || is_form(e);
  }
  bool is_without_frame(const Explanation& e) const { return e.kind == Kind::drift && !grows(e) && !content_.frame; }

  /// Core columns: what is always unknown, joint motions, and every parameter of a candidate.
  void choose_core() {
    std::vector<int> free;
    const auto want = [&](int parameter) {
      const auto found = std::find(free.begin(), free.end(), parameter);
      if (found != free.end()) return static_cast<int>(found - free.begin());
      free.push_back(parameter);
      return static_cast<int>(free.size()) - 1;
    };
    for (std::size_t k = 0; k < model_.parameters.size(); ++k) {
      if (is_nuisance(model_.parameters[k], content_)) out_.nuisance.push_back(want(static_cast<int>(k)));
    }
    for (int k = 0; k < 6 && content_.frame; ++k)
      out_.base_columns.push_back(want(model_.parameter_index(std::string("base.") + kFrame[k])));
    for (const Joint& joint : task_.at.joints)
      out_.joint_column.push_back({want(model_.parameter_index(parameter_of(StandsFor::joint_offset, joint.name)))});
    for (std::size_t g = 0; g < out_.candidates.named.size(); ++g) {
      const Explanation& e = out_.candidates.named[g];
      for (std::size_t k = 0; k < lengths_of(e).size(); ++k) want(model_.parameter_index(lengths_of(e)[k].first));
      if ((e.kind != Kind::catalogue && e.kind != Kind::all_geometry) || is_form(e)) continue;
      for (const std::string& name : e.parameters)
        out_.candidates.groups[g].columns.push_back(want(model_.parameter_index(name)));
    }
    put_in_order(free);
  }

  /// The evaluator wants its parameters in order.
  void put_in_order(const std::vector<int>& free) {
    core_ = free;
    std::sort(core_.begin(), core_.end());
    std::vector<int> place(free.size());
    for (std::size_t k = 0; k < free.size(); ++k)
      place[k] = static_cast<int>(std::lower_bound(core_.begin(), core_.end(), free[k]) - core_.begin());
    const auto moved = [&](std::vector<int>* columns) {
      for (int& column : *columns) column = place[static_cast<std::size_t>(column)];
    };
    moved(&out_.nuisance);
    moved(&out_.base_columns);
    for (std::vector<int>& column : out_.joint_column) moved(&column);
    for (ColumnGroup& group : out_.candidates.groups) moved(&group.columns);
  }

  Eigen::Index core() const { return static_cast<Eigen::Index>(core_.size()); }

  Eigen::Index count_products() const {
    Eigen::Index count = 0;
    for (const Explanation& e : out_.candidates.named) {
      if (is_product(e) && !is_without_frame(e)) count += static_cast<Eigen::Index>(e.parameters.size());
    }
    return count;
  }

  void linearise_core() {
    const Evaluator evaluator(model_, task_.data, bases_, segments_, core_, task_.options.threads);
    const Eigen::VectorXd values = initial_values(model_);
    out_.x.resize(static_cast<Eigen::Index>(evaluator.components()), core() + count_products());
    out_.y.resize(out_.x.rows());
    Weighing weighing;
    weighing.rotation_scale = 1.0;
    weighing.row_weights = false;
    Eigen::Index at = 0;
    int tile = 0;
    Design::Rows jacobian;
    Eigen::VectorXd residual;
    for (const Segment& segment : segments_) {
      const int components = segment.kind == kernel::Kind::distance ? 1 : segment.kind == kernel::Kind::pose ? 6 : 3;
      std::size_t next = 0;
      while (next < segment.rows.size()) {
        const int poses = evaluator.tile_rows(tile);
        const Eigen::Index values_here = static_cast<Eigen::Index>(poses) * components;
        jacobian.resize(values_here, core());
        residual.resize(values_here);
        evaluator.tile(tile++, values, weighing, residual.data(), jacobian.data());
        out_.x.block(at, 0, values_here, core()) = jacobian;
        out_.y.segment(at, values_here) = -residual;
        for (int i = 0; i < poses; ++i) {
          for (int c = 0; c < components; ++c) {
            out_.row.push_back(segment.rows[next + static_cast<std::size_t>(i)]);
            out_.component.push_back(static_cast<std::int8_t>(components == 1 ? 6 : c));
          }
        }
        next += static_cast<std::size_t>(poses);
        at += values_here;
      }
    }
  }

  /// Rms of every term's basis under the full weight: with gravity along that axis of the base where it is largest. As
  /// it stands a joint may carry next to nothing, and is no softer for it. 0: it needs no gravity.
  std::vector<double> sizes_under_full_weight() const {
    std::vector<double> out(model_.terms.size(), 0.0);
    if (std::none_of(model_.terms.begin(), model_.terms.end(), [](const Term& t) { return t.needs_gravity; }))
      return out;
    constexpr std::size_t kRows = 200;
    std::vector<std::int32_t> some, every;
    for (std::size_t k = 0; k < task_.rows.size(); k += task_.rows.size() / kRows + 1) {
      every.push_back(static_cast<std::int32_t>(some.size()));
      some.push_back(task_.rows[k]);
    }
    const Measurements few = subset_of(task_.data, some);
    const std::vector<Effect> own = mapped(task_.options.own_effects, task_.data, some);
    for (int axis = 0; axis < 3; ++axis) {
      Robot turned = task_.at;
      turned.gravity = task_.at.gravity.norm() * Eigen::Vector3d::Unit(axis);
      const Model model = make_model(turned, few, requests_of(out_.candidates), own);
      if (model.terms.size() != out.size()) continue;
      const std::vector<std::vector<double>> bases = make_bases(model, few);
      for (std::size_t t = 0; t < out.size(); ++t)
        if (model.terms[t].needs_gravity) out[t] = std::max(out[t], root_mean_square(bases[t], every));
    }
    return out;
  }

  /// Rms of what multiplies a parameter on its way to the site.
  double size_of_basis(const ParameterInfo& info, const std::vector<double>& under_full_weight) const {
    double size = 0.0;
    for (const ColumnTerm& column : info.columns) {
      if (column.term >= 0) {
        const auto term = static_cast<std::size_t>(column.term);
        size = std::max({size, root_mean_square(bases_[term], task_.rows), under_full_weight[term]});
      }
      if (column.reading >= 0) {
        std::vector<double> reading(task_.data.rows);
        for (std::size_t row = 0; row < reading.size(); ++row)
          reading[row] = task_.data.joints[static_cast<std::size_t>(column.reading)][row];
        size = std::max(size, root_mean_square(reading, task_.rows));
      }
    }
    return size;
  }

  const EffectTraits& traits_of_owner(const ParameterInfo& info) const {
    return traits_of(model_.requests[static_cast<std::size_t>(info.owner)].effect, task_.options.own_effects);
  }

  /// How far the effect that a parameter belongs to may well move its site.
  double largest_motion(const ParameterInfo& info) const {
    return info.role == Role::effect ? traits_of_owner(info).prior : kLargest;
  }

  /// Moments of weights that nobody knows: what hardly loads the joint, as what a parallelogram holds upright, is no
  /// heavier for it than machines are.
  double no_more_than_plausible(const ParameterInfo& info, double prior) const {
    if (info.role != Role::effect || traits_of_owner(info).search != Search::with_unknown_weights) return prior;
    return std::min(prior, traits_of_owner(info).plausible);
  }

  /// Names, units and the sizes that parameters may have.
  void name_core() {
    out_.prior = Eigen::VectorXd::Constant(out_.x.cols(), kLargest);
    const std::vector<double> under_full_weight = sizes_under_full_weight();
    for (Eigen::Index k = 0; k < core(); ++k) {
      const ParameterInfo& info = model_.parameters[static_cast<std::size_t>(core_[static_cast<std::size_t>(k)])];
      out_.column_names.push_back(info.name);
      out_.column_units.push_back(info.unit);
      const double size = size_of_basis(info, under_full_weight);
      if (size > 0.0) out_.prior[k] = no_more_than_plausible(info, largest_motion(info) / size);
      const auto shift = task_.shift.find(info.name);
      if (shift != task_.shift.end()) out_.y += shift->second * out_.x.col(k);
    }
  }

  /// Drifts and corrections of laws: products of columns that are there with hats of inputs.
  void add_products() {
    Eigen::Index next = core();
    for (std::size_t g = 0; g < out_.candidates.named.size(); ++g) {
      const Explanation& e = out_.candidates.named[g];
      ColumnGroup& group = out_.candidates.groups[g];
      if (!is_product(e)) continue;
      if (is_without_frame(e)) {
        group.shadow = true;
        continue;
      }
      const auto count = static_cast<Eigen::Index>(e.parameters.size());
      const Design::Rows columns = is_form(e) ? columns_of_form(e, next) : products(e);
      group.shadow = group.shadow || columns.size() == 0;
      for (Eigen::Index k = 0; k < count; ++k) {
        if (columns.size() != 0) group.columns.push_back(static_cast<int>(next + k));
        out_.column_names.push_back(e.parameters[static_cast<std::size_t>(k)]);
        out_.column_units.push_back(grows(e) ? "-" : "rad");  // a form at a joint, as well
      }
      for (const std::string& name : e.model_free) group.columns.push_back(out_.column(name));
      if (columns.size() == 0)
        out_.x.middleCols(next, count).setZero();
      else
        out_.x.middleCols(next, count) = columns;
      next += count;
    }
  }

  /// Columns of one drift or correction; none: of a target that no row measures.
  Design::Rows products(const Explanation& e) const {
    if (grows(e)) return times_the_lengths(e);
    if (e.kind == Kind::drift) {
      std::vector<int> sites;
      for (const std::string& site : frame_coordinates(e.site)) sites.push_back(out_.column(site));
      if (std::find(sites.begin(), sites.end(), -1) != sites.end()) return {};
      return free_columns(out_, sites, task_.inputs, e.inputs, e.knots);
    }
    Design::Rows columns =
        free_columns(out_, out_.joint_column[task_.at.joint_index(e.site)], task_.inputs, e.inputs, e.knots);
    if (e.law_test == LawTest::times_direction) multiply_by_direction(e, &columns);
    return columns;
  }

  /// Columns of an effect with constants of its own, at joints: its bases times the joint's column. They are the ones
  /// from `first` on, and get their priors.
  Design::Rows columns_of_form(const Explanation& e, Eigen::Index first) {
    Robot carrying = task_.at;
    carrying.effects.push_back({e.effect, e.joints, e.constants});
    Design::Rows columns = Design::Rows::Zero(out_.x.rows(), static_cast<Eigen::Index>(e.parameters.size()));
    for (const Term& term : effect_terms(e.requests, carrying, task_.data, task_.options.own_effects)) {
      const auto at = std::find(e.parameters.begin(), e.parameters.end(), term.parameter) - e.parameters.begin();
      if (at == static_cast<std::ptrdiff_t>(e.parameters.size())) continue;
      if (term.needs_gravity) throw std::logic_error(e.effect + ": a form with constants must not need gravity");
      const std::vector<double> basis = values_of(term);
      const int joint = out_.joint_column[task_.at.joint_index(term.site)][0];
      for (Eigen::Index i = 0; i < columns.rows(); ++i)
        columns(i, at) += basis[static_cast<std::size_t>(out_.row[static_cast<std::size_t>(i)])] * out_.x(i, joint);
      const double size = root_mean_square(basis, task_.rows);
      if (size > 0.0) out_.prior[first + at] = traits_of(e.effect, task_.options.own_effects).prior / size;
    }
    return columns;
  }

  /// A basis that is a function of the joints, on every row.
  std::vector<double> values_of(const Term& term) const {
    std::vector<const std::vector<double>*> motions(task_.at.joints.size(), nullptr);
    for (const InputColumn& input : task_.inputs) {
      if (input.joint >= 0 && input.name == input_name(Driver::angle, static_cast<std::size_t>(input.joint)))
        motions[static_cast<std::size_t>(input.joint)] = &input.values;
    }
    std::vector<double> out(task_.data.rows);
    Inputs in;
    in.data = &task_.data;
    in.joints = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(motions.size()));
    for (in.row = 0; in.row < out.size(); ++in.row) {
      for (std::size_t k = 0; k < motions.size(); ++k)
        if (motions[k]) in.joints[static_cast<Eigen::Index>(k)] = (*motions[k])[in.row];
      out[in.row] = term.basis(in);
    }
    return out;
  }

  std::vector<std::pair<std::string, double>> lengths_of(const Explanation& e) const {
    return grows(e) ? lengths_that_grow(task_.at, e) : std::vector<std::pair<std::string, double>>{};
  }

  Design::Rows times_the_lengths(const Explanation& e) const {
    Design::Rows columns = Design::Rows::Zero(out_.x.rows(), static_cast<Eigen::Index>(e.parameters.size()));
    bool first = true;
    for (const auto& [site, length] : lengths_of(e)) {
      const int column = out_.column(site);
      if (column < 0) continue;
      const Design::Rows one = length * free_columns(out_, {column}, task_.inputs, e.inputs, e.knots);
      if (first)
        columns = one;
      else
        columns += one;
      first = false;
    }
    if (e.kind == Kind::drift) columns.col(0).setZero();  // since the first pose
    return columns;
  }

  void multiply_by_direction(const Explanation& e, Design::Rows* columns) const {
    const Column direction =
        direction_beside(task_.at, task_.data, task_.inputs[static_cast<std::size_t>(e.inputs[0])]);
    for (Eigen::Index i = 0; i < columns->rows(); ++i) {
      const auto row = static_cast<std::size_t>(out_.row[static_cast<std::size_t>(i)]);
      columns->row(i) *= direction ? 0.5 * direction[row] : 0.0;
    }
  }

  /// The first joint that turns, on nothing but slides: its axis has one direction in the base. None: no angle.
  TurningBase turning_base() const {
    TurningBase out;
    for (std::size_t joint = 0; joint < task_.at.joints.size(); ++joint) {
      if (task_.at.joints[joint].type == JointType::prismatic) continue;
      const std::string angle = input_name(Driver::angle, joint);
      for (std::size_t k = 0; k < task_.inputs.size(); ++k)
        if (task_.inputs[k].name == angle && !task_.inputs[k].constant) out.angle = static_cast<int>(k);
      const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(task_.data.joints.size()));
      const Eigen::Vector3d axis = joint_axis(task_.at, forward_kinematics(task_.at, zero, 0), joint).direction;
      out.axes.col(0) = axis.unitOrthogonal();
      out.axes.col(1) = axis.cross(out.axes.col(0));
      out.axes.col(2) = axis;
      break;
    }
    return out;
  }

  /// Columns of the base along axes that turn with the arm: what leans towards the arm is a constant along them.
  void add_turning_base() {
    if (out_.base_columns.empty()) return;
    out_.turning_base = turning_base();
    if (out_.turning_base.angle < 0) return;
    const std::vector<double>& angle = task_.inputs[static_cast<std::size_t>(out_.turning_base.angle)].values;
    const Eigen::Index first = out_.x.cols();
    out_.x.conservativeResize(Eigen::NoChange, first + 6);
    out_.prior.conservativeResize(first + 6);
    out_.prior.tail(6).setConstant(kLargest);
    for (int k = 0; k < 6; ++k) {
      const int fixed = out_.base_columns[static_cast<std::size_t>(k)];
      out_.turning_base_columns.push_back(static_cast<int>(first) + k);
      out_.column_names.push_back(out_.column_names[static_cast<std::size_t>(fixed)] + " towards the arm");
      out_.column_units.push_back(out_.column_units[static_cast<std::size_t>(fixed)]);
    }
    for (Eigen::Index i = 0; i < out_.x.rows(); ++i) {
      const auto row = static_cast<std::size_t>(out_.row[static_cast<std::size_t>(i)]);
      const Eigen::Matrix3d turn = turn_of(out_.turning_base, angle[row]);
      Eigen::Matrix<double, 1, 6> fixed;
      for (int k = 0; k < 6; ++k) fixed[k] = out_.x(i, out_.base_columns[static_cast<std::size_t>(k)]);
      out_.x.row(i).segment<3>(first) = fixed.head<3>() * turn;
      out_.x.row(i).segment<3>(first + 3) = fixed.tail<3>() * turn;
    }
  }

  /// Folds of whole pose groups, drawn with the seed.
  void draw_folds() {
    out_.folds = kFolds;
    out_.test_folds = kTestFolds;
    std::map<std::int32_t, std::int32_t> fold_of;
    std::vector<std::int32_t> groups_of[2];
    for (const std::int32_t row : out_.row) {
      const std::int32_t cluster = task_.cluster[static_cast<std::size_t>(row)];
      if (fold_of.emplace(cluster, -1).second)
        groups_of[task_.set[static_cast<std::size_t>(row)] ? 1 : 0].push_back(cluster);
    }
    Random random(task_.options.seed + 0x7f4a7c15u);
    for (int part = 0; part < 2; ++part) {
      std::vector<std::int32_t>& clusters = groups_of[part];
      for (std::size_t k = clusters.size(); k > 1; --k) std::swap(clusters[k - 1], clusters[random.below(k)]);
      for (std::size_t k = 0; k < clusters.size(); ++k) {
        fold_of[clusters[k]] =
            part == 0 ? static_cast<std::int32_t>(k % kFolds) : kFolds + static_cast<std::int32_t>(k % kTestFolds);
      }
    }
    for (const std::int32_t row : out_.row) {
      out_.cluster.push_back(task_.cluster[static_cast<std::size_t>(row)]);
      out_.fold.push_back(fold_of[out_.cluster.back()]);
    }
  }

  const DesignTask& task_;
  Design& out_;
  const Model model_;  ///< with every effect at once
  const std::vector<std::vector<double>> bases_;
  const std::vector<Segment> segments_;
  const Content content_;
  std::vector<int> core_;  ///< parameters of the model, in order
};

/// Sites that a free function acts at, and what each is multiplied by.
std::vector<std::pair<std::string, double>> places_of(const Explanation& candidate, const Robot& robot) {
  if (candidate.law_test == LawTest::times_the_lengths) return lengths_that_grow(robot, candidate);
  std::vector<std::pair<std::string, double>> places;
  for (const std::string& site : frame_coordinates(candidate.site)) places.push_back({site, 1.0});
  if (places.empty()) places.push_back({candidate.site, 1.0});
  return places;
}

/// Its function, from the hats' coefficients `from` on.
std::function<double(const Inputs&)> function_of(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                                                 const std::vector<InputColumn>& inputs, std::size_t from, double times,
                                                 const Column& direction) {
  const std::vector<double>* first = &inputs[static_cast<std::size_t>(candidate.inputs[0])].values;
  const std::vector<double>* second =
      candidate.inputs.size() > 1 ? &inputs[static_cast<std::size_t>(candidate.inputs[1])].values : nullptr;
  const auto k1 = candidate.knots[0].size(), k2 = candidate.knots.size() > 1 ? candidate.knots[1].size() : 1;
  return [=, knots = candidate.knots](const Inputs& in) {
    std::vector<double> a(k1), b(k2, 1.0);
    hats_at(knots[0], (*first)[in.row], a.data());
    if (second) hats_at(knots[1], (*second)[in.row], b.data());
    double value = 0.0;
    for (std::size_t m = 0; m < k1; ++m) {
      for (std::size_t n = 0; n < k2 && a[m] != 0.0; ++n)
        value += a[m] * b[n] * coefficients[static_cast<Eigen::Index>(from + m * k2 + n)];
    }
    return times * value * (direction ? 0.5 * direction[in.row] : 1.0);
  };
}

/// One coordinate of the base, along fixed axes: what the coordinates along axes that turn with the arm make of it, at
/// an angle.
Eigen::VectorXd turned_into(int coordinate, const TurningBase& base, double angle) {
  const Eigen::Matrix3d turn = turn_of(base, angle);
  Eigen::VectorXd out(static_cast<Eigen::Index>(base.coordinates.size()));
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    const int from = base.coordinates[static_cast<std::size_t>(k)];
    out[k] = from / 3 == coordinate / 3 ? turn(coordinate % 3, from % 3) : 0.0;
  }
  return out;
}

/// That coordinate as a function of the inputs.
std::function<double(const Inputs&)> function_of_turning(const Explanation& candidate,
                                                         const Eigen::VectorXd& coefficients,
                                                         const std::vector<InputColumn>& inputs, int coordinate) {
  std::vector<std::function<double(const Inputs&)>> along;
  const std::size_t hats = candidate.knots[0].size();
  for (std::size_t k = 0; k < candidate.turning.coordinates.size(); ++k)
    along.push_back(function_of(candidate, coefficients, inputs, k * hats, 1.0, {}));
  const std::vector<double>* angle = &inputs[static_cast<std::size_t>(candidate.turning.angle)].values;
  return [=, base = candidate.turning](const Inputs& in) {
    const Eigen::VectorXd times = turned_into(coordinate, base, (*angle)[in.row]);
    double out = 0.0;
    for (std::size_t k = 0; k < along.size(); ++k) {
      if (times[static_cast<Eigen::Index>(k)] != 0.0) out += times[static_cast<Eigen::Index>(k)] * along[k](in);
    }
    return out;
  };
}

}  // namespace

int Design::column(const std::string& name) const {
  for (std::size_t k = 0; k < column_names.size(); ++k) {
    if (column_names[k] == name) return static_cast<int>(k);
  }
  return -1;
}

Gram Design::gram_of_fold(int wanted, GramSum* sum) const {
  const Eigen::Index p = x.cols();
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (fold[static_cast<std::size_t>(i)] != wanted || weight[i] == 0.0) continue;
    double* out = sum->row();
    for (Eigen::Index k = 0; k < p; ++k) out[k] = weight[i] * x(i, k);
    out[p] = weight[i] * y[i];
    sum->push();
  }
  return sum->finish();
}

Design::Rows free_columns(const Design& design, const std::vector<int>& site_columns,
                          const std::vector<InputColumn>& inputs, const std::vector<int>& which,
                          const std::vector<std::vector<double>>& knots) {
  Eigen::Index k1 = static_cast<Eigen::Index>(knots[0].size()),
               k2 = which.size() > 1 ? static_cast<Eigen::Index>(knots[1].size()) : 1;
  Design::Rows out(design.x.rows(), static_cast<Eigen::Index>(site_columns.size()) * k1 * k2);
  std::vector<double> first(static_cast<std::size_t>(k1)), second(static_cast<std::size_t>(k2), 1.0);
  std::int32_t last = -1;
  for (Eigen::Index i = 0; i < design.x.rows(); ++i) {
    const std::int32_t row = design.row[static_cast<std::size_t>(i)];
    if (row != last) {
      hats_at(knots[0], inputs[static_cast<std::size_t>(which[0])].values[static_cast<std::size_t>(row)], first.data());
      if (which.size() > 1)
        hats_at(knots[1], inputs[static_cast<std::size_t>(which[1])].values[static_cast<std::size_t>(row)],
                second.data());
      last = row;
    }
    Eigen::Index at = 0;
    for (const int site : site_columns) {
      const double d = design.x(i, site);
      for (Eigen::Index a = 0; a < k1; ++a) {
        const double value = d * first[static_cast<std::size_t>(a)];
        for (Eigen::Index b = 0; b < k2; ++b)
          out(i, at++) = value == 0.0 ? 0.0 : value * second[static_cast<std::size_t>(b)];
      }
    }
  }
  return out;
}

Effect free_effect(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                   const std::vector<InputColumn>& inputs) {
  Effect effect;
  const std::string& first_name = candidate.parameters.front();
  effect.name = first_name.substr(0, first_name.rfind('.')) + "!";  // no name of the catalogue
  effect.summary = "a free function of inputs";
  effect.per_joint = false;
  const std::string parameter = effect.name;
  effect.terms = [candidate, coefficients, &inputs, parameter](const Robot& of, std::size_t, const Measurements& data) {
    Column direction;
    const bool of_law = candidate.kind == Kind::law;
    if (of_law && candidate.law_test == LawTest::times_direction)
      direction = direction_beside(of, data, inputs[static_cast<std::size_t>(candidate.inputs[0])]);
    std::size_t hats = 1;
    for (const std::vector<double>& knots : candidate.knots) hats *= knots.size();
    std::vector<Term> terms;
    for (const auto& [site, times] : places_of(candidate, of)) {
      // One function for all lengths of a link.
      const bool shared = candidate.law_test == LawTest::times_the_lengths;
      Term term;
      term.parameter = parameter;
      term.unit = "-";
      term.site = site;
      term.basis =
          candidate.turning.angle >= 0
              ? function_of_turning(candidate, coefficients, inputs, static_cast<int>(terms.size()))
              : function_of(candidate, coefficients, inputs, shared ? 0 : terms.size() * hats, times, direction);
      terms.push_back(std::move(term));
    }
    return terms;
  };
  return effect;
}

bool fits_in_tables(const Explanation& candidate, const std::vector<InputColumn>& inputs) {
  if (candidate.kind != Kind::law && candidate.kind != Kind::free) return false;
  if (candidate.law_test == LawTest::times_the_lengths) return false;
  return std::all_of(candidate.inputs.begin(), candidate.inputs.end(),
                     [&](int input) { return is_input_of_tables(inputs[static_cast<std::size_t>(input)].name); });
}

/// The same of a base along axes that turn with the arm: over its angle as well, in steps that turn as evenly.
static std::vector<LookupTable> tables_of_turning(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                                                  const std::vector<InputColumn>& inputs) {
  constexpr double kStep = 5.0 * kPi / 180.0;  ///< between lines a circle's chords are off by 0.1 %
  const InputColumn& angle = inputs[static_cast<std::size_t>(candidate.turning.angle)];
  const auto [low, high] = std::minmax_element(angle.values.begin(), angle.values.end());
  const auto steps = static_cast<int>(std::ceil((*high - *low) / kStep));
  LookupTable table{"", {angle.name}, {{}}, {}};
  for (int k = 0; k <= steps; ++k) table.knots[0].push_back(*low + (*high - *low) * k / steps);
  table.inputs.push_back(inputs[static_cast<std::size_t>(candidate.inputs[0])].name);
  table.knots.push_back(candidate.knots[0]);
  const auto hats = static_cast<Eigen::Index>(candidate.knots[0].size());
  std::vector<LookupTable> out;
  const std::vector<std::string> sites = frame_coordinates(candidate.site);
  for (std::size_t coordinate = 0; coordinate < sites.size(); ++coordinate) {
    table.site = sites[coordinate];
    table.values.clear();
    for (const double at : table.knots[0]) {
      const Eigen::VectorXd times = turned_into(static_cast<int>(coordinate), candidate.turning, at);
      const Eigen::VectorXd values = Eigen::Map<const Eigen::MatrixXd>(coefficients.data(), hats, times.size()) * times;
      table.values.insert(table.values.end(), values.begin(), values.end());
    }
    if (std::all_of(table.values.begin(), table.values.end(), [](double value) { return value == 0.0; })) continue;
    out.push_back(table);
  }
  return out;
}

std::vector<LookupTable> tables_of(const Explanation& candidate, const Eigen::VectorXd& coefficients,
                                   const std::vector<InputColumn>& inputs, const Robot& robot) {
  if (candidate.turning.angle >= 0) return tables_of_turning(candidate, coefficients, inputs);
  LookupTable table{"", {}, candidate.knots, {}};
  for (const int input : candidate.inputs) table.inputs.push_back(inputs[static_cast<std::size_t>(input)].name);
  Eigen::Index hats = 1;
  for (const std::vector<double>& knots : candidate.knots) hats *= static_cast<Eigen::Index>(knots.size());
  const bool halved = candidate.kind == Kind::law && candidate.law_test == LawTest::times_direction;
  if (halved) {  // direction / 2 times the function: linear in the direction as well
    const int joint = inputs[static_cast<std::size_t>(candidate.inputs[0])].joint;
    table.inputs.push_back(input_name(Driver::direction, static_cast<std::size_t>(joint)));
    table.knots.push_back({-1.0, 1.0});
  }
  std::vector<LookupTable> out;
  for (const auto& place : places_of(candidate, robot)) {
    table.site = place.first;
    table.values.clear();
    for (const double value : coefficients.segment(static_cast<Eigen::Index>(out.size()) * hats, hats)) {
      if (halved) table.values.push_back(-0.5 * value);
      table.values.push_back(halved ? 0.5 * value : value);
    }
    out.push_back(table);
  }
  return out;
}

Design make_design(const DesignTask& task) {
  Design out;
  out.candidates = make_candidates(task);
  Designer(task, &out).fill();
  return out;
}

}  // namespace truing::diagnosis
