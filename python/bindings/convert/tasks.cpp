// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "convert/tasks.hpp"

#include "convert/text.hpp"
#include "tables/inverse.hpp"

namespace truing::python {

Joints joints_from(const Eigen::Ref<const Eigen::VectorXd>& values) {
  if (values.size() > kMaxDrivenJoints)
    throw std::invalid_argument("got " + std::to_string(values.size()) + " joint readings, at most " +
                                std::to_string(kMaxDrivenJoints) + " are possible");
  return values;
}

std::vector<Joints> joint_rows(const ArrayLike& given, int driven, const std::string& name) {
  const Array array = Array::ensure(given);
  const py::ssize_t axis = array ? array.ndim() - 1 : -1;
  if (axis < 0 || axis > 1 || array.shape(axis) != driven) {
    PyErr_Clear();
    const std::string wanted = std::to_string(driven);
    std::string found;
    for (py::ssize_t k = 0; k <= axis; ++k) found += (k ? ", " : "") + std::to_string(array.shape(k));
    throw std::invalid_argument(name + " must have shape (" + wanted + ",) or (n, " + wanted + "): " + wanted +
                                " driven joints; found (" + found + ")");
  }
  std::vector<Joints> rows;
  const py::ssize_t count = axis == 0 ? 1 : array.shape(0);
  for (py::ssize_t k = 0; k < count; ++k)
    rows.push_back(joints_from(Eigen::Map<const Eigen::VectorXd>(array.data() + k * driven, driven)));
  return rows;
}

std::vector<Joints> seeds_from(const std::optional<ArrayLike>& given, const InverseSolver& solver) {
  return given ? joint_rows(*given, solver.driven_count(), "seeds") : std::vector<Joints>{solver.middle()};
}

Joints seed_from(const std::optional<Eigen::VectorXd>& given, const InverseSolver& solver) {
  return given ? joints_from(*given) : solver.middle();
}

std::vector<Task> tasks_from(const Tasks& given, const std::optional<Task>& like) {
  if (const auto* tasks = std::get_if<std::vector<Task>>(&given)) return *tasks;
  const std::vector<Eigen::Isometry3d> frames = frames_from(std::get<FrameArray>(given), "targets");
  std::vector<Task> tasks(frames.size(), like.value_or(Task{}));
  for (std::size_t k = 0; k < frames.size(); ++k) tasks[k].T_measurement_target = frames[k];
  return tasks;
}

std::vector<Conditions> conditions_from(const GivenConditions& given) {
  if (!given) return {};
  if (const auto* one = std::get_if<Conditions>(&*given)) return {*one};
  return std::get<std::vector<Conditions>>(*given);
}

void require_one_or_each(std::size_t found, std::size_t count, const std::string& name) {
  if (found != 1 && found != count)
    throw std::invalid_argument("got " + std::to_string(found) + " " + name + " for " + std::to_string(count) +
                                ": give one, or one for each");
}

py::array_t<double> array_of(const Joints& joints) {
  return read_only(py::array_t<double>(joints.size(), joints.data()));
}

std::string repr(const Solution& s) {
  return formatted("Solution('%s', %.3g mm, %.3g mrad)", word(s.reason), 1e3 * s.position_error,
                   1e3 * s.rotation_error);
}

}  // namespace truing::python
