// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// The actuator chain of servo arms, step by step beside a simulator of the bodies.

#include "truing/dynamics/servo.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "dynamics/servo_chain.hpp"
#include "dynamics/servo_lanes.hpp"
#include "math/batch.hpp"
#include "rooms.hpp"

namespace truing::dynamics {
namespace {

using Eigen::Index;

constexpr std::size_t kAtOnce = 16;       ///< joints apart that go through a window side by side: they do not wait for
                                          ///< each other's sums, and a processor works at several at once
constexpr std::size_t kLanesAtOnce = 32;  ///< the same of those that are the kernel's

/// Cosine and sine, near zero by their series, to 1e-14.
void turn_of(double x, double* cosine, double* sine) {
  if (std::abs(x) > 0.5) {
    *cosine = std::cos(x);
    *sine = std::sin(x);
    return;
  }
  const double y = x * x, y2 = y * y, y4 = y2 * y2;
  *cosine = (1.0 - y * (1.0 / 2.0)) + y2 * (1.0 / 24.0 - y * (1.0 / 720.0)) +
            y4 * ((1.0 / 40320.0 - y * (1.0 / 3628800.0)) + y2 * (1.0 / 479001600.0));
  *sine = x * ((1.0 - y * (1.0 / 6.0)) + y2 * (1.0 / 120.0 - y * (1.0 / 5040.0)) +
               y4 * ((1.0 / 362880.0 - y * (1.0 / 39916800.0)) + y2 * (1.0 / 6227020800.0)));
}

/// Of a link's inertia with all other joints held: so little at least it has where they give way.
constexpr double kMovesAlone = 0.3;

/// A joint of a set that is simulated.
struct Lane {
  ServoDrive drive;
  std::size_t set = 0;  ///< of those that are simulated side by side
  Index joint = 0;
};

/// The whole arm, moved by the simulator: where the lanes of one set read and write.
class Simulator {
 public:
  Simulator(const ServoCalls& calls, const ServoWorkspace& w, const ServoArm& arm) : calls_(calls), w_(w), arm_(arm) {}
  void add(const Lane& lane) {
    w_.armature[arm_.dof[static_cast<std::size_t>(lane.joint)]] = lane.drive.most_armature();
  }
  void begin(std::size_t k, double angle, double speed) {
    w_.qpos[arm_.qpos[k]] = angle;
    w_.qvel[dof(k)] = speed;
  }
  /// What weight and motion ask of every joint where it begins: a step computes it, after which all begin again.
  void weigh(Index /*row*/) { calls_.step(w_.model, w_.data); }
  double load(std::size_t k) const { return w_.bias[dof(k)]; }
  double inertia(std::size_t k) const { return kMovesAlone * w_.inertia_at_zero[dof(k)]; }
  void come(Index /*row*/, double /*part*/) {}
  void look(std::size_t k, ServoMoment* now) const {
    now->angle = angle(k);
    now->speed = w_.qvel[dof(k)];
    now->bias = w_.bias[dof(k)];
    now->rubbed = w_.constraint[dof(k)];
    now->inertia = inertia(k);
  }
  void act(std::size_t k, ServoDrive* drive, const ServoMoment& now) {
    const ServoActs acts = drive->act(now);
    w_.applied[dof(k)] = acts.applied;
    w_.damping[dof(k)] = acts.damping;
    w_.frictionloss[dof(k)] = acts.friction;
    w_.armature[dof(k)] = acts.armature;
  }
  void step() { calls_.step(w_.model, w_.data); }
  double angle(std::size_t k) const { return w_.qpos[arm_.qpos[k]]; }

