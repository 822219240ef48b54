// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Times inverse kinematics on arms whose every target is the forward kinematics of random joints, and counts the
// answers that hold when forward_kinematics looks at them again. One line a task: median and 99th percentile of the CPU
// time, best of several runs for every target; and the share reached.
//
//     bench_inverse [NAME] [--quick] [--write FOLDER]
//
// NAME: only tasks that have it in their name. --quick: a tenth of the targets. --write: the robots, targets, seeds and
// answers as well, for bench/inverse.py, which hands the same ones to the peers and looks at all answers with another
// program's forward kinematics:
//
//     robots.json             link parameters as written below
//     SET.cases               doubles, a row a target: joints it was made from, seed, wanted T_measurement_target (4 x
//     4, row-major) truing.NAME.answers     doubles, a row an answer: index of the target, 1 if said to be reached,
//     joints, more for some tasks truing.jsonl            what is printed, one object a task

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "math/constants.hpp"
#include "math/random.hpp"
#include "truing/compensate.hpp"
#include "truing/inverse.hpp"
#include "truing/model/robot.hpp"

namespace {

using namespace truing;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using math::kDegree;

struct Arguments {
  std::string wanted;  ///< in the names of the tasks
  bool quick = false;
  std::string folder;  ///< empty: nothing is written

  std::size_t count(std::size_t full) const { return quick ? full / 10 : full; }
};
Arguments g_arguments;

/// What --write leaves in its folder.
void write_file(const std::string& name, const void* data, std::size_t bytes, const char* mode = "wb") {
  if (g_arguments.folder.empty()) return;
  const std::string path = g_arguments.folder + "/" + name;
  std::FILE* file = std::fopen(path.c_str(), mode);
  const bool written = file && std::fwrite(data, 1, bytes, file) == bytes;
  if (!file || std::fclose(file) != 0 || !written) throw std::runtime_error("cannot write " + path);
}

/// Rows of doubles.
class Table {
 public:
  void add(double value) { values_.push_back(value); }
  void add(const Joints& joints) { values_.insert(values_.end(), joints.data(), joints.data() + joints.size()); }
  void add(const Isometry3d& T) {
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 4; ++c) values_.push_back(T.matrix()(r, c));
    }
  }
  void write(const std::string& name) const { write_file(name, values_.data(), values_.size() * sizeof(double)); }

 private:
  std::vector<double> values_;
};

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Joint joint(const std::string& name, double theta, double d, double a, double alpha, double lower, double upper) {
  Joint j;
  j.name = name;
  j.theta = theta;
  j.d = d;
  j.a = a;
  j.alpha = alpha;
  j.lower = lower;
  j.upper = upper;
  return j;
}

/// UR10, modified DH: axes 2, 3, 4 are parallel; every joint turns twice.
Robot ur10() {
  Robot robot;
  robot.name = "ur10";
  robot.convention = Convention::mdh;
  const double table[6][3] = {{0, 0, 0.1273},         {M_PI / 2, 0, 0},      {0, -0.612, 0},
                              {0, -0.5723, 0.163941}, {M_PI / 2, 0, 0.1157}, {-M_PI / 2, 0, 0.0922}};
  for (int k = 0; k < 6; ++k)
    robot.joints.push_back(
        joint("J" + std::to_string(k + 1), 0, table[k][2], table[k][1], table[k][0], -2 * M_PI, 2 * M_PI));
  robot.targets = {{"tool", frame_from_xyz_rpy({0.03, -0.02, 0.15}, {0.0, 0.5, 0.0})}};
  return robot;
}

