// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <pybind11/functional.h>

#include "convert/options.hpp"
#include "convert/samples.hpp"
#include "convert/tracking.hpp"
#include "parts.hpp"
#include "tables/tracking/replay.hpp"

namespace truing::python {

namespace {

template <class Sample>
void sort_by_arrival(std::vector<Sample>& samples) {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.arrival < b.arrival; });
}

void bind_recording(py::module_& m) {
  py::class_<RecordedStreams> cls(m, "RecordedStreams",
                                  "A recording: samples of all devices, each with its stamp and its arrival. Build it "
                                  "with `streams` or by `set_...`.");
  cls.def(py::init<>());
  cls.def(
      "set_imu",
      [](RecordedStreams& self, const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel,
         const std::optional<ArrayLike>& arrival) {
        self.imu = imu_samples(t, gyro, accel, arrival);
        sort_by_arrival(self.imu);
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"), py::arg("arrival") = py::none(),
      "t, arrival: shape=(n,) [s]. gyro, accel: shape=(n, 3) [rad/s], [m/s^2]. arrival None: at once.");
  cls.def(
      "set_tracker",
      [](RecordedStreams& self, const ArrayLike& t, const ArrayLike& position,
         const std::optional<ArrayLike>& orientation, const std::optional<ArrayLike>& arrival) {
        self.tracker = pose_samples(t, position, orientation, arrival);
        sort_by_arrival(self.tracker);
      },
      py::arg("t"), py::arg("position"), py::arg("orientation") = py::none(), py::arg("arrival") = py::none(),
      "position: shape=(n, 3) [m]. orientation: shape=(n, 4) w x y z, or None.");
  cls.def(
      "set_flange",
      [](RecordedStreams& self, const ArrayLike& t, const FrameArray& T_base_flange,
         const std::optional<ArrayLike>& arrival) {
        self.flange = frame_samples(t, T_base_flange, arrival, "T_base_flange");
        sort_by_arrival(self.flange);
      },
      py::arg("t"), py::arg("T_base_flange"), py::arg("arrival") = py::none(),
      "T_base_flange: shape=(n, 4, 4), forward kinematics of the encoders.");
  cls.def(
      "set_plan",
      [](RecordedStreams& self, const ArrayLike& t, const FrameArray& T_base_tool,
         const std::optional<ArrayLike>& arrival) {
        self.plan = frame_samples(t, T_base_tool, arrival, "T_base_tool");
        sort_by_arrival(self.plan);
      },
      py::arg("t"), py::arg("T_base_tool"), py::arg("arrival") = py::none(), "T_base_tool: shape=(n, 4, 4), planned.");
  cls.def_property_readonly(
      "counts",
      [](const RecordedStreams& s) {
        return std::map<std::string, std::size_t>{
            {"imu", s.imu.size()}, {"tracker", s.tracker.size()}, {"joints", s.flange.size()}, {"plan", s.plan.size()}};
      },
      "Samples by stream.");
  cls.def("__repr__", [](const RecordedStreams& s) {
    return "RecordedStreams(" + std::to_string(s.imu.size()) + " inertial, " + std::to_string(s.tracker.size()) +
           " tracker, " + std::to_string(s.flange.size()) + " joints, " + std::to_string(s.plan.size()) + " plan)";
  });
}

// ---- Results

/// A row for each row of the plan.
Columns compensation_columns(const ReplayResult& r) {
  py::dict out;
  const auto& rows = r.rows;
  out["made"] = column<bool>(rows, [](const auto& x) { return x.made; });
  out["t"] = column(rows, [](const auto& x) { return x.t; });
  out["made_at"] = column(rows, [](const auto& x) { return x.compensation.predicted.made; });
  out["T_base_tool"] = frame_column(rows, [](const auto& x) { return x.compensation.predicted.T_base_tool; });
  out["T_base_tool_planned"] = frame_column(rows, [](const auto& x) { return x.compensation.T_base_tool_planned; });
  out["T_base_flange"] = frame_column(rows, [](const auto& x) { return x.compensation.T_base_flange; });
  out["correction"] = columns(rows, 6, [](const auto& x) -> const auto& { return x.compensation.correction; });
  out["wanted"] = columns(rows, 6, [](const auto& x) -> const auto& { return x.compensation.wanted; });
  out["covariance"] = columns(rows, 36, [](const auto& x) {
    return Eigen::Matrix<double, 36, 1>(x.compensation.predicted.covariance.reshaped());
  });
  out["limited"] = column<bool>(rows, [](const auto& x) { return x.compensation.limited; });
  out["status"] = tuple_column(rows, [](const auto& x) { return x.compensation.predicted.status; });
  out["predictor"] = tuple_column(rows, [](const auto& x) { return x.compensation.predicted.predictor; });
  return Columns(sealed(out));
}

/// A row for each prediction that the tracker has graded.
Columns graded_columns(const ReplayResult& r) {
  py::dict out;
  const auto& rows = r.graded;
  out["t"] = column(rows, [](const auto& x) { return x.t; });
  out["made_at"] = column(rows, [](const auto& x) { return x.made; });
  out["horizon"] = column(rows, [](const auto& x) { return x.horizon; });
  out["dimensions"] = column(rows, [](const auto& x) { return static_cast<double>(x.dimensions); });
  out["position"] = columns(rows, 3, [](const auto& x) -> const auto& { return x.position; });
  out["rotation"] = columns(rows, 3, [](const auto& x) -> const auto& { return x.rotation; });
  out["position_sigma"] = columns(rows, 3, [](const auto& x) -> const auto& { return x.position_sigma; });
  out["squares"] = column(rows, [](const auto& x) { return x.squares; });
  for (std::size_t k = 0; k < kBaselines; ++k)
    out[name(static_cast<Baseline>(k))] = column(rows, [k](const auto& x) { return x.baselines[k]; });
  out["status"] = tuple_column(rows, [](const auto& x) { return x.status; });
  out["predictor"] = tuple_column(rows, [](const auto& x) { return x.predictor; });
  return Columns(sealed(out));
}

/// A row for every tenth of a second.
Columns timeline_columns(const ReplayResult& r) {
  py::dict out;
  const auto& rows = r.timeline;
  out["t"] = column(rows, [](const auto& x) { return x.t; });
  out["offset"] = column(rows, [](const auto& x) { return x.clock.offset; });
  out["sigma"] = column(rows, [](const auto& x) { return x.clock.sigma; });
  out["drift"] = column(rows, [](const auto& x) { return x.clock.drift; });
  out["frequencies"] = columns(rows, ModalModel::kMost, [](const auto& x) -> const auto& { return x.frequencies; });
  out["status"] = tuple_column(rows, [](const auto& x) { return x.status; });
  out["predictor"] = tuple_column(rows, [](const auto& x) { return x.predictor; });
  return Columns(sealed(out));
}

void bind_result(py::module_& m) {
  define_result<CompensationRow>(m, "CompensationRow");

  auto cls =
      define_result<ReplayResult>(m, "ReplayResult", {"graded", "innovations", "timeline", "counters", "stopped"});
  cls.def_property_readonly(
      "compensation", &compensation_columns,
      "The same as columns: made (bool), t, made_at [s], T_base_tool, T_base_tool_planned, T_base_flange (n, 4, 4), "
      "correction, wanted (n, 6), covariance (n, 36), limited, status, predictor.");
  cls.def_property_readonly(
      "graded", &graded_columns,
      "Predictions against the tracker's later samples, measured minus predicted receiver in the base frame: t, "
      "made_at, horizon [s], dimensions (0: lost), position (n, 3) [m], "
      "rotation (n, 3) [rad], position_sigma (n, 3) [m], squares, the errors [m] of hold, velocity, fk, fk_velocity "
      "(infinite: not to be had), status, predictor.");
  cls.def_property_readonly(
      "timeline", &timeline_columns,
      "Every tenth of a second: t, offset, sigma [s], drift [s/s] of the tracker's clock, frequencies (n, 4) [Hz], "
      "status, predictor.");
  cls.def_property_readonly(
      "innovations", [](const ReplayResult& r) { return innovation_columns(r.innovations); },
      "Tracker samples against the filter: t [s], nis, dimensions, accepted.");
  cls.def_property_readonly(
      "counters", [](const ReplayResult& r) { return counts_of(r.counters); }, "Samples by stream and outcome.");
  cls.def("__repr__", [](const ReplayResult& r) {
    return "ReplayResult(" + std::to_string(r.rows.size()) + " rows of the plan, " + std::to_string(r.graded.size()) +
           " graded predictions)";
  });
}

}  // namespace

