// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "diagnosis/sanity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "diagnosis/linearise.hpp"
#include "diagnosis/rows.hpp"
#include "math/constants.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "model/frame_change.hpp"
#include "model/motion.hpp"
#include "model/readings.hpp"
#include "model/repeats.hpp"
#include "model/row_slip.hpp"
#include "model/time_series.hpp"

namespace truing::diagnosis {
namespace {

constexpr double kWorthALook = 0.001, kHardlyAnything = 0.02;
constexpr std::size_t kRows = 1200;  ///< that the quick comparisons look at
constexpr std::size_t kFewRows = 300;
constexpr double kSmall = 0.02;  ///< of the error that is left: many rows see less than a row's noise

/// What base and targets are fitted by, before statistics.
IdentifyOptions frames_alone(const Robot& robot, const DiagnoseOptions& options) {
  IdentifyOptions fit;
  fit.test_share = 0.0;
  fit.own_effects = options.own_effects;
  fit.threads = options.threads;
  fit.max_iterations = 60;
  fit.free = targets_of(robot);
  return fit;
}

/// Median error with base and targets fitted and, if wanted, the geometry under its prior: a few hundred rows will do.
double median_error(const Robot& robot, const Measurements& data, const DiagnoseOptions& options, bool geometry) {
  const RowSample sample = sample_of(data, kRows);
  Measurements some = data;
  some.weight = {sample.weights.data(), 1};
  some.set.assign(data.rows, 0);
  const Identification frames = identify(robot, some, frames_alone(robot, options));
  if (!geometry) return frames.train.after.median;
  const Linearisation found = linearise(frames.robot, some, sample.rows, options.rotation_length, options.threads);
  const Residuals left = residuals(found.at, some, options.own_effects, options.threads);
  const std::vector<double> errors = lengths_of(left, data.rows);
  std::vector<double> lengths;
  for (const std::int32_t row : sample.rows) lengths.push_back(errors[static_cast<std::size_t>(row)]);
  return median_of(lengths);
}

/// The decimal step that all of these are multiples of [m]; 0: there is none down to a nanometre.
double resolution_of(const std::vector<double>& values) {
  for (const double step : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    const auto is_multiple = [&](double v) { return std::abs(v / step - std::round(v / step)) < 1e-3; };
    if (std::all_of(values.begin(), values.end(), is_multiple)) return step;
  }
  return 0.0;
}

/// Rows that coincide with another row although they were measured anew: noise that is not much larger than what the
/// instrument can show. Two normal numbers of one mean fall into one cell with the chance step / (2 sigma sqrt(pi)).
double expected_coincidences(const Measurements& data) {
  const double sigma = noise_of_repeats(data).sigma;
  if (!(sigma > 0.0)) return 0.0;
  double chance = 1.0;
  for (const Column& column : data.distance ? std::vector<Column>{data.distance}
                                            : std::vector<Column>(data.position.begin(), data.position.end())) {
    std::vector<double> values;
    for (std::size_t row = 0; column && row < data.rows; ++row) {
      if (std::isfinite(column[row])) values.push_back(column[row]);
    }
    if (!values.empty()) chance *= std::min(1.0, resolution_of(values) / (2.0 * sigma * std::sqrt(kPi)));
  }
  std::map<std::int32_t, double> repeats;
  for (const std::int32_t pose : pose_groups(data)) repeats[pose] += 1.0;
  double pairs = 0.0;
  for (const auto& [pose, count] : repeats) pairs += 0.5 * count * (count - 1.0);
  return pairs * chance;
}

void find_duplicates(const Measurements& data, std::vector<SanityFinding>* findings) {
  constexpr double kBeyondChance = 4.0;  // standard deviations of a count
  std::map<std::vector<double>, std::size_t> seen;
  std::vector<std::size_t> twice;
  for (std::size_t row = 0; row < data.rows; ++row) {
    std::vector<double> key;
    for (const Column& column : data.joints) key.push_back(column[row]);
    for (const Column& column : data.position) key.push_back(column && column[row] == column[row] ? column[row] : 0.0);
    key.push_back(data.distance && data.distance[row] == data.distance[row] ? data.distance[row] : 0.0);
    key.push_back(data.target.empty() ? 0.0 : data.target[row]);
    if (!seen.emplace(std::move(key), row).second) twice.push_back(row);
  }
  if (twice.empty()) return;
  const double expected = expected_coincidences(data);
  if (static_cast<double>(twice.size()) <= expected + kBeyondChance * std::sqrt(expected)) return;
  SanityFinding finding;
  finding.kind = "duplicates";
  finding.text = std::to_string(twice.size()) +
                 " rows repeat another row to the last digit, joints and measurement: they are copies, not repeats, "
                 "and make noise look smaller than it is. Remove them.";
  if (twice.size() <= 50) finding.rows = twice;
  findings->push_back(finding);
}

/// The second record of the joints, if it is complete.
std::vector<std::vector<double>> second_record(const Measurements& data, std::size_t driven, const Robot& robot) {
  std::vector<std::vector<double>> out;
  const std::vector<std::size_t> joints = robot.driven_joints();
  for (std::size_t k = 0; k < driven; ++k) {
    const std::string unit = robot.joints[joints[k]].type == JointType::revolute ? "_rad" : "_m";
    const auto found = data.covariates.find("qr" + std::to_string(k + 1) + unit);
    if (found == data.covariates.end()) return {};
    std::vector<double> column(data.rows);
    for (std::size_t row = 0; row < data.rows; ++row) {
      column[row] = found->second[row];
      if (!std::isfinite(column[row])) return {};
    }
    out.push_back(std::move(column));
  }
  return out;
}

void choose_record(const Robot& robot, const DiagnoseOptions& options, Checked* out) {
  std::vector<std::vector<double>> other = second_record(out->data, out->data.joints.size(), robot);
  if (other.empty()) return;
  const Measurements alternative = with_joint_columns(out->data, std::move(other));
  const double first = median_error(robot, out->data, options, true),
               second = median_error(robot, alternative, options, true);
  SanityFinding finding;
  finding.kind = "joint_record";
  const double ratio = first / std::max(second, 1e-12);
  if (ratio > 1.1) {
    finding.text = "the second record of the joints (qr) explains the measurements better than the first (q): median " +
                   millimetres(second) + " against " + millimetres(first) +
                   " after geometry. The diagnosis goes on with qr.";
    out->data = alternative;
    out->joint_record = "qr";
  } else if (ratio < 1.0 / 1.1) {
    finding.text = "the two records of the joints differ, and the first (q) explains the measurements better: median " +
                   millimetres(first) + " against " + millimetres(second) +
                   " after geometry. The diagnosis goes on with q; was the other read before the arm had settled?";
  } else {
    finding.text =
        "the two records of the joints (q, qr) explain the measurements equally well; the diagnosis goes on with q.";
  }
  out->findings.push_back(finding);
}

/// Median error of rows `begin` to `end` with base and targets fitted to these alone.
double median_error_of(const Robot& robot, const Measurements& data, const DiagnoseOptions& options, std::size_t begin,
                       std::size_t end) {
  std::vector<double> weights(data.rows, 0.0);
  for (std::size_t row = begin; row < end; ++row) weights[row] = data.weight ? data.weight[row] : 1.0;
  Measurements part = data;
  part.weight = {weights.data(), 1};
  return median_error(robot, part, options, false);
}

/// From some row on the instrument stood elsewhere: the poses before and after it agree with the robot, but not with
/// each other.
std::optional<SanityFinding> moved_instrument(const Robot& robot, const Measurements& data,
                                              const DiagnoseOptions& options, double together) {
  if (!has_one_frame(data) || robot.targets.size() > 1) return {};
  const Residuals off = residuals(robot, data, options.own_effects, options.threads);
  const std::optional<model::FrameChange> change = model::find_frame_change(data, off.position);
  if (!change) return {};
  const auto moved = static_cast<std::size_t>(change->row);
  const double apart = std::max(median_error_of(robot, data, options, 0, moved),
                                median_error_of(robot, data, options, moved, data.rows));
  if (!(apart < model::kOfTwoFrames * together)) return {};
  SanityFinding out;
  out.kind = "frame_change";
  out.text = text_of(*change) + ". Either part by itself leaves a median error of " + millimetres(apart) +
             " or less, both together " + millimetres(together) +
             ". Bring all rows into one frame, or diagnose the parts by themselves.";
  out.rows = {moved};
  out.mistake = true;
  return out;
}

/// A row that one of two records lacks, or has twice: from there on the other pairing is beyond doubt, and taken.
void undo_slip(const Robot& robot, const DiagnoseOptions& options, Checked* out) {
  FramesFit frames;
  frames.fit = [&](const Measurements& data) {
    Measurements all = data;
    all.set.assign(data.rows, 0);
    return identify(robot, all, frames_alone(robot, options)).robot;
  };
  frames.errors = [&](const Robot& fitted, const Measurements& data) {
    return lengths_of(residuals(fitted, data, options.own_effects, options.threads), data.rows);
  };
  const std::optional<RowSlip> slip = find_row_slip(out->data, frames);
  if (!slip) return;
  out->data = with_slip_undone(out->data, *slip);
  const auto [first, last] = rows_in_doubt(out->data, *slip);
  SanityFinding finding;
  finding.kind = "row_shift";
  finding.text = text_of(*slip) + " (" + millimetres(slip->after) + " in place of " + millimetres(slip->before) +
                 " from there on, by base and tool alone). The diagnosis goes on with that, without rows " +
                 std::to_string(first + 1) + " to " + std::to_string(last) + ". Correct the file.";
  for (std::size_t row = first; row < last; ++row) finding.rows.push_back(row);
  out->findings.push_back(finding);
}

/// Orientations that were read wrongly: then no effect can be named before it is corrected.
bool find_turned(const Robot& robot, const DiagnoseOptions& options, Checked* out) {
  const RowSample sample = sample_of(out->data, kRows);
  IdentifyOptions every_row = frames_alone(robot, options);
  every_row.loss = Loss::none;  // what rejects most rows fits the rest under any reading
  const auto errors = [&](const Measurements& read) {
    Measurements some = read;
    some.weight = {sample.weights.data(), 1};
    some.set.assign(some.rows, 0);
    return identify(robot, some, every_row).train.after;
  };
  if (!out->data.orientation[0]) return false;
  const auto better = better_orientations(robot, out->data, errors);
  if (better) out->findings.push_back({better->reading.kind, text_of(*better), {}, true});
  return better.has_value();
}

/// Does another reading explain more? Columns of the wrist cost least: they are looked at from `kWorthALook` of the
/// measured range on, and what nothing explains is said from `kHardlyAnything` on. A mistake is what halves the error
/// with the geometry fitted, too: then no effect can be named before it is corrected.
void try_readings(const Robot& robot, const DiagnoseOptions& options, double spread, Checked* out) {
  const double as_is = median_error(robot, out->data, options, false);
  if (!(as_is > kWorthALook * spread)) return;
  double best = 0.5 * as_is;
  SanityFinding finding;
  std::optional<Reading> better;
  for (const auto& make_reading : readings_of(robot, out->data)) {
    Reading reading = make_reading();
    const double error = median_error(reading.robot, reading.data, options, false) / reading.length_scale;
    if (!(error < best)) continue;
    best = error;
    better = std::move(reading);
  }
  if (better) {
    finding.kind = better->kind;
    finding.text = better->text + " leaves a median error of " + millimetres(best) + " in place of " +
                   millimetres(as_is) + ". Correct it and run again.";
    finding.mistake = median_error(better->robot, better->data, options, true) <
                      0.5 * better->length_scale * median_error(robot, out->data, options, true);
  } else if (const std::optional<SanityFinding> moved = moved_instrument(robot, out->data, options, as_is)) {
    finding = *moved;
  } else if (as_is > kHardlyAnything * spread) {
    finding.kind = "joint_order";
    finding.text = "with base and tool fitted the median error is " + millimetres(as_is) + ", " +
                   number(100.0 * as_is / spread, 2) +
                   " % of the measured range, and no swap, sign or unit of columns and no other convention of "
                   "the links explains it: is it the right robot file?";
  } else {
    return;
  }
  out->findings.push_back(finding);
}

/// Median error with base and targets fitted to a few rows, with the joints as they were `later` [s].
double error_of_joints_at(const Robot& robot, const Measurements& data, const DiagnoseOptions& options, double later) {
  const Measurements moved = model::with_joints_at(data, later);
  if (!model::has_most_rows(moved)) return std::numeric_limits<double>::infinity();
  Measurements some = subset_of(moved, sample_of(moved, kFewRows).rows);
  some.set.assign(some.rows, 0);
  return identify(robot, some, frames_alone(robot, options)).train.after.median;
}

/// How far a tip is off where joints are taken `later` [s] by their speeds alone, rms [m].
double beyond_first_order(const Robot& robot, const Measurements& data, double later) {
  const Measurements now = model::with_joints_at(data, 0.0), then = model::with_joints_at(data, later);
  double squares = 0.0;
  for (std::size_t k = 0; k < data.joints.size(); ++k) {
    for (std::size_t row = 0; row < data.rows; ++row) {
      if (!(then.weight[row] > 0.0)) continue;
      squares += std::pow(then.joints[k][row] - now.joints[k][row] - later * now.joint_speed[k][row], 2.0);
    }
  }
  return model::stretched_length(robot) * std::sqrt(squares / static_cast<double>(data.rows));
}

/// Clocks of joints and measurement that differ by so much that speeds alone do not say what it does: beyond doubt, and
/// undone. Less than that is an effect.
void undo_lag(const Robot& robot, const DiagnoseOptions& options, Checked* out) {
  // Own effects may look values up by row, and rows are others here.
  if (!options.own_effects.empty() || !model::moved_while_measured(out->data)) return;
  const Measurements some = model::middle_rows(out->data, model::kRowsOfLag);
  const auto error = [&](double later) { return error_of_joints_at(robot, some, options, later); };
  const double later = model::best_lag(error), as_is = error(0.0), left = error(later);
  if (!(left < 0.5 * as_is) || beyond_first_order(robot, some, later) < kSmall * left) return;
  out->data = model::with_joints_at(out->data, later);
  out->findings.push_back({"lag",
                           model::text_of_lag(later) + " (" + millimetres(left) + " in place of " + millimetres(as_is) +
                               ", by base and tool alone). The diagnosis goes on with joints between the rows, there. "
                               "Correct the file.",
                           {}});
}

void infer_speeds(Checked* out) {
  if (!out->data.joint_speed.empty()) return;
  out->data = with_inferred_speeds(out->data);
  if (out->data.joint_speed.empty()) return;
  out->findings.push_back({"speed",
                           "the robot moved while it was measured, and there are no columns qd1 …: joint speeds were "
                           "inferred from joints and times.",
                           {}});
}

void infer_directions(Checked* out) {
  if (!out->data.direction.empty()) return;
  out->data = with_inferred_directions(out->data);
  out->inferred_direction = true;
  out->findings.push_back({"direction",
                           "no columns dir1 …: the approach directions were inferred from the order of the rows, as if "
                           "the poses had been driven to one after the other.",
                           {}});
}

}  // namespace

Checked check(const Robot& robot, const Measurements& data, const DiagnoseOptions& options) {
  Checked out;
  out.data = data;
  const std::vector<std::int32_t> group = pose_groups(data);
  const std::size_t poses =
      group.empty() ? 0 : static_cast<std::size_t>(*std::max_element(group.begin(), group.end())) + 1;
  if (poses < 12)
    throw std::invalid_argument(std::to_string(poses) +
                                " poses are too few to diagnose anything: measure at least 12, better 100");
  find_duplicates(data, &out.findings);
  choose_record(robot, options, &out);
  undo_slip(robot, options, &out);
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const double range = measured_range(data, rows);
  const double spread = range > 0.0 ? range : 1.0;
  undo_lag(robot, options, &out);
  infer_speeds(&out);
  if (!find_turned(robot, options, &out)) try_readings(robot, options, spread, &out);
  infer_directions(&out);
  return out;
}

}  // namespace truing::diagnosis
