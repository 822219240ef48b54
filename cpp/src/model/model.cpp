// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/model.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <stdexcept>

#include "math/near_names.hpp"
#include "math/registration.hpp"
#include "math/text.hpp"
#include "model/effects/traits.hpp"
#include "truing/model/effect_values.hpp"

namespace truing::model {
namespace {

constexpr const char* kFrameNames[6] = {"x", "y", "z", "rz", "ry", "rx"};
constexpr Motion kFrameMotions[6] = {Motion::translate_x, Motion::translate_y, Motion::translate_z,
                                     Motion::rotate_z,    Motion::rotate_y,    Motion::rotate_x};

class Builder {
 public:
  explicit Builder(Model* model) : model_(*model) {}

  int add_parameter(const std::string& name, const std::string& unit, Role role, int owner) {
    ParameterInfo info;
    info.name = name;
    info.unit = unit;
    info.role = role;
    info.owner = owner;
    model_.parameters.push_back(info);
    return static_cast<int>(model_.parameters.size()) - 1;
  }

  int add_site(Motion motion, const std::string& name, Role role, int owner) {
    const int site = static_cast<int>(model_.sites.size());
    Site s;
    s.motion = motion;
    s.parameter = add_parameter(name, is_rotation(motion) ? "rad" : "m", role, owner);
    model_.parameters.back().columns = {{{{site, 1.0}}, -1, -1}};
    model_.sites.push_back(s);
    return site;
  }

  void add_fixed(const Eigen::Matrix3d& rotation) {
    if (rotation.isIdentity(0.0)) return;
    Site s;
    s.fixed = rotation;
    model_.sites.push_back(s);
  }

  /// T = Trans(x, y, z) Rz(rz) Ry(ry) Rx(rx) R0: small rotations on top of R0, so that no orientation is singular.
  void add_frame(const std::string& prefix, const Eigen::Isometry3d& T, Role role, int owner) {
    for (int k = 0; k < 6; ++k) {
      add_site(kFrameMotions[k], prefix + "." + kFrameNames[k], role, owner);
      if (role == Role::target) model_.parameters.back().rotation = k >= 3;
    }
    add_fixed(T.rotation());
  }

  /// Returns the site that the joint's motion moves.
  int add_joint(const Joint& joint, int index, Convention convention) {
    const auto geometry = [&](Motion motion, const char* name) {
      return add_site(motion, joint.name + "." + name, Role::geometry, index);
    };
    int theta = -1, d = -1;
    switch (convention) {
      case Convention::dh:
        theta = geometry(Motion::rotate_z, "theta");
        d = geometry(Motion::translate_z, "d");
        geometry(Motion::translate_x, "a");
        geometry(Motion::rotate_x, "alpha");
        geometry(Motion::rotate_y, "beta");
        break;
      case Convention::mdh:
        geometry(Motion::rotate_x, "alpha");
        geometry(Motion::translate_x, "a");
        geometry(Motion::rotate_y, "beta");
        theta = geometry(Motion::rotate_z, "theta");
        d = geometry(Motion::translate_z, "d");
        break;
      case Convention::urdf: {
        add_frame(joint.name, joint.T_parent_joint, Role::geometry, index);
        const Eigen::Matrix3d z_to_axis = least_rotation(Eigen::Vector3d::UnitZ(), joint.axis).toRotationMatrix();
        add_fixed(z_to_axis);
        Site motion;
        motion.motion = joint.type == JointType::revolute ? Motion::rotate_z : Motion::translate_z;
        model_.sites.push_back(motion);
        theta = d = static_cast<int>(model_.sites.size()) - 1;
        add_fixed(z_to_axis.transpose());
        break;
      }
    }
    return joint.type == JointType::revolute ? theta : d;
  }

