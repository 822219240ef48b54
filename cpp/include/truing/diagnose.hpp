// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "truing/common/not_testable.hpp"
#include "truing/identify.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing {

struct DiagnoseOptions {
  std::vector<Effect> own_effects;     ///< take part beside the catalogue
  std::vector<std::string> leave_out;  ///< effects that are not to be considered, by name
  double false_alarm = 0.01;           ///< chance that a robot without any gap is said to have one
  int max_effects = 12;                ///< at most so many are named
  double test_share = 0.2;             ///< of the pose groups, held out when `set` is absent
  std::size_t search_poses = 6000;     ///< of more pose groups, so many are searched; errors are those of all rows
  int resamples =
      60;  ///< draws of folds for the intervals, what was chosen fitted again; at most 10 more repeat the selection
  double rotation_length = 0.1;   ///< [m]: a rotation error of 1 rad counts as this length in reported errors
  std::uint64_t seed = 0;         ///< of the split and of every simulation
  int threads = 0;                ///< 0: as many as the machine has
  std::vector<std::string> also;  ///< effects that are considered only when they are asked for, by name

  /// False, and why, when an option makes no sense.
  bool is_valid(std::string* error) const;
};

enum class Verdict {
  none,                 ///< no gap beyond noise
  effects,              ///< named, and nothing is left
  unknown,              ///< a gap that no effect of the catalogue explains
  effects_and_unknown,  ///< named, and something is left
};

/// A share and its 90 % interval.
struct Share {
  double value = 0.0;
  double low = 0.0;
  double high = 0.0;
};

/// An effect that would explain the data as well.
struct Alternative {
  std::string effect;
  std::vector<std::string> joints;
  double probability = 0.0;  ///< its part of the class's probability
  std::string separated_by;  ///< what to measure to tell
};

/// A fitted law, or a free function, drawn against its input: value at the site in rad or m.
struct Curve {
  std::string site;                            ///< what moves: a joint's name, "base.x" …
  std::string input;                           ///< "q4", "torque2", "temp", "time", "dir3", "payload", a covariate
  std::string second_input;                    ///< of a function of two inputs: this curve is for its values from …
  double second_low = 0.0, second_high = 0.0;  ///< … to
  std::string input_unit, unit;
  std::vector<std::array<double, 3>> points;   ///< input, value, standard error
  std::vector<std::array<double, 2>> samples;  ///< input, value: what single poses say (at most 600)
};

/// One effect found.
struct FoundEffect {
  std::string effect;
  std::vector<std::string> joints;
  double probability = 0.0;           ///< of the class: this effect or one of `confounded_with`
  std::vector<Parameter> parameters;  ///< value and standard error
  ErrorStatistics held_out_before;    ///< without this effect, all others in (last in) [m]
  ErrorStatistics held_out_after;     ///< with all named effects [m]
  Share shrink;                       ///< of the held-out rms, 1 - after / before
  double share = 0.0;        ///< of the gap's mean square; those of all effects and unknowns add up to what was closed
  double share_alone = 0.0;  ///< of the gap's mean square that it closes when it is the only one
  double share_last = 0.0;   ///< that it closes when all others are in already
  std::vector<Alternative> confounded_with;
  std::string note;  ///< "not linear in the torque", "direction inferred from the order of poses" …
  std::string
      identify_as;  ///< what `truing identify --effects` takes for it: "backlash:J3"; empty: a frame that wanders
  std::vector<Curve> curves;  ///< the law drawn through what single poses say
};

/// Something is left: a joint that moves as a smooth, stepwise or two-input function of recorded inputs; or more than
/// repeats show, and no such function describes it.
struct UnknownEffect {
  std::string joint;                ///< a joint's name, "base", or "" when only "somewhere" can be said
  std::vector<std::string> inputs;  ///< one or two; none: no function of them describes it
  double probability = 0.0;
  ErrorStatistics held_out_before, held_out_after;
  Share shrink;
  double share = 0.0;  ///< of the gap's mean square, as FoundEffect::share
  std::vector<Curve>
      curves;              ///< along the first input (of two inputs: one curve for each of three ranges of the second)
  std::string looks_like;  ///< "a step at q4 = 0.41 rad"
};

/// The smallest effect that would have been found.
struct Detectable {
  std::string effect, joint;
  std::string parameter, unit;
  double size = 0.0;         ///< in the parameter's unit
  double size_at_tip = 0.0;  ///< rms at the tip [m]
};

