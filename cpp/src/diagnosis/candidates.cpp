// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "estimation/evaluate.hpp"
#include "estimation/selection.hpp"
#include "math/random.hpp"
#include "model/gravity.hpp"
#include "model/motion.hpp"

namespace truing::diagnosis {
namespace {

constexpr int kFolds = 12;
constexpr int kTestFolds = 8;
/// A joint that moves less stands still [rad | m].
constexpr double kStandstill = 1e-3;
const char* const kFrame[6] = {"x", "y", "z", "rx", "ry", "rz"};

bool is_constant(const std::vector<double>& values, double least) {
  if (values.empty()) return true;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return !(*high - *low > least);
}

/// Inputs that repeat a few values (directions, payloads) have no more hats than values.
std::vector<double> distinct(std::vector<double> sorted, std::size_t most) {
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted.size() <= most ? sorted : std::vector<double>{};
}

std::string driver_of(const std::string& effect, const std::string& joint_number) {
  static const std::map<std::string, std::string> drivers = {{"joint_compliance", "torque"},
                                                             {"stiffness_zones", "torque"},
                                                             {"gravity_backlash", "torque"},
                                                             {"gravity_moment", "torque"},
                                                             {"link_compliance", "torque"},
                                                             {"backlash", "dir"},
                                                             {"harmonic", "q"},
                                                             {"gear_ratio", "q"},
                                                             {"axis_wobble", "q"},
                                                             {"windup", "tau"}};
  if (effect == "thermal" || effect == "thermal_zero") return "temp";
  if (effect == "drift") return "time";
  if (effect.rfind("transmission_error", 0) == 0) return "q" + joint_number;
  const auto found = drivers.find(effect);
  return found == drivers.end() ? "" : found->second + joint_number;
}

/// Effects whose law is one function of one driver at the joint itself: a number for "driver at joint".
int law_number(const std::string& effect, std::size_t joint) {
  static const std::map<std::string, int> kinds = {
      {"joint_compliance", 0}, {"stiffness_zones", 0}, {"gravity_backlash", 0}, {"backlash", 1},
      {"harmonic", 2},         {"thermal", 3},         {"thermal_zero", 4}};
  const auto found = kinds.find(effect);
  return found == kinds.end() ? -1 : static_cast<int>(joint) * 8 + found->second;
}

double root_mean_square(const std::vector<double>& values, const std::vector<std::int32_t>& rows) {
  double sum = 0.0;
  for (const std::int32_t row : rows)
    sum += values[static_cast<std::size_t>(row)] * values[static_cast<std::size_t>(row)];
  return std::sqrt(sum / std::max<double>(1.0, static_cast<double>(rows.size())));
}

/// "base.xyz" -> base.x, base.y, base.z; "base" and "base.xyzrxryrz" -> all six; a joint -> none.
std::vector<std::string> frame_coordinates(const std::string& site) {
  const std::size_t dot = site.rfind(".xyz");
  if (site != "base" && dot == std::string::npos) return {};
  const std::string frame = site.substr(0, dot);
  std::vector<std::string> out;
  for (int k = 0; k < (site.size() > 4 && dot != std::string::npos && site.size() == dot + 4 ? 3 : 6); ++k)
    out.push_back(frame + "." + kFrame[k]);
  return out;
}

/// Builds the list of candidates and, column by column, what they need.
class Builder {
 public:
  explicit Builder(const DesignTask& task) : task_(task), driven_(task.at.driven_joints()) {
    for (std::size_t k = 0; k < task.at.joints.size(); ++k) {
      const InputColumn* motion = input("q" + std::to_string(k + 1));
      moves_.push_back(!motion || !motion->constant);
      if (motion && motion->constant) {
        const Joint& joint = task.at.joints[k];
        if (!joint.passive())
          out_.not_testable.push_back({"every effect but its zero", {joint.name}, joint.name + " does not move"});
      }
    }
  }

  Candidates build() {
    geometry();
    for (const Effect& effect : catalogue()) {
      if (left_out(effect.name)) continue;
      if (effect.name == "base_frame" || effect.name == "tool_frame" || effect.name == "link_geometry" ||
          effect.name == "gravity_moment" || effect.name == "transmission_error")
        continue;
      add_effect(effect, false);
    }
    for (const Effect& effect : task_.options.own_effects) {
      if (!left_out(effect.name)) add_effect(effect, true);
    }
    drifts();
    laws();
    return std::move(out_);
  }

