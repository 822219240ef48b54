// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/tracking/calibrate.hpp"
#include "convert/options.hpp"
#include "convert/samples.hpp"
#include "convert/text.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

// ---- Standstills

TupleOf<RestPose> rests_found(const RestOptions& options, const ArrayLike& t, const FrameArray& T_base_flange,
                              const ArrayLike& tracker_t, const ArrayLike& position, const ArrayLike& orientation) {
  const std::vector<FrameSample> flange = frame_samples(t, T_base_flange, std::nullopt, "T_base_flange");
  const std::vector<PoseSample> tracker = pose_samples(tracker_t, position, orientation, std::nullopt);
  std::vector<RestPose> found;
  {
    const py::gil_scoped_release unlocked;
    found = find_rests(flange, tracker, options);
  }
  return tuple_of(found);
}

void bind_rests(py::module_& m) {
  auto rest = define_result<RestPose>(m, "RestPose");
  rest.def("__repr__", [](const RestPose& r) { return "RestPose(" + text(r.start) + " to " + text(r.end) + " s)"; });

  define_function<RestOptions>(m, "find_rests", &rests_found,
                               R"(Standstills of forward kinematics, with what the tracker saw during them.

t, tracker_t: shape=(n,), shape=(m,) [s]. T_base_flange: shape=(n, 4, 4). position: shape=(m, 3) [m].
orientation: shape=(m, 4) w x y z.

Raises InputError.)",
                               py::arg("t"), py::arg("T_base_flange"), py::arg("tracker_t"), py::arg("position"),
                               py::arg("orientation"));
}

// ---- Frames and tool

void bind_frames(py::module_& m) {
  auto error = define_result<PositionError>(m, "PositionError");
  error.def("__repr__", [](const PositionError& e) {
    return "PositionError(" + text(1e3 * e.position) + " mm, weight " + text(e.weight) + ")";
  });

  auto cls = define_result<FramesResult>(m, "FramesResult");
  cls.def("__repr__",
          [](const FramesResult& r) { return std::string("FramesResult(") + word(r.status) + ": " + r.message + ")"; });

  m.def(
      "calibrate_frames",
      [](const FrameArray& T_base_flange, const FrameArray& T_tracker_receiver) {
        const std::vector<Eigen::Isometry3d> flange = frames_from(T_base_flange, "T_base_flange"),
                                             receiver = frames_from(T_tracker_receiver, "T_tracker_receiver");
        if (flange.size() != receiver.size())
          throw std::invalid_argument("T_base_flange has " + std::to_string(flange.size()) +
                                      " poses, T_tracker_receiver has " + std::to_string(receiver.size()));
        const py::gil_scoped_release unlocked;
        return calibrate_frames(flange, receiver);
      },
      py::arg("T_base_flange"), py::arg("T_tracker_receiver"),
      R"(Tracker frame and receiver on the flange from test positions.

A closed form, then least squares in which every position is weighted by its own error.
T_base_flange, T_tracker_receiver: shape=(n, 4, 4). Raises InputError.)");
}

void bind_tool(py::module_& m) {
  auto cls = define_result<ToolResult>(m, "ToolResult", {"pivot_error", "orientation_error"});
  cls.def_property_readonly(
      "pivot_error", [](const ToolResult& r) { return tuple_of(r.pivot_error); }, "[m] of every pivot pose.");
  cls.def_property_readonly(
      "orientation_error", [](const ToolResult& r) { return tuple_of(r.orientation_error); },
      "[rad] of every orientation pose.");
  cls.def("__repr__",
          [](const ToolResult& r) { return std::string("ToolResult(") + word(r.status) + ": " + r.message + ")"; });

  m.def(
      "calibrate_tool",
      [](const FrameArray& pivot, const std::optional<FrameArray>& orientation,
         const std::vector<Eigen::Matrix3d>& prescribed) {
        ToolPoses poses;
        poses.pivot = frames_from(pivot, "pivot");
        if (orientation) poses.orientation = frames_from(*orientation, "orientation");
        poses.prescribed = prescribed;
        return calibrate_tool(poses);
      },
      py::arg("pivot"), py::arg("orientation") = py::none(), py::arg("prescribed") = std::vector<Eigen::Matrix3d>{},
      R"(The tool from poses of the flange.

pivot: shape=(n, 4, 4), the tool tip on one point in three or more orientations.
orientation: shape=(m, 4, 4), the tool in prescribed orientations; None: the flange's axes are the tool's.
prescribed: R_base_tool of those, shape=(3, 3) each.

Raises InputError.)");
}

// ---- Inertial sensor

InertialResult inertial_found(const InertialOptions& options, const ArrayLike& t, const ArrayLike& gyro,
                              const ArrayLike& accel, const ArrayLike& tracker_t, const ArrayLike& position,
                              const ArrayLike& orientation) {
  const std::vector<ImuSample> imu = imu_samples(t, gyro, accel, std::nullopt);
  const std::vector<PoseSample> tracker = pose_samples(tracker_t, position, orientation, std::nullopt);
  const py::gil_scoped_release unlocked;
  return calibrate_inertial(imu, tracker, options);
}

void bind_inertial(py::module_& m) {
  auto cls = define_result<InertialResult>(m, "InertialResult");
  cls.def("__repr__", [](const InertialResult& r) {
    return std::string("InertialResult(") + word(r.status) + ": " + r.message + ")";
  });

  define_function<InertialOptions>(
      m, "calibrate_inertial", &inertial_found,
      R"(Where the inertial sensor is on the receiver, gravity, and the clock offset, from one motion that both saw.

t, gyro, accel: shape=(n,) [s], (n, 3) [rad/s], (n, 3) [m/s^2].
tracker_t, position, orientation: shape=(m,) [s], (m, 3) [m], (m, 4) w x y z.

Raises InputError on data that cannot be used.)",
      py::arg("t"), py::arg("gyro"), py::arg("accel"), py::arg("tracker_t"), py::arg("position"),
      py::arg("orientation"));
  m.def(
      "assemble_setup",
      [](const FramesResult& frames, const InertialResult& inertial, const std::optional<ToolResult>& tool) {
        std::vector<std::string> notes;
        const TrackSetup setup = assemble_setup(frames, tool.value_or(ToolResult{}), inertial, &notes);
        return std::make_pair(setup, notes);
      },
      py::arg("frames"), py::arg("inertial"), py::arg("tool") = py::none(),
      "The parts put together, gravity in the base frame; and what to know, as a base that is not level. Without "
      "`tool` it is the flange.");
}

}  // namespace

void bind_calibrate(py::module_& m) {
  bind_rests(m);
  bind_frames(m);
  bind_tool(m);
  bind_inertial(m);
}

}  // namespace truing::python
