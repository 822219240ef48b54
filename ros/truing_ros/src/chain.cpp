// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "chain.hpp"

#include <algorithm>
#include <stdexcept>

namespace truing_ros {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kShortestAxis = 1e-9;  // [-] what is shorter has no direction

Isometry3d frame_of(const urdf::Pose& pose) {
  Isometry3d T = Isometry3d::Identity();
  const urdf::Rotation& q = pose.rotation;
  T.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  T.translation() = Vector3d(pose.position.x, pose.position.y, pose.position.z);
  return T;
}

std::vector<urdf::JointConstSharedPtr> joints_between(const urdf::ModelInterface& model, const std::string& base,
                                                      const std::string& tip) {
  for (const std::string& name : {base, tip}) {
    if (!model.getLink(name)) throw std::invalid_argument("the robot description has no link '" + name + "'");
  }
  std::vector<urdf::JointConstSharedPtr> path;
  for (urdf::LinkConstSharedPtr link = model.getLink(tip); link->name != base;
       link = model.getLink(link->parent_joint->parent_link_name)) {
    if (!link->parent_joint) throw std::invalid_argument("link '" + tip + "' is not below link '" + base + "'");
    path.push_back(link->parent_joint);
  }
  std::reverse(path.begin(), path.end());
  return path;
}

truing::JointType type_of(const urdf::Joint& source) {
  if (source.type == urdf::Joint::REVOLUTE || source.type == urdf::Joint::CONTINUOUS)
    return truing::JointType::revolute;
  if (source.type == urdf::Joint::PRISMATIC) return truing::JointType::prismatic;
  throw std::invalid_argument("joint '" + source.name +
                              "' is neither fixed, revolute, continuous nor prismatic: such a chain cannot be solved");
}

truing::Joint moving_joint(const urdf::Joint& source, const Isometry3d& T_parent_joint,
                           const std::vector<std::string>& before) {
  truing::Joint joint;
  joint.name = source.name;
  joint.type = type_of(source);
  joint.T_parent_joint = T_parent_joint;
  const Vector3d axis(source.axis.x, source.axis.y, source.axis.z);
  if (!(axis.norm() > kShortestAxis)) throw std::invalid_argument("joint '" + source.name + "' has a zero axis");
  joint.axis = axis.normalized();
  if (source.limits && source.type != urdf::Joint::CONTINUOUS) {
    joint.lower = source.limits->lower;
    joint.upper = source.limits->upper;
  }
  if (source.mimic) {
    const std::string& driver = source.mimic->joint_name;
    if (std::find(before.begin(), before.end(), driver) == before.end())
      throw std::invalid_argument("joint '" + source.name + "' mimics '" + driver +
                                  "', which does not lie before it in the chain");
    joint.driven_by = {{driver, source.mimic->multiplier}};
    joint.offset = source.mimic->offset;
  }
  return joint;
}

}  // namespace

const Chain::Link& Chain::link(const std::string& name) const {
  for (const Link& candidate : links) {
    if (candidate.name == name) return candidate;
  }
  std::string known;
  for (const Link& candidate : links) known += (known.empty() ? "" : ", ") + candidate.name;
  throw std::invalid_argument("link '" + name + "' is not in the chain; its links are " + known);
}

truing::Joints Chain::driven(const std::vector<double>& positions) const {
  truing::Joints readings(static_cast<Eigen::Index>(robot.driven_count()));
  Eigen::Index next = 0;
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    if (!robot.joints[k].passive()) readings[next++] = positions[k];
  }
  return readings;
}

std::vector<double> Chain::all(const truing::Joints& readings) const {
  std::vector<double> positions;
  Eigen::Index next = 0;
  for (const truing::Joint& joint : robot.joints) {
    double position = joint.passive() ? joint.offset : readings[next++];
    for (const auto& [driver, weight] : joint.driven_by) position += weight * positions[robot.joint_index(driver)];
    positions.push_back(position);
  }
  return positions;
}

Chain chain_between(const urdf::ModelInterface& model, const std::string& base, const std::string& tip) {
  Chain chain;
  chain.base = base;
  chain.robot.name = model.getName();
  chain.robot.convention = truing::Convention::urdf;
  Isometry3d T = Isometry3d::Identity();  // from the last moving joint, or the base, to here
  chain.links.push_back({base, 0, T});
  for (const urdf::JointConstSharedPtr& joint : joints_between(model, base, tip)) {
    T = T * frame_of(joint->parent_to_joint_origin_transform);
    if (joint->type != urdf::Joint::FIXED) {
      chain.robot.joints.push_back(moving_joint(*joint, T, chain.names));
      chain.names.push_back(joint->name);
      T.setIdentity();
    }
    chain.links.push_back({joint->child_link_name, chain.names.size(), T});
  }
  if (chain.names.empty()) throw std::invalid_argument("nothing moves between '" + base + "' and '" + tip + "'");
  chain.robot.targets = {{tip, T}};
  return chain;
}

truing::Robot robot_up_to(const Chain& chain, const Chain::Link& link) {
  truing::Robot robot = chain.robot;
  robot.joints.resize(link.moving);
  robot.targets = {{link.name, link.T_last_link}};
  return robot;
}

Isometry3d link_pose(const Chain& chain, const Chain::Link& link, const truing::Joints& readings) {
  if (link.moving == 0) return link.T_last_link;
  return truing::forward_kinematics(chain.robot, readings)[link.moving - 1] * link.T_last_link;
}

}  // namespace truing_ros
