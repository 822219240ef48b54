// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/model/effect.hpp"
#include "convert/columns.hpp"
#include "convert/options.hpp"
#include "convert/own_effects.hpp"
#include "convert/text.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

/// Terms of an own effect at a joint: the numbers are already there, so no Python runs, and no GIL is needed, in the
/// loop over the rows.
std::vector<Term> terms_of(const OwnEffect& effect, const Robot& robot, std::size_t joint, const Measurements& data) {
  std::vector<Term> terms;
  for (const OwnEffect::Part& part : effect.parts) {
    if (part.joint != robot.joints.at(joint).name) continue;
    if (part.rows != data.rows)
      throw std::invalid_argument("effect '" + effect.name + "' was evaluated for " + std::to_string(part.rows) +
                                  " rows, the data has " + std::to_string(data.rows));
    terms.push_back({part.parameter, part.unit, part.site,
                     [values = part.values, owner = part.owner](const Inputs& in) { return values[in.row]; }, false});
  }
  return terms;
}

/// What `truing.Effect.evaluate` returns for these rows. Holds the GIL meanwhile.
OwnEffect evaluate(py::handle effect, const Robot& robot, const Measurements& data) {
  try {
    return effect
        .attr("evaluate")(py::cast(&robot, py::return_value_policy::reference),
                          py::cast(&data, py::return_value_policy::reference))
        .cast<OwnEffect>();
  } catch (py::error_already_set& error) {
    if (!error.matches(py::module_::import("truing.errors").attr("InputError"))) throw;
    throw MissingColumn(py::str(error.value()).cast<std::string>());
  }
}

}  // namespace

std::vector<Effect> effects_from(const std::vector<OwnEffect>& own) {
  std::vector<Effect> effects;
  for (const OwnEffect& effect : own) {
    effects.push_back({effect.name, effect.summary,
                       [effect](const Robot& robot, std::size_t joint, const Measurements& data) {
                         return terms_of(effect, robot, joint, data);
                       },
                       true, effect.traits});
  }
  return effects;
}

std::vector<Effect> effects_evaluated_when_asked(const std::vector<py::object>& own) {
  std::vector<Effect> effects;
  for (const py::object& effect : own) {
    effects.push_back({effect.attr("name").cast<std::string>(), effect.attr("summary").cast<std::string>(),
                       [object = effect.ptr(), kept = keep_alive({effect})](const Robot& robot, std::size_t joint,
                                                                            const Measurements& data) {
                         const py::gil_scoped_acquire locked;
                         return terms_of(evaluate(object, robot, data), robot, joint, data);
                       },
                       true, effect.attr("traits").cast<EffectTraits>()});
  }
  return effects;
}

namespace {

Eigen::VectorXd reading_of(const Measurements& data, std::size_t row) {
  Eigen::VectorXd q(static_cast<Eigen::Index>(data.joints.size()));
  for (Eigen::Index j = 0; j < q.size(); ++j) q[j] = data.joints[static_cast<std::size_t>(j)][row];
  return q;
}

/// Weights of the driven joints' readings in a joint's motion; gear ratios and zeros do not count in what was
/// read.
Eigen::VectorXd reading_weights(const Robot& robot, std::size_t joint) {
  const std::vector<std::size_t> driven = robot.driven_joints();
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(driven.size()));
  for (std::size_t i = 0; i < driven.size(); ++i)
    if (driven[i] == joint) weights[static_cast<Eigen::Index>(i)] = 1.0;
  for (const auto& [name, weight] : robot.joints[joint].driven_by)
    weights += weight * reading_weights(robot, robot.joint_index(name));
  return weights;
}

void check_joint_count(const Robot& robot, const Measurements& data) {
  validate(robot);
  if (data.joints.size() != robot.driven_count())
    throw std::invalid_argument("joints has " + std::to_string(data.joints.size()) + " columns, the robot has " +
                                std::to_string(robot.driven_count()) + " driven joints");
}

Eigen::VectorXd joint_motion(const Robot& robot, const Measurements& data, const std::string& name) {
  check_joint_count(robot, data);
  const Eigen::VectorXd weights = reading_weights(robot, robot.joint_index(name));
  Eigen::VectorXd out = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(data.rows));
  for (std::size_t j = 0; j < data.joints.size(); ++j)
    if (const double weight = weights[static_cast<Eigen::Index>(j)]; weight != 0.0)
      for (std::size_t i = 0; i < data.rows; ++i) out[static_cast<Eigen::Index>(i)] += weight * data.joints[j][i];
  return out;
}

