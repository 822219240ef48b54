// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "identification/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "math/constants.hpp"
#include "math/rotation.hpp"
#include "math/statistics.hpp"

namespace truing::identification {
namespace {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

/// d(rotation vector) / d(small rotation about the parent's axes): inverse left Jacobian of SO(3), Sola et al. 2018,
/// eq. (146).
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& v) {
  const Eigen::Matrix3d cross = skew(v);
  const double angle = v.norm();
  const double factor = angle < 1e-4 ? 1.0 / 12.0 : (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

/// Which axis a parameter turns about, if it is a frame's orientation: 0..2; else -1.
int orientation_axis(const ParameterInfo& info) {
  const std::string name = info.name.substr(info.name.rfind('.') + 1);
  if (info.role == Role::effect) return -1;
  return name == "rx" ? 0 : name == "ry" ? 1 : name == "rz" ? 2 : -1;
}

/// The covariance of rotation vectors from that of the small rotations which were fitted.
void report_orientation_covariance(const Model& model, const std::vector<int>& fitted, const Eigen::VectorXd& values,
                                   Eigen::MatrixXd* covariance) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Identity(covariance->rows(), covariance->cols());
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    const ParameterInfo& row = model.parameters[fitted[i]];
    if (orientation_axis(row) < 0) continue;
    const std::string frame = row.name.substr(0, row.name.rfind('.'));
    Eigen::Vector3d v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = values[model.parameter_index(frame + ".r" + "xyz"[axis])];
    const Eigen::Matrix3d j = inverse_left_jacobian(v);
    for (std::size_t k = 0; k < fitted.size(); ++k) {
      const ParameterInfo& column = model.parameters[fitted[k]];
      if (orientation_axis(column) < 0 || column.name.substr(0, column.name.rfind('.')) != frame) continue;
      T(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          j(orientation_axis(row), orientation_axis(column));
    }
  }
  *covariance = T * *covariance * T.transpose();
}

/// Orientation parameters as the user reads them: the rotation vector from the nominal to the found orientation, about
/// the parent's axes.
void report_orientations(const Robot& nominal, const Robot& found, const Model& model, Eigen::VectorXd* nominal_values,
                         Eigen::VectorXd* values) {
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    const int axis = orientation_axis(info);
    if (axis < 0) continue;
    const auto frame = [&](const Robot& robot) {
      return info.role == Role::base     ? robot.T_measurement_base
             : info.role == Role::target ? robot.targets[info.owner].T_last_target
                                         : robot.joints[info.owner].T_parent_joint;
    };
    (*nominal_values)[static_cast<Eigen::Index>(k)] = 0.0;
    (*values)[static_cast<Eigen::Index>(k)] =
        rotation_vector(frame(found).linear() * frame(nominal).linear().transpose())[axis];
  }
}

}  // namespace

void report_parameters(const Model& nominal_model, const Model& model, const Seen& seen, const Fit& found,
                       Identification* result) {
  const std::vector<int>& fitted = seen.selection.fitted;
  Eigen::VectorXd nominal_values = initial_values(nominal_model), values = found.values;
  report_orientations(nominal_model.robot, result->robot, model, &nominal_values, &values);
  report_orientation_covariance(model, fitted, values, &result->covariance);
  std::vector<int> asked = seen.free;
  if (seen.scale_carrier >= 0) asked.push_back(seen.scale_carrier);
  std::sort(asked.begin(), asked.end());
  Eigen::Index at = 0;
  for (const int k : asked) {
    Parameter parameter;
    parameter.name = model.parameters[k].name;
    parameter.unit = model.parameters[k].unit;
    parameter.nominal = nominal_values[k];
    parameter.value = values[k];
    parameter.frozen = std::find(fitted.begin(), fitted.end(), k) == fitted.end();
    parameter.sigma = parameter.frozen ? kNaN : std::sqrt(result->covariance(at, at));
    if (!parameter.frozen) ++at;
    result->parameters.push_back(parameter);
  }
}

std::map<std::string, std::pair<double, double>> ranges_of(const Measurements& data,
                                                           const std::vector<std::int32_t>& rows) {
  std::map<std::string, std::pair<double, double>> out;
  const auto look_at = [&](const std::string& name, const Column& column) {
    for (const std::int32_t row : rows) {
      const double value = column ? column[static_cast<std::size_t>(row)] : kNaN;
      if (!std::isfinite(value)) continue;
      const auto found = out.emplace(name, std::pair{value, value}).first;
      found->second.first = std::min(found->second.first, value);
      found->second.second = std::max(found->second.second, value);
    }
  };
  for (std::size_t k = 0; k < data.joints.size(); ++k) look_at("q" + std::to_string(k + 1), data.joints[k]);
  look_at("payload", data.payload);
  look_at("temp", data.temperature);
  return out;
}

