// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Before any data: columns of every effect at the planned poses, what base, tool and each other take up of them.

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

#include <Eigen/QR>

#include "estimation/evaluate.hpp"
#include "estimation/evidence.hpp"
#include "math/constants.hpp"
#include "math/random.hpp"
#include "math/text.hpp"
#include "model/gravity.hpp"
#include "model/model.hpp"
#include "planning/poses.hpp"
#include "rooms.hpp"
#include "truing/model/effect.hpp"
#include "truing/plan.hpp"

namespace truing {
using namespace planning;

namespace planning {
namespace {

const char* const kColumns[4] = {"dir", "payload", "temp", "t"};
/// A column of which less is left (of its square) cannot be seen.
constexpr double kInvisible = 1e-9;
/// Unit columns that add less than this to those before them are left out: of base, tool and geometry; of a rival,
/// which would need to be absurdly large.
constexpr double kSameColumn = 1e-8, kSameRival = 1e-4;
/// Pairs to be told apart get poses until less than this is shared: the size needed is then three times what it takes
/// to be seen.
constexpr double kGoal = 0.9;
/// A pose that tells less than this share of an effect does not tell.
constexpr double kTellsNothing = 1e-6;
/// Nor does one after which R2 falls by less than this, on average.
constexpr double kProgress = 1e-4;

using Eigen::Index;
using Eigen::MatrixXd;

/// One pose, and the inputs that it is measured with.
struct Planned {
  Pose joints;
  std::vector<double> direction;
  double payload = 0.0, temperature = 0.0, time = 0.0;
};

struct Recorded {
  bool direction = false, payload = false, temperature = false, time = false;
};

Recorded recorded(const DistinguishOptions& options) {
  Recorded out;
  bool* const flags[4] = {&out.direction, &out.payload, &out.temperature, &out.time};
  for (const std::string& name : options.columns) {
    const auto found = std::find(std::begin(kColumns), std::end(kColumns), name);
    if (found == std::end(kColumns))
      throw std::invalid_argument("distinguish: column '" + name + "' does not exist; there are dir, payload, temp, t");
    *flags[found - std::begin(kColumns)] = true;
  }
  return out;
}

/// Planned poses as measurements of the robot itself.
class Measured {
 public:
  Measured(const Robot& robot, const std::vector<Planned>& poses, const DistinguishOptions& options) {
    const Recorded with = recorded(options);
    const std::size_t driven = robot.driven_count();
    columns_.reserve(2 * driven + 3);  // columns keep their place
    data.rows = poses.size();
    const auto add = [&](const auto& value) {
      columns_.emplace_back();
      for (const Planned& pose : poses) columns_.back().push_back(value(pose));
      return Column{columns_.back().data(), 1};
    };
    for (std::size_t k = 0; k < driven; ++k)
      data.joints.push_back(add([k](const Planned& p) { return p.joints[static_cast<Index>(k)]; }));
    for (std::size_t k = 0; k < driven; ++k)
      data.direction.push_back(add([k](const Planned& p) { return p.direction[k]; }));
    if (with.payload) data.payload = add([](const Planned& p) { return p.payload; });
    if (with.temperature) data.temperature = add([](const Planned& p) { return p.temperature; });
    if (with.time) data.time = add([](const Planned& p) { return p.time; });
    Robot plain = robot;
    plain.effects.clear();
    predicted_ = predict(plain, data, {}, 1);
    for (std::size_t k = 0; k < 3; ++k) data.position[k] = {predicted_.position.data() + k, 3};
    for (std::size_t k = 0; k < 4 && options.orientation; ++k)
      data.orientation[k] = {predicted_.orientation.data() + k, 4};
  }
  Measured(const Measured&) = delete;
  Measured& operator=(const Measured&) = delete;

  Measurements data;