RowMajor gravity_torque_rows(const Robot& robot, const Measurements& data) {
  check_joint_count(robot, data);
  RowMajor out(static_cast<Eigen::Index>(data.rows), static_cast<Eigen::Index>(robot.joints.size()));
  for (std::size_t i = 0; i < data.rows; ++i)
    out.row(static_cast<Eigen::Index>(i)) =
        gravity_torques(robot, reading_of(data, i), data.payload ? data.payload[i] : 0.0);
  return out;
}

}  // namespace

void bind_effect(py::module_& m) {
  py::class_<EffectRequest> request(m, "EffectRequest",
                                    R"(An effect asked for: its name, and joints (none: every driven joint).)");
  request.def(py::init([](std::string effect, std::vector<std::string> joints) {
                return EffectRequest{std::move(effect), std::move(joints)};
              }),
              py::arg("effect"), py::arg("joints") = std::vector<std::string>{});
  request.def_readonly("effect", &EffectRequest::effect, "Name, as in `catalogue()`.");
  request.def_property_readonly(
      "joints", [](const EffectRequest& r) { return tuple_of(r.joints); }, "Names of joints; none: every driven one.");
  request.def("__repr__", [](const EffectRequest& r) {
    return "EffectRequest('" + r.effect + "'" + (r.joints.empty() ? "" : ", joints: " + joined(r.joints)) + ")";
  });
  define_value(request, {"effect", "joints"});

  py::class_<OwnEffect> own(m, "OwnEffect",
                            "The values of a user's effect for the rows of some data; `truing.Effect` makes these.");
  own.def(py::init([](std::string name, std::string summary, EffectTraits traits) {
            return OwnEffect{std::move(name), std::move(summary), {}, std::move(traits)};
          }),
          py::arg("name"), py::arg("summary") = "", py::arg("traits") = EffectTraits{});
  own.def_readonly("name", &OwnEffect::name, "Name of the effect.");
  own.def_readonly("traits", &OwnEffect::traits, "What it says of itself.");
  own.def(
      "add",
      [](OwnEffect& self, std::string joint, std::string parameter, std::string unit, std::string site,
         const ArrayLike& values) {
        const py::array array = float_array(values, parameter);
        if (array.ndim() != 1) throw std::invalid_argument(parameter + ": values must have shape (n,)");
        self.parts.push_back({std::move(joint), std::move(parameter), std::move(unit), std::move(site),
                              column_of(array), static_cast<std::size_t>(array.shape(0)), keep_alive({array})});
      },
      py::kw_only(), py::arg("joint"), py::arg("parameter"), py::arg("unit"), py::arg("site"), py::arg("values"),
      "Adds a term: parameter * values[row] on `site`, listed under `joint`. values: shape=(n,); not copied "
      "when float64. Raises InputError.");
  own.def("__repr__", [](const OwnEffect& e) {
    return "OwnEffect('" + e.name + "', " + std::to_string(e.parts.size()) + " terms)";
  });

  m.def(
      "catalogue",
      [] {
        std::vector<std::pair<std::string, std::string>> out;
        for (const Effect& effect : catalogue()) out.emplace_back(effect.name, effect.summary);
        return out;
      },
      "Name and summary of the effects that truing knows.");
  m.def("gravity_torques", &gravity_torques, py::arg("robot"), py::arg("q"), py::arg("payload") = 0.0,
        R"(Gravity torque on every joint, passive ones included.

q: shape=(driven joints,) [rad | m]. payload: [kg] at the tool. Returns shape=(joints,) [Nm | N].
Raises InputError when no mass is known and the payload is zero.)");
  m.def("joint_motion", &joint_motion, py::arg("robot"), py::arg("data"), py::arg("joint"),
        py::call_guard<py::gil_scoped_release>(),
        "shape=(n,) [rad | m]: motion of a joint as read, of a passive one from its drivers' readings. "
        "Raises InputError.");
  m.def("gravity_torque_rows", &gravity_torque_rows, py::arg("robot"), py::arg("data"),
        py::call_guard<py::gil_scoped_release>(),
        "shape=(n, joints) [Nm | N]: `gravity_torques` of every row, with its payload. Raises InputError.");
}

}  // namespace truing::python
