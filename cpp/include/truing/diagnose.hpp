// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "truing/common/not_testable.hpp"
#include "truing/identify.hpp"
#include "truing/model/effect.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// How `diagnose` works.
struct DiagnoseOptions {
  std::vector<Effect> own_effects;     ///< take part beside the catalogue
  std::vector<std::string> leave_out;  ///< effects that are not to be considered, by name
  double false_alarm = 0.01;           ///< false-positive rate: chance that a robot without any gap is said to have one
  int max_effects = 12;                ///< maximum number of effects named
  double test_share = 0.2;             ///< fraction of the pose groups held out when the data has no `set`
  std::size_t search_poses = 6000;     ///< maximum number of pose groups searched; errors are those of all rows
  /// Bootstrap samples of folds of pose groups for the intervals, the chosen effects fitted again; at most 10 more
  /// repeat the selection.
  int resamples = 60;
  double rotation_length = 0.1;   ///< [m] a rotation error of 1 rad counts as this length in reported errors
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
  effects_and_unknown,  ///< "effects+unknown": named, and something is left
  does_not_hold,        ///< what was found makes errors of held-out poses larger, for sure: nothing of it is in `robot`
};

/// How much of the gap the named effects leave, as mean squares of held-out errors beyond the noise.
enum class Explained {
  explained,         ///< no more than the noise itself
  partly_explained,  ///< "partly explained": more than the noise, and at most half of the gap
  not_explained,     ///< "not explained": more than half of the gap; or nothing was named
  no_gap,            ///< "no gap": there was none beyond noise
  does_not_hold,     ///< "does not hold": held-out errors are larger with what was found, for sure
};

/// A fraction and its 90 % interval.
struct Share {
  double value = 0.0;  ///< 1: all of it
  double low = 0.0;    ///< lower end
  double high = 0.0;   ///< upper end
};

/// How the error of a held-out pose falls with what was found, pose by pose: of its rms error, so that no single pose
/// far out decides.
struct HeldOutFall {
  std::size_t poses = 0;     ///< number of held-out poses
  double mean = 0.0;         ///< [m] over the poses: error without what was found, less that with it
  double sigma = 0.0;        ///< [m] standard error of the mean, by its scatter over the poses
  double probability = 0.5;  ///< that errors of other poses fall, too: Student's t of the paired differences
};

/// An effect that would explain the data as well.
struct Alternative {
  std::string effect;               ///< its name
  std::vector<std::string> joints;  ///< where
  double probability = 0.0;         ///< its part of the class's posterior probability
  std::string separated_by;         ///< what to measure to tell
};

/// A fitted law, or a free function, drawn against its input: value at the site [rad | m].
struct Curve {
  std::string site;          ///< what moves: a joint's name, 'base.x' …
  std::string input;         ///< 'q4', 'torque2', 'temp', 'time', 'dir3', 'payload', a covariate
  std::string second_input;  ///< of a function of two inputs the other one, held between the two bounds below; or empty
  double second_low = 0.0;   ///< of the second input: lower bound
  double second_high = 0.0;  ///< of the second input: upper bound
  std::string input_unit;    ///< of the input
  double period = 0.0;       ///< that the input is folded by, in its unit; 0: it is not folded
  std::string unit;          ///< of the value and its standard error: rad or m
  std::vector<std::array<double, 3>> points;   ///< shape=(n, 3): input, value, standard error
  std::vector<std::array<double, 2>> samples;  ///< shape=(n, 2): input and value of single poses, at most 600
};

/// An effect that `diagnose` named.
struct FoundEffect {
  std::string effect;               ///< its name, as in `catalogue()`, or that of an effect of one's own
  std::vector<std::string> joints;  ///< where
  double probability = 0.0;         ///< posterior of the class: this effect or one of `confounded_with`
  /// What that was worked out from: the class's `posterior` against others, and what speaks for a name or against it.
  std::map<std::string, double> grounds;
  std::vector<Parameter> parameters;  ///< values and standard errors
  ErrorStatistics held_out_before;    ///< errors of poses that the fit did not see, without this effect, all others in
  ErrorStatistics held_out_after;     ///< held-out errors with all named effects
  Share shrink;                       ///< of the rms, rotations counted by their noise: 1 - after / before
  /// Fraction of the gap's mean square: its fall when the effect is added with the size found, averaged over the orders
  /// in which effects may be added; those of all effects and unknowns add up to what was closed.
  double share = 0.0;
  double share_alone = 0.0;  ///< fraction of the gap's mean square that it closes when it is the only one
  double share_last = 0.0;   ///< fraction that it closes when all others are in already
  double size_at_tip = 0.0;  ///< [m] rms motion of the tip that it makes, beyond what base and tool could do as well
  std::vector<Alternative> confounded_with;  ///< effects that would explain these data as well
  std::string note;  ///< what else is to be known of it: 'not linear in the torque' …; may be empty
  /// What `effects` of `identify` and `truing identify --effects` take for it: 'backlash:J3'; empty for a frame that
  /// wanders.
  std::string identify_as;
  std::vector<Curve> curves;  ///< the law, drawn through single poses
};

