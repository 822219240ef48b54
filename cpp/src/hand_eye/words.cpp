// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#include "hand_eye/words.hpp"

#include <algorithm>
#include <cmath>

#include "hand_eye/readings.hpp"
#include "math/direction.hpp"
#include "math/text.hpp"

namespace truing::hand_eye {
namespace {

std::string what_of(const Unobservable& u, const std::string& parent) {
  switch (u.reason) {
    case UnobservableReason::no_rotation:
      return "the camera's position along " + direction_name(u.direction, parent);
    case UnobservableReason::one_axis:
      return "the camera's height along " + direction_name(u.direction, parent);
    case UnobservableReason::large_error:
      return std::string("the camera's ") + (u.rotation ? "rotation about " : "position along ") +
             direction_name(u.direction, parent);
    case UnobservableReason::singular:
      break;
  }
  return "the place of camera and board together";
}

std::string advice_of(const Unobservable& u) {
  switch (u.reason) {
    case UnobservableReason::no_rotation:
      return "the hand did not turn: rotate it by 30 deg or more about two axes";
    case UnobservableReason::one_axis:
      return "all rotations are about this one axis: rotate about a second one by 30 deg, or tell "
             "the height (known height)";
    case UnobservableReason::large_error:
      return "its standard error would be " + (u.rotation ? degrees(u.sigma) : millimetres(u.sigma)) +
             ": turn the hand further, by 30 deg or more about two axes, or take more poses";
    case UnobservableReason::singular:
      break;
  }
  return "rotate the hand about two axes by 30 deg or more, and move it";
}

}  // namespace

std::string camera_parent(HandEyeSetup setup) { return setup == HandEyeSetup::eye_in_hand ? "flange" : "base"; }

Unobservable unobservable(UnobservableReason reason, const Eigen::Vector3d& direction, HandEyeSetup setup,
                          bool rotation, double sigma) {
  Unobservable out{reason, {}, direction, rotation, sigma, {}};
  out.what = what_of(out, camera_parent(setup));
  out.advice = advice_of(out);
  return out;
}

std::string unobservable_message(const std::vector<Unobservable>& all) {
  if (!all.empty() && all[0].reason == UnobservableReason::no_rotation)
    return "The camera's position is not observable: the hand moved without turning. Rotate it by 30 deg or more about "
           "two axes.";
  std::string text;
  for (const Unobservable& u : all)
    text += (text.empty() ? "" : " ") + u.what + " is not observable; " + u.advice + ".";
  if (!text.empty()) text[0] = 'T';  // "the camera's …"
  return text;
}

std::string not_closing_message(const HandEyeResult& result, HandEyeSetup setup) {
  const std::string given = "The loop does not close as given (median " + millimetres(result.as_given.position_rms) +
                            ", " + degrees(result.as_given.rotation_rms) + ").";
  if (result.readings.empty() && result.board_scale != 1.0)
    return given + " It closes with a board " + number(std::max(result.board_scale, 1.0 / result.board_scale), 3) +
           " times as " + (result.board_scale > 1.0 ? "large" : "small") + ": check its lengths, and their unit.";
  if (result.readings.empty())
    return given +
           " No other reading of the poses that was tried closes it: check that every board belongs to its hand pose "
           "(where a row is missing, or there twice, all that follow are shifted), and how orientations are written.";
  const Reading& best = result.readings.front();
  const std::string closes =
      given + " It closes to " + millimetres(best.position_rms) + ", " + degrees(best.rotation_rms) + " if ";
  if (!best.other_setup) return closes + best.explanation + ": reading \"" + best.name + "\".";
  const std::string other = setup == HandEyeSetup::eye_in_hand ? "eye-to-hand" : "eye-in-hand",
                    told = setup == HandEyeSetup::eye_in_hand ? "eye-in-hand" : "eye-to-hand";
  const std::string rest = best.name.substr(0, best.name.find(kOtherSetup));  // and what is to be read otherwise
  return closes + "the set-up is " + other + ", not " + told + ": set-up " + other +
         (rest.empty() ? "" : ", reading \"" + rest.substr(0, rest.size() - 1) + "\"") + ".";
}

std::string text_of(const HandEyeConcern& concern) {
  switch (concern.kind) {
    case HandEyeConcernKind::not_like_noise:
      return "What is left does not look like noise of robot and camera poses: plain weights predict poses that were "
             "left out better (" +
             millimetres(concern.value) + " for " + millimetres(concern.reference) +
             "). The robot's own kinematics may be off: give joint values and the robot model (with kinematics).";
    case HandEyeConcernKind::beyond_pixels:
      return "Boards scatter by " + degrees(concern.value) + " about what the loop expects, " +
             number(concern.reference, 2) +
             " times what their pixels can tell: is the lens calibrated, the board flat, did anything move while the "
             "image was taken? Board poses are weighed by that scatter, not pixels by theirs.";
    case HandEyeConcernKind::noise_of_one_side:
      return "Position noise was given for one side, robot or camera, only: what acts is their sum, which was found "
             "from "
             "the data.";
    case HandEyeConcernKind::noise_too_small:
      return "The poses scatter " + number(concern.value, 3) +
             " times as much as the noise that was given; standard errors are widened by that.";
    case HandEyeConcernKind::board_scale: {
      const double off = concern.value - 1.0;
      return "The loop closes better with a board " + number(100.0 * std::abs(off), 3) + " % " +
             (off > 0.0 ? "larger" : "smaller") + " than given (standard error " +
             number(100.0 * concern.reference, 2) + " %): check the size of its squares.";
    }
    case HandEyeConcernKind::other_lens:
      return "With the camera as it was given, points of the board are off by " + number(concern.value, 2) +
             " px in their images, and by " + number(concern.reference, 2) +
             " px with one that fits them: is it this camera, focused as when it was calibrated? Standard errors take "
             "it for exact: have it refined.";
    case HandEyeConcernKind::behind_camera:
      break;
  }
  return number(concern.value) + " of " + number(concern.reference) +
         " boards lie behind the camera (z of the board pose is not positive): does its z axis look out of the lens? "
         "If hand and board poses are both inverted, camera and board have changed places.";
}

void warn(HandEyeResult* result, const HandEyeConcern& concern) {
  result->concerns.push_back(concern);
  result->warnings.push_back(text_of(concern));
}

}  // namespace truing::hand_eye
