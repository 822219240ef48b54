// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: a parameter of a node, of the types that ros/truing_ros asks for.

#include <string>
#include <variant>

namespace rclcpp {

class Parameter {
 public:
  using Value = std::variant<bool, double, std::string>;

  Parameter() = default;
  Parameter(std::string name, Value value) : name_(std::move(name)), value_(std::move(value)) {}
  std::string as_string() const { return std::get<std::string>(value_); }
  double as_double() const { return std::get<double>(value_); }
  const Value& value() const { return value_; }

 private:
  std::string name_;
  Value value_;
};

}  // namespace rclcpp