/// A gap that no effect of the catalogue explains: a joint that moves as a smooth, stepwise or two-input function of
/// recorded inputs; or more than repeats show, and no such function describes it.
struct UnknownEffect {
  std::string joint;                ///< a joint's name, 'base', or empty when only 'somewhere' can be said
  std::vector<std::string> inputs;  ///< one or two; none: no function of them describes it
  double probability = 0.0;         ///< posterior that there is such a thing
  ErrorStatistics held_out_before;  ///< held-out errors without it
  ErrorStatistics held_out_after;   ///< held-out errors with it
  Share shrink;                     ///< of the held-out rms: 1 - after / before
  double share = 0.0;               ///< fraction of the gap's mean square, as that of an effect
  double size_at_tip = 0.0;         ///< [m] rms motion of the tip, as that of an effect
  std::vector<Curve> curves;  ///< along the first input; of two inputs, one for each of three ranges of the second
  std::string looks_like;     ///< in words: 'a step at q4 = 0.41 rad'
};

/// The smallest effect that would have been found.
struct Detectable {
  std::string effect;        ///< its name
  std::string joint;         ///< where
  std::string parameter;     ///< of which parameter `size` is
  std::string unit;          ///< of `size`
  double size = 0.0;         ///< in `unit`
  double size_at_tip = 0.0;  ///< [m] rms motion of the tip that this makes
};

/// One candidate before any selection: what methods without a search would go by.
struct Candidate {
  std::string effect;               ///< its name
  std::vector<std::string> joints;  ///< where
  int columns = 0;                  ///< number of parameters that the data can see
  double gain = 0.0;                ///< fall of the sum of squares when it is added alone, in units of the noise
  double evidence = 0.0;            ///< log Bayes factor against frames only
  double held_out_gain = 0.0;       ///< cross-validated fall of the mean square, as a fraction of the gap
  double largest_z = 0.0;           ///< largest |estimate / standard error| when everything is fitted together
};

/// What looks wrong with the data themselves.
struct SanityFinding {
  /// 'joint_record', 'joint_order', 'joint_sign', 'joint_unit', 'length_unit', 'handedness', 'link_unit', 'row_shift',
  /// 'convention', 'orientation_order', 'orientation_inverse', 'pose_inverse', 'frame_change', 'gravity_direction',
  /// 'duplicates', 'direction', 'speed', 'lag', 'moved_target', 'constant' or 'outliers'.
  std::string kind;
  std::string text;               ///< a sentence with what to do
  std::vector<std::size_t> rows;  ///< rows (counted from 0) that it is about, if few
  bool mistake = false;           ///< the robot file or the columns are to be corrected: until then nothing is named
};

/// How much of the closable gap sits at a joint.
struct WhereJoint {
  std::string joint;  ///< its name
  Share share;        ///< fraction of the closable gap that a free function of the inputs at this joint explains
};
/// How much of the closable gap goes with an input.
struct WhereInput {
  std::string input;   ///< its name
  double share = 0.0;  ///< fraction of the closable gap
};
/// The error in one part of the workspace.
struct WorkspaceCell {
  std::array<double, 3> center{};  ///< shape=(3,) [m] in the base frame
  double rms = 0.0;                ///< [m] of the gap
  std::size_t n = 0;               ///< number of rows
};

/// A pose worth measuring next.
struct NextPose {
  std::vector<double> joints;                                 ///< shape=(driven joints,) [rad | m]
  std::vector<int> direction;                                 ///< approach direction of every driven joint; empty: any
  double payload = std::numeric_limits<double>::quiet_NaN();  ///< [kg]; NaN: any
  std::string why;                                            ///< what it tells
};

