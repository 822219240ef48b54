// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <variant>

#include <pybind11/functional.h>

#include "casters.hpp"
#include "truing/tracking/replay.hpp"
#include "truing/tracking/simulation.hpp"
#include "truing/tracking/tracker.hpp"

namespace truing::python {

template <>
struct Words<Outcome> {
  static constexpr const char* what = "outcome";
  static constexpr std::array<const char*, 11> list{
      "accepted", "accepted_gap", "accepted_saturated", "accepted_restart", "duplicate", "backwards",
      "future",   "too_late",     "not_finite",         "not_unit",         "frozen"};
  static constexpr auto type = py::detail::const_name(
      "typing.Literal['accepted', 'accepted_gap', 'accepted_saturated', 'accepted_restart', 'duplicate', 'backwards', "
      "'future', 'too_late', 'not_finite', 'not_unit', 'frozen']");
};

template <>
struct Words<Status> {
  static constexpr const char* what = "status";
  static constexpr std::array<const char*, 4> list{"valid", "coasting", "hold", "lost"};
  static constexpr auto type = py::detail::const_name("typing.Literal['valid', 'coasting', 'hold', 'lost']");
};

template <>
struct Words<Predictor> {
  static constexpr const char* what = "predictor";
  static constexpr std::array<const char*, 3> list{"slow", "acceleration", "modes"};
  static constexpr auto type = py::detail::const_name("typing.Literal['slow', 'acceleration', 'modes']");
};

template <>
struct Words<ShiftCause> {
  static constexpr const char* what = "cause";
  static constexpr std::array<const char*, 3> list{"station_or_receiver", "station", "receiver"};
  static constexpr auto type = py::detail::const_name("typing.Literal['station_or_receiver', 'station', 'receiver']");
};

template <>
struct Words<SimulatedMotion> {
  static constexpr const char* what = "motion";
  static constexpr std::array<const char*, 3> list{"still", "gentle", "stop-and-go"};
  static constexpr auto type = py::detail::const_name("typing.Literal['still', 'gentle', 'stop-and-go']");
};

}  // namespace truing::python

namespace pybind11::detail {

template <>
struct type_caster<truing::Outcome> : word_caster<truing::Outcome> {};
template <>
struct type_caster<truing::Status> : word_caster<truing::Status> {};
template <>
struct type_caster<truing::Predictor> : word_caster<truing::Predictor> {};
template <>
struct type_caster<truing::ShiftCause> : word_caster<truing::ShiftCause> {};
template <>
struct type_caster<truing::SimulatedMotion> : word_caster<truing::SimulatedMotion> {};

}  // namespace pybind11::detail

