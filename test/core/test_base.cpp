// base: a scenario that names another one holds only what is its own.
#include <filesystem>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "folder.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail {
namespace {

class Base : public test::Folder {
 protected:
  std::string put(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(at(name)).parent_path());
    write(name, text);
    return at(name);
  }
  /// what() of the error that reading ends with, the folder left out.
  std::string refusal(const std::string& path, const std::vector<inputs::Override>& overrides = {}) const {
    try {
      inputs::read_scenario_file(path, overrides);
    } catch (const inputs::InputError& e) {
      std::string text = e.what();
      for (auto at = text.find(folder_.string()); at != std::string::npos; at = text.find(folder_.string())) {
        text.erase(at, folder_.string().size() + 1);
      }
      return text;
    }
    return "nothing";
  }

  const std::string whole_ = put("whole.yaml",
                                 "title: whole\n"
                                 "consist:\n"
                                 "  - {name: hopper, count: 5, length: 50 ft, weight: 286 kip}\n"
                                 "coupler: {slack: 0.1 ft, length: 4 ft}\n"
                                 "initial: {speed: 40 mph, yaw_rate: 0.1}\n");
};

TEST_F(Base, ItsValuesHoldWhereTheFileHasNone) {
  const std::string path = put("own.yaml", "base: whole.yaml\ncoupler: {slack: 0.2 ft}\ninitial: {speed: 30 mph}\n");
  const inputs::Scenario s = inputs::read_scenario_file(path);
  EXPECT_EQ(s.title, "whole");
  EXPECT_EQ(s.consist.at(0).count, 5);
  EXPECT_DOUBLE_EQ(s.coupler.slack, 0.2 * inputs::kFoot);
  EXPECT_DOUBLE_EQ(s.coupler.length, 4.0 * inputs::kFoot);
  EXPECT_DOUBLE_EQ(s.initial.speed, 30.0 * inputs::kMph);
  // Changes of the command line go over all of it; the file of the base is as before.
  EXPECT_EQ(inputs::read_scenario_file(path, {{"consist[0].count", "7"}}).consist.at(0).count, 7);
  EXPECT_DOUBLE_EQ(inputs::read_scenario_file(whole_).initial.speed, 40.0 * inputs::kMph);
}

TEST_F(Base, ListsAreTakenAsAWhole) {
  const std::string consist = "consist:\n  - {count: 2, length: 60 ft, weight: 200 kip}\n";
  const inputs::Scenario s = inputs::read_scenario_file(put("own.yaml", "base: whole.yaml\n" + consist));
  ASSERT_EQ(s.consist.size(), 1U);
  EXPECT_EQ(s.consist[0].name, "car");  // not the base's hopper
  EXPECT_EQ(s.consist[0].count, 2);
}

TEST_F(Base, MayHaveABaseItselfInAnotherFolder) {
  put("middle/middle.yaml", "base: ../whole.yaml\ntitle: middle\n");
  const std::string path = put("deep/er/own.yaml", "base: ../../middle/middle.yaml\ninitial: {yaw_rate: 0.2}\n");
  const inputs::Scenario s = inputs::read_scenario_file(path);
  EXPECT_EQ(s.title, "middle");
  EXPECT_EQ(s.initial.yaw_rate, 0.2);
  EXPECT_DOUBLE_EQ(s.initial.speed, 40.0 * inputs::kMph);
  // Written out whole, it is the same without its base.
  EXPECT_EQ(inputs::to_yaml(inputs::read_scenario_file(put("flat.yaml", inputs::to_yaml(s)))), inputs::to_yaml(s));
}

TEST_F(Base, ErrorsNameTheFileThatTheValueStandsIn) {
  put("bad.yaml", "base: whole.yaml\ncoupler:\n  slack: 1 kg\n");
  const std::string own = put("own.yaml", "base: bad.yaml\ncoupler:\n\n\n  length: 4 ft\n");
  EXPECT_EQ(refusal(own).rfind("bad.yaml:3: coupler.slack = '1 kg'", 0), 0U) << refusal(own);
  const std::string over = put("over.yaml", "base: bad.yaml\ncoupler:\n  slack: 2 kg\n");
  EXPECT_EQ(refusal(over).rfind("over.yaml:3: coupler.slack = '2 kg'", 0), 0U) << refusal(over);
  const std::string unknown = put("unknown.yaml", "base: whole.yaml\ncoupler: {slak: 1 ft}\n");
  EXPECT_EQ(refusal(unknown).rfind("unknown.yaml:2: coupler.slak", 0), 0U) << refusal(unknown);
  const std::string twice = put("twice.yaml", "base: whole.yaml\ncoupler: {slack: 1 ft, slack: 2 ft}\n");
  EXPECT_NE(refusal(twice).find("given twice"), std::string::npos) << refusal(twice);
}

TEST_F(Base, WhatCannotBeABaseIsRefusedWithTheChain) {
  const std::string a = put("a.yaml", "base: b.yaml\n");
  put("b.yaml", "base: c.yaml\n");
  put("c.yaml", "title: c\nbase: a.yaml\n");
  EXPECT_EQ(refusal(a),
            "c.yaml:2: base = 'a.yaml': the base files form a circle: a.yaml -> b.yaml -> c.yaml -> a.yaml; "
            "allowed: a file that does not lead back to this one");
  EXPECT_EQ(refusal(put("none.yaml", "base: missing.yaml\n")),
            "missing.yaml: cannot be read: No such file or directory (base of none.yaml)");
  EXPECT_NE(refusal(put("list.yaml", "base: [a.yaml]\n")).find("not the name of a file"), std::string::npos);
  EXPECT_NE(refusal(put("text.yaml", "base: whole.yaml\n"), {{"base", "whole.yaml"}}).find("base"), std::string::npos);
  std::string last = put("0.yaml", "base: whole.yaml\n");
  for (int i = 1; i < 12; ++i) last = put(fmt::format("{}.yaml", i), fmt::format("base: {}.yaml\n", i - 1));
  EXPECT_NE(refusal(last).find("too many bases"), std::string::npos) << refusal(last);
}

TEST_F(Base, NothingIsReadThatMayNotBe) {
  const std::string path = put("own.yaml", "base: whole.yaml\n");
  const auto never = [](const std::string&) { throw inputs::InputError("here", "base", "", "not allowed", ""); };
  EXPECT_THROW(inputs::layers(inputs::load_file(path), path, folder_.string(), never), inputs::InputError);
}

}  // namespace
}  // namespace train_derail
