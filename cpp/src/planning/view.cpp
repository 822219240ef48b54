// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "planning/view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include <Eigen/QR>

#include "estimation/evaluate.hpp"
#include "estimation/evidence.hpp"
#include "estimation/selection.hpp"
#include "math/constants.hpp"
#include "math/text.hpp"
#include "model/motion.hpp"
#include "planning/poses.hpp"

namespace truing::planning {
namespace {

/// Unit columns that add less than this to those before them are left out: of base, tool and geometry; of a rival,
/// which would need to be absurdly large.
constexpr double kSameColumn = 1e-8, kSameRival = 1e-4;

using Eigen::Index;
using Eigen::MatrixXd;

/// Where an effect does not say what machines have: a joint that turns by a radian. A tenth of the robot's length at
/// the tip none has.
constexpr double kWholeUnit = 1.0, kShareOfLength = 0.1;

/// Length one, where there is any length.
MatrixXd unit_columns(MatrixXd x) {
  for (Index k = 0; k < x.cols(); ++k) {
    const double length = x.col(k).norm();
    if (length > 0.0) x.col(k) /= length;
  }
  return x;
}

/// What `basis` (orthonormal) leaves; twice, for the rounding of the first time.
MatrixXd beyond(const MatrixXd& basis, MatrixXd x) {
  for (int k = 0; k < 2; ++k) x -= basis * (basis.transpose() * x);
  return x;
}

MatrixXd orthonormal(const MatrixXd& x, double least) {
  if (x.cols() == 0 || x.rows() == 0) return MatrixXd(x.rows(), 0);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(x);
  Index rank = 0;
  const Index most = std::min(x.rows(), x.cols());
  while (rank < most && std::abs(qr.matrixR()(rank, rank)) > least) ++rank;
  return qr.householderQ() * MatrixXd::Identity(x.rows(), rank);
}

MatrixXd beside(const MatrixXd& a, const MatrixXd& b) {
  MatrixXd out(a.rows(), a.cols() + b.cols());
  out << a, b;
  return out;
}

/// Effects that the groups ask for, each once.
std::vector<EffectRequest> requests_of(const std::vector<Group>& groups) {
  std::vector<EffectRequest> requests;
  std::set<std::pair<std::string, std::string>> asked;
  for (const Group& group : groups) {
    for (const EffectRequest& request : group.requests) {
      if (asked.insert({request.effect, request.joints.empty() ? "" : request.joints[0]}).second)
        requests.push_back(request);
    }
  }
  return requests;
}

Seen seen_of(const Group& group, const Columns& columns, const MatrixXd& frames) {
  Seen seen;
  for (const std::string& name : group.parameters) {
    const Index column = columns.at(name);
    if (column >= 0) seen.columns.push_back(column);
  }
  seen.left = beyond(frames, unit_columns(chosen(columns.x, seen.columns)));
  for (Index k = 0; k < seen.left.cols(); ++k) {
    if (seen.left.col(k).squaredNorm() < kInvisible)
      seen.left.col(k).setZero();  // rounding explains nothing, and is explained by anything
  }
  seen.basis = orthonormal(seen.left, kSameRival);
  return seen;
}

/// Rms motion of the tip by a parameter of one.
double at_tip(const View& view, Index column, double position_sigma) {
  double sum = 0.0;
  const Index poses = view.columns.x.rows() / view.columns.per_pose;
  for (Index k = 0; k < poses; ++k)
    sum += view.columns.x.col(column).segment<3>(k * view.columns.per_pose).squaredNorm();
  return position_sigma * std::sqrt(sum / static_cast<double>(std::max<Index>(1, poses)));
}

}  // namespace

Index Columns::at(const std::string& name) const {
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    if (parameters[k].name == name) return static_cast<Index>(k);
  }
  return -1;
}

MatrixXd chosen(const MatrixXd& x, const std::vector<Index>& columns) {
  MatrixXd out(x.rows(), static_cast<Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) out.col(static_cast<Index>(k)) = x.col(columns[k]);
  return out;
}

Columns make_columns(const Robot& robot, const std::vector<Planned>& poses, const std::vector<EffectRequest>& requests,
                     const DistinguishOptions& options, Robot* carrying) {
  const Measured measured(robot, poses, options);
  const Model model = make_model(robot, measured.data, requests, options.own_effects);
  const std::vector<bool> parallel = near_parallel(robot, IdentifyOptions().hayati_angle);
  Columns out;
  out.per_pose = options.orientation ? 6 : 3;
  std::vector<int> free;
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const ParameterInfo& info = model.parameters[k];
    if (info.role == Role::anchor || info.role == Role::point) continue;
    if (info.role == Role::target && (info.owner != 0 || (info.rotation && !options.orientation))) continue;
    if (info.role == Role::geometry && !is_fitted_geometry(info, parallel, robot)) continue;
    free.push_back(static_cast<int>(k));
    out.parameters.push_back(info);
  }
  std::vector<std::int32_t> rows(poses.size());
  for (std::size_t k = 0; k < rows.size(); ++k) rows[k] = static_cast<std::int32_t>(k);
  const std::vector<std::vector<double>> bases = make_bases(model, measured.data);
  const Evaluator evaluator(model, measured.data, bases, make_segments(measured.data, rows), free, 1);
  Weighing weighing;
  weighing.position_scale = 1.0 / options.position_sigma;
  weighing.rotation_scale = 1.0 / options.rotation_sigma;
  const Eigen::VectorXd values = initial_values(model);
  out.x.resize(static_cast<Index>(poses.size()) * out.per_pose, static_cast<Index>(free.size()));
  Index row = 0;
  for (int tile = 0; tile < evaluator.tile_count(); ++tile) {
    Eigen::VectorXd r(evaluator.tile_rows(tile) * evaluator.tile_components(tile));
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> j(r.size(), out.x.cols());
    evaluator.tile(tile, values, weighing, r.data(), j.data());
    out.x.middleRows(row, r.size()) = j;
    row += r.size();
  }
  const double rounding = kRounding / options.position_sigma * std::sqrt(static_cast<double>(poses.size()));
  for (Index k = 0; k < out.x.cols(); ++k) {
    if (out.x.col(k).norm() < rounding) out.x.col(k).setZero();
  }
  if (carrying) *carrying = robot_with(model, values);
  return out;
}

