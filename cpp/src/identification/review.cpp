// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// Whether what was found can be believed, and which mistake of the robot file or the columns would explain it.

#include "truing/review.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <utility>

#include "math/constants.hpp"
#include "math/text.hpp"
#include "model/frame_change.hpp"
#include "model/model.hpp"
#include "model/motion.hpp"
#include "model/readings.hpp"
#include "model/repeats.hpp"
#include "model/row_slip.hpp"
#include "model/time_series.hpp"
#include "rooms.hpp"

namespace truing {
using namespace identification;

namespace identification {
namespace {

// What a workshop makes: links differ from the drawing by less.
constexpr double kLength = 0.01;          ///< [m]
constexpr double kShareOfReach = 0.02;    ///< of the robot's reach, if that is more
constexpr double kAngle = 3.0 * kDegree;  ///< [rad]
constexpr double kRatio = 0.05;           ///< of a gear ratio
constexpr double kSigmas = 3.0;           ///< a parameter that the data hardly see may wander

constexpr double kWorthALook = 0.001;  ///< of the measured range: more left than this, and readings are tried
constexpr double kBetter = 0.5;        ///< a reading that leaves less than this fraction explains the data
constexpr double kAsGood = 1.5;        ///< times the error of the fit as it is, that a reading's own fit may leave
constexpr std::size_t kTried = 3;      ///< readings refitted, the best first
constexpr std::size_t kRows = 400;     ///< that readings are compared on
constexpr int kIterations = 30;        ///< a reading that needs more explains nothing

/// A link that is another one's misses by a good part of its change, whatever base and tool do: where the robot as
/// drawn misses by less than this part, it is the fit that went astray, and not the drawing.
constexpr double kMissed = 0.05;

/// Rows that the fit counted: not held out, not rejected.
std::vector<std::int32_t> fitted_rows(const Identification& found) {
  const std::set<std::size_t> rejected(found.rejected_rows.begin(), found.rejected_rows.end());
  std::vector<std::int32_t> out;
  for (std::size_t row = 0; row < found.set.size(); ++row) {
    if (found.set[row] == 0 && rejected.count(row) == 0) out.push_back(static_cast<std::int32_t>(row));
  }
  return out;
}

/// As many as the rows after a missing one might be: a fit that bears gross errors may be none the worse for them.
bool has_rows_far_out(const Identification& found) {
  constexpr std::size_t kSeveral = 8;
  constexpr double kFarOut = 10.0;
  return found.rejected_rows.size() >= kSeveral || found.train.after.p95 > kFarOut * found.train.after.median;
}

/// By how much a parameter changed; whole turns are none.
double change_of(const Parameter& p) {
  const double change = p.value - p.nominal;
  return std::abs(p.unit == "rad" ? std::remainder(change, kTwoPi) : change);
}

/// The value of a link that its joint's motion adds to; of joint origins, the one most along the axis.
std::string zero_of(const Joint& joint, Convention convention) {
  const bool turns = joint.type == JointType::revolute;
  if (convention != Convention::urdf) return turns ? "theta" : "d";
  int along = 0;
  (joint.T_parent_joint.linear() * joint.axis).cwiseAbs().maxCoeff(&along);
  return (turns ? "r" : "") + std::string(1, "xyz"[along]);
}

/// Which changes of the robot exceed what a workshop makes.
class Workshop {
 public:
  Workshop(const Robot& nominal, const Measurements& data)
      : reach_(stretched_length(nominal)), length_(std::max(kLength, kShareOfReach * reach_)) {
    for (const ParameterInfo& info : make_model(nominal, data).parameters) {
      if (info.role == Role::geometry || info.role == Role::offset || info.role == Role::ratio)
        robot_.insert(info.name);
      if (info.role == Role::offset) zeros_.insert(info.name);
    }
    for (const Joint& joint : nominal.joints) zeros_.insert(joint.name + "." + zero_of(joint, nominal.convention));
  }

  /// By how many times a change exceeds it; 0: it does not.
  double excess(const Parameter& p) const {
    if (p.frozen || !robot_.count(p.name)) return 0.0;
    const double limit = p.unit == "m" ? length_ : p.unit == "rad" ? kAngle : kRatio;
    const double change = change_of(p) - (p.sigma > 0.0 ? kSigmas * p.sigma : 0.0);
    return change > limit ? change / limit : 0.0;
  }