 private:
  std::size_t dof(std::size_t k) const { return static_cast<std::size_t>(arm_.dof[k]); }
  const ServoCalls& calls_;
  const ServoWorkspace& w_;
  const ServoArm& arm_;
};

/// Joints that do not know of each other, each along its path, implicit in friction and damping.
class Apart {
 public:
  Apart(const ServoArm& arm, const ServoRecording& recording, const std::vector<std::vector<ServoPath>>& paths,
        std::size_t number, const std::vector<const ServoSet*>& sets)
      : step_(arm.step), recording_(recording) {
    for (const ServoSet* set : sets) {
      paths_.push_back(&paths[static_cast<std::size_t>(std::max(0, set->bodies))][number]);
      weights_.push_back(set->weight_scale);
    }
  }

  void add(const Lane& lane) {
    const ServoPath& path = *paths_[lane.set];
    const auto column = [&](const Eigen::MatrixXd& table) { return table.col(lane.joint).data(); };
    const double* inertia = column(path.inertia);
    std::size_t track = 0;
    while (track < tracks_.size() && tracks_[track].inertia != inertia) ++track;
    if (track == tracks_.size())
      tracks_.push_back({inertia,
                         column(path.bias),
                         column(path.cosine),
                         column(path.sine),
                         column(recording_.position),
                         path.inertia.rows() - 1,
                         path.turns[lane.joint],
                         {}});
    joints_.push_back({track, weights_[lane.set], lane.drive.armature()});
  }
  void begin(std::size_t k, double angle, double speed) {
    joints_[k].angle = angle;
    joints_[k].speed = speed;
  }

  void weigh(Index row) { come(row, 0.0); }
  double load(std::size_t k) const {
    const Track& t = tracks_[joints_[k].track];
    return t.now.bias + (joints_[k].weight - 1.0) * t.now.cosine;
  }
  double inertia(std::size_t k) const { return tracks_[joints_[k].track].now.inertia; }

  /// Where a step begins, `part` of the way from a row to the next.
  void come(Index row, double part) {
    for (Track& t : tracks_) {
      const Index next = std::min(row + 1, t.last);
      const auto between = [&](const double* of) { return of[row] + part * (of[next] - of[row]); };
      t.now = {between(t.inertia), between(t.bias), between(t.cosine), between(t.sine), between(t.position)};
    }
  }
  void look(std::size_t k, ServoMoment* now) {
    Joint& j = joints_[k];
    const Track& t = tracks_[j.track];
    double c = 1.0, s = 0.0;
    turn_of(t.turns * (j.angle - t.now.position), &c, &s);
    now->angle = j.angle;
    now->speed = j.speed;
    now->bias = j.weight * (t.now.cosine * c + t.now.sine * s);
    j.against = now->bias + t.now.bias - t.now.cosine;
    j.heavy = t.now.inertia + j.armature;
  }

  /// (I + h d) v' + h F sgn v' = I v + h (applied - bias), by implicit Coulomb friction (Moreau 1988).
  void act(std::size_t k, ServoDrive* drive, const ServoMoment& now) {
    Joint& j = joints_[k];
    if (drive->has_rotor()) {
      drive->turn(now, j.heavy, j.against, &j.angle, &j.speed);
      return;
    }
    const ServoActs acts = drive->act(now);
    const double h = step_, light = 1.0 / (j.heavy + h * acts.damping);
    const double free = (j.heavy * j.speed + h * (acts.applied - j.against)) * light;
    j.speed = std::copysign(std::max(0.0, std::abs(free) - h * acts.friction * light), free);
    j.angle += h * j.speed;
  }
  void step() {}
  double angle(std::size_t k) const { return joints_[k].angle; }

