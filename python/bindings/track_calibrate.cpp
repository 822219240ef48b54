// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "casters.hpp"
#include "truing/tracking/calibrate.hpp"

namespace truing::python {

template <>
struct Words<CalibrationStatus> {
  static constexpr const char* what = "status";
  static constexpr std::array<const char*, 4> list{"done", "not observable", "not consistent", "not converged"};
  static constexpr auto type =
      py::detail::const_name("typing.Literal['done', 'not observable', 'not consistent', 'not converged']");
};

}  // namespace truing::python

namespace pybind11::detail {

template <>
struct type_caster<truing::CalibrationStatus> : word_caster<truing::CalibrationStatus> {};

}  // namespace pybind11::detail

namespace truing::python {

namespace {

void bind_rests(py::module_& m) {
  py::class_<RestPose> rest(m, "RestPose", "A standstill, averaged.");
  rest.def_readonly("start", &RestPose::start, "[s] the controller's clock.");
  rest.def_readonly("end", &RestPose::end, "[s]");
  rest.def_readonly("T_base_flange", &RestPose::T_base_flange, "shape=(4, 4)");
  rest.def_readonly("T_tracker_receiver", &RestPose::T_tracker_receiver, "shape=(4, 4)");
  rest.def_readonly("scatter", &RestPose::scatter,
                    "[m] of the tracker's position, rms of a component: noise and sway.");
  rest.def_readonly("samples", &RestPose::samples, "Of the tracker.");
  rest.def("__repr__", [](const RestPose& r) { return "RestPose(" + text(r.start) + " to " + text(r.end) + " s)"; });

  const RestOptions usual;
  m.def(
      "find_rests",
      [](const ArrayLike& t, const FrameArray& T_base_flange, const ArrayLike& tracker_t, const ArrayLike& position,
         const ArrayLike& orientation, double least, double margin, double moved_by, double turned_by,
         double clock_offset) {
        const std::vector<FrameSample> flange = frame_samples(t, T_base_flange, std::nullopt, "T_base_flange");
        const std::vector<PoseSample> tracker = pose_samples(tracker_t, position, orientation, std::nullopt);
        RestOptions options{least, margin, moved_by, turned_by, clock_offset};
        std::vector<RestPose> found;
        {
          const py::gil_scoped_release unlocked;
          found = find_rests(flange, tracker, options);
        }
        return tuple_of(found);
      },
      py::arg("t"), py::arg("T_base_flange"), py::arg("tracker_t"), py::arg("position"), py::arg("orientation"),
      py::kw_only(), py::arg("least") = usual.least, py::arg("margin") = usual.margin,
      py::arg("moved_by") = usual.position, py::arg("turned_by") = usual.rotation,
      py::arg("clock_offset") = usual.clock_offset,
      R"(Standstills of forward kinematics, with what the tracker saw during them.

t, tracker_t: shape=(n,), shape=(m,) [s]. T_base_flange: shape=(n, 4, 4). position: shape=(m, 3) [m]. orientation: shape=(m, 4) w x y z.
least: [s] shorter ones do not count: sway has to average out. margin: [s] left out after the arm has stopped and before it starts.
moved_by, turned_by: [m], [rad] the flange stays within these. clock_offset: [s] t_controller = t_tracker - clock_offset.

Raises InputError.)");
}

void bind_frames(py::module_& m) {
  py::class_<PositionError> error(m, "PositionError",
                                  "How far a test position is from the frames found, and what it counted.");
  error.def_readonly("position", &PositionError::position, "[m]");
  error.def_readonly("rotation", &PositionError::rotation, "[rad]");
  error.def_readonly("weight", &PositionError::weight,
                     "About 1 where errors are usual, towards 0 where they are large.");
  error.def("__repr__", [](const PositionError& e) {
    return "PositionError(" + text(1e3 * e.position) + " mm, weight " + text(e.weight) + ")";
  });

  py::class_<FramesResult> cls(m, "FramesResult", "Tracker frame and receiver, of `calibrate_frames`.");
  cls.def_readonly(
      "status", &FramesResult::status,
      "'done', 'not observable', 'not consistent' (the message names the reading that would close), 'not converged'.");
  cls.def_readonly("message", &FramesResult::message, "One sentence.");
  cls.def_property_readonly(
      "warnings", [](const FramesResult& r) { return tuple_of(r.warnings); }, "What to know or do.");
  cls.def_readonly("T_tracker_base", &FramesResult::T_tracker_base, "With covariance.");
  cls.def_readonly("T_flange_receiver", &FramesResult::T_flange_receiver, "With covariance.");
  cls.def_property_readonly("errors", [](const FramesResult& r) { return tuple_of(r.errors); }, "One per position.");
  cls.def_readonly("position_sigma", &FramesResult::position_sigma, "[m] usual error of one component.");
  cls.def_readonly("rotation_sigma", &FramesResult::rotation_sigma, "[rad]");
  cls.def_readonly("iterations", &FramesResult::iterations, "Of the refinement.");
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
      R"(Tracker frame and receiver on the flange from test positions: closed form, then least squares in which every position counts by its own error.

T_base_flange, T_tracker_receiver: shape=(n, 4, 4). Raises InputError.)");
}

void bind_tool(py::module_& m) {
  py::class_<ToolResult> cls(m, "ToolResult", "The tool on the flange, of `calibrate_tool`.");
  cls.def_readonly("status", &ToolResult::status, "'done' or 'not observable'.");
  cls.def_readonly("message", &ToolResult::message, "One sentence.");
  cls.def_readonly("T_flange_tool", &ToolResult::T_flange_tool, "With covariance.");
  cls.def_readonly("point", &ToolResult::point, "shape=(3,) [m] where the tip was, in the base.");
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
orientation: shape=(m, 4, 4), the tool in prescribed orientations; None: the flange's axes are the tool's. prescribed: R_base_tool of those, shape=(3, 3) each.

Raises InputError.)");
}

