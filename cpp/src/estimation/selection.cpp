// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "estimation/selection.hpp"

#include <algorithm>
#include <string>

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

std::vector<int> select_free(const Model& model, const Content& content, const ParameterSelection& selection) {
  const std::vector<bool> parallel = near_parallel(model.robot, selection.hayati_angle);
  std::vector<bool> wanted(model.parameters.size(), false);
  const auto suffix_is = [](const ParameterInfo& info, const char* name) {
    return info.name.size() > std::string(name).size() && info.name.substr(info.name.rfind('.') + 1) == name;
  };
  if (!selection.free.empty()) {
    for (const int k : find_parameters(model, selection.free)) wanted[k] = true;
  }
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const bool by_default = selection.free.empty();
    switch (info.role) {
      case Role::base:
        wanted[k] = wanted[k] || content.frame;
        break;
      case Role::anchor:
        wanted[k] = wanted[k] || content.distance;
        break;
      case Role::point:
        wanted[k] = content.point[info.owner];
        break;
      case Role::target:
        if (by_default) wanted[k] = info.rotation ? content.target_rotation[info.owner] : content.target[info.owner];
        break;
      case Role::geometry:
        if (by_default)
          wanted[k] = !suffix_is(info, "beta") || parallel[info.owner] || model.robot.joints[info.owner].beta != 0.0;
        break;
      default:
        break;
    }
  }
  // Effects asked for: their own terms, or the model parameters that they stand for.
  for (const EffectRequest& request : selection.effects) {
    const auto on_joint = [&](int joint) {
      const Joint& j = model.robot.joints[joint];
      return request.joints.empty()
                 ? !j.passive() || request.effect == "link_geometry"
                 : std::find(request.joints.begin(), request.joints.end(), j.name) != request.joints.end();
    };
    for (std::size_t k = 0; k < model.parameters.size(); ++k) {
      const ParameterInfo& info = model.parameters[k];
      if (request.effect == "gear_ratio" && info.role == Role::ratio && on_joint(info.owner)) wanted[k] = true;
      if (request.effect == "joint_offset" && info.role == Role::offset && on_joint(info.owner)) wanted[k] = true;
      if (request.effect == "link_geometry" && info.role == Role::geometry && on_joint(info.owner))
        wanted[k] = !suffix_is(info, "beta") || parallel[info.owner];
      if (request.effect == "base_frame" && info.role == Role::base) wanted[k] = content.frame;
      if (request.effect == "tool_frame" && info.role == Role::target) {
        wanted[k] = info.rotation ? content.target_rotation[info.owner] : content.target[info.owner];
      }
      if (info.role == Role::effect) {
        const EffectRequest& from = model.requests[info.owner];
        const std::string& joint = model.terms[info.columns[0].term].joint;
        const bool named = request.joints.empty() ||
                           std::find(request.joints.begin(), request.joints.end(), joint) != request.joints.end();
        if (from.effect == request.effect && named) wanted[k] = true;
      }
    }
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