/// IRB 4600-like: a spherical wrist, axes 2 and 3 parallel, limits of its data sheet. DH.
Robot irb() {
  Robot robot;
  robot.name = "irb";
  robot.joints = {joint("J1", 0, 0.495, 0.175, -M_PI / 2, -180 * kDegree, 180 * kDegree),
                  joint("J2", -M_PI / 2, 0, 0.9, 0, -90 * kDegree, 150 * kDegree),
                  joint("J3", 0, 0, 0.175, -M_PI / 2, -180 * kDegree, 75 * kDegree),
                  joint("J4", 0, 0.96, 0, M_PI / 2, -400 * kDegree, 400 * kDegree),
                  joint("J5", 0, 0, 0, -M_PI / 2, -125 * kDegree, 120 * kDegree),
                  joint("J6", 0, 0.135, 0, 0, -400 * kDegree, 400 * kDegree)};
  robot.targets = {{"tool", frame_from_xyz_rpy({0.05, 0.0, 0.25}, {0.0, 0.6, 0.0})}};
  return robot;
}

/// The same arm hanging from a gantry of three rails.
Robot gantry() {
  Robot robot = irb();
  robot.name = "gantry";
  // DH moves along z of the frame before: x, y, z rails by twisting the frames; the arm hangs head down.
  std::vector<Joint> rails = {joint("X", 0, 0, 0, -M_PI / 2, 0, 10), joint("Y", M_PI / 2, 0, 0, M_PI / 2, 0, 4),
                              joint("Z", 0, 0, 0, 0, 0, 2)};
  for (Joint& rail : rails) rail.type = JointType::prismatic;
  robot.T_measurement_base = frame_from_xyz_rpy({0, 0, 3}, {0, M_PI / 2, 0});
  robot.joints.insert(robot.joints.begin(), rails.begin(), rails.end());
  return robot;
}

/// The same arm on one rail along x.
Robot rail() {
  Robot robot = irb();
  robot.name = "rail";
  Joint x =
      joint("X", 0, 0, 0, 0, 0, 10);  // along z of the base, which lies along x; the twist puts the arm upright again
  x.beta = -M_PI / 2;
  x.type = JointType::prismatic;
  robot.T_measurement_base = frame_from_xyz_rpy({0, 0, 0.3}, {0, M_PI / 2, 0});
  robot.joints.insert(robot.joints.begin(), x);
  return robot;
}

/// As it is rather than as it was drawn: errors of `length` [m] and `angle` [rad], standard deviation, in every link.
Robot perturbed(Robot robot, double length, double angle, std::uint64_t seed) {
  math::Random random(seed);
  robot.name += "_calibrated";
  for (Joint& j : robot.joints) {
    j.theta += angle * random.normal();
    j.d += length * random.normal();
    j.a += length * random.normal();
    j.alpha += angle * random.normal();
    j.beta += angle * random.normal();
  }
  return robot;
}

Joints random_joints(const Robot& robot, math::Random* random) {
  Joints q(static_cast<Eigen::Index>(robot.driven_count()));
  Eigen::Index k = 0;
  for (const Joint& j : robot.joints) {
    if (!j.passive()) q[k++] = random->uniform(j.lower, j.upper);
  }
  return q;
}

/// Does forward_kinematics agree, and are all joints within limits?
bool holds(const Robot& robot, const Task& task, const Joints& q) {
  Eigen::Index k = 0;
  for (const Joint& j : robot.joints) {
    if (j.passive()) continue;
    if (q[k] < j.lower || q[k] > j.upper) return false;
    ++k;
  }
  const Isometry3d T = forward_kinematics(robot, q).back();
  if ((T.translation() - task.T_measurement_target.translation()).norm() > 1e-6) return false;
  if (task.kind == TaskKind::pose) {
    return Eigen::Quaterniond(T.linear()).angularDistance(Eigen::Quaterniond(task.T_measurement_target.linear())) <=
           1e-6;
  }
  if (task.kind == TaskKind::torch) {
    const Vector3d a = T.linear() * task.axis, b = task.T_measurement_target.linear() * task.axis;
    return std::atan2(a.cross(b).norm(), a.dot(b)) <= 1e-6;
  }
  return true;
}

struct Case {
  Task task;
  Joints truth, seed;
};

const char* name_of(TaskKind kind) {
  return kind == TaskKind::pose ? "pose" : kind == TaskKind::torch ? "torch" : "point";
}

