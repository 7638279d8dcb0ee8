// What is allowed but odd is said: values that do nothing, unusual numbers, trains of which nothing was compared with
// reality. And what would have no end is refused before it begins, with its number and the limit.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using inputs::Scenario;

std::vector<std::string> said(const Scenario& s, const std::vector<inputs::Override>& given = {}) {
  std::vector<std::string> texts;
  for (const auto& w : inputs::warnings(s, given)) texts.push_back(inputs::to_string(w));
  return texts;
}
using Texts = std::vector<std::string>;

Scenario shipped(const char* name, const std::vector<inputs::Override>& changed = {}) {
  return inputs::read_scenario_file(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/" + name, changed);
}

TEST(Warnings, ShippedScenariosHaveNoneButRightOnes) {
  EXPECT_EQ(said(shipped("baseline.yaml")), Texts{});
  EXPECT_EQ(said(shipped("accident.yaml")), Texts{});
  EXPECT_EQ(said(shipped("mixed_train.yaml")), Texts{});
  EXPECT_EQ(said(shipped("decoupling.yaml")), Texts{});
  EXPECT_EQ(said(shipped("always_coupled.yaml")),
            Texts{"consist[0].width = 0.1 ft: less than usual: 6.562 to 14.76 ft"});
  // The presets of trains of which nothing is known say so, and nothing else.
  ASSERT_EQ(said(shipped("uic_freight.yaml")).size(), 1u) << said(shipped("uic_freight.yaml")).back();
  EXPECT_NE(said(shipped("uic_freight.yaml"))[0].find("a screw coupling"), std::string::npos);
  ASSERT_EQ(said(shipped("passenger.yaml")).size(), 1u) << said(shipped("passenger.yaml")).back();
  EXPECT_NE(said(shipped("passenger.yaml"))[0].find("a passenger car"), std::string::npos);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(TRAIN_DERAIL_SOURCE_DIR) / "config/accidents")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    for (const std::string& text : said(inputs::read_scenario_file(entry.path().string()))) {
      EXPECT_EQ(text.substr(0, 10), "consist = ") << entry.path() << ": " << text;  // lighter than what was fitted
    }
  }
  EXPECT_GT(files, 15);
}

TEST(Warnings, WhatTheChosenLawsDoNotUseHasNoEffect) {
  EXPECT_EQ(said(shipped("accident.yaml", {{"ground.on_track_friction", "0.3"}})),
            Texts{"ground.on_track_friction = 0.3: no effect: it acts with brakes.law: friction"});
  EXPECT_EQ(said(shipped("accident.yaml", {{"ground.off_track_friction", "0.3"}})),
            Texts{"ground.off_track_friction = 0.3: no effect: it acts with ground.off_track_law: coulomb"});
  EXPECT_EQ(said(shipped("baseline.yaml", {{"rails.stiffness", "3e6 lbf/ft"}})),
            Texts{"rails.stiffness = 3e+06 lbf/ft: no effect: it acts with ground.on_track_law: rails"});
  EXPECT_EQ(said(shipped("baseline.yaml", {{"contact.friction", "0.4"}, {"initial.perturbation.seed", "7"}})),
            (Texts{"contact.friction = 0.4: no effect: it acts with contact.law: elastic",
                   "initial.perturbation.seed = 7: no effect: it acts with a size of initial.perturbation above 0, or "
                   "a law that leaves something to chance"}));
  EXPECT_EQ(said(shipped("accident.yaml", {{"solver.rtol", "1e-7"}})).size(), 1u);
  EXPECT_EQ(
      said(shipped("baseline.yaml", {{"consist[0].brake_share", "0.5"}, {"consist[0].brake_source", "remote"}})).size(),
      2u);
}

