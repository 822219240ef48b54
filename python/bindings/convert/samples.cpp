// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/samples.hpp"

namespace truing::python {

namespace {

Array arrivals_from(const std::optional<ArrayLike>& arrival, const Array& times) {
  const Array arrived = arrival ? vector_from(*arrival, "arrival") : times;
  if (arrived.shape(0) != times.shape(0)) throw std::invalid_argument("arrival must be as long as t");
  return arrived;
}

}  // namespace

Eigen::Vector3d vector_at(const Array& array, py::ssize_t row) {
  return Eigen::Map<const Eigen::Vector3d>(array.data(row, 0));
}

std::vector<ImuSample> imu_samples(const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel,
                                   const std::optional<ArrayLike>& arrival) {
  const Array times = vector_from(t, "t");
  const py::ssize_t rows = times.shape(0);
  const Array g = rows_from(gyro, rows, 3, "gyro"), a = rows_from(accel, rows, 3, "accel");
  const Array arrived = arrivals_from(arrival, times);
  std::vector<ImuSample> out(static_cast<std::size_t>(rows));
  for (py::ssize_t k = 0; k < rows; ++k)
    out[static_cast<std::size_t>(k)] = {times.at(k), arrived.at(k), vector_at(g, k), vector_at(a, k)};
  return out;
}

std::vector<PoseSample> pose_samples(const ArrayLike& t, const ArrayLike& position,
                                     const std::optional<ArrayLike>& orientation,
                                     const std::optional<ArrayLike>& arrival) {
  const Array times = vector_from(t, "t");
  const py::ssize_t rows = times.shape(0);
  const Array p = rows_from(position, rows, 3, "position");
  const Array q = orientation ? rows_from(*orientation, rows, 4, "orientation") : Array();
  const Array arrived = arrivals_from(arrival, times);
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
  const Array times = vector_from(t, "t");
  const std::vector<Eigen::Isometry3d> frames = frames_from(T, name);
  if (frames.size() != static_cast<std::size_t>(times.shape(0)))
    throw std::invalid_argument(std::string(name) + " must be as long as t");
  const Array arrived = arrivals_from(arrival, times);
  std::vector<FrameSample> out;
  for (py::ssize_t k = 0; k < times.shape(0); ++k)
    out.push_back({times.at(k), arrived.at(k), frames[static_cast<std::size_t>(k)]});
  return out;
}

}  // namespace truing::python