void write_cases(const std::string& set, const std::vector<Case>& cases) {
  Table table;
  for (const Case& c : cases) {
    table.add(c.truth);
    table.add(c.seed);
    table.add(c.task.T_measurement_target);
  }
  table.write(set + ".cases");
}

/// The first `count` are the same for any count.
std::vector<Case> make_cases(const Robot& robot, std::size_t count, TaskKind kind) {
  math::Random random(7);
  std::vector<Case> cases(count);
  for (Case& c : cases) {
    c.truth = random_joints(robot, &random);
    c.seed = random_joints(robot, &random);
    c.task.kind = kind;
    c.task.T_measurement_target = forward_kinematics(robot, c.truth).back();
    // The roll of the torch is anything: as a program without a wish would have it.
    if (kind == TaskKind::torch)
      c.task.T_measurement_target.linear() *=
          Eigen::AngleAxisd(random.uniform(-3, 3), Vector3d::UnitZ()).toRotationMatrix();
  }
  return cases;
}

/// One task's answers and figures.
struct Report {
  std::string task, robot, set;
  std::size_t targets = 0, reached = 0, wrong = 0;
  std::string note;
  Table answers;
  double median_us = 0.0, p99_us = 0.0;
  double grid_us = 0.0;  ///< what the grid takes, mean; 0: there is none

  Report(std::string task_, std::string robot_, const std::string& cases, std::size_t targets_)
      : task(std::move(task_)), robot(std::move(robot_)), set(robot + "." + cases), targets(targets_) {}

  std::string name() const { return robot + " " + task; }

  void print() const {
    std::printf("%-40s %9.2f / %9.2f us   %zu of %zu reached, %zu claimed wrongly%s%s\n", name().c_str(), median_us,
                p99_us, reached, targets, wrong, note.empty() ? "" : ", ", note.c_str());
    std::fflush(stdout);
    char line[600];
    const int length = std::snprintf(
        line, sizeof line,
        "{\"task\": \"%s\", \"robot\": \"%s\", \"set\": \"%s\", \"targets\": %zu, \"reached\": %zu, \"wrong\": %zu, "
        "\"median_us\": %.4g, \"p99_us\": %.4g, \"grid_us\": %.4g, \"note\": \"%s\"}\n",
        task.c_str(), robot.c_str(), set.c_str(), targets, reached, wrong, median_us, p99_us, grid_us, note.c_str());
    write_file("truing.jsonl", line, static_cast<std::size_t>(length), "ab");
    answers.write("truing." + name() + ".answers");
  }
};

/// Median and p99 over the cases: of every case the best of several runs; reading the clock takes time too, so a case
/// is done a few times in a row.
void time_cases(std::size_t count, const std::function<void(std::size_t)>& work, Report* report, int runs = 5,
                int times = 8) {
  std::vector<double> best(count, 1e9);
  for (int run = 0; run < runs; ++run) {
    for (std::size_t k = 0; k < count; ++k) {
      const double start = cpu_seconds();
      for (int time = 0; time < times; ++time) work(k);
      best[k] = std::min(best[k], (cpu_seconds() - start) / times);
    }
  }
  std::sort(best.begin(), best.end());
  report->median_us = 1e6 * best[count / 2];
  report->p99_us = 1e6 * best[count * 99 / 100];
}

bool wanted(const Report& report) { return report.name().find(g_arguments.wanted) != std::string::npos; }

std::string text(const char* format, double a, double b = 0.0, double c = 0.0) {
  char line[300];
  std::snprintf(line, sizeof line, format, a, b, c);
  return line;
}

// ---- Tasks ----------------------------------------------------------------------------------------------------------

