// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Every effect at every joint as columns, and their normal equations joint by joint: a column of one joint's torque
// meets those of the same joint alone.

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "dynamics/prepare.hpp"
#include "dynamics/torque_model.hpp"
#include "estimation/evidence.hpp"
#include "rooms.hpp"
#include "truing/common/not_testable.hpp"
#include "truing/dynamics/effect.hpp"

namespace truing::dynamics {

/// Columns that come and go together: one form of an effect at a joint, or a free function.
struct TorqueGroup {
  std::string effect;               ///< empty: a free function
  std::vector<std::string> joints;  ///< names; of an effect of the whole robot: none
  int joint = -1;                   ///< number of the joint whose torque it is; -1: of several
  bool standard = false;
  TorqueFamily family = TorqueFamily::own;
  std::vector<std::string> inputs;  ///< of a free function
  double low = 0.0, high = 0.0;     ///< of its first input: first and last knot
  int forms = 1;                    ///< number of forms that the effect has there
  bool of_given_masses = false;     ///< an alternative of masses; where these are the file's it may be named
  std::vector<int> columns;
};

struct TorqueDesign {
  std::vector<TorqueTerm> terms;  ///< one a column
  std::vector<TorqueGroup> groups;
  std::vector<NotTestable> not_testable;
};

/// All effects of the catalogue, and one's own, at all joints. `leave_out`: names. `fits_masses`: inertial parameters
/// are fitted beside them.
TorqueDesign design_of(const Robot& robot, const MotionRange& range, const std::vector<TorqueEffect>& own,
                       const std::set<std::string>& leave_out, bool fits_masses);
/// Effects that are the same as masses, joint by joint and of all drives by one factor: they are not named, but may be
/// what links' inertias look like.
void add_alternatives_of_masses(const Robot& robot, const MotionRange& range, const std::vector<TorqueEffect>& own,
                                TorqueDesign* design);
/// One effect more, in all its forms, at a joint (-1: at every joint). Throws std::invalid_argument where it does not
/// suit.
void add_effect(const TorqueEffect& effect, int joint, const Robot& robot, const MotionRange& range,
                TorqueDesign* design);
/// Free functions of what may drive an unknown effect, at every joint.
void add_free_functions(const Robot& robot, const MotionRange& range, TorqueDesign* design);

/// Some groups of a design, in this order.
TorqueDesign part_of(const TorqueDesign& whole, const std::vector<int>& groups);

/// Which tile rows belong to which fold.
struct Folds {
  std::vector<int> of_recording;  ///< -1: not of these folds
  std::vector<int> of_block;      ///< not empty: recordings are cut into blocks of time; -1: not of these folds
  double block_length = 0.0;      ///< [s]
  int count = 0;

  int fold(std::size_t recording, double time) const;
};

/// Normal equations of one joint's torque, fold by fold; columns are numbers of the design's.
struct JointGrams {
  /// `of_design`: how many columns the design has.
  JointGrams(std::vector<int> columns, std::size_t of_design, int folds);

  std::vector<int> columns;
  std::vector<Eigen::Index> places;  ///< where each column of the design stands among these; -1: it does not
  std::vector<Gram> folds;           ///< without rows: empty
};
using TorqueGrams = std::shared_ptr<const std::vector<JointGrams>>;  ///< by joint

/// How the errors of a model go on in time.
struct Noise {
  double sigma = 1.0;          ///< [Nm | N] standard deviation of a filtered row
  double design_effect = 1.0;  ///< rows that count as one
  double rows = 0.0;
  /// Less than 1 where errors are far beyond those of other folds; none: 1.
  Eigen::VectorXd weight_of_fold{};
};

/// Standard deviation and design effect (Kish 1965; 1 + 2 sum of autocorrelations) of every joint's errors.
std::vector<Noise> noise_of(const Tiles& tiles, const TorqueModel& model, const Folds& folds);
/// The same of errors in the tile's own rows, shape=(count, joints).
std::vector<Noise> noise_of(const Tiles& tiles, const std::function<Eigen::MatrixXd(Tile&)>& errors,
                            const Folds& folds);

void fill_rigid(Motion* motion);

/// Sets Motion::direction to what friction that turns so knows of it.
void set_direction(const std::vector<FrictionTurn>& turns, Tile* tile);
/// Torque of the model in the tile's own rows, shape=(count, joints). Sets Motion::direction and Motion::torque.
Eigen::MatrixXd own_torque(const TorqueModel& model, Tile* tile);
/// The same without setting anything; kept for the next time that the tile is asked for the same model.
const Eigen::MatrixXd& kept_torque(const TorqueModel& model, Tile* tile);
/// Only Motion::direction and Motion::torque.
void set_torque(const TorqueModel& model, Tile* tile);

/// One fold, all joints together: each in units of its noise and with rows that count as one. As one matrix it would be
/// mostly zeros.
class FoldGram {
 public:
  FoldGram(TorqueGrams grams, std::size_t fold, const std::vector<Noise>& noise);
  Gram of(const std::vector<int>& columns) const;
  /// Of several columns with one.
  Eigen::VectorXd products(const std::vector<int>& columns, int with) const;
  /// Of two columns; of a column with the torque.
  double product(int one, int other) const;
  double product(int column) const;

  const TorqueGrams& joints() const { return grams_; }
  double design_effect(std::size_t joint) const { return design_effects_[joint]; }

 private:
  TorqueGrams grams_;
  std::size_t fold_;
  std::vector<double> weights_;         ///< of the joints' squares
  std::vector<double> design_effects_;  ///< of the joints' noise
  double yy_ = 0.0, n_ = 0.0;
};

/// All folds of a joint together, in units of its noise, with rows that count as one.
Gram sum_of_folds(const JointGrams& grams, const Noise& noise);
/// All folds and joints together, in the same units; joints on so many threads (0: as many as the machine has).
Gram sum_of_folds(const std::vector<JointGrams>& grams, const std::vector<Noise>& noise, std::size_t columns,
                  int threads = 1);

}  // namespace truing::dynamics