 private:
  std::vector<std::vector<double>> columns_;
  Prediction predicted_;
};

/// An effect at a joint (or of the whole robot), and how the model calls its parameters.
struct Group {
  std::string effect, joint;
  std::vector<std::string> parameters;
  std::vector<EffectRequest> requests;
};

bool is_named(const std::vector<EffectRequest>& requests, const Group& group) {
  return std::any_of(requests.begin(), requests.end(), [&](const EffectRequest& r) {
    return r.effect == group.effect &&
           (r.joints.empty() || std::find(r.joints.begin(), r.joints.end(), group.joint) != r.joints.end());
  });
}

/// Names that mean nothing are errors that list what there is.
void check(const Robot& robot, const std::vector<EffectRequest>& separate, const Measurements& data) {
  for (const EffectRequest& request : separate) {
    const Effect& effect = find_effect(request.effect);
    if (effect.name == "base_frame" || effect.name == "tool_frame")
      throw std::invalid_argument("distinguish: " + effect.name +
                                  " is fitted in any case, and what it explains is told from nothing");
    if (effect.name == "transmission_error") effect.terms(robot, 0, data);  // throws: the name lacks the order
    if (!effect.per_joint && !request.joints.empty())
      throw std::invalid_argument("distinguish: effect '" + effect.name +
                                  "' belongs to the robot as a whole and takes no joints");
    for (const std::string& joint : request.joints) {
      try {
        effect.terms(robot, robot.joint_index(joint), data);
      } catch (const Unsuited&) {
        throw;
      } catch (const std::invalid_argument&) {
        robot.joint_index(joint);  // throws again if it is the joint that does not exist; a column that is missing is
                                   // said in the result
      }
    }
  }
}

/// Every effect at every joint that these inputs can show, and why not the others.
std::vector<Group> find_groups(const Robot& robot, const Measurements& data, const std::vector<EffectRequest>& separate,
                               std::vector<NotTestable>* not_testable) {
  std::vector<Group> groups;
  const Model plain = make_model(robot, data);
  const std::vector<bool> parallel = near_parallel(robot, IdentifyOptions().hayati_angle);
  const auto add = [&](const Effect& effect, const std::vector<std::string>& joints) {
    Group group;
    group.effect = effect.name;
    if (!joints.empty()) group.joint = joints[0];
    if (effect.name == "joint_offset" || effect.name == "gear_ratio") {
      const std::string name = group.joint + (effect.name == "gear_ratio" ? ".ratio" : ".offset");
      effect.terms(robot, robot.joint_index(group.joint), data);
      if (plain.parameter_index(name) >= 0) group.parameters = {name};
    } else if (effect.name == "link_geometry") {
      const std::size_t joint = robot.joint_index(group.joint);
      for (const ParameterInfo& info : plain.parameters) {
        const bool beta = info.name.size() > 5 && info.name.compare(info.name.size() - 5, 5, ".beta") == 0;
        if (info.role != Role::geometry || info.owner != static_cast<int>(joint)) continue;
        if (!beta || parallel[joint] || robot.joints[joint].beta != 0.0) group.parameters.push_back(info.name);
      }
    } else {
      // Weights that nobody knows: the compliance finds the first moments itself.
      const bool weights_missing = effect.name == "joint_compliance" && !knows_mass(robot);
      if (weights_missing) group.requests.push_back({"gravity_moment", joints});
      if (!weights_missing || data.payload) group.requests.push_back({effect.name, joints});
      for (const Term& term : effect_terms(group.requests, robot, data)) {
        if (std::find(group.parameters.begin(), group.parameters.end(), term.parameter) == group.parameters.end())
          group.parameters.push_back(term.parameter);
      }
    }
    if (!group.parameters.empty()) groups.push_back(std::move(group));
  };

  std::vector<const Effect*> effects;
  for (const Effect& effect : catalogue()) {
    const bool named =
        std::any_of(separate.begin(), separate.end(), [&](const EffectRequest& r) { return r.effect == effect.name; });
    const bool special = effect.name == "base_frame" || effect.name == "tool_frame" ||
                         effect.name == "gravity_moment" || effect.name == "transmission_error";
    if (named || !special) effects.push_back(&effect);
  }
  for (const EffectRequest& request : separate) {  // transmission_error@96
    const Effect& effect = find_effect(request.effect);
    if (std::none_of(effects.begin(), effects.end(), [&](const Effect* e) { return e->name == effect.name; }))
      effects.push_back(&effect);
  }
  for (const Effect* effect : effects) {
    if (!effect->per_joint) {
      try {
        add(*effect, {});
      } catch (const Unsuited&) {
      } catch (const std::invalid_argument& why) {
        not_testable->push_back({effect->name, {}, why.what()});
      }
      continue;
    }
    std::vector<std::string> missing_at;
    std::string missing;
    const std::size_t before = groups.size();
    for (const Joint& joint : robot.joints) {
      try {
        add(*effect, {joint.name});
      } catch (const Unsuited&) {
      } catch (const std::invalid_argument& why) {
        if (missing.empty()) missing = why.what();
        missing_at.push_back(joint.name);
      }
    }
    if (missing.empty()) continue;
    if (groups.size() == before) missing_at.clear();  // at any joint
    not_testable->push_back({effect->name, std::move(missing_at), missing});
  }
  return groups;
}

/// Unit-weight columns of every parameter of the model at the planned poses.
struct Columns {
  MatrixXd x;  ///< shape (poses * per_pose, parameters)
  std::vector<ParameterInfo> parameters;
  Index per_pose = 3;

