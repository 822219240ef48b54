// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

#include "hand_eye/readings.hpp"
#include "math/constants.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "hand_eye/consensus.hpp"
#include "math/frame.hpp"
#include "math/statistics.hpp"
#include "math/text.hpp"
#include "rooms.hpp"

namespace truing::hand_eye {
namespace {

constexpr double kClearlyBetter = 0.3;               // of the closure as given
constexpr double kAsGood = 1.5;                      // times the best closure: the simpler reading is preferred
constexpr double kShortest = 0.01, kLongest = 20.0;  // [m] of positions that make sense
constexpr double kInside = 0.02;                     // [m] a camera no further from the flange's origin is inside it
constexpr double kOnHand = 2.0;     // times as far from the hand as the other is from the base: not on the hand
constexpr std::size_t kPoses = 30;  // that readings are judged by
constexpr std::size_t kKept = 16;   // readings of the rotations that are tried with positions

using Change = std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)>;

enum class Part { rotation, inversion, position, rows, setup };

/// A reading of one side's poses.
struct Atom {
  std::string name;
  std::string explanation;  ///< with {hand}, {camera} and {board} for what they are called
  Part part;
  bool hand;
  Change change;
};

// ---- Angles in twelve orders, and rotation vectors -----------------------------------------------------------------

Eigen::Matrix3d about(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

/// R = R_i(a_0) R_j(a_1) R_k(a_2)
Eigen::Matrix3d compose(const std::array<int, 3>& order, const Eigen::Vector3d& a) {
  return about(order[0], a(0)) * about(order[1], a(1)) * about(order[2], a(2));
}

/// The inverse of compose.
Eigen::Vector3d decompose(const std::array<int, 3>& order, const Eigen::Matrix3d& R) {
  const int i = order[0], j = order[1];
  const double sign = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;  // of the permutation that begins with i, j
  const int other = 3 - i - j;
  Eigen::Vector3d a;
  if (order[2] == i) {
    a(1) = std::atan2(std::hypot(R(i, j), R(i, other)), R(i, i));
    a(0) = std::atan2(R(j, i), -sign * R(other, i));
  } else {
    a(1) = std::atan2(sign * R(i, other), std::hypot(R(i, i), R(i, j)));
    a(0) = std::atan2(-sign * R(j, other), R(other, other));
  }
  const Eigen::Matrix3d rest = about(j, -a(1)) * about(i, -a(0)) * R;  // R_k(a_2)
  const int k = order[2], m = (k + 1) % 3;
  a(2) = std::atan2(rest((k + 2) % 3, m), rest(m, m));
  return a;
}

struct Order {
  std::string name;
  std::array<int, 3> axes;
};

const std::vector<Order>& orders() {
  static const std::vector<Order> list = [] {
    std::vector<Order> out;
    for (const char* name : {"xyz", "xzy", "yxz", "yzx", "zxy", "zyx", "zyz", "zxz", "xyx", "xzx", "yxy", "yzy"})
      out.push_back({name, {name[0] - 'x', name[1] - 'x', name[2] - 'x'}});
    return out;
  }();
  return list;
}

Eigen::Isometry3d with_rotation(const Eigen::Isometry3d& T, const Eigen::Matrix3d& R) {
  Eigen::Isometry3d out = T;
  out.linear() = R;
  return out;
}

/// Angles by the axis they are named after: x, y, z.
Eigen::Vector3d named(const std::array<int, 3>& order, const Eigen::Vector3d& a) {
  Eigen::Vector3d out;
  for (int k = 0; k < 3; ++k) out(order[static_cast<std::size_t>(k)]) = a(k);
  return out;
}

Eigen::Vector3d in_order(const std::array<int, 3>& order, const Eigen::Vector3d& by_name) {
  return {by_name(order[0]), by_name(order[1]), by_name(order[2])};
}

/// What was built as `as` is built as `is` from the same three numbers.
void add_orders(bool hand, std::vector<Atom>* out) {
  const std::string side = hand ? "hand" : "board", noun = "{" + side + "}";
  const auto tait_bryan = [](const Order& o) { return o.axes[0] != o.axes[2]; };
  const auto even = [](const std::array<int, 3>& axes) { return (axes[1] - axes[0] + 3) % 3 == 1; };
  const auto add = [&](const std::string& is, const std::string& as, const std::string& how,
                       std::function<Eigen::Matrix3d(const Eigen::Matrix3d&)> f) {
    out->push_back({side + "-" + is + "-as-" + as + how,
                    noun + " angles are " + is +
                        (how.empty() ? "" : ", the three numbers in the order of the rotations,") +
                        " and were read as " + as,
                    Part::rotation, hand, [f](const Eigen::Isometry3d& T) { return with_rotation(T, f(T.linear())); }});
  };
  for (const Order& as : orders())
    for (const Order& is : orders()) {
      if (as.name == is.name) continue;
      if (tait_bryan(as) && tait_bryan(is))
        add(is.name, as.name, "", [as, is](const Eigen::Matrix3d& R) {
          return compose(is.axes, in_order(is.axes, named(as.axes, decompose(as.axes, R))));
        });
      // Other names for the axes are another frame, which X and Y take up: even permutations, and all of those that
      // begin and end with one axis.
      if (tait_bryan(as) == tait_bryan(is) && (!tait_bryan(as) || even(as.axes) == even(is.axes))) continue;
      add(is.name, as.name, "-in-order",
          [as, is](const Eigen::Matrix3d& R) { return compose(is.axes, decompose(as.axes, R)); });
    }
  for (const Order& o : orders()) {
    if (!tait_bryan(o)) continue;
    add("rotation-vector", o.name, "",
        [o](const Eigen::Matrix3d& R) { return rotation_from_vector(named(o.axes, decompose(o.axes, R))); });
    add(o.name, "rotation-vector", "",
        [o](const Eigen::Matrix3d& R) { return compose(o.axes, in_order(o.axes, vector_from_rotation(R))); });
    out->push_back({side + "-radians-as-degrees-" + o.name,
                    noun + " angles (" + o.name + ") are in radians and were read as degrees", Part::rotation, hand,
                    [o](const Eigen::Isometry3d& T) {
                      return with_rotation(
                          T, compose(o.axes, Eigen::Vector3d(180.0 / kPi * decompose(o.axes, T.linear()))));
                    }});
  }
  out->push_back({side + "-radians-as-degrees", noun + " rotation vectors are in radians and were read as degrees",
                  Part::rotation, hand, [](const Eigen::Isometry3d& T) {
                    return with_rotation(T, rotation_from_vector(180.0 / kPi * vector_from_rotation(T.linear())));
                  }});
}

// ---- The list ------------------------------------------------------------------------------------------------------

void add_side(bool hand, std::vector<Atom>* out) {
  const std::string side = hand ? "hand" : "board";
  const auto add = [&](const std::string& name, const std::string& text, Part part, Change change) {
    out->push_back({side + "-" + name, "{" + side + "} " + text, part, hand, std::move(change)});
  };
  add("inverted", hand ? "poses are inverted (base in {hand})" : "poses are inverted ({camera} in {board})",
      Part::inversion, [](const Eigen::Isometry3d& T) { return T.inverse(Eigen::Isometry); });
  add("millimetres", "positions are in mm and were read as m", Part::position, [](Eigen::Isometry3d T) {
    T.translation() *= 1e-3;
    return T;
  });
  add("metres", "positions are in m and were read as mm", Part::position, [](Eigen::Isometry3d T) {
    T.translation() *= 1e3;
    return T;
  });
  for (int k = 0; k < 3; ++k) {
    const std::string axis(1, "xyz"[k]);
    add(axis + "-negated", axis + " has the wrong sign", Part::position, [k](Eigen::Isometry3d T) {
      T.translation()(k) *= -1.0;
      return T;
    });
  }
  for (const auto& [a, b] : {std::pair<int, int>{0, 1}, {0, 2}, {1, 2}}) {
    const std::string axes{"xyz"[a], "xyz"[b]};
    add(axes + "-swapped", std::string(1, "xyz"[a]) + " and " + "xyz"[b] + " are swapped", Part::position,
        [a = a, b = b](Eigen::Isometry3d T) {
          std::swap(T.translation()(a), T.translation()(b));
          return T;
        });
  }
  add("transposed", "rotations are transposed (positions are not)", Part::rotation,
      [](const Eigen::Isometry3d& T) { return with_rotation(T, T.linear().transpose()); });
  // A mirror in x, y or z differs by half a turn of both frames, which X and Y take up.
  add("left-handed", "poses are in a left-handed frame", Part::rotation, [](Eigen::Isometry3d T) {
    const Eigen::DiagonalMatrix<double, 3> mirror(1.0, -1.0, 1.0);
    T.linear() = mirror * T.linear() * mirror;
    T.translation()(1) *= -1.0;
    return T;
  });
  add("xyzw", "quaternions are x y z w and were read as w x y z", Part::rotation, [](const Eigen::Isometry3d& T) {
    const Eigen::Quaterniond q(T.linear());
    return with_rotation(
        T, Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix());  // columns read as w x y z hold x y z w
  });
  add("wxyz", "quaternions are w x y z and were read as x y z w", Part::rotation, [](const Eigen::Isometry3d& T) {
    const Eigen::Quaterniond q(T.linear());
    return with_rotation(T, Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix());
  });
  add_orders(hand, out);
}

const std::vector<Atom>& atoms() {
  static const std::vector<Atom> list = [] {
    std::vector<Atom> out;
    add_side(true, &out);
    add_side(false, &out);
    // The same equation as with the hand's poses inverted, but what moves with the hand is the other of the two.
    out.push_back({kOtherSetup,
                   "the set-up is the other one, {camera} and {board} in each other's place (eye-in-hand, eye-to-hand)",
                   Part::setup, true, [](const Eigen::Isometry3d& T) { return T.inverse(Eigen::Isometry); }});
    out.push_back(
        {"board-one-later", "every {board} belongs to the {hand} pose of the next row", Part::rows, false, nullptr});
    out.push_back({"board-one-earlier", "every {board} belongs to the {hand} pose of the row before", Part::rows, false,
                   nullptr});
    return out;
  }();
  return list;
}

const Atom& find_atom(const std::string& name) {
  std::vector<std::string> names;
  for (const Atom& atom : atoms()) {
    if (atom.name == name) return atom;
    if (atom.part != Part::rotation || atom.name.find("-as-") == std::string::npos) names.push_back(atom.name);
  }
  throw std::invalid_argument("unknown reading '" + name + "'; there are " + listed(names) +
                              ", and those of angles like hand-xyz-as-zyx; several are joined by '+'");
}

std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> out;
  for (std::size_t from = 0; from <= name.size();) {
    const std::size_t to = std::min(name.find('+', from), name.size());
    out.push_back(name.substr(from, to - from));
    from = to + 1;
  }
  return out;
}

/// How well the loop closes, and with what.
struct Closed {
  double position = 0.0, rotation = 0.0;  ///< [m], [rad] medians
  double distance = 0.0;                  ///< both as one number
  double camera = 0.0, board = 0.0;       ///< [m] how far they are from the frames that carry them
};

/// Medians after twice keeping the better two thirds.
Closed close_up(const Frames& hand, const Frames& board, HandEyeSetup setup) {
  const Frames M = moving_frames(hand, setup);
  Rows rows(M.size());
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = i;
  const double length = make_screws(M, board, rows).length;
  std::vector<double> position(M.size()), rotation(M.size());
  std::vector<std::pair<double, std::size_t>> order(M.size());
  Closed out;
  for (int round = 0; round < 3; ++round) {
    const Eigen::Isometry3d X = solve_camera(M, board, rows).X, Y = mean_board(M, board, rows, X);
    for (std::size_t i = 0; i < M.size(); ++i) {
      const Vector6d e = closure(predicted_board(X, M[i], Y), board[i]);
      position[i] = e.head<3>().norm(), rotation[i] = e.tail<3>().norm();
      order[i] = {std::hypot(position[i] / length, rotation[i]), i};
    }
    out.camera = X.translation().norm(), out.board = Y.translation().norm();
    std::sort(order.begin(), order.end());
    rows.clear();
    for (std::size_t k = 0; k < std::max<std::size_t>(3, (2 * M.size()) / 3); ++k) rows.push_back(order[k].second);
  }
  const auto [distance, middle] = order[order.size() / 2];
  out.distance = distance, out.position = position[middle], out.rotation = rotation[middle];
  return out;
}

/// Median difference of the angles by which hand and board turn between poses: zero in the right reading of the
/// rotations, whatever the frames.
double incongruence(const Frames& hand, const Frames& board) {
  std::vector<double> difference;
  const std::size_t n = hand.size();
  for (std::size_t step : {std::size_t{1}, n / 3 + 1, n / 2})
    for (std::size_t i = 0; step > 0 && i + step < n; ++i) {
      const auto angle = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
        return vector_from_rotation(a.linear() * b.linear().transpose()).norm();
      };
      difference.push_back(std::abs(angle(hand[i], hand[i + step]) - angle(board[i], board[i + step])));
    }
  std::nth_element(difference.begin(), difference.begin() + static_cast<std::ptrdiff_t>(difference.size() / 2),
                   difference.end());
  return difference[difference.size() / 2];
}