TEST(Warnings, ATypeOfCouplerThatAKeyDefeatsNamesBoth) {
  const auto text = [](const std::string& key) {
    return key +
           " = rotary: has no effect on roll_limit: coupler.roll_limit = 10 deg holds for all couplers; with .inf "
           "there a rotary coupler is what it is";
  };
  EXPECT_EQ(said(shipped("accident3d.yaml")), Texts{});
  EXPECT_EQ(said(shipped("verify3d.yaml")), Texts{});
  EXPECT_EQ(said(shipped("accident3d.yaml", {{"coupler.type", "rotary"}})), Texts{text("coupler.type")});
  EXPECT_EQ(said(shipped("accident3d.yaml", {{"consist[1].coupler_type", "rotary"}})),
            Texts{text("consist[1].coupler_type")});
  EXPECT_EQ(said(shipped("accident3d.yaml", {{"coupler.type", "rotary"}, {"coupler.roll_limit", ".inf"}})), Texts{});
  EXPECT_EQ(said(shipped("accident3d.yaml", {{"coupler.type", "F"}, {"coupler.pitch_limit", "5 deg"}})), Texts{})
      << "another value than the type's, on purpose";
  EXPECT_EQ(said(shipped("accident3d.yaml", {{"coupler.type", "F"}, {"coupler.slip_height", "0.3 m"}})).size(), 1U);
}

TEST(Warnings, AChangeToTheDefaultThatDoesNothingIsSaid) {
  const std::vector<inputs::Override> given{{"ground.on_track_friction", "0.15"}};
  EXPECT_EQ(said(shipped("accident.yaml", given)), Texts{}) << "written out, it is no noise";
  EXPECT_EQ(said(shipped("accident.yaml", given), given),
            Texts{"ground.on_track_friction = 0.15: no effect: it acts with brakes.law: friction"});
  const std::vector<inputs::Override> acts{{"brakes.force", "0.06"}};
  EXPECT_EQ(said(shipped("accident.yaml", acts), acts), Texts{});
}

TEST(Warnings, InSpaceFlangesGuideWhereRailsYield) {
  const std::vector<inputs::Override> given{{"rails.flange_height", "1.5 in"}};
  EXPECT_EQ(said(shipped("dads20.yaml", given), given), Texts{});
  const std::vector<inputs::Override> firm{{"rails.derail_ratio", ".inf"}, given[0]};
  const Texts idle = said(shipped("dads20.yaml", firm), firm);
  EXPECT_EQ(std::count(idle.begin(), idle.end(),
                       "rails.flange_height = 1.5 in: no effect: it acts with model: spatial, ground.on_track_law: "
                       "rails and a finite rails.derail_ratio"),
            1);
}

TEST(Warnings, TheWholeScenarioReadsBackWithoutNoise) {
  for (const char* name : {"baseline.yaml", "accident.yaml"}) {
    const Scenario s = shipped(name);
    EXPECT_EQ(said(inputs::read_scenario(inputs::load_text(inputs::to_yaml(s), "again"), "again")), said(s)) << name;
  }
}

/// Whether the motion of the first second depends on a key.
std::string motion(const Scenario& s) {
  simulation::Simulation simulation(s);
  simulation.advance(2.0);
  std::string text;
  for (Eigen::Index i = 0; i < simulation.state().size(); ++i) text += fmt::format("{:a} ", simulation.state()[i]);
  return text;
}

/// Other values of a key as with_values() takes them: half and half as much again of a number, all choices of a choice,
/// some text.
Texts other_values(const Scenario& s, const inputs::KeyValue& v) {
  if (!v.unit.empty() && v.value == ".inf") return {"1e6"};
  if (!v.unit.empty()) {
    const double now = std::strtod(v.value.c_str(), nullptr);
    return {fmt::format("{}", 0.5 * now), fmt::format("{}", 1.5 * now)};
  }
  const std::string any_text = "no such choice";
  try {
    inputs::with_values(s, {{v.key, any_text}});
  } catch (const inputs::InputError& e) {
    const std::string text = e.what(), before = "allowed: ";
    const auto at = text.rfind(before);
    Texts choices;
    std::istringstream list(at == std::string::npos ? "" : text.substr(at + before.size()));
    for (std::string choice; std::getline(list >> std::ws, choice, ',');) choices.push_back(choice);
    return choices;
  }
  return {any_text};
}

