// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "convert/pybind.hpp"
#include "truing/dynamics/effect.hpp"
#include "truing/model/effect.hpp"

namespace truing::python {

/// A user's effect: its values were computed in Python, one per row, before C++ runs.
struct OwnEffect {
  struct Part {
    std::string joint, parameter, unit, site;
    Column values;
    std::size_t rows = 0;
    std::shared_ptr<const void> owner;
  };
  std::string name, summary;
  std::vector<Part> parts;
  EffectTraits traits{};
};

std::vector<Effect> effects_from(const std::vector<OwnEffect>& own);
/// Effects whose basis Python evaluates whenever rows are asked for: `truing.Effect` objects. Takes the GIL to do so.
std::vector<Effect> effects_evaluated_when_asked(const std::vector<py::object>& own);
/// The same of effects on torques: `truing.dynamics.TorqueEffect` objects.
std::vector<TorqueEffect> torque_effects_evaluated_when_asked(const std::vector<py::object>& own);

}  // namespace truing::python