namespace truing::python {

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Eigen::Isometry3d;
using Eigen::Vector3d;

// ---- Options that are numbers

template <class T>
struct Field {
  const char* name;
  std::variant<double T::*, int T::*> member;
  const char* doc;
};

/// Attributes, a constructor that takes them as keywords, `replace`, `copy`, pickling.
template <class T>
void bind_fields(py::module_& m, const char* name, const char* doc, const std::vector<Field<T>>& fields) {
  py::class_<T> cls(m, name, doc);
  std::vector<const char*> names;
  for (const Field<T>& field : fields) {
    std::visit([&](auto member) { cls.def_readwrite(field.name, member, field.doc); }, field.member);
    names.push_back(field.name);
  }
  cls.def(py::init([fields, name](const py::KWArgs<py::typing::Union<double, int>>& given) {
    T out;
    for (const auto& [key, value] : given) {
      const std::string word = py::str(key);
      const auto field = std::find_if(fields.begin(), fields.end(), [&](const Field<T>& f) { return word == f.name; });
      if (field == fields.end()) {
        std::vector<std::string> known;
        for (const Field<T>& f : fields) known.emplace_back(f.name);
        throw py::type_error(std::string(name) + " has no '" + word + "'; choose from " + joined(known));
      }
      const py::object item = py::reinterpret_borrow<py::object>(value);
      std::visit([&](auto member) { out.*member = item.cast<std::decay_t<decltype(out.*member)>>(); }, field->member);
    }
    return out;
  }));
  cls.def("__repr__", [fields, name](const T& self) {
    std::vector<std::string> words;
    for (const Field<T>& f : fields)
      words.push_back(std::string(f.name) + "=" +
                      std::visit([&](auto member) { return text(static_cast<double>(self.*member)); }, f.member));
    return std::string(name) + "(" + joined(words) + ")";
  });
  define_value(cls, names);
}

void bind_numbers(py::module_& m) {
  bind_fields<FilterOptions>(
      m, "FilterOptions", "What the filter takes for granted: noise, gaps, gates. Keywords are the attributes.",
      {
          {"window", &FilterOptions::window, "measurements up to so late are put at their place [s]"},
          {"future_limit", &FilterOptions::future_limit, "of a stamp against the newest inertial sample [s]"},
          {"highest_imu_rate", &FilterOptions::highest_imu_rate, "sizes the ring buffer [Hz]"},
          {"highest_pose_rate", &FilterOptions::highest_pose_rate, "[Hz]"},
          {"gyro_noise", &FilterOptions::gyro_noise, "[rad/s/sqrt(Hz)]"},
          {"accel_noise", &FilterOptions::accel_noise, "[m/s^2/sqrt(Hz)]"},
          {"gyro_bias", &FilterOptions::gyro_bias, "standard deviation before any data [rad/s]"},
          {"accel_bias", &FilterOptions::accel_bias, "[m/s^2]"},
          {"gyro_bias_walk", &FilterOptions::gyro_bias_walk, "[rad/s/sqrt(s)]"},
          {"accel_bias_walk", &FilterOptions::accel_bias_walk, "[m/s^2/sqrt(s)]"},
          {"imu_scale", &FilterOptions::imu_scale,
           "standard deviation of the scale of gyro and accelerometer, as a share"},
          {"gyro_range", &FilterOptions::gyro_range, "a component at or beyond is saturated [rad/s]"},
          {"accel_range", &FilterOptions::accel_range, "[m/s^2]"},
          {"largest_gap", &FilterOptions::largest_gap, "between inertial samples, before uncertainty is widened [s]"},
          {"restart_gap", &FilterOptions::restart_gap, "[s]"},
          {"gap_acceleration", &FilterOptions::gap_acceleration,
           "standard deviation of what a gap or saturation hides [m/s^2]"},
          {"gap_rate", &FilterOptions::gap_rate, "[rad/s]"},
          {"position_sigma", &FilterOptions::position_sigma, "of the tracker, one component [m]"},
          {"rotation_sigma", &FilterOptions::rotation_sigma, "[rad]"},
          {"gate", &FilterOptions::gate, "tracker samples with a larger normalised innovation squared are outliers"},
          {"reacquire_after", &FilterOptions::reacquire_after, "outliers in a row, then the tracker is believed"},
          {"frozen_after", &FilterOptions::frozen_after, "equal tracker samples in a row, then they are refused"},
          {"clock_walk", &FilterOptions::clock_walk, "of the tracker's clock [s/sqrt(s)]"},
          {"clock_drift", &FilterOptions::clock_drift, "standard deviation of its drift [s/s]"},
          {"clock_drift_walk", &FilterOptions::clock_drift_walk, "[1/sqrt(s)]"},
          {"sway_position", &FilterOptions::sway_position,
           "standard deviation of the tip about its slow mean, before any data; then as the arm shows it [m]"},
          {"sway_rotation", &FilterOptions::sway_rotation, "[rad]"},
          {"sway_correlation", &FilterOptions::sway_correlation, "time over which sway is like itself [s]"},
          {"slow_position", &FilterOptions::slow_position,
           "standard deviation of the deviation from forward kinematics before any data [m]"},
          {"slow_rotation", &FilterOptions::slow_rotation, "[rad]"},
          {"slow_position_walk", &FilterOptions::slow_position_walk, "how it wanders [m/sqrt(s)]"},
          {"slow_rotation_walk", &FilterOptions::slow_rotation_walk, "[rad/sqrt(s)]"},
      });
  bind_fields<DeviationOptions>(
      m, "DeviationOptions", "How the deviation from the plan is modelled. Keywords are the attributes.",
      {
          {"period", &DeviationOptions::period, "of the model's steps, on multiples of it [s]"},
          {"horizon", &DeviationOptions::horizon, "for which predictions are graded [s]"},
          {"position_noise", &DeviationOptions::position_noise,
           "of the filter's position, as the model sees it [m], rotations as 1 m"},
          {"velocity_noise", &DeviationOptions::velocity_noise, "[m/s]"},
          {"slow_noise", &DeviationOptions::slow_noise, "acceleration that drives the slow part [m/s^2/sqrt(Hz)]"},
          {"static_time", &DeviationOptions::static_time, "over which the static deviation is averaged [s]"},
          {"mode_noise", &DeviationOptions::mode_noise,
           "acceleration that drives a mode beside the plan's [m/s^2/sqrt(Hz)]"},
          {"frequency_sigma", &DeviationOptions::frequency_sigma,
           "standard deviation of the given frequencies, as a share; 0: they stay"},
          {"frequency_walk", &DeviationOptions::frequency_walk, "how they wander, as a share [1/sqrt(s)]"},
          {"frequency_range", &DeviationOptions::frequency_range, "and how far at most, as a share"},
          {"grade_time", &DeviationOptions::grade_time, "over which grades are averaged [s]"},
          {"settle_time", &DeviationOptions::settle_time,
           "after so long no more late samples are waited for, and a prediction is graded [s]"},
          {"least_evidence", &DeviationOptions::least_evidence,
           "predictions of modes are used after so long of grades [s]"},
          {"plan_limit", &DeviationOptions::plan_limit, "plan samples further ahead are refused [s]"},
      });
  bind_fields<WatchOptions>(
      m, "WatchOptions", "Watching for jumps of the tracker. Keywords are the attributes.",
      {
          {"threshold", &WatchOptions::threshold,
           "of averages that are chi-square distributed with six degrees of freedom"},
          {"forget", &WatchOptions::forget, "after a gap of the tracker longer than this, averages begin anew [s]"},
          {"compare", &WatchOptions::compare, "after a shift, station and receiver are told apart for so long [s]"},
      });
  bind_fields<CorrectionLimits>(m, "CorrectionLimits",
                                "Bounds of what is sent to the arm. Keywords are the attributes.",
                                {
                                    {"position", &CorrectionLimits::position, "size [m]"},
                                    {"rotation", &CorrectionLimits::rotation, "[rad]"},
                                    {"position_rate", &CorrectionLimits::position_rate, "[m/s]"},
                                    {"rotation_rate", &CorrectionLimits::rotation_rate, "[rad/s]"},
                                    {"position_jerk", &CorrectionLimits::position_jerk, "[m/s^3]"},
                                    {"rotation_jerk", &CorrectionLimits::rotation_jerk, "[rad/s^3]"},
                                });
  bind_fields<ImuErrors>(m, "ImuErrors", "Errors of a simulated inertial sensor. Keywords are the attributes.",
                         {
                             {"gyro_noise", &ImuErrors::gyro_noise, "[rad/s/sqrt(Hz)]"},
                             {"accel_noise", &ImuErrors::accel_noise, "[m/s^2/sqrt(Hz)]"},
                             {"gyro_bias", &ImuErrors::gyro_bias, "standard deviation at the start [rad/s]"},
                             {"accel_bias", &ImuErrors::accel_bias, "[m/s^2]"},
                             {"gyro_bias_walk", &ImuErrors::gyro_bias_walk, "[rad/s/sqrt(s)]"},
                             {"accel_bias_walk", &ImuErrors::accel_bias_walk, "[m/s^2/sqrt(s)]"},
                             {"gyro_scale", &ImuErrors::gyro_scale, "standard deviation of each axis' scale error"},
                             {"accel_scale", &ImuErrors::accel_scale, ""},
                         });
  bind_fields<TrackerErrors>(
      m, "TrackerErrors", "Errors of a simulated tracker, and of its way to the computer. Keywords are the attributes.",
      {
          {"position_noise", &TrackerErrors::position_noise, "of one component [m]"},
          {"rotation_noise", &TrackerErrors::rotation_noise, "of one component [rad]"},
          {"latency", &TrackerErrors::latency, "[s]"},
          {"latency_jitter", &TrackerErrors::latency_jitter,
           "standard deviation, never before the sample was taken [s]"},
          {"clock_offset", &TrackerErrors::clock_offset, "t_tracker = t_imu * (1 + clock_drift) + clock_offset [s]"},
          {"clock_drift", &TrackerErrors::clock_drift, "[s/s]"},
          {"out_of_order", &TrackerErrors::out_of_order, "share of the samples that take 25 ms more"},
          {"lost", &TrackerErrors::lost, "share of single samples that never arrive"},
      });
}

// ---- Arrays of samples

py::ssize_t rows_of(const Array& array, const char* name) {
  if (!array || array.ndim() != 1) {
    PyErr_Clear();
    throw std::invalid_argument(std::string(name) + " must have shape (n,)");
  }
  return array.shape(0);
}

/// `given` as rows of `columns` numbers; as many as there are in `rows`.
Array block_of(const ArrayLike& given, py::ssize_t rows, py::ssize_t columns, const char* name) {
  const Array array = Array::ensure(given);
  if (!array || array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != columns) {
    PyErr_Clear();
    throw std::invalid_argument(std::string(name) + " must have shape (" + std::to_string(rows) + ", " +
                                std::to_string(columns) + "): a row for each entry of t");
  }
  return array;
}

Vector3d vector_at(const Array& array, py::ssize_t row) { return Eigen::Map<const Vector3d>(array.data(row, 0)); }

}  // namespace