void bind_replay(py::module_& m) {
  bind_recording(m);
  bind_result(m);
  m.def(
      "replay",
      [](const RecordedStreams& streams, const TrackSetup& setup, const std::optional<TrackOptions>& track,
         const std::vector<double>& horizons, double learn_modes,
         const std::optional<std::function<bool(double)>>& progress) {
        ReplayOptions options;
        if (track) options.track = *track;
        options.horizons = horizons;
        options.learn_modes = learn_modes;
        const RecordedStreams copy = streams;
        const TrackSetup where = setup;
        const auto told = [&](double share) {
          const py::gil_scoped_acquire locked;
          if (PyErr_CheckSignals() != 0) throw py::error_already_set();
          return !progress || (*progress)(share);
        };
        const py::gil_scoped_release unlocked;
        return replay(copy, where, options, told);
      },
      py::arg("streams"), py::arg("setup"), py::arg("options") = py::none(), py::kw_only(),
      py::arg("horizons") = ReplayOptions{}.horizons, py::arg("learn_modes") = 0.0, py::arg("progress") = py::none(),
      R"(Plays a recording as it would have gone on the day: nothing is used before it arrived.

horizons: [s] at which predictions are graded against the tracker's later samples.
    Compensations are made `options.deviation.horizon` ahead.
learn_modes: [s] modes are identified from the recording's start of this length and used from then on; 0: never.
progress: called with the fraction that is done; it returns False to stop. Ctrl-C stops as well.

Raises InputError.)");
}

}  // namespace truing::python