  /// Zeros of joints among them: a sign is fitted by one that turns half round, too.
  std::vector<Parameter> changes(const Identification& found) const {
    std::vector<Parameter> out;
    Eigen::Index at = 0;
    for (Parameter p : found.parameters) {
      if (!p.frozen) p.sigma = found.local_sigma[at++];  // other fits end elsewhere, but as far off
      if (excess(p) > 0.0) out.push_back(p);
    }
    std::stable_sort(out.begin(), out.end(),
                     [&](const Parameter& a, const Parameter& b) { return excess(a) > excess(b); });
    return out;
  }

  /// Those that a drawing which misses by `missed` [m] can be wrong by, without zeros of joints: a controller may count
  /// from anywhere.
  std::vector<Parameter> of_drawing(std::vector<Parameter> changes, double missed) const {
    const auto is_none = [&](const Parameter& p) {
      const double motion = change_of(p) * (p.unit == "m" ? 1.0 : reach_);
      return zeros_.count(p.name) > 0 || missed < kMissed * motion;
    };
    changes.erase(std::remove_if(changes.begin(), changes.end(), is_none), changes.end());
    return changes;
  }

 private:
  double reach_, length_;
  std::set<std::string> robot_, zeros_;
};

/// Base, targets and what else `identify` was asked for, fitted to a few rows of one reading.
class Trials {
 public:
  Trials(const Measurements& data, const IdentifyOptions& options)
      : sample_(sample_of(data, kRows)), options_(options) {
    options_.test_share = 0.0;
    options_.resamples = 0;
    options_.bounds.clear();
    options_.solver = Solver::lm;
    options_.frame_by = FrameBy::parameters;
    options_.max_iterations = std::min(options_.max_iterations, 200);
  }

  Identification everything(const Robot& robot, const Measurements& data) const {
    return identify(robot, thinned(data), options_);
  }

  /// Median error with base and targets fitted alone. [m]
  double error(const Robot& robot, const Measurements& data) const {
    return identify(robot, thinned(data), frames_alone(robot)).train.after.median;
  }

  /// Another reading of the orientations that agrees with the robot, where these do not.
  std::optional<BetterOrientations> orientations(const Robot& robot, const Measurements& data) const {
    IdentifyOptions every_row = frames_alone(robot);
    every_row.loss = Loss::none;  // what rejects most rows fits the rest under any reading
    return better_orientations(robot, data, [&](const Measurements& read) {
      try {
        return identify(robot, thinned(read), every_row).train.after;
      } catch (const std::invalid_argument&) {  // nothing can be found under this reading
        ErrorStatistics none;
        none.rotation_rms = kNaN;
        return none;
      }
    });
  }

  /// From where on everything was measured in another frame, if it was; `robot`: as found. With it the median errors of
  /// all rows with one base and targets, and of the part that is worse with its own [m].
  struct Moved {
    FrameChange change;
    double together, apart;
  };
  std::optional<Moved> moved_instrument(const Robot& robot, const Measurements& data) const {
    if (!has_one_frame(data) || robot.targets.size() > 1) return {};
    const Residuals off = residuals(robot, data, options_.own_effects, options_.threads);
    const std::optional<FrameChange> change = find_frame_change(data, off.position);
    if (!change) return {};
    const auto at = static_cast<std::size_t>(change->row);
    const double apart = std::max(error_of(robot, data, 0, at), error_of(robot, data, at, data.rows));
    const double together = error_of(robot, data, 0, data.rows);
    if (!(apart < kOfTwoFrames * together)) return {};
    return Moved{*change, together, apart};
  }

  /// How much later the joints are to be taken of a robot that moved while it was measured, if that explains far more;
  /// and the median errors without and with it, base and targets fitted [m].
  struct Lag {
    double later, as_is, left;
  };
  std::optional<Lag> lag(const Robot& robot, const Measurements& data) const {
    const auto error_later = [&](double later) {
      const Measurements then = with_joints_at(data, later);
      return has_most_rows(then) ? error(robot, then) : std::numeric_limits<double>::infinity();
    };
    Lag out{best_lag(error_later), error_later(0.0), 0.0};
    out.left = error_later(out.later);
    if (!(out.left < kBetter * out.as_is)) return {};
    return out;
  }

