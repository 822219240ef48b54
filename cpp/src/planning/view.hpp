// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A plan, looked at: columns of every effect at the planned poses, and what base, tool and each other take up of them.

#include <string>
#include <vector>

#include <Eigen/Core>

#include "model/model.hpp"
#include "planning/groups.hpp"
#include "planning/planned_poses.hpp"
#include "rooms.hpp"
#include "truing/plan.hpp"

namespace truing::planning {

/// A column of which less is left (of its square) cannot be seen.
constexpr double kInvisible = 1e-9;

/// Unit-weight columns of every parameter of the model at the planned poses.
struct Columns {
  Eigen::MatrixXd x;  ///< shape (poses * per_pose, parameters)
  std::vector<ParameterInfo> parameters;
  Eigen::Index per_pose = 3;

  Eigen::Index at(const std::string& name) const;
};

/// `carrying` (null: none) becomes the robot with the effects at zero: it remembers mean temperatures and knots.
Columns make_columns(const Robot& robot, const std::vector<Planned>& poses, const std::vector<EffectRequest>& requests,
                     const DistinguishOptions& options, Robot* carrying);

/// Those of `x`, in this order.
Eigen::MatrixXd chosen(const Eigen::MatrixXd& x, const std::vector<Eigen::Index>& columns);

/// One group's columns at a plan.
struct Seen {
  std::vector<Eigen::Index> columns;  ///< of Columns
  Eigen::MatrixXd left;               ///< unit columns beyond base and tool
  Eigen::MatrixXd basis;              ///< and what they span
};

/// A plan, looked at.
struct View {
  Columns columns;
  std::vector<Eigen::Index> base, tool, geometry;
  Eigen::MatrixXd frames, all;  ///< bases of what base and tool span, and of that with all geometry
  std::vector<Seen> seen;       ///< parallel to the groups
  double values = 0.0;

  bool is_visible(std::size_t group) const { return seen[group].basis.cols() > 0; }
  /// Fraction of group a's motion of the tip that group b explains.
  double r2(std::size_t a, std::size_t b) const;
  /// What is left of a parameter's square beyond base, tool and the rival.
  double visible_beside(std::size_t rival, Eigen::Index column) const;
  /// Standard errors that diagnose would ask of an effect with so many parameters, out of so many effects.
  double standard_errors(std::size_t group) const;
};

View look(const Robot& robot, const std::vector<Planned>& poses, const std::vector<Group>& groups,
          const DistinguishOptions& options, Robot* carrying);

/// The smallest effect of a group that the plan would see.
EffectSize smallest(const View& view, const Group& group, std::size_t g, const DistinguishOptions& options);

/// A size that no machine has: the plan does not test for the effect.
bool is_beyond_machines(const EffectSize& size, const Group& group, const Robot& robot);
NotTestable why_not_seen(const EffectSize& size);

/// Why nothing is left of a group beyond base and tool.
NotTestable why_invisible(const View& view, const Group& group, const Seen& seen);

}  // namespace truing::planning