 private:
  /// What a joint goes through, along a recording and now.
  struct Felt {
    double inertia = 0.0, bias = 0.0, cosine = 0.0, sine = 0.0, position = 0.0;
  };
  struct Track {
    const double *inertia, *bias, *cosine, *sine, *position;
    Index last;
    double turns;
    Felt now;
  };
  struct Joint {
    std::size_t track;
    double weight, armature;
    double angle = 0.0, speed = 0.0;
    double against = 0.0, heavy = 0.0;  ///< in this step
  };
  double step_;
  const ServoRecording& recording_;
  std::vector<const ServoPath*> paths_;
  std::vector<double> weights_;
  std::vector<Track> tracks_;  ///< of sets of the same masses one a joint
  std::vector<Joint> joints_;
};

/// Sets over one window, side by side. What leaves stays where it is.
template <class Bodies>
class Run {
 public:
  /// number: of the recording.
  Run(Bodies* moved, const ServoArm& arm, const ServoRecording& recording, int number,
      const std::vector<const ServoSet*>& sets)
      : moved_(moved), arm_(arm), r_(recording), left_(sets.size(), false), torques_(sets.size(), 0.0) {
    const auto joints = static_cast<Index>(arm.dof.size());
    for (std::size_t k = 0; k < sets.size(); ++k) {
      const Index first = std::max(0, sets[k]->only), end = sets[k]->only < 0 ? joints : sets[k]->only + 1;
      for (Index j = first; j < end; ++j) lanes_.push_back({ServoDrive(arm, recording, *sets[k], number, j), k, j});
    }
    for (const Lane& lane : lanes_) {
      moved->add(lane);
      sags_ = sags_ || lane.drive.sags();
      rotors_ = rotors_ || lane.drive.has_rotor();
    }
  }

  /// Writes a window's rows, from `row` on, of every set. places: their numbers in `out`.
  void window(const ServoWindow& window, Index row, const std::vector<std::size_t>& places, ServoMotion* out) {
    const auto substeps = static_cast<int>(std::lround(r_.step / arm_.step));
    begin(window.first);
    for (Index k = 0; k < window.rows; ++k) {
      for (Lane& lane : lanes_) lane.drive.enter(window.first + k);
      for (int i = 0; i < substeps; ++i) step(window.first + k, i, static_cast<double>(i) / substeps);
      for (std::size_t l = 0; l < lanes_.size(); ++l) {
        const Lane& lane = lanes_[l];
        const std::size_t set = places[lane.set];
        const double q = lane.drive.recorded(moved_->angle(l));
        if (!(std::abs(q) < kServoFar)) left_[lane.set] = true;
        out->position[set](row + k, lane.joint) = std::isfinite(q) ? std::clamp(q, -kServoFar, kServoFar) : kServoFar;
        if (!out->torque.empty()) out->torque[set](row + k, lane.joint) = lane.drive.torque();
      }
    }
  }

 private:
  void begin(Index row) {
    time_ = static_cast<double>(row) * r_.step;
    for (std::size_t l = 0; l < lanes_.size(); ++l) moved_->begin(l, measured(row, l), r_.speed(row, lanes_[l].joint));
    if (rotors_) moved_->weigh(row);
    std::vector<std::pair<double, double>> loads(lanes_.size(), {0.0, 1.0});
    for (std::size_t l = 0; rotors_ && l < lanes_.size(); ++l) loads[l] = {moved_->load(l), moved_->inertia(l)};
    for (std::size_t l = 0; l < lanes_.size(); ++l) {
      const double speed = r_.speed(row, lanes_[l].joint);
      const auto [load, inertia] = loads[l];
      moved_->begin(l, lanes_[l].drive.begin(row, measured(row, l), speed, load, inertia), speed);
    }
  }
  double measured(Index row, std::size_t l) const { return r_.position(row, lanes_[l].joint) - lanes_[l].drive.zero(); }

  /// One step of the simulator, `part` of the way from a row to the next.
  void step(Index row, int number, double part) {
    if (sags_) {
      std::fill(torques_.begin(), torques_.end(), 0.0);
      for (const Lane& lane : lanes_) torques_[lane.set] += std::abs(lane.drive.torque());
    }
    ServoMoment now;
    now.row = row;
    now.step = static_cast<std::size_t>(number);
    now.time = time_;
    bool moves = false;
    moved_->come(row, part);
    for (std::size_t l = 0; l < lanes_.size(); ++l) {
      Lane& lane = lanes_[l];
      if (left_[lane.set]) continue;
      moves = true;
      now.all_torques = torques_[lane.set];
      moved_->look(l, &now);
      moved_->act(l, &lane.drive, now);
    }
    if (moves) moved_->step();
    time_ += arm_.step;
  }