void one_answer(const std::string& task, const Robot& robot, TaskKind kind, const InverseOptions& options = {}) {
  Report report(task, robot.name, name_of(kind), g_arguments.count(10000));
  if (!wanted(report)) return;
  const InverseSolver solver(robot, options);
  const std::vector<Case> cases = make_cases(robot, report.targets, kind);
  write_cases(report.set, cases);
  long iterations = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Solution s = solver.solve(cases[k].task, cases[k].seed);
    const bool held = s.reached() && holds(robot, cases[k].task, s.joints);
    report.reached += held;
    report.wrong += s.reached() && !held;
    iterations += s.iterations;
    report.answers.add(static_cast<double>(k));
    report.answers.add(s.reached() ? 1.0 : 0.0);
    report.answers.add(s.joints);
  }
  report.note = text("%.1f iterations", static_cast<double>(iterations) / static_cast<double>(report.targets));
  time_cases(report.targets, [&](std::size_t k) { (void)solver.solve(cases[k].task, cases[k].seed); }, &report);
  report.print();
}

/// The largest difference of two joint positions, whole turns aside. [rad | m]
double apart(const Joints& a, const Joints& b) {
  double most = 0.0;
  for (Eigen::Index j = 0; j < a.size(); ++j) most = std::max(most, std::abs(std::remainder(a[j] - b[j], 2 * M_PI)));
  return most;
}

void all_branches(const Robot& robot) {
  Report report("branches", robot.name, "pose", g_arguments.count(1000));
  if (!wanted(report)) return;
  const InverseSolver solver(robot);
  const std::vector<Case> cases = make_cases(robot, report.targets, TaskKind::pose);
  Branches found;
  std::size_t branches = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    solver.branches(cases[k].task, cases[k].seed, &found);
    branches += static_cast<std::size_t>(found.count);
    bool has_own = false;
    for (int b = 0; b < found.count; ++b) {
      const Joints& q = found.solution[static_cast<std::size_t>(b)].joints;
      report.wrong += !holds(robot, cases[k].task, q);
      has_own = has_own || apart(q, cases[k].truth) < 1e-4;
      report.answers.add(static_cast<double>(k));
      report.answers.add(1.0);
      report.answers.add(q);
    }
    report.reached += has_own;  // the joints that the target was made from are among them
  }
  report.note = text("%.0f branches", static_cast<double>(branches));
  time_cases(report.targets, [&](std::size_t k) { solver.branches(cases[k].task, cases[k].seed, &found); }, &report);
  report.print();
}

/// What Choose looks at, written once more: larger is better.
double merit(const Robot& robot, const InverseSolver& solver, Choose choose, const Joints& q, const Joints& seed) {
  if (choose == Choose::manipulability) {  // Yoshikawa 1985, eq. (6), of the joints that turn; the unit of length is a
                                           // factor of it
    TipJacobian J;
    solver.forward(q, &J);
    Eigen::Matrix<double, 6, 6> gram = Eigen::Matrix<double, 6, 6>::Zero();
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      if (robot.joints[static_cast<std::size_t>(j)].type == JointType::revolute)
        gram += J.col(j) * J.col(j).transpose();
    }
    return std::sqrt(std::max(0.0, gram.determinant()));
  }
  double way = 0.0, margin = 1.0;
  for (Eigen::Index j = 0; j < q.size(); ++j) {
    const Joint& joint = robot.joints[static_cast<std::size_t>(j)];
    if (joint.type == JointType::prismatic) way += (q[j] - seed[j]) * (q[j] - seed[j]);
    margin = std::min(margin, std::min(q[j] - joint.lower, joint.upper - q[j]) / (joint.upper - joint.lower));
  }
  return choose == Choose::limits_margin ? margin : -std::sqrt(way);
}

