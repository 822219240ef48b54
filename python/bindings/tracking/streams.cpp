// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/tracking/streams.hpp"

#include "convert/options.hpp"
#include "convert/samples.hpp"
#include "parts.hpp"
#include "tables/tracking/streams.hpp"
#include "truing/model/robot.hpp"

namespace truing::python {

namespace {

/// The frame after the last link in the robot base, at every row of joint readings.
py::array_t<double> flange_poses(const Robot& robot, const ArrayLike& joints) {
  const Array q = rows_from(joints, py::len(joints), static_cast<py::ssize_t>(robot.driven_count()), "joints");
  std::vector<Eigen::Isometry3d> frames;
  const Eigen::Isometry3d T_base_measurement = robot.T_measurement_base.inverse();
  for (py::ssize_t k = 0; k < q.shape(0); ++k)
    frames.push_back(T_base_measurement *
                     forward_kinematics(
                         robot, Eigen::Map<const Eigen::VectorXd>(q.data(k, 0), q.shape(1)))[robot.joints.size() - 1]);
  return array_from(frames);
}

}  // namespace

void bind_streams(py::module_& m) {
  define_options<TrackSetup>(m, "TrackSetup");
  m.def(
      "flange_poses", &flange_poses, py::arg("robot"), py::arg("joints"),
      "shape=(n, 4, 4): the frame after the last link in the robot base. joints: shape=(n, driven joints) [rad | m].");
}

}  // namespace truing::python
