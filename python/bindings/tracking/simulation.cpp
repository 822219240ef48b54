// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/tracking/simulation.hpp"
#include "convert/options.hpp"
#include "convert/samples.hpp"
#include "convert/text.hpp"
#include "convert/tracking.hpp"
#include "parts.hpp"
#include "truing/tracking/replay.hpp"

namespace truing::python {

/// Dropouts are pairs (start, length).
template <>
struct Exchange<std::vector<Dropout>> {
  using In = std::vector<std::pair<double, double>>;
  static In given(const std::vector<Dropout>& value) {
    In out;
    for (const Dropout& dropout : value) out.emplace_back(dropout.start, dropout.seconds);
    return out;
  }
  static auto shown(const std::vector<Dropout>& value) { return tuple_of(given(value)); }
  static std::vector<Dropout> taken(const In& value) {
    std::vector<Dropout> out;
    for (const auto& [start, length] : value) out.push_back({start, length});
    return out;
  }
};

/// Shifts are pairs (start, T_old_new).
template <>
struct Exchange<std::vector<StationShift>> {
  using In = std::vector<std::pair<double, Eigen::Isometry3d>>;
  static In given(const std::vector<StationShift>& value) {
    In out;
    for (const StationShift& shift : value) out.emplace_back(shift.start, shift.T_old_new);
    return out;
  }
  static auto shown(const std::vector<StationShift>& value) { return tuple_of(given(value)); }
  static std::vector<StationShift> taken(const In& value) {
    std::vector<StationShift> out;
    for (const auto& [start, T_old_new] : value) out.push_back({start, T_old_new});
    return out;
  }
};

namespace {

void bind_mode(py::module_& m) {
  py::class_<FlexibleMode> cls(m, "FlexibleMode", Fields<FlexibleMode>::summary);
  cls.def(py::init([](double frequency, double damping, const Eigen::Vector3d& direction,
                      const Eigen::Vector3d& rotation, const Eigen::Vector3d& participation, double gust) {
            return FlexibleMode{frequency, damping, direction, rotation, participation, gust};
          }),
          py::kw_only(), py::arg("frequency"), py::arg("damping"), py::arg("direction"), py::arg("rotation"),
          py::arg("participation"), py::arg("gust") = 0.0);
  define_attributes(cls);
  cls.def("__repr__", [](const FlexibleMode& f) { return "FlexibleMode(" + text(f.frequency) + " Hz)"; });
  define_value(cls, {"frequency", "damping", "direction", "rotation", "participation", "gust"});
}

// ---- Streams as columns

NumberColumns imu_columns(const SimulatedStreams& s) {
  py::dict out;
  out["t"] = column(s.imu, [](const auto& x) { return x.t; });
  out["gyro"] = columns(s.imu, 3, [](const auto& x) -> const auto& { return x.gyro; });
  out["accel"] = columns(s.imu, 3, [](const auto& x) -> const auto& { return x.accel; });
  out["arrival"] = column(s.imu, [](const auto& x) { return x.arrival; });
  return NumberColumns(sealed(out));
}

NumberColumns tracker_columns(const SimulatedStreams& s) {
  py::dict out;
  out["t"] = column(s.tracker, [](const auto& x) { return x.t; });
  out["position"] = columns(s.tracker, 3, [](const auto& x) -> const auto& { return x.position; });
  out["orientation"] = columns(s.tracker, 4, [](const auto& x) {
    return Eigen::Vector4d(x.orientation.w(), x.orientation.x(), x.orientation.y(), x.orientation.z());
  });
  out["arrival"] = column(s.tracker, [](const auto& x) { return x.arrival; });
  return NumberColumns(sealed(out));
}

NumberColumns joints_columns(const SimulatedStreams& s) {
  py::dict out;
  out["t"] = column(s.joints_t, [](double x) { return x; });
  out["joints"] = py::array_t<double>(py::cast(s.joints));
  out["arrival"] = column(s.joints_arrival, [](double x) { return x; });
  return NumberColumns(sealed(out));
}

NumberColumns frame_columns(const std::vector<FrameSample>& samples, const char* name) {
  py::dict out;
  out["t"] = column(samples, [](const auto& x) { return x.t; });
  out[name] = frame_column(samples, [](const auto& x) { return x.T_base_frame; });
  out["arrival"] = column(samples, [](const auto& x) { return x.arrival; });
  return NumberColumns(sealed(out));
}

py::array_t<double> tools_at(const SimulatedStreams& s, const ArrayLike& t) {
  const Array times = vector_from(t, "t");
  std::vector<Eigen::Isometry3d> out;
  for (py::ssize_t k = 0; k < times.shape(0); ++k) out.push_back(s.tool_at(times.at(k)));
  return array_from(out);
}

void bind_simulated(py::module_& m) {
  py::class_<SimulatedStreams> cls(m, "SimulatedStreams",
                                   "Streams of a simulated arm, with their truth. Every stream is sorted by arrival.");
  cls.def_property_readonly(
      "recorded", [](const SimulatedStreams& s) { return RecordedStreams{s.imu, s.tracker, s.flange, s.plan}; },
      "What a recording would hold.");
  cls.def_property_readonly("imu", &imu_columns, "t, gyro, accel, arrival: arguments of `RecordedStreams.set_imu`.");
  cls.def_property_readonly("tracker", &tracker_columns, "t, position, orientation (w x y z), arrival.");
  cls.def_property_readonly("joints", &joints_columns, "t, joints (n, driven joints), arrival.");
  cls.def_property_readonly(
      "flange", [](const SimulatedStreams& s) { return frame_columns(s.flange, "T_base_flange"); },
      "t, T_base_flange, arrival: forward kinematics of the joints.");
  cls.def_property_readonly(
      "plan", [](const SimulatedStreams& s) { return frame_columns(s.plan, "T_base_tool"); },
      "t, T_base_tool, arrival.");
  cls.def_property_readonly(
      "modes", [](const SimulatedStreams& s) { return tuple_of(s.modes); }, "As they were drawn.");
  cls.def_readonly("setup", &SimulatedStreams::setup, "True frames, clock offset at t = 0.");
  cls.def("tool_at", &tools_at, py::arg("t"),
          "shape=(n, 4, 4): the true tool in the base frame. t: shape=(n,) [s], the inertial sensor's clock.");
  cls.def("__repr__", [](const SimulatedStreams& s) {
    return "SimulatedStreams(" + std::to_string(s.imu.size()) + " inertial samples)";
  });
}

}  // namespace

void bind_simulation(py::module_& m) {
  bind_mode(m);
  define_options<ImuErrors>(m, "ImuErrors");
  define_options<TrackerErrors>(m, "TrackerErrors");
  define_options<StreamSimulationOptions>(m, "StreamSimulationOptions");
  bind_simulated(m);
  m.def("large_boom", &large_boom,
        "A concrete pump's or crane's arm in its plane: slew, luff, elbow and a levelled tip, 12 m of reach.");
  m.def(
      "large_boom_modes", [] { return tuple_of(large_boom_modes()); },
      "Four modes from 0.6 to 6 Hz: lateral, vertical, lateral, vertical.");
  m.def(
      "simulate_streams",
      [](const Robot& given_robot, const std::optional<StreamSimulationOptions>& given) {
        const Robot robot = given_robot;
        const StreamSimulationOptions options = given.value_or(StreamSimulationOptions{});
        const py::gil_scoped_release unlocked;
        return simulate_streams(robot, options);
      },
      py::arg("robot"), py::arg("options") = py::none(),
      "Streams of an arm that sways, with known truth; shares no equation with the filter. Raises InputError on "
      "options that make no sense.");
}

}  // namespace truing::python