/// The best of all branches with the rails at every multiple of `spacing`; -infinity: none reaches.
double best_on_grid(const Robot& robot, const InverseSolver& solver, Choose choose, double spacing, const Case& c,
                    Branches* found) {
  int rails = 0;
  while (robot.joints[static_cast<std::size_t>(rails)].type == JointType::prismatic) ++rails;
  std::vector<int> cells(static_cast<std::size_t>(rails)), at(static_cast<std::size_t>(rails), 0);
  for (std::size_t r = 0; r < cells.size(); ++r)
    cells[r] = static_cast<int>(std::lround((robot.joints[r].upper - robot.joints[r].lower) / spacing));
  // Of a joint's turns those in the middle of its range, where limits are asked about.
  Joints from = choose == Choose::limits_margin ? solver.middle() : c.seed;
  double best = -std::numeric_limits<double>::infinity();
  for (bool more = true; more;) {
    for (std::size_t r = 0; r < cells.size(); ++r)
      from[static_cast<Eigen::Index>(r)] = robot.joints[r].lower + spacing * at[r];
    solver.branches(c.task, from, found);
    for (int b = 0; b < found->count; ++b) {
      const Joints& q = found->solution[static_cast<std::size_t>(b)].joints;
      const double here = merit(robot, solver, choose, q, c.seed);
      if (here > best && holds(robot, c.task, q)) best = here;
    }
    more = false;
    for (std::size_t r = 0; r < cells.size() && !more; ++r) {
      more = at[r]++ < cells[r];
      if (!more) at[r] = 0;
    }
  }
  return best;
}

void best_over_rails(const Robot& robot, Choose choose, const char* name, std::size_t count) {
  Report report(std::string("best ") + name, robot.name, "pose", count);
  if (!wanted(report)) return;
  InverseOptions options;
  options.choose = choose;
  const InverseSolver solver(robot, options), plain(robot);
  const std::vector<Case> cases = make_cases(robot, report.targets, TaskKind::pose);
  Branches found;
  std::size_t worse = 0;
  double worst = 0.0, grid_seconds = 0.0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Solution s = solver.solve(cases[k].task, cases[k].seed);
    const bool held = s.reached() && holds(robot, cases[k].task, s.joints);
    report.reached += held;
    report.wrong += s.reached() && !held;
    const double start = cpu_seconds();
    const double grid = best_on_grid(robot, plain, choose, 0.1, cases[k], &found);
    grid_seconds += cpu_seconds() - start;
    const double ours =
        held ? merit(robot, solver, choose, s.joints, cases[k].seed) : -std::numeric_limits<double>::infinity();
    const double short_by = std::isfinite(grid) ? (grid - ours) / std::max(std::abs(grid), 1e-3) : 0.0;
    worse += short_by > 1e-6;
    worst = std::max(worst, short_by);
    report.answers.add(static_cast<double>(k));
    report.answers.add(s.reached() ? 1.0 : 0.0);
    report.answers.add(s.joints);
    report.answers.add(ours);
    report.answers.add(grid);
  }
  report.grid_us = 1e6 * grid_seconds / static_cast<double>(count);
  report.note = text("grid of 0.1 m %.0f us, better than ours on %.0f, by up to %.2g of its merit", report.grid_us,
                     static_cast<double>(worse), worst);
  time_cases(report.targets, [&](std::size_t k) { (void)solver.solve(cases[k].task, cases[k].seed); }, &report, 3, 1);
  report.print();
}

/// Every joint swings about `middle`, by `swing`, so that the elbow and the wrist stay bent.
std::vector<Case> make_path(const Robot& robot, const std::vector<double>& middle, const std::vector<double>& swing,
                            std::size_t count) {
  math::Random random(13);
  const Eigen::Index n = static_cast<Eigen::Index>(middle.size());
  Joints phase(n), turns(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    phase[j] = random.uniform(0, 2 * M_PI);
    turns[j] = random.uniform(0.5, 2.0);
  }
  std::vector<Case> cases(count);
  for (std::size_t k = 0; k < count; ++k) {
    Joints q(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const double s = static_cast<double>(k) / 1000.0;
      q[j] = middle[static_cast<std::size_t>(j)] +
             swing[static_cast<std::size_t>(j)] * std::sin(phase[j] + 2 * M_PI * turns[j] * s);
    }
    cases[k].truth = q;
    cases[k].seed = k > 0 ? cases[k - 1].truth : q;
    cases[k].task.T_measurement_target = forward_kinematics(robot, q).back();
  }
  return cases;
}

