// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// The Python module truing._core: conversion, keywords, docstrings, and the GIL released around long calls.
#include <cstdlib>  // with the C library's own macros
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "parts.hpp"
#include "truing/version.hpp"

namespace py = pybind11;

namespace {

/// A diagnosis makes and frees hundreds of matrices of some megabytes. The C library gives such memory back to the
/// system and takes it anew page by page, which was a third of the time. So up to 512 MB that were freed stay with the
/// process, unless the environment says how memory is to be kept.
void keep_freed_memory() {
#ifdef __GLIBC__
  for (const char* told : {"MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_", "GLIBC_TUNABLES"}) {
    if (std::getenv(told)) return;
  }
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);
  mallopt(M_TRIM_THRESHOLD, 512 * kMegabyte);
#endif
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  keep_freed_memory();
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
