// From what the members of an accident are drawn: groups of causes, ways and their shares, studies that change others.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "train_derail/files/csv.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/validation/validation.hpp"
#include "validation_fixtures.hpp"

namespace train_derail {
namespace {

using validation::Accident;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;

class ByCause : public test::Validate {
 protected:
  void SetUp() override {
    Validate::SetUp();
    write("causes.yaml", kCauses);
    write("soft.yaml", "title: soft\nbase: study.yaml\nfactors:\n  - {key: rails.derail_ratio, low: 0.5, high: 0.6}\n");
    write("plan.yaml", kPlan);
  }
  validation::Plan plan(const std::string& text = kPlan) {
    return validation::read_plan(write("plan.yaml", text).string());
  }
  std::string plan_refusal(const std::string& text) {
    try {
      plan(text);
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "";
  }
  static Accident accident(const std::string& cause, std::size_t line = 2) {
    Accident a;
    a.line = line;
    a.cause = cause;
    return a;
  }

  static const std::string kCauses, kPlan;
};

const std::string ByCause::kCauses =
    "source: a test\ngroups:\n"
    "  - {name: rail, title: broken rails, codes: [T207, T220], families: [T2]}\n"
    "  - {name: wheel, title: wheels, codes: [E61C], families: [E]}\n"
    "  - {name: other, title: others, codes: [M405]}\n";
const std::string ByCause::kPlan =
    "title: two ways\ncauses: causes.yaml\ngroups:\n"
    "  rail: [{study: study.yaml}]\n"
    "  wheel: [{name: stiff, share: 0.25, study: study.yaml}, {name: soft, share: 0.75, study: soft.yaml}]\n"
    "  other: [{study: soft.yaml}]\n";

TEST_F(ByCause, EveryCodeHasAGroup) {
  const validation::CauseGroups groups = validation::read_cause_groups((folder_ / "causes.yaml").string());
  struct Case {
    const char *code, *group;
    bool listed;
  };
  for (const Case& c : {Case{"T207", "rail", true},
                        {"T299", "rail", false},
                        {"E61C", "wheel", true},
                        {"E00C", "wheel", false},
                        {"M405", "other", true},
                        {"H702", "other", false},
                        {"", "other", false}}) {
    EXPECT_EQ(groups.find(c.code).group->name, c.group) << c.code;
    EXPECT_EQ(groups.find(c.code).listed, c.listed) << c.code;
  }
  validation::AccidentTable table;
  for (const char* code : {"T207", "T299", "H702", "T299", ""}) table.rows.push_back(accident(code));
  const std::vector<std::string> remarks = validation::unlisted_causes(groups, table);
  ASSERT_EQ(remarks.size(), 3u);
  EXPECT_EQ(remarks[0], "1 rows do not tell their cause: they count as other");
  EXPECT_EQ(remarks[1], "cause H702 in 1 rows is not listed in " + groups.path + ": it counts as other");
  EXPECT_EQ(remarks[2], "cause T299 in 2 rows is not listed in " + groups.path + ": it counts as rail");
}

TEST_F(ByCause, ACodeStandsOnce) {
  for (const char* text :
       {"groups: [{name: a, codes: [T1]}, {name: b, codes: [T1]}]",
        "groups: [{name: a, codes: [T1]}, {name: a, codes: [T2]}]", "groups: [{name: a, families: [T, T]}]",
        "groups: []", "groups: [{title: a}]", "groups: [{name: a b}]", "[1]", "causes: [T1]",
        "groups: [{name: a, code: T1}]", "groups: [{name: a, codes: ['']}]"}) {
    EXPECT_THROW(validation::read_cause_groups(write("wrong.yaml", text).string()), inputs::InputError) << text;
  }
}

TEST_F(ByCause, TheShippedGroupsKnowTheirCodes) {
  const validation::CauseGroups groups = validation::read_cause_groups(kSource + "/config/types/fra_causes.yaml");
  struct Case {
    const char *code, *group;
  };
  for (const Case& c : {Case{"T207", "broken_rail"},
                        {"T109", "track_geometry"},
                        {"T001", "track_geometry"},
                        {"E53C", "wheel_axle_truck"},
                        {"E61C", "wheel_axle_truck"},
                        {"H503", "train_handling"},
                        {"E00C", "brakes_couplers"},
                        {"H018", "brakes_couplers"},
                        {"H702", "switch"},
                        {"T314", "switch"},
                        {"H302", "human"},
                        {"M201", "lading_body"},
                        {"M405", "other"},
                        {"T401", "other"}}) {
    EXPECT_EQ(groups.find(c.code).group->name, c.group) << c.code;
    EXPECT_TRUE(groups.find(c.code).listed) << c.code;
  }
}

TEST_F(ByCause, WaysHaveTheirSharesOfTheMembers) {
  const validation::Plan by = plan();
  EXPECT_EQ(validation::members_a_row(by), 3);
  EXPECT_EQ(by.ways_of(accident("T207")).size(), 1u);
  EXPECT_EQ(by.ways_of(accident("T207"))[0].name, "study");
  int soft = 0;
  constexpr int kRows = 1000;
  for (int line = 2; line < 2 + kRows; ++line) {
    int of_row = 0;
    for (int m = 0; m < 3; ++m) of_row += by.way_of(accident("E61C", line), m).name == "soft" ? 1 : 0;
    EXPECT_GE(of_row, 2) << "of three members 2.25, up to one";
    soft += of_row;
  }
  EXPECT_NEAR(soft, 3 * 0.75 * kRows, 3 * std::sqrt(kRows * 0.25 * 0.75));
}

TEST_F(ByCause, SharesGoWithAPowerOfTheSpeed) {
  std::string text = kPlan;
  text.replace(text.find("share: 0.25"), 11, "share: 0.25, speed_exponent: 2");
  const validation::Plan by = plan(text);
  struct Case {
    double speed_mph, stiff;
  };
  for (const Case& c : {Case{25.0, 0.25}, Case{50.0, 1.0 / 1.75}, Case{12.5, 0.0625 / 0.8125}}) {
    Accident a = accident("E61C");
    a.speed_mph = c.speed_mph;
    const std::vector<double> shares = by.shares_of(a);
    ASSERT_EQ(shares.size(), 2u);
    EXPECT_NEAR(shares[0], c.stiff, 1e-12) << c.speed_mph;
    EXPECT_NEAR(shares[0] + shares[1], 1.0, 1e-12) << c.speed_mph;
    int stiff = 0;
    constexpr int kRows = 1000;
    for (a.line = 2; a.line < 2 + kRows; ++a.line) {
      for (int m = 0; m < 3; ++m) stiff += by.way_of(a, m).name == "stiff" ? 1 : 0;
    }
    EXPECT_NEAR(stiff, 3 * c.stiff * kRows, 3 * std::sqrt(kRows * 0.25)) << c.speed_mph;
  }
}

TEST_F(ByCause, WrongPlansAreRefused) {
  const auto with = [](const std::string& was, const std::string& is) {
    std::string text = kPlan;
    return text.replace(text.find(was), was.size(), is);
  };
  const std::string file = (folder_ / "plan.yaml").string();
  EXPECT_EQ(plan_refusal(with("0.75", "0.7")), file + ":5: groups.wheel = '0.95': the sum of the shares; allowed: 1");
  EXPECT_NE(plan_refusal(with("0.75", "1.5")).find("groups.wheel.share = '1.5': out of range; allowed: 0 to 1"),
            std::string::npos);
  EXPECT_NE(plan_refusal(with("share: 0.75", "share: 0.75, speed_exponent: 11"))
                .find("groups.wheel.speed_exponent = '11': out of range; allowed: -10 to 10"),
            std::string::npos);
  EXPECT_NE(plan_refusal(with("  other: [{study: soft.yaml}]\n", "")).find("other"), std::string::npos);
  EXPECT_NE(plan_refusal(with("rail:", "rails:")).find("groups.rails: no group of"), std::string::npos);
  EXPECT_NE(plan_refusal(with("causes: causes.yaml\n", "")).find("causes: missing"), std::string::npos);
  EXPECT_NE(plan_refusal(with("study: study.yaml", "studies: study.yaml")), "");
  EXPECT_NE(plan_refusal(with("study: study.yaml", "share: 1")).find("groups.rail.study: missing"), std::string::npos);
  write("soft.yaml", "base: study.yaml\nsamples: 4\n");
  EXPECT_NE(plan_refusal(kPlan).find("members of a row differ from way to way"), std::string::npos);
}

TEST_F(ByCause, RowsInsideOfAClassHaveItsStudy) {
  write("class.yaml", "title: fast\nranges:\n  speed_mph: [40, 60]\ncauses: [E61C]\n");
  const validation::Plan by = plan(kPlan + "classes: [{class: class.yaml, study: study.yaml}]\n");
  Accident a = accident("E61C");
  a.speed_mph = 50.0;
  ASSERT_EQ(by.ways_of(a).size(), 1u);
  EXPECT_EQ(by.ways_of(a)[0].name, "study");
  EXPECT_EQ(by.group_of(a), "wheel");
  a.speed_mph = 30.0;
  EXPECT_EQ(by.ways_of(a).size(), 2u);
  a.speed_mph = 50.0;
  a.cause = "T207";
  EXPECT_EQ(by.ways_of(a).size(), 1u);
  EXPECT_EQ(by.all_ways().size(), 5u);
  EXPECT_NE(plan_refusal(kPlan + "classes: [{class: class.yaml}]\n").find("not a class and a study"),
            std::string::npos);
}

TEST_F(ByCause, TheShippedPlanIsReadAndGivesUnitTrainsOnBrokenRailsTheirStudyAsItIs) {
  const validation::Plan plan = validation::read_plan(kSource + "/config/studies/freight.yaml");
  EXPECT_EQ(validation::members_a_row(plan), 19);
  for (const validation::CauseGroups::Group& g : plan.causes().groups) EXPECT_FALSE(plan.ways_of_group(g.name).empty());
  const study::Study own = study::read_study_file(kSource + "/config/studies/accident_validation.yaml");
  for (const Accident& a : validation::read_accidents(kSource + "/config/accidents/example.csv").rows) {
    ASSERT_EQ(plan.ways_of(a).size(), 1u);
    EXPECT_EQ(study::to_json(plan.ways_of(a)[0].study), study::to_json(own));
    EXPECT_EQ(validation::outside(validation::read_fitted_class(plan.fitted_on), a), "");
  }
}

TEST_F(ByCause, WaysOfAnotherFileHaveOtherStudies) {
  const validation::Plan own = plan(kPlan + "positions_counting_locomotives: 0.25\n");
  write("hard.yaml", "title: hard\nbase: study.yaml\nfactors:\n  - {key: rails.derail_ratio, low: 1.5, high: 1.6}\n");
  const auto changed = [this](const std::string& studies) {
    return write("changed.yaml", "title: changed\nbase: plan.yaml\nstudies: {" + studies + "}\n").string();
  };
  std::string both;
  for (const validation::Way* w : own.all_ways()) {
    if (both.find(w->name + ":") == std::string::npos) both += (both.empty() ? "" : ", ") + w->name + ": hard.yaml";
  }
  const validation::Plan other = validation::read_plan(changed(both));
  EXPECT_EQ(other.title(), "changed");
  EXPECT_EQ(other.positions_counting_locomotives, 0.25);
  for (const std::string cause : {"T207", "E61C", "M405"}) {
    const Accident a = accident(cause);
    EXPECT_EQ(other.group_of(a), own.group_of(a));
    ASSERT_EQ(other.ways_of(a).size(), own.ways_of(a).size());
    EXPECT_EQ(other.shares_of(a), own.shares_of(a));
    for (std::size_t i = 0; i < own.ways_of(a).size(); ++i) {
      EXPECT_EQ(other.ways_of(a)[i].name, own.ways_of(a)[i].name);
      EXPECT_EQ(std::filesystem::path(other.ways_of(a)[i].study.source).filename(), "hard.yaml");
    }
  }
  const auto refusal = [&](const std::string& studies) -> std::string {
    try {
      validation::read_plan(changed(studies));
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(refusal(both + ", nobody: hard.yaml").find("studies = 'nobody': no way of"), std::string::npos);
  EXPECT_NE(refusal(both.substr(0, both.find(','))).find("missing in the file that has this one as its base"),
            std::string::npos);
  EXPECT_NE(refusal("").find("studies: empty; allowed: a file of a study for each way of"), std::string::npos)
      << refusal("");
  EXPECT_NE(refusal(both + ", list: [hard.yaml]").find("not a file of a study"), std::string::npos);
}

TEST_F(ByCause, ThePostureOfAllWaysHasTheSharesOfFreight) {
  const validation::Plan freight = validation::read_plan(kSource + "/config/studies/freight.yaml");
  const validation::Plan posture = validation::read_plan(kSource + "/config/studies/posture_ways.yaml");
  Accident a = accident("T110");
  a.speed_mph = 12.0;
  EXPECT_EQ(posture.shares_of(a), freight.shares_of(a));
  for (const validation::Way* w : posture.all_ways()) EXPECT_EQ(w->study.base.model, inputs::Model::spatial) << w->name;
}

TEST_F(ByCause, AShareOfThePositionsCountsTheLocomotives) {
  validation::Plan ways = plan("positions_counting_locomotives: 0.25\n" + kPlan);
  int moved = 0;
  const int rows = 100, members = 40;
  for (int line = 2; line < rows + 2; ++line) {
    Accident a = accident("T207", static_cast<std::size_t>(line));
    a.n_cars = 60;
    a.head_end_locos = 3;
    a.first_car_position = 51;
    a.cars_from_pod_to_rear = 10;
    for (int m = 0; m < members; ++m) {
      const Accident seen = ways.seen_by(a, m);
      ASSERT_EQ(seen.first_car_position + seen.cars_from_pod_to_rear, 61);
      ASSERT_TRUE(seen.first_car_position == 51 || seen.first_car_position == 48);
      moved += seen.first_car_position == 48 ? 1 : 0;
    }
    a.first_car_position = 2;
    for (int m = 0; m < members; ++m) ASSERT_GE(ways.seen_by(a, m).first_car_position, 1);
  }
  EXPECT_NEAR(moved / double{rows * members}, 0.25, 0.01);
  EXPECT_EQ(plan().seen_by(accident("T207"), 3).first_car_position, accident("T207").first_car_position);
  EXPECT_NE(plan_refusal("positions_counting_locomotives: 2\n" + kPlan).find("out of range"), std::string::npos);
}

TEST_F(ByCause, AStudyChangesItsBase) {
  const study::Study base = study::read_study_file((folder_ / "study.yaml").string());
  const study::Study soft = study::read_study_file((folder_ / "soft.yaml").string());
  EXPECT_EQ(soft.title, "soft");
  EXPECT_EQ(soft.samples, base.samples);
  EXPECT_EQ(soft.seed, base.seed);
  ASSERT_EQ(soft.factors.size(), 2u);
  EXPECT_EQ(soft.factors[0].key, "rails.derail_ratio");
  EXPECT_EQ(soft.factors[0].low, 0.5);
  EXPECT_EQ(soft.factors[1].low, base.factors[1].low);
  write("more.yaml",
        "base: soft.yaml\nsamples: 9\nscenario: {base: scenario.yaml, stop: {time_max: 9}}\n"
        "spread: 2\nfactors:\n  - {key: ground.broadside_friction, low: 0.5, high: 0.7}\n");
  const study::Study more = study::read_study_file((folder_ / "more.yaml").string());
  EXPECT_EQ(more.samples, 9);
  EXPECT_EQ(more.base.stop.time_max, 9.0);
  ASSERT_EQ(more.factors.size(), 3u);
  EXPECT_EQ(more.factors[0].low, 0.5) << "spread is for the study's own ranges";
  EXPECT_NEAR(more.factors[2].low, 0.4, 1e-12);
  write("round.yaml", "base: round.yaml\n");
  EXPECT_THROW(study::read_study_file((folder_ / "round.yaml").string()), inputs::InputError);
}

TEST_F(ByCause, MembersAreThoseOfTheirWay) {
  write("table.csv",
        kTable.substr(0, kTable.find('\n')) +
            ",cause\n"
            "ONE,31,6,140.5,2,0,0,2,5,3,T207\nTWO,31,6,140.5,2,0,0,2,5,3,E61C\nTHREE,31,6,140.5,2,0,0,2,5,3,X999\n");
  const test::Result r = derail("validate table.csv --study plan.yaml --out out --members 8");
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("cause X999 in 1 rows is not listed"), std::string::npos) << r.out;
  files::CsvReader in((folder_ / "out" / "members.csv").string());
  std::vector<std::string> names, fields;
  in.next(names);
  const auto place = [&](const char* name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::map<std::string, std::map<std::string, int>> ways;
  while (in.next(fields)) {
    const double ratio = std::stod(fields.at(place("rails.derail_ratio")));
    const std::string& way = fields.at(place("way"));
    EXPECT_EQ(way == "soft", ratio >= 0.5 && ratio <= 0.6) << ratio;
    ++ways[fields.at(0)][way];
  }
  EXPECT_EQ(ways["2"], (std::map<std::string, int>{{"study", 8}}));
  EXPECT_EQ(ways["3"], (std::map<std::string, int>{{"stiff", 2}, {"soft", 6}}));
  EXPECT_EQ(ways["4"], (std::map<std::string, int>{{"soft", 8}}));
  const std::string rows = test::text_of(folder_ / "out" / "rows.csv");
  EXPECT_NE(rows.find(",cause_group"), std::string::npos);
  EXPECT_NE(rows.find(",wheel,"), std::string::npos) << rows;
  const auto about = nlohmann::json::parse(test::text_of(folder_ / "out" / "about.json"));
  const auto& of_wheels = about.at("study").at("groups").at(1);
  EXPECT_EQ(of_wheels.at("name"), "wheel");
  ASSERT_EQ(of_wheels.at("ways").size(), 2u);
  EXPECT_EQ(of_wheels.at("ways").at(1).at("share"), 0.75);
  EXPECT_EQ(of_wheels.at("ways").at(1).at("study").at("title"), "soft");
  EXPECT_EQ(derail("validate table.csv --study plan.yaml --out out --members 8 --resume").code, 0);
}

}  // namespace
}  // namespace train_derail