  Bodies* moved_;
  const ServoArm& arm_;
  const ServoRecording& r_;
  std::vector<Lane> lanes_;
  std::vector<char> left_;       ///< of every set
  std::vector<double> torques_;  ///< of every set, of all its drives, in the step before
  double time_ = 0.0;
  bool sags_ = false, rotors_ = false;
};

ServoBodies bodies_of(const ServoWorkspace& w, int bodies) {
  const auto take = [&](const double* from, int width) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(from, width * bodies));
  };
  return {take(w.mass, 1), take(w.ipos, 3), take(w.iquat, 4), take(w.inertia, 3)};
}

void place_bodies(const ServoWorkspace& w, const ServoBodies& b) {
  std::copy(b.mass.begin(), b.mass.end(), w.mass);
  std::copy(b.ipos.begin(), b.ipos.end(), w.ipos);
  std::copy(b.iquat.begin(), b.iquat.end(), w.iquat);
  std::copy(b.inertia.begin(), b.inertia.end(), w.inertia);
}

void require(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

void check_paths(const std::vector<std::vector<ServoPath>>& paths, const std::vector<ServoRecording>& recordings,
                 const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets) {
  for (const std::vector<ServoPath>& kind : paths) {
    require(kind.size() == recordings.size(), "simulate_servos_apart: a path of every recording expected");
    for (const ServoWindow& w : windows) {
      const auto k = static_cast<std::size_t>(w.recording);
      const Eigen::MatrixXd& like = recordings[k].position;
      for (const Eigen::MatrixXd* table : {&kind[k].inertia, &kind[k].bias, &kind[k].cosine, &kind[k].sine})
        require(table->rows() == like.rows() && table->cols() == like.cols() && kind[k].turns.size() == like.cols(),
                "simulate_servos_apart: a path's tables have another shape than its recording");
    }
  }
  for (const ServoSet& s : sets)
    require(s.only < s.chain.rows() && std::max(0, s.bodies) < static_cast<int>(paths.size()),
            "simulate_servos_apart: masses without paths, or no such joint");
}

void check(const ServoArm& arm, const std::vector<ServoRecording>& recordings, const std::vector<ServoWindow>& windows,
           const std::vector<ServoSet>& sets) {
  const auto joints = static_cast<Index>(arm.dof.size());
  require(arm.step > 0.0 && arm.qpos.size() == arm.dof.size(),
          "simulate_servos: an arm with a step and joints expected");
  for (const ServoRecording& r : recordings) {
    require(r.command.cols() == joints && r.position.cols() == joints && r.speed.cols() == joints &&
                r.command.rows() == r.position.rows() && r.speed.rows() == r.position.rows(),
            "simulate_servos: a recording's tables have other shapes than (n, joints)");
    const double steps = r.step / arm.step;
    require(steps > 0.5 && std::abs(steps - std::round(steps)) < 1e-6,
            "simulate_servos: a recording's rows are not a whole number of steps apart");
    for (const Eigen::MatrixXd* table : {&r.gain, &r.supply, &r.enabled, &r.warmth})
      require(table->rows() > 0 && (table->cols() == 1 || table->cols() == joints),
              "simulate_servos: gain, supply, enabled and warmth have shape (n, joints) or (n, 1)");
  }
  for (const ServoWindow& w : windows) {
    require(w.recording >= 0 && static_cast<std::size_t>(w.recording) < recordings.size() && w.first >= 0 &&
                w.rows > 0 && w.first + w.rows < recordings[static_cast<std::size_t>(w.recording)].position.rows(),
            "simulate_servos: a window beyond its recording");
  }
  for (const ServoSet& s : sets) {
    require(s.chain.rows() == joints && s.chain.cols() == kServoFields, "simulate_servos: a chain of another shape");
    require(
        s.charge.size() == 0 || (s.charge.rows() == static_cast<Index>(recordings.size()) && s.charge.cols() == joints),
        "simulate_servos: charges of another shape than (recordings, joints)");
    for (const ServoFunction& f : s.functions)
      require(f.values.size() > 1 && f.width > 0.0, "simulate_servos: a function needs two places or more");
  }
}

/// The row at which each window's begin, and the number of all.
std::vector<Index> rows_of(const std::vector<ServoWindow>& windows) {
  std::vector<Index> rows(1, 0);
  for (const ServoWindow& w : windows) rows.push_back(rows.back() + w.rows);
  return rows;
}

ServoMotion zeros(std::size_t sets, Index rows, Index joints, bool torques) {
  ServoMotion out;
  out.position.assign(sets, Eigen::MatrixXd::Zero(rows, joints));
  if (torques) out.torque = out.position;
  return out;
}

/// Pieces in groups that have up to so many joints together, each group of windows with the same steps between rows.
/// Windows that are as long come one after the other.
std::vector<std::vector<ServoPiece>> grouped(const ServoTask& task, const std::vector<std::size_t>& sets,
                                             std::size_t most) {
  std::vector<std::size_t> windows(task.windows.size());
  std::iota(windows.begin(), windows.end(), std::size_t{0});
  const auto kind = [&](std::size_t k) {
    const ServoWindow& w = task.windows[k];
    return std::make_pair(std::lround(task.recordings[static_cast<std::size_t>(w.recording)].step / task.arm.step),
                          w.rows);
  };
  std::stable_sort(windows.begin(), windows.end(), [&](std::size_t a, std::size_t b) { return kind(a) < kind(b); });
  std::vector<std::vector<ServoPiece>> out;
  std::size_t lanes = most;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    if (k > 0 && kind(windows[k]).first != kind(windows[k - 1]).first) lanes = most;
    for (const std::size_t set : sets) {
      const std::size_t more = task.sets[set].only < 0 ? task.arm.dof.size() : 1;
      if (lanes + more > most) {
        out.emplace_back();
        lanes = 0;
      }
      out.back().push_back({set, windows[k]});
      lanes += more;
    }
  }
  return out;
}

