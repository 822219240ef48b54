// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/tracking/tracker.hpp"

#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/samples.hpp"
#include "convert/text.hpp"
#include "convert/tracking.hpp"
#include "parts.hpp"
#include "tables/tracking/tracker.hpp"

namespace truing::python {

Counts counts_of(const Counters& counters) {
  Counts out;
  const auto add = [&](const char* stream, const std::array<std::uint64_t, 11>& numbers) {
    out[stream];
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      if (numbers[k] > 0) out[stream][name(static_cast<Outcome>(k))] = numbers[k];
    }
  };
  add("imu", counters.imu);
  add("pose", counters.pose);
  add("joints", counters.joints);
  add("plan", counters.plan);
  out["pose"]["outlier"] = counters.outliers;
  out["pose"]["reacquired"] = counters.reacquired;
  return out;
}

py::dict sealed(py::dict columns) {
  for (const auto& [name, values] : columns)
    if (py::isinstance<py::array>(values)) values.attr("flags").attr("writeable") = false;
  return columns;
}

NumberColumns innovation_columns(const std::vector<Innovation>& items) {
  py::dict out;
  out["t"] = column(items, [](const Innovation& i) { return i.t; });
  out["nis"] = column(items, [](const Innovation& i) { return i.nis; });
  out["dimensions"] = column(items, [](const Innovation& i) { return static_cast<double>(i.dimensions); });
  out["accepted"] = column(items, [](const Innovation& i) { return i.accepted ? 1.0 : 0.0; });
  return NumberColumns(sealed(out));
}