  Index at(const std::string& name) const {
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (parameters[k].name == name) return static_cast<Index>(k);
    }
    return -1;
  }
};

/// `carrying` (null: none) becomes the robot with the effects at zero: it remembers mean temperatures and knots.
Columns make_columns(const Robot& robot, const std::vector<Planned>& poses, const std::vector<EffectRequest>& requests,
                     const DistinguishOptions& options, Robot* carrying) {
  const Measured measured(robot, poses, options);
  const Model model = make_model(robot, measured.data, requests);
  const std::vector<bool> parallel = near_parallel(robot, IdentifyOptions().hayati_angle);
  Columns out;
  out.per_pose = options.orientation ? 6 : 3;
  std::vector<int> free;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const auto owner = static_cast<std::size_t>(std::max(info.owner, 0));
    const bool beta =
        info.role == Role::geometry && info.name.size() > 5 && info.name.compare(info.name.size() - 5, 5, ".beta") == 0;
    if (info.role == Role::anchor || info.role == Role::point) continue;
    if (info.role == Role::target && (info.owner != 0 || (info.rotation && !options.orientation))) continue;
    if (beta && !parallel[owner] && robot.joints[owner].beta == 0.0) continue;
    free.push_back(static_cast<int>(k));
    out.parameters.push_back(info);
  }
  std::vector<std::int32_t> rows(poses.size());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = static_cast<std::int32_t>(k);
  const std::vector<std::vector<double>> bases = make_bases(model, measured.data);
  const Evaluator evaluator(model, measured.data, bases, make_segments(measured.data, rows), free, 1);
  Weighing weighing;
  weighing.position_scale = 1.0 / options.position_sigma;
  weighing.rotation_scale = 1.0 / options.rotation_sigma;
  const Eigen::VectorXd values = initial_values(model);
  out.x.resize(static_cast<Index>(poses.size()) * out.per_pose, static_cast<Index>(free.size()));
  Index row = 0;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    Eigen::VectorXd r(evaluator.tile_rows(tile) * evaluator.tile_components(tile));
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(r.size(), out.x.cols());
    evaluator.tile(tile, values, weighing, r.data(), j.data());
    out.x.middleRows(row, r.size()) = j;
    row += r.size();
  }
  if (carrying) *carrying = robot_with(model, values);
  return out;
}

/// Length one, where there is any length.
MatrixXd unit_columns(MatrixXd x) {
  for (Index k = 0; k < x.cols(); ++k) {
    const double length = x.col(k).norm();
    if (length > 0.0) x.col(k) /= length;
  }
  return x;
}

/// What `basis` (orthonormal) leaves; twice, for the rounding of the first time.
MatrixXd beyond(const MatrixXd& basis, MatrixXd x) {
  for (int k = 0; k < 2; ++k) x -= basis * (basis.transpose() * x);
  return x;
}

MatrixXd orthonormal(const MatrixXd& x, double least) {
  if (x.cols() == 0 || x.rows() == 0) return MatrixXd(x.rows(), 0);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(x);
  Index rank = 0;
  const Index most = std::min(x.rows(), x.cols());
  while (rank < most && std::abs(qr.matrixR()(rank, rank)) > least) ++rank;
  return qr.householderQ() * MatrixXd::Identity(x.rows(), rank);
}

MatrixXd chosen(const MatrixXd& x, const std::vector<Index>& columns) {
  MatrixXd out(x.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) out.col(static_cast<Index>(k)) = x.col(columns[k]);
  return out;
}

MatrixXd beside(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd out(a.rows(), a.cols() + b.cols());
  out << a, b;
  return out;
}