// The conditions of schema.hpp are true: what is said to have no effect has none.
TEST(Warnings, WhatIsSaidToDoNothingDoesNothing) {
  const std::vector<inputs::Override> short_train{
      {"consist[0].count", "1"}, {"consist[1].count", "5"}, {"initial.cars_ahead", "2"}};
  Scenario rails = shipped("accident.yaml", short_train);
  Scenario space = shipped("accident3d.yaml", short_train);
  Scenario firm_rails = inputs::with_values(space, {{"rails.derail_ratio", ".inf"}});
  Scenario paper = shipped("baseline.yaml", {{"consist[0].count", "4"}, {"solver.fixed_step", "1 ms"}});
  Scenario paper_contact = shipped("decoupling.yaml", {{"consist[0].count", "4"}});
  int idle = 0, choices = 0;
  for (const Scenario& s : {rails, space, firm_rails, paper, paper_contact}) {
    const std::string before = motion(s);
    for (const auto& v : inputs::key_values(s)) {
      if (v.acts_with.empty() || v.key == "initial.cars_ahead" || v.key == "track.grade") continue;
      if (v.key == "initial.perturbation.seed" || v.key.find("cars_ahead") != std::string::npos) continue;
      const Texts others = other_values(s, v);
      EXPECT_FALSE(others.empty()) << v.key;
      for (const std::string& changed : others) {
        try {
          EXPECT_EQ(motion(inputs::with_values(s, {{v.key, changed}})), before) << v.key << " " << changed;
        } catch (const inputs::InputError& e) {  // what would switch a part on that has no law is refused, not idle
          EXPECT_NE(std::string(e.what()).find("works only with"), std::string::npos) << e.what();
        }
      }
      ++idle;
      choices += v.unit.empty() ? 1 : 0;
    }
  }
  EXPECT_GT(idle, 50);
  EXPECT_GT(choices, 3);
}

// North is for pictures, whatever the law of the track.
TEST(Warnings, HeadingIsNeverIdle) {
  EXPECT_EQ(said(shipped("baseline.yaml", {{"track.heading", "270 deg"}})), Texts{});
  EXPECT_EQ(said(shipped("accident.yaml", {{"track.heading", "0 deg"}})), said(shipped("accident.yaml", {})));
}

TEST(Warnings, UnusualNumbersAreSaidWithWhatIsUsual) {
  EXPECT_EQ(said(shipped("baseline.yaml", {{"initial.speed", "150 mph"}})),
            Texts{"initial.speed = 150 mph: more than usual: 1.118 to 100.7 mph"});
  EXPECT_EQ(said(shipped("baseline.yaml", {{"initial.speed", "30 m/h"}})),
            Texts{"initial.speed = 0.01864 mph: less than usual: 1.118 to 100.7 mph"});
  EXPECT_EQ(said(shipped("baseline.yaml", {{"coupler.break_draft", "20 kip"},
                                           {"solver.method", "semi_implicit"},
                                           {"solver.fixed_step", "1 ms"}})),
            Texts{"coupler.break_draft = 20 kip: less than usual: 67.44 to 1349 kip, or .inf"});
}

TEST(Warnings, TrainsOfWhichNothingIsKnown) {
  const auto passenger = said(shipped("accident.yaml", {{"consist[1].name", "passenger"}}));
  ASSERT_EQ(passenger.size(), 1u);
  EXPECT_EQ(passenger[0].substr(0, 88),
            "consist[1].name = passenger: a passenger car: nothing here was compared with derailments");
  const auto screw = said(shipped("accident.yaml", {{"coupler.break_draft", "850 kN"}}));
  ASSERT_EQ(screw.size(), 1u);
  EXPECT_NE(screw[0].find("a screw coupling"), std::string::npos);
  const auto light = said(shipped("accident.yaml", {{"consist[1].weight", "785 kN"}, {"consist[2].weight", "785 kN"}}));
  ASSERT_EQ(light.size(), 1u);
  EXPECT_EQ(light[0].substr(0, 36), "consist = 176.5 kip a car: lighter t");
}

// Counts.

