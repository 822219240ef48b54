// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/model/urdf.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>

#include <console_bridge/console.h>
#include <tinyxml2.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include "math/text.hpp"
#include "model/motion.hpp"
#include "rooms.hpp"

namespace truing {
using namespace model;

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr const char* tool_link = "truing_tool";
constexpr const char* tool_joint = "truing_tool_joint";

// urdfdom writes what is wrong to a console that the whole process shares. While it parses we listen there
// instead, so that the exception can say it. (console_bridge asks for a derived class.)
class Listener : public console_bridge::OutputHandler {
 public:
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) hear(text);
  }
  void hear(const std::string& text) { heard += (heard.empty() ? "" : "; ") + text; }

  std::string heard;
};

// urdfdom descends by recursion, into elements and along links, and asks nobody how deep: a file of a few hundred
// kilobytes would overrun the stack. tinyxml2 bounds the depth of what it reads (TINYXML2_MAX_ELEMENT_DEPTH, 100 or
// 500).
constexpr int kMostLinks = 5000;

void require_bounded(const std::string& urdf_text) {
  tinyxml2::XMLDocument document;
  if (document.Parse(urdf_text.c_str(), urdf_text.size()) == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
    throw std::invalid_argument("line " + std::to_string(document.ErrorLineNum()) +
                                ": elements are nested too deeply for a URDF");
  }
  int links = 0;
  const tinyxml2::XMLElement* const root = document.RootElement();
  if (root == nullptr) return;  // urdfdom says what is wrong
  for (const auto* link = root->FirstChildElement("link"); link != nullptr; link = link->NextSiblingElement("link")) {
    if (++links <= kMostLinks) continue;
    throw std::invalid_argument("line " + std::to_string(link->GetLineNum()) + ": has more than " +
                                std::to_string(kMostLinks) + " links");
  }
}

std::size_t links_from(const urdf::Link& link) {
  std::size_t count = 1;
  for (const urdf::LinkSharedPtr& child : link.child_links) count += links_from(*child);
  return count;
}

// urdfdom takes a link that two joints hold, and passes over links that go round in a circle.
void require_tree(const urdf::ModelInterface& model) {
  for (const auto& [name, joint] : model.joints_) {
    const urdf::JointSharedPtr& holder = model.getLink(joint->child_link_name)->parent_joint;
    if (holder == joint) continue;
    throw std::invalid_argument("link '" + joint->child_link_name + "' is the child of joint '" + name +
                                "' and of joint '" + holder->name + "', expected one joint that holds it");
  }
  if (links_from(*model.getRoot()) == model.links_.size()) return;
  for (const auto& [name, link] : model.links_) {
    const urdf::Link* up = link.get();
    for (std::size_t k = 0; up->getParent() && k < model.links_.size(); ++k) up = up->getParent().get();
    if (!up->getParent()) continue;
    throw std::invalid_argument("link '" + name + "' hangs on a circle of links, expected a tree below '" +
                                model.getRoot()->name + "'");
  }
}

// urdfdom takes such a link for one that weighs nothing.
void require_inertials(const std::string& heard) {
  if (heard.find("inertial element for Link") == std::string::npos) return;
  throw std::invalid_argument("not a URDF that can be used: " + heard + " (a link whose mass is not known has no " +
                              "<inertial>)");
}

urdf::ModelInterfaceSharedPtr parse(const std::string& urdf_text) {
  require_bounded(urdf_text);
  static std::mutex one_at_a_time;
  static Listener listener;  // static: console_bridge remembers the last handler that it had
  const std::lock_guard<std::mutex> lock(one_at_a_time);
  listener.heard.clear();
  console_bridge::OutputHandler* const before = console_bridge::getOutputHandler();
  console_bridge::useOutputHandler(&listener);
  urdf::ModelInterfaceSharedPtr model;
  try {
    model = urdf::parseURDF(urdf_text);
  } catch (const std::exception& error) {
    listener.hear(error.what());
  }
  console_bridge::useOutputHandler(before);
  if (!model) {
    throw std::invalid_argument("not a URDF that can be used: " +
                                (listener.heard.empty() ? "the text holds no <robot>" : listener.heard));
  }
  require_inertials(listener.heard);
  require_tree(*model);
  return model;
}

Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Isometry3d frame_of(const urdf::Pose& pose) {
  const urdf::Rotation& q = pose.rotation;
  Isometry3d T = Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix();
  T.translation() = vector_of(pose.position);
  return T;
}