/// One group's columns at a plan.
struct Seen {
  std::vector<Index> columns;  ///< of Columns
  MatrixXd left;               ///< unit columns beyond base and tool
  MatrixXd basis;              ///< and what they span
};

/// A plan, looked at.
struct View {
  Columns columns;
  std::vector<Index> base, tool, geometry;
  MatrixXd frames, all;    ///< bases of what base and tool span, and of that with all geometry
  std::vector<Seen> seen;  ///< parallel to the groups
  double values = 0.0;

  double r2(std::size_t a, std::size_t b) const {
    const double all_of_it = seen[a].left.squaredNorm();
    return all_of_it > 0.0 ? std::min(1.0, (seen[b].basis.transpose() * seen[a].left).squaredNorm() / all_of_it) : 0.0;
  }
  /// What is left of a parameter's square beyond base, tool and the rival.
  double visible_beside(std::size_t rival, Index column) const {
    return beyond(seen[rival].basis, beyond(frames, columns.x.col(column))).squaredNorm();
  }
};

View look(const Robot& robot, const std::vector<Planned>& poses, const std::vector<Group>& groups,
          const DistinguishOptions& options, Robot* carrying) {
  std::vector<EffectRequest> requests;
  std::set<std::pair<std::string, std::string>> asked;
  for (const Group& group : groups) {
    for (const EffectRequest& request : group.requests) {
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        requests.push_back(request);
    }
  }
  View out;
  out.columns = make_columns(robot, poses, requests, options, carrying);
  const MatrixXd& x = out.columns.x;
  out.values = static_cast<double>(x.rows());
  for (std::size_t k = 0; k < out.columns.parameters.size(); ++k) {
    const Role role = out.columns.parameters[k].role;
    if (role == Role::base) out.base.push_back(static_cast<Index>(k));
    if (role == Role::target) out.tool.push_back(static_cast<Index>(k));
    if (role == Role::geometry) out.geometry.push_back(static_cast<Index>(k));
  }
  out.frames = orthonormal(beside(unit_columns(chosen(x, out.base)), unit_columns(chosen(x, out.tool))), kSameColumn);
  out.all = beside(out.frames, orthonormal(beyond(out.frames, unit_columns(chosen(x, out.geometry))), kSameColumn));
  for (const Group& group : groups) {
    Seen seen;
    for (const std::string& name : group.parameters) {
      const Index column = out.columns.at(name);
      if (column >= 0) seen.columns.push_back(column);
    }
    seen.left = beyond(out.frames, unit_columns(chosen(x, seen.columns)));
    for (Index k = 0; k < seen.left.cols(); ++k) {
      if (seen.left.col(k).squaredNorm() < kInvisible)
        seen.left.col(k).setZero();  // rounding explains nothing, and is explained by anything
    }
    seen.basis = orthonormal(seen.left, kSameRival);
    out.seen.push_back(std::move(seen));
  }
  return out;
}

/// Standard errors that diagnose would ask of an effect with so many parameters, out of so many effects.
double standard_errors(const View& view, std::size_t group, std::size_t groups) {
  const auto parameters = static_cast<std::size_t>(std::max<Index>(1, view.seen[group].basis.cols()));
  return std::sqrt(
      2.0 * detection_nats(SearchOptions().threshold, std::log(static_cast<double>(groups)), parameters, view.values));
}

/// Rms motion of the tip by a parameter of one.
double at_tip(const View& view, Index column, double position_sigma) {
  double sum = 0.0;
  const Index poses = view.columns.x.rows() / view.columns.per_pose;
  for (Index k = 0; k < poses; ++k)
    sum += view.columns.x.col(column).segment<3>(k * view.columns.per_pose).squaredNorm();
  return position_sigma * std::sqrt(sum / static_cast<double>(std::max<Index>(1, poses)));
}

