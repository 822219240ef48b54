// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone, written for them: the parts of rclcpp that ros/truing_ros uses. What is logged is kept.

#include <cstdarg>
#include <cstdio>
#include <string>

namespace rclcpp {

struct Logger {
  std::string name;
};

inline Logger get_logger(const std::string& name) { return {name}; }

/// The last error that was logged.
inline std::string& last_error() {
  static std::string text;
  return text;
}

__attribute__((format(printf, 1, 2))) inline std::string formatted(const char* format, ...) {
  char text[4000];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
}

}  // namespace rclcpp

#define RCLCPP_ERROR(logger, ...) ((void)(logger), (void)(rclcpp::last_error() = rclcpp::formatted(__VA_ARGS__)))
#define RCLCPP_DEBUG(logger, ...) ((void)(logger), (void)rclcpp::formatted(__VA_ARGS__))
