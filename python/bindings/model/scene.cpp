// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "tables/model/scene.hpp"
#include "convert/options.hpp"
#include "convert/text.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

void bind_obstacle(py::module_& m) {
  const Obstacle usual;
  py::class_<Obstacle> cls(m, "Obstacle", R"(A fixed obstacle; `replace(...)` makes another one.

shape: 'sphere' (radius about the frame's origin), 'capsule' (radius about the segment from the origin to
(0, 0, size[2])) or 'box' (`size` along the frame's axes, its centre at the origin).)");
  cls.def(py::init([](std::string name, Shape shape, const Eigen::Isometry3d& T, const Eigen::Vector3d& size,
                      double radius) { return Obstacle{std::move(name), shape, T, size, radius}; }),
          py::arg("name"), py::kw_only(), py::arg("shape") = usual.shape,
          py::arg("T_measurement_shape") = usual.T_measurement_shape, py::arg("size") = array_from(usual.size),
          py::arg("radius") = usual.radius);
  define_read_only_attributes(cls);
  cls.def("__repr__",
          [](const Obstacle& o) { return "Obstacle('" + o.name + "', " + std::string(word(o.shape)) + ")"; });
  define_value(cls, {"name", "shape", "T_measurement_shape", "size", "radius"});
}

void bind_capsule(py::module_& m) {
  py::class_<LinkCapsule> cls(m, "LinkCapsule", Fields<LinkCapsule>::summary);
  cls.def(py::init([](std::string name, std::string link, const Eigen::Vector3d& start, const Eigen::Vector3d& end,
                      double radius) { return LinkCapsule{std::move(name), std::move(link), start, end, radius}; }),
          py::arg("name"), py::kw_only(), py::arg("link"), py::arg("start"), py::arg("end"), py::arg("radius"));
  define_read_only_attributes(cls);
  cls.def("__repr__", [](const LinkCapsule& c) { return "LinkCapsule('" + c.name + "' on '" + c.link + "')"; });
  define_value(cls, {"name", "link", "start", "end", "radius"});
}

using NamePairs = std::vector<std::pair<std::string, std::string>>;

void bind_scene_class(py::module_& m) {
  py::class_<Scene> cls(m, "Scene", Fields<Scene>::summary);
  cls.def(py::init([](std::vector<Obstacle> obstacles, std::vector<LinkCapsule> capsules, double clearance,
                      NamePairs ignored) {
            return Scene{std::move(obstacles), std::move(capsules), clearance, std::move(ignored)};
          }),
          py::kw_only(), py::arg("obstacles") = std::vector<Obstacle>{},
          py::arg("capsules") = std::vector<LinkCapsule>{}, py::arg("clearance") = 0.0,
          py::arg("ignored") = NamePairs{});
  define_read_only_attributes(cls);
  cls.def("__repr__", [](const Scene& s) {
    return "Scene(" + std::to_string(s.obstacles.size()) + " obstacles, " + std::to_string(s.capsules.size()) +
           " capsules)";
  });
  define_value(cls, {"obstacles", "capsules", "clearance", "ignored"});
}

}  // namespace

void bind_scene(py::module_& m) {
  bind_obstacle(m);
  bind_capsule(m);
  bind_scene_class(m);

  auto contact = define_result<Contact>(m, "Contact");
  contact.def("__repr__", [](const Contact& c) {
    return "Contact('" + c.first + "', '" + c.second + "', " + text(1e3 * c.distance) + " mm)";
  });

  m.def("validate_scene", py::overload_cast<const Scene&, const Robot&>(&validate), py::arg("scene"), py::arg("robot"),
        "Raises InputError on unknown links, empty or equal names, sizes that are not positive, frames that are not "
        "rigid.");
  m.def("nearest_contact", &nearest_contact, py::arg("scene"), py::arg("robot"), py::arg("joints"),
        py::arg("target") = 0,
        R"(The nearest pair at these readings, effects left out; without names when there is none to look at.

joints: shape=(driven joints,) [rad | m]. target: its index in `robot.targets`. Raises InputError.)");
}

}  // namespace truing::python
