// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/inputs.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "model/gravity.hpp"
#include "model/model.hpp"
#include "model/motion.hpp"

namespace truing::diagnosis {
namespace {

/// A joint that moves less stands still [rad | m].
constexpr double kStandstill = 1e-3;
constexpr std::size_t kMostInputs = 60;

bool is_constant(const std::vector<double>& values, double least) {
  if (values.empty()) return true;
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return !(*high - *low > least);
}

/// Inputs that repeat a few values (directions, payloads) have no more hats than values.
std::vector<double> distinct(std::vector<double> sorted, std::size_t most) {
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted.size() <= most ? sorted : std::vector<double>{};
}

/// Collects the inputs of all rows.
class InputCollector {
 public:
  InputCollector(const Robot& robot, const Measurements& data)
      : robot_(robot), data_(data), driven_(robot.driven_joints()) {}

  std::vector<InputColumn> collect() {
    joint_motions_and_torques();
    for (std::size_t k = 0; k < motion_.size(); ++k)
      add(input_name(Driver::angle, k), unit_of(k), static_cast<int>(k), std::move(motion_[k]), kStandstill);
    of_driven_joints(data_.direction, Driver::direction, "", 0.5);
    of_driven_joints(data_.joint_speed, Driver::speed, "rad/s", 1e-6);
    for (std::size_t k = 0; k < torque_.size(); ++k) {
      const double size = largest(torque_[k]);
      if (size > 0.0)
        add(input_name(Driver::gravity_torque, k), "Nm", static_cast<int>(k), std::move(torque_[k]), 1e-6 * size);
    }
    if (data_.payload) add("payload", "kg", -1, copy(data_.payload), 1e-6);
    if (data_.temperature) add("temp", "deg C", -1, copy(data_.temperature), 0.05);
    time_or_order();
    covariates();
    return std::move(out_);
  }

 private:
  void add(const std::string& name, const std::string& unit, int joint, std::vector<double> values, double least) {
    const bool finite = std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    if (finite) out_.push_back({name, unit, joint, is_constant(values, least), std::move(values)});
  }

  std::vector<double> copy(const Column& column) const {
    std::vector<double> values(data_.rows);
    for (std::size_t row = 0; row < data_.rows; ++row) values[row] = column[row];
    return values;
  }

  const char* unit_of(std::size_t joint) const {
    return robot_.joints[joint].type == JointType::revolute ? "rad" : "m";
  }