/// `follow` from pose to pose; then all of it by `path`, which looks at every branch and rail place.
void smooth_path(const Robot& robot, const std::vector<double>& middle, const std::vector<double>& swing) {
  Report report("follow", robot.name, "path", 1000);
  Report whole("path", robot.name, "path", 1000);
  if (!wanted(report) && !wanted(whole)) return;
  const InverseSolver solver(robot);
  const std::vector<Case> cases = make_path(robot, middle, swing, report.targets);
  write_cases(report.set, cases);
  std::vector<Task> tasks;
  for (const Case& c : cases) tasks.push_back(c.task);

  Joints q = cases[0].truth;
  double longest = 0.0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Solution s = solver.follow(tasks[k], q);
    const bool held = s.reached() && holds(robot, tasks[k], s.joints);
    report.reached += held;
    report.wrong += s.reached() && !held;
    longest = std::max(longest, (s.joints - q).cwiseAbs().maxCoeff());
    q = s.joints;
    report.answers.add(static_cast<double>(k));
    report.answers.add(s.reached() ? 1.0 : 0.0);
    report.answers.add(q);
  }
  report.note = text("longest step %.4f", longest);
  // Each pose from the answer before, which the seeds are to the tolerance: the same work.
  time_cases(cases.size(), [&](std::size_t k) { (void)solver.follow(tasks[k], cases[k].seed); }, &report);
  report.print();

  const Path path = solver.path(tasks, cases[0].truth);
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Solution& s = path.solutions[k];
    const bool held = s.reached() && holds(robot, tasks[k], s.joints);
    whole.reached += held;
    whole.wrong += s.reached() && !held;
    whole.answers.add(static_cast<double>(k));
    whole.answers.add(s.reached() ? 1.0 : 0.0);
    whole.answers.add(s.joints);
  }
  whole.note = text("%.0f gaps, longest step %.4f rad, %.4f m", static_cast<double>(path.gaps.size()),
                    path.longest_turn, path.longest_slide);
  time_cases(1, [&](std::size_t) { (void)solver.path(tasks, cases[0].truth); }, &whole, 3, 1);
  whole.median_us = whole.p99_us /= static_cast<double>(cases.size());
  whole.print();
}

/// Position that is missed when a controller with the nominal robot is told `T_command`; NaN: it cannot go there. `q`:
/// where it comes from, and where it goes.
double missed(const Compensator& compensator, const Isometry3d& T_command, const Isometry3d& T_wanted, Joints* q,
              Isometry3d* T_real) {
  Task command;
  command.T_measurement_target = T_command;
  const Solution s = compensator.nominal().solve(command, *q);
  if (!s.reached()) return std::numeric_limits<double>::quiet_NaN();
  *q = s.joints;
  *T_real = compensator.calibrated().forward(s.joints);
  return (T_real->translation() - T_wanted.translation()).norm();
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// The usual way: command the wanted pose less what the real robot was off by, once more and once more. Returned: which
/// are where they should be to a nanometre after `kMost` corrections.
std::vector<bool> fake_targets(const Compensator& compensator, const std::vector<Case>& cases,
                               const std::string& robot) {
  constexpr int kMost = 50;
  Report report("fake targets", robot, "compensate", cases.size());
  std::vector<double> first, second, third;
  std::vector<bool> arrived;
  std::size_t micrometre = 0, never = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Isometry3d wanted = cases[k].task.T_measurement_target;
    Isometry3d command = wanted, real = wanted;
    Joints q = cases[k].seed;
    double miss[kMost + 1];
    for (int n = 0; n <= kMost; ++n) {
      miss[n] = missed(compensator, command, wanted, &q, &real);
      if (std::isnan(miss[n])) {  // the corrections have led out of the nominal robot's reach
        for (int rest = n; rest <= kMost; ++rest) miss[rest] = std::numeric_limits<double>::infinity();
        break;
      }
      command = command * real.inverse() * wanted;
    }
    first.push_back(miss[0]);
    second.push_back(miss[1]);
    third.push_back(miss[2]);
    micrometre += miss[2] > 1e-6;
    never += !(miss[kMost] <= 1e-9);
    report.reached += miss[kMost] <= 1e-9;
    arrived.push_back(miss[kMost] <= 1e-9);
  }
  report.note =
      text("medians %.3g m, %.3g m, %.3g m", quantile(first, 0.5), quantile(second, 0.5), quantile(third, 0.5)) +
      text(" after 0, 1, 2 corrections, after two %.2f %% off by more than 1 um, after 50 %.2f %% by more than 1 nm",
           100.0 * static_cast<double>(micrometre) / static_cast<double>(cases.size()),
           100.0 * static_cast<double>(never) / static_cast<double>(cases.size()));
  time_cases(
      cases.size(),
      [&](std::size_t k) {
        const Isometry3d wanted = cases[k].task.T_measurement_target;
        Isometry3d command = wanted, real = wanted;
        Joints q = cases[k].seed;
        for (int n = 0; n < 2; ++n) {  // the third solve is the controller's own
          if (std::isnan(missed(compensator, command, wanted, &q, &real))) return;
          command = command * real.inverse() * wanted;
        }
      },
      &report, 3, 1);
  report.print();
  return arrived;
}

