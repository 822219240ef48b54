// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// The parts of the module, one per public header; each adds its classes and functions to the module.
#pragma once

#include "convert/pybind.hpp"

namespace truing::python {

void bind_common(py::module_& m);
void bind_robot(py::module_& m);
void bind_measurement(py::module_& m);
void bind_effect_traits(py::module_& m);
void bind_effect(py::module_& m);
void bind_motion_recording(py::module_& m);
void bind_own_torque_effects(py::module_& m);
void bind_torque(py::module_& m);
void bind_torque_plan(py::module_& m);
void bind_urdf(py::module_& m);
void bind_torque_regressor(py::module_& m);
void bind_scene(py::module_& m);
void bind_identify(py::module_& m);
void bind_review(py::module_& m);
void bind_fleet(py::module_& m);
void bind_plan(py::module_& m);
void bind_diagnose(py::module_& m);
void bind_handeye(py::module_& m);
void bind_inverse(py::module_& m);
void bind_compensate(py::module_& m);
void bind_streams(py::module_& m);
void bind_tracker(py::module_& m);
void bind_replay(py::module_& m);
void bind_simulation(py::module_& m);
void bind_rigid(py::module_& m);
void bind_servo(py::module_& m);
void bind_calibrate(py::module_& m);

}  // namespace truing::python
