// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// The Python module truing._core: conversion, keywords, docstrings, and the GIL released around long calls.
#include "parts.hpp"
#include "truing/version.hpp"

namespace py = pybind11;

PYBIND11_MODULE(_core, m) {
  m.doc() = "The C++ core of truing. Use it through `import truing`.";
  // A function, so that the committed stubs do not hold the version a second time.
  m.def("version", [] { return truing::version; }, "Version of the C++ core: 'major.minor.patch'.");

  // The library reports bad input as std::invalid_argument; the exception that teaches is written in Python.
  py::register_local_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const std::invalid_argument& error) {
      py::set_error(py::module_::import("truing.errors").attr("InputError"), error.what());
    }
  });

  // Signatures name the classes that were bound before.
  truing::python::bind_common(m);
  truing::python::bind_robot(m);
  truing::python::bind_measurement(m);
  truing::python::bind_effect_traits(m);
  truing::python::bind_effect(m);
  truing::python::bind_motion_recording(m);
  truing::python::bind_urdf(m);
  truing::python::bind_torque_regressor(m);
  truing::python::bind_scene(m);
  truing::python::bind_identify(m);
  truing::python::bind_review(m);
  truing::python::bind_fleet(m);
  truing::python::bind_plan(m);
  truing::python::bind_diagnose(m);
  truing::python::bind_handeye(m);
  truing::python::bind_inverse(m);
  truing::python::bind_compensate(m);
  truing::python::bind_streams(m);
  truing::python::bind_tracker(m);
  truing::python::bind_replay(m);
  truing::python::bind_simulation(m);
  truing::python::bind_calibrate(m);
  truing::python::bind_rigid(m);
  truing::python::bind_own_torque_effects(m);
  truing::python::bind_torque(m);
  truing::python::bind_torque_plan(m);
  truing::python::bind_servo(m);
}
