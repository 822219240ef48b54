// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: what a controller hands to a kinematics plugin to read its parameters from.

#include <map>
#include <string>

#include <rclcpp/parameter.hpp>

namespace rclcpp::node_interfaces {

class NodeParametersInterface {
 public:
  bool has_parameter(const std::string& name) const { return values.count(name) > 0; }
  bool get_parameter(const std::string& name, Parameter& parameter) const {
    if (!has_parameter(name)) return false;
    parameter = Parameter(name, values.at(name));
    return true;
  }

  std::map<std::string, Parameter::Value> values;
};

}  // namespace rclcpp::node_interfaces