EffectSize smallest(const View& view, const Group& group, std::size_t g, std::size_t groups,
                    const DistinguishOptions& options) {
  EffectSize best;
  double least = std::numeric_limits<double>::infinity();
  bool best_with_geometry = false;
  const double errors = standard_errors(view, g, groups);
  for (const Index k : view.seen[g].columns) {
    const auto column = view.columns.x.col(k);
    const double visible = beyond(view.frames, column).squaredNorm(),
                 beside_geometry = beyond(view.all, column).squaredNorm();
    if (!(visible > kInvisible * column.squaredNorm())) continue;
    const bool with_geometry = beside_geometry > kInvisible * column.squaredNorm();
    const double tip = at_tip(view, k, options.position_sigma);
    const double size = errors / std::sqrt(visible),
                 larger = with_geometry ? errors / std::sqrt(beside_geometry) : kNaN;
    const double judged = (with_geometry ? larger : size) * tip;
    if (with_geometry < best_with_geometry || (with_geometry == best_with_geometry && judged >= least)) continue;
    least = judged;
    best_with_geometry = with_geometry;
    const ParameterInfo& info = view.columns.parameters[static_cast<std::size_t>(k)];
    best = {group.effect, group.joint, info.name, info.unit, size, size * tip, larger, larger * tip, errors};
  }
  return best;
}

std::string why_invisible(const View& view, const Seen& seen) {
  const MatrixXd x = unit_columns(chosen(view.columns.x, seen.columns));
  if (x.squaredNorm() == 0.0) return "moves nothing in this plan";
  const auto taken_up_by = [&](const std::vector<Index>& frame) {
    return beyond(orthonormal(unit_columns(chosen(view.columns.x, frame)), kSameColumn), x)
               .colwise()
               .squaredNorm()
               .maxCoeff() < kInvisible;
  };
  if (taken_up_by(view.base)) return "the same as the base frame";
  if (taken_up_by(view.tool)) return "the same as the tool";
  return "the same as base and tool together";
}

std::string separated_by(const Group& a, const Group& b, const DistinguishOptions& options) {
  const Recorded with = recorded(options);
  const auto one_is = [&](const char* x) { return a.effect == x || b.effect == x; };
  const auto pair_is = [&](const char* x, const char* y) {
    return (a.effect == x && b.effect == y) || (a.effect == y && b.effect == x);
  };
  const bool thermal = one_is("thermal") || one_is("thermal_zero");
  if (one_is("backlash") && !with.direction) return "approach the same poses from both sides (column dir)";
  if (pair_is("joint_offset", "link_geometry") && a.joint == b.joint)
    return "no measurement; a joint's zero is part of its link's geometry";
  if (pair_is("joint_compliance", "stiffness_zones") && a.joint == b.joint)
    return "no measurement; a spring with three zones can be a plain one";
  if (one_is("scale")) return "measure a scale bar of known length";
  if (thermal && one_is("drift")) return "measure during warm-up and cool-down, or touch a fixed nest again and again";
  if (thermal) return "measure at more temperatures, and further apart";
  if (one_is("drift")) return "measure fixed points again and again";
  if (pair_is("joint_compliance", "link_compliance")) return "put a target on the elbow, or measure orientations";
  if (one_is("joint_compliance") || one_is("link_compliance") || one_is("stiffness_zones") ||
      one_is("gravity_backlash")) {
    return with.payload ? "repeat the same poses with another payload"
                        : "repeat the same poses with another payload (column payload)";
  }
  if (one_is("gear_ratio") || one_is("harmonic")) return "use the joint's full range, both turns";
  if (one_is("axis_wobble") && !options.orientation) return "measure orientations as well";
  return "measure poses where the two differ (name both to have them added)";
}

/// The two, the one that is explained better first.
EffectPair make_pair(const View& view, const std::vector<Group>& groups, std::size_t a, std::size_t b,
                     const DistinguishOptions& options) {
  if (view.r2(b, a) > view.r2(a, b) + 1e-9) std::swap(a, b);
  EffectPair pair;
  pair.effect = groups[a].effect;
  pair.joint = groups[a].joint;
  pair.other = groups[b].effect;
  pair.other_joint = groups[b].joint;
  pair.r2 = view.r2(a, b);
  const EffectSize size = smallest(view, groups[a], a, groups.size(), options);
  pair.parameter = size.parameter;
  pair.unit = size.unit;
  const Index column = view.columns.at(size.parameter);
  const double visible = column < 0 ? 0.0 : view.visible_beside(b, column);
  pair.size = column >= 0 && visible > kInvisible * view.columns.x.col(column).squaredNorm()
                  ? size.standard_errors / std::sqrt(visible)
                  : kNaN;
  pair.separated_by = separated_by(groups[a], groups[b], options);
  return pair;
}

