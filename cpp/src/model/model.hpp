// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A robot compiled to sites and parameters: everything above works on these, nothing knows DH from URDF any more.

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "rooms.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/robot.hpp"

namespace truing::model {

enum class Motion { rotate_x, rotate_y, rotate_z, translate_x, translate_y, translate_z, fixed };
inline bool is_rotation(Motion m) { return m == Motion::rotate_x || m == Motion::rotate_y || m == Motion::rotate_z; }

/// One elementary transform of the chain.
struct Site {
  Motion motion = Motion::fixed;
  int parameter = -1;                                   ///< whose value it holds; -1: zero
  Eigen::Matrix3d fixed = Eigen::Matrix3d::Identity();  ///< Motion::fixed only
};

using SiteWeight = std::pair<int, double>;

enum class Role { base, geometry, offset, ratio, target, anchor, point, effect };

/// A sum of sites' columns, times a reading or a term's basis.
struct ColumnTerm {
  std::vector<SiteWeight> sites;
  int reading = -1;  ///< driven joint (ratio)
  int term = -1;     ///< effect
};

struct ParameterInfo {
  std::string name;
  std::string unit;
  Role role;
  int owner = -1;                   ///< joint, target or fixed-point index; effect: its request
  std::vector<ColumnTerm> columns;  ///< its Jacobian column is their sum
  int axis = -1;                    ///< anchor, point: coordinate 0..2; 3: the wire's zero
  bool rotation = false;            ///< an angle of the target's own orientation: positions cannot see it
};

/// The drive: motion of joint k = ratio * reading + offset + terms, moving its own site and those of passive joints.
struct Coordinate {
  int reading = -1;               ///< driven joint's reading; -1: passive joint, or a term's own site
  int ratio = -1, offset = -1;    ///< parameters; -1: none
  std::vector<int> terms;         ///< terms that add to it
  std::vector<SiteWeight> sites;  ///< what it moves
};

struct Model {
  Robot robot;                    ///< what it was made from
  std::vector<Site> sites;        ///< base, joints, then each target's
  int common_sites = 0;           ///< base and joints
  std::vector<int> target_first;  ///< first site of each target; one more at the end
  std::vector<ParameterInfo> parameters;
  std::vector<Coordinate> coordinates;  ///< joints in chain order, then sites that terms act on directly
  std::vector<Term> terms;
  std::vector<int> term_parameter;      ///< which parameter each term belongs to: several terms may share one
  std::vector<EffectRequest> requests;  ///< effects in the robot, then those asked for
  std::vector<std::string> point_names;

  int parameter_index(const std::string& name) const;  ///< -1: none of that name
};

/// `requests` are effects beside those that the robot already has. Point names are those of the data's fixed points.
Model make_model(const Robot& robot, const Measurements& data, const std::vector<EffectRequest>& requests = {},
                 const std::vector<Effect>& own = {});

/// Parameter values of the model's own robot, in order of Model::parameters; points start at zero.
Eigen::VectorXd initial_values(const Model& model);

/// The robot with these parameter values.
Robot robot_with(const Model& model, const Eigen::VectorXd& values);

/// Joints whose axis is within `angle` of parallel to the next axis in the chain, where d cannot stand for the missing
/// freedom.
std::vector<bool> near_parallel(const Robot& robot, double angle);

/// True when `name` matches the glob (`*`, `?`).
bool matches(const std::string& glob, const std::string& name);

/// Indices of the parameters that any of the names or globs mean; throws std::invalid_argument naming one that means
/// none.
std::vector<int> find_parameters(const Model& model, const std::vector<std::string>& globs);

}  // namespace truing::model
