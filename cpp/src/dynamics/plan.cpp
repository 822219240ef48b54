// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Motions that tell effects on torques apart: random ones, and the best of them refined.

#include "truing/dynamics/plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "dynamics/effects/families.hpp"
#include "dynamics/filter.hpp"
#include "dynamics/outlook.hpp"
#include "dynamics/payload.hpp"
#include "dynamics/problem.hpp"
#include "dynamics/trajectory.hpp"
#include "math/batch.hpp"
#include "math/text.hpp"

namespace truing {
using namespace dynamics;

bool TorquePlanOptions::is_valid(std::string* error) const {
  const auto fail = [&](const char* why) { return *error = why, false; };
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  if (!(duration >= 10.0 && duration <= 3600.0)) return fail("duration must lie between 10 s and an hour");
  if (!(rate >= 20.0 && rate <= 10000.0)) return fail("rate must lie between 20 Hz and 10 kHz");
  if (!(speed > 0.0 && speed <= 1.0)) return fail("speed must lie above 0 and not above 1");
  if (!positive(usual_speed) || !positive(acceleration) || !positive(reach))
    return fail("usual_speed, acceleration and reach must be positive");
  if (!std::all_of(home.begin(), home.end(), [](double q) { return std::isfinite(q); }))
    return fail("home must be finite");
  if (!positive(payload)) return fail("payload must be positive");
  if (!(temperature_high > temperature_low) || !std::isfinite(temperature_high - temperature_low))
    return fail("temperature_high must be above temperature_low");
  if (!positive(noise) || !std::all_of(torque_noise.begin(), torque_noise.end(), positive))
    return fail("noise and torque_noise must be positive");
  if (!(noise_time >= 0.0 && noise_time <= 10.0)) return fail("noise_time must lie between 0 and 10 s");
  if (!positive(cutoff)) return fail("cutoff must be above 0 Hz");
  if (!(alike > 0.0 && alike < 1.0)) return fail("alike must lie between 0 and 1");
  if (starts < 1 || rounds < 0) return fail("starts must be 1 or more, rounds 0 or more");
  if (threads < 0) return fail("threads must be 0 or more");
  return true;
}

namespace dynamics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kProposals = 4;       ///< of a round
constexpr double kFirstStep = 0.5;  ///< of what random motions differ by
constexpr double kLastStep = 0.1;
constexpr double kLittleTorque = 0.05;  ///< of the largest joint's: no joint's noise is less than that of so much

/// What will be recorded beside joints and torques.
struct Columns {
  bool current = false, torque = false, payload = false, temperature = false;
};

Columns columns_of(const TorquePlanOptions& options) {
  Columns out;
  for (const std::string& name : options.columns) {
    if (name == "current") {
      out.current = true;
    } else if (name == "torque") {
      out.torque = true;
    } else if (name == "payload") {
      out.payload = true;
    } else if (name == "temp") {
      out.temperature = true;
    } else {
      throw std::invalid_argument("columns: found '" + name + "', expected words of current, torque, payload, temp");
    }
  }
  return out;
}

/// All that is recorded, once each: every payload at every temperature.
std::vector<TorqueRun> runs_of(const TorquePlanOptions& options) {
  const Columns columns = columns_of(options);
  std::vector<TorqueRun> out;
  for (const double payload : {0.0, options.payload}) {
    if (payload > 0.0 && !columns.payload) continue;
    if (!columns.temperature) {
      out.push_back({payload});
      continue;
    }
    out.push_back({payload, options.temperature_low});
    out.push_back({payload, options.temperature_high});
  }
  return out;
}

/// The motion as it would be recorded; torques are not there yet, and zero.
std::vector<Recording> recorded(const MatrixXd& position, const std::vector<TorqueRun>& runs,
                                const TorquePlanOptions& options) {
  const Columns columns = columns_of(options);
  std::vector<Recording> out;
  for (const TorqueRun& run : runs) {
    Recording one;
    one.name = "planned";
    one.time = VectorXd::LinSpaced(position.rows(), 0.0, static_cast<double>(position.rows() - 1) / options.rate);
    one.position = position;
    one.torque = MatrixXd::Zero(position.rows(), position.cols());
    if (columns.payload) one.columns[kPayload] = VectorXd::Constant(position.rows(), run.payload);
    if (columns.temperature) one.columns["temp_C"] = VectorXd::Constant(position.rows(), run.temperature);
    out.push_back(std::move(one));
  }
  return out;
}

bool keeps_passive_limits(const Robot& robot, const MatrixXd& position) {
  for (std::size_t k = 0; k < robot.joints.size(); ++k) {
    if (!robot.joints[k].passive()) continue;
    VectorXd motion = VectorXd::Constant(position.rows(), robot.joints[k].offset);
    const std::vector<std::size_t> driven = robot.driven_joints();
    for (const auto& [name, weight] : robot.joints[k].driven_by) {
      const std::size_t by = robot.joint_index(name);
      const auto at = std::find(driven.begin(), driven.end(), by);
      if (at == driven.end()) continue;  // one that is driven in turn
      const Joint& joint = robot.joints[by];
      motion.array() += weight * (joint.ratio * position.col(at - driven.begin()).array() + joint.offset);
    }
    if (motion.minCoeff() < robot.joints[k].lower || motion.maxCoeff() > robot.joints[k].upper) return false;
  }
  return true;
}

/// Everything that the search asks again and again.
class Planner {
 public:
  Planner(const Robot& robot, const TorquePlanOptions& options)
      : robot_(robot), options_(options), limits_(motion_limits(robot, options)), runs_(runs_of(options)) {
    start_ = draw(0);
    set_noise();
    design_ = design_within(planned_range());
    check_requests();
    for (const TorqueGroup& group : design_.groups) {
      if (!group.standard) all_.insert(all_.end(), group.columns.begin(), group.columns.end());
    }
  }