std::string refusal(const std::function<void(Scenario&)>& change, Scenario s = test::accident(10)) {
  change(s);
  try {
    inputs::validate(s);
  } catch (const inputs::InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Counts, AreNamedBeforeAnythingStarts) {
  Scenario s = test::accident(10);
  s.stop.time_max = 100.0;
  const auto with = [&](const std::function<void(Scenario&)>& change) { return refusal(change, s); };
  EXPECT_EQ(with([](Scenario& c) { c.outcome.sample_interval = 1e-300; }),
            "scenario: outcome.sample_interval = '1e-300': out of range; allowed: [1e-06, 1] s");
  EXPECT_EQ(with([](Scenario& c) { c.outcome.sample_interval = 1e-6; }),
            "scenario: outcome.sample_interval = '1e-06': 1e+08 samples up to stop.time_max; allowed: at most "
            "10000000, so >= 1e-05 s");
  EXPECT_EQ(with([](Scenario& c) { c.output.interval = 1e-5; }),
            "scenario: output.interval = '1e-05': 1e+07 output times up to stop.time_max; allowed: at most 1000000, so "
            ">= 0.0001 s");
  EXPECT_EQ(
      with([](Scenario& c) { c.solver.fixed_step = 1e-6; }),
      "scenario: solver.fixed_step = '1e-06': 1e+08 steps up to stop.time_max, more than solver.steps_max; allowed: "
      "at most 10000000, so >= 1e-05 s");
  EXPECT_EQ(with([](Scenario& c) { c.rails.torn_length = 1e-9; }).substr(0, 44),
            "scenario: rails.torn_length = '1e-09': 2.21e");
  EXPECT_EQ(with([](Scenario& c) { c.rails.torn_length = 0.0; }), "no error");
  EXPECT_EQ(with([](Scenario& c) {
              c.track.curves = {{1e12, 1.0, 0.001}};
            }),
            "scenario: track.curves[0].start = '1000000000000': out of range; allowed: [-100000, 100000] m");
  EXPECT_EQ(with([](Scenario& c) { c.consist[0].length = 1e9; }),
            "scenario: consist[0].length = '1000000000': out of range; allowed: [1, 100] m");
  EXPECT_EQ(with([](Scenario& c) {
              for (int i = 0; i < 1001; ++i) c.track.curves.push_back({10.0 * i, 5.0, 0.001});
            }),
            "scenario: track.curves = '1001 items': too many; allowed: at most 1000");
  EXPECT_EQ(with([](Scenario& c) {
              c.ground.patches.assign(1001, {0.0, 1.0, 0.0, 1.0, 1.0});
            }),
            "scenario: ground.patches = '1001 items': too many; allowed: at most 1000");
}

TEST(Ranges, HoldWhatATrainCanHave) {
  const auto baseline = [](const std::function<void(Scenario&)>& change) { return refusal(change, test::baseline(3)); };
  EXPECT_EQ(baseline([](Scenario& s) { s.initial.yaw_rate = 1e6; }),
            "scenario: initial.yaw_rate = '1000000': out of range; allowed: [-100, 100] rad/s");
  EXPECT_EQ(baseline([](Scenario& s) { s.coupler.stiffness = 1e15; }),
            "scenario: coupler.stiffness = '1000000000000000': out of range; allowed: [0, 1e+12] N/m");
  EXPECT_EQ(baseline([](Scenario& s) { s.solver.rtol = 0.2; }),
            "scenario: solver.rtol = '0.2': out of range; allowed: [1e-15, 0.1]");
  EXPECT_EQ(baseline([](Scenario& s) { s.consist[0].yaw_inertia = 1e-9; }),
            "scenario: consist[0].yaw_inertia = '1e-09': out of range; allowed: [1, 1e+10] kg m2");
  EXPECT_EQ(baseline([](Scenario& s) { s.consist[0].yaw_inertia = 1000.0; }).substr(0, 66),
            "scenario: consist[0].yaw_inertia = '1000': is 4.51e-05 M L^2; allo");
  // Every number has a finite range.
  for (const auto& v : inputs::key_values(test::accident(3))) {
    if (v.unit.empty()) continue;
    for (const char* value : {"1e300", "-1e300"}) {
      EXPECT_THROW(inputs::with_values(test::accident(3), {{v.key, value}}), inputs::InputError)
          << v.key << " " << value;
    }
  }
}

}  // namespace
}  // namespace train_derail
