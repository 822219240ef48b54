// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A robot compiled for one configuration at a time: where its target is and how it moves, in a few hundred nanoseconds
// and without allocation. The kernel does the same for tiles of poses.

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "model/model.hpp"
#include "rooms.hpp"
#include "truing/inverse.hpp"
#include "truing/model/robot.hpp"

namespace truing::inverse_kinematics {

/// T_measurement_target, its columns side by side.
struct Tip {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d position;
};

/// Geometric Jacobian by readings, a column per driven joint.
struct Columns {
  Eigen::Vector3d linear[kMaxDrivenJoints];
  Eigen::Vector3d angular[kMaxDrivenJoints];
};

/// An axis of motion in the measurement frame when all readings are zero, and the readings that move it.
struct HomeAxis {
  Eigen::Vector3d direction;
  Eigen::Vector3d point;
  bool prismatic = false;
  std::vector<std::pair<int, double>> joints;  ///< driven joint, weight: the motion is their weighted sum
};

/// Memory for the bases of effects, of one solve at a time.
struct EffectScratch {
  Measurements data;  ///< one row, whose columns point at the arrays below
  Inputs inputs;
  std::vector<double> direction, speed, reading, covariates, basis;
  double payload = 0.0, temperature = 0.0, time = 0.0;
};

/// Every joint's frame split where it moves: T_measurement_link grows by before * motion about or along z * after.
struct JointFrame {
  Eigen::Isometry3d before, after;
  bool prismatic = false;
};

class Arm {
 public:
  /// `available`: the inputs there will be. Throws std::invalid_argument when effects need others, or there are too
  /// many joints.
  Arm(const Robot& robot, const Conditions& available, std::size_t target, const std::vector<Effect>& own_effects);

  const Robot& robot() const { return model_.robot; }
  int driven() const { return driven_; }
  bool turns(int driven_joint) const { return turns_[driven_joint]; }
  bool has_effects() const { return !model_.terms.empty(); }

  /// Where the target is at `readings`, and how it moves. `scratch` may be null without effects.
  Tip tip(const double* readings, EffectScratch* scratch) const;
  Tip tip(const double* readings, EffectScratch* scratch, Columns* columns) const;
  /// T_measurement_link after every joint, then that of the target, effects left out; `frames` has room for all.
  void link_frames(const double* readings, Eigen::Isometry3d* frames) const;

  /// Axes in chain order at zero readings, and the target's pose there; effects left out.
  std::vector<HomeAxis> home_axes(Tip* tip) const;

  /// Motion of every joint: rows of weights on the readings, and constants.
  const Eigen::MatrixXd& motion_weights() const { return motion_weights_; }
  const Eigen::VectorXd& motion_constants() const { return motion_constants_; }

  const Model& model() const { return model_; }
  /// What each of these parameters of the model does to the target: linear [m] above angular [rad] motion per unit.
  /// Anchors, points and indices below zero do nothing. Not for inner loops: it goes through every elementary
  /// transform.
  void parameter_motions(const double* readings, EffectScratch* scratch, const std::vector<int>& parameters,
                         Eigen::Matrix<double, 6, Eigen::Dynamic>* motions) const;

  std::unique_ptr<EffectScratch> make_scratch() const;
  /// Throws std::invalid_argument when a needed input is missing in `conditions`.
  void set_conditions(const Conditions& conditions, EffectScratch* scratch) const;

 private:
  /// One motion about or along z, after a frame that does not move.
  struct Step {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    bool turns = false;  ///< `rotation` is not the identity
    bool prismatic = false;
    int first_joint = 0, end_joint = 0;  ///< in joint_weights_
    int first_term = 0, end_term = 0;    ///< in term_weights_
  };

  void add_step(const Eigen::Isometry3d& fixed, bool prismatic);
  void evaluate_terms(const double* readings, EffectScratch* scratch) const;
  template <bool with_columns>
  Tip sweep(const double* readings, EffectScratch* scratch, Columns* columns) const;

  Model model_;
  Conditions available_;
  std::size_t target_ = 0;
  int driven_ = 0;
  bool turns_[kMaxDrivenJoints] = {};
  bool gravity_ = false;  ///< some term looks at torques or frames
  std::vector<Step> steps_;
  std::vector<std::pair<int, double>> joint_weights_, term_weights_;
  Eigen::Matrix3d last_rotation_ = Eigen::Matrix3d::Identity();  ///< from the last motion to the target
  Eigen::Vector3d last_shift_ = Eigen::Vector3d::Zero();
  std::vector<JointFrame> joint_frames_;
  Eigen::Isometry3d T_last_target_ = Eigen::Isometry3d::Identity();
  Eigen::MatrixXd coupling_, motion_weights_;
  Eigen::VectorXd motion_constants_;
};

/// Scratch memory that solves on any thread borrow and give back.
class ScratchPool {
 public:
  explicit ScratchPool(const Arm& arm) : arm_(arm) {}
  std::unique_ptr<EffectScratch> take();
  void give_back(std::unique_ptr<EffectScratch> scratch);

 private:
  const Arm& arm_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<EffectScratch>> idle_;
};

}  // namespace truing::inverse_kinematics