  const std::vector<TorqueRun>& runs() const { return runs_; }
  const std::vector<double>& noise() const { return noise_; }
  const Trajectory& start() const { return start_; }

  Trajectory draw(std::uint64_t number) const {
    math::Random random(options_.seed * 1000003ull + number);
    return random_trajectory(limits_.home.size(), &random);
  }
  MatrixXd positions(const Trajectory& trajectory) const {
    return sampled(trajectory, limits_, options_.duration, options_.rate);
  }

  /// What a search makes as large as it can [nats].
  double worth(const Trajectory& trajectory) const {
    const MatrixXd position = positions(trajectory);
    if (!keeps_passive_limits(robot_, position)) return -std::numeric_limits<double>::infinity();
    const std::vector<Recording> recordings = recorded(position, runs_, options_);
    const Information information =
        information_of(Tiles(recordings, robot_, prepare(), 1), design_, noise_, options_.noise_time);
    return options_.separate.empty() ? nats(information, design_, all_) : nats_apart(information);
  }

  TorqueOutlook outlook(const std::vector<Recording>& recordings, std::vector<TorqueEffectPair>* separated) const {
    const Tiles tiles(recordings, robot_, prepare(), options_.threads);
    MotionRange range = range_of(tiles);
    range.torque = torque_;
    const TorqueDesign design = design_within(range);
    const Information information = information_of(tiles, design, noise_, options_.noise_time);
    const std::vector<bool> wanted = wanted_in(design);
    if (separated && !options_.separate.empty())
      *separated = pairs_of(information, design, options_.own_effects, wanted);
    TorqueOutlook out = outlook_of(information, design, robot_, options_.own_effects, wanted, options_.alike);
    say_what_was_asked_only(&out.not_testable);
    return out;
  }

  std::vector<Recording> recordings_along(const MatrixXd& position) const {
    return recorded(position, runs_, options_);
  }

 private:
  void say_what_was_asked_only(std::vector<NotTestable>* not_testable) const {
    if (options_.separate.empty()) return;
    const auto other = [&](const NotTestable& n) {
      return std::none_of(options_.separate.begin(), options_.separate.end(),
                          [&](const EffectRequest& request) { return request.effect == n.effect; });
    };
    not_testable->erase(std::remove_if(not_testable->begin(), not_testable->end(), other), not_testable->end());
  }

  PrepareOptions prepare() const {
    PrepareOptions out;
    out.cutoff = options_.cutoff;
    out.torque_per_ampere.assign(robot_.driven_count(), 1.0);
    return out;
  }

  /// Torques along the first random motion are what sizes and noise are measured by.
  void set_noise() {
    const MatrixXd position = positions(start_);
    std::vector<Recording> recordings = recorded(position, {runs_.front()}, options_);
    const TorqueModel nominal(robot_, {});
    MatrixXd squares = MatrixXd::Zero(1, position.cols()), sums = squares;
    double n = 0.0;
    for_each_tile(recordings.front(), 0, robot_, prepare(), [&](Tile& tile) {
      const MatrixXd torque = own_torque(nominal, &tile);
      squares += torque.array().square().matrix().colwise().sum();
      sums += torque.colwise().sum();
      n += static_cast<double>(torque.rows());
      return true;
    });
    torque_ = (squares / n - (sums / n).array().square().matrix()).cwiseMax(0.0).cwiseSqrt().transpose();
    torque_ = torque_.cwiseMax(kLittleTorque * torque_.maxCoeff());
    if (!(torque_.maxCoeff() > 0.0))
      throw std::invalid_argument("no motion of this robot takes a torque: its links have no mass that is moved");
    if (!options_.torque_noise.empty() && options_.torque_noise.size() != static_cast<std::size_t>(torque_.size()))
      throw std::invalid_argument("torque_noise has " + std::to_string(options_.torque_noise.size()) +
                                  " numbers, expected " + std::to_string(torque_.size()) +
                                  ", one for each joint with a reading");
    noise_ = options_.torque_noise;
    for (Index j = 0; noise_.size() < static_cast<std::size_t>(torque_.size()); ++j)
      noise_.push_back(options_.noise * torque_[j]);
  }