namespace {

ErrorStatistics statistics(const ErrorLengths& errors, const std::vector<std::int32_t>& rows) {
  std::vector<double> lengths;
  lengths.reserve(rows.size());
  double turn = 0.0;
  std::size_t turns = 0;
  for (const std::int32_t row : rows) {
    lengths.push_back(errors.position[row]);
    if (!errors.rotation.empty() && std::isfinite(errors.rotation[row])) {
      turn += static_cast<double>(errors.rotation[row]) * static_cast<double>(errors.rotation[row]);
      ++turns;
    }
  }
  ErrorStatistics out = error_statistics(std::move(lengths));
  if (turns) out.rotation_rms = std::sqrt(turn / static_cast<double>(turns));
  return out;
}

}  // namespace

void report_errors(const Job& job, const Content& content, const std::vector<std::int32_t>& test,
                   const Eigen::VectorXd& before, const Fit& found, Identification* result) {
  std::vector<std::int32_t> seen_test;
  for (const std::int32_t row : test) {  // a fixed point that no training row touches has no place to compare with
    if (!job.data.has_fixed_point(row) || content.point[job.data.fixed_point[row]]) seen_test.push_back(row);
  }
  std::vector<std::int32_t> all;
  std::merge(job.rows.begin(), job.rows.end(), seen_test.begin(), seen_test.end(), std::back_inserter(all));
  const Evaluator everything(job.model, job.data, job.bases, make_segments(job.data, all), found.fitted,
                             job.options.threads);
  const std::vector<std::int32_t> kept = without(job.rows, found.rejected);
  if (!seen_test.empty()) result->test.emplace();
  for (const bool after : {false, true}) {
    const ErrorLengths errors = error_lengths(job, everything, after ? found.values : before, content.poses);
    (after ? result->train.after : result->train.before) = statistics(errors, kept);
    if (result->test) (after ? result->test->after : result->test->before) = statistics(errors, seen_test);
  }
}

namespace {

std::string three_digits(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.3g", v);
  return buffer;
}

/// "a (1.2 mm), b (3 mrad)": fitted, and known to more than 10 mm or mrad only.
std::string barely_seen(const std::vector<Parameter>& parameters) {
  std::string out;
  for (const Parameter& parameter : parameters) {
    const bool length = parameter.unit == "m";
    if (parameter.frozen || !(length || parameter.unit == "rad") || !(parameter.sigma > 0.01)) continue;
    const bool large = parameter.sigma >= 1.0;
    out += (out.empty() ? "" : ", ") + parameter.name + " (" + three_digits((large ? 1.0 : 1e3) * parameter.sigma) +
           (large ? " " : " m") + (length ? "m)" : "rad)");
  }
  return out;
}

}  // namespace

std::vector<std::string> make_warnings(const Identification& result, std::size_t train_values, double spread) {
  std::vector<std::string> warnings;
  const ErrorStatistics& train = result.train.after;
  if (spread > 0.0 && train.median > 0.02 * spread) {
    warnings.push_back("what is left, " + three_digits(1e3 * train.median) + " mm in the median, is " +
                       three_digits(100.0 * train.median / spread) +
                       " % of the measured range: is a joint column wrong (unit, sign, order), or the robot file?");
  }
  if (train_values < 3 * static_cast<std::size_t>(result.rank)) {
    warnings.push_back("only " + count_of(train_values, "measured value") + " for " +
                       count_of(static_cast<std::size_t>(result.rank), "parameter") +
                       ": measure more poses or free fewer parameters");
  }
  if (!result.test) {
    warnings.push_back("no rows are held out: nothing says how good the result is on other poses");
  } else if (result.test->after.rms > 1.5 * train.rms && result.test->after.median > 1.3 * train.median) {
    warnings.push_back("held-out error " + three_digits(1e3 * result.test->after.rms) + " mm against " +
                       three_digits(1e3 * train.rms) + " mm in training: the data cannot support this many parameters");
  }
  if (result.shrunk_to > 0.0)
    warnings.push_back("the rows hardly see some links: all are held near the nominal robot, within about " +
                       three_digits(1e3 * result.shrunk_to) + " mm and mrad, as the rows have it");
  const std::string weak = barely_seen(result.parameters);
  if (!weak.empty()) warnings.push_back("barely seen, standard error in brackets: " + weak);
  if (!result.rejected_rows.empty())
    warnings.push_back(count_of(result.rejected_rows.size(), "training row") + " left out as gross outliers");
  return warnings;
}

}  // namespace truing::identification
