// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: a node that has parameters and nothing else.

#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include <rclcpp/parameter.hpp>

namespace rclcpp {

class Node {
 public:
  using SharedPtr = std::shared_ptr<Node>;

  bool has_parameter(const std::string& name) const { return values.count(name) > 0; }

  /// As rclcpp: a value that was given from outside (`given`) goes before the default; declared twice is a mistake.
  template <class Value>
  Value declare_parameter(const std::string& name, const Value& otherwise) {
    if (has_parameter(name)) throw std::runtime_error("parameter '" + name + "' has already been declared");
    values[name] = given.count(name) ? given.at(name) : Parameter::Value(otherwise);
    return std::get<Value>(values.at(name));
  }

  template <class Value>
  bool get_parameter(const std::string& name, Value& value) const {
    if (!has_parameter(name)) return false;
    value = std::get<Value>(values.at(name));
    return true;
  }

  std::map<std::string, Parameter::Value> given, values;
};

}  // namespace rclcpp