 private:
  Model& model_;
};

/// By how much a joint moves for a motion of one of `joint`, however indirectly it is driven. `known`: of each joint
/// that was asked for before; NaN: not yet.
double moved_by(const Robot& robot, std::size_t joint, std::size_t of, std::vector<double>* known) {
  double& out = (*known)[of];
  if (!std::isnan(out)) return out;
  double sum = of == joint ? 1.0 : 0.0;
  for (const auto& [driver, factor] : robot.joints[of].driven_by) {
    for (std::size_t k = 0; k < robot.joints.size(); ++k) {
      if (robot.joints[k].name == driver) sum += factor * moved_by(robot, joint, k, known);
    }
  }
  return out = sum;
}

/// Everything that the motion of `joint` moves: its own site first, then those of the joints that it drives.
std::vector<SiteWeight> moved_sites(const Robot& robot, const std::vector<int>& own_site, std::size_t joint) {
  std::vector<double> known(robot.joints.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<SiteWeight> out{{own_site[joint], 1.0}};
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    const double weight = moved_by(robot, joint, k, &known);
    if (k != joint && weight != 0.0) out.push_back({own_site[k], weight});
  }
  return out;
}

/// The coordinate that a term's site names; a link value, base or target coordinate becomes a coordinate of its own.
int coordinate_of(Model* model, const std::string& site) {
  for (std::size_t k = 0; k < model->robot.joints.size(); ++k) {
    if (model->robot.joints[k].name == site) return static_cast<int>(k);
  }
  const int parameter = model->parameter_index(site);
  const bool is_site = parameter >= 0 && model->parameters[parameter].role != Role::offset &&
                       model->parameters[parameter].role != Role::ratio &&
                       model->parameters[parameter].columns.size() == 1;
  if (!is_site) {
    throw std::invalid_argument("effect site '" + site + "' does not exist; a site is a joint, a link value such as '" +
                                model->robot.joints[0].name + ".a', or base.x … tool.rz");
  }
  Coordinate own;
  own.sites = model->parameters[parameter].columns[0].sites;
  model->coordinates.push_back(own);
  return static_cast<int>(model->coordinates.size()) - 1;
}

void add_request(Model* model, const EffectRequest& request, const Measurements& data, const std::vector<Effect>& own) {
  model->requests.push_back(request);
  const int request_index = static_cast<int>(model->requests.size()) - 1;
  for (Term& term : effect_terms({request}, model->robot, data, own)) {
    int parameter = model->parameter_index(term.parameter);
    if (parameter >= 0 && model->parameters[parameter].owner != request_index)
      continue;  // the robot has this effect already
    const int index = static_cast<int>(model->terms.size());
    const int at = coordinate_of(model, term.site);
    model->coordinates[at].terms.push_back(index);
    if (parameter < 0) {
      ParameterInfo info;
      info.name = term.parameter;
      info.unit = term.unit;
      info.role = Role::effect;
      info.owner = request_index;
      model->parameters.push_back(info);
      parameter = static_cast<int>(model->parameters.size()) - 1;
    }
    model->parameters[parameter].columns.push_back({model->coordinates[at].sites, -1, index});
    model->term_parameter.push_back(parameter);
    model->terms.push_back(std::move(term));
  }
}

/// Names of the values that effects have: their parameters, and constants of their laws. `owner`: of one request; -1:
/// of all.
std::set<std::string> effect_values(const Model& model, int owner) {
  std::set<std::string> names;
  for (const ParameterInfo& info : model.parameters) {
    if (info.role != Role::effect || (owner >= 0 && info.owner != owner)) continue;
    names.insert(info.name);
    for (const ColumnTerm& column : info.columns) {
      for (const auto& [name, value] : model.terms[column.term].constants) names.insert(name);
    }
  }
  return names;
}

/// A value of effect `k` of the robot that no law looks at, in words: a misspelt one would do nothing. "": none.
std::string unknown_value(const Model& model, std::size_t k, const std::set<std::string>& known) {
  const AppliedEffect& applied = model.robot.effects[k];
  for (const auto& [name, value] : applied.parameters) {
    if (known.count(name)) continue;
    const std::set<std::string> own = effect_values(model, static_cast<int>(k));
    const std::vector<std::string> has(own.begin(), own.end());
    return "effect '" + applied.effect + "' has a value '" + name + "', which its law does not look at" +
           did_you_mean(name, has) + "; it has " + (has.empty() ? "none here" : listed(has));
  }
  return "";
}

void require_known_values(const Model& model) {
  if (model.robot.effects.empty()) return;
  const std::set<std::string> known = effect_values(model, -1);
  for (std::size_t k = 0; k < model.robot.effects.size(); ++k) {
    const std::string text = unknown_value(model, k, known);
    if (!text.empty()) throw std::invalid_argument(text);
  }
}

/// A row of zeros with every input that effects may ask for.
Measurements row_of_zeros(const Robot& robot) {
  static const double zero = 0.0;
  const Column column{&zero, 0};
  Measurements row;
  row.rows = 1;
  row.joints.assign(robot.driven_count(), column);
  row.direction = row.joint_speed = row.joints;
  row.payload = row.temperature = row.time = column;
  return row;
}

double* geometry_value(Joint* joint, const std::string& name) {
  if (name == "theta") return &joint->theta;
  if (name == "d") return &joint->d;
  if (name == "a") return &joint->a;
  if (name == "alpha") return &joint->alpha;
  return name == "beta" ? &joint->beta : nullptr;
}

std::string suffix(const std::string& name) { return name.substr(name.rfind('.') + 1); }

/// Index of a frame coordinate in kFrameNames.
int frame_coordinate(const std::string& name) {
  for (int k = 0; k < 6; ++k) {
    if (name == kFrameNames[k]) return k;
  }
  return -1;
}

/// Trans(x, y, z) Rz Ry Rx R0 for the six values in order of kFrameNames.
Eigen::Isometry3d frame_with(const Eigen::Isometry3d& start, const Eigen::Matrix<double, 6, 1>& v) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = v.head<3>();
  T.linear() = rotation_from_rpy({v[5], v[4], v[3]}) * start.linear();
  return T;
}

}  // namespace