 private:
  bool left_out(const std::string& name) const {
    return std::find(task_.options.leave_out.begin(), task_.options.leave_out.end(), name) !=
           task_.options.leave_out.end();
  }

  const InputColumn* input(const std::string& name) const {
    for (const InputColumn& column : task_.inputs) {
      if (column.name == name) return &column;
    }
    return nullptr;
  }
  int input_index(const std::string& name) const {
    for (std::size_t k = 0; k < task_.inputs.size(); ++k) {
      if (task_.inputs[k].name == name) return static_cast<int>(k);
    }
    return -1;
  }

  void add(Explanation named, ColumnGroup group) {
    out_.named.push_back(std::move(named));
    out_.groups.push_back(std::move(group));
  }

  void geometry() {
    const Model plain = make_model(task_.at, task_.data);
    const std::vector<bool> parallel = near_parallel(task_.at, IdentifyOptions().hayati_angle);
    Explanation all;
    all.kind = Explanation::Kind::all_geometry;
    all.effect = "link_geometry";
    for (std::size_t k = 0; k < task_.at.joints.size(); ++k) {
      Explanation link;
      link.effect = "link_geometry";
      link.joints = {task_.at.joints[k].name};
      for (const ParameterInfo& info : plain.parameters) {
        if (info.role != Role::geometry || info.owner != static_cast<int>(k)) continue;
        const bool beta = info.name.size() > 5 && info.name.compare(info.name.size() - 5, 5, ".beta") == 0;
        if (beta && !parallel[k] && task_.at.joints[k].beta == 0.0) continue;
        link.parameters.push_back(info.name);
      }
      link.model_free = link.parameters;
      all.joints.push_back(link.joints[0]);
      all.parameters.insert(all.parameters.end(), link.parameters.begin(), link.parameters.end());
      if (!left_out("link_geometry")) add(link, {});
    }
    all.model_free = all.parameters;
    if (!left_out("link_geometry")) add(all, {});
  }

  void add_effect(const Effect& effect, bool own) {
    if (!effect.per_joint) {
      try_terms(effect, own, {});
      return;
    }
    std::string missing;
    bool any = false;
    for (std::size_t k = 0; k < task_.at.joints.size(); ++k) {
      if (!moves_[k] && effect.name != "joint_offset") continue;
      any |= try_terms(effect, own, {k}, &missing);
    }
    if (!any && !missing.empty()) out_.not_testable.push_back({effect.name, {}, missing});
  }

  bool try_terms(const Effect& effect, bool own, const std::vector<std::size_t>& joints,
                 std::string* missing = nullptr) {
    Explanation e;
    e.effect = effect.name;
    for (const std::size_t k : joints) e.joints.push_back(task_.at.joints[k].name);
    const std::size_t joint = joints.empty() ? 0 : joints[0];
    try {
      if ((effect.name == "thermal" || effect.name == "thermal_zero") && task_.data.temperature && !input("temp")) {
        throw std::invalid_argument("the column temp_C has rows without a number: fill or remove it to test " +
                                    effect.name);
      }
      if ((effect.name == "stiffness_zones" || effect.name == "gravity_backlash") && !knows_mass(task_.at)) {
        throw std::invalid_argument(effect.name +
                                    " needs the links' mass and com: the payload's torque alone does not say in which "
                                    "zone, or on which side, a joint is");
      }
      // Weights that nobody knows: the compliance finds the first moments itself.
      const bool weights_missing = effect.name == "joint_compliance" && !knows_mass(task_.at);
      std::vector<EffectRequest> requests;
      if (weights_missing) requests.push_back({"gravity_moment", e.joints});
      if (!weights_missing || task_.data.payload) requests.push_back({effect.name, e.joints});
      e.requests = requests;
      effect_terms(requests, task_.nominal, task_.data, own ? task_.options.own_effects : std::vector<Effect>{});
      const std::vector<Term> terms =
          effect_terms(requests, task_.at, task_.data, own ? task_.options.own_effects : std::vector<Effect>{});
      if (weights_missing)
        e.note = "the links' masses are not known: their first moments are found as well (gravity_moment)";
      if (effect.name == "gear_ratio") {
        e.parameters = e.model_free = {e.joints[0] + ".ratio"};
      } else if (effect.name == "joint_offset") {
        e.parameters = e.model_free = {e.joints[0] + ".offset"};
      } else {
        for (const Term& term : terms) {
          if (std::find(e.parameters.begin(), e.parameters.end(), term.parameter) == e.parameters.end())
            e.parameters.push_back(term.parameter);
        }
      }
    } catch (const Unsuited&) {
      return false;
    } catch (const std::invalid_argument& why) {
      if (missing && missing->empty()) *missing = why.what();
      if (!missing) out_.not_testable.push_back({effect.name, e.joints, why.what()});
      return false;
    }
    if (e.parameters.empty()) return false;
    const std::string number = std::to_string(joint + 1);
    e.driver = joints.empty() && effect.name != "drift" ? "" : driver_of(effect.name, number);
    ColumnGroup group;
    group.law_at = joints.empty() ? -1 : law_number(effect.name, joint);
    if (effect.name == "backlash" && task_.inferred_direction)
      e.note = "the approach direction was inferred from the order of the poses";
    // An input that never changes: the effect cannot be told from geometry, and is only named beside it.
    const InputColumn* driver = input(e.driver);
    if (effect.name == "backlash" && driver && driver->constant) {
      group.shadow = true;
      out_.not_testable.push_back(
          {effect.name, e.joints, "every pose was approached from the same side: the same as a joint zero"});
    }
    if ((effect.name == "thermal" || effect.name == "thermal_zero") && driver && driver->constant) {
      group.shadow = true;
      if (joint == 0)
        out_.not_testable.push_back({effect.name, {}, "the temperature is constant: the same as geometry"});
    }
    if (effect.name == "drift" && driver && driver->constant) return false;
    add(std::move(e), std::move(group));
    return true;
  }