std::vector<ImuSample> imu_samples(const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel,
                                   const std::optional<ArrayLike>& arrival) {
  const Array times = Array::ensure(t);
  const py::ssize_t rows = rows_of(times, "t");
  const Array g = block_of(gyro, rows, 3, "gyro"), a = block_of(accel, rows, 3, "accel");
  const Array arrived = arrival ? Array::ensure(*arrival) : times;
  if (rows_of(arrived, "arrival") != rows) throw std::invalid_argument("arrival must be as long as t");
  std::vector<ImuSample> out(static_cast<std::size_t>(rows));
  for (py::ssize_t k = 0; k < rows; ++k)
    out[static_cast<std::size_t>(k)] = {times.at(k), arrived.at(k), vector_at(g, k), vector_at(a, k)};
  return out;
}

std::vector<PoseSample> pose_samples(const ArrayLike& t, const ArrayLike& position,
                                     const std::optional<ArrayLike>& orientation,
                                     const std::optional<ArrayLike>& arrival) {
  const Array times = Array::ensure(t);
  const py::ssize_t rows = rows_of(times, "t");
  const Array p = block_of(position, rows, 3, "position");
  const Array q = orientation ? block_of(*orientation, rows, 4, "orientation") : Array();
  const Array arrived = arrival ? Array::ensure(*arrival) : times;
  if (rows_of(arrived, "arrival") != rows) throw std::invalid_argument("arrival must be as long as t");
  std::vector<PoseSample> out(static_cast<std::size_t>(rows));
  for (py::ssize_t k = 0; k < rows; ++k) {
    PoseSample& sample = out[static_cast<std::size_t>(k)];
    sample.t = times.at(k), sample.arrival = arrived.at(k), sample.position = vector_at(p, k);
    if (orientation) sample.orientation = Eigen::Quaterniond(q.at(k, 0), q.at(k, 1), q.at(k, 2), q.at(k, 3));
  }
  return out;
}

std::vector<FrameSample> frame_samples(const ArrayLike& t, const FrameArray& T, const std::optional<ArrayLike>& arrival,
                                       const char* name) {
  const Array times = Array::ensure(t);
  const py::ssize_t rows = rows_of(times, "t");
  const std::vector<Isometry3d> frames = frames_from(T, name);
  if (frames.size() != static_cast<std::size_t>(rows))
    throw std::invalid_argument(std::string(name) + " must be as long as t");
  const Array arrived = arrival ? Array::ensure(*arrival) : times;
  if (rows_of(arrived, "arrival") != rows) throw std::invalid_argument("arrival must be as long as t");
  std::vector<FrameSample> out;
  for (py::ssize_t k = 0; k < rows; ++k)
    out.push_back({times.at(k), arrived.at(k), frames[static_cast<std::size_t>(k)]});
  return out;
}

namespace {

template <class Sample>
void sort_by_arrival(std::vector<Sample>& samples) {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.arrival < b.arrival; });
}

// ---- Columns of results

template <class Items, class Get>
py::array_t<double> column(const Items& items, Get get) {
  py::array_t<double> out(static_cast<py::ssize_t>(items.size()));
  double* at = out.mutable_data();
  for (const auto& item : items) *at++ = get(item);
  return read_only(std::move(out));
}

template <int N, class Items, class Get>
py::array_t<double> columns(const Items& items, Get get) {
  py::array_t<double> out({static_cast<py::ssize_t>(items.size()), static_cast<py::ssize_t>(N)});
  double* at = out.mutable_data();
  for (const auto& item : items) {
    const auto& row = get(item);
    for (int k = 0; k < N; ++k) *at++ = row[static_cast<decltype(k)>(k)];
  }
  return read_only(std::move(out));
}

template <class Items, class Get>
py::array_t<bool> flags(const Items& items, Get get) {
  py::array_t<bool> out(static_cast<py::ssize_t>(items.size()));
  bool* at = out.mutable_data();
  for (const auto& item : items) *at++ = get(item);
  return out;
}

template <class Items, class Get>
py::array_t<double> frame_column(const Items& items, Get get) {
  std::vector<Isometry3d> frames;
  frames.reserve(items.size());
  for (const auto& item : items) frames.push_back(get(item));
  return array_from(frames);
}

template <class Items, class Get>
auto words_of(const Items& items, Get get) {
  std::vector<std::decay_t<decltype(get(items.front()))>> out;
  out.reserve(items.size());
  for (const auto& item : items) out.push_back(get(item));
  return tuple_of(out);
}

using Counts = std::map<std::string, std::map<std::string, std::uint64_t>>;

/// Samples by stream and outcome; outcomes that never came are left out.
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

// ---- Set-up, options, modes

void bind_setup(py::module_& m) {
  const TrackSetup usual;
  py::class_<TrackSetup> cls(
      m, "TrackSetup", R"(Where things are, and how clocks differ. `T_a_b` maps b-coordinates into a, shape=(4, 4).

t_imu = t_tracker - clock_offset = t_controller - controller_clock_offset; joints are where the plan was `actuator_lag` ago.)");
  cls.def(
      py::init([](const Isometry3d& T_tracker_base, const Isometry3d& T_flange_receiver,
                  const Isometry3d& T_flange_tool, const Isometry3d& T_flange_imu, const Vector3d& gravity,
                  double clock_offset, double clock_offset_sigma, double controller_clock_offset, double actuator_lag) {
        return TrackSetup{T_tracker_base, T_flange_receiver,  T_flange_tool,           T_flange_imu, gravity,
                          clock_offset,   clock_offset_sigma, controller_clock_offset, actuator_lag};
      }),
      py::kw_only(), py::arg("T_tracker_base") = usual.T_tracker_base,
      py::arg("T_flange_receiver") = usual.T_flange_receiver, py::arg("T_flange_tool") = usual.T_flange_tool,
      py::arg("T_flange_imu") = usual.T_flange_imu, py::arg("gravity") = usual.gravity,
      py::arg("clock_offset") = usual.clock_offset, py::arg("clock_offset_sigma") = usual.clock_offset_sigma,
      py::arg("controller_clock_offset") = usual.controller_clock_offset, py::arg("actuator_lag") = usual.actuator_lag);
  cls.def_readwrite("T_tracker_base", &TrackSetup::T_tracker_base, "shape=(4, 4)");
  cls.def_readwrite("T_flange_receiver", &TrackSetup::T_flange_receiver, "shape=(4, 4)");
  cls.def_readwrite("T_flange_tool", &TrackSetup::T_flange_tool, "shape=(4, 4)");
  cls.def_readwrite("T_flange_imu", &TrackSetup::T_flange_imu, "shape=(4, 4)");
  cls.def_readwrite("gravity", &TrackSetup::gravity, "shape=(3,) [m/s^2] in the base frame.");
  cls.def_readwrite("clock_offset", &TrackSetup::clock_offset, "[s] t_imu = t_tracker - clock_offset");
  cls.def_readwrite("clock_offset_sigma", &TrackSetup::clock_offset_sigma,
                    "[s] its standard error; 0: known, and not estimated.");
  cls.def_readwrite("controller_clock_offset", &TrackSetup::controller_clock_offset,
                    "[s] t_imu = t_controller - controller_clock_offset");
  cls.def_readwrite("actuator_lag", &TrackSetup::actuator_lag, "[s] joints are where the plan was so long ago.");
  cls.def("__repr__", [](const TrackSetup& s) {
    return "TrackSetup(clock_offset=" + text(s.clock_offset) + ", actuator_lag=" + text(s.actuator_lag) + ", ...)";
  });
  define_value(cls, {"T_tracker_base", "T_flange_receiver", "T_flange_tool", "T_flange_imu", "gravity", "clock_offset",
                     "clock_offset_sigma", "controller_clock_offset", "actuator_lag"});
}