int Model::parameter_index(const std::string& name) const {
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].name == name) return static_cast<int>(k);
  }
  return -1;
}

namespace {

/// The model with the effects that the robot has, whatever their values are called.
Model model_of(const Robot& robot, const Measurements& data, const std::vector<Effect>& own) {
  validate(robot);
  Model model;
  model.robot = robot;
  if (model.robot.targets.empty()) model.robot.targets.push_back({"tool", Eigen::Isometry3d::Identity()});
  Builder build(&model);

  build.add_frame("base", robot.T_measurement_base, Role::base, -1);
  std::vector<int> own_site;
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    own_site.push_back(build.add_joint(robot.joints[k], static_cast<int>(k), robot.convention));
  }
  model.common_sites = static_cast<int>(model.sites.size());
  for (std::size_t k = 0; k < model.robot.targets.size(); ++k) {
    model.target_first.push_back(static_cast<int>(model.sites.size()));
    build.add_frame(model.robot.targets[k].name, model.robot.targets[k].T_last_target, Role::target,
                    static_cast<int>(k));
  }
  model.target_first.push_back(static_cast<int>(model.sites.size()));

  int reading = 0;
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    const Joint& joint = robot.joints[k];
    Coordinate coordinate;
    coordinate.sites = moved_sites(robot, own_site, k);
    coordinate.offset = build.add_parameter(joint.name + ".offset", joint.type == JointType::revolute ? "rad" : "m",
                                            Role::offset, static_cast<int>(k));
    model.parameters.back().columns = {{coordinate.sites, -1, -1}};
    if (!joint.passive()) {
      coordinate.reading = reading;
      coordinate.ratio = build.add_parameter(joint.name + ".ratio", "-", Role::ratio, static_cast<int>(k));
      model.parameters.back().columns = {{coordinate.sites, reading++, -1}};
    }
    model.coordinates.push_back(coordinate);
  }

  const char* const axes[4] = {"x", "y", "z", "zero"};
  for (int k = 0; k < 4; ++k) {
    build.add_parameter(std::string("anchor.") + axes[k], "m", Role::anchor, -1);
    model.parameters.back().axis = k;
  }
  model.point_names = data.fixed_point_names;
  for (std::size_t p = 0; p < model.point_names.size(); ++p) {
    for (int k = 0; k < 3; ++k) {
      build.add_parameter("point." + model.point_names[p] + "." + axes[k], "m", Role::point, static_cast<int>(p));
      model.parameters.back().axis = k;
    }
  }

  for (const AppliedEffect& applied : robot.effects) add_request(&model, {applied.effect, applied.joints}, data, own);
  return model;
}

}  // namespace

