// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What moves with an input and follows no law that anybody knows: a table of values at knots, as a diagnosis found it.

#include "model/effects/tables.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>
#include <set>

#include "math/text.hpp"
#include "model/effects/families.hpp"
#include "model/effects/terms.hpp"

namespace truing::model {
namespace {

constexpr const char* kTable = "lookup_table";
constexpr const char* kForm = "lookup_table.J2:q3@-0.52, or with two inputs lookup_table.J2:q3@-0.52,dir3@1";

/// "torque12" is the gravity torque of joint 12, "payload" belongs to none.
struct InputName {
  std::string what;
  std::size_t joint = 0;  ///< index in Robot::joints
  bool of_joint = false;
};

std::optional<InputName> read_input(const std::string& text) {
  if (text == "payload" || text == "temp") return InputName{text};
  const std::size_t digits = text.find_first_of("0123456789");
  if (digits == std::string::npos || text[digits] == '0') return std::nullopt;
  InputName out{text.substr(0, digits), 0, true};
  if (out.what != "q" && out.what != "dir" && out.what != "speed" && out.what != "torque") return std::nullopt;
  const char* end = text.data() + text.size();
  const auto read = std::from_chars(text.data() + digits, end, out.joint);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  --out.joint;
  return out;
}

/// One value of a table: its parameter's name says at which site and inputs it is.
struct Knot {
  std::string site;
  std::vector<std::string> inputs;
  std::vector<double> at;
};

[[noreturn]] void refuse_name(const std::string& parameter, const std::string& why) {
  throw std::invalid_argument(std::string(kTable) + " has the parameter '" + parameter + "'" + why + ", expected " +
                              kForm);
}

Knot read_knot(const std::string& parameter) {
  const std::string before = std::string(kTable) + ".";
  const std::size_t colon = parameter.rfind(':');
  if (parameter.rfind(before, 0) != 0 || colon == std::string::npos || colon <= before.size())
    refuse_name(parameter, "");
  Knot out{parameter.substr(before.size(), colon - before.size()), {}, {}};
  for (std::size_t from = colon + 1; from < parameter.size();) {
    const std::size_t comma = std::min(parameter.find(',', from), parameter.size()), at = parameter.find('@', from);
    double value = 0.0;
    const char* end = parameter.data() + comma;
    if (at >= comma) refuse_name(parameter, "");
    const auto read = std::from_chars(parameter.data() + at + 1, end, value);
    if (read.ec != std::errc() || read.ptr != end || !std::isfinite(value)) refuse_name(parameter, "");
    out.inputs.push_back(parameter.substr(from, at - from));
    out.at.push_back(value);
    from = comma + 1;
  }
  if (out.inputs.empty() || out.inputs.size() > 2) refuse_name(parameter, "");
  return out;
}

std::string name_of(const LookupTable& table, std::size_t first, std::size_t second) {
  const auto knot = [&](std::size_t input, std::size_t at) {
    return table.inputs[input] + "@" + number(table.knots[input][at], 7);  // for people: lost is a millionth of a step
  };
  const std::string name = std::string(kTable) + "." + table.site + ":" + knot(0, first);
  return table.inputs.size() > 1 ? name + "," + knot(1, second) : name;
}

/// Height at x of the hat over knot k: one there, nought at its neighbours, flat beyond the first and the last.
double hat(const std::vector<double>& knots, std::size_t k, double x) {
  if (x <= knots[k]) return k == 0 ? 1.0 : std::max(0.0, (x - knots[k - 1]) / (knots[k] - knots[k - 1]));
  return k + 1 == knots.size() ? 1.0 : std::max(0.0, (knots[k + 1] - x) / (knots[k + 1] - knots[k]));
}

std::size_t seconds_of(const LookupTable& table) { return table.inputs.size() > 1 ? table.knots[1].size() : 1; }

double value_at(const LookupTable& table, double first, double second) {
  double out = 0.0;
  for (std::size_t a = 0; a < table.knots[0].size(); ++a) {
    for (std::size_t b = 0; b < seconds_of(table); ++b)
      out += table.values[a * seconds_of(table) + b] * hat(table.knots[0], a, first) *
             (table.inputs.size() > 1 ? hat(table.knots[1], b, second) : 1.0);
  }
  return out;
}

/// The tables that a robot carries.
std::vector<LookupTable> tables_of(const Robot& robot) {
  std::map<std::pair<std::string, std::vector<std::string>>, std::map<std::vector<double>, double>> found;
  for (const AppliedEffect& applied : robot.effects) {
    if (applied.effect != kTable) continue;
    for (const auto& [parameter, value] : applied.parameters) {
      const Knot knot = read_knot(parameter);
      found[{knot.site, knot.inputs}][knot.at] = value;
    }
  }
  std::vector<LookupTable> out;
  for (const auto& [where, values] : found) {
    LookupTable table{where.first, where.second, {}, {}};
    for (std::size_t input = 0; input < table.inputs.size(); ++input) {
      std::set<double> knots;
      for (const auto& value : values) knots.insert(value.first[input]);
      table.knots.emplace_back(knots.begin(), knots.end());
    }
    for (const double first : table.knots[0]) {
      if (table.inputs.size() == 1) table.values.push_back(values.at({first}));
      for (std::size_t b = 0; table.inputs.size() > 1 && b < table.knots[1].size(); ++b) {
        const auto value = values.find({first, table.knots[1][b]});
        table.values.push_back(value == values.end() ? 0.0 : value->second);
      }
    }
    out.push_back(std::move(table));
  }
  return out;
}

/// The column of an input that is recorded; absent: it is not in the data.
Column column_of(const InputName& input, std::size_t number, const Measurements& data) {
  if (input.what == "payload") return data.payload;
  if (input.what == "temp") return data.temperature;
  const std::vector<Column>& by_joint = input.what == "dir" ? data.direction : data.joint_speed;
  return number < by_joint.size() ? by_joint[number] : Column{};
}

/// The value of an input, row by row.
Basis reader_of(const std::string& input, const Robot& robot, const Measurements& data) {
  const std::optional<InputName> name = read_input(input);
  if (!name || (name->of_joint && name->joint >= robot.joints.size()))
    throw std::invalid_argument(std::string(kTable) + " over '" + input +
                                "': expected q1 ..., dir1 ..., speed1 ..., torque1 ..., payload or temp");
  const auto index = static_cast<Eigen::Index>(name->joint);
  if (name->what == "q") return [index](const Inputs& in) { return in.joints[index]; };
  if (name->what == "torque") {
    require_weight(kTable, robot, robot.joints[name->joint], data);
    return [index](const Inputs& in) { return in.gravity_torque[index]; };
  }
  const std::size_t number = driven_number(robot, name->joint);
  if (!column_of(*name, number, data))
    throw MissingColumn(std::string(kTable) + " over " + input + " needs its column");
  return [name = *name, number](const Inputs& in) { return column_of(name, number, *in.data)[in.row]; };
}

/// A parameter a knot: `value * hat(first) hat(second)`.
void add_terms(const LookupTable& table, const std::string& unit, const Robot& robot, const Measurements& data,
               std::vector<Term>* terms) {
  const bool two = table.inputs.size() > 1;
  bool needs_gravity = false;
  for (const std::string& input : table.inputs) needs_gravity |= input.rfind("torque", 0) == 0;
  const Basis first = reader_of(table.inputs[0], robot, data);
  const Basis second = two ? reader_of(table.inputs[1], robot, data) : Basis{};
  for (std::size_t a = 0; a < table.knots[0].size(); ++a) {
    for (std::size_t b = 0; b < seconds_of(table); ++b) {
      const Basis basis = [first, second, a, b, knots = table.knots](const Inputs& in) {
        const double height = hat(knots[0], a, first(in));
        return second && height != 0.0 ? height * hat(knots[1], b, second(in)) : height;
      };
      terms->push_back(make_term(name_of(table, a, b), unit, table.site, basis, needs_gravity));
    }
  }
}

/// Of a joint's name, of "base.x" or of "J2.alpha".
const char* unit_of(const std::string& site, const Robot& robot) {
  for (const Joint& joint : robot.joints) {
    if (joint.name == site) return motion_unit(joint);
  }
  const std::string coordinate = site.substr(site.rfind('.') + 1);
  const bool length = coordinate.size() == 1;  // x, y, z, a, d; the others are rx …, alpha, theta, beta
  return length ? "m" : "rad";
}

std::vector<Term> lookup_table(const Robot& robot, std::size_t, const Measurements& data) {
  std::vector<Term> terms;
  for (const LookupTable& table : tables_of(robot)) add_terms(table, unit_of(table.site, robot), robot, data, &terms);
  if (terms.empty())
    throw Unsuited(std::string(kTable) + " needs a robot that carries one: `truing diagnose` writes it");
  return terms;
}

/// Both tables in one: linear between the knots of either.
LookupTable sum_of(const LookupTable& one, const LookupTable& other) {
  LookupTable out{one.site, one.inputs, {}, {}};
  for (std::size_t input = 0; input < one.inputs.size(); ++input) {
    std::set<double> knots(one.knots[input].begin(), one.knots[input].end());
    knots.insert(other.knots[input].begin(), other.knots[input].end());
    out.knots.emplace_back(knots.begin(), knots.end());
  }
  for (const double first : out.knots[0]) {
    for (std::size_t b = 0; b < seconds_of(out); ++b) {
      const double second = out.inputs.size() > 1 ? out.knots[1][b] : 0.0;
      out.values.push_back(value_at(one, first, second) + value_at(other, first, second));
    }
  }
  return out;
}

Effect lookup_table_effect() {
  Effect effect{kTable, "a joint, or the base, moves as a table says: what a diagnosis found and has no law for",
                lookup_table};
  effect.per_joint = false;
  EffectTraits& traits = effect.traits;
  traits.search = Search::if_asked;
  traits.documentation = {
      "Σ value · hat(input): linear between knots, flat beyond the first and the last; of two inputs the "
      "product of their hats",
      "`lookup_table.J2:q3@-0.52` … [rad]: the value at the knot; inputs `q3`, `dir3`, `speed3`, "
      "`torque3` (of the third joint), `payload`, `temp`",
      "a robot file that carries it"};
  return effect;
}

}  // namespace

bool is_input_of_tables(const std::string& input) { return read_input(input).has_value(); }

void add_table(const LookupTable& given, Robot* robot) {
  LookupTable table = given;
  for (const LookupTable& there : tables_of(*robot)) {
    if (there.site == given.site && there.inputs == given.inputs) table = sum_of(there, given);
  }
  auto applied = std::find_if(robot->effects.begin(), robot->effects.end(),
                              [](const AppliedEffect& effect) { return effect.effect == kTable; });
  if (applied == robot->effects.end()) applied = robot->effects.insert(applied, {kTable, {}, {}});
  for (std::size_t a = 0; a < table.knots[0].size(); ++a) {
    for (std::size_t b = 0; b < seconds_of(table); ++b)
      applied->parameters[name_of(table, a, b)] = table.values[a * seconds_of(table) + b];
  }
}

std::vector<Effect> table_effects() { return {lookup_table_effect()}; }

}  // namespace truing::model
