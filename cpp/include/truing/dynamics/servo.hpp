// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Servo arms simulated from their commands: many values of the actuator chain over many stretches of recordings at
// once, on all cores. The rigid bodies and dry friction are a simulator's (MuJoCo), whose functions and arrays come as
// addresses: this library is built without it. The chain itself (docs/method/servo.md) is computed here, step by step.

#include <string>
#include <vector>

#include <Eigen/Core>

namespace truing::dynamics {

/// Values of a joint's chain, in the order of a row's columns. Units in ServoJoint (python/truing/dynamics/servo).
enum class ServoField : int {
  command_gain,
  integral_gain,
  damping_gain,
  gain_law,
  delay,
  rate_limit,
  saturation,
  drive_law,
  drive_reference,
  supply_gain,
  supply_sag,
  dead_band,
  coulomb,
  viscous,
  viscous_law,
  back_emf,
  limited_damping,
  stribeck,
  stribeck_speed,
  load_friction,
  asymmetric_friction,
  presliding,
  thermal_friction,
  warmup,
  spring,
  current_offset,
  gravity_scale,
  armature,
  backlash,
  elasticity,
  motor_encoder,
  zero,
  count
};
inline constexpr int kServoFields = static_cast<int>(ServoField::count);
/// Their names, in order.
std::vector<std::string> servo_fields();

/// What a torque that is added to a joint is a function of.
enum class ServoInput : int { speed, load, angle, command_error, time, directed_load, directed_angle, count };
std::vector<std::string> servo_inputs();

/// Functions of the simulator.
struct ServoCalls {
  void (*step)(const void* model, void* data) = nullptr;   ///< mj_step
  void (*reset)(const void* model, void* data) = nullptr;  ///< mj_resetData
  void (*constants)(void* model, void* data) = nullptr;    ///< mj_setConst
};

/// One thread's model and data: nobody else may touch them meanwhile. The arrays are those of the two.
struct ServoWorkspace {
  void* model = nullptr;
  void* data = nullptr;
  double *qpos = nullptr, *qvel = nullptr, *applied = nullptr, *bias = nullptr;  // of the data
  double *constraint = nullptr, *inertia_at_zero = nullptr;  // of the data; of the model, each joint's own
  double *frictionloss = nullptr, *damping = nullptr, *armature = nullptr, *gravity = nullptr;  // of the model
  double *mass = nullptr, *ipos = nullptr, *iquat = nullptr, *inertia = nullptr;
};

/// The arm in the simulator. A joint's place in qpos, and in qvel.
struct ServoArm {
  std::vector<int> qpos, dof;
  double step = 0.001;  ///< [s] of the simulator
  int bodies = 0;
  Eigen::Vector3d gravity = Eigen::Vector3d(0.0, 0.0, -9.81);
  bool torque_command = false;  ///< commands are torques: they are passed on, times command_gain
};

/// A recording, rows at even times. Tables of one column hold for all joints.
struct ServoRecording {
  double step = 0.0;         ///< [s] between rows, a whole number of the simulator's steps
  Eigen::MatrixXd command;   ///< shape=(n, joints) [rad | m], or [Nm | N]; held until the next row
  Eigen::MatrixXd position;  ///< shape=(n, joints) [rad | m] as measured, smoothed: where windows begin
  Eigen::MatrixXd speed;     ///< shape=(n, joints) [rad/s | m/s] the same
  Eigen::MatrixXd gain;      ///< shape=(n, joints or 1): firmware gain over its reference
  Eigen::MatrixXd supply;    ///< shape=(n, joints or 1): voltage over its reference
  Eigen::MatrixXd enabled;   ///< shape=(n, joints or 1): 0 switched off
  Eigen::MatrixXd warmth;    ///< shape=(n, joints or 1) [K] temperature less its reference
};

/// Rows first + 1 to first + rows of a recording, simulated from the measured state of row `first`.
struct ServoWindow {
  int recording = 0;
  Eigen::Index first = 0, rows = 0;
};

/// Body arrays of the simulator with other masses: all bodies, one after the other.
struct ServoBodies {
  Eigen::VectorXd mass, ipos, iquat, inertia;
};

/// A torque added at a joint: straight lines through values at even places of an input.
struct ServoFunction {
  int joint = 0;
  ServoInput input = ServoInput::speed;
  double low = 0.0, width = 1.0;  ///< first place, and between places
  Eigen::VectorXd values;         ///< [Nm | N]
};

/// One arm to be simulated.
struct ServoSet {
  Eigen::MatrixXd chain;  ///< shape=(joints, kServoFields)
  double weight_scale = 1.0;
  int bodies = -1;  ///< number of its ServoBodies; -1: the model's
  int only = -1;    ///< of joints apart: the one that is moved, the others' numbers are zero; -1: all
  std::vector<ServoFunction> functions;
  Eigen::MatrixXd charge;  ///< shape=(recordings, joints) [rad s | m s]: integrals at their first rows; empty: zero
};

/// Simulated positions, and the drives' torques.
struct ServoMotion {
  std::vector<Eigen::MatrixXd> position;  ///< of every set, shape=(rows of all windows, joints) [rad | m], as recorded
  std::vector<Eigen::MatrixXd> torque;    ///< the same [Nm | N], if asked for
};

/// What each joint of an arm feels along a recorded motion while the others move as was measured: shape=(n, joints),
/// rows as the recording's. With x the joint's angle less the recorded one, `turns` 1 for a hinge and 0 for a slide,
///   inertia qdd + bias + weight_scale (cosine cos(turns x) + sine sin(turns x)) - cosine = torque.
struct ServoPath {
  Eigen::MatrixXd inertia;       ///< of what the joint moves, without its rotor [kg m^2 | kg]
  Eigen::MatrixXd bias;          ///< all else along the recorded motion, weight included [Nm | N]
  Eigen::MatrixXd cosine, sine;  ///< weight, as the joint alone leaves the recorded motion [Nm | N]
  Eigen::VectorXd turns;
};

/// Simulates every set over every window, one workspace a thread. What leaves (not finite, or 1e3 rad from where it
/// began) stays there. The same numbers whatever the number of workspaces. Throws std::invalid_argument: tables of
/// other shapes, windows beyond their recordings.
ServoMotion simulate_servos(const ServoCalls& calls, const std::vector<ServoWorkspace>& workspaces, const ServoArm& arm,
                            const std::vector<ServoBodies>& bodies, const std::vector<ServoRecording>& recordings,
                            const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets, bool torques);

/// The same joint by joint, each along the measured motion of the others: no simulator is called. `paths`: of every
/// kind of masses, those of every recording (empty: no window is of it); a set's `bodies` is the number of its kind.
ServoMotion simulate_servos_apart(const ServoArm& arm, const std::vector<std::vector<ServoPath>>& paths,
                                  const std::vector<ServoRecording>& recordings,
                                  const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets,
                                  int threads, bool torques);

/// Normal equations of one fold: rows that are fitted or left out together.
struct ColumnSums {
  Eigen::MatrixXd xx;
  Eigen::VectorXd xy;
  double yy = 0.0;
  double n = 0.0;  ///< rows that count
};

/// A column of a table of rows by joints, as it lies in memory: of one joint, shape=(rows,), or of all (joint -1),
/// shape=(rows, joints).
struct ColumnValues {
  const double* values = nullptr;
  int joint = -1;
};

/// Rows that sums are made of.
struct ColumnRows {
  const double* measured = nullptr;  ///< shape=(rows, joints): what the columns are to explain
  Eigen::VectorXd weight;            ///< of each joint's rows
  std::vector<int> fold;             ///< of each row, from 0 on
  int folds = 1;
  Eigen::Index every = 1;  ///< rows are thinned to each so-many-th, which counts for as many
};

/// Normal equations by fold of weighted rows. The order of the sums is fixed: the same bits whatever the threads.
/// Throws std::invalid_argument: folds or joints that there are not.
std::vector<ColumnSums> sum_columns(const std::vector<ColumnValues>& columns, const ColumnRows& rows, int threads);

/// What adding columns to those that are always in would win.
struct ColumnGain {
  double score = 0.0;          ///< log Bayes factor less the candidate's cost [nats]
  double scale = 1.0;          ///< of the prior, the most likely one
  double share = 0.0;          ///< of the squares that are left, the part that it removes
  int rank = 0;                ///< columns that the data can see
  Eigen::VectorXd values;      ///< of its columns, fitted with those that are always in
  Eigen::VectorXd folds;       ///< squares of each fold, by the fit to the others
  double explains_best = 0.0;  ///< of what the candidate of the best score does, the part that this one can do
};

/// Every candidate's gain, and first that of none (with no columns): evidence as everywhere (estimation/evidence.hpp).
/// `always`: columns that are in any case, flat. `prior`: standard deviation of each column's value. Throws
/// std::invalid_argument: no fold, other shapes, columns that there are not.
std::vector<ColumnGain> rank_columns(const std::vector<ColumnSums>& folds, const std::vector<int>& always,
                                     const std::vector<std::vector<int>>& candidates, const std::vector<double>& costs,
                                     const Eigen::VectorXd& prior);

}  // namespace truing::dynamics