  /// As far as motions may go, so that all of them are measured by the same columns.
  MotionRange planned_range() const {
    MotionRange out;
    out.lower = limits_.lower;
    out.upper = limits_.upper;
    out.speed = limits_.speed;
    out.acceleration = limits_.acceleration;
    out.torque = torque_;
    out.turns.resize(robot_.driven_count());
    out.duration = options_.duration;
    const Columns columns = columns_of(options_);
    if (columns.payload) out.columns[kPayload] = {0.0, options_.payload};
    if (columns.temperature) out.columns["temp_C"] = {options_.temperature_low, options_.temperature_high};
    return out;
  }

  TorqueDesign design_within(const MotionRange& range) const {
    std::set<std::string> left_out;
    for (const TorqueEffect& effect : torque_catalogue()) {  // a sensor of torque has no motor's constant
      if (effect.traits.scales_masses && columns_of(options_).torque) left_out.insert(effect.name);
    }
    return design_of(robot_, range, options_.own_effects, left_out, true);
  }

  void check_requests() const {
    for (const EffectRequest& request : options_.separate) {
      const TorqueEffect& effect = find_torque_effect(request.effect, options_.own_effects);
      if (effect.traits.standard)
        throw std::invalid_argument("separate: '" + effect.name +
                                    "' is fitted in any case; name effects that compete beside it");
      for (const std::string& joint : request.joints) driven_number(robot_, joint);
    }
    const std::vector<bool> wanted = wanted_in(design_);
    for (const EffectRequest& request : options_.separate) {
      const bool there = std::any_of(design_.groups.begin(), design_.groups.end(),
                                     [&](const TorqueGroup& g) { return is_meant(request, g); });
      if (there) continue;
      for (const NotTestable& n : design_.not_testable)
        if (n.effect == request.effect) throw std::invalid_argument("separate: '" + n.effect + "': " + n.why);
      throw std::invalid_argument("separate: '" + request.effect + "' does not act at these joints");
    }
  }

  static bool is_meant(const EffectRequest& request, const TorqueGroup& group) {
    if (group.effect != request.effect || group.standard) return false;
    return request.joints.empty() || (!group.joints.empty() && std::find(request.joints.begin(), request.joints.end(),
                                                                         group.joints.front()) != request.joints.end());
  }

  std::vector<bool> wanted_in(const TorqueDesign& design) const {
    std::vector<bool> out;
    for (const TorqueGroup& group : design.groups) {
      const bool meant = options_.separate.empty() ||
                         std::any_of(options_.separate.begin(), options_.separate.end(),
                                     [&](const EffectRequest& request) { return is_meant(request, group); });
      out.push_back(meant && !group.standard);
    }
    return out;
  }

  /// Of every two effects to be told apart what one tells beside the other; the least counts, the others a little.
  double nats_apart(const Information& information) const {
    constexpr double kOthers = 0.1;
    std::vector<std::vector<int>> columns;  // by effect and place, all forms
    std::vector<const TorqueGroup*> places;
    const std::vector<bool> wanted = wanted_in(design_);
    for (std::size_t g = 0; g < design_.groups.size(); ++g) {
      const TorqueGroup& group = design_.groups[g];
      if (!wanted[g]) continue;
      if (places.empty() || places.back()->effect != group.effect || places.back()->joints != group.joints) {
        places.push_back(&group);
        columns.emplace_back();
      }
      columns.back().insert(columns.back().end(), group.columns.begin(), group.columns.end());
    }
    if (columns.size() == 1) return nats_beside(information, design_, columns.front(), rest_of(columns.front()));
    double least = std::numeric_limits<double>::infinity(), sum = 0.0, n = 0.0;
    for (std::size_t a = 0; a < columns.size(); ++a) {
      for (std::size_t b = 0; b < columns.size(); ++b) {
        if (a == b) continue;
        const double apart = nats_beside(information, design_, columns[a], columns[b]);
        least = std::min(least, apart);
        sum += apart;
        n += 1.0;
      }
    }
    return least + kOthers * sum / n;
  }

