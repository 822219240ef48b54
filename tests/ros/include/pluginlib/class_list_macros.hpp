// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// For the tests alone: instead of a class loader, a function that makes the plugin of a base class.

#include <memory>

template <class Base>
std::unique_ptr<Base> make_plugin();

#define PLUGINLIB_EXPORT_CLASS(Plugin, Base)  \
  template <>                                 \
  std::unique_ptr<Base> make_plugin<Base>() { \
    return std::make_unique<Plugin>();        \
  }