double View::r2(std::size_t a, std::size_t b) const {
  const double all_of_it = seen[a].left.squaredNorm();
  return all_of_it > 0.0 ? std::min(1.0, (seen[b].basis.transpose() * seen[a].left).squaredNorm() / all_of_it) : 0.0;
}

double View::visible_beside(std::size_t rival, Index column) const {
  return beyond(seen[rival].basis, beyond(frames, columns.x.col(column))).squaredNorm();
}

double View::standard_errors(std::size_t group) const {
  const auto parameters = static_cast<std::size_t>(std::max<Index>(1, seen[group].basis.cols()));
  return std::sqrt(
      2.0 * detection_nats(SearchOptions().threshold, std::log(static_cast<double>(seen.size())), parameters, values));
}

View look(const Robot& robot, const std::vector<Planned>& poses, const std::vector<Group>& groups,
          const DistinguishOptions& options, Robot* carrying) {
  View out;
  out.columns = make_columns(robot, poses, requests_of(groups), options, carrying);
  const MatrixXd& x = out.columns.x;
  out.values = static_cast<double>(x.rows());
  for (std::size_t k = 0; k < out.columns.parameters.size(); ++k) {
    const Role role = out.columns.parameters[k].role;
    if (role == Role::base) out.base.push_back(static_cast<Index>(k));
    if (role == Role::target) out.tool.push_back(static_cast<Index>(k));
    if (role == Role::geometry) out.geometry.push_back(static_cast<Index>(k));
  }
  out.frames = orthonormal(beside(unit_columns(chosen(x, out.base)), unit_columns(chosen(x, out.tool))), kSameColumn);
  out.all = beside(out.frames, orthonormal(beyond(out.frames, unit_columns(chosen(x, out.geometry))), kSameColumn));
  for (const Group& group : groups) out.seen.push_back(seen_of(group, out.columns, out.frames));
  return out;
}

EffectSize smallest(const View& view, const Group& group, std::size_t g, const DistinguishOptions& options) {
  EffectSize best;
  double least = std::numeric_limits<double>::infinity();
  bool best_with_geometry = false;
  const double errors = view.standard_errors(g);
  for (const Index k : view.seen[g].columns) {
    const auto column = view.columns.x.col(k);
    const double visible = beyond(view.frames, column).squaredNorm(),
                 beside_geometry = beyond(view.all, column).squaredNorm();
    if (!(visible > kInvisible * column.squaredNorm())) continue;
    const bool with_geometry = beside_geometry > kInvisible * column.squaredNorm();
    const double tip = at_tip(view, k, options.position_sigma);
    const double size = errors / std::sqrt(visible),
                 larger = with_geometry ? errors / std::sqrt(beside_geometry) : kNaN;
    const double judged = (with_geometry ? larger : size) * tip;
    if (with_geometry < best_with_geometry || (with_geometry == best_with_geometry && judged >= least)) continue;
    least = judged;
    best_with_geometry = with_geometry;
    const ParameterInfo& info = view.columns.parameters[static_cast<std::size_t>(k)];
    best = {group.effect->name, group.joint, info.name, info.unit, size, size * tip, larger, larger * tip, errors};
  }
  return best;
}

bool is_beyond_machines(const EffectSize& size, const Group& group, const Robot& robot) {
  const bool whole = size.unit == "rad" || size.unit == "m" || size.unit == "-";
  const double plausible = group.effect->traits.plausible;
  const bool too_large = plausible > 0.0 ? size.size > plausible : whole && size.size > kWholeUnit;
  return too_large || size.size_at_tip > kShareOfLength * stretched_length(robot);
}

NotTestable why_not_seen(const EffectSize& size) {
  NotTestable out{size.effect, {}, "", Untestable::other};
  if (!size.joint.empty()) out.joints = {size.joint};
  out.why = "it would show from " + number(size.size, 2) + " " + (size.unit == "-" ? "" : size.unit + " ") +
            "on, more than machines have";
  return out;
}

NotTestable why_invisible(const View& view, const Group& group, const Seen& seen) {
  const MatrixXd x = unit_columns(chosen(view.columns.x, seen.columns));
  const auto is_taken_up_by = [&](const std::vector<Index>& frame) {
    return beyond(orthonormal(unit_columns(chosen(view.columns.x, frame)), kSameColumn), x)
               .colwise()
               .squaredNorm()
               .maxCoeff() < kInvisible;
  };
  NotTestable out{group.effect->name, {}, "the same as base and tool together", Untestable::same_as_frames};
  if (!group.joint.empty()) out.joints = {group.joint};
  if (x.squaredNorm() == 0.0) {
    out.why = "moves nothing in this plan";
    out.reason = Untestable::no_motion;
  } else if (is_taken_up_by(view.base)) {
    out.why = "the same as the base frame";
  } else if (is_taken_up_by(view.tool)) {
    out.why = "the same as the tool";
  }
  return out;
}

}  // namespace truing::planning
