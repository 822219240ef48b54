// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/model/urdf.hpp"

#include "parts.hpp"

namespace truing::python {

void bind_urdf(py::module_& m) {
  m.def("robot_from_urdf", &robot_from_urdf, py::arg("urdf_text"), py::arg("base_link") = "", py::arg("tip_link") = "",
        R"(The chain from `base_link` to `tip_link` of a URDF text, as a robot of convention 'urdf'.

Fixed joints are folded into the next moving joint, the last ones into the tool; masses and inertias of links are
merged the same way, also of what moves off the chain (fingers), as it stands at zero; `mimic` becomes `driven_by`, `<dynamics>` the torque effects coulomb and viscous. Empty link names: the only root, the only leaf.
Raises InputError: not a URDF, unknown base or tip (lists the links there are), tip not below base, planar or
floating joint.)");
  m.def("links_off_chain", &links_off_chain, py::arg("urdf_text"), py::arg("base_link") = "", py::arg("tip_link") = "",
        R"(Links that the chain carries and that move by joints of their own, as a gripper's fingers do.

Their masses are merged into the link that carries them, as they stand at zero. Raises InputError as robot_from_urdf.)");
  m.def("last_moving_link", &last_moving_link, py::arg("urdf_text"), py::arg("base_link") = "",
        R"(The last moving link of the only chain below `base_link` of a URDF text, whatever is fixed to it.

Raises InputError: not a URDF, unknown base, nothing moves, several chains move.)");
  m.def("urdf_with_calibration", &urdf_with_calibration, py::arg("urdf_text"), py::arg("calibrated"),
        py::arg("base_link") = "", py::arg("tip_link") = "",
        R"(The URDF text with the joint origins of the chain replaced by those of `calibrated`.

What URDF cannot hold (gear ratios, base frame, effects) is named in a comment at the top. Raises InputError.)");
}

}  // namespace truing::python
