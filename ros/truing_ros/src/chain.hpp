// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <urdf_model/model.h>
#include <truing/inverse.hpp>

namespace truing_ros {

/// The chain between two links of a parsed URDF, as the plugins need it: by names, fixed joints folded away.
struct Chain {
  struct Link {
    std::string name;
    std::size_t moving = 0;         ///< how many of `joints` lie before it
    Eigen::Isometry3d T_last_link;  ///< shape=(4, 4) [m] in the frame after the last of these, or in the base
  };
  std::string base;
  truing::Robot robot;             ///< convention urdf; its only target is the tip
  std::vector<std::string> names;  ///< of all moving joints, base first, those that mimic too
  std::vector<Link> links;         ///< base first, tip last

  /// Throws std::invalid_argument that lists the links there are.
  const Link& link(const std::string& name) const;

  /// Readings of the driven joints out of the positions of all of `names`; wrong sizes are the caller's business.
  truing::Joints driven(const std::vector<double>& positions) const;
  /// Positions of all of `names`: those of joints that mimic follow. [rad | m]
  std::vector<double> all(const truing::Joints& readings) const;
};

/// Throws std::invalid_argument: unknown link, tip not below base, nothing moves between them, floating or planar
/// joint, a joint that mimics one that does not lie before it in the chain.
Chain chain_between(const urdf::ModelInterface& model, const std::string& base, const std::string& tip);

/// The robot up to a link, which is its target. `link.moving` has to be above 0.
truing::Robot robot_up_to(const Chain& chain, const Chain::Link& link);

/// shape=(4, 4) [m] where a link is in the base frame.
Eigen::Isometry3d link_pose(const Chain& chain, const Chain::Link& link, const truing::Joints& readings);

}  // namespace truing_ros