  /// A frame that wanders freely: six coordinates, or the three of the place, by hats of time.
  void drifts() {
    if (left_out("drift")) return;
    const int time = input_index("time") >= 0 ? input_index("time") : input_index("order");
    if (time < 0 || task_.inputs[static_cast<std::size_t>(time)].constant) return;
    const bool by_order = task_.inputs[static_cast<std::size_t>(time)].name == "order";
    if (by_order) out_.not_testable.push_back({"drift", {}, "no column t_s: the order of the rows stands for time"});
    for (const int most : {6, 12, 24}) {
      const std::vector<double> knots = knots_of(task_.inputs[static_cast<std::size_t>(time)], task_.rows, most);
      if (static_cast<int>(knots.size()) < std::min(most, 4) || (most > 6 && static_cast<int>(knots.size()) < most))
        continue;
      for (const int coordinates : {3, 6}) {
        Explanation e;
        e.kind = Explanation::Kind::drift;
        e.effect = "drift";
        e.site = coordinates == 3 ? "base.xyz" : "base.xyzrxryrz";
        e.inputs = {time};
        e.knots = {knots};
        e.driver = task_.inputs[static_cast<std::size_t>(time)].name;
        e.note = std::string("the frame wanders: a free function of ") + (by_order ? "the order of the rows" : "time") +
                 ", " + std::to_string(knots.size()) + " knots";
        for (int c = 0; c < coordinates; ++c) {
          for (std::size_t k = 0; k < knots.size(); ++k) {
            e.parameters.push_back("drift_" + std::to_string(knots.size()) + "_" + std::to_string(coordinates) +
                                   ".base." + kFrame[c] + "." + std::to_string(k + 1));
          }
        }
        add(std::move(e), {});
      }
      if (most != 6) continue;
      // Or it is the target that has slipped on the last link.
      for (const Target& target : task_.at.targets) {
        Explanation e;
        e.kind = Explanation::Kind::drift;
        e.effect = "tool_frame";
        e.site = target.name + ".xyz";
        e.inputs = {time};
        e.knots = {knots};
        e.driver = task_.inputs[static_cast<std::size_t>(time)].name;
        e.note = "target " + target.name + " moves on the last link: a free function of " +
                 (by_order ? "the order of the rows" : "time");
        for (std::size_t k = 0; k < 3 * knots.size(); ++k)
          e.parameters.push_back("wander." + target.name + "." + std::to_string(k + 1));
        add(std::move(e), {});
      }
    }
  }