std::string link_names(const urdf::ModelInterface& model) {
  std::vector<std::string> names;
  for (const auto& entry : model.links_) names.push_back(entry.first);
  return listed(names);
}

urdf::LinkConstSharedPtr link_named(const urdf::ModelInterface& model, const std::string& name, const char* role) {
  const urdf::LinkConstSharedPtr link = model.getLink(name);
  if (!link) {
    throw std::invalid_argument(std::string(role) + " link '" + name + "' does not exist; the links are " +
                                link_names(model));
  }
  return link;
}

void collect_leaves(const urdf::Link& link, std::vector<std::string>& leaves) {
  if (link.child_links.empty()) leaves.push_back(link.name);
  for (const urdf::LinkSharedPtr& child : link.child_links) collect_leaves(*child, leaves);
}

urdf::LinkConstSharedPtr only_leaf(const urdf::ModelInterface& model, const urdf::Link& base) {
  std::vector<std::string> leaves;
  collect_leaves(base, leaves);
  if (leaves.size() != 1) {
    std::sort(leaves.begin(), leaves.end());
    throw std::invalid_argument("name the tip link: below '" + base.name + "' the URDF has " +
                                std::to_string(leaves.size()) + " ends, " + listed(leaves));
  }
  return model.getLink(leaves.front());
}

// Links behind a moving joint below which nothing moves any more; true where anything moves below `link`.
bool collect_moving_ends(const urdf::ModelInterface& model, const urdf::Link& link, std::vector<std::string>* ends) {
  bool moves = false;
  for (const urdf::JointSharedPtr& joint : link.child_joints) {
    const bool goes_on = collect_moving_ends(model, *model.getLink(joint->child_link_name), ends);
    const bool is_fixed = joint->type == urdf::Joint::FIXED;
    if (!is_fixed && !goes_on) ends->push_back(joint->child_link_name);
    moves = moves || goes_on || !is_fixed;
  }
  return moves;
}

// The joints between two links, base first.
std::vector<urdf::JointConstSharedPtr> joints_between(const urdf::ModelInterface& model, const urdf::Link& base,
                                                      const urdf::Link& tip) {
  std::vector<urdf::JointConstSharedPtr> path;
  const urdf::Link* link = &tip;
  while (link->name != base.name) {
    if (!link->parent_joint) {
      throw std::invalid_argument("tip link '" + tip.name + "' is not below base link '" + base.name +
                                  "'; the links are " + link_names(model));
    }
    path.push_back(link->parent_joint);
    link = model.getLink(link->parent_joint->parent_link_name).get();
  }
  std::reverse(path.begin(), path.end());
  return path;
}

bool is_below(const urdf::ModelInterface& model, const urdf::Link& base, const urdf::Link& tip) {
  const urdf::Link* link = &tip;
  while (link->name != base.name && link->parent_joint)
    link = model.getLink(link->parent_joint->parent_link_name).get();
  return link->name == base.name;
}

// Where a chain leaves what its base is fixed to.
struct Start {
  const urdf::Link* link;
  Isometry3d T_base_link;
};

// The base itself, or of one beside the chain the link that it is fixed to: makers' URDFs have the frame in which the
// controller counts as a leaf of its own.
Start start_of(const urdf::ModelInterface& model, const urdf::Link& base, const urdf::Link& tip) {
  Start start{&base, Isometry3d::Identity()};
  while (!is_below(model, *start.link, tip)) {
    const urdf::JointConstSharedPtr up = start.link->parent_joint;
    if (!up || up->type != urdf::Joint::FIXED) return {&base, Isometry3d::Identity()};
    start.T_base_link = start.T_base_link * frame_of(up->parent_to_joint_origin_transform).inverse();
    start.link = model.getLink(up->parent_link_name).get();
  }
  return start;
}