/// Positions of an arm or of a board before its camera: not millimetres, not kilometres, as metres.
bool plausible(const Frames& frames) {
  std::vector<double> lengths;
  for (const Eigen::Isometry3d& T : frames) lengths.push_back(T.translation().norm());
  const double typical = median_of(lengths);
  return typical > kShortest && typical < kLongest;
}

/// Most boards are before the camera, z looking out of it: of two inversions that close equally well, the one that has
/// them there.
bool in_front(const Frames& board) {
  return 2 * std::count_if(board.begin(), board.end(),
                           [](const Eigen::Isometry3d& T) { return T.translation().z() > 0.0; }) >
         static_cast<std::ptrdiff_t>(board.size());
}

std::string joined(const std::string& a, const std::string& b) { return a.empty() ? b : b.empty() ? a : a + "+" + b; }

/// An atom's explanation with its nouns.
std::string in_words(std::string text, const HandEyeNouns& nouns) {
  for (const auto& [mark, noun] : {std::pair<std::string, const std::string&>{"{hand}", nouns.hand},
                                   {"{camera}", nouns.camera},
                                   {"{board}", nouns.board}}) {
    for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + noun.size()))
      text.replace(at, mark.size(), noun);
  }
  return text;
}

// ---- The search ----------------------------------------------------------------------------------------------------