/// The first `count` of a model's numbers.
py::array_t<double> of_modes(const ModalModel& model, const std::array<double, ModalModel::kMost>& values) {
  return read_only(py::array_t<double>(model.count, values.data()));
}

void bind_modes(py::module_& m) {
  py::class_<ModalModel> cls(
      m, "ModalModel",
      R"(Sway as damped modes, x'' + 2 zeta omega x' + omega^2 x = gain a_plan + noise, for each component of the deviation from the plan.

frequency: shape=(n,) [Hz], n at most 4. damping: shape=(n,) ratio. gain: shape=(n, 6, 3) [-], [rad/m]; None: 0. frequency_sigma: shape=(n,) [Hz] standard error; None: 0.)");
  cls.def(
      py::init([](const std::vector<double>& frequency, const std::vector<double>& damping,
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
      }),
      py::arg("frequency") = std::vector<double>{}, py::arg("damping") = std::vector<double>{},
      py::arg("gain") = py::none(), py::arg("frequency_sigma") = py::none());
  cls.def_property_readonly("count", [](const ModalModel& s) { return s.count; }, "Number of modes.");
  cls.def_property_readonly(
      "frequency", [](const ModalModel& s) { return of_modes(s, s.frequency); }, "shape=(n,) [Hz], undamped.");
  cls.def_property_readonly(
      "damping", [](const ModalModel& s) { return of_modes(s, s.damping); }, "shape=(n,) ratios.");
  cls.def_property_readonly(
      "frequency_sigma", [](const ModalModel& s) { return of_modes(s, s.frequency_sigma); },
      "shape=(n,) [Hz] standard errors.");
  cls.def_property_readonly(
      "gain",
      [](const ModalModel& s) {
        py::array_t<double> out({s.count, 6, 3});
        for (int k = 0; k < s.count; ++k)
          Eigen::Map<Eigen::Matrix<double, 6, 3, Eigen::RowMajor>>{out.mutable_data(k, 0, 0)} =
              s.gain[static_cast<std::size_t>(k)];
        return read_only(std::move(out));
      },
      "shape=(n, 6, 3): per planned acceleration in the frame of the planned inertial sensor; translation [-], "
      "rotation [rad/m].");
  cls.def("__repr__", [](const ModalModel& s) {
    std::vector<std::string> words;
    for (int k = 0; k < s.count; ++k) words.push_back(text(s.frequency[static_cast<std::size_t>(k)]) + " Hz");
    return "ModalModel(" + joined(words) + ")";
  });
  define_value(cls, {"frequency", "damping", "gain", "frequency_sigma"});

  py::class_<ModesResult> result(m, "ModesResult", "What `identify_modes` found.");
  result.def_readonly("model", &ModesResult::model, "The modes.");
  result.def_property_readonly(
      "error", [](const ModesResult& r) { return tuple_of(r.error); },
      "[m] rms of predictions twice the horizon ahead: of no change, with one mode, two ...");
  result.def_readonly("rows", &ModesResult::rows, "Number of rows used.");
  result.def_readonly("stopped_because", &ModesResult::stopped_because, "Why there are no more modes.");
  result.def("__repr__", [](const ModesResult& r) {
    return "ModesResult(" + std::to_string(r.model.count) + " modes: " + r.stopped_because + ")";
  });

  m.def(
      "identify_modes",
      [](const ArrayLike& t, const ArrayLike& deviation, const ArrayLike& rate, const ArrayLike& plan_acceleration,
         const std::optional<DeviationOptions>& given, int most, double worth) {
        const Array times = Array::ensure(t);
        const py::ssize_t n = rows_of(times, "t");
        const Array d = block_of(deviation, n, 6, "deviation"), v = block_of(rate, n, 6, "rate"),
                    a = block_of(plan_acceleration, n, 3, "plan_acceleration");
        std::vector<DeviationRow> rows(static_cast<std::size_t>(n));
        for (py::ssize_t k = 0; k < n; ++k) {
          DeviationRow& row = rows[static_cast<std::size_t>(k)];
          row.t = times.at(k);
          row.deviation = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(d.data(k, 0));
          row.rate = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(v.data(k, 0));
          row.plan_acceleration = vector_at(a, k);
        }
        const DeviationOptions options = given.value_or(DeviationOptions{});
        const py::gil_scoped_release unlocked;
        return identify_modes(rows, options, most, worth);
      },
      py::arg("t"), py::arg("deviation"), py::arg("rate"), py::arg("plan_acceleration"),
      py::arg("options") = py::none(), py::arg("most") = int{ModalModel::kMost}, py::arg("worth") = 0.03,
      R"(Frequencies, damping and gains of the sway from what `Tracker.take_rows` gave over a recording.

t: shape=(n,) [s], `options.period` apart. deviation, rate: shape=(n, 6) [m, rad], [m/s, rad/s]. plan_acceleration: shape=(n, 3) [m/s^2].
most: at most so many modes; another is taken while it lowers the error of predictions by at least the share `worth`.

Raises InputError on fewer than 500 rows.)");
}

void bind_options(py::module_& m) {
  const TrackOptions usual;
  py::class_<TrackOptions> cls(m, "TrackOptions", "How `Tracker` works.");
  cls.def(py::init([](const FilterOptions& filter, const DeviationOptions& deviation, const WatchOptions& watch,
                      const ModalModel& modes, const CorrectionLimits& limits, double coast_position,
                      double coast_rotation, double imu_timeout, double joints_timeout) {
            TrackOptions o;
            o.filter = filter;
            o.deviation = deviation;
            o.watch = watch;
            o.modes = modes;
            o.limits = limits;
            o.coast_position = coast_position;
            o.coast_rotation = coast_rotation;
            o.imu_timeout = imu_timeout;
            o.joints_timeout = joints_timeout;
            return o;
          }),
          py::kw_only(), py::arg_v("filter", usual.filter, "FilterOptions()"),
          py::arg_v("deviation", usual.deviation, "DeviationOptions()"),
          py::arg_v("watch", usual.watch, "WatchOptions()"), py::arg_v("modes", usual.modes, "ModalModel()"),
          py::arg_v("limits", usual.limits, "CorrectionLimits()"), py::arg("coast_position") = usual.coast_position,
          py::arg("coast_rotation") = usual.coast_rotation, py::arg("imu_timeout") = usual.imu_timeout,
          py::arg("joints_timeout") = usual.joints_timeout);
  cls.def_readwrite("filter", &TrackOptions::filter, "Noise, gaps, gates.");
  cls.def_readwrite("deviation", &TrackOptions::deviation, "The model of the deviation from the plan.");
  cls.def_readwrite("watch", &TrackOptions::watch, "Watching for jumps of the tracker.");
  cls.def_readwrite("modes", &TrackOptions::modes, "Of `identify_modes`; none: predictions at constant acceleration.");
  cls.def_readwrite("limits", &TrackOptions::limits, "Bounds of corrections.");
  cls.def_readwrite("coast_position", &TrackOptions::coast_position,
                    "[m] without the tracker, estimates with a larger standard deviation are not used.");
  cls.def_readwrite("coast_rotation", &TrackOptions::coast_rotation, "[rad]");
  cls.def_readwrite("imu_timeout", &TrackOptions::imu_timeout,
                    "[s] the inertial sensor is taken for dead when it is so much older than the joints.");
  cls.def_readwrite("joints_timeout", &TrackOptions::joints_timeout, "[s]");
  cls.def("__repr__", [](const TrackOptions& o) {
    return "TrackOptions(horizon " + text(o.deviation.horizon) + " s, " + std::to_string(o.modes.count) + " modes)";
  });
  define_value(cls, {"filter", "deviation", "watch", "modes", "limits", "coast_position", "coast_rotation",
                     "imu_timeout", "joints_timeout"});
}