void bind_inertial(py::module_& m) {
  py::class_<InertialResult> cls(m, "InertialResult", "Inertial sensor, gravity and clock, of `calibrate_inertial`.");
  cls.def_readonly("status", &InertialResult::status, "'done', 'not observable', 'not consistent', 'not converged'.");
  cls.def_readonly("message", &InertialResult::message, "One sentence.");
  cls.def_property_readonly(
      "warnings", [](const InertialResult& r) { return tuple_of(r.warnings); }, "What to know or do.");
  cls.def_readonly("T_receiver_imu", &InertialResult::T_receiver_imu, "With covariance.");
  cls.def_readonly("gravity", &InertialResult::gravity, "shape=(3,) [m/s^2] in the tracker frame.");
  cls.def_readonly("gravity_covariance", &InertialResult::gravity_covariance, "shape=(3, 3)");
  cls.def_readonly("tracker_up", &InertialResult::tracker_up, "The tracker's axis that points up: '+z', '+y', ...");
  cls.def_readonly("clock_offset", &InertialResult::clock_offset, "[s] t_imu = t_tracker - clock_offset");
  cls.def_readonly("clock_offset_sigma", &InertialResult::clock_offset_sigma, "[s] standard error.");
  cls.def_readonly("rich_enough", &InertialResult::rich_enough, "The offset is known as well as wanted.");
  cls.def_readonly("advice", &InertialResult::advice, "What would make it so.");
  cls.def_readonly("gyro_bias", &InertialResult::gyro_bias, "shape=(3,) [rad/s]");
  cls.def_readonly("accel_bias", &InertialResult::accel_bias, "shape=(3,) [m/s^2]");
  cls.def_readonly("rotation_rate", &InertialResult::rotation_rate,
                   "shape=(3,) [rad/s] rms about the three principal axes, descending.");
  cls.def_readonly("position_rms", &InertialResult::position_rms, "[m] of one component, what is left.");
  cls.def_readonly("rotation_rms", &InertialResult::rotation_rms, "[rad]");
  cls.def_readonly("iterations", &InertialResult::iterations, "Of the fit.");
  cls.def("__repr__", [](const InertialResult& r) {
    return std::string("InertialResult(") + word(r.status) + ": " + r.message + ")";
  });

  const InertialOptions usual;
  m.def(
      "calibrate_inertial",
      [](const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel, const ArrayLike& tracker_t,
         const ArrayLike& position, const ArrayLike& orientation, double clock_search, double clock_wanted,
         double segment, double gyro_bias, double accel_bias, int max_iterations) {
        const std::vector<ImuSample> imu = imu_samples(t, gyro, accel, std::nullopt);
        const std::vector<PoseSample> tracker = pose_samples(tracker_t, position, orientation, std::nullopt);
        const InertialOptions options{clock_search, clock_wanted, segment, gyro_bias, accel_bias, max_iterations};
        const py::gil_scoped_release unlocked;
        return calibrate_inertial(imu, tracker, options);
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"), py::arg("tracker_t"), py::arg("position"),
      py::arg("orientation"), py::kw_only(), py::arg("clock_search") = usual.clock_search,
      py::arg("clock_wanted") = usual.clock_wanted, py::arg("segment") = usual.segment,
      py::arg("gyro_bias") = usual.gyro_bias, py::arg("accel_bias") = usual.accel_bias,
      py::arg("max_iterations") = usual.max_iterations,
      R"(Where the inertial sensor is on the receiver, gravity, and the offset of the clocks, from one motion that both saw.

t, gyro, accel: shape=(n,) [s], (n, 3) [rad/s], (n, 3) [m/s^2]. tracker_t, position, orientation: shape=(m,) [s], (m, 3) [m], (m, 4) w x y z.
clock_search: [s] offsets up to this are looked for. clock_wanted: [s] a larger standard error is not enough, and advice is given.
segment: [s] inertial data are integrated over so long. gyro_bias, accel_bias: [rad/s], [m/s^2] standard deviations before any data.

Raises InputError on data that cannot be used.)");
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

void bind_track_calibrate(py::module_& m) {
  bind_rests(m);
  bind_frames(m);
  bind_tool(m);
  bind_inertial(m);
}

}  // namespace truing::python