// An arm with a gripper ends where its fingers part: the last link that all chains share, if anything moves before it.
std::string where_they_part(const urdf::ModelInterface& model, const urdf::Link& base,
                            const std::vector<std::string>& ends) {
  std::vector<urdf::JointConstSharedPtr> shared = joints_between(model, base, *model.getLink(ends.front()));
  for (const std::string& end : ends) {
    const std::vector<urdf::JointConstSharedPtr> path = joints_between(model, base, *model.getLink(end));
    const auto part = std::mismatch(shared.begin(), shared.end(), path.begin(), path.end()).first;
    shared.erase(part, shared.end());
  }
  const auto moves = [](const urdf::JointConstSharedPtr& joint) { return joint->type != urdf::Joint::FIXED; };
  if (std::none_of(shared.begin(), shared.end(), moves)) return "";
  return "; they part at '" + shared.back()->child_link_name + "', the tip of an arm whose gripper is the rest";
}

struct Body {
  double mass;
  Vector3d center;   ///< of mass
  Matrix3d inertia;  ///< about it
};

Matrix3d symmetric(const Matrix3d& I) { return 0.5 * (I + I.transpose()); }

Body body_of(const urdf::Inertial& inertial, const Isometry3d& T) {
  Matrix3d I;
  I << inertial.ixx, inertial.ixy, inertial.ixz,  //
      inertial.ixy, inertial.iyy, inertial.iyz,   //
      inertial.ixz, inertial.iyz, inertial.izz;
  const Isometry3d T_link_body = T * frame_of(inertial.origin);
  const Matrix3d R = T_link_body.linear();
  // What is not turned keeps its digits.
  return {inertial.mass, T_link_body.translation(), R.isIdentity(0.0) ? I : symmetric(R * I * R.transpose())};
}

bool is_in(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// A link and all that it carries up to the chain's next moving joints: side branches too (a motor, a camera, a
// gripper's fingers), in the frame of the link that `T` was started from. Where joints off the chain stand is not
// known: they are taken at zero, as a gripper that is left out would weigh nothing, and their links are told.
void collect_bodies(const urdf::ModelInterface& model, const urdf::Link& link, const Isometry3d& T,
                    const std::vector<std::string>& chain, std::vector<Body>* bodies,
                    std::vector<std::string>* off_chain) {
  if (link.inertial) bodies->push_back(body_of(*link.inertial, T));
  for (const urdf::JointSharedPtr& joint : link.child_joints) {
    if (is_in(chain, joint->name)) continue;
    if (joint->type != urdf::Joint::FIXED) off_chain->push_back(joint->child_link_name);
    collect_bodies(model, *model.getLink(joint->child_link_name), T * frame_of(joint->parent_to_joint_origin_transform),
                   chain, bodies, off_chain);
  }
}

void take_axis(const urdf::Joint& source, Joint& joint) {
  const Vector3d axis = vector_of(source.axis);
  if (!(axis.norm() > 1e-9))
    throw std::invalid_argument("joint '" + source.name + "' has a zero axis, expected a direction");
  joint.axis = axis.normalized();
}

void take_type(const urdf::Joint& source, Joint& joint) {
  switch (source.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      joint.type = JointType::revolute;
      return;
    case urdf::Joint::PRISMATIC:
      joint.type = JointType::prismatic;
      return;
    default:
      break;
  }
  const char* type = source.type == urdf::Joint::PLANAR     ? "planar"
                     : source.type == urdf::Joint::FLOATING ? "floating"
                                                            : "of unknown type";
  throw std::invalid_argument(
      "joint '" + source.name + "' is " + type +
      "; between base and tip only fixed, revolute, continuous and prismatic joints can be used");
}

void take_limits(const urdf::Joint& source, Joint& joint) {
  if (source.type == urdf::Joint::CONTINUOUS || !source.limits) return;
  joint.lower = source.limits->lower;
  joint.upper = source.limits->upper;
}

void take_mimic(const urdf::Joint& source, Joint& joint) {
  if (!source.mimic) return;
  joint.driven_by = {{source.mimic->joint_name, source.mimic->multiplier}};
  joint.offset = source.mimic->offset;
}

void take_inertia(const std::vector<Body>& bodies, Joint& joint) {
  if (bodies.empty()) return;
  double mass = 0.0;
  Vector3d moment = Vector3d::Zero();
  for (const Body& body : bodies) {
    mass += body.mass;
    moment += body.mass * body.center;
  }
  joint.mass = mass;
  if (bodies.size() == 1)
    joint.center_of_mass = bodies.front().center;
  else if (mass > 0.0)
    joint.center_of_mass = moment / mass;
  // Steiner: from each centre of mass to the common one.
  Matrix3d inertia = Matrix3d::Zero();
  for (const Body& body : bodies) {
    const Vector3d r = body.center - joint.center_of_mass;
    inertia += body.inertia + body.mass * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose());
  }
  joint.inertia = symmetric(inertia);
}