  static double largest(const std::vector<double>& values) {
    if (values.empty()) return 0.0;
    return std::abs(
        *std::max_element(values.begin(), values.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
  }

  /// Of every joint, passive ones included, at the readings.
  void joint_motions_and_torques() {
    const std::size_t n = data_.rows, joints = robot_.joints.size();
    const bool weights = knows_mass(robot_) || data_.payload;
    motion_.assign(joints, std::vector<double>(n));
    if (weights) torque_.assign(joints, std::vector<double>(n));
    const Eigen::MatrixXd coupling = coupling_matrix(robot_);
    Robot plain = robot_;
    for (Joint& joint : plain.joints) {
      joint.ratio = 1.0;
      joint.offset = 0.0;
    }
    Eigen::VectorXd reading(static_cast<Eigen::Index>(driven_.size())), moment(static_cast<Eigen::Index>(joints));
    for (std::size_t row = 0; row < n; ++row) {
      for (std::size_t k = 0; k < driven_.size(); ++k) reading[static_cast<Eigen::Index>(k)] = data_.joints[k][row];
      const Eigen::VectorXd q = joint_motions(plain, reading);
      for (std::size_t k = 0; k < joints; ++k) motion_[k][row] = q[static_cast<Eigen::Index>(k)];
      if (!weights) continue;
      gravity_torques_at(robot_, coupling, forward_kinematics(robot_, reading, 0),
                         data_.payload ? data_.payload[row] : 0.0, moment);
      for (std::size_t k = 0; k < joints; ++k) torque_[k][row] = moment[static_cast<Eigen::Index>(k)];
    }
  }

  void of_driven_joints(const std::vector<Column>& columns, Driver driver, const char* unit, double least) {
    for (std::size_t k = 0; k < driven_.size() && k < columns.size(); ++k) {
      if (columns[k]) add(input_name(driver, driven_[k]), unit, static_cast<int>(driven_[k]), copy(columns[k]), least);
    }
  }

  void time_or_order() {
    if (data_.time) {
      add("time", "s", -1, copy(data_.time), 1e-3);
      return;
    }
    std::vector<double> order(data_.rows);
    const std::vector<std::int32_t> group = pose_groups(data_);
    for (std::size_t row = 0; row < data_.rows; ++row) order[row] = group[row];
    add("order", "", -1, std::move(order), 0.5);
  }

  void covariates() {
    for (const auto& [name, column] : data_.covariates) {
      std::vector<double> values = copy(column);
      // A second record of a joint says what it differs by; speeds and records alone are joints again.
      if (name.rfind("qr", 0) == 0 && name.size() > 2 && std::isdigit(static_cast<unsigned char>(name[2]))) {
        difference_of_records(static_cast<std::size_t>(std::stoi(name.substr(2))), std::move(values));
        continue;
      }
      if (name.rfind("qd", 0) == 0 && !data_.joint_speed.empty()) continue;
      if (out_.size() < kMostInputs) add(name, "", -1, std::move(values), 0.0);
    }
  }

  void difference_of_records(std::size_t k, std::vector<double> values) {
    if (k < 1 || k > driven_.size()) return;
    for (std::size_t row = 0; row < data_.rows; ++row) values[row] -= data_.joints[k - 1][row];
    add("qr" + std::to_string(k) + "-q" + std::to_string(k), "rad", static_cast<int>(driven_[k - 1]), std::move(values),
        1e-7);
  }

  const Robot& robot_;
  const Measurements& data_;
  std::vector<std::size_t> driven_;
  std::vector<std::vector<double>> motion_, torque_;  ///< by joint and row
  std::vector<InputColumn> out_;
};

}  // namespace

std::string input_name(Driver driver, std::size_t joint) {
  const std::string number = std::to_string(joint + 1);
  switch (driver) {
    case Driver::angle:
      return "q" + number;
    case Driver::speed:
      return "speed" + number;
    case Driver::direction:
      return "dir" + number;
    case Driver::gravity_torque:
      return "torque" + number;
    case Driver::motor_torque:
      return "tau" + number;
    case Driver::temperature:
      return "temp";
    case Driver::time:
      return "time";
    case Driver::several:
    case Driver::constant:
    case Driver::other_angles:
      break;
  }
  return "";
}

bool is_torque(const InputColumn& input) { return input.name.rfind("torque", 0) == 0; }

std::vector<InputColumn> make_inputs(const Robot& robot, const Measurements& data) {
  return InputCollector(robot, data).collect();
}

std::vector<double> knots_of(const InputColumn& input, const std::vector<std::int32_t>& rows, int most) {
  std::vector<double> sorted;
  sorted.reserve(rows.size());
  for (const std::int32_t row : rows) sorted.push_back(input.values[static_cast<std::size_t>(row)]);
  std::sort(sorted.begin(), sorted.end());
  if (sorted.empty()) return {};
  const std::vector<double> few = distinct(sorted, static_cast<std::size_t>(most));
  if (!few.empty()) return few;
  std::vector<double> knots;
  for (int k = 0; k < most; ++k) {
    const double at = static_cast<double>(k) / (most - 1);
    // Halfway between equal steps and equal shares of the rows: neither gaps nor crowds get all the knots.
    const double share = sorted[static_cast<std::size_t>(at * static_cast<double>(sorted.size() - 1))];
    const double step = sorted.front() + at * (sorted.back() - sorted.front());
    const double knot = 0.5 * (share + step);
    if (knots.empty() || knot > knots.back() + 1e-9 * (sorted.back() - sorted.front())) knots.push_back(knot);
  }
  return knots;
}

void hats_at(const std::vector<double>& knots, double x, double* out) {
  const std::size_t n = knots.size();
  std::fill(out, out + n, 0.0);
  if (n == 0) return;
  if (x <= knots.front()) {
    out[0] = 1.0;
    return;
  }
  if (x >= knots.back()) {
    out[n - 1] = 1.0;
    return;
  }
  const auto above = static_cast<std::size_t>(std::upper_bound(knots.begin(), knots.end(), x) - knots.begin());
  const double part = (x - knots[above - 1]) / (knots[above] - knots[above - 1]);
  out[above - 1] = 1.0 - part;
  out[above] = part;
}

}  // namespace truing::diagnosis