Model make_model(const Robot& robot, const Measurements& data, const std::vector<EffectRequest>& requests,
                 const std::vector<Effect>& own) {
  Model model = model_of(robot, data, own);
  require_known_values(model);
  for (const EffectRequest& request : requests) add_request(&model, request, data, own);
  return model;
}

Eigen::VectorXd initial_values(const Model& model) {
  const Robot& robot = model.robot;
  Eigen::VectorXd values = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.parameters.size()));
  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    const ParameterInfo& info = model.parameters[i];
    const std::string name = suffix(info.name);
    const int coordinate = frame_coordinate(name);
    const auto translation = [&](const Eigen::Isometry3d& T) {
      return coordinate < 3 ? T.translation()[coordinate] : 0.0;
    };
    double& value = values[static_cast<Eigen::Index>(i)];
    switch (info.role) {
      case Role::base:
        value = translation(robot.T_measurement_base);
        break;
      case Role::target:
        value = translation(robot.targets[info.owner].T_last_target);
        break;
      case Role::geometry: {
        Joint joint = robot.joints[info.owner];
        value =
            robot.convention == Convention::urdf ? translation(joint.T_parent_joint) : *geometry_value(&joint, name);
        break;
      }
      case Role::offset:
        value = robot.joints[info.owner].offset;
        break;
      case Role::ratio:
        value = robot.joints[info.owner].ratio;
        break;
      case Role::anchor:
        if (robot.anchor) value = info.axis == 3 ? robot.anchor->zero : robot.anchor->point[info.axis];
        break;
      case Role::point:
        break;
      case Role::effect:
        for (const AppliedEffect& applied : robot.effects) {
          const auto found = applied.parameters.find(info.name);
          if (found != applied.parameters.end()) value = found->second;
        }
        break;
    }
  }
  return values;
}

Robot robot_with(const Model& model, const Eigen::VectorXd& values) {
  Robot robot = model.robot;
  Eigen::Matrix<double, 6, 1> base;
  std::vector<Eigen::Matrix<double, 6, 1>> targets(robot.targets.size()), origins(robot.joints.size());
  bool anchored = robot.anchor.has_value();
  Anchor anchor = robot.anchor.value_or(Anchor{});
  robot.effects.clear();
  for (const EffectRequest& request : model.requests) robot.effects.push_back({request.effect, {}, {}});

  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    const ParameterInfo& info = model.parameters[i];
    const double value = values[static_cast<Eigen::Index>(i)];
    const std::string name = suffix(info.name);
    switch (info.role) {
      case Role::base:
        base[frame_coordinate(name)] = value;
        break;
      case Role::target:
        targets[info.owner][frame_coordinate(name)] = value;
        break;
      case Role::geometry:
        if (robot.convention == Convention::urdf) {
          origins[info.owner][frame_coordinate(name)] = value;
        } else {
          *geometry_value(&robot.joints[info.owner], name) = value;
        }
        break;
      case Role::offset:
        robot.joints[info.owner].offset = value;
        break;
      case Role::ratio:
        robot.joints[info.owner].ratio = value;
        break;
      case Role::anchor:
        (info.axis == 3 ? anchor.zero : anchor.point[info.axis]) = value;
        if (value != 0.0) anchored = true;
        break;
      case Role::point:
        break;
      case Role::effect: {
        AppliedEffect& applied = robot.effects[info.owner];
        applied.parameters[info.name] = value;
        for (const ColumnTerm& column : info.columns) {
          const Term& term = model.terms[column.term];
          applied.parameters.insert(term.constants.begin(), term.constants.end());
          const std::string& joint = term.joint;  // not its site, which may belong to a neighbour
          if (joint.empty()) continue;
          if (std::find(applied.joints.begin(), applied.joints.end(), joint) == applied.joints.end())
            applied.joints.push_back(joint);
        }
        break;
      }
    }
  }
  robot.effects.erase(std::remove_if(robot.effects.begin(), robot.effects.end(),
                                     [](const AppliedEffect& e) { return e.parameters.empty(); }),
                      robot.effects.end());
  robot.T_measurement_base = frame_with(model.robot.T_measurement_base, base);
  for (std::size_t k = 0; k < targets.size(); ++k)
    robot.targets[k].T_last_target = frame_with(model.robot.targets[k].T_last_target, targets[k]);
  if (robot.convention == Convention::urdf) {
    for (std::size_t k = 0; k < origins.size(); ++k)
      robot.joints[k].T_parent_joint = frame_with(model.robot.joints[k].T_parent_joint, origins[k]);
  }
  if (anchored) robot.anchor = anchor;
  return robot;
}