  /// Corrections of the laws of effects at joints, to be asked for once the effect itself is in.
  void laws() {
    const auto law = [&](const std::string& effect, std::size_t joint, const std::string& driver, int form) {
      const int at = input_index(driver);
      if (at < 0 || task_.inputs[static_cast<std::size_t>(at)].constant) return;
      Explanation e;
      e.kind = Explanation::Kind::law;
      e.effect = effect;
      e.joints = {task_.at.joints[joint].name};
      e.site = e.joints[0];
      e.inputs = {at};
      e.driver = driver;
      e.law_form = form;
      e.knots = {knots_of(task_.inputs[static_cast<std::size_t>(at)], task_.rows, form == 1 ? 5 : 8)};
      if (e.knots[0].size() < 3) return;
      for (std::size_t k = 0; k < e.knots[0].size(); ++k)
        e.parameters.push_back("law." + effect + "." + e.site + "." + std::to_string(k + 1));
      ColumnGroup group;
      group.corrects_law_at = group.law_at = law_number(effect, joint);
      add(std::move(e), std::move(group));
    };
    for (std::size_t k = 0; k < task_.at.joints.size(); ++k) {
      if (!moves_[k]) continue;
      const std::string number = std::to_string(k + 1);
      law("joint_compliance", k, "torque" + number, 0);
      law("harmonic", k, "q" + number, 0);
      law("thermal_zero", k, "temp", 0);
      law("backlash", k, knows_mass(task_.at) ? "torque" + number : "q" + number, 1);
      law("thermal", k, input_index("time") >= 0 ? "time" : "temp", 2);
    }
  }