// ---- Tracker

void bind_answers(py::module_& m) {
  py::class_<PosePrediction> prediction(m, "PosePrediction",
                                        "The tool at time `t`, as known at time `made`; the inertial sensor's clock.");
  prediction.def_readonly("t", &PosePrediction::t, "[s]");
  prediction.def_readonly("made", &PosePrediction::made, "[s]");
  prediction.def_readonly("T_base_tool", &PosePrediction::T_base_tool, "shape=(4, 4)");
  prediction.def_readonly("covariance", &PosePrediction::covariance,
                          "shape=(6, 6), of position [m] and rotation vector [rad] about the base frame's axes.");
  prediction.def_readonly(
      "status", &PosePrediction::status,
      "'valid', 'coasting' (the tracker is away), 'hold' (forward kinematics and the last static deviation), 'lost'.");
  prediction.def_readonly("predictor", &PosePrediction::predictor,
                          "What it was made by: 'slow', 'acceleration', 'modes'.");
  prediction.def("__repr__", [](const PosePrediction& p) {
    return std::string("PosePrediction(t=") + text(p.t) + ", made " + text(p.t - p.made) + " s before, " +
           word(p.status) + ", by " + word(p.predictor) + ")";
  });

  py::class_<Compensation> compensation(m, "Compensation",
                                        "What to add to the plan so that the tool is where it was planned.");
  compensation.def_readonly("predicted", &Compensation::predicted, "The prediction behind it.");
  compensation.def_readonly("has_plan", &Compensation::has_plan,
                            "False: the plan does not reach that far, and nothing is corrected.");
  compensation.def_readonly("T_base_tool_planned", &Compensation::T_base_tool_planned, "shape=(4, 4)");
  compensation.def_readonly("wanted", &Compensation::wanted,
                            "shape=(6,) [m], rotation vector [rad]: the correction in the base frame.");
  compensation.def_readonly("correction", &Compensation::correction, "shape=(6,): the same within the limits.");
  compensation.def_readonly("limited", &Compensation::limited, "The two differ by more than 1 mm or 1 mrad.");
  compensation.def_readonly("T_base_flange", &Compensation::T_base_flange, "shape=(4, 4): corrected.");
  compensation.def("__repr__", [](const Compensation& c) {
    return std::string("Compensation(") + word(c.predicted.status) + (c.limited ? ", limited" : "") + ")";
  });

  py::class_<ClockEstimate> clock(m, "ClockEstimate", "The tracker's clock: t_imu = t_tracker - offset.");
  clock.def_readonly("offset", &ClockEstimate::offset, "[s]");
  clock.def_readonly("sigma", &ClockEstimate::sigma, "[s]");
  clock.def_readonly("drift", &ClockEstimate::drift, "[s/s]");
  clock.def("__repr__", [](const ClockEstimate& c) {
    return "ClockEstimate(" + text(c.offset) + " s, sigma " + text(c.sigma) + " s)";
  });

  py::class_<Shift> shift(m, "Shift", "The last jump of the tracker that was noticed.");
  shift.def_readonly("count", &Shift::count, "Since the start; 0: none, and the rest means nothing.");
  shift.def_readonly("t", &Shift::t, "[s] when it happened, the inertial sensor's clock.");
  shift.def_readonly("flagged", &Shift::flagged, "[s] stamp of the tracker sample that it was noticed by.");
  shift.def_readonly("jump", &Shift::jump,
                     "shape=(6,) [m], rotation vector [rad]: of the receiver as measured, base frame.");
  shift.def_readonly(
      "cause", &Shift::cause,
      "'station' (constant in the tracker frame), 'receiver' (constant on the flange), or not told apart (yet).");
  shift.def_readonly("odds", &Shift::odds, "Logarithm of the odds of station against receiver.");
  shift.def("__repr__", [](const Shift& s) {
    return s.count == 0 ? std::string("Shift(none)")
                        : std::string("Shift(at ") + text(s.t) + " s: " + word(s.cause) + ")";
  });
}

/// The tables of take_rows and take_innovations, and outcomes of many samples.
py::typing::Dict<std::string, py::array_t<double>> rows_taken(Tracker& tracker) {
  std::vector<DeviationRow> rows;
  DeviationRow buffer[64];
  for (int n; (n = tracker.take_rows(buffer, 64)) > 0;) rows.insert(rows.end(), buffer, buffer + n);
  py::dict out;
  out["t"] = column(rows, [](const DeviationRow& r) { return r.t; });
  out["deviation"] = columns<6>(rows, [](const DeviationRow& r) -> const auto& { return r.deviation; });
  out["rate"] = columns<6>(rows, [](const DeviationRow& r) -> const auto& { return r.rate; });
  out["plan_acceleration"] = columns<3>(rows, [](const DeviationRow& r) -> const auto& { return r.plan_acceleration; });
  return py::typing::Dict<std::string, py::array_t<double>>(out);
}

py::typing::Dict<std::string, py::array_t<double>> innovation_columns(const std::vector<Innovation>& items) {
  py::dict out;
  out["t"] = column(items, [](const Innovation& i) { return i.t; });
  out["nis"] = column(items, [](const Innovation& i) { return i.nis; });
  out["dimensions"] = column(items, [](const Innovation& i) { return static_cast<double>(i.dimensions); });
  out["accepted"] = column(items, [](const Innovation& i) { return i.accepted ? 1.0 : 0.0; });
  return py::typing::Dict<std::string, py::array_t<double>>(out);
}