std::vector<bool> near_parallel(const Robot& robot, double angle) {
  std::vector<bool> found(robot.joints.size(), false);
  if (robot.convention == Convention::urdf) return found;  // origins have all six freedoms already
  const double bound = std::sin(angle);
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    // DH: alpha_k turns axis k into axis k+1; modified DH: axis k-1 into axis k. What lies beyond the ends is base or
    // tool.
    const bool inner = robot.convention == Convention::dh ? k + 1 < robot.joints.size() : k > 0;
    found[k] = inner && std::abs(std::sin(robot.joints[k].alpha)) < bound;
  }
  return found;
}

bool matches(const std::string& glob, const std::string& name) {
  // Greedy with one point of return: the last '*'.
  std::size_t g = 0, n = 0, star = std::string::npos, mark = 0;
  while (n < name.size()) {
    if (g < glob.size() && glob[g] == '*') {
      star = g++;
      mark = n;
    } else if (g < glob.size() && (glob[g] == '?' || glob[g] == name[n])) {
      ++g;
      ++n;
    } else if (star != std::string::npos) {
      g = star + 1;
      n = ++mark;
    } else {
      return false;
    }
  }
  while (g < glob.size() && glob[g] == '*') ++g;
  return g == glob.size();
}

std::vector<int> find_parameters(const Model& model, const std::vector<std::string>& globs) {
  std::vector<bool> wanted(model.parameters.size(), false);
  for (const std::string& glob : globs) {
    bool any = false;
    for (std::size_t k = 0; k < model.parameters.size(); ++k) {
      if (matches(glob, model.parameters[k].name)) any = wanted[k] = true;
    }
    if (!any) {
      std::vector<std::string> names;
      for (const ParameterInfo& info : model.parameters) names.push_back(info.name);
      throw std::invalid_argument("no parameter matches '" + glob + "'" + did_you_mean(glob, names) +
                                  "; there are: " + listed(names));
    }
  }
  std::vector<int> found;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (wanted[k]) found.push_back(static_cast<int>(k));
  }
  return found;
}

}  // namespace truing::model

namespace truing {

std::vector<std::string> unknown_effect_values(const Robot& robot) {
  std::vector<std::string> texts(robot.effects.size());
  Robot known = robot;
  const auto is_own = [](const AppliedEffect& e) { return model::effect_or_null(e.effect, {}) == nullptr; };
  known.effects.erase(std::remove_if(known.effects.begin(), known.effects.end(), is_own), known.effects.end());
  if (known.effects.empty()) return texts;
  try {
    const model::Model model = model::model_of(known, model::row_of_zeros(known), {});
    const std::set<std::string> values = model::effect_values(model, -1);
    for (std::size_t k = 0, at = 0; k < texts.size(); ++k) {
      if (!is_own(robot.effects[k])) texts[k] = model::unknown_value(model, at++, values);
    }
  } catch (const std::invalid_argument&) {  // is said where the effects are used
  }
  return texts;
}

}  // namespace truing
