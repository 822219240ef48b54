// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The machinery of InverseSolver: candidates from the closed form, descents, the check of what comes out, why it
// failed.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "inverse_kinematics/arm.hpp"
#include "inverse_kinematics/closed_form.hpp"
#include "inverse_kinematics/descent.hpp"
#include "inverse_kinematics/surroundings.hpp"
#include "math/constants.hpp"
#include "rooms.hpp"
#include "truing/inverse.hpp"

namespace truing::inverse_kinematics {

constexpr double kLimitRounding =
    1e-9;  ///< a reading so far beyond its limit is rounding, and set to the limit [rad | m]
constexpr double kNearLimit =
    0.02;  ///< a seed so far beyond may lead to joints within: the robot is not quite the closed form's

using Gram = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxDrivenJoints, kMaxDrivenJoints>;

/// Scratch memory of the pool while it is needed; none for robots without effects.
class Borrowed {
 public:
  Borrowed(const Arm& arm, ScratchPool* pool, const Conditions& conditions) : pool_(pool) {
    if (!arm.has_effects()) return;
    scratch_ = pool->take();
    arm.set_conditions(conditions, scratch_.get());
  }
  ~Borrowed() {
    if (scratch_) pool_->give_back(std::move(scratch_));
  }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  EffectScratch* get() const { return scratch_.get(); }

 private:
  ScratchPool* pool_;
  std::unique_ptr<EffectScratch> scratch_;
};

/// A seed that the closed form gave.
struct Candidate {
  double readings[kMaxDrivenJoints];
  double distance;  ///< from the seed, squared, joints in radians' worth
  double excess;    ///< beyond limits
  int branch;
};

/// One call of solve: what is wanted, from where, and what was met on the way.
struct Search {
  const Goal& goal;
  const double* seed;
  EffectScratch* scratch;
  bool by_way = false;  ///< approach directions are those of the way from the seed
  int iterations = 0;
  Descent nearest{};       ///< of all descents within limits the one that came nearest
  Solution interfering{};  ///< of what would be there but for an interference the least deep; joints empty: none
};

/// What a task leaves free, and between which bounds: rails before the arm, then the roll of a torch.
struct Box {
  static constexpr int kMost = 4;
  double low[kMost] = {}, high[kMost] = {};
  int count = 0;
  bool rolls = false;
};

class Reach {
 public:
  Reach(const Robot& robot, const InverseOptions& options, const Conditions& conditions, std::size_t target,
        const std::vector<Effect>& own);

  const InverseOptions options;
  const Conditions conditions;
  const Arm arm;
  const Limits limits;
  const Scales scales;
  const ClosedForm closed;
  const Surroundings surroundings;
  mutable ScratchPool pool;

  int driven() const { return arm.driven(); }

  /// One answer, or why there is none.
  Solution solve(Search* search) const;
  /// From the seed alone, and within limits.
  Solution follow(Search* search) const;
  /// All answers that the closed form knows of, or many descents find.
  void branches(Search* search, Branches* found) const;
  /// Joints along a chain of goals; `scratch` as for one solve; `by_way`: approach directions are those of the path.
  Path path(const std::vector<Goal>& goals, const double* seed, const PathOptions& how, EffectScratch* scratch,
            bool by_way, const std::function<bool(std::size_t)>& progress) const;
  /// Where effects ask for the direction that a joint came from and nobody said: the way from the seed. An answer
  /// changes the ways, and the ways the answer, by no more than the play: a few rounds settle it.
  void settle_directions(Search* search, Solution* solution) const;

  /// The independent check: forward once more, task, limits, interference. Fills errors and roll; true: reached.
  bool check(Search* search, const double* readings, Solution* solution) const;

  /// By InverseOptions::choose: how good these joints are, more is better.
  double merit(const Search& search, const double* readings) const;

 private:
  // reach.cpp
  Descent descent_from(Search* search, const double* from, const DescentOptions& how) const;
  bool descend_to(Search* search, const double* from, Solution* solution) const;
  bool descend_from_many(Search* search, int restarts, Solution* solution) const;
  void restart_seed(int k, const double* around, double* seed) const;
  int candidates(Search* search, const Goal& pose, const double* rails, double slack, Candidate* found) const;
  double newton_numerator(const Goal& pose, const double* readings, int joint, EffectScratch* scratch) const;
  void choose_on_circles(const Goal& pose, const double* rails, Configuration* all, int count, EffectScratch* scratch,
                         bool* worth) const;
  bool polish(Search* search, const Candidate& candidate, Solution* solution) const;
  bool finish(Search* search, Descent descent, Solution* solution) const;
  void leave_singularity(Search* search, const double* seed, const DescentOptions& how, Descent* descent) const;
  bool solve_by_branches(Search* search, Solution* solution) const;
  bool solve_by_rolls(Search* search, Solution* solution) const;
  bool solve_once(Search* search, Solution* solution) const;
  bool solve_at_preferred_roll(Search* search, Solution* solution) const;
  bool retreat(Search* search, Solution* solution) const;
  double distance2(const double* a, const double* b) const;

  // best.cpp
  int nearest_to_limit(const double* readings) const;
  void pull(Search* search, Solution* solution) const;
  bool find_free(const Goal& goal, Box* free) const;
  double best_branch(Search* search, const Search& asked, const Box& free, const double* x, Candidate* best) const;
  double best_answer(Search* search, const Search& asked, const double* x, Solution* best) const;
  bool solve_for_best(Search* search, Solution* solution) const;
  bool solve_for_best_of_many(Search* search, Solution* solution) const;

  // path.cpp
  struct Node;
  void sample(const Goal& goal, const double* seed, const PathOptions& how, EffectScratch* scratch,
              std::vector<Node>* nodes) const;
  double step_cost(const double* from, const double* to, const PathOptions& how, double slack) const;
  double turn_of(int joint) const;
  void even_out(const std::vector<Goal>& goals, const PathOptions& how, EffectScratch* scratch,
                std::vector<Joints>* joints) const;

  // why_not.cpp
  void explain(Search* search, Solution* solution) const;
  Eigen::Vector3d singular_direction(const double* readings, EffectScratch* scratch) const;
  Vector6d still_direction(const double* readings, int fixed, EffectScratch* scratch, double* still) const;
  void bring_near(const double* seed, double* readings) const;

  double golden_[kMaxDrivenJoints];
};

/// The wanted frame turned about the torch's axis, and leant as little as its windows ask for.
Goal pose_at_roll(const Goal& goal, double roll);

}  // namespace truing::inverse_kinematics