  std::vector<int> rest_of(const std::vector<int>& columns) const {
    std::vector<int> out;
    std::copy_if(all_.begin(), all_.end(), std::back_inserter(out),
                 [&](int c) { return std::find(columns.begin(), columns.end(), c) == columns.end(); });
    return out;
  }

  const Robot& robot_;
  const TorquePlanOptions& options_;
  MotionLimits limits_;
  std::vector<TorqueRun> runs_;
  Trajectory start_;
  VectorXd torque_;            ///< [Nm | N] standard deviation along the first random motion
  std::vector<double> noise_;  ///< [Nm | N]
  TorqueDesign design_;
  std::vector<int> all_;  ///< columns of all candidates
};

/// A motion and what it is worth [nats].
struct Valued {
  Trajectory trajectory;
  double worth = -std::numeric_limits<double>::infinity();
};

/// The best of these, and the first of equals.
Valued best_of(const Planner& planner, const std::vector<Trajectory>& trajectories, int threads) {
  std::vector<double> worth(trajectories.size());
  for_each_on_threads(
      trajectories.size(), threads, {}, [&](std::size_t k) { worth[k] = planner.worth(trajectories[k]); }, 1);
  const auto best = static_cast<std::size_t>(std::max_element(worth.begin(), worth.end()) - worth.begin());
  return {trajectories[best], worth[best]};
}

/// Random ones, then small changes of the best, ever smaller.
Valued searched(const Planner& planner, const TorquePlanOptions& options, int* evaluated) {
  std::vector<Trajectory> trajectories;
  for (int k = 0; k < options.starts; ++k) trajectories.push_back(planner.draw(static_cast<std::uint64_t>(k)));
  Valued best = best_of(planner, trajectories, options.threads);
  *evaluated = options.starts;
  math::Random random(options.seed * 1000003ull + 999983ull);
  for (int round = 0; round < options.rounds; ++round) {
    const double part = static_cast<double>(round) / std::max(1, options.rounds - 1);
    const double step = kFirstStep * std::pow(kLastStep / kFirstStep, part);
    trajectories.clear();
    for (int k = 0; k < kProposals; ++k) trajectories.push_back(varied(best.trajectory, step, &random));
    Valued next = best_of(planner, trajectories, options.threads);
    *evaluated += kProposals;
    if (next.worth > best.worth) best = std::move(next);
  }
  return best;
}

std::vector<Recording> without_torques(std::vector<Recording> recordings, const Robot& robot) {
  for (Recording& recording : recordings) {
    validate(recording, robot);
    recording.torque = MatrixXd::Zero(recording.position.rows(), recording.position.cols());
  }
  return recordings;
}

}  // namespace

TorquePlan plan(const Robot& given, const TorquePlanOptions& options, const std::vector<Recording>& recordings) {
  std::string error;
  if (!options.is_valid(&error)) throw std::invalid_argument(error);
  validate(given);
  if (std::none_of(given.joints.begin(), given.joints.end(), [](const Joint& j) { return j.mass.value_or(0.0) > 0.0; }))
    throw std::invalid_argument("no link of the robot has a mass: torques need mass, centre of mass and inertia");
  Robot robot = given;
  robot.torque_effects.clear();  // effects compete, whether the robot has them or not
  const Planner planner(robot, options);
  TorquePlan out;
  const Valued best = searched(planner, options, &out.evaluated);
  if (!std::isfinite(best.worth))
    throw std::invalid_argument(
        "no random motion keeps the limits of the passive joints: give a smaller reach, or home");
  out.information = best.worth;
  out.information_random = planner.worth(planner.start());
  out.position = planner.positions(best.trajectory);
  const double step = 1.0 / options.rate;
  out.time = VectorXd::LinSpaced(out.position.rows(), 0.0, static_cast<double>(out.position.rows() - 1) * step);
  out.speed = rate_of(out.position, step);
  out.acceleration = rate_of(out.speed, step);
  out.runs = planner.runs();
  out.planned = planner.outlook(planner.recordings_along(out.position), &out.separated);
  out.random = planner.outlook(planner.recordings_along(planner.positions(planner.start())), nullptr);
  if (!recordings.empty()) out.given = planner.outlook(without_torques(recordings, robot), nullptr);
  out.torque_noise = planner.noise();
  out.warnings.push_back(
      "collisions are not looked at, of the arm with itself and with what stands around it: try the motion slowly, or "
      "in a simulator");
  return out;
}

}  // namespace dynamics
}  // namespace truing
