// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "truing/common/parameter.hpp"
#include "truing/identify.hpp"
#include "truing/model/measurement.hpp"
#include "truing/model/robot.hpp"

namespace truing {

/// What speaks against the robot file or the columns that were handed to `identify`.
struct Mistake {
  /// 'joint_sign', 'joint_order', 'joint_unit', 'length_unit', 'handedness', 'link_unit', 'row_shift', 'convention',
  /// 'orientation_order', 'orientation_inverse' or 'pose_inverse': reading it otherwise explains the measurements;
  /// 'frame_change': two frames do; 'lag': joints of an instant before or after do; 'unexplained': nothing of this
  /// does.
  std::string kind;
  std::string text;  ///< what is wrong, and what to do, in sentences
  /// What changed by more than a workshop makes, most first: 10 mm or 2 % of the robot's reach if that is more, 3
  /// degrees, 5 % of a gear ratio. Three standard errors are taken off first. Zeros of joints are here only beside a
  /// reading that explains them: a controller may count from anywhere.
  std::vector<Parameter> changes;
};

/// Looks at what `identify` found the way a calibration engineer does, before anyone believes it. A joint with the
/// wrong sign is fitted as well by turning two links round, so a change of a link beyond what a workshop makes, or more
/// left over than a good model leaves, has the usual mistakes tried: the sign of a joint, the order of joint columns,
/// units of angles and lengths, the Denavit-Hartenberg convention. Each is undone, base and targets are fitted, and one
/// that halves the error is the likely mistake if the refit under it changes no link as much.
///
/// Before that, orientations that are scalar last, turned round or of inverse poses, an instrument that was moved,
/// clocks that differ where the robot moved while it was measured, and a row that is missing in the middle or measured
/// twice, are looked for.
///
/// `found`: by identify(nominal, data, options). Empty: nothing speaks against it.
std::optional<Mistake> review(const Robot& nominal, const Measurements& data, const Identification& found,
                              const IdentifyOptions& options = {});

/// [m] noise of one position component (or distance), as rows measured again at one pose scatter: noise alone, where
/// `Identification::noise_sigma` also has what the model does not explain. Empty: the repeats have fewer than 20
/// degrees of freedom.
std::optional<double> noise_from_repeats(const Measurements& data);

}  // namespace truing