/// Every single candidate, before any choice: what other methods would go by.
struct Candidate {
  std::string effect;
  std::vector<std::string> joints;
  int columns = 0;             ///< that the data can see
  double gain = 0.0;           ///< fall of the sum of squares, in units of the noise, when it is added alone
  double evidence = 0.0;       ///< log Bayes factor against frames only
  double held_out_gain = 0.0;  ///< cross-validated fall of the mean square, share of the gap
  double largest_z = 0.0;      ///< its largest |estimate / standard error| when everything is fitted together
};

struct SanityFinding {
  std::string kind;  ///< joint_record, joint_order, joint_sign, joint_unit, duplicates, direction, outliers
  std::string text;  ///< a sentence with what to do
  std::vector<std::size_t> rows;  ///< that it is about, if few
};

/// Where the gap lies.
struct WhereJoint {
  std::string joint;
  Share share;  ///< of the closable gap that a free function of the inputs at this joint explains
};
struct WhereInput {
  std::string input;
  double share = 0.0;
};
struct WorkspaceCell {
  std::array<double, 3> center{};  ///< in the base frame [m]
  double rms = 0.0;                ///< of the gap [m]
  std::size_t n = 0;
};

/// A pose worth measuring next.
struct NextPose {
  std::vector<double> joints;  ///< driven joints [rad | m]
  std::vector<int> direction;  ///< approach directions; empty: any
  double payload = std::numeric_limits<double>::quiet_NaN();
  std::string why;
};

struct Diagnosis {
  Verdict verdict = Verdict::none;
  std::string sentence;      ///< the verdict in words
  ErrorStatistics gap;       ///< held-out error with base, targets (and anchor) fitted only [m]
  double noise_floor = 0.0;  ///< rms length of a row's error that is noise [m]
  bool noise_from_repeats = false;
  Share shrink;                   ///< of the held-out rms by `robot`, 1 - its error / gap
  double closable = 0.0;          ///< share of the gap's mean square above the noise floor that the named effects close
  double p_gap = 1.0;             ///< chance of a gain as large under noise alone
  ErrorStatistics after;          ///< held-out error with all named effects, laws' corrections and drifts included [m]
  ErrorStatistics after_unknown;  ///< and with the unknown functions as well [m]
  double remaining_structure_p = 1.0;  ///< permutation test of the free functions on what is left
  std::vector<FoundEffect> effects;    ///< by how much of the gap each explains, most first
  std::vector<UnknownEffect> unknown;
  std::vector<NotTestable> not_testable;
  std::vector<Detectable> detectable;  ///< per effect, its easiest joint first
  std::vector<Candidate> candidates;
  std::vector<SanityFinding> sanity;
  std::vector<WhereJoint> where_joints;
  std::vector<WhereInput> where_inputs;
  std::vector<WorkspaceCell> workspace;
  Eigen::Matrix3d direction =
      Eigen::Matrix3d::Identity();  ///< principal axes of the residual in the base frame, columns
  Eigen::Vector3d direction_rms = Eigen::Vector3d::Zero();  ///< along them [m]
  std::vector<NextPose> next_poses;
  std::vector<std::int8_t> set;                   ///< 0 train, 1 test, for every row
  std::vector<double> error_before, error_after;  ///< per row, as `gap` and `after` [m]
  Residuals residuals_before, residuals_after;    ///< per row, in the measurement frame
  std::vector<std::vector<double>>
      directions;                     ///< per driven joint and row, where they were inferred; empty: they were given
  std::vector<std::size_t> outliers;  ///< rows that counted for little
  double neighbour_p95 = std::numeric_limits<double>::quiet_NaN();
  double neighbour_share = 0.0;  ///< of the remaining mean square that a nearest-neighbour predictor still explains
  Robot robot_before;            ///< with base and targets (and anchor) fitted only
  Robot robot;                   ///< with what was named (free functions left out)
  std::string joint_record;      ///< "q" or "qr": the record that explains the measurements better
  std::vector<std::string> warnings;
  std::uint64_t seed = 0;
};

/// Where the gap between robot and model lies, which effect causes it, and how far it shrinks.
///
/// Base and targets are fitted first; every effect of the catalogue at every joint, the geometry, and free functions of
/// the inputs compete; what is named is refitted without linearisation on the training rows and judged on the held-out
/// ones. Throws std::invalid_argument on data or options that cannot be used.
Diagnosis diagnose(const Robot& robot, const Measurements& data, const DiagnoseOptions& options = {});

}  // namespace truing