namespace {

// ---- Modes

/// The first `count` of a model's numbers.
py::array_t<double> of_modes(const ModalModel& model, const std::array<double, ModalModel::kMost>& values) {
  return read_only(py::array_t<double>(model.count, values.data()));
}

ModalModel make_modes(const std::vector<double>& frequency, const std::vector<double>& damping,
                      const std::optional<Array>& gain, const std::optional<std::vector<double>>& sigma) {
  ModalModel out;
  if (frequency.size() > ModalModel::kMost || damping.size() != frequency.size() ||
      (sigma && sigma->size() != frequency.size()))
    throw std::invalid_argument("ModalModel: expected at most 4 frequencies, and a damping (and sigma) for each");
  const auto n = static_cast<py::ssize_t>(frequency.size());
  if (gain && (gain->ndim() != 3 || gain->shape(0) != n || gain->shape(1) != 6 || gain->shape(2) != 3))
    throw std::invalid_argument("ModalModel: gain must have shape (n, 6, 3)");
  out.count = static_cast<int>(n);
  std::copy(frequency.begin(), frequency.end(), out.frequency.begin());
  std::copy(damping.begin(), damping.end(), out.damping.begin());
  if (sigma) std::copy(sigma->begin(), sigma->end(), out.frequency_sigma.begin());
  for (py::ssize_t k = 0; gain && k < n; ++k)
    out.gain[static_cast<std::size_t>(k)] =
        Eigen::Map<const Eigen::Matrix<double, 6, 3, Eigen::RowMajor>>(gain->data(k, 0, 0));
  return out;
}

py::array_t<double> gains_of(const ModalModel& s) {
  py::array_t<double> out({s.count, 6, 3});
  for (int k = 0; k < s.count; ++k)
    Eigen::Map<Eigen::Matrix<double, 6, 3, Eigen::RowMajor>>{out.mutable_data(k, 0, 0)} =
        s.gain[static_cast<std::size_t>(k)];
  return read_only(std::move(out));
}

void bind_modes(py::module_& m) {
  py::class_<ModalModel> cls(m, "ModalModel",
                             R"(Sway as damped modes of each component of the deviation from the plan.

x'' + 2 zeta omega x' + omega^2 x = gain a_plan + noise.

frequency: shape=(n,) [Hz], n at most 4. damping: shape=(n,) ratio.
gain: shape=(n, 6, 3) [-], [rad/m]; None: 0. frequency_sigma: shape=(n,) [Hz] standard error; None: 0.)");
  cls.def(py::init(&make_modes), py::arg("frequency") = std::vector<double>{},
          py::arg("damping") = std::vector<double>{}, py::arg("gain") = py::none(),
          py::arg("frequency_sigma") = py::none());
  cls.def_property_readonly("count", [](const ModalModel& s) { return s.count; }, "Number of modes.");
  cls.def_property_readonly(
      "frequency", [](const ModalModel& s) { return of_modes(s, s.frequency); }, "shape=(n,) [Hz], undamped.");
  cls.def_property_readonly(
      "damping", [](const ModalModel& s) { return of_modes(s, s.damping); }, "shape=(n,) ratios.");
  cls.def_property_readonly(
      "frequency_sigma", [](const ModalModel& s) { return of_modes(s, s.frequency_sigma); },
      "shape=(n,) [Hz] standard errors.");
  cls.def_property_readonly(
      "gain", &gains_of,
      "shape=(n, 6, 3): per planned acceleration in the frame of the planned inertial sensor; translation [-], "
      "rotation [rad/m].");
  cls.def("__repr__", [](const ModalModel& s) {
    std::vector<std::string> words;
    for (int k = 0; k < s.count; ++k) words.push_back(text(s.frequency[static_cast<std::size_t>(k)]) + " Hz");
    return "ModalModel(" + joined(words) + ")";
  });
  define_value(cls, {"frequency", "damping", "gain", "frequency_sigma"});
}

std::vector<DeviationRow> deviation_rows(const ArrayLike& t, const ArrayLike& deviation, const ArrayLike& rate,
                                         const ArrayLike& plan_acceleration) {
  const Array times = vector_from(t, "t");
  const py::ssize_t n = times.shape(0);
  const Array d = rows_from(deviation, n, 6, "deviation"), v = rows_from(rate, n, 6, "rate"),
              a = rows_from(plan_acceleration, n, 3, "plan_acceleration");
  std::vector<DeviationRow> rows(static_cast<std::size_t>(n));
  for (py::ssize_t k = 0; k < n; ++k) {
    DeviationRow& row = rows[static_cast<std::size_t>(k)];
    row.t = times.at(k);
    row.deviation = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(d.data(k, 0));
    row.rate = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(v.data(k, 0));
    row.plan_acceleration = vector_at(a, k);
  }
  return rows;
}

void bind_identify_modes(py::module_& m) {
  auto result = define_result<ModesResult>(m, "ModesResult", {"error"});
  result.def_property_readonly(
      "error", [](const ModesResult& r) { return tuple_of(r.error); },
      "[m] rms of predictions twice the horizon ahead: of no change, with one mode, with two ...");
  result.def("__repr__", [](const ModesResult& r) {
    return "ModesResult(" + std::to_string(r.model.count) + " modes: " + r.stopped_because + ")";
  });

  m.def(
      "identify_modes",
      [](const ArrayLike& t, const ArrayLike& deviation, const ArrayLike& rate, const ArrayLike& plan_acceleration,
         const std::optional<DeviationOptions>& given, int most, double worth) {
        const std::vector<DeviationRow> rows = deviation_rows(t, deviation, rate, plan_acceleration);
        const DeviationOptions options = given.value_or(DeviationOptions{});
        const py::gil_scoped_release unlocked;
        return identify_modes(rows, options, most, worth);
      },
      py::arg("t"), py::arg("deviation"), py::arg("rate"), py::arg("plan_acceleration"),
      py::arg("options") = py::none(), py::arg("most") = int{ModalModel::kMost}, py::arg("worth") = 0.03,
      R"(Frequencies, damping and gains of the sway from what `Tracker.take_rows` gave over a recording.

t: shape=(n,) [s], `options.period` apart. deviation, rate: shape=(n, 6) [m, rad], [m/s, rad/s].
plan_acceleration: shape=(n, 3) [m/s^2].
most: maximum number of modes; another is taken while it lowers the error of predictions by at least the fraction
`worth`.

Raises InputError on fewer than 500 rows.)");
}

// ---- Options

void bind_options(py::module_& m) {
  define_options<FilterOptions>(m, "FilterOptions");
  define_options<DeviationOptions>(m, "DeviationOptions");
  define_options<WatchOptions>(m, "WatchOptions");
  define_options<CorrectionLimits>(m, "CorrectionLimits");
  define_options<TrackOptions>(m, "TrackOptions");
}

// ---- Answers

void bind_answers(py::module_& m) {
  auto prediction = define_result<PosePrediction>(m, "PosePrediction");
  prediction.def("__repr__", [](const PosePrediction& p) {
    return std::string("PosePrediction(t=") + text(p.t) + ", made " + text(p.t - p.made) + " s before, " +
           word(p.status) + ", by " + word(p.predictor) + ")";
  });

  auto compensation = define_result<Compensation>(m, "Compensation");
  compensation.def("__repr__", [](const Compensation& c) {
    return std::string("Compensation(") + word(c.predicted.status) + (c.limited ? ", limited" : "") + ")";
  });

  auto clock = define_result<ClockEstimate>(m, "ClockEstimate");
  clock.def("__repr__", [](const ClockEstimate& c) {
    return "ClockEstimate(" + text(c.offset) + " s, sigma " + text(c.sigma) + " s)";
  });

  auto noise = define_result<TrackerNoise>(m, "TrackerNoise");
  noise.def("__repr__", [](const TrackerNoise& n) {
    return "TrackerNoise(" + text(n.position) + " m, " + text(n.rotation) + " rad)";
  });

  auto shift = define_result<Shift>(m, "Shift");
  shift.def("__repr__", [](const Shift& s) {
    return s.count == 0 ? std::string("Shift(none)")
                        : std::string("Shift(at ") + text(s.t) + " s: " + word(s.cause) + ")";
  });
}

/// The settled rows, as columns.
NumberColumns rows_taken(Tracker& tracker) {
  std::vector<DeviationRow> rows;
  DeviationRow buffer[64];
  for (int n; (n = tracker.take_rows(buffer, 64)) > 0;) rows.insert(rows.end(), buffer, buffer + n);
  py::dict out;
  out["t"] = column(rows, [](const DeviationRow& r) { return r.t; });
  out["deviation"] = columns(rows, 6, [](const DeviationRow& r) -> const auto& { return r.deviation; });
  out["rate"] = columns(rows, 6, [](const DeviationRow& r) -> const auto& { return r.rate; });
  out["plan_acceleration"] = columns(rows, 3, [](const DeviationRow& r) -> const auto& { return r.plan_acceleration; });
  return NumberColumns(sealed(out));
}

// ---- Tracker

using TrackerClass = py::class_<Tracker>;

/// Samples in.
void bind_pushing(TrackerClass& cls) {
  cls.def(
      "push_imu",
      [](Tracker& self, double t, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
        return self.push_imu({t, t, gyro, accel});
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"),
      "t: [s]. gyro: shape=(3,) [rad/s]. accel: shape=(3,) [m/s^2], specific force, +9.81 upward at rest; both in the "
      "sensor frame.");
  cls.def(
      "push_pose",
      [](Tracker& self, double t, const Eigen::Vector3d& position, const std::optional<Eigen::Vector4d>& orientation) {
        PoseSample sample;
        sample.t = t, sample.position = position;
        if (orientation)
          sample.orientation =
              Eigen::Quaterniond((*orientation)[0], (*orientation)[1], (*orientation)[2], (*orientation)[3]);
        return self.push_pose(sample);
      },
      py::arg("t"), py::arg("position"), py::arg("orientation") = py::none(),
      "t: [s] the tracker's stamp. position: shape=(3,) [m], orientation: shape=(4,) w x y z, the receiver in the "
      "tracker frame; None: the tracker gives none.");
  cls.def("push_joints", &Tracker::push_joints, py::arg("t"), py::arg("T_base_flange"),
          "t: [s] the controller's stamp. T_base_flange: shape=(4, 4), forward kinematics of the encoders.");
  cls.def("push_plan", &Tracker::push_plan, py::arg("t"), py::arg("T_base_tool"),
          "t: [s] the controller's clock, ahead of its time and in order. T_base_tool: shape=(4, 4), planned.");
  cls.def(
      "push_imu_rows",
      [](Tracker& self, const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel) {
        const std::vector<ImuSample> samples = imu_samples(t, gyro, accel, std::nullopt);
        return tuple_column(samples, [&](const ImuSample& sample) { return self.push_imu(sample); });
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"),
      "Many at once: shape=(n,), (n, 3), (n, 3). What became of each.");
  cls.def(
      "push_pose_rows",
      [](Tracker& self, const ArrayLike& t, const ArrayLike& position, const std::optional<ArrayLike>& orientation) {
        const std::vector<PoseSample> samples = pose_samples(t, position, orientation, std::nullopt);
        return tuple_column(samples, [&](const PoseSample& sample) { return self.push_pose(sample); });
      },
      py::arg("t"), py::arg("position"), py::arg("orientation") = py::none(),
      "Many at once: shape=(n,), (n, 3), (n, 4).");
}

/// Answers out.
void bind_asking(TrackerClass& cls) {
  cls.def("predict", &Tracker::predict, py::arg("t"),
          "The tool at a time of the inertial sensor's clock, past (within the window), now or to come. t: [s].");
  cls.def("compensate", &Tracker::compensate, py::arg("t"),
          "Prediction, and the correction that it asks for, within limits; to be called at growing times. t: [s].");
  cls.def("set_modes", &Tracker::set_modes, py::arg("modes"), "Raises InputError.");
  cls.def_property_readonly("now", &Tracker::now, "[s] stamp of the newest inertial sample.");
  cls.def_property_readonly(
      "clock", [](Tracker& self) { return self.clock(); }, "The tracker's clock as it is now estimated.");
  cls.def_property_readonly(
      "noise", [](Tracker& self) { return self.noise(); }, "Noise of the sensors as the filter has found it.");
  cls.def_property_readonly(
      "frequencies", [](const Tracker& self) { return TupleOf<double>(py::cast(self.frequencies())); },
      "[Hz] of the modes, as tracked; 0 beyond them.");
  cls.def_property_readonly(
      "shift", [](Tracker& self) { return self.shift(); },
      "The last jump of the tracker. After one the filter follows the tracker: calibrate anew.");
  cls.def_property_readonly(
      "counters", [](const Tracker& self) { return counts_of(self.counters()); }, "Samples by stream and outcome.");
  cls.def("take_rows", &rows_taken,
          "Settled rows since the last call, for `identify_modes`: its arguments by name. Call often: few are kept.");
  cls.def(
      "take_innovations",
      [](Tracker& self) {
        std::vector<Innovation> items;
        Innovation buffer[64];
        for (int n; (n = self.take_innovations(buffer, 64)) > 0;) items.insert(items.end(), buffer, buffer + n);
        return innovation_columns(items);
      },
      "Settled tracker samples against what was expected of them, since the last call: t [s], nis, dimensions, "
      "accepted (1 or 0).");
}

}  // namespace

void bind_tracker(py::module_& m) {
  bind_modes(m);
  bind_options(m);
  bind_identify_modes(m);
  bind_answers(m);

  TrackerClass cls(m, "Tracker",
                   R"(Fusion and prediction, sample by sample.

Samples may come late, twice, or out of order within the window: the result is the same. Stamps are of each device's
own clock; the answers' times are of the inertial sensor's. Refused samples change nothing. Not for two threads at
once.)");
  cls.def(py::init([](const TrackSetup& setup, const std::optional<TrackOptions>& options) {
            return Tracker(setup, options.value_or(TrackOptions{}));
          }),
          py::arg("setup"), py::arg("options") = py::none(), "Raises InputError on options that make no sense.");
  bind_pushing(cls);
  bind_asking(cls);
}

}  // namespace truing::python
