// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/selection.hpp"

#include <algorithm>
#include <string>

#include "model/effects/traits.hpp"

namespace truing::estimation {

Content content_of(const Model& model, const std::vector<Segment>& segments) {
  Content content;
  content.target.resize(model.robot.targets.size());
  content.target_rotation.resize(model.robot.targets.size());
  content.point.resize(model.point_names.size());
  for (const Segment& segment : segments) {
    content.target[segment.target] = true;
    if (segment.point >= 0) {
      content.point[segment.point] = true;
    } else if (segment.kind == kernel::Kind::distance) {
      content.distance = true;
    } else {
      content.frame = true;
    }
    if (segment.kind == kernel::Kind::pose) content.poses = content.target_rotation[segment.target] = true;
  }
  return content;
}

namespace {

bool is_beta(const ParameterInfo& info) {
  return info.role == Role::geometry && info.name.substr(info.name.rfind('.') + 1) == "beta";
}

bool is_among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_measured_target(const ParameterInfo& info, const Content& content) {
  return info.rotation ? content.target_rotation[info.owner] : content.target[info.owner];
}

/// What nobody has to ask for, and what is found when nothing in particular is asked for.
bool is_usual(const ParameterInfo& info, const Content& content, const std::vector<bool>& parallel, const Robot& robot,
              bool nothing_asked, bool asked) {
  switch (info.role) {
    case Role::base:
      return asked || content.frame;
    case Role::anchor:
      return asked || content.distance;
    case Role::point:
      return content.point[info.owner];
    case Role::target:
      return nothing_asked ? is_measured_target(info, content) : asked;
    case Role::geometry:
      return nothing_asked ? is_fitted_geometry(info, parallel, robot) : asked;
    default:
      return asked;
  }
}

/// The parameters that effects asked for stand for: their own terms, or parameters of the model.
class Requested {
 public:
  Requested(const Model& model, const Content& content, const std::vector<bool>& parallel, const EffectRequest& request)
      : model_(model),
        content_(content),
        parallel_(parallel),
        request_(request),
        stands_for_(traits_of(request.effect, {}).stands_for) {}

  /// Changes `wanted` where the request means this parameter.
  void ask(const ParameterInfo& info, std::vector<bool>::reference wanted) const {
    switch (info.role) {
      case Role::ratio:
        if (stands_for_ == StandsFor::gear_ratio && is_on_joint(info.owner)) wanted = true;
        break;
      case Role::offset:
        if (stands_for_ == StandsFor::joint_offset && is_on_joint(info.owner)) wanted = true;
        break;
      case Role::geometry:
        if (stands_for_ == StandsFor::link_geometry && is_on_joint(info.owner))
          wanted = !is_beta(info) || parallel_[info.owner];
        break;
      case Role::base:
        if (stands_for_ == StandsFor::base_frame) wanted = content_.frame;
        break;
      case Role::target:
        if (stands_for_ == StandsFor::tool_frame) wanted = is_measured_target(info, content_);
        break;
      case Role::effect:
        if (is_own_term(info)) wanted = true;
        break;
      default:
        break;
    }
  }

 private:
  /// Without joints named: the driven ones; links are all of them.
  bool is_on_joint(int joint) const {
    const Joint& j = model_.robot.joints[joint];
    if (!request_.joints.empty()) return is_among(request_.joints, j.name);
    return !j.passive() || stands_for_ == StandsFor::link_geometry;
  }

  bool is_own_term(const ParameterInfo& info) const {
    const std::string& joint = model_.terms[info.columns[0].term].joint;
    return model_.requests[info.owner].effect == request_.effect &&
           (request_.joints.empty() || is_among(request_.joints, joint));
  }

  const Model& model_;
  const Content& content_;
  const std::vector<bool>& parallel_;
  const EffectRequest& request_;
  StandsFor stands_for_;
};

}  // namespace

bool is_fitted_geometry(const ParameterInfo& info, const std::vector<bool>& parallel, const Robot& robot) {
  if (info.role != Role::geometry) return false;
  return !is_beta(info) || parallel[info.owner] || robot.joints[info.owner].beta != 0.0;
}

std::vector<int> select_free(const Model& model, const Content& content, const ParameterSelection& selection) {
  const std::vector<bool> parallel = near_parallel(model.robot, selection.hayati_angle);
  std::vector<bool> wanted(model.parameters.size(), false);
  if (!selection.free.empty()) {
    for (const int k : find_parameters(model, selection.free)) wanted[k] = true;
  }
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    wanted[k] = is_usual(model.parameters[k], content, parallel, model.robot, selection.free.empty(), wanted[k]);
  }
  for (const EffectRequest& effect : selection.effects) {
    const Requested request(model, content, parallel, effect);
    for (std::size_t k = 0; k < wanted.size(); ++k) request.ask(model.parameters[k], wanted[k]);
  }
  if (!selection.hold.empty()) {
    for (const int k : find_parameters(model, selection.hold)) wanted[k] = false;
  }
  std::vector<int> free;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (wanted[k]) free.push_back(static_cast<int>(k));
  }
  return free;
}

int priority_of(Role role) {
  switch (role) {
    case Role::base:
    case Role::anchor:
    case Role::point:
    case Role::target:
      return 0;
    case Role::geometry:
      return 1;
    case Role::offset:
    case Role::ratio:
      return 2;
    case Role::effect:
      return 3;
  }
  return 3;
}

Selection observable(const Model& model, const std::vector<int>& free, const Rank& rank) {
  Selection out;
  for (const int k : rank.kept) out.fitted.push_back(free[k]);
  for (std::size_t j = 0; j < rank.frozen.size(); ++j) {
    Frozen frozen;
    frozen.parameter = model.parameters[free[rank.frozen[j]]].name;
    frozen.combination[frozen.parameter] = 1.0;
    for (std::size_t i = 0; i < rank.kept.size(); ++i) {
      const double weight = rank.combination(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (weight != 0.0) frozen.combination[model.parameters[free[rank.kept[i]]].name] = -weight;
    }
    frozen.why = frozen.combination.size() == 1
                     ? "no measurement depends on it"
                     : "moving these together changes no measurement; " + frozen.parameter + " is held at nominal";
    out.frozen.push_back(frozen);
  }
  return out;
}

}  // namespace truing::estimation