  const DesignTask& task_;
  std::vector<std::size_t> driven_;
  std::vector<bool> moves_;
  Candidates out_;
};

/// Groups of one kind share the prior: the cost of having looked at all of them.
void charge_search(Candidates* candidates) {
  double count = 0.0;
  for (const ColumnGroup& group : candidates->groups) count += group.corrects_law_at < 0 && !group.shadow ? 1.0 : 0.0;
  for (ColumnGroup& group : candidates->groups)
    group.cost += group.corrects_law_at < 0 ? std::log(std::max(1.0, count)) : std::log(3.0);
}

}  // namespace

std::vector<InputColumn> make_inputs(const Robot& robot, const Measurements& data) {
  std::vector<InputColumn> out;
  const std::size_t n = data.rows, joints = robot.joints.size();
  const std::vector<std::size_t> driven = robot.driven_joints();
  const auto add = [&](const std::string& name, const std::string& unit, int joint, std::vector<double> values,
                       double least) {
    const bool finite = std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    if (finite) out.push_back({name, unit, joint, is_constant(values, least), std::move(values)});
  };
  const auto copy = [&](const Column& column) {
    std::vector<double> values(n);
    for (std::size_t row = 0; row < n; ++row) values[row] = column[row];
    return values;
  };
  std::vector<std::vector<double>> motion(joints, std::vector<double>(n)), torque;
  const bool weights = knows_mass(robot) || data.payload;
  if (weights) torque.assign(joints, std::vector<double>(n));
  const Eigen::MatrixXd coupling = coupling_matrix(robot);
  Robot plain = robot;
  for (Joint& joint : plain.joints) {
    joint.ratio = 1.0;
    joint.offset = 0.0;
  }
  Eigen::VectorXd reading(static_cast<Eigen::Index>(driven.size())), moment(static_cast<Eigen::Index>(joints));
  for (std::size_t row = 0; row < n; ++row) {
    for (std::size_t k = 0; k < driven.size(); ++k) reading[static_cast<Eigen::Index>(k)] = data.joints[k][row];
    const Eigen::VectorXd q = joint_motions(plain, reading);
    for (std::size_t k = 0; k < joints; ++k) motion[k][row] = q[static_cast<Eigen::Index>(k)];
    if (!weights) continue;
    gravity_torques_at(robot, coupling, forward_kinematics(robot, reading, 0), data.payload ? data.payload[row] : 0.0,
                       moment);
    for (std::size_t k = 0; k < joints; ++k) torque[k][row] = moment[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k < joints; ++k) {
    const bool revolute = robot.joints[k].type == JointType::revolute;
    add("q" + std::to_string(k + 1), revolute ? "rad" : "m", static_cast<int>(k), std::move(motion[k]), kStandstill);
  }
  for (std::size_t k = 0; k < driven.size() && k < data.direction.size(); ++k) {
    if (data.direction[k])
      add("dir" + std::to_string(driven[k] + 1), "", static_cast<int>(driven[k]), copy(data.direction[k]), 0.5);
  }
  for (std::size_t k = 0; k < driven.size() && k < data.joint_speed.size(); ++k) {
    if (data.joint_speed[k])
      add("speed" + std::to_string(driven[k] + 1), "rad/s", static_cast<int>(driven[k]), copy(data.joint_speed[k]),
          1e-6);
  }
  for (std::size_t k = 0; k < torque.size(); ++k) {
    const double size = torque[k].empty()
                            ? 0.0
                            : std::abs(*std::max_element(torque[k].begin(), torque[k].end(),
                                                         [](double a, double b) { return std::abs(a) < std::abs(b); }));
    if (size > 0.0) add("torque" + std::to_string(k + 1), "Nm", static_cast<int>(k), std::move(torque[k]), 1e-6 * size);
  }
  if (data.payload) add("payload", "kg", -1, copy(data.payload), 1e-6);
  if (data.temperature) add("temp", "deg C", -1, copy(data.temperature), 0.05);
  if (data.time) {
    add("time", "s", -1, copy(data.time), 1e-3);
  } else {
    std::vector<double> order(n);
    const std::vector<std::int32_t> group = pose_groups(data);
    for (std::size_t row = 0; row < n; ++row) order[row] = group[row];
    add("order", "", -1, std::move(order), 0.5);
  }
  for (const auto& [name, column] : data.covariates) {
    std::vector<double> values = copy(column);
    // A second record of a joint says what it differs by; speeds and records alone are joints again.
    if (name.rfind("qr", 0) == 0 && name.size() > 2 && std::isdigit(static_cast<unsigned char>(name[2]))) {
      const std::size_t k = static_cast<std::size_t>(std::stoi(name.substr(2)));
      if (k >= 1 && k <= driven.size()) {
        for (std::size_t row = 0; row < n; ++row) values[row] -= data.joints[k - 1][row];
        add("qr" + std::to_string(k) + "-q" + std::to_string(k), "rad", static_cast<int>(driven[k - 1]),
            std::move(values), 1e-7);
      }
      continue;
    }
    if (name.rfind("qd", 0) == 0 && !data.joint_speed.empty()) continue;
    if (out.size() < 60) add(name, "", -1, std::move(values), 0.0);
  }
  return out;
}

std::vector<double> knots_of(const InputColumn& input, const std::vector<std::int32_t>& rows, int most) {
  std::vector<double> sorted;
  sorted.reserve(rows.size());
  for (const std::int32_t row : rows) sorted.push_back(input.values[static_cast<std::size_t>(row)]);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty()) return {};
  const std::vector<double> few = distinct(sorted, static_cast<std::size_t>(most));
  if (!few.empty()) return few;
  std::vector<double> knots;
  for (int k = 0; k < most; ++k) {
    const double at = static_cast<double>(k) / (most - 1);
    // Halfway between equal steps and equal shares of the rows: neither gaps nor crowds get all the knots.
    const double share = sorted[static_cast<std::size_t>(at * static_cast<double>(sorted.size() - 1))];
    const double step = sorted.front() + at * (sorted.back() - sorted.front());
    const double knot = 0.5 * (share + step);
    if (knots.empty() || knot > knots.back() + 1e-9 * (sorted.back() - sorted.front())) knots.push_back(knot);
  }
  return knots;
}

void hats_at(const std::vector<double>& knots, double x, double* out) {
  const std::size_t n = knots.size();
  std::fill(out, out + n, 0.0);
  if (n == 0) return;
  if (x <= knots.front()) {
    out[0] = 1.0;
    return;
  }
  if (x >= knots.back()) {
    out[n - 1] = 1.0;
    return;
  }
  const auto above = static_cast<std::size_t>(std::upper_bound(knots.begin(), knots.end(), x) - knots.begin());
  const double part = (x - knots[above - 1]) / (knots[above] - knots[above - 1]);
  out[above - 1] = 1.0 - part;
  out[above] = part;
}

int Design::column(const std::string& name) const {
  for (std::size_t k = 0; k < column_names.size(); ++k) {
    if (column_names[k] == name) return static_cast<int>(k);
  }
  return -1;
}

Gram Design::gram_of_fold(int wanted) const {
  const Eigen::Index p = x.cols();
  GramSum sum(p);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (fold[static_cast<std::size_t>(i)] != wanted || weight[i] == 0.0) continue;
    double* out = sum.row();
    for (Eigen::Index k = 0; k < p; ++k) out[k * GramSum::stride()] = weight[i] * x(i, k);
    out[p * GramSum::stride()] = weight[i] * y[i];
    sum.push();
  }
  return sum.finish();
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
    std::vector<std::pair<std::string, double>> places;  // site, factor
    const std::vector<std::string> coordinates = frame_coordinates(candidate.site);
    if (!coordinates.empty()) {
      for (const std::string& site : coordinates) places.push_back({site, 1.0});
    } else if (candidate.law_form == 2) {
      const Joint& link = of.joints[of.joint_index(candidate.site)];
      const Eigen::Vector3d origin = link.T_parent_joint.translation();
      const std::pair<const char*, double> lengths[5] = {
          {"a", link.a}, {"d", link.d}, {"x", origin.x()}, {"y", origin.y()}, {"z", origin.z()}};
      for (const auto& [value, length] : lengths) {
        if ((value[0] >= 'x') == (of.convention == Convention::urdf) && length != 0.0)
          places.push_back({candidate.site + "." + value, length});
      }
    } else {
      places.push_back({candidate.site, 1.0});
    }
    Column direction;
    if (candidate.law_form == 1) {
      const std::vector<std::size_t> driven = of.driven_joints();
      const auto joint = static_cast<std::size_t>(inputs[static_cast<std::size_t>(candidate.inputs[0])].joint);
      direction =
          data.direction[static_cast<std::size_t>(std::find(driven.begin(), driven.end(), joint) - driven.begin())];
    }
    const auto k1 = candidate.knots[0].size(), k2 = candidate.knots.size() > 1 ? candidate.knots[1].size() : 1;
    std::vector<Term> terms;
    for (std::size_t s = 0; s < places.size(); ++s) {
      const std::size_t from = candidate.law_form == 2 ? 0 : s * k1 * k2;  // one function for all lengths of a link
      Term term;
      term.parameter = parameter;
      term.unit = "-";
      term.site = places[s].first;
      const std::vector<double>* first = &inputs[static_cast<std::size_t>(candidate.inputs[0])].values;
      const std::vector<double>* second =
          candidate.inputs.size() > 1 ? &inputs[static_cast<std::size_t>(candidate.inputs[1])].values : nullptr;
      term.basis = [=, times = places[s].second, knots = candidate.knots](const Inputs& in) {
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
      terms.push_back(std::move(term));
    }
    return terms;
  };
  return effect;
}