  /// The same, with links as they are found without it: those of `robot` may have been fitted to the lag.
  std::optional<Lag> lag_apart(const Robot& nominal, const Robot& robot, const Measurements& data) const {
    constexpr int kRounds = 3;
    std::optional<Lag> out = lag(robot, data);
    for (int round = 0; out && round < kRounds; ++round) {
      const std::optional<Lag> next = lag(everything(nominal, with_joints_at(data, out->later)).robot, data);
      if (!next || !(next->left < out->left)) break;
      out = next;
    }
    return out;
  }

  /// From where on joints and measurements are some rows apart, if they are.
  std::optional<RowSlip> slip(const Robot& robot, const Measurements& data) const {
    FramesFit frames;
    frames.fit = [&](const Measurements& rows) {
      Measurements all = rows;
      all.set.assign(rows.rows, 0);
      return identify(robot, all, frames_alone(robot)).robot;
    };
    frames.errors = [&](const Robot& fitted, const Measurements& rows) {
      const Residuals left = residuals(fitted, rows, options_.own_effects, options_.threads);
      std::vector<double> lengths(rows.rows);
      for (std::size_t row = 0; row < rows.rows; ++row) {
        const auto i = static_cast<Eigen::Index>(row);
        lengths[row] = rows.has_distance(row) ? std::abs(left.distance[i]) : left.position.row(i).norm();
      }
      return lengths;
    };
    return find_row_slip(data, frames);
  }

 private:
  IdentifyOptions frames_alone(const Robot& robot) const {
    IdentifyOptions frames = options_;
    frames.free.clear();
    for (const Target& target : robot.targets) frames.free.push_back(target.name + ".*");
    if (frames.free.empty()) frames.free.push_back("tool.*");
    frames.effects.clear();
    frames.priors.clear();
    frames.max_iterations = std::min(frames.max_iterations, kIterations);
    return frames;
  }

  /// Median error of rows `begin` to `end` with base and targets fitted to these alone [m].
  double error_of(const Robot& robot, const Measurements& data, std::size_t begin, std::size_t end) const {
    std::vector<double> weights(data.rows, 0.0);
    for (std::size_t row = begin; row < end; ++row) weights[row] = data.weight ? data.weight[row] : 1.0;
    Measurements part = data;
    part.weight = {weights.data(), 1};
    part.set.assign(data.rows, 0);
    return identify(robot, part, frames_alone(robot)).train.after.median;
  }

  /// Some rows, without those that do not count.
  Measurements thinned(const Measurements& data) const {
    const auto weights = std::make_shared<std::vector<double>>(sample_.weights);
    for (const std::int32_t row : sample_.rows) {
      const auto at = static_cast<std::size_t>(row);
      if (data.weight && data.weight[at] == 0.0) (*weights)[at] = 0.0;
    }
    Measurements out = data;
    out.owner = std::make_shared<std::pair<std::shared_ptr<const void>, std::shared_ptr<std::vector<double>>>>(
        data.owner, weights);
    out.weight = {weights->data(), 1};
    out.set.assign(data.rows, 0);
    return out;
  }

