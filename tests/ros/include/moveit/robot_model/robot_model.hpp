// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: a robot model that knows its URDF and the joints of its groups.

#include <map>
#include <string>
#include <vector>

#include <urdf_model/model.h>
#include <urdf_world/types.h>

namespace moveit::core {

struct VariableBounds {
  double min_position_ = 0.0, max_position_ = 0.0;
  bool position_bounded_ = false;
};

class JointModel {
 public:
  using Bounds = std::vector<VariableBounds>;
  const Bounds& getVariableBounds() const { return bounds; }
  Bounds bounds;
};

class JointModelGroup {
 public:
  bool hasJointModel(const std::string& name) const { return joints.count(name) > 0; }
  const JointModel* getJointModel(const std::string& name) const {
    return hasJointModel(name) ? &joints.at(name) : nullptr;
  }
  std::map<std::string, JointModel> joints;
};

class RobotModel {
 public:
  const urdf::ModelInterfaceSharedPtr& getURDF() const { return urdf; }
  const JointModelGroup* getJointModelGroup(const std::string& name) const {
    return groups.count(name) ? &groups.at(name) : nullptr;
  }
  urdf::ModelInterfaceSharedPtr urdf;
  std::map<std::string, JointModelGroup> groups;
};

}  // namespace moveit::core
