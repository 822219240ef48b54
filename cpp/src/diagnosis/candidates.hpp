// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// What may explain a gap: every effect at every joint, geometry, drifting frames, corrections of laws, free functions.

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "diagnosis/inputs.hpp"
#include "estimation/evidence.hpp"
#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// Coordinates of a frame, in the order of its columns.
constexpr const char* kFrame[6] = {"x", "y", "z", "rx", "ry", "rz"};
/// In place of an effect's name: a function of what was recorded, and of no known cause.
constexpr const char* kNoEffect = "free";

/// The base seen from where the arm stands: axes that turn with the joint that turns the arm. Of six coordinates, three
/// shifts and three turns, the last of each three is along that joint's axis.
struct TurningBase {
  int angle = -1;  ///< index in make_inputs of that joint's angle; -1: no joint turns the arm as a whole
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< where that joint stands at zero, in the measurement frame
  std::vector<int> coordinates{0, 1, 2, 3, 4, 5};      ///< those that move
};

/// One candidate, as the user reads it and as `identify` is asked for it.
struct Explanation {
  enum class Kind { catalogue, all_geometry, drift, law, free };
  Kind kind = Kind::catalogue;
  std::string effect;
  std::vector<std::string> joints;
  std::vector<std::string> parameters;        ///< names of its columns
  std::vector<std::string> model_free;        ///< parameters of the model to free: a form's has columns as well
  std::vector<EffectRequest> requests;        ///< effects to ask for
  std::map<std::string, double> constants{};  ///< of the effect's form (EffectForm), which the robot is to carry
  std::string note;
  std::string driver;   ///< the input that its law is a function of, if one
  double period = 0.0;  ///< of its law, in the motion of each of its joints [rad]; 0: it has none
  // kind drift, law, free: hats of inputs at a site
  std::string site;
  std::vector<int> inputs;  ///< indices of make_inputs
  std::vector<std::vector<double>> knots;
  LawTest law_test = LawTest::of_driver;  ///< kind law: which function its columns are
  TurningBase turning{};                  ///< kind free, at the base: along axes that turn with the arm
};

/// A candidate that is a free function of time from the start, be it named or not.
inline bool is_over_time(const Explanation& e) {
  return e.kind == Explanation::Kind::drift || (e.kind == Explanation::Kind::free && e.effect != kNoEffect);
}

struct Candidates {
  std::vector<Explanation> named;  ///< parallel to `groups`
  std::vector<ColumnGroup> groups;
  std::vector<NotTestable> not_testable;
};

/// What candidates and their columns are made from.
struct DesignTask {
  const Robot& nominal;                 ///< as given, base and targets found: what an effect must suit
  const Robot& at;                      ///< linearised here
  std::map<std::string, double> shift;  ///< parameters of the geometry: value at `at` minus nominal
  const Measurements& data;
  const std::vector<InputColumn>& inputs;
  std::vector<std::int32_t> rows;  ///< of the search, training and test
  const std::vector<std::int8_t>& set;
  const std::vector<std::int32_t>& cluster;  ///< pose group of every row
  const DiagnoseOptions& options;
  bool inferred_direction = false;
};

/// Every candidate, each charged with the cost of having looked at all of its kind; their columns are still to come.
Candidates make_candidates(const DesignTask& task);

/// True when the effect is not to be considered, by name.
bool is_left_out(const DiagnoseOptions& options, const std::string& effect);

/// Lengths of a link that its convention has, and the sites that they are values of [m].
std::vector<std::pair<std::string, double>> lengths_of_link(const Robot& robot, const std::string& joint);

/// Of LawTest::times_the_lengths: the lengths of its joints' links, of every link where it names none.
std::vector<std::pair<std::string, double>> lengths_that_grow(const Robot& robot, const Explanation& e);

/// Coordinates of a frame that wanders: "base.xyz" -> base.x, base.y, base.z; "base" and "base.xyzrxryrz" -> all six; a
/// joint -> none.
std::vector<std::string> frame_coordinates(const std::string& site);

}  // namespace truing::diagnosis