  RowSample sample_;
  IdentifyOptions options_;
};

struct Tried {
  Reading reading;
  double error = 0.0;  ///< [m of the data as handed over], base and targets fitted
};

/// Readings that explain far more than what was handed over, the best first. `Reading::data` are of few rows each.
std::vector<Tried> better_readings(const Robot& robot, const Measurements& data, const Trials& trials, double as_is) {
  std::vector<Tried> out;
  for (const auto& make_reading : readings_of(robot, data)) {
    Reading reading = make_reading();
    double error = kNaN;
    try {
      error = trials.error(reading.robot, reading.data) / reading.length_scale;
    } catch (const std::invalid_argument&) {
      continue;  // nothing can be found under this reading
    }
    if (!(error < kBetter * as_is)) continue;
    out.push_back({std::move(reading), error});
    std::sort(out.begin(), out.end(), [](const Tried& a, const Tried& b) { return a.error < b.error; });
    if (out.size() > kTried) out.pop_back();
  }
  return out;
}

std::string change_text(const Parameter& p) {
  const double change = change_of(p);
  return p.name + " by " +
         (p.unit == "m"     ? millimetres(change)
          : p.unit == "rad" ? degrees(change)
                            : number(100.0 * change, 3) + " %");
}

std::string changes_text(const std::vector<Parameter>& changes) {
  constexpr std::size_t kSaid = 4;
  std::vector<std::string> said;
  for (std::size_t k = 0; k < std::min(kSaid, changes.size()); ++k) said.push_back(change_text(changes[k]));
  const std::string more = changes.size() > kSaid ? " and " + std::to_string(changes.size() - kSaid) + " more" : "";
  return "the fit changes " + listed(said) + more + ", more than a workshop makes";
}

Mistake explained_by(const Tried& best, double as_is, std::vector<Parameter> changes) {
  const std::string fitted = changes.empty() ? "." : ": as it is, " + changes_text(changes) + ".";
  return {best.reading.kind,
          best.reading.text + " leaves a median error of " + millimetres(best.error) + " in place of " +
              millimetres(as_is) + " with base and tool fitted. Correct it and run again" + fitted,
          std::move(changes)};
}

Mistake slipped(const RowSlip& slip, std::vector<Parameter> changes) {
  return {"row_shift",
          text_of(slip) + ": that leaves a median error of " + millimetres(slip.after) + " from there on in place of " +
              millimetres(slip.before) + " with base and tool fitted. Correct it and run again.",
          std::move(changes)};
}

Mistake moved_from(const Trials::Moved& moved, std::vector<Parameter> changes) {
  return {"frame_change",
          text_of(moved.change) + ". With base and tool of its own either part leaves a median error of " +
              millimetres(moved.apart) + " or less, both together " + millimetres(moved.together) +
              ". Bring all rows into one frame, or identify the parts by themselves.",
          std::move(changes)};
}

Mistake late(const Trials::Lag& lag, std::vector<Parameter> changes) {
  return {"lag",
          text_of_lag(lag.later) + ". That leaves a median error of " + millimetres(lag.left) + " in place of " +
              millimetres(lag.as_is) +
              " with base and tool fitted. Correct the times of the joints and run again; diagnose goes on without.",
          std::move(changes)};
}

Mistake turned(const BetterOrientations& better, std::vector<Parameter> changes) {
  return {better.reading.kind, text_of(better), std::move(changes)};
}

Mistake unexplained(std::vector<Parameter> changes) {
  return {"unexplained",
          changes_text(changes) +
              ", and no sign, order or unit of columns and no other convention of the links explains it: is it the "
              "right robot file, and is every link of it right?",
          std::move(changes)};
}

}  // namespace
}  // namespace identification

std::optional<Mistake> review(const Robot& nominal, const Measurements& data, const Identification& found,
                              const IdentifyOptions& options) {
  const Workshop workshop(nominal, data);
  const Trials trials(data, options);
  std::vector<Parameter> changes = workshop.changes(found);
  if (found.train.after.rotation_rms > kAngle) {
    if (const auto better = trials.orientations(nominal, data)) return turned(*better, std::move(changes));
  }
  for (const Robot* robot : {&found.robot, &nominal}) {
    if (const auto moved = trials.moved_instrument(*robot, data)) return moved_from(*moved, std::move(changes));
  }
  if (options.own_effects.empty() && moved_while_measured(data)) {  // which may look values up by row
    const Measurements some = middle_rows(data, kRowsOfLag);
    if (const auto lag = Trials(some, options).lag_apart(nominal, found.robot, some))
      return late(*lag, std::move(changes));
  }
  const bool much_left = found.train.after.median > kWorthALook * measured_range(data, fitted_rows(found));
  if (changes.empty() && !much_left && !has_rows_far_out(found)) return std::nullopt;
  if (const std::optional<RowSlip> slip = trials.slip(nominal, data)) return slipped(*slip, std::move(changes));
  if (changes.empty() && !much_left) return std::nullopt;
  const double as_is = trials.error(nominal, data);
  const double fitted = found.train.after.median;
  for (const Tried& tried : better_readings(nominal, data, trials, as_is)) {
    const Identification other = trials.everything(tried.reading.robot, tried.reading.data);
    const double left = other.train.after.median / tried.reading.length_scale;
    const std::size_t still = workshop.changes(other).size();
    if (changes.empty() ? left < kBetter * fitted : still < changes.size() && left < kAsGood * fitted)
      return explained_by(tried, as_is, std::move(changes));
  }
  changes = workshop.of_drawing(std::move(changes), as_is);
  if (changes.empty()) return std::nullopt;
  return unexplained(std::move(changes));
}

std::optional<double> noise_from_repeats(const Measurements& data) {
  const Repeats repeats = noise_of_repeats(data);
  if (!repeats.enough()) return std::nullopt;
  return repeats.sigma;
}

}  // namespace truing