/// Poses of a program for the nominal robot, made from random joints; the robot comes from those.
void compensate(const Robot& nominal, const Robot& calibrated) {
  Report report("compensate", calibrated.name, "compensate", 1500);
  if (!wanted(report)) return;
  CompensateOptions options;
  options.inverse.position_tolerance = options.inverse.rotation_tolerance = 1e-9;
  const Compensator compensator(nominal, calibrated, options);
  std::vector<Case> cases = make_cases(nominal, report.targets, TaskKind::pose);
  for (Case& c : cases) c.seed = c.truth;
  write_cases(report.set, cases);
  const std::vector<bool> by_fake_targets = fake_targets(compensator, cases, calibrated.name);

  std::vector<double> before;
  std::size_t labelled = 0, others = 0;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Compensated c = compensator.pose(cases[k].task, cases[k].seed);
    const Isometry3d real = forward_kinematics(calibrated, c.solution.joints).back();
    const double miss = (real.translation() - cases[k].task.T_measurement_target.translation()).norm();
    const bool held = c.solution.reached() && miss <= 1e-9;
    report.reached += held;
    report.wrong += c.solution.reached() && !held;
    labelled += !c.solution.reached();
    others += !c.solution.reached() && by_fake_targets[k];
    before.push_back(c.position_before);
    report.answers.add(static_cast<double>(k));
    report.answers.add(c.solution.reached() ? 1.0 : 0.0);
    report.answers.add(c.solution.joints);
    report.answers.add(c.T_command);
    if (!c.solution.reached() && labelled == 1)
      report.note = "the first of them " + compensator.calibrated().describe(c.solution) + "; ";
  }
  report.note = text("%.3g m before in the median; %.0f labelled, of which fake targets reach %.0f; ",
                     quantile(before, 0.5), static_cast<double>(labelled), static_cast<double>(others)) +
                report.note;
  time_cases(cases.size(), [&](std::size_t k) { (void)compensator.pose(cases[k].task, cases[k].seed); }, &report);
  report.print();
}

