// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/review.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "parts.hpp"
#include "repr.hpp"

namespace truing::python {

void bind_review(py::module_& m) {
  auto mistake = define_result<Mistake>(m, "Mistake");
  mistake.def("__repr__", [](const Mistake& found) { return "Mistake('" + found.kind + "', '" + found.text + "')"; });
  m.def(
      "review",
      [](const Robot& given_robot, const Measurements& data, const Identification& found,
         const std::optional<IdentifyOptions>& given, const std::vector<OwnEffect>& own) {
        IdentifyOptions options = given.value_or(IdentifyOptions{});
        options.own_effects = effects_from(own);
        const Robot robot = given_robot;  // other Python threads may change theirs once the GIL is released
        const py::gil_scoped_release unlocked;
        return review(robot, data, found, options);
      },
      py::arg("robot"), py::arg("data"), py::arg("found"), py::arg("options") = py::none(),
      py::arg("own_effects") = std::vector<OwnEffect>(),
      "What speaks against the robot file or the columns that `found` was identified from. None: nothing. Raises "
      "InputError.");
  m.def("noise_from_repeats", &noise_from_repeats, py::arg("data"), py::call_guard<py::gil_scoped_release>(),
        "Noise of one position component (or distance) [m], as rows measured again at one pose scatter. None: the "
        "repeats "
        "have fewer than 20 degrees of freedom.");
}

}  // namespace truing::python