// urdfdom wants both limits stated, so a file that knows none writes zero, -1 as in SDF, or 1e10.
double stated_limit(double value) {
  return value > 0.0 && value < 1e6 ? value : std::numeric_limits<double>::infinity();
}

void take_drive_limits(const urdf::Joint& source, Joint& joint) {
  if (!source.limits) return;
  joint.speed_limit = stated_limit(source.limits->velocity);
  joint.torque_limit = stated_limit(source.limits->effort);
}

// What a URDF says about the chain, with what it takes to write it back.
struct Chain {
  Robot robot;
  std::vector<Isometry3d>
      T_link_parent;      ///< fixed joints folded in: from the link after the last moving joint to <parent>
  std::string last_link;  ///< child of the last moving joint
  std::vector<std::string> off_chain;  ///< links that the chain carries and that move by joints of their own
};

void require_drivers_in_chain(const Robot& robot) {
  for (const Joint& joint : robot.joints) {
    for (const auto& driver : joint.driven_by) {
      const auto is_driver = [&driver](const Joint& other) { return other.name == driver.first; };
      if (std::any_of(robot.joints.begin(), robot.joints.end(), is_driver)) continue;
      throw std::invalid_argument(
          "joint '" + joint.name + "' mimics '" + driver.first +
          "', which does not move between base and tip link: choose links that have both between them");
    }
  }
}

void add_friction(const char* effect, const std::string& joint, double value, Robot& robot) {
  if (value == 0.0) return;
  robot.torque_effects.push_back({effect, {joint}, {{effect + ("." + joint), value}}});
}

// <dynamics> of every joint, at the reading that moves it: a joint that mimics moves by w times its reading, and there
// its friction counts |w| times, its damping w^2 (virtual work).
void take_friction(const std::vector<urdf::JointConstSharedPtr>& sources, Robot& robot) {
  const auto n = static_cast<Eigen::Index>(sources.size());
  Eigen::VectorXd coulomb = Eigen::VectorXd::Zero(n), viscous = Eigen::VectorXd::Zero(n);
  const Eigen::MatrixXd coupling = coupling_matrix(robot);
  for (Eigen::Index i = 0; i < n; ++i) {
    const urdf::JointConstSharedPtr& source = sources[static_cast<std::size_t>(i)];
    if (!source->dynamics) continue;
    for (const std::size_t index : robot.driven_joints()) {
      const auto k = static_cast<Eigen::Index>(index);
      const double w = coupling(i, k);
      coulomb[k] += std::abs(w) * source->dynamics->friction;
      viscous[k] += w * w * source->dynamics->damping;
    }
  }
  for (const std::size_t index : robot.driven_joints()) {
    const std::string& joint = robot.joints[index].name;
    add_friction("coulomb", joint, coulomb[static_cast<Eigen::Index>(index)], robot);
    add_friction("viscous", joint, viscous[static_cast<Eigen::Index>(index)], robot);
  }
}

