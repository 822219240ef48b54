// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
/// Streams of samples from columns: t shape (n,), the others (n, 3) or (n, 4). Without arrivals, arrived at once.
#pragma once

#include "convert/columns.hpp"
#include "truing/tracking/streams.hpp"

namespace truing::python {

std::vector<ImuSample> imu_samples(const ArrayLike& t, const ArrayLike& gyro, const ArrayLike& accel,
                                   const std::optional<ArrayLike>& arrival);
std::vector<PoseSample> pose_samples(const ArrayLike& t, const ArrayLike& position,
                                     const std::optional<ArrayLike>& orientation,
                                     const std::optional<ArrayLike>& arrival);
std::vector<FrameSample> frame_samples(const ArrayLike& t, const FrameArray& T, const std::optional<ArrayLike>& arrival,
                                       const char* name);

Eigen::Vector3d vector_at(const Array& array, py::ssize_t row);

}  // namespace truing::python
