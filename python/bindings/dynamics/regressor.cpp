// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/regressor.hpp"

#include "convert/columns.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

const char* const kShape = "(n, driven joints)";

py::array_t<double> regressor_of(const Robot& given_robot, const ArrayLike& given_q, const ArrayLike& given_qd,
                                 const ArrayLike& given_qdd) {
  const Eigen::MatrixXd q = matrix_from(given_q, "q", kShape), qd = matrix_from(given_qd, "qd", kShape),
                        qdd = matrix_from(given_qdd, "qdd", kShape);
  const Robot robot = given_robot;
  RowMajor Y;
  {
    const py::gil_scoped_release unlocked;
    Y = dynamics::torque_regressor(robot, q, qd, qdd);
  }
  return py::array_t<double>({q.rows(), q.cols(), Y.cols()}, Y.data());
}

}  // namespace

void bind_torque_regressor(py::module_& m) {
  m.def(
      "link_parameters", [](const Robot& robot) { return dynamics::link_parameters(robot); }, py::arg("robot"),
      R"(Inertial parameters of all links, one after the other, shape=(10 * joints,).

Of a link: mass, mass times centre of mass (x, y, z), inertia about the origin of the frame after the link (xx, yy, zz,
xy, xz, yz) [kg, kg m, kg m^2]; what is not known is zero.)");
  m.def("torque_regressor", &regressor_of, py::arg("robot"), py::arg("q"), py::arg("qd"), py::arg("qdd"),
        R"(Y of tau = Y pi, shape=(n, driven joints, 10 * joints): torques against inertia and gravity, linear in
`link_parameters`.

q, qd, qdd: shape=(n, driven joints), readings, their speeds and accelerations [rad | m, s]. Rotors are no part of it.
Raises InputError: a robot that cannot be used, another shape, values that are not finite.)");
}

}  // namespace truing::python
