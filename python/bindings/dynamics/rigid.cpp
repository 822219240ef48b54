// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/rigid.hpp"
#include "convert/columns.hpp"
#include "parts.hpp"

namespace truing::python {

void bind_rigid(py::module_& m) {
  m.def(
      "rigid_torques",
      [](const Robot& given, const ArrayLike& q, const ArrayLike& qd, const ArrayLike& qdd) {
        const char* const shape = "(n, driven joints)";
        const Robot robot = given;  // other Python threads may change theirs once the GIL is released
        const Eigen::MatrixXd position = matrix_from(q, "q", shape), speed = matrix_from(qd, "qd", shape),
                              acceleration = matrix_from(qdd, "qdd", shape);
        const py::gil_scoped_release unlocked;
        return RowMajor(dynamics::rigid_torques(robot, position, speed, acceleration));
      },
      py::arg("robot"), py::arg("q"), py::arg("qd"), py::arg("qdd"),
      R"(Torques that the drives must give to move the rigid chain, rotor inertias included, friction not.

What the robot does not state (mass, inertia) counts as zero; a passive joint's torque is felt by those that drive it.
q, qd, qdd: shape=(n, driven joints) [rad | m, per s, per s^2]. Returns shape=(n, driven joints) [Nm | N]. Raises
InputError: other shapes, values that are not finite.)");
}

}  // namespace truing::python
