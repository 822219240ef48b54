// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "truing/dynamics/servo.hpp"

#include <cstdint>
#include <map>
#include <tuple>

#include <algorithm>

#include "convert/pybind.hpp"
#include "parts.hpp"

namespace truing::python {

namespace {

using namespace dynamics;
using Addresses = std::map<std::string, std::uintptr_t>;

template <class Pointer>
Pointer address(const Addresses& of, const std::string& name) {
  const auto at = of.find(name);
  if (at == of.end() || at->second == 0) throw std::invalid_argument("simulate_servos: no address of " + name);
  return reinterpret_cast<Pointer>(at->second);
}

ServoWorkspace workspace_of(const Addresses& a) {
  ServoWorkspace w;
  w.model = address<void*>(a, "model");
  w.data = address<void*>(a, "data");
  const std::pair<const char*, double**> arrays[] = {{"qpos", &w.qpos},
                                                     {"qvel", &w.qvel},
                                                     {"qfrc_applied", &w.applied},
                                                     {"qfrc_bias", &w.bias},
                                                     {"qfrc_constraint", &w.constraint},
                                                     {"inertia_at_zero", &w.inertia_at_zero},
                                                     {"frictionloss", &w.frictionloss},
                                                     {"damping", &w.damping},
                                                     {"armature", &w.armature},
                                                     {"gravity", &w.gravity},
                                                     {"mass", &w.mass},
                                                     {"ipos", &w.ipos},
                                                     {"iquat", &w.iquat},
                                                     {"inertia", &w.inertia}};
  for (const auto& [name, to] : arrays) *to = address<double*>(a, name);
  return w;
}

ServoCalls calls_of(const Addresses& a) {
  ServoCalls calls;
  calls.step = address<void (*)(const void*, void*)>(a, "mj_step");
  calls.reset = address<void (*)(const void*, void*)>(a, "mj_resetData");
  calls.constants = address<void (*)(void*, void*)>(a, "mj_setConst");
  return calls;
}

using Function = std::tuple<int, std::string, double, double, Eigen::VectorXd>;

ServoFunction function_of(const Function& given) {
  const std::vector<std::string> inputs = servo_inputs();
  const auto at = std::find(inputs.begin(), inputs.end(), std::get<1>(given));
  if (at == inputs.end()) throw std::invalid_argument("simulate_servos: no input " + std::get<1>(given));
  return {std::get<0>(given), static_cast<ServoInput>(at - inputs.begin()), std::get<2>(given), std::get<3>(given),
          std::get<4>(given)};
}

std::pair<std::vector<Eigen::MatrixXd>, std::vector<Eigen::MatrixXd>> simulate(
    const Addresses& calls, const std::vector<Addresses>& workspaces, const ServoArm& arm,
    const std::vector<ServoBodies>& bodies, const std::vector<ServoRecording>& recordings,
    const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets, bool torques) {
  std::vector<ServoWorkspace> spaces;
  for (const Addresses& one : workspaces) spaces.push_back(workspace_of(one));
  const ServoCalls functions = calls_of(calls);
  ServoMotion motion;
  {
    const py::gil_scoped_release unlocked;
    motion = simulate_servos(functions, spaces, arm, bodies, recordings, windows, sets, torques);
  }
  return {std::move(motion.position), std::move(motion.torque)};
}

std::pair<std::vector<Eigen::MatrixXd>, std::vector<Eigen::MatrixXd>> simulate_apart(
    const ServoArm& arm, const std::vector<std::vector<ServoPath>>& paths,
    const std::vector<ServoRecording>& recordings, const std::vector<ServoWindow>& windows,
    const std::vector<ServoSet>& sets, int threads, bool torques) {
  ServoMotion motion;
  {
    const py::gil_scoped_release unlocked;
    motion = simulate_servos_apart(arm, paths, recordings, windows, sets, threads, torques);
  }
  return {std::move(motion.position), std::move(motion.torque)};
}

using Sums = std::tuple<Eigen::MatrixXd, Eigen::VectorXd, double, double>;

using Values = py::array_t<double, py::array::c_style>;

std::vector<Sums> summed(const std::vector<std::pair<int, Values>>& columns, const Values& measured,
                         const Eigen::VectorXd& weight, std::vector<int> fold, int folds, Eigen::Index every,
                         int threads) {
  const auto rows = static_cast<py::ssize_t>(fold.size());
  if (measured.ndim() != 2 || measured.shape(0) != rows || measured.shape(1) != weight.size())
    throw std::invalid_argument("sum_columns: measured has another shape than (rows, joints)");
  std::vector<ColumnValues> seen;
  for (const auto& [joint, values] : columns) {
    if (values.size() != (joint < 0 ? measured.size() : rows))
      throw std::invalid_argument("sum_columns: a column has another shape than the rows");
    seen.push_back({values.data(), joint});
  }
  const ColumnRows of{measured.data(), weight, std::move(fold), folds, every};
  std::vector<ColumnSums> sums;
  {
    const py::gil_scoped_release unlocked;
    sums = sum_columns(seen, of, threads);
  }
  std::vector<Sums> out;
  for (ColumnSums& one : sums) out.emplace_back(std::move(one.xx), std::move(one.xy), one.yy, one.n);
  return out;
}

std::vector<ColumnGain> ranked(const std::vector<Sums>& given, const std::vector<int>& always,
                               const std::vector<std::vector<int>>& candidates, const std::vector<double>& costs,
                               const Eigen::VectorXd& prior) {
  std::vector<ColumnSums> folds;
  for (const auto& [xx, xy, yy, n] : given) folds.push_back({xx, xy, yy, n});
  const py::gil_scoped_release unlocked;
  return rank_columns(folds, always, candidates, costs, prior);
}

/// Sums over columns, and the evidence from them.
void bind_columns(py::module_& m) {
  m.def("sum_columns", &summed, py::arg("columns"), py::arg("measured"), py::arg("weight"), py::arg("fold"),
        py::arg("folds") = 1, py::arg("every") = 1, py::arg("threads") = 1,
        R"(Of each fold X^T X, X^T y, y^T y and the number of rows, weighted; the same bits whatever the threads.

columns: a joint and its values, shape=(rows,), or -1 and those of all joints, shape=(rows, joints). measured: y,
shape=(rows, joints). weight: of each joint. fold: of each row, from 0 on. every: rows are thinned to each
so-many-th. Raises InputError: shapes that do not fit, folds or joints that there are not.)");
  py::class_<ColumnGain>(m, "ColumnGain", "What adding a candidate's columns would win.")
      .def_readonly("score", &ColumnGain::score, "Log Bayes factor less the candidate's cost [nats].")
      .def_readonly("scale", &ColumnGain::scale, "Of the prior, the most likely one.")
      .def_readonly("share", &ColumnGain::share, "Of the squares that are left, the part that it removes.")
      .def_readonly("rank", &ColumnGain::rank, "Columns that the data can see.")
      .def_readonly("values", &ColumnGain::values, "Of its columns.")
      .def_readonly("folds", &ColumnGain::folds, "Squares of each fold, by the fit to the others.")
      .def_readonly("explains_best", &ColumnGain::explains_best,
                    "Of what the candidate of the best score does, the part that this one can do.");
  m.def("rank_columns", &ranked, py::arg("folds"), py::arg("always"), py::arg("candidates"), py::arg("costs"),
        py::arg("prior"),
        R"(Evidence of candidates beside columns that are always in; the first entry is that of none.

folds: of each X^T X, X^T y, y^T y and the number of rows that count. Raises InputError: other shapes.)");
}

}  // namespace

void bind_servo(py::module_& m) {
  py::class_<ServoArm>(m, "ServoArm", "Where the joints of an arm are in the simulator.")
      .def(py::init([](std::vector<int> qpos, std::vector<int> dof, double step, int bodies,
                       const Eigen::Vector3d& gravity, bool torque_command) {
             return ServoArm{std::move(qpos), std::move(dof), step, bodies, gravity, torque_command};
           }),
           py::arg("qpos"), py::arg("dof"), py::arg("step"), py::arg("bodies"), py::arg("gravity"),
           py::arg("torque_command") = false);
  py::class_<ServoBodies>(m, "ServoBodies", "Masses of all bodies of the simulator.")
      .def(py::init([](Eigen::VectorXd mass, Eigen::VectorXd ipos, Eigen::VectorXd iquat, Eigen::VectorXd inertia) {
             return ServoBodies{std::move(mass), std::move(ipos), std::move(iquat), std::move(inertia)};
           }),
           py::arg("mass"), py::arg("ipos"), py::arg("iquat"), py::arg("inertia"));
  py::class_<ServoRecording>(m, "ServoRecording", "A recording as the simulation takes it, rows at even times.")
      .def(py::init([](double step, Eigen::MatrixXd command, Eigen::MatrixXd position, Eigen::MatrixXd speed,
                       Eigen::MatrixXd gain, Eigen::MatrixXd supply, Eigen::MatrixXd enabled, Eigen::MatrixXd warmth) {
             return ServoRecording{step,
                                   std::move(command),
                                   std::move(position),
                                   std::move(speed),
                                   std::move(gain),
                                   std::move(supply),
                                   std::move(enabled),
                                   std::move(warmth)};
           }),
           py::arg("step"), py::arg("command"), py::arg("position"), py::arg("speed"), py::arg("gain"),
           py::arg("supply"), py::arg("enabled"), py::arg("warmth"));
  py::class_<ServoWindow>(m, "ServoWindow", "Rows of a recording that are simulated from the state of the first.")
      .def(py::init([](int recording, Eigen::Index first, Eigen::Index rows) {
             return ServoWindow{recording, first, rows};
           }),
           py::arg("recording"), py::arg("first"), py::arg("rows"));
  py::class_<ServoSet>(m, "ServoSet", R"(Values of the chain of every joint, shape=(joints, fields).

charge: integrals of the command error at the first rows of recordings, shape=(recordings, joints); empty: zero.)")
      .def(py::init([](Eigen::MatrixXd chain, double weight_scale, int bodies, const std::vector<Function>& functions,
                       int only, Eigen::MatrixXd charge) {
             ServoSet out{std::move(chain), weight_scale, bodies, only, {}, std::move(charge)};
             for (const Function& one : functions) out.functions.push_back(function_of(one));
             return out;
           }),
           py::arg("chain"), py::arg("weight_scale") = 1.0, py::arg("bodies") = -1,
           py::arg("functions") = std::vector<Function>{}, py::arg("only") = -1, py::arg("charge") = Eigen::MatrixXd());
  py::class_<ServoPath>(m, "ServoPath", "What each joint feels along a recorded motion of the others.")
      .def(py::init([](Eigen::MatrixXd inertia, Eigen::MatrixXd bias, Eigen::MatrixXd cosine, Eigen::MatrixXd sine,
                       Eigen::VectorXd turns) {
             return ServoPath{std::move(inertia), std::move(bias), std::move(cosine), std::move(sine),
                              std::move(turns)};
           }),
           py::arg("inertia"), py::arg("bias"), py::arg("cosine"), py::arg("sine"), py::arg("turns"));
  m.def("servo_fields", &servo_fields, "Names of the columns of ServoSet's chain.");
  m.def("servo_inputs", &servo_inputs, "Names of what a torque added at a joint may be a function of.");
  m.def("simulate_servos", &simulate, py::arg("calls"), py::arg("workspaces"), py::arg("arm"), py::arg("bodies"),
        py::arg("recordings"), py::arg("windows"), py::arg("sets"), py::arg("torques") = false,
        R"(Simulates every set over every window: positions and torques, a list of shape=(rows, joints) each.

calls, workspaces: addresses of the simulator's functions, and of each thread's model, data and arrays, which must live
as long as the call takes. Raises InputError: shapes that do not fit, addresses that are missing.)");
  m.def("simulate_servos_apart", &simulate_apart, py::arg("arm"), py::arg("paths"), py::arg("recordings"),
        py::arg("windows"), py::arg("sets"), py::arg("threads") = 1, py::arg("torques") = false,
        R"(As simulate_servos, joint by joint along the measured motion of the others, without a simulator.

paths: of every kind of masses, those of every recording; a set's `bodies` is the number of its kind. Raises InputError:
shapes that do not fit, masses without paths.)");
  bind_columns(m);
}

}  // namespace truing::python
