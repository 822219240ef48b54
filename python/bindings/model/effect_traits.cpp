// SPDX-FileCopyrightText: 2026 the truing authors
// SPDX-License-Identifier: BSD-3-Clause

// What effects say of themselves, for Python: simulation and documents read it, own effects carry it.

#include <array>

#include "convert/text.hpp"
#include "convert/values.hpp"
#include "parts.hpp"
#include "truing/model/effect.hpp"

namespace truing::python {
namespace {

template <typename Value>
using Spellings = std::vector<std::pair<const char*, Value>>;

const Spellings<Driver> kDrivers = {{"several", Driver::several},
                                    {"constant", Driver::constant},
                                    {"angle", Driver::angle},
                                    {"other_angles", Driver::other_angles},
                                    {"speed", Driver::speed},
                                    {"direction", Driver::direction},
                                    {"gravity_torque", Driver::gravity_torque},
                                    {"motor_torque", Driver::motor_torque},
                                    {"temperature", Driver::temperature},
                                    {"time", Driver::time}};
const Spellings<Moves> kMoves = {{"joint", Moves::joint},
                                 {"axis", Moves::axis},
                                 {"link", Moves::link},
                                 {"base", Moves::base},
                                 {"target", Moves::target}};
const Spellings<StandsFor> kStandsFor = {{"", StandsFor::terms},
                                         {"ratio", StandsFor::gear_ratio},
                                         {"offset", StandsFor::joint_offset},
                                         {"geometry", StandsFor::link_geometry},
                                         {"base", StandsFor::base_frame},
                                         {"target", StandsFor::tool_frame}};
const Spellings<Law> kLaws = {{"", Law::none},
                              {"of_torque", Law::of_torque},
                              {"of_direction", Law::of_direction},
                              {"of_angle", Law::of_angle},
                              {"of_lengths_in_warmth", Law::of_lengths_in_warmth},
                              {"of_warmth", Law::of_warmth}};
const Spellings<LawTest> kLawTests = {{"", LawTest::none},
                                      {"of_driver", LawTest::of_driver},
                                      {"times_direction", LawTest::times_direction},
                                      {"times_the_lengths", LawTest::times_the_lengths}};
const Spellings<Search> kSearches = {{"always", Search::always},
                                     {"if_asked", Search::if_asked},
                                     {"by_order", Search::by_order},
                                     {"with_unknown_weights", Search::with_unknown_weights},
                                     {"never", Search::never}};

template <typename Value>
Value value_of(const Spellings<Value>& words, const std::string& word, const char* keyword) {
  std::string known;
  for (const auto& [name, value] : words) {
    if (word == name) return value;
    known += (known.empty() ? "'" : ", '") + std::string(name) + "'";
  }
  throw std::invalid_argument(std::string(keyword) + ": found '" + word + "', expected one of " + known);
}

template <typename Value>
std::string word_of(const Spellings<Value>& words, Value value) {
  for (const auto& [name, other] : words) {
    if (other == value) return name;
  }
  return "";
}

template <typename Value>
void define_word(py::class_<EffectTraits>* cls, const char* name, Value EffectTraits::* member,
                 const Spellings<Value>& words, const char* what) {
  cls->def_property_readonly(name, [member, &words](const EffectTraits& t) { return word_of(words, t.*member); }, what);
}

/// What separates an own effect from any other ("") or from the one named: a sentence.
std::vector<SeparatedBy> separated_by(const std::map<std::string, std::string>& from) {
  std::vector<SeparatedBy> out;
  for (const auto& [other, words] : from) out.push_back({Experiment::own_words, other, words});
  return out;
}

EffectTraits traits_of_own(const std::string& driver, const std::string& moves, const std::string& law,
                           const std::string& law_test, bool of_instrument, bool needs_masses,
                           std::vector<std::string> mimicked_by, const std::map<std::string, std::string>& separation,
                           double prior, double usual, double plausible, std::string main_part) {
  EffectTraits traits;
  traits.driver = value_of(kDrivers, driver, "driver");
  traits.moves = value_of(kMoves, moves, "moves");
  traits.law = value_of(kLaws, law, "law");
  traits.law_test = value_of(kLawTests, law_test, "law_test");
  traits.of_instrument = of_instrument;
  traits.needs_masses = needs_masses;
  traits.mimicked_by = std::move(mimicked_by);
  traits.separated_by = separated_by(separation);
  traits.prior = prior;
  traits.usual = usual;
  traits.plausible = plausible;
  traits.main_part = std::move(main_part);
  if (!(prior > 0.0)) throw std::invalid_argument("prior: found " + text(prior) + ", expected a size above zero");
  if (traits.law_test != LawTest::none && traits.law == Law::none)
    throw std::invalid_argument("law_test needs a law: say what one input the effect's motion of the joint follows");
  return traits;
}

void bind_traits(py::module_& m) {
  const EffectTraits usual;
  py::class_<EffectTraits> cls(
      m, "EffectTraits", "What diagnosis, planning and simulation know of an effect; they read these and no name.");
  cls.def(py::init(&traits_of_own), py::kw_only(), py::arg("driver") = "several", py::arg("moves") = "joint",
          py::arg("law") = "", py::arg("law_test") = "", py::arg("of_instrument") = usual.of_instrument,
          py::arg("needs_masses") = usual.needs_masses, py::arg("mimicked_by") = usual.mimicked_by,
          py::arg("separated_by") = std::map<std::string, std::string>{}, py::arg("prior") = usual.prior,
          py::arg("usual") = usual.usual, py::arg("plausible") = usual.plausible,
          py::arg("main_part") = usual.main_part);
  define_word(&cls, "driver", &EffectTraits::driver, kDrivers, "The input that its basis is a function of.");
  define_word(&cls, "moves", &EffectTraits::moves, kMoves, "joint, axis, link, base or target.");
  define_word(&cls, "stands_for", &EffectTraits::stands_for, kStandsFor,
              "Parameters of the model that it stands for; empty: it has terms of its own.");
  define_word(&cls, "law", &EffectTraits::law, kLaws, "The law of one input that its motion of a joint follows.");
  define_word(&cls, "law_test", &EffectTraits::law_test, kLawTests,
              "The free function that the law is tested against.");
  define_word(&cls, "search", &EffectTraits::search, kSearches, "When it takes part in a diagnosis or a plan.");
  cls.def_readonly("of_instrument", &EffectTraits::of_instrument, "Not a motion of the robot.");
  cls.def_readonly("wanders", &EffectTraits::wanders, "Also tried as a free function of time.");
  cls.def_readonly("needs_masses", &EffectTraits::needs_masses, "Searched only where the links' masses are known.");
  cls.def_readonly("weights_found_by", &EffectTraits::weights_found_by,
                   "The effect that finds the weights where no mass is known.");
  cls.def_property_readonly(
      "mimicked_by", [](const EffectTraits& t) { return tuple_of(t.mimicked_by); },
      "Effects that may do the same, and show only with a column of their own.");
  cls.def_property_readonly(
      "separated_by",
      [](const EffectTraits& t) {
        std::map<std::string, std::string> out;
        for (const SeparatedBy& by : t.separated_by) {
          if (by.experiment == Experiment::own_words) out[by.from] = by.words;
        }
        return out;
      },
      "By other effect ('': any): what to measure to tell them apart. Of own effects.");
  cls.def_readonly("prior", &EffectTraits::prior, "Motion of its site that it may well make [rad | m].");
  cls.def_readonly("usual", &EffectTraits::usual, "Size that a simulation draws, in the parameter's unit; 0: unknown.");
  cls.def_readonly("plausible", &EffectTraits::plausible,
                   "No machine in working order has more, in the parameter's unit; 0: unknown.");
  cls.def_readonly("main_part", &EffectTraits::main_part, "The parameter that is meant by the effect's name alone.");
  cls.def_property_readonly(
      "documentation",
      [](const EffectTraits& t) {
        const EffectDocumentation& d = t.documentation;
        return std::array<std::string, 3>{d.law, d.parameters, d.needs};
      },
      "Law, parameters and needs, as docs/reference/effects.md has them.");
  cls.def("__repr__", [](const EffectTraits& t) {
    return "EffectTraits(driver='" + word_of(kDrivers, t.driver) + "', moves='" + word_of(kMoves, t.moves) + "')";
  });
}

void bind_catalogue(py::module_& m) {
  py::class_<Effect> effect(m, "CatalogueEffect", "An effect that truing knows by name.");
  effect.def_readonly("name", &Effect::name, "Its name.");
  effect.def_readonly("summary", &Effect::summary, "What it is.");
  effect.def_readonly("per_joint", &Effect::per_joint, "False: it belongs to the robot as a whole.");
  effect.def_readonly("traits", &Effect::traits, "What it says of itself.");
  effect.def("__repr__", [](const Effect& e) { return "CatalogueEffect('" + e.name + "')"; });
  m.def(
      "catalogue_effects", [] { return tuple_of(catalogue()); },
      "The effects that truing knows, with what they say of themselves.");
}

}  // namespace

void bind_effect_traits(py::module_& m) {
  bind_traits(m);
  bind_catalogue(m);
}

}  // namespace truing::python