/// Whether all of a set's joints that move may be the kernel's.
bool has_lanes(const ServoTask& task, const ServoSet& set) {
  const auto value = [&](Index j, ServoField field) { return set.chain(j, static_cast<int>(field)); };
  const auto joints = static_cast<Index>(task.arm.dof.size());
  const Index first = std::max(0, set.only), end = set.only < 0 ? joints : set.only + 1;
  for (Index j = first; j < end; ++j)
    if (value(j, ServoField::backlash) > 0.0 || value(j, ServoField::elasticity) > 0.0 ||
        value(j, ServoField::supply_sag) != 0.0)
      return false;
  return true;
}

/// Through the chain as the whole arm has it, the sets of a window side by side.
void run_with_rotors(const ServoTask& task, const std::vector<ServoPiece>& pieces) {
  for (std::size_t first = 0; first < pieces.size();) {
    const std::size_t window = pieces[first].window;
    const auto recording = static_cast<std::size_t>(task.windows[window].recording);
    std::vector<const ServoSet*> sets;
    std::vector<std::size_t> places;
    for (; first < pieces.size() && pieces[first].window == window; ++first) {
      places.push_back(pieces[first].set);
      sets.push_back(&task.sets[pieces[first].set]);
    }
    Apart moved(task.arm, task.recordings[recording], task.paths, recording, sets);
    Run<Apart> run(&moved, task.arm, task.recordings[recording], static_cast<int>(recording), sets);
    run.window(task.windows[window], task.rows[window], places, task.out);
  }
}

}  // namespace