Chain read_chain(const std::string& urdf_text, const std::string& base_link, const std::string& tip_link) {
  const urdf::ModelInterfaceSharedPtr model = parse(urdf_text);
  const urdf::LinkConstSharedPtr base = base_link.empty() ? model->getRoot() : link_named(*model, base_link, "base");
  const urdf::LinkConstSharedPtr tip =
      tip_link.empty() ? only_leaf(*model, *base) : link_named(*model, tip_link, "tip");

  Chain chain;
  chain.robot.name = model->getName();
  chain.robot.convention = Convention::urdf;
  const Start start = start_of(*model, *base, *tip);
  Isometry3d T_link_parent = start.T_base_link;
  std::vector<urdf::JointConstSharedPtr> sources;
  const std::vector<urdf::JointConstSharedPtr> path = joints_between(*model, *start.link, *tip);
  std::vector<std::string> moving;
  for (const urdf::JointConstSharedPtr& source : path) {
    if (source->type != urdf::Joint::FIXED) moving.push_back(source->name);
  }
  for (const urdf::JointConstSharedPtr& source : path) {
    const Isometry3d T_parent_joint = frame_of(source->parent_to_joint_origin_transform);
    if (source->type == urdf::Joint::FIXED) {
      T_link_parent = T_link_parent * T_parent_joint;
      continue;
    }
    Joint joint;
    joint.name = source->name;
    joint.T_parent_joint = T_link_parent * T_parent_joint;
    take_type(*source, joint);
    take_axis(*source, joint);
    take_limits(*source, joint);
    take_mimic(*source, joint);
    std::vector<Body> bodies;
    collect_bodies(*model, *model->getLink(source->child_link_name), Isometry3d::Identity(), moving, &bodies,
                   &chain.off_chain);
    take_inertia(bodies, joint);
    take_drive_limits(*source, joint);
    chain.robot.joints.push_back(joint);
    sources.push_back(source);
    chain.T_link_parent.push_back(T_link_parent);
    chain.last_link = source->child_link_name;
    T_link_parent = Isometry3d::Identity();
  }
  if (chain.robot.joints.empty()) {
    throw std::invalid_argument("nothing moves between base link '" + base->name + "' and tip link '" + tip->name +
                                "'");
  }
  chain.robot.targets = {{"tool", T_link_parent}};
  require_drivers_in_chain(chain.robot);
  validate(chain.robot);
  take_friction(sources, chain.robot);
  validate(chain.robot);
  return chain;
}

bool is_same(const Isometry3d& a, const Isometry3d& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff() < 1e-14;
}

std::string triple(const Vector3d& v) {
  return exact_number(v.x()) + " " + exact_number(v.y()) + " " + exact_number(v.z());
}

// The joint moved by `motion`, as a frame: how a joint zero goes into an origin.
Isometry3d motion_frame(const Joint& joint, double motion) {
  if (joint.type == JointType::revolute) return Isometry3d(Eigen::AngleAxisd(motion, joint.axis));
  return Isometry3d(Eigen::Translation3d(motion * joint.axis));
}

// A <joint> or <link> of the robot by name; only direct children: <transmission> has elements named joint as
// well.
tinyxml2::XMLElement* named_element(tinyxml2::XMLElement* robot, const char* kind, const std::string& name) {
  for (auto* child = robot->FirstChildElement(kind); child; child = child->NextSiblingElement(kind)) {
    const char* found = child->Attribute("name");
    if (found != nullptr && name == found) return child;
  }
  return nullptr;
}

tinyxml2::XMLElement* child_element(tinyxml2::XMLElement* parent, const char* name) {
  tinyxml2::XMLElement* child = parent->FirstChildElement(name);
  return child != nullptr ? child : parent->InsertNewChildElement(name);
}

void write_origin(tinyxml2::XMLElement* joint, const Isometry3d& T) {
  tinyxml2::XMLElement* origin = child_element(joint, "origin");
  origin->SetAttribute("xyz", triple(T.translation()).c_str());
  origin->SetAttribute("rpy", triple(rpy_from_rotation(T.linear())).c_str());
}

