// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// One diagnosis as it goes: its working state, and the steps that diagnose.cpp puts in order.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "diagnosis/design.hpp"
#include "diagnosis/free_search.hpp"
#include "diagnosis/linearise.hpp"
#include "diagnosis/orders.hpp"
#include "diagnosis/rows.hpp"
#include "estimation/confidence.hpp"
#include "estimation/evidence.hpp"
#include "model/repeats.hpp"
#include "rooms.hpp"
#include "truing/diagnose.hpp"

namespace truing::diagnosis {

/// What is diagnosed, from the registration on.
struct Registered {
  DiagnoseOptions options;
  Measurements data;  ///< with the better joint record, and approach directions where they could be inferred
  bool inferred_direction = false;
  bool mistaken = false;              ///< robot file or columns are to be corrected first: nothing is named
  std::vector<std::int32_t> cluster;  ///< pose group of every row
  std::vector<std::int8_t> set;       ///< 0 train, 1 test, for every row
  Identification frames;              ///< base and targets found, everything else nominal
  /// Standard errors by which held-out errors of the frames exceed what repeats show. 0: of those there are too few.
  double beyond_repeats = 0.0;
};

/// What noise is.
struct Noise {
  double design_effect = 1.0;   ///< values of a pose that count as one (Kish 1965)
  double position_sigma = 0.0;  ///< [m] of a component (or a distance), from the flexible fit
  double unit = 0.0;  ///< of a component that its row's own sigma and weight have been divided by; without those [m]
  std::vector<std::int32_t> outliers;  ///< rows that count for little
};

/// Sums of the weighted rows, fold by fold and of all.
struct Grams {
  std::vector<Gram> train_folds, test_folds;
  Gram train, test;
};

/// What the search works on. It appends columns of functions that it finds to the design, and nothing else.
struct Work {
  Registered given;  ///< of the rows that are searched
  Linearisation linear;
  std::vector<InputColumn> inputs;
  Design design;
  std::vector<Sampling> samplings;  ///< of joints whose orders can be looked for
  Noise noise;
  Grams grams;
};

/// An effect that fits, and would have to be larger than any machine has.
struct TooLarge {
  int group = -1;
  int column = -1;  ///< of the design, that is beyond
  double size = 0.0;
  ColumnGroup candidate{};  ///< as it was
};

/// What a free function of one or two inputs would still win, at a joint.
struct FunctionBeside {
  std::string joint;
  std::vector<int> inputs;
  double evidence = 0.0;  ///< log Bayes factor; of two inputs less what having tried all of them costs
};

/// Everything that was decided.
struct Decision {
  Evidence::State state;  ///< named, laws and free functions
  SearchOptions search;   ///< with the threshold raised to what noise alone reaches
  double p_gap = 1.0;
  double p_left = 1.0;
  std::vector<Evidence::Gain> first;     ///< every group alone
  std::map<int, int> corrects;           ///< a law's correction, or what is one: the group whose law it corrects
  std::vector<TooLarge> too_large{};     ///< set aside: the rest was decided without them
  std::vector<FunctionBeside> beside{};  ///< the likeliest of those that were not taken
  std::set<int> in_question{};           ///< groups of which several together may stand for one function
};

struct Refit {
  Identification found;
  std::vector<Effect> own;
};

/// What may stand in a named group's place.
struct Rival {
  int group = -1;
  double loss = 0.0;  ///< of score [nats]
  double r2 = 0.0;    ///< share of the named effect's motion of the tip that it can make
  bool in_class = false;
};

struct Sureness {
  std::vector<Rival> rivals;     ///< those in the class first, by loss
  double posterior = 0.0;        ///< of the class
  double removal_loss = 0.0;     ///< nats lost without it
  bool law_in_question = false;  ///< any function of its input does as well, or finds something beside it
  bool law_is_part = false;  ///< of the angle that its law follows, a function there or elsewhere does what it does not
};

/// Errors that a choice leaves of poses that its fit did not see, times the root of their weight.
struct UnseenErrors {
  std::vector<double> length;          ///< [m] of position (or distance), by row
  std::vector<double> square_of_fold;  ///< [m^2] sum of squares; rotations in it by their noise
};

/// The selection repeated on resampled poses: which groups come back, and how far the held-out error shrinks each time.
struct Resampled {
  std::vector<std::vector<int>> chosen;
  std::vector<double> shrink;  ///< of the held-out rms, all groups
};

// --- weigh.cpp: what noise is ----------------------------------------------------------------------------------------

/// 0 position, 1 rotation, 2 distance.
inline int kind_of(std::int8_t component) { return component < 3 ? 0 : component < 6 ? 1 : 2; }

struct Weighted {
  Eigen::VectorXd weight;  ///< of the design's rows, which then have unit noise
  Noise noise;
};

/// Each kind of value by its own noise, what stands far out by less. The noise is what the flexible model leaves.
Weighted weigh(const Design& design, const Measurements& data, int threads);
/// Noise of a position or distance value, as a choice leaves it [m]: where there are rotations, too, `State::sigma2` is
/// of both. Each kind's squares over its values less the effective parameters that they determine.
double noise_of_positions(const Work& work, const Evidence::State& state);
Grams make_grams(const Design& design, double design_effect, int threads);
/// After columns were appended: their part of every Gram, nothing else.
void extend_grams(const Design& design, double design_effect, Grams* grams);

// --- unseen.cpp: errors of poses that a fit did not see
// ---------------------------------------------------------------

/// Sum of squares on every training fold, of the fit to the others.
Eigen::VectorXd squares_of_folds(const Work& work, const Choice& choice);
/// Sum of squares on every training fold where the choice, too, was made without it and others: nested cross-validation
/// (Varma and Simon 2006). A quarter of the folds at a time; `choose`: from the sums of the other folds.
Eigen::VectorXd squares_of_parts(const Work& work, const std::function<Choice(const Gram&)>& choose);
double cross_validated(const Work& work, const Choice& choice);
/// Fits of some choices, of each so much: `parts` add up to one.
struct Average {
  std::vector<Choice> of;
  std::vector<double> parts;
};

/// Part of an average of fits in one with a further choice's fit that misses training folds least, each predicted from
/// the others: stacked regressions (Breiman 1996), parts not negative and adding up to one. What the folds do not know
/// of it draws it towards equal parts of all fits (Diebold and Pauly 1990, The use of prior information in forecast
/// combination). Where both predict the same, there is nothing to average: 1.
double stacked_part(const Work& work, const Average& one, const Choice& other);
/// Does one choice predict the folds better than another, by this factor and for sure?
bool predicts_better(const Eigen::VectorXd& one, const Eigen::VectorXd& other, double factor);
/// Of every training fold by a fit to the others, and of the poses held out by the fit to all training folds.
UnseenErrors unseen_errors(const Work& work, const Choice& choice);
/// Fraction by which the root mean square shrinks, and its 90 % interval over draws of the folds.
Share shrinkage(const UnseenErrors& before, const UnseenErrors& after, int draws, std::uint64_t seed);
/// Standard errors, over the rows, by which the length of a row's error falls in the mean.
double sure_fall(const UnseenErrors& before, const UnseenErrors& after);

constexpr double kContradicted = 0.05;  ///< probability that errors of other poses fall, below which they rise for sure
constexpr double kConfirmed = 0.95;     ///< the same, from which on they fall for sure

/// How errors of held-out poses fall, pose by pose: lengths of all rows' errors without and with what was found.
HeldOutFall fall_of(const std::vector<double>& before, const std::vector<double>& after,
                    const std::vector<std::int8_t>& set, const std::vector<std::int32_t>& cluster);

// --- decide.cpp: what explains the gap -------------------------------------------------------------------------------

constexpr double kLackOfFit = 4.0;  ///< standard errors beyond repeats, from which on what is left is no noise

inline bool is_named(const Explanation& e) {
  return e.kind == Explanation::Kind::catalogue || e.kind == Explanation::Kind::all_geometry ||
         e.kind == Explanation::Kind::drift;
}

/// Traits of the effect that an explanation names.
const EffectTraits& effect_traits(const Work& work, const Explanation& e);
/// An effect whose law at the joint may be another one.
bool has_law_at(const Work& work, const Explanation& e, const std::string& joint);
/// Index of an input; -1: there is none of that name.
int input_named(const Work& work, const std::string& name);
/// Columns of some groups, one after the other.
std::vector<int> columns_of_groups(const Work& work, const std::vector<int>& groups);
/// A choice less one group, and less what corrects its law.
Choice without(const Choice& choice, const std::vector<ColumnGroup>& groups, std::size_t at);
/// A choice less some groups.
Choice without_these(const Choice& choice, const std::vector<int>& gone);
/// Some groups of a choice.
Choice only_these(const Choice& choice, const std::vector<int>& groups);

/// The groups that may enter first, on a Gram of their columns only: corrections of laws and fine drifts are many
/// columns.
struct Shortlist {
  std::vector<ColumnGroup> groups;
  std::vector<int> which;    ///< of all groups
  std::vector<int> columns;  ///< of the design; the nuisance comes first
  std::vector<int> nuisance;
  Eigen::VectorXd prior;
};

Shortlist shortlist(const Work& work, const std::vector<int>& also);

/// Evidence of the work's columns as they are now.
Evidence evidence_now(const Work& work);
/// Adds columns of one more candidate to the design, and to nothing else.
void append(Work* work, Explanation what, const Design::Rows& columns, double cost);
/// The same of a free function, that was found among so many.
void append_free(Work* work, const FreeGain& found, std::size_t trials);
/// A free function of these inputs at a joint, with many knots, as one more candidate: its group.
int add_fine_function(Work* work, const Robot& robot, std::size_t joint, const std::vector<int>& which);
/// Groups that do not help, for sure, on poses they were not fitted to go, however well they fit.
Evidence::State keep_what_predicts(const Work& work, Evidence::State state);

/// The group of all links together; -1: the robot has none.
int all_links(const Work& work);
/// Training values for each parameter of a group.
double values_for_each(const Work& work, int group);
/// Fewer than ten values for each parameter of the links: what is known of every robot beforehand counts.
bool has_few_poses(const Work& work, int links);
/// How large angles of links are against their lengths, as the data have it.
void size_angles_of_links(Work* work);
Decision decide(Work* work, const Robot& robot);
/// The group is all links together, and poses that it was not fitted to are predicted better with it, for sure.
bool links_predict(const Work& work, const Choice& choice, std::size_t at);

// --- gears.cpp: errors that repeat with the gear --------------------------------------------------------------------

/// Which orders stand for each other on the sampled angles, and which do not show.
void say_what_angles_cannot_show(const std::vector<Sampling>& samplings, const Robot& robot,
                                 std::vector<NotTestable>* out);

/// Of joints that err as an unknown function of so few angles that an order explains much of any function by chance.
void say_where_any_function_looks_like_a_gear(const Work& work, const Robot& robot, Diagnosis* out);

/// Orders of gears as they are found, one after another.
class Gears {
 public:
  Gears(Work* work, const Robot& robot);