Design make_design(const DesignTask& task) {
  Design out;
  out.candidates = Builder(task).build();
  charge_search(&out.candidates);

  // The model with every effect at once.
  std::vector<EffectRequest> requests;
  std::set<std::pair<std::string, std::string>> asked;
  for (const Explanation& e : out.candidates.named) {
    for (const EffectRequest& request : e.requests) {
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        requests.push_back(request);
    }
  }
  const Model model = make_model(task.at, task.data, requests, task.options.own_effects);
  const std::vector<std::vector<double>> bases = make_bases(model, task.data);
  const std::vector<Segment> segments = make_segments(task.data, task.rows);
  const Content content = content_of(model, segments);

  // Core columns: what is always unknown, joint motions, and every parameter of a candidate.
  std::vector<int> free;
  const auto want = [&](int parameter) {
    const auto found = std::find(free.begin(), free.end(), parameter);
    if (found != free.end()) return static_cast<int>(found - free.begin());
    free.push_back(parameter);
    return static_cast<int>(free.size()) - 1;
  };
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const bool seen =
        (info.role == Role::base && content.frame) || (info.role == Role::anchor && content.distance) ||
        (info.role == Role::point && content.point[static_cast<std::size_t>(info.owner)]) ||
        (info.role == Role::target &&
         (info.rotation ? content.target_rotation : content.target)[static_cast<std::size_t>(info.owner)]);
    if (seen) out.nuisance.push_back(want(static_cast<int>(k)));
  }
  for (int k = 0; k < 6 && content.frame; ++k)
    out.base_columns.push_back(want(model.parameter_index(std::string("base.") + kFrame[k])));
  for (const Joint& joint : task.at.joints)
    out.joint_column.push_back({want(model.parameter_index(joint.name + ".offset"))});
  for (std::size_t g = 0; g < out.candidates.named.size(); ++g) {
    const Explanation& e = out.candidates.named[g];
    if (e.kind != Explanation::Kind::catalogue && e.kind != Explanation::Kind::all_geometry) continue;
    for (const std::string& name : e.parameters)
      out.candidates.groups[g].columns.push_back(want(model.parameter_index(name)));
  }
  // The evaluator wants its parameters in order.
  std::vector<int> order(free);
  std::sort(order.begin(), order.end());
  std::vector<int> place(free.size());
  for (std::size_t k = 0; k < free.size(); ++k) {
    place[k] = static_cast<int>(std::lower_bound(order.begin(), order.end(), free[k]) - order.begin());
  }
  const auto moved = [&](std::vector<int>* columns) {
    for (int& column : *columns) column = place[static_cast<std::size_t>(column)];
  };
  moved(&out.nuisance);
  moved(&out.base_columns);
  for (std::vector<int>& column : out.joint_column) moved(&column);
  for (ColumnGroup& group : out.candidates.groups) moved(&group.columns);
  const auto core = static_cast<Eigen::Index>(order.size());
  Eigen::Index derived = 0;
  for (const Explanation& e : out.candidates.named) {
    if (e.kind == Explanation::Kind::drift && !content.frame) continue;
    if (e.kind == Explanation::Kind::drift || e.kind == Explanation::Kind::law)
      derived += static_cast<Eigen::Index>(e.parameters.size());
  }

  const Evaluator evaluator(model, task.data, bases, segments, order, task.options.threads);
  const Eigen::VectorXd values = initial_values(model);
  out.x.resize(static_cast<Eigen::Index>(evaluator.components()), core + derived);
  out.y.resize(out.x.rows());
  Weighing weighing;
  weighing.rotation_scale = 1.0;
  weighing.row_weights = false;
  Eigen::Index at = 0;
  int tile = 0;
  Design::Rows jacobian;
  Eigen::VectorXd residual;
  for (const Segment& segment : segments) {
    const int components = segment.kind == kernel::Kind::distance ? 1 : segment.kind == kernel::Kind::pose ? 6 : 3;
    std::size_t next = 0;
    while (next < segment.rows.size()) {
      const int poses = evaluator.tile_rows(tile);
      const Eigen::Index values_here = static_cast<Eigen::Index>(poses) * components;
      jacobian.resize(values_here, core);
      residual.resize(values_here);
      evaluator.tile(tile++, values, weighing, residual.data(), jacobian.data());
      out.x.block(at, 0, values_here, core) = jacobian;
      out.y.segment(at, values_here) = -residual;
      for (int i = 0; i < poses; ++i) {
        for (int c = 0; c < components; ++c) {
          out.row.push_back(segment.rows[next + static_cast<std::size_t>(i)]);
          out.component.push_back(static_cast<std::int8_t>(components == 1 ? 6 : c));
        }
      }
      next += static_cast<std::size_t>(poses);
      at += values_here;
    }
  }

  // Names, units and the sizes that parameters may have.
  out.prior = Eigen::VectorXd::Constant(core + derived, kLargest);
  for (Eigen::Index k = 0; k < core; ++k) {
    const ParameterInfo& info = model.parameters[static_cast<std::size_t>(order[static_cast<std::size_t>(k)])];
    out.column_names.push_back(info.name);
    out.column_units.push_back(info.unit);
    double size = 0.0;
    for (const ColumnTerm& column : info.columns) {
      if (column.term >= 0)
        size = std::max(size, root_mean_square(bases[static_cast<std::size_t>(column.term)], task.rows));
      if (column.reading >= 0) {
        std::vector<double> reading(task.data.rows);
        for (std::size_t row = 0; row < reading.size(); ++row)
          reading[row] = task.data.joints[static_cast<std::size_t>(column.reading)][row];
        size = std::max(size, root_mean_square(reading, task.rows));
      }
    }
    if (size > 0.0) out.prior[k] = kLargest / size;
    const auto shift = task.shift.find(info.name);
    if (shift != task.shift.end()) out.y += shift->second * out.x.col(k);
  }

  // Drifts and laws: products of columns that are there with hats of inputs.
  Eigen::Index next = core;
  for (std::size_t g = 0; g < out.candidates.named.size(); ++g) {
    const Explanation& e = out.candidates.named[g];
    ColumnGroup& group = out.candidates.groups[g];
    if (e.kind != Explanation::Kind::drift && e.kind != Explanation::Kind::law) continue;
    if (e.kind == Explanation::Kind::drift && !content.frame) {
      group.shadow = true;
      continue;
    }
    Design::Rows columns;
    if (e.kind == Explanation::Kind::drift) {
      std::vector<int> sites;
      for (const std::string& site : frame_coordinates(e.site)) sites.push_back(out.column(site));
      if (std::find(sites.begin(), sites.end(), -1) != sites.end()) {  // a target that no row measures
        group.shadow = true;
        out.x.middleCols(next, static_cast<Eigen::Index>(e.parameters.size())).setZero();
        for (const std::string& name : e.parameters) {
          out.column_names.push_back(name);
          out.column_units.push_back("rad");
        }
        next += static_cast<Eigen::Index>(e.parameters.size());
        continue;
      }
      columns = free_columns(out, sites, task.inputs, e.inputs, e.knots);
    } else if (e.law_form == 2) {
      const std::string joint = e.site;
      const int length_columns[5] = {out.column(joint + ".a"), out.column(joint + ".d"), out.column(joint + ".x"),
                                     out.column(joint + ".y"), out.column(joint + ".z")};
      const Joint& link = task.at.joints[task.at.joint_index(joint)];
      const double lengths[5] = {link.a, link.d, link.T_parent_joint.translation().x(),
                                 link.T_parent_joint.translation().y(), link.T_parent_joint.translation().z()};
      for (int k = 0; k < 5; ++k) {
        if (length_columns[k] < 0 || lengths[k] == 0.0 || (k >= 2) != (task.at.convention == Convention::urdf))
          continue;
        const Design::Rows one = lengths[k] * free_columns(out, {length_columns[k]}, task.inputs, e.inputs, e.knots);
        if (columns.size() == 0)
          columns = one;
        else
          columns += one;
      }
      if (columns.size() == 0)
        columns = Design::Rows::Zero(out.x.rows(), static_cast<Eigen::Index>(e.parameters.size()));
    } else {
      columns = free_columns(out, out.joint_column[task.at.joint_index(e.site)], task.inputs, e.inputs, e.knots);
      if (e.law_form == 1) {
        const auto k = static_cast<std::size_t>(task.inputs[static_cast<std::size_t>(e.inputs[0])].joint);
        const std::vector<std::size_t> driven = task.at.driven_joints();
        const auto number = static_cast<std::size_t>(std::find(driven.begin(), driven.end(), k) - driven.begin());
        const bool known = number < task.data.direction.size() && task.data.direction[number];
        for (Eigen::Index i = 0; i < columns.rows(); ++i) {
          columns.row(i) *=
              known ? 0.5 * task.data.direction[number][static_cast<std::size_t>(out.row[static_cast<std::size_t>(i)])]
                    : 0.0;
        }
      }
    }
    out.x.middleCols(next, columns.cols()) = columns;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      group.columns.push_back(static_cast<int>(next + k));
      out.column_names.push_back(e.parameters[static_cast<std::size_t>(k)]);
      out.column_units.push_back("rad");
    }
    next += columns.cols();
  }

  // Folds of whole pose groups, drawn with the seed.
  out.folds = kFolds;
  out.test_folds = kTestFolds;
  std::map<std::int32_t, std::int32_t> fold_of;
  std::vector<std::int32_t> groups_of[2];
  for (const std::int32_t row : out.row) {
    const std::int32_t cluster = task.cluster[static_cast<std::size_t>(row)];
    if (fold_of.emplace(cluster, -1).second)
      groups_of[task.set[static_cast<std::size_t>(row)] ? 1 : 0].push_back(cluster);
  }
  Random random(task.options.seed + 0x7f4a7c15u);
  for (int part = 0; part < 2; ++part) {
    std::vector<std::int32_t>& clusters = groups_of[part];
    for (std::size_t k = clusters.size(); k > 1; --k) std::swap(clusters[k - 1], clusters[random.below(k)]);
    for (std::size_t k = 0; k < clusters.size(); ++k) {
      fold_of[clusters[k]] =
          part == 0 ? static_cast<std::int32_t>(k % kFolds) : kFolds + static_cast<std::int32_t>(k % kTestFolds);
    }
  }
  for (const std::int32_t row : out.row) {
    out.cluster.push_back(task.cluster[static_cast<std::size_t>(row)]);
    out.fold.push_back(fold_of[out.cluster.back()]);
  }
  out.weight = Eigen::VectorXd::Ones(out.x.rows());
  return out;
}

}  // namespace truing::diagnosis