void bind_tracker(py::module_& m) {
  py::class_<Tracker> cls(
      m, "Tracker",
      R"(Fusion and prediction, sample by sample. Samples may come late, twice, or out of order within the window: the result is the same.

Stamps are of each device's own clock; the answers' times are of the inertial sensor's. Refused samples change nothing. Not for two threads at once.)");
  cls.def(py::init([](const TrackSetup& setup, const std::optional<TrackOptions>& options) {
            return Tracker(setup, options.value_or(TrackOptions{}));
          }),
          py::arg("setup"), py::arg("options") = py::none(), "Raises InputError on options that make no sense.");
  cls.def(
      "push_imu",
      [](Tracker& self, double t, const Vector3d& gyro, const Vector3d& accel) {
        return self.push_imu({t, t, gyro, accel});
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"),
      "t: [s]. gyro: shape=(3,) [rad/s]. accel: shape=(3,) [m/s^2], specific force, +9.81 upward at rest; both in the "
      "sensor frame.");
  cls.def(
      "push_pose",
      [](Tracker& self, double t, const Vector3d& position, const std::optional<Eigen::Vector4d>& orientation) {
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
        return words_of(samples, [&](const ImuSample& sample) { return self.push_imu(sample); });
      },
      py::arg("t"), py::arg("gyro"), py::arg("accel"),
      "Many at once: shape=(n,), (n, 3), (n, 3). What became of each.");
  cls.def(
      "push_pose_rows",
      [](Tracker& self, const ArrayLike& t, const ArrayLike& position, const std::optional<ArrayLike>& orientation) {
        const std::vector<PoseSample> samples = pose_samples(t, position, orientation, std::nullopt);
        return words_of(samples, [&](const PoseSample& sample) { return self.push_pose(sample); });
      },
      py::arg("t"), py::arg("position"), py::arg("orientation") = py::none(),
      "Many at once: shape=(n,), (n, 3), (n, 4).");
  cls.def("predict", &Tracker::predict, py::arg("t"),
          "The tool at a time of the inertial sensor's clock, past (within the window), now or to come. t: [s].");
  cls.def("compensate", &Tracker::compensate, py::arg("t"),
          "Prediction, and the correction that it asks for, within limits; to be called at growing times. t: [s].");
  cls.def("set_modes", &Tracker::set_modes, py::arg("modes"), "Raises InputError.");
  cls.def_property_readonly("now", &Tracker::now, "[s] stamp of the newest inertial sample.");
  cls.def_property_readonly(
      "clock", [](Tracker& self) { return self.clock(); }, "The tracker's clock as it is now estimated.");
  cls.def_property_readonly(
      "frequencies",
      [](const Tracker& self) { return py::typing::Tuple<double, py::ellipsis>(py::cast(self.frequencies())); },
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

// ---- Streams and replay

void bind_streams(py::module_& m) {
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

  m.def(
      "flange_poses",
      [](const Robot& robot, const ArrayLike& joints) {
        const Array q = block_of(joints, py::len(joints), static_cast<py::ssize_t>(robot.driven_count()), "joints");
        std::vector<Isometry3d> frames;
        const Isometry3d T_base_measurement = robot.T_measurement_base.inverse();
        for (py::ssize_t k = 0; k < q.shape(0); ++k)
          frames.push_back(T_base_measurement *
                           forward_kinematics(robot, Eigen::Map<const Eigen::VectorXd>(
                                                         q.data(k, 0), q.shape(1)))[robot.joints.size() - 1]);
        return array_from(frames);
      },
      py::arg("robot"), py::arg("joints"),
      "shape=(n, 4, 4): the frame after the last link in the robot base. joints: shape=(n, driven joints) [rad | m].");
}

void bind_replay(py::module_& m) {
  py::class_<CompensationRow> row(m, "CompensationRow", "A row of the plan: what to add there.");
  row.def_readonly("made", &CompensationRow::made, "False: the streams do not reach there.");
  row.def_readonly("t", &CompensationRow::t, "[s] when the tool is to be there, the inertial sensor's clock.");
  row.def_readonly("compensation", &CompensationRow::compensation);

  using Result = ReplayResult;
  py::class_<Result> cls(m, "ReplayResult", "What a replay gave. Times are of the inertial sensor's clock.");
  cls.def_property_readonly("rows", [](const Result& r) { return tuple_of(r.rows); }, "One for each row of the plan.");
  cls.def_property_readonly(
      "compensation",
      [](const Result& r) {
        py::dict out;
        const auto& rows = r.rows;
        out["made"] = flags(rows, [](const auto& x) { return x.made; });
        out["t"] = column(rows, [](const auto& x) { return x.t; });
        out["made_at"] = column(rows, [](const auto& x) { return x.compensation.predicted.made; });
        out["T_base_tool"] = frame_column(rows, [](const auto& x) { return x.compensation.predicted.T_base_tool; });
        out["T_base_tool_planned"] =
            frame_column(rows, [](const auto& x) { return x.compensation.T_base_tool_planned; });
        out["T_base_flange"] = frame_column(rows, [](const auto& x) { return x.compensation.T_base_flange; });
        out["correction"] = columns<6>(rows, [](const auto& x) -> const auto& { return x.compensation.correction; });
        out["wanted"] = columns<6>(rows, [](const auto& x) -> const auto& { return x.compensation.wanted; });
        out["covariance"] = columns<36>(rows, [](const auto& x) {
          return Eigen::Matrix<double, 36, 1>(x.compensation.predicted.covariance.reshaped());
        });
        out["limited"] = flags(rows, [](const auto& x) { return x.compensation.limited; });
        out["status"] = words_of(rows, [](const auto& x) { return x.compensation.predicted.status; });
        out["predictor"] = words_of(rows, [](const auto& x) { return x.compensation.predicted.predictor; });
        return py::typing::Dict<std::string, py::object>(out);
      },
      "The same as columns: made (bool), t, made_at [s], T_base_tool, T_base_tool_planned, T_base_flange (n, 4, 4), "
      "correction, wanted (n, 6), covariance (n, 36), limited, status, predictor.");
  cls.def_property_readonly(
      "graded",
      [](const Result& r) {
        py::dict out;
        const auto& rows = r.graded;
        out["t"] = column(rows, [](const auto& x) { return x.t; });
        out["made_at"] = column(rows, [](const auto& x) { return x.made; });
        out["horizon"] = column(rows, [](const auto& x) { return x.horizon; });
        out["dimensions"] = column(rows, [](const auto& x) { return static_cast<double>(x.dimensions); });
        out["position"] = columns<3>(rows, [](const auto& x) -> const auto& { return x.position; });
        out["rotation"] = columns<3>(rows, [](const auto& x) -> const auto& { return x.rotation; });
        out["position_sigma"] = columns<3>(rows, [](const auto& x) -> const auto& { return x.position_sigma; });
        out["squares"] = column(rows, [](const auto& x) { return x.squares; });
        for (std::size_t k = 0; k < kBaselines; ++k)
          out[name(static_cast<Baseline>(k))] = column(rows, [k](const auto& x) { return x.baselines[k]; });
        out["status"] = words_of(rows, [](const auto& x) { return x.status; });
        out["predictor"] = words_of(rows, [](const auto& x) { return x.predictor; });
        return py::typing::Dict<std::string, py::object>(out);
      },
      "Predictions against the tracker's later samples, measured minus predicted receiver in the base frame: t, "
      "made_at, horizon [s], dimensions (0: lost), position (n, 3) [m], "
      "rotation (n, 3) [rad], position_sigma (n, 3) [m], squares, the errors [m] of hold, velocity, fk, fk_velocity "
      "(infinite: not to be had), status, predictor.");
  cls.def_property_readonly(
      "timeline",
      [](const Result& r) {
        py::dict out;
        const auto& rows = r.timeline;
        out["t"] = column(rows, [](const auto& x) { return x.t; });
        out["offset"] = column(rows, [](const auto& x) { return x.clock.offset; });
        out["sigma"] = column(rows, [](const auto& x) { return x.clock.sigma; });
        out["drift"] = column(rows, [](const auto& x) { return x.clock.drift; });
        out["frequencies"] =
            columns<ModalModel::kMost>(rows, [](const auto& x) -> const auto& { return x.frequencies; });
        out["status"] = words_of(rows, [](const auto& x) { return x.status; });
        out["predictor"] = words_of(rows, [](const auto& x) { return x.predictor; });
        return py::typing::Dict<std::string, py::object>(out);
      },
      "Every tenth of a second: t, offset, sigma [s], drift [s/s] of the tracker's clock, frequencies (n, 4) [Hz], "
      "status, predictor.");
  cls.def_property_readonly(
      "innovations", [](const Result& r) { return innovation_columns(r.innovations); },
      "Tracker samples against the filter: t [s], nis, dimensions, accepted.");
  cls.def_property_readonly("shifts", [](const Result& r) { return tuple_of(r.shifts); }, "Jumps of the tracker.");
  cls.def_readonly("modes", &Result::modes, "Identified in the replay; no modes where none were asked for.");
  cls.def_readonly("modes_from", &Result::modes_from, "[s] they are used from then on; 0: never.");
  cls.def_readonly("clock", &Result::clock, "At the end.");
  cls.def_property_readonly(
      "counters", [](const Result& r) { return counts_of(r.counters); }, "Samples by stream and outcome.");
  cls.def("__repr__", [](const Result& r) {
    return "ReplayResult(" + std::to_string(r.rows.size()) + " rows of the plan, " + std::to_string(r.graded.size()) +
           " graded predictions)";
  });

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

horizons: [s] at which predictions are graded against the tracker's later samples. Compensations are made `options.deviation.horizon` ahead.
learn_modes: [s] modes are identified from so much of the recording's start and used from then on; 0: never.
progress: called with the share that is done; it returns False to stop. Ctrl-C stops as well.

Raises InputError.)");
}

// ---- Simulation

void bind_simulation(py::module_& m) {
  py::class_<FlexibleMode> mode(m, "FlexibleMode",
                                "A flexible mode of a simulated arm; vectors in the base axes, slewed with the first "
                                "joint. See stream_simulation.hpp.");
  mode.def(py::init([](double frequency, double damping, const Vector3d& direction, const Vector3d& rotation,
                       const Vector3d& participation, double gust) {
             return FlexibleMode{frequency, damping, direction, rotation, participation, gust};
           }),
           py::kw_only(), py::arg("frequency"), py::arg("damping"), py::arg("direction"), py::arg("rotation"),
           py::arg("participation"), py::arg("gust") = 0.0);
  mode.def_readwrite("frequency", &FlexibleMode::frequency, "[Hz] undamped, at the reference reach.");
  mode.def_readwrite("damping", &FlexibleMode::damping, "Ratio.");
  mode.def_readwrite("direction", &FlexibleMode::direction, "shape=(3,): of the tip's motion, per unit of the mode.");
  mode.def_readwrite("rotation", &FlexibleMode::rotation, "shape=(3,) [rad/m]: of the tip, per unit of the mode.");
  mode.def_readwrite("participation", &FlexibleMode::participation,
                     "shape=(3,): share of the tip's acceleration that drives it.");
  mode.def_readwrite("gust", &FlexibleMode::gust, "[m] standard deviation of the sway that gusts alone would make.");
  mode.def("__repr__", [](const FlexibleMode& f) { return "FlexibleMode(" + text(f.frequency) + " Hz)"; });
  define_value(mode, {"frequency", "damping", "direction", "rotation", "participation", "gust"});

  const StreamSimulationOptions usual;
  using Options = StreamSimulationOptions;
  py::class_<Options> cls(m, "StreamSimulationOptions", "A simulated recording; see the attributes.");
  cls.def(py::init([](double seconds, SimulatedMotion motion, double tip_speed, double imu_rate, double tracker_rate,
                      double joint_rate, double plan_rate, double plan_ahead, double joint_noise, double actuator_lag,
                      const std::vector<FlexibleMode>& modes, const ImuErrors& imu, const TrackerErrors& tracker,
                      const std::vector<std::pair<double, double>>& dropouts,
                      const std::vector<std::pair<double, Isometry3d>>& shifts, const std::optional<TrackSetup>& setup,
                      std::uint64_t seed) {
            Options o;
            o.seconds = seconds, o.motion = motion, o.tip_speed = tip_speed;
            o.imu_rate = imu_rate, o.tracker_rate = tracker_rate, o.joint_rate = joint_rate, o.plan_rate = plan_rate;
            o.plan_ahead = plan_ahead, o.joint_noise = joint_noise, o.actuator_lag = actuator_lag;
            o.modes = modes;
            o.imu = imu, o.tracker = tracker;
            for (const auto& [start, length] : dropouts) o.dropouts.push_back({start, length});
            for (const auto& [start, T] : shifts) o.shifts.push_back({start, T});
            o.default_setup = !setup;
            if (setup) o.setup = *setup;
            o.seed = seed;
            return o;
          }),
          py::kw_only(), py::arg("seconds") = usual.seconds, py::arg("motion") = usual.motion,
          py::arg("tip_speed") = usual.tip_speed, py::arg("imu_rate") = usual.imu_rate,
          py::arg("tracker_rate") = usual.tracker_rate, py::arg("joint_rate") = usual.joint_rate,
          py::arg("plan_rate") = usual.plan_rate, py::arg("plan_ahead") = usual.plan_ahead,
          py::arg("joint_noise") = usual.joint_noise, py::arg("actuator_lag") = usual.actuator_lag,
          py::arg("modes") = std::vector<FlexibleMode>{}, py::arg_v("imu", usual.imu, "ImuErrors()"),
          py::arg_v("tracker", usual.tracker, "TrackerErrors()"),
          py::arg("dropouts") = std::vector<std::pair<double, double>>{},
          py::arg("shifts") = std::vector<std::pair<double, Isometry3d>>{}, py::arg("setup") = py::none(),
          py::arg("seed") = usual.seed);
  cls.def_readwrite("seconds", &Options::seconds, "[s]");
  cls.def_readwrite("motion", &Options::motion,
                    "'still', 'gentle' (slow waves of all joints) or 'stop-and-go' (jerk-limited moves with rests).");
  cls.def_readwrite("tip_speed", &Options::tip_speed, "[m/s] rms of a gentle motion, highest of stop-and-go.");
  cls.def_readwrite("imu_rate", &Options::imu_rate, "[Hz]");
  cls.def_readwrite("tracker_rate", &Options::tracker_rate, "[Hz]");
  cls.def_readwrite("joint_rate", &Options::joint_rate, "[Hz]");
  cls.def_readwrite("plan_rate", &Options::plan_rate, "[Hz]");
  cls.def_readwrite("plan_ahead", &Options::plan_ahead, "[s] a planned pose is known so long before.");
  cls.def_readwrite("joint_noise", &Options::joint_noise, "[rad | m] standard deviation of encoder readings.");
  cls.def_readwrite("actuator_lag", &Options::actuator_lag, "[s] joints follow the plan so late.");
  cls.def_property_readonly(
      "modes", [](const Options& o) { return tuple_of(o.modes); }, "Empty: those of a large boom.");
  cls.def_readwrite("imu", &Options::imu, "Errors of the inertial sensor.");
  cls.def_readwrite("tracker", &Options::tracker, "Errors of the tracker.");
  cls.def_property_readonly(
      "dropouts",
      [](const Options& o) {
        std::vector<std::pair<double, double>> out;
        for (const Dropout& d : o.dropouts) out.emplace_back(d.start, d.seconds);
        return tuple_of(out);
      },
      "Of the tracker: start and length [s].");
  cls.def_property_readonly(
      "shifts",
      [](const Options& o) {
        std::vector<std::pair<double, Isometry3d>> out;
        for (const StationShift& s : o.shifts) out.emplace_back(s.start, s.T_old_new);
        return tuple_of(out);
      },
      "From a time [s] on the tracker frame is another: T_old_new, shape=(4, 4).");
  cls.def_property_readonly(
      "setup", [](const Options& o) { return o.default_setup ? std::nullopt : std::optional<TrackSetup>(o.setup); },
      "Where the sensors truly are; None: as on a large arm.");
  cls.def_readwrite("seed", &Options::seed, "Of everything that is drawn.");
  cls.def("__repr__", [](const Options& o) {
    return "StreamSimulationOptions(" + text(o.seconds) + " s, " + word(o.motion) + ", seed " + std::to_string(o.seed) +
           ")";
  });
  define_value(cls,
               {"seconds", "motion", "tip_speed", "imu_rate", "tracker_rate", "joint_rate", "plan_rate", "plan_ahead",
                "joint_noise", "actuator_lag", "modes", "imu", "tracker", "dropouts", "shifts", "setup", "seed"});

  using Streams = SimulatedStreams;
  py::class_<Streams> streams(m, "SimulatedStreams",
                              "Streams of a simulated arm, with their truth. Every stream is sorted by arrival.");
  streams.def_property_readonly(
      "recorded", [](const Streams& s) { return RecordedStreams{s.imu, s.tracker, s.flange, s.plan}; },
      "What a recording would hold.");
  streams.def_property_readonly(
      "imu",
      [](const Streams& s) {
        py::dict out;
        out["t"] = column(s.imu, [](const auto& x) { return x.t; });
        out["gyro"] = columns<3>(s.imu, [](const auto& x) -> const auto& { return x.gyro; });
        out["accel"] = columns<3>(s.imu, [](const auto& x) -> const auto& { return x.accel; });
        out["arrival"] = column(s.imu, [](const auto& x) { return x.arrival; });
        return py::typing::Dict<std::string, py::array_t<double>>(out);
      },
      "t, gyro, accel, arrival: arguments of `RecordedStreams.set_imu`.");
  streams.def_property_readonly(
      "tracker",
      [](const Streams& s) {
        py::dict out;
        out["t"] = column(s.tracker, [](const auto& x) { return x.t; });
        out["position"] = columns<3>(s.tracker, [](const auto& x) -> const auto& { return x.position; });
        out["orientation"] = columns<4>(s.tracker, [](const auto& x) {
          return Eigen::Vector4d(x.orientation.w(), x.orientation.x(), x.orientation.y(), x.orientation.z());
        });
        out["arrival"] = column(s.tracker, [](const auto& x) { return x.arrival; });
        return py::typing::Dict<std::string, py::array_t<double>>(out);
      },
      "t, position, orientation (w x y z), arrival.");
  streams.def_property_readonly(
      "joints",
      [](const Streams& s) {
        py::dict out;
        out["t"] = column(s.joints_t, [](double x) { return x; });
        out["joints"] = py::array_t<double>(py::cast(s.joints));
        out["arrival"] = column(s.joints_arrival, [](double x) { return x; });
        return py::typing::Dict<std::string, py::array_t<double>>(out);
      },
      "t, joints (n, driven joints), arrival.");
  const auto frames = [](const std::vector<FrameSample>& samples, const char* name) {
    py::dict out;
    out["t"] = column(samples, [](const auto& x) { return x.t; });
    out[name] = frame_column(samples, [](const auto& x) { return x.T_base_frame; });
    out["arrival"] = column(samples, [](const auto& x) { return x.arrival; });
    return py::typing::Dict<std::string, py::array_t<double>>(out);
  };
  streams.def_property_readonly(
      "flange", [frames](const Streams& s) { return frames(s.flange, "T_base_flange"); },
      "t, T_base_flange, arrival: forward kinematics of the joints.");
  streams.def_property_readonly(
      "plan", [frames](const Streams& s) { return frames(s.plan, "T_base_tool"); }, "t, T_base_tool, arrival.");
  streams.def_property_readonly("modes", [](const Streams& s) { return tuple_of(s.modes); }, "As they were drawn.");
  streams.def_readonly("setup", &Streams::setup, "True frames, clock offset at t = 0.");
  streams.def(
      "tool_at",
      [](const Streams& s, const ArrayLike& t) {
        const Array times = Array::ensure(t);
        rows_of(times, "t");
        std::vector<Isometry3d> out;
        for (py::ssize_t k = 0; k < times.shape(0); ++k) out.push_back(s.tool_at(times.at(k)));
        return array_from(out);
      },
      py::arg("t"),
      "shape=(n, 4, 4): the true tool in the base frame. t: shape=(n,) [s], the inertial sensor's clock.");
  streams.def("__repr__", [](const Streams& s) {
    return "SimulatedStreams(" + std::to_string(s.imu.size()) + " inertial samples)";
  });

  m.def("large_boom", &large_boom,
        "A concrete pump's or crane's arm in its plane: slew, luff, elbow and a levelled tip, 12 m of reach.");
  m.def(
      "large_boom_modes", [] { return tuple_of(large_boom_modes()); },
      "Four modes from 0.6 to 6 Hz: lateral, vertical, lateral, vertical.");
  m.def(
      "simulate_streams",
      [](const Robot& given_robot, const std::optional<Options>& given) {
        const Robot robot = given_robot;
        const Options options = given.value_or(Options{});
        const py::gil_scoped_release unlocked;
        return simulate_streams(robot, options);
      },
      py::arg("robot"), py::arg("options") = py::none(),
      "Streams of an arm that sways, with known truth; shares no equation with the filter. Raises InputError on "
      "options that make no sense.");
}

}  // namespace

void bind_track(py::module_& m) {
  bind_numbers(m);
  bind_setup(m);
  bind_modes(m);
  bind_options(m);
  bind_answers(m);
  bind_tracker(m);
  bind_streams(m);
  bind_replay(m);
  bind_simulation(m);
}

}  // namespace truing::python