std::vector<std::string> servo_fields() {
  return {"command_gain",
          "integral_gain",
          "damping_gain",
          "gain_law",
          "delay",
          "rate_limit",
          "saturation",
          "drive_law",
          "drive_reference",
          "supply_gain",
          "supply_sag",
          "dead_band",
          "coulomb",
          "viscous",
          "viscous_law",
          "back_emf",
          "limited_damping",
          "stribeck",
          "stribeck_speed",
          "load_friction",
          "asymmetric_friction",
          "presliding",
          "thermal_friction",
          "warmup",
          "spring",
          "current_offset",
          "gravity_scale",
          "armature",
          "backlash",
          "elasticity",
          "motor_encoder",
          "zero"};
}

std::vector<std::string> servo_inputs() {
  return {"speed", "load", "angle", "command_error", "time", "directed_load", "directed_angle"};
}

ServoMotion simulate_servos(const ServoCalls& calls, const std::vector<ServoWorkspace>& workspaces, const ServoArm& arm,
                            const std::vector<ServoBodies>& bodies, const std::vector<ServoRecording>& recordings,
                            const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets, bool torques) {
  require(!workspaces.empty(), "simulate_servos: no workspace");
  check(arm, recordings, windows, sets);
  const std::vector<Index> rows = rows_of(windows);
  ServoMotion out = zeros(sets.size(), rows.back(), static_cast<Index>(arm.dof.size()), torques);
  const ServoBodies nominal = bodies_of(workspaces.front(), arm.bodies);
  std::atomic<std::size_t> next{0};
  const std::size_t count = sets.size() * windows.size();
  // One long piece of work a workspace: pieces of it are dealt out by the counter, and none sees another's numbers.
  const auto work = [&](std::size_t thread) {
    const ServoWorkspace& w = workspaces[thread];
    for (std::size_t k = next++; k < count; k = next++) {
      const std::size_t set = k % sets.size(), window = k / sets.size();
      const ServoRecording& r = recordings[static_cast<std::size_t>(windows[window].recording)];
      for (int i = 0; i < 3; ++i) w.gravity[i] = sets[set].weight_scale * arm.gravity[i];
      if (sets[set].bodies >= 0) place_bodies(w, bodies[static_cast<std::size_t>(sets[set].bodies)]);
      Simulator moved(calls, w, arm);
      Run<Simulator> run(&moved, arm, r, windows[window].recording, {&sets[set]});
      calls.constants(w.model, w.data);
      calls.reset(w.model, w.data);
      run.window(windows[window], rows[window], {set}, &out);
      if (sets[set].bodies >= 0) place_bodies(w, nominal);
    }
  };
  for_each_on_threads(workspaces.size(), static_cast<int>(workspaces.size()), {}, work, 1);
  return out;
}

ServoMotion simulate_servos_apart(const ServoArm& arm, const std::vector<std::vector<ServoPath>>& paths,
                                  const std::vector<ServoRecording>& recordings,
                                  const std::vector<ServoWindow>& windows, const std::vector<ServoSet>& sets,
                                  int threads, bool torques) {
  check(arm, recordings, windows, sets);
  check_paths(paths, recordings, windows, sets);
  const std::size_t joints = arm.dof.size();
  const std::vector<Index> rows = rows_of(windows);
  ServoMotion out = zeros(sets.size(), rows.back(), static_cast<Index>(joints), torques);
  const ServoTask task{arm, paths, recordings, windows, sets, rows, &out};
  std::vector<std::size_t> plain, others;
  for (std::size_t k = 0; k < sets.size(); ++k) (has_lanes(task, sets[k]) ? plain : others).push_back(k);
  const std::vector<std::vector<ServoPiece>> side_by_side = grouped(task, plain, kLanesAtOnce);
  const std::vector<std::vector<ServoPiece>> alone = grouped(task, others, kAtOnce);
  const auto work = [&](std::size_t k) {
    if (k < alone.size()) {
      run_with_rotors(task, alone[k]);
    } else {
      ServoLanes(task, side_by_side[k - alone.size()]).run();
    }
  };
  for_each_on_threads(alone.size() + side_by_side.size(), threads, {}, work, 1);
  return out;
}

}  // namespace truing::dynamics
