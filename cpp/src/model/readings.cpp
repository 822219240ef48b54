// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "model/readings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <string>
#include <utility>

#include "math/constants.hpp"
#include "math/text.hpp"

namespace truing::model {
namespace {

/// Columns of one's own beside the rest of the data.
struct OtherColumns {
  std::shared_ptr<const void> rest;
  std::vector<std::vector<double>> columns;
};

std::vector<double> copy_of(const Column& column, std::size_t rows, double factor = 1.0) {
  std::vector<double> out(rows);
  for (std::size_t row = 0; row < rows; ++row) out[row] = factor * column[row];
  return out;
}

/// The joint columns, changed in place by `change`.
Measurements with_changed_joints(const Measurements& data,
                                 const std::function<void(std::vector<std::vector<double>>*)>& change) {
  std::vector<std::vector<double>> columns;
  for (const Column& column : data.joints) columns.push_back(copy_of(column, data.rows));
  change(&columns);
  return with_joint_columns(data, std::move(columns));
}

/// The data with every measured length in another unit.
Measurements with_lengths(const Measurements& data, double factor) {
  Measurements out = data;
  auto owned = std::make_shared<OtherColumns>();
  owned->rest = data.owner;
  owned->columns.reserve(5);
  for (Column* column : {&out.position[0], &out.position[1], &out.position[2], &out.distance, &out.position_sigma}) {
    if (!*column) continue;
    owned->columns.push_back(copy_of(*column, data.rows, factor));
    *column = {owned->columns.back().data(), 1};
  }
  out.owner = owned;
  return out;
}

using Quaternion = Eigen::Quaterniond;
using Position = Eigen::Vector3d;

/// The data with the pose of every row that has one, position and orientation, changed in place by `change`. Rows of
/// positions alone are as they were.
Measurements with_poses(const Measurements& data, const std::function<void(Position*, Quaternion*)>& change) {
  Measurements out = data;
  auto owned = std::make_shared<OtherColumns>();
  owned->rest = data.owner;
  for (const Column& column : data.position) owned->columns.push_back(copy_of(column, data.rows));
  for (const Column& column : data.orientation) owned->columns.push_back(copy_of(column, data.rows));
  auto& of = owned->columns;
  for (std::size_t row = 0; row < data.rows; ++row) {
    if (!data.has_orientation(row)) continue;
    Position p(of[0][row], of[1][row], of[2][row]);
    Quaternion q(of[3][row], of[4][row], of[5][row], of[6][row]);
    change(&p, &q);
    for (std::size_t k = 0; k < 3; ++k) of[k][row] = p[static_cast<Eigen::Index>(k)];
    of[3][row] = q.w();
    for (std::size_t k = 0; k < 3; ++k) of[4 + k][row] = q.vec()[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k < 3; ++k) out.position[k] = {of[k].data(), 1};
  for (std::size_t k = 0; k < 4; ++k) out.orientation[k] = {of[3 + k].data(), 1};
  out.owner = owned;
  return out;
}

/// The other hand's frame: its y axis points the other way.
Measurements mirrored(const Measurements& data) {
  Measurements out = data;
  auto owned = std::make_shared<OtherColumns>();
  owned->rest = data.owner;
  owned->columns.reserve(3);
  for (Column* column : {&out.position[1], &out.orientation[1], &out.orientation[3]}) {
    if (!*column) continue;
    owned->columns.push_back(copy_of(*column, data.rows, -1.0));
    *column = {owned->columns.back().data(), 1};
  }
  out.owner = owned;
  return out;
}

/// Of columns that are scalar last under the names of scalar first.
void scalar_last(Position* /*p*/, Quaternion* q) { *q = Quaternion(q->z(), q->w(), q->x(), q->y()); }
void turned_round(Position* /*p*/, Quaternion* q) { *q = q->conjugate(); }
void inverted(Position* p, Quaternion* q) {
  *q = q->conjugate();
  *p = -(*q * *p);
}

using Readings = std::vector<std::function<Reading()>>;

void add_joint_readings(const Robot& robot, const Measurements& data, Readings* out) {
  using Columns = std::vector<std::vector<double>>;
  for (std::size_t k = 0; k < data.joints.size(); ++k) {
    out->push_back([&robot, &data, k] {
      const auto turn = [&](Columns* columns) {
        for (double& q : (*columns)[k]) q = -q;
      };
      return Reading{robot, with_changed_joints(data, turn), "joint_sign",
                     "turning the sign of joint column " + std::to_string(k + 1)};
    });
    for (std::size_t m = k + 1; m < data.joints.size(); ++m) {
      out->push_back([&robot, &data, k, m] {
        const auto exchange = [&](Columns* columns) { std::swap((*columns)[k], (*columns)[m]); };
        return Reading{robot, with_changed_joints(data, exchange), "joint_order",
                       "swapping joint columns " + std::to_string(k + 1) + " and " + std::to_string(m + 1)};
      });
    }
  }
}

/// One of two records that were joined row by row has a few rows more than the other at its beginning.
void add_row_readings(const Robot& robot, const Measurements& data, Readings* out) {
  constexpr int kRowsOff = 3;
  for (int shift = -kRowsOff; shift <= kRowsOff; ++shift) {
    if (shift == 0 || data.rows < 8) continue;
    out->push_back([&robot, &data, shift] {
      const int by = std::abs(shift);
      return Reading{robot, with_rows_shifted(data, shift), "row_shift",
                     "taking for every row's joints what was measured " + std::to_string(by) +
                         (by == 1 ? " row " : " rows ") + (shift > 0 ? "further down" : "further up")};
    });
  }
}

/// What an angle is multiplied by that was read in the other unit.
constexpr double kOtherAngles[] = {180.0 / kPi, kDegree};

std::string units_of_angles(double factor) { return factor > 1.0 ? "rad instead of deg" : "deg instead of rad"; }

void add_unit_readings(const Robot& robot, const Measurements& data, Readings* out) {
  for (const double factor : kOtherAngles) {
    out->push_back([&robot, &data, factor] {
      const std::vector<std::size_t> driven = robot.driven_joints();
      const auto convert = [&](std::vector<std::vector<double>>* columns) {
        for (std::size_t k = 0; k < columns->size(); ++k) {
          if (robot.joints[driven[k]].type != JointType::revolute) continue;
          for (double& q : (*columns)[k]) q *= factor;
        }
      };
      return Reading{robot, with_changed_joints(data, convert), "joint_unit",
                     "reading the joints in " + units_of_angles(factor)};
    });
  }
  if (!data.position[0] && !data.distance) return;
  if (data.position[0]) {
    out->push_back([&robot, &data] {
      return Reading{robot, mirrored(data), "handedness", "reading the measured positions in a left-handed frame"};
    });
  }
  const std::pair<double, const char*> lengths[] = {
      {1e-3, "mm instead of m"}, {1e3, "m instead of mm"}, {0.0254, "in instead of m"}, {25.4, "in instead of mm"}};
  for (const auto& length : lengths) {
    out->push_back([&robot, &data, length] {
      return Reading{robot, with_lengths(data, length.first), "length_unit",
                     std::string("reading the measured lengths in ") + length.second +
                         " (or those of the robot file the other way round)",
                     length.first};
    });
  }
}

/// The table of links with its angles in the other unit, or by the other convention. Joint origins as of a URDF have
/// none.
void add_link_readings(const Robot& robot, const Measurements& data, Readings* out) {
  if (robot.convention == Convention::urdf) return;
  for (const double factor : kOtherAngles) {
    out->push_back([&robot, &data, factor] {
      Reading other{robot, data, "link_unit", "reading the angles of the robot file in " + units_of_angles(factor)};
      for (Joint& joint : other.robot.joints) {
        joint.theta *= factor;
        joint.alpha *= factor;
        joint.beta *= factor;
      }
      return other;
    });
  }
  out->push_back([&robot, &data] {
    const bool modified = robot.convention == Convention::mdh;
    Reading other{robot, data, "convention",
                  std::string("reading the robot file's links as convention: ") + (modified ? "dh" : "mdh")};
    other.robot.convention = modified ? Convention::dh : Convention::mdh;
    return other;
  });
}

}  // namespace

Measurements with_joint_columns(const Measurements& data, std::vector<std::vector<double>> columns) {
  Measurements out = data;
  auto owned = std::make_shared<OtherColumns>(OtherColumns{data.owner, std::move(columns)});
  for (std::size_t k = 0; k < owned->columns.size(); ++k) out.joints[k] = {owned->columns[k].data(), 1};
  out.owner = owned;
  return out;
}

Measurements with_rows_paired(const Measurements& data, const std::vector<std::size_t>& joints_of,
                              const std::vector<std::size_t>& measured_of) {
  const auto taken = [](const auto& column, const std::vector<std::size_t>& rows) {
    std::vector<std::decay_t<decltype(column[0])>> out;
    for (const std::size_t row : rows) out.push_back(column[row]);
    return out;
  };
  std::vector<std::vector<double>> joints;
  for (const Column& column : data.joints) joints.push_back(taken(column, joints_of));
  Measurements out = with_joint_columns(data, std::move(joints));
  auto owned = std::make_shared<OtherColumns>(OtherColumns{out.owner, {}});
  std::vector<Column*> measured = {&out.position[0], &out.position[1], &out.position[2], &out.distance};
  for (Column& column : out.orientation) measured.push_back(&column);
  owned->columns.reserve(measured.size());
  for (Column* column : measured) {
    if (!*column) continue;
    owned->columns.push_back(taken(*column, measured_of));
    *column = {owned->columns.back().data(), 1};
  }
  for (std::vector<std::int32_t>* index : {&out.target, &out.fixed_point}) {
    if (!index->empty()) *index = taken(*index, measured_of);
  }
  out.owner = owned;
  return out;
}

Measurements with_rows_shifted(const Measurements& data, int shift) {
  const auto last = static_cast<std::ptrdiff_t>(data.rows) - 1;
  std::vector<std::size_t> joints_of, measured_of;
  for (std::ptrdiff_t row = 0; row <= last; ++row) {
    const std::ptrdiff_t paired = std::clamp<std::ptrdiff_t>(row, std::max(0, -shift), last - std::max(0, shift));
    joints_of.push_back(static_cast<std::size_t>(paired));
    measured_of.push_back(static_cast<std::size_t>(paired + shift));
  }
  return with_rows_paired(data, joints_of, measured_of);
}

double measured_range(const Measurements& data, const std::vector<std::int32_t>& rows) {
  Eigen::Vector4d low = Eigen::Vector4d::Constant(1e300), high = -low;
  const auto see = [&](Eigen::Index k, double value) {
    low[k] = std::min(low[k], value);
    high[k] = std::max(high[k], value);
  };
  for (const std::int32_t i : rows) {
    const auto row = static_cast<std::size_t>(i);
    for (std::size_t k = 0; k < 3 && data.has_position(row); ++k)
      see(static_cast<Eigen::Index>(k), data.position[k][row]);
    if (data.has_distance(row)) see(3, data.distance[row]);
  }
  const Eigen::Vector4d range = (high - low).cwiseMax(0.0);
  return high[0] >= low[0] ? range.head<3>().norm() : range[3];
}

RowSample sample_of(const Measurements& data, std::size_t most) {
  RowSample out;
  out.weights.assign(data.rows, 0.0);
  const std::size_t step = data.rows / most + 1;
  for (std::size_t row = 0; row < data.rows; row += step) {
    out.weights[row] = data.weight ? data.weight[row] : 1.0;
    if (out.weights[row] > 0.0) out.rows.push_back(static_cast<std::int32_t>(row));
  }
  return out;
}

std::optional<BetterOrientations> better_orientations(
    const Robot& robot, const Measurements& data, const std::function<ErrorStatistics(const Measurements&)>& errors) {
  constexpr double kWrong = 5.0 * kDegree;  // more than a robot or an instrument is off
  constexpr double kBetter = 0.25;
  constexpr double kOfRange = 0.02;  // positions must go with the robot as well
  struct Other {
    const char* kind;
    const char* text;
    std::vector<void (*)(Position*, Quaternion*)> changes;
  };
  const Other others[] = {
      {"orientation_order", "reading the orientations' columns as qx qy qz qw (scalar last)", {scalar_last}},
      {"orientation_inverse", "taking the inverse of the orientations", {turned_round}},
      {"orientation_inverse",
       "reading the orientations' columns as qx qy qz qw (scalar last), and taking their inverse",
       {scalar_last, turned_round}},
      {"pose_inverse", "taking the inverse of the measured poses", {inverted}},
      {"pose_inverse",
       "reading the orientations' columns as qx qy qz qw (scalar last), and taking the inverse of the measured poses",
       {scalar_last, inverted}},
  };
  std::vector<std::int32_t> rows(data.rows);
  std::iota(rows.begin(), rows.end(), 0);
  const ErrorStatistics as_is = errors(data);
  double least = std::min(kWrong, kBetter * as_is.rotation_rms);
  std::optional<BetterOrientations> out;
  if (!(as_is.rotation_rms > kWrong)) return out;
  for (const Other& other : others) {
    Measurements read = with_poses(data, [&](Position* p, Quaternion* q) {
      for (const auto change : other.changes) change(p, q);
    });
    const ErrorStatistics left = errors(read);
    if (!(left.rotation_rms < least && left.median < kOfRange * measured_range(read, rows))) continue;
    least = left.rotation_rms;
    out = BetterOrientations{{robot, std::move(read), other.kind, other.text}, as_is.rotation_rms, left.rotation_rms};
  }
  return out;
}

std::string text_of(const BetterOrientations& better) {
  return better.reading.text + " leaves a rotation error of " + degrees(better.left) + " in place of " +
         degrees(better.as_is) + " with base and tool fitted. Correct it and run again.";
}

std::vector<std::function<Reading()>> readings_of(const Robot& robot, const Measurements& data) {
  Readings out;
  add_joint_readings(robot, data, &out);
  add_unit_readings(robot, data, &out);
  add_row_readings(robot, data, &out);
  add_link_readings(robot, data, &out);
  return out;
}

}  // namespace truing::model