void write_robots(const std::vector<Robot>& robots) {
  std::string out = "{";
  for (const Robot& robot : robots) {
    const Isometry3d& base = robot.T_measurement_base;
    const Isometry3d& tool = robot.targets[0].T_last_target;
    const auto frame = [](const Isometry3d& T) {
      std::string rows;
      for (int r = 0; r < 4; ++r) {
        for (int c = 0; c < 4; ++c) rows += text(r + c == 0 ? "%.17g" : ", %.17g", T.matrix()(r, c));
      }
      return "[" + rows + "]";
    };
    out += (out.size() > 1 ? ",\n\"" : "\n\"") + robot.name + "\": {\"convention\": \"" +
           (robot.convention == Convention::dh ? "dh" : "mdh") + "\", \"T_measurement_base\": " + frame(base) +
           ", \"T_last_target\": " + frame(tool) + ", \"joints\": [";
    for (const Joint& j : robot.joints) {
      out += std::string(&j == &robot.joints.front() ? "\n" : ",\n") +
             " {\"prismatic\": " + (j.type == JointType::prismatic ? "true" : "false") +
             text(", \"theta\": %.17g, \"d\": %.17g, \"a\": %.17g", j.theta, j.d, j.a) +
             text(", \"alpha\": %.17g, \"beta\": %.17g", j.alpha, j.beta) +
             text(", \"lower\": %.17g, \"upper\": %.17g}", j.lower, j.upper);
    }
    out += "]}";
  }
  out += "\n}\n";
  write_file("robots.json", out.data(), out.size());
}

void parse(int argc, char** argv) {
  for (int k = 1; k < argc; ++k) {
    const std::string argument = argv[k];
    if (argument == "--quick") {
      g_arguments.quick = true;
    } else if (argument == "--write") {
      if (++k == argc) throw std::runtime_error("--write wants a folder");
      g_arguments.folder = argv[k];
    } else if (argument.compare(0, 2, "--") == 0) {
      throw std::runtime_error("no option " + argument + "; there are --quick and --write FOLDER");
    } else {
      g_arguments.wanted = argument;
    }
  }
}

void run() {
  const Robot ur = ur10(), ur_real = perturbed(ur, 1e-3, 1e-3, 11);
  const Robot arm = irb(), arm_real = perturbed(arm, 1e-3, 1e-3, 11);
  const Robot portal = gantry(), portal_real = perturbed(portal, 1e-3, 1e-3, 12);
  const Robot track = rail(), track_real = perturbed(track, 1e-3, 1e-3, 14);
  write_file("truing.jsonl", "", 0);
  write_robots({ur, ur_real, arm, arm_real, portal, portal_real, track, track_real});

  for (const Robot* robot : {&ur, &arm, &ur_real, &arm_real}) all_branches(*robot);
  for (const Robot* robot : {&ur, &arm, &ur_real, &arm_real, &portal, &portal_real})
    one_answer("one", *robot, TaskKind::pose);
  InverseOptions without;
  without.wrist_tolerance = without.parallel_tolerance = 0.0;
  for (const Robot* robot : {&ur_real, &arm_real}) one_answer("one by descent alone", *robot, TaskKind::pose, without);
  for (const Robot* robot : {&ur_real, &arm_real, &portal_real}) one_answer("torch", *robot, TaskKind::torch);

  const std::pair<Choose, const char*> criteria[] = {{Choose::limits_margin, "limits margin"},
                                                     {Choose::manipulability, "manipulability"},
                                                     {Choose::rail_travel, "rail travel"}};
  for (const Robot* robot : {&track, &track_real}) one_answer("one", *robot, TaskKind::pose);
  for (const Robot* robot : {&track, &track_real}) {
    for (const auto& [choose, name] : criteria) best_over_rails(*robot, choose, name, g_arguments.count(1000));
  }
  for (const auto& [choose, name] : criteria) best_over_rails(portal_real, choose, name, g_arguments.count(20));

  smooth_path(ur_real, {0.0, -1.2, 1.4, -0.8, 1.3, 0.0}, {1.0, 0.4, 0.6, 0.6, 0.6, 1.0});
  smooth_path(arm_real, {0.0, 0.4, -0.3, 0.3, 0.9, 0.0}, {1.0, 0.4, 0.4, 0.8, 0.5, 1.0});
  smooth_path(portal_real, {5.0, 2.0, 1.0, 0.0, 0.4, -0.3, 0.3, 0.9, 0.0},
              {0.8, 0.5, 0.3, 1.0, 0.4, 0.4, 0.8, 0.5, 1.0});

  compensate(arm, arm_real);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    parse(argc, argv);
    run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