/// A reading and how well the loop closes in it.
struct Found {
  double distance;
  std::size_t changes;  ///< one more for each thing about the outcome that is hardly so
  Reading reading;
};

double length_of(const Frames& hand, const Frames& board, HandEyeSetup setup) {
  Rows all(hand.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return make_screws(moving_frames(hand, setup), board, all).length;
}

/// Readings of the rotations: of one side, and the same mistake on both, as where one program wrote both. Mirrored on
/// both sides the loop closes as it does on none.
std::vector<std::string> rotations_or_rows(bool with_rows) {
  std::vector<std::string> names;
  for (const Atom& atom : atoms()) {
    if (atom.part == Part::rotation || (atom.part == Part::rows && with_rows)) names.push_back(atom.name);
    if (atom.part == Part::rotation && atom.hand && atom.name != "hand-left-handed")
      names.push_back(atom.name + "+board" + atom.name.substr(std::string("hand").size()));
  }
  return names;
}

/// As given, and the readings that bring the angles of hand and board together: how far a motion turns does not depend
/// on frames or inversions. Those that keep every angle (transposed, left-handed, another order of the quaternion) tie
/// with the given one.
std::vector<std::string> readings_of_rotations(const Frames& hand, const Frames& board, bool with_rows) {
  const double given = incongruence(hand, board);
  std::vector<std::pair<double, std::string>> turns;
  for (const std::string& name : rotations_or_rows(with_rows)) {
    Frames h = hand, b = board;
    apply_reading(name, &h, &b);
    turns.emplace_back(incongruence(h, b), name);
  }
  std::stable_sort(turns.begin(), turns.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> kept{""};
  for (const auto& [difference, name] : turns)
    if (kept.size() <= kKept && difference < std::max(0.6 * given, given + 1e-9)) kept.push_back(name);
  return kept;
}

/// Each with every reading of the positions. Both inverted close as well as none: camera and board change places.
/// Positions are put right before poses are inverted.
std::vector<std::string> worth_trying(const std::vector<std::string>& rotations) {
  std::vector<std::string> names;
  for (const std::string& turn : rotations) {
    names.push_back(turn);
    for (const Atom& atom : atoms())
      if (atom.part == Part::position) names.push_back(joined(turn, atom.name));
  }
  return names;
}

/// What carries the camera in a reading: with the other set-up not what carries it in the one that was told.
bool camera_on_hand(HandEyeSetup setup, bool other) { return (setup == HandEyeSetup::eye_in_hand) != other; }

/// What is hardly so: lengths that are not those of an arm in its cell, boards behind the lens, a camera inside the
/// flange, and on the hand what is further from it than the other is from the base.
std::size_t oddities(const Frames& hand, const Frames& board, const Closed& closed, bool on_hand) {
  const double moves = on_hand ? closed.camera : closed.board, stands = on_hand ? closed.board : closed.camera;
  return (plausible(hand) && plausible(board) && in_front(board) ? 0 : 1) + (on_hand && moves < kInside ? 1 : 0) +
         (moves > kOnHand * stands ? 1 : 0);
}

Found close_in(const std::string& name, Frames hand, Frames board, HandEyeSetup setup) {
  apply_reading(name, &hand, &board);
  const Closed closed = close_up(hand, board, setup);
  const bool other_setup = scope_of(name).setup;
  const bool on_hand = camera_on_hand(setup, other_setup);
  return {closed.distance,
          parts_of(name).size() + oddities(hand, board, closed, on_hand),
          {name, explain_reading(name), closed.position, closed.rotation, other_setup}};
}

/// Hand poses inverted, board poses inverted and the other set-up are one equation, that closes at one end of the loop
/// or at the other: none of them closes better.
void close_alike(std::vector<Found>::iterator first, std::vector<Found>::iterator last) {
  double least = std::numeric_limits<double>::infinity();
  for (auto f = first; f != last; ++f) least = std::min(least, f->distance);
  for (auto f = first; f != last; ++f) f->distance = least;
}

/// Of those that close about as well as the best the simplest first, the set-up before the poses; then the others.
void sort_readings(std::vector<Found>* found) {
  double best = std::numeric_limits<double>::infinity();
  for (const Found& f : *found) best = std::min(best, f.distance);
  std::stable_sort(found->begin(), found->end(), [&](const Found& a, const Found& b) {
    const bool a_good = a.distance <= kAsGood * best, b_good = b.distance <= kAsGood * best;
    if (a_good != b_good) return a_good;
    if (!a_good) return a.distance < b.distance;
    const ReadingScope in_a = scope_of(a.reading.name), in_b = scope_of(b.reading.name);
    if (a.changes == b.changes && a.reading.other_setup != b.reading.other_setup) return a.reading.other_setup;
    const bool a_hand = in_a.hand_first, b_hand = in_b.hand_first;  // a mirror may be on either side
    return a.changes != b.changes ? a.changes < b.changes : a_hand != b_hand ? a_hand : a.distance < b.distance;
  });
}

}  // namespace

void apply_reading(const std::string& name, Frames* hand, Frames* board) {
  if (name.empty()) return;
  for (const std::string& part : parts_of(name)) {
    const Atom& atom = find_atom(part);
    if (atom.part == Part::rows) {  // the row without a partner is closed with itself a second time
      if (part == "board-one-later")
        std::rotate(board->begin(), board->end() - 1, board->end()), board->front() = (*board)[1],
                                                                     hand->front() = (*hand)[1];
      else
        std::rotate(board->begin(), board->begin() + 1, board->end()), board->back() = (*board)[board->size() - 2],
                                                                       hand->back() = (*hand)[hand->size() - 2];
      continue;
    }
    for (Eigen::Isometry3d& T : *(atom.hand ? hand : board)) T = atom.change(T);
  }
}

ReadingScope scope_of(const std::string& name) {
  ReadingScope scope;
  if (name.empty()) return scope;
  for (const std::string& part : parts_of(name)) {
    const Atom& atom = find_atom(part);
    scope.board = scope.board || !atom.hand;
    scope.rows = scope.rows || atom.part == Part::rows;
    scope.setup = scope.setup || atom.part == Part::setup;
  }
  scope.hand_first = find_atom(parts_of(name)[0]).hand;
  return scope;
}

std::vector<Reading> find_readings(const Frames& T_base_hand, const Frames& T_camera_board, HandEyeSetup setup,
                                   const Rows& rows, double position, double rotation) {
  Frames hand, board;
  const std::size_t stride = std::max<std::size_t>(1, rows.size() / kPoses);
  for (std::size_t r = 0; r < rows.size(); r += stride)
    hand.push_back(T_base_hand[rows[r]]), board.push_back(T_camera_board[rows[r]]);
  const double as_given = std::hypot(position / length_of(hand, board, setup), rotation);
  std::vector<Found> found;
  for (const std::string& name : worth_trying(readings_of_rotations(hand, board, stride == 1))) {
    std::vector<Found> here;
    if (!name.empty()) here.push_back(close_in(name, hand, board, setup));
    for (const char* inversion : {kOtherSetup, "hand-inverted", "board-inverted"})
      here.push_back(close_in(joined(name, inversion), hand, board, setup));
    close_alike(here.end() - 3, here.end());
    for (const Found& f : here)
      if (std::isfinite(f.distance) && f.distance < kClearlyBetter * as_given && f.distance < 0.1) found.push_back(f);
  }
  sort_readings(&found);
  std::vector<Reading> out;
  for (std::size_t k = 0; k < std::min<std::size_t>(3, found.size()); ++k) out.push_back(found[k].reading);
  return out;
}

}  // namespace truing::hand_eye

namespace truing {
using namespace hand_eye;

std::string explain_reading(const std::string& name, const HandEyeNouns& nouns) {
  std::string text;
  for (const std::string& part : parts_of(name))
    text += (text.empty() ? "" : "; ") + in_words(find_atom(part).explanation, nouns);
  return text;
}

std::vector<Reading> handeye_readings() {
  std::vector<Reading> out;
  for (const Atom& atom : atoms())
    out.push_back({atom.name, in_words(atom.explanation, {}), 0.0, 0.0, atom.part == Part::setup});
  return out;
}

}  // namespace truing