/// Draws the inputs of poses.
class InputDraw {
 public:
  InputDraw(const DistinguishOptions& options, std::size_t driven)
      : options_(options), with_(recorded(options)), driven_(driven), random_(options.seed + 0x51ed2701u) {}

  /// Of the plan's own poses: warm-up and cool-down, half a sine, so that temperature is no function of time alone.
  Planned planned(const Pose& joints, std::size_t k, std::size_t count) {
    Planned out = drawn(joints, k);
    const double part = count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0.5;
    out.temperature =
        options_.temperature_low + (options_.temperature_high - options_.temperature_low) * std::sin(M_PI * part);
    return out;
  }

  /// Of poses to choose from, measured as number `k`: warm or cold.
  Planned drawn(const Pose& joints, std::size_t k) {
    Planned out;
    out.joints = joints;
    for (std::size_t j = 0; j < driven_; ++j) out.direction.push_back(coin() || !with_.direction ? 1.0 : -1.0);
    out.payload = coin() ? options_.payload : 0.0;
    out.temperature = coin() ? options_.temperature_high : options_.temperature_low;
    out.time = options_.seconds_per_pose * static_cast<double>(k);
    return out;
  }

  Random& random() { return random_; }

 private:
  bool coin() { return (random_.next() & 1u) != 0; }

  const DistinguishOptions& options_;
  Recorded with_;
  std::size_t driven_;
  Random random_;
};

using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// The pose, of some hundred, where rivals that are fitted to each other on what is planned already still differ most
/// (greedy T-optimal design, Atkinson and Fedorov 1975), summed over the pairs that are still alike. False: none tells.
bool next_pose(const View& view, const std::vector<Planned>& proposals, const Robot& carrying, const Pairs& alike,
               const DistinguishOptions& options, Planned* out) {
  const Columns there = make_columns(carrying, proposals, {}, options, nullptr);
  const Index m = there.per_pose, count = static_cast<Index>(proposals.size());
  Eigen::VectorXd told = Eigen::VectorXd::Zero(count);
  std::vector<Index> frames = view.base;
  frames.insert(frames.end(), view.tool.begin(), view.tool.end());
  const auto same_there = [&](const std::vector<Index>& columns) {
    std::vector<Index> places;
    for (const Index k : columns) places.push_back(there.at(view.columns.parameters[static_cast<std::size_t>(k)].name));
    return places;
  };
  const double planned = static_cast<double>(view.columns.x.rows() / m);
  for (const auto& [a, b] : alike) {
    std::vector<Index> rivals = frames;
    rivals.insert(rivals.end(), view.seen[b].columns.begin(), view.seen[b].columns.end());
    MatrixXd x = chosen(view.columns.x, rivals), x_there = chosen(there.x, same_there(rivals));
    MatrixXd y = chosen(view.columns.x, view.seen[a].columns),
             y_there = chosen(there.x, same_there(view.seen[a].columns));
    // Unit rms over plan and proposals together, so that what the plan does not move at all counts as well.
    const auto scale = [&](MatrixXd* here, MatrixXd* other) {
      for (Index k = 0; k < here->cols(); ++k) {
        const double rms =
            std::sqrt(here->col(k).squaredNorm() / planned + other->col(k).squaredNorm() / static_cast<double>(count));
        if (!(rms > 0.0)) continue;
        here->col(k) /= rms;
        other->col(k) /= rms;
      }
    };
    scale(&x, &x_there);
    scale(&y, &y_there);
    // What the plan leaves open, the rival uses to follow on poses of this kind in general: they count, but little.
    const double little = std::sqrt(1e-3 * planned / static_cast<double>(count));
    MatrixXd both(x.rows() + x_there.rows(), x.cols()), wanted(both.rows(), y.cols());
    both << x, little * x_there;
    wanted << y, little * y_there;
    const MatrixXd left = y_there - x_there * Eigen::ColPivHouseholderQR<MatrixXd>(both).solve(wanted);
    for (Index k = 0; k < count; ++k)
      told[k] += left.middleRows(k * m, m).squaredNorm() / static_cast<double>(std::max<Index>(1, y.cols()));
  }
  Index best = -1;
  if (count == 0 || !(told.maxCoeff(&best) > kTellsNothing)) return false;
  *out = proposals[static_cast<std::size_t>(best)];
  return true;
}

}  // namespace
}  // namespace planning