/// What `diagnose` found.
struct Diagnosis {
  Verdict verdict = Verdict::none;          ///< whether there is a gap, and whether the effects named explain it
  Explained explained = Explained::no_gap;  ///< how much is left
  std::string sentence;                     ///< the verdict in words
  ErrorStatistics gap;                      ///< held-out errors with base, targets (and anchor) fitted only
  double noise_floor = 0.0;                 ///< [m] rms length of a row's error that is noise
  bool noise_from_repeats = false;          ///< the noise is that of repeated poses, not what a flexible fit leaves
  Share shrink;                             ///< of the held-out rms, by `robot`: 1 - its error / gap
  HeldOutFall held_out_fall;                ///< how sure held-out poses are that what was found holds
  double closable = 0.0;  ///< fraction of the gap's mean square above the noise floor that the named effects close
  double p_gap = 1.0;     ///< p-value of the gap: probability of a gain as large under noise alone
  ErrorStatistics after;  ///< held-out errors with all named effects, corrections of their laws and drifts included
  ErrorStatistics after_unknown;          ///< held-out errors with the unknown functions as well
  double remaining_structure_p = 1.0;     ///< p-value of the free functions on the residual, by permutation
  std::vector<FoundEffect> effects;       ///< by how much of the gap each explains, most first
  std::vector<UnknownEffect> unknown;     ///< what no effect of the catalogue explains
  std::vector<NotTestable> not_testable;  ///< what these data could not show
  std::vector<Detectable> detectable;     ///< the smallest effects that would have been found, easiest joint first
  std::vector<Candidate> candidates;      ///< every candidate, before any selection
  std::vector<SanityFinding> sanity;      ///< what looks wrong with the data themselves
  std::vector<WhereJoint> where_joints;   ///< the gap by joint
  std::vector<WhereInput> where_inputs;   ///< the gap by input
  std::vector<WorkspaceCell> workspace;   ///< the gap by part of the workspace
  /// shape=(3, 3): principal axes of the residual in the base frame, as columns.
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  Eigen::Vector3d direction_rms = Eigen::Vector3d::Zero();  ///< shape=(3,) [m]: along them
  std::vector<NextPose> next_poses;                         ///< poses worth measuring next
  std::vector<std::int8_t> set;                             ///< shape=(n,): 0 train, 1 test, for every row
  std::vector<double> error_before;                         ///< shape=(n,) [m]: of every row, as `gap`
  std::vector<double> error_after;                          ///< shape=(n,) [m]: of every row, as `after`
  Residuals residuals_before;                               ///< predicted minus measured, of every row, as `gap`
  Residuals residuals_after;                                ///< predicted minus measured, of every row, as `after`
  /// Approach directions per driven joint and row, where they were inferred from the order of the rows; empty: the data
  /// had them.
  std::vector<std::vector<double>> directions;
  std::vector<std::size_t> outliers;  ///< rows (counted from 0) with little weight
  /// [m] 95th percentile of the errors of a nearest-neighbour predictor; NaN: too few rows.
  double neighbour_p95 = std::numeric_limits<double>::quiet_NaN();
  double neighbour_share = 0.0;  ///< fraction of the remaining mean square that a nearest-neighbour predictor explains
  Robot
      robot_before;  ///< nominal, with base and targets (and anchor) fitted; part of this result: copy it to change it
  Robot robot;       ///< with the effects that were named, free functions left out; part of this result
  /// The same with the unknown functions of joint motions, directions, gravity torques, payload and temperature, as
  /// tables (effect lookup_table). None: there are none, or held-out poses do not gain by them for sure.
  std::optional<Robot> robot_with_unknown;
  ErrorStatistics after_robot_with_unknown;  ///< held-out errors by `robot_with_unknown`
  std::string joint_record;                  ///< 'q' or 'qr': the record that explains the measurements better
  std::vector<std::string> warnings;         ///< what to know before trusting it
  std::uint64_t seed = 0;                    ///< of the split and of every simulation
};

/// Where the gap between robot and model lies, which effect causes it, and how far it shrinks.
///
/// Base and targets are fitted first; every effect of the catalogue at every joint, the geometry, and free functions of
/// the inputs compete; what is named is refitted without linearisation on the training rows and judged on the held-out
/// ones. Throws std::invalid_argument on data or options that cannot be used.
Diagnosis diagnose(const Robot& robot, const Measurements& data, const DiagnoseOptions& options = {});

}  // namespace truing