  /// The best order on what a state leaves.
  OrderAt best(const Evidence& evidence, const Evidence::State& state);
  /// Takes `first` and then others, as long as they win. True: at least one was taken.
  bool take(OrderAt first, Decision* decision);

 private:
  void keep_what_is_in(const Evidence::State& state);
  bool wins(const OrderAt& order, const SearchOptions& search) const;
  int append_candidates(const OrderAt& order);
  void rename(std::size_t group, const std::string& suffix);
  void withdraw(std::size_t first, std::size_t last);
  void withdraw_with_others(std::size_t group);
  std::size_t others_behind(std::size_t group) const;
  bool take_one(OrderAt order, Decision* decision);
  void search_again(Decision* decision);
  void choose_orders_again(Decision* decision);
  void leave_out_joints(Decision* decision);
  bool leave_out_joint(std::size_t known, Decision* decision);

  Work* work_;
  const Robot& robot_;
  bool wanted_;  ///< the effect was not left out
  std::vector<OrderAt> known_, passed_over_;
  std::vector<int> groups_;  ///< of those known
};

// --- plausible.cpp: what no machine has ------------------------------------------------------------------------------

/// Chosen effects of the catalogue that are, for sure, larger than plausible.
std::vector<TooLarge> too_large_in(const Work& work, const Evidence::State& state);
/// Groups of chosen effects whose parts are, for sure, of sizes that no machine has side by side.
std::vector<int> out_of_proportion_in(const Work& work, const Evidence::State& state);
/// These are candidates no more. What was appended since there were `groups` of them goes as well.
void set_aside(const std::vector<int>& these, std::size_t groups, const Grams& grams, Work* work);
/// Warns of parameters below zero that no machine has so.
void say_what_is_negative(Diagnosis* out);
/// What looks like an effect that no machine has: said of the unknown at its joint, or as one of its own.
void describe_what_is_too_large(const Work& work, const Evidence& evidence, const Decision& decision, Diagnosis* out);

// --- bundles.cpp: names that together stand for one function ---------------------------------------------------------

/// Each bundle of them against one function in its place: taken, where it is better; else in question, where it is as
/// good.
void question_bundles(Work* work, const Robot& robot, Decision* decision);

// --- local_shapes.cpp: steps, corners and bumps ----------------------------------------------------------------------

/// What the best of them would win at a joint along an input [nats], less what having scanned all of them costs.
double best_local_shape(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
                        int input);
/// Does a joint that moves with its own angle turn in waves? Then those of the first three orders are likelier than any
/// function with knots, a step, a corner or a bump.
bool is_smooth(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint, int angle);

/// What a joint that moves with an angle, its own or another one's, would win: by waves of the first three orders or by
/// knots, whichever is likelier [nats].
double best_function(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t joint,
                     int angle);
/// The same of anything that has a value for every row, by knots.
double best_function_of(const InputColumn& along, const Work& work, const Evidence& evidence,
                        const Evidence::State& state, std::size_t joint);

// --- sureness.cpp: how sure that is ----------------------------------------------------------------------------------

bool same_name(const Explanation& a, const Explanation& b);
bool contains(const Explanation& large, const Explanation& small);
/// A joint, and the angle that a law moves it with.
struct MovedBy {
  std::size_t joint;
  int angle;  ///< of the inputs
};

/// Of laws of a joint's own angle, and of joints that others carry along.
std::vector<MovedBy> motions_of_law(const Work& work, const Explanation& name);
Sureness how_sure(const Work& work, const Evidence& evidence, const Evidence::State& state, std::size_t at);
/// Names that are what a larger law at their joint leaves of the motion, by group, and the group of that law.
std::map<int, int> departures_from_laws(const Work& work, const Evidence& evidence, const Decision& decision);
Resampled resample(const Work& work, const Decision& decision);
/// Is what was found without a name what the name's law leaves at its joint, were it not exact? Warmth lags behind its
/// sensor: a function of time; what changes with the direction grows with the load, or goes with the angle.
bool is_left_by(const Work& work, const Explanation& name, const UnknownEffect& unknown);
/// What speaks for a chosen group's name, and against it. Errors of poses that the fit did not see, without it and with
/// it; `unknown`: something was found that has no name, and is not left by this one.
std::vector<Ground> grounds_of(const Work& work, const Decision& decision, const Resampled& resampled, int group,
                               const Sureness& sure, const UnseenErrors& without, const UnseenErrors& with,
                               bool unknown);

// --- relinearise.cpp: of targets that the rows barely see ------------------------------------------------------------

/// Where columns are to be taken next: at the base, targets and links of a state's solution. None: it is near enough,
/// or the rows see the targets well.
std::optional<Linearisation> where_it_leads(const Work& work, const Evidence::State& state);

// --- refit.cpp: how far the error shrinks ----------------------------------------------------------------------------

Share percentile_interval(std::vector<double> values, double center);
/// What `identify` is asked for.
struct RefitTask {
  Robot start;
  IdentifyOptions options;
};

/// Of the chosen `groups`, whose parameters have the size of their group. `inputs` are those of the whole.
RefitTask refit_task(const Work& work, const std::vector<InputColumn>& inputs, const Robot& robot,
                     const Evidence::State& state, const std::vector<int>& groups);
/// The chosen `groups` fitted without linearisation on the training rows of `whole`, under the search's priors.
/// `inputs` are those of the whole.
Refit refit(const Registered& whole, const Work& work, const std::vector<InputColumn>& inputs, const Robot& robot,
            const Evidence::State& state, const std::vector<int>& groups);
/// The robot as refitted to these groups, its functions as tables, which a robot file can hold.
Robot with_tables(const Work& work, const std::vector<InputColumn>& inputs, const Evidence::State& state,
                  const std::vector<int>& groups, const Refit& refitted);
double lack_of_fit(const Measurements& data, const std::vector<double>& lengths, const std::vector<std::int8_t>& set,
                   const Repeats& repeats);

// --- average.cpp: of few poses, two fits in one ----------------------------------------------------------------------

/// Of few poses: do links, under the prior that these speak for, predict the folds better than nothing does?
bool links_predict_alone(const Work& work);
/// Of few poses: `found`, the fit of a choice, averaged with one of all links alone under the widest prior, as poses
/// that neither saw have it. The part that is left of the choice's fit; 1: nothing was averaged.
double average_with_links(const Registered& whole, const Work& work, const Robot& robot, const Choice& choice,
                          Identification* found);

// --- describe.cpp: what the user reads -------------------------------------------------------------------------------

FoundEffect describe(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at,
                     const Sureness& sure, const Resampled& resampled, bool unknown, const Identification& refitted);
/// Fraction of what a free function of one input makes at a joint, that a step, a corner or a bump makes.
double share_of_local_shape(const Work& work, const Decision& decision, int function, std::size_t joint);
UnknownEffect describe_unknown(const Work& work, const Evidence& evidence, const Decision& decision, std::size_t at);
/// A gap beyond the noise of repeats that nothing describes; `excess`: in standard errors.
UnknownEffect describe_lack_of_fit(const Diagnosis& d, double excess);
/// A gap that comes from what was handed over.
UnknownEffect describe_mistake(const Diagnosis& d, const SanityFinding& mistake);
std::vector<Candidate> list_candidates(const Work& work, const Evidence& evidence,
                                       const std::vector<Evidence::Gain>& first);
std::vector<Detectable> smallest_sizes(const Work& work, const Evidence& evidence, const Decision& decision);
void add_next_poses(const Work& work, const Measurements& data, const DiagnoseOptions& options,
                    const Decision& decision, Diagnosis* out);
/// Errors well above the noise of a fit of everything, and yet no gap that could be told from it.
bool too_few_poses(const Diagnosis& d);
std::string sentence_of(const Diagnosis& d);

// --- headline.cpp ----------------------------------------------------------------------------------------------------

std::string plain(const std::string& effect);
std::string largest_causes(const Diagnosis& d);
/// It is no larger than machines have it.
bool may_be_of_machines(const Detectable& detectable);
/// What poses that are too few for more can tell: single effects that would show where they are smaller than the gap.
std::string answerable_questions(const Diagnosis& d);

// --- shares.cpp: how much each cause counts --------------------------------------------------------------------------

std::vector<double> order_averaged_shares(const Work& work, const Evidence& evidence, const Evidence::State& state);
double size_at_tip(const Work& work, const Evidence::State& state, const std::vector<int>& columns);
Explained explained_by(const Diagnosis& d, bool too_few_poses);

}  // namespace truing::diagnosis