bool DistinguishOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) {
    if (error) *error = why;
    return false;
  };
  if (!(payload > 0.0) || !std::isfinite(payload)) return fail("payload must be positive");
  if (!(temperature_high > temperature_low) || !std::isfinite(temperature_high - temperature_low))
    return fail("temperature_high must be above temperature_low");
  if (!(seconds_per_pose > 0.0) || !std::isfinite(seconds_per_pose)) return fail("seconds_per_pose must be positive");
  if (!(position_sigma > 0.0) || !(rotation_sigma > 0.0))
    return fail("position_sigma and rotation_sigma must be positive");
  if (!(alike > 0.0 && alike < 1.0)) return fail("alike must lie between 0 and 1");
  if (add < 0 || proposals < 1) return fail("add must not be negative, proposals at least 1");
  if (!(min_step >= 0.0) || !(min_step_prismatic >= 0.0)) return fail("min_step must not be negative");
  return true;
}

Distinction distinguish(const Robot& given, const Eigen::MatrixXd& joints, const DistinguishOptions& options) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument("distinguish: " + error);
  validate(given);
  Robot robot = given;
  robot.effects.clear();
  const Recorded with = recorded(options);
  const std::size_t driven = robot.driven_count();
  if (joints.cols() != static_cast<Index>(driven)) {
    throw std::invalid_argument("distinguish: poses have " + std::to_string(joints.cols()) + " joints, and the robot " +
                                std::to_string(driven) + " driven ones");
  }
  if (joints.rows() < 3) throw std::invalid_argument("distinguish: a plan has at least 3 poses");
  if (!joints.allFinite()) throw std::invalid_argument("distinguish: joints must be finite");

  InputDraw inputs(options, driven);
  std::vector<Planned> poses;
  for (Index k = 0; k < joints.rows(); ++k)
    poses.push_back(inputs.planned(joints.row(k).transpose(), static_cast<std::size_t>(k),
                                   static_cast<std::size_t>(joints.rows())));

  Distinction result;
  std::vector<Group> groups;
  {
    const Measured measured(robot, poses, options);
    check(robot, options.separate, measured.data);
    groups = find_groups(robot, measured.data, options.separate, &result.not_testable);
  }
  // One effect alone is to be told from everything else.
  std::set<std::string> names;
  for (const EffectRequest& request : options.separate) names.insert(request.effect);
  const bool all = names.size() < 2;
  const auto named = [&](std::size_t g) { return is_named(options.separate, groups[g]); };

  Robot carrying;
  View view = look(robot, poses, groups, options, &carrying);
  const auto visible = [&](std::size_t g) { return view.seen[g].basis.cols() > 0; };
  Pairs pairs;  // to be told apart
  for (std::size_t a = 0; a < groups.size(); ++a) {
    for (std::size_t b = a + 1; b < groups.size(); ++b) {
      const bool wanted = all ? named(a) || named(b) : named(a) && named(b);
      if (wanted && visible(a) && visible(b)) pairs.emplace_back(a, b);
    }
  }
  for (const auto& [a, b] : pairs) result.separated.push_back(make_pair(view, groups, a, b, options));

  // Poses that tell them apart.
  if (!pairs.empty() && options.add > 0) {
    const std::vector<Range> ranges = joint_ranges(robot, options.min_step, options.min_step_prismatic, "distinguish");
    const Model bare = make_model(robot, Measurements{});
    const std::vector<Planned> first = poses;
    while (result.added < options.add) {
      Pairs alike;
      for (const auto& [a, b] : pairs) {
        const double forth = view.r2(a, b), back = view.r2(b, a);
        if (std::max(forth, back) > kGoal) alike.push_back(forth >= back ? std::make_pair(a, b) : std::make_pair(b, a));
      }
      if (alike.empty()) break;
      std::vector<Planned> proposals;
      const Pose last = poses.back().joints;
      for (int k = 0; k < options.proposals; ++k) {
        Pose pose(static_cast<Index>(driven));
        if (k % 2 == 0) {  // a pose of the plan again, with other inputs
          pose = first[inputs.random().below(first.size())].joints;
          bool far = true;
          for (Index j = 0; j < pose.size(); ++j)
            far = far && std::abs(pose[j] - last[j]) > ranges[static_cast<std::size_t>(j)].step;
          if (!far) continue;
        } else if (!draw_pose(robot, bare, ranges, &last, nullptr, &inputs.random(), &pose)) {
          continue;
        }
        proposals.push_back(inputs.drawn(pose, poses.size()));
      }
      Planned best;
      if (!next_pose(view, proposals, carrying, alike, options, &best)) break;
      poses.push_back(best);
      Robot carrying_more;
      View more = look(robot, poses, groups, options, &carrying_more);
      double fall = 0.0;
      for (const auto& [a, b] : alike) fall += view.r2(a, b) - more.r2(a, b);
      if (fall < kProgress * static_cast<double>(alike.size())) {
        poses.pop_back();
        break;
      }
      view = std::move(more);
      carrying = std::move(carrying_more);
      ++result.added;
    }
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      EffectPair& pair = result.separated[k];
      const bool as_before = groups[pairs[k].first].effect == pair.effect && groups[pairs[k].first].joint == pair.joint;
      const std::size_t a = as_before ? pairs[k].first : pairs[k].second,
                        b = as_before ? pairs[k].second : pairs[k].first;
      pair.r2_after = view.r2(a, b);
      const Index column = view.columns.at(pair.parameter);
      const double left = column < 0 ? 0.0 : view.visible_beside(b, column);
      if (left > kInvisible * view.columns.x.col(std::max<Index>(0, column)).squaredNorm())
        pair.size_after = standard_errors(view, a, groups.size()) / std::sqrt(left);
    }
  }
  std::stable_sort(result.separated.begin(), result.separated.end(),
                   [](const EffectPair& a, const EffectPair& b) { return a.r2 > b.r2; });

  // What the whole plan sees.
  std::vector<std::size_t> shown;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    if (!options.separate.empty() && !all && !named(g)) continue;
    if (!visible(g)) {
      result.not_testable.push_back(
          {groups[g].effect,
           groups[g].joint.empty() ? std::vector<std::string>{} : std::vector<std::string>{groups[g].joint},
           why_invisible(view, view.seen[g])});
      continue;
    }
    shown.push_back(g);
    result.effects.push_back(smallest(view, groups[g], g, groups.size(), options));
  }
  if (!options.separate.empty() && !all) {  // nobody asked for the others
    const auto other = [&](const NotTestable& n) { return names.count(n.effect) == 0; };
    result.not_testable.erase(std::remove_if(result.not_testable.begin(), result.not_testable.end(), other),
                              result.not_testable.end());
  }
  if (!with.direction && (all || names.count("backlash") > 0)) {
    result.not_testable.push_back(
        {"backlash",
         {},
         "no column dir: every pose is approached from the same side, and play is the same as a joint's zero"});
  }
  const auto count = static_cast<Index>(shown.size());
  result.r2.resize(count, count);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      const std::size_t a = shown[static_cast<std::size_t>(i)], b = shown[static_cast<std::size_t>(j)];
      result.r2(i, j) = i == j ? 1.0 : view.r2(a, b);
    }
  }
  for (Index i = 0; i < count; ++i) {
    for (Index j = i + 1; j < count; ++j) {
      if (std::max(result.r2(i, j), result.r2(j, i)) > options.alike) {
        result.alike.push_back(
            make_pair(view, groups, shown[static_cast<std::size_t>(i)], shown[static_cast<std::size_t>(j)], options));
      }
    }
  }
  std::stable_sort(result.alike.begin(), result.alike.end(),
                   [](const EffectPair& a, const EffectPair& b) { return a.r2 > b.r2 + 1e-9; });

  const auto n = static_cast<Index>(poses.size());
  result.joints.resize(n, static_cast<Index>(driven));
  if (with.direction) result.direction.resize(n, static_cast<Index>(driven));
  if (with.payload) result.payload.resize(n);
  if (with.temperature) result.temperature.resize(n);
  if (with.time) result.time.resize(n);
  for (Index k = 0; k < n; ++k) {
    const Planned& pose = poses[static_cast<std::size_t>(k)];
    result.joints.row(k) = pose.joints.transpose();
    for (Index j = 0; j < result.direction.cols(); ++j)
      result.direction(k, j) = pose.direction[static_cast<std::size_t>(j)];
    if (with.payload) result.payload[k] = pose.payload;
    if (with.temperature) result.temperature[k] = pose.temperature;
    if (with.time) result.time[k] = pose.time;
  }
  return result;
}

}  // namespace truing