void write_tool(tinyxml2::XMLElement* robot, const std::string& parent_link, const Isometry3d& T_last_target) {
  tinyxml2::XMLElement* joint = named_element(robot, "joint", tool_joint);
  if (joint == nullptr) {
    if (named_element(robot, "link", tool_link) != nullptr) {
      throw std::invalid_argument(std::string("the URDF has a link ") + tool_link + " of its own: rename it");
    }
    robot->InsertNewChildElement("link")->SetAttribute("name", tool_link);
    joint = robot->InsertNewChildElement("joint");
    joint->SetAttribute("name", tool_joint);
    joint->SetAttribute("type", "fixed");
  }
  child_element(joint, "parent")->SetAttribute("link", parent_link.c_str());
  child_element(joint, "child")->SetAttribute("link", tool_link);
  write_origin(joint, T_last_target);
}

void require_same_chain(const Robot& nominal, const Robot& calibrated) {
  if (calibrated.convention != Convention::urdf) {
    throw std::invalid_argument(
        "the calibrated robot is a link table, it was not read from a URDF: its frames differ from "
        "those of the URDF; read the URDF and calibrate that robot");
  }
  std::vector<std::string> expected, found;
  for (const Joint& joint : nominal.joints) expected.push_back(joint.name);
  for (const Joint& joint : calibrated.joints) found.push_back(joint.name);
  if (expected != found) {
    throw std::invalid_argument("the URDF's chain has the joints " + listed(expected) + "; the calibrated robot has " +
                                listed(found));
  }
  for (std::size_t i = 0; i < nominal.joints.size(); ++i) {
    if (nominal.joints[i].type == calibrated.joints[i].type) continue;
    throw std::invalid_argument("joint '" + expected[i] + "' is revolute in one and prismatic in the other");
  }
}

// What a reader of the new file must know and URDF has no place for.
std::vector<std::string> not_in_urdf(const Robot& nominal, const Robot& calibrated) {
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < calibrated.joints.size(); ++i) {
    const Joint& joint = calibrated.joints[i];
    if (!joint.passive() && joint.ratio != 1.0) {
      notes.push_back("gear ratio of " + joint.name + ": " + number(joint.ratio, 12) +
                      " (the joint moves by ratio * reading)");
    }
    if (joint.driven_by != nominal.joints[i].driven_by) {
      notes.push_back("coupling of " + joint.name + ": the calibrated robot's driven_by is not the mimic of this file");
    }
  }
  if (!is_same(calibrated.T_measurement_base, Isometry3d::Identity())) {
    const Isometry3d& T = calibrated.T_measurement_base;
    notes.push_back("base in the measurement frame: xyz " + triple(T.translation()) + " m, rpy " +
                    triple(rpy_from_rotation(T.linear())) + " rad");
  }
  for (std::size_t k = 1; k < calibrated.targets.size(); ++k) notes.push_back("target " + calibrated.targets[k].name);
  for (const AppliedEffect& applied : calibrated.effects) {
    std::string note = "effect " + applied.effect + ":";
    for (const auto& [name, value] : applied.parameters) note += " " + name + " = " + number(value, 9);
    notes.push_back(note);
  }
  if (calibrated.anchor) notes.push_back("anchor of the distance instrument");
  return notes;
}

// XML forbids '--' in a comment, and '-' at its end: ours end in a new line.
std::string comment_text(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--")) text.insert(at + 1, " ");
  return text;
}

void write_comment(tinyxml2::XMLDocument& document, const std::string& text) {
  tinyxml2::XMLComment* comment = document.NewComment(comment_text(text).c_str());
  tinyxml2::XMLNode* first = document.FirstChild();
  if (first != nullptr && first->ToDeclaration() != nullptr) {
    document.InsertAfterChild(first, comment);  // nothing may stand before <?xml …?>
  } else {
    document.InsertFirstChild(comment);
  }
}

}  // namespace

Robot robot_from_urdf(const std::string& urdf_text, const std::string& base_link, const std::string& tip_link) {
  return read_chain(urdf_text, base_link, tip_link).robot;
}

std::vector<std::string> links_off_chain(const std::string& urdf_text, const std::string& base_link,
                                         const std::string& tip_link) {
  return read_chain(urdf_text, base_link, tip_link).off_chain;
}

std::string last_moving_link(const std::string& urdf_text, const std::string& base_link) {
  const urdf::ModelInterfaceSharedPtr model = parse(urdf_text);
  const urdf::LinkConstSharedPtr base = base_link.empty() ? model->getRoot() : link_named(*model, base_link, "base");
  std::vector<std::string> ends;
  collect_moving_ends(*model, *base, &ends);
  if (ends.empty()) throw std::invalid_argument("nothing moves below base link '" + base->name + "'");
  if (ends.size() > 1) {
    std::sort(ends.begin(), ends.end());
    throw std::invalid_argument("name the tip link (--tip-link, tip_link=): below '" + base->name + "' " +
                                std::to_string(ends.size()) + " chains move, that end at " + listed(ends) +
                                where_they_part(*model, *base, ends));
  }
  return ends.front();
}

std::string urdf_with_calibration(const std::string& urdf_text, const Robot& calibrated, const std::string& base_link,
                                  const std::string& tip_link) {
  const Chain chain = read_chain(urdf_text, base_link, tip_link);
  const Robot& nominal = chain.robot;
  validate(calibrated);
  require_same_chain(nominal, calibrated);

  tinyxml2::XMLDocument document;
  if (document.Parse(urdf_text.data(), urdf_text.size()) != tinyxml2::XML_SUCCESS) {
    throw std::invalid_argument(std::string("not a URDF that can be used: ") + document.ErrorStr());
  }
  tinyxml2::XMLElement* robot = document.RootElement();

  // The file's joints move by reading, or by the mimic's line; what the calibrated joints move more at
  // reading zero goes into their origins. This holds for passive joints too, whose drivers' zeros arrive
  // through the coupling.
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(nominal.driven_count()));
  if (calibrated.driven_count() != nominal.driven_count()) {
    throw std::invalid_argument("the calibrated robot has " + std::to_string(calibrated.driven_count()) +
                                " driven joints, the URDF's chain " + std::to_string(nominal.driven_count()));
  }
  const Eigen::VectorXd shift = joint_motions(calibrated, zero) - joint_motions(nominal, zero);
  for (std::size_t i = 0; i < nominal.joints.size(); ++i) {
    const Joint& joint = calibrated.joints[i];
    tinyxml2::XMLElement* element = named_element(robot, "joint", joint.name);
    if (element == nullptr) throw std::invalid_argument("joint '" + joint.name + "' is not a child of <robot>");
    const Isometry3d T_link_joint = joint.T_parent_joint * motion_frame(joint, shift[static_cast<Eigen::Index>(i)]);
    // What did not move keeps its text.
    if (!is_same(T_link_joint, nominal.joints[i].T_parent_joint)) {
      write_origin(element, chain.T_link_parent[i].inverse() * T_link_joint);
    }
    if ((joint.axis - nominal.joints[i].axis).cwiseAbs().maxCoeff() > 1e-14) {
      child_element(element, "axis")->SetAttribute("xyz", triple(joint.axis).c_str());
    }
  }

  std::string comment =
      "\n  Calibrated by truing: the origins of the joints from base to tip are as measured; joint zeros are "
      "in them.\n";
  const Isometry3d T_last_tool =
      calibrated.targets.empty() ? Isometry3d::Identity() : calibrated.targets.front().T_last_target;
  if (!is_same(T_last_tool, nominal.targets.front().T_last_target)) {
    write_tool(robot, chain.last_link, T_last_tool);
    comment += std::string("  The measured tool is the link ") + tool_link + ", fixed to " + chain.last_link + ".\n";
  }
  const std::vector<std::string> notes = not_in_urdf(nominal, calibrated);
  if (!notes.empty()) comment += "  Found as well, but URDF cannot hold it:\n";
  for (const std::string& note : notes) comment += "  * " + note + "\n";
  write_comment(document, comment);

  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

}  // namespace truing
