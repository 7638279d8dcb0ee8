// Validation: the runs of all rows, what is made of them, the command as a user meets it.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "train_derail/inputs/error.hpp"
#include "train_derail/validation/validation.hpp"
#include "validation_fixtures.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

using Validate = test::Validate;

TEST_F(Validate, StudiesThatCannotServeAreRefused) {
  const auto refused = [&](const std::string& was, const std::string& is) -> std::string {
    std::string text = kStudy;
    try {
      validation::members_a_row(study(text.replace(text.find(was), was.size(), is)));
    } catch (const inputs::InputError& e) {
      return e.key() + ": " + e.problem();
    }
    return "";
  };
  EXPECT_EQ(refused("rails.derail_ratio", "initial.speed"), "factors.key: the rows of the table decide it");
  EXPECT_EQ(refused("rails.derail_ratio, low: 0.8, high: 1.1", "\"consist[1].weight\", low: 200 kip, high: 286 kip"),
            "factors.key: the rows of the table decide it");
  EXPECT_EQ(refused("latin_hypercube", "saltelli"), "plan: every row needs a random sample of its own");
  EXPECT_EQ(refused("latin_hypercube", "sobol"), "plan: every row needs a random sample of its own");
}

TEST_F(Validate, ARowThatTheScenarioCannotTakeIsNamed) {
  study::Study s = study();
  s.base.ground.on_track_law = inputs::OnTrackLaw::along_track;
  s.base.initial.perturbation = {};
  const std::atomic<bool> stop{false};
  try {
    validation::run(
        s, table(), 1, [](const study::Progress&) {}, stop);
    FAIL();
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.where(), (folder_ / "table.csv").string() + ":2: scenario");
    EXPECT_EQ(e.key(), "initial.cars_ahead");
  }
}

TEST_F(Validate, DependsNeitherOnThreadsNorOnTheOtherRows) {
  const study::Study s = study();
  const validation::AccidentTable all = table();
  const std::atomic<bool> stop{false};
  std::int64_t calls = 0;
  const validation::Ensembles one = validation::run(
      s, all, 1, [&](const study::Progress& p) { EXPECT_EQ(p.done, ++calls); }, stop);
  EXPECT_EQ(calls, 9);
  ASSERT_EQ(one.members.size(), 9u);
  EXPECT_EQ(one.failed, 0);
  const validation::Ensembles four = validation::run(
      s, all, 4, [](const study::Progress&) {}, stop);
  EXPECT_EQ(validation::members_csv(s, one), validation::members_csv(s, four));
  EXPECT_EQ(validation::rows_csv(validation::evaluate(s, all, one)),
            validation::rows_csv(validation::evaluate(s, all, four)));

  validation::AccidentTable last = all;
  last.rows = {all.rows[2]};
  const validation::Ensembles alone = validation::run(
      s, last, 1, [](const study::Progress&) {}, stop);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(alone.members[i].seed, one.members[6 + i].seed);
    EXPECT_EQ(alone.members[i].outcome.energy.total(), one.members[6 + i].outcome.energy.total());
  }
  EXPECT_NE(one.members[0].seed, one.members[1].seed);
  EXPECT_NE(one.members[0].outcome.energy.total(), one.members[1].outcome.energy.total());
}

TEST_F(Validate, MembersHaveTheInputsOfTheirPoint) {
  const study::Study s = study();
  const validation::AccidentTable t = table();
  const std::atomic<bool> stop{false};
  const validation::Ensembles e = validation::run(
      s, t, 0, [](const study::Progress&) {}, stop);
  const study::Points points = validation::points_of(s, t.rows[1]);
  EXPECT_NE(points[1].values, validation::points_of(s, t.rows[0])[1].values) << "a sample of each row's own";
  const validation::Member& m = e.members[4];  // row 1, member 1
  EXPECT_EQ(m.row, 1u);
  EXPECT_EQ(m.member, 1);
  inputs::Scenario by_hand = study::scenario_of(s, points[1], {0, 0, 0, m.seed});
  EXPECT_EQ(by_hand.initial.perturbation.kick, inputs::kFoot);
  EXPECT_DOUBLE_EQ(by_hand.rails.derail_ratio, std::stod(points[1].values[0]));
  by_hand = validation::scenario_of(by_hand, t.rows[1]);
  simulation::Simulation simulation(by_hand);
  simulation.run();
  EXPECT_EQ(simulation.outcome().energy.total(), m.outcome.energy.total());
  const validation::Derailed derailed = validation::count_derailed(by_hand, simulation.snapshot());
  EXPECT_EQ(derailed.cars, m.derailed.cars);
  EXPECT_EQ(derailed.cars + derailed.locomotives, m.outcome.cars_derailed);
  EXPECT_GT(m.derailed.cars, 0);
}

TEST_F(Validate, SeedsOnlyKeepsTheInputs) {
  const study::Study s = validation::seeds_only(study());
  EXPECT_EQ(validation::members_a_row(s), 3);
  const std::vector<study::Point> points = study::points(s);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_TRUE(points[0].values.empty());
}

TEST_F(Validate, EvaluatesWhatTheMembersSay) {
  const study::Study s = study();
  const validation::AccidentTable t = table();
  validation::Ensembles e;
  const int counts[3][3]{{2, 4, 9}, {2, 2, 2}, {1, 9, 5}};
  for (std::size_t row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      validation::Member& m = e.members.emplace_back();
      m.row = row;
      m.member = k;
      m.derailed.cars = counts[row][k];
      m.outcome.ended = outcome::Ended::at_rest;
    }
  }
  e.members.back().outcome.ended = outcome::Ended::integration_failed;  // the 5 does not count
  e.failed = 1;
  const validation::Validation v = validation::evaluate(s, t, e);
  EXPECT_DOUBLE_EQ(v.predicted[0].mean, 5.0);
  EXPECT_DOUBLE_EQ(v.predicted[0].median, 4.0);
  EXPECT_DOUBLE_EQ(v.intervals[0].low, 2.0);  // three members: their range
  EXPECT_DOUBLE_EQ(v.intervals[0].high, 9.0);
  EXPECT_DOUBLE_EQ(v.intervals[2].high, 9.0);
  EXPECT_DOUBLE_EQ(v.predicted[2].mean, 5.0);
  EXPECT_EQ(v.predicted[2].count, 2u);
  ASSERT_EQ(v.groups.size(), 2u);  // all are faster than 10 mph, none has a long tail
  EXPECT_EQ(v.groups[1].name, "10 mph or more");
  const validation::Rated& simulation = v.groups[0].rated[0];
  EXPECT_DOUBLE_EQ(simulation.score.mean_absolute_error, 1.0 / 3.0);  // 4 for 3, 2 for 2, 5 for 5
  EXPECT_DOUBLE_EQ(simulation.score.bias, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(v.groups[0].rated[1].score.mean_absolute_error, 2.0 / 3.0);  // of the mean: 5 for 3
  ASSERT_TRUE(simulation.coverage);
  EXPECT_DOUBLE_EQ(simulation.coverage->share, 1.0);
  ASSERT_TRUE(simulation.crps);  // 3 of 2, 4, 9; 2 of 2, 2, 2; 5 of 1, 9
  EXPECT_DOUBLE_EQ(*simulation.crps, (8.0 / 3.0 - 14.0 / 6.0 + 0.0 + 4.0 - 4.0) / 3.0);
  const auto j = nlohmann::json::parse(validation::to_json(v));
  EXPECT_EQ(j.at("rows"), 3);
  EXPECT_EQ(j.at("failed"), 1);
  EXPECT_EQ(j.at("interval").at("high_rank"), 3);
  EXPECT_EQ(j.at("interval").at("held_by_ranks"), 0.5);
  EXPECT_EQ(j.at("groups").at(0).at("scores").at(0).at("mean_absolute_error"), 1.0 / 3.0);
  EXPECT_TRUE(j.at("groups").at(0).at("fits").at(1).at("coefficients").empty());  // three rows, four coefficients
  EXPECT_NE(validation::to_table(v).find("1 runs failed"), std::string::npos);
  EXPECT_NE(validation::to_table(v).find("from member 1 to member 3 of 3, sorted; holds 50 %"), std::string::npos);
}

TEST_F(Validate, TheCommandLeavesTablesAndScores) {
  const test::Result r =
      derail("validate table.csv --study study.yaml --members 2 --min-speed '20 mph' --out results --jobs 2");
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("2 accidents, 2 members each"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("straight line in speed, left out"), std::string::npos) << r.out;
  const auto lines = [&](const char* name) {
    const std::string text = test::text_of(folder_ / "results" / name);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("rows.csv"), 3);
  EXPECT_EQ(lines("members.csv"), 5);
  const std::string rows = test::text_of(folder_ / "results/rows.csv");
  EXPECT_NE(rows.find("\n2,ONE,31,6,"), std::string::npos) << rows;
  EXPECT_NE(rows.find("\n4,THREE,"), std::string::npos) << rows;
  EXPECT_EQ(nlohmann::json::parse(test::text_of(folder_ / "results/validation.json")).at("members"), 2);
  const auto about = nlohmann::json::parse(test::text_of(folder_ / "results/about.json"));
  EXPECT_EQ(about.at("runs"), 4);
  EXPECT_EQ(about.at("study").at("samples"), 2);
  EXPECT_DOUBLE_EQ(about.at("study").at("perturbation").at("kick"), inputs::kFoot);
}

TEST_F(Validate, TheCommandRefusesWhatIsWrong) {
  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const test::Result r = derail("validate " + arguments);
    EXPECT_EQ(r.code, 2) << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
  };
  refused("nowhere.csv --study study.yaml", "nowhere.csv: cannot be read");
  refused("table.csv --study nowhere.yaml", "nowhere.yaml");
  refused("table.csv", "--study is required");
  refused("table.csv --study study.yaml --min-speed 10kg", "--min-speed = '10kg'");
  refused("table.csv --study study.yaml --min-tail 500", "no row fulfils");
  refused("table.csv --study study.yaml --set rails.stiffness=-1", "rails.stiffness");
  EXPECT_FALSE(fs::exists(folder_ / "table.validated"));
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out results --quiet").code, 0);
  const auto in_use = [&](const std::string& arguments, const std::string& why) {
    const test::Result r = derail("validate table.csv --study study.yaml --out results " + arguments);
    EXPECT_EQ(r.code, 1) << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
  };
  in_use("", "results: holds 9 finished runs of this validation; --resume computes what is missing");
  in_use("--resume --members 4", "results: holds results of another study; samples: was 3, is now 4");
  in_use("--resume --spread 1.1", "holds results of another study");
  in_use("--resume --min-speed '20 mph'", "holds results of another study; accidents/rows/3");
}

TEST_F(Validate, TheBytesDoNotDependOnTheThreads) {
  const auto bytes = [&](const std::string& jobs) {
    const test::Result r = derail("validate table.csv --study study.yaml --quiet --out " + jobs + " --jobs " + jobs);
    EXPECT_EQ(r.code, 0) << r.out;
    std::string all;
    for (const char* name : {"rows.csv", "members.csv", "validation.json"}) all += test::text_of(folder_ / jobs / name);
    return all;
  };
  const std::string one = bytes("1");
  EXPECT_GT(one.size(), 1000U);
  for (const char* jobs : {"2", "5"}) EXPECT_EQ(bytes(jobs), one) << jobs;
}

TEST_F(Validate, GoesOnAfterAKillWithTheSameResults) {
  write("study.yaml", std::string(kStudy).replace(kStudy.find("samples: 3"), 10, "samples: 30"));
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out whole --jobs 1 --quiet").code, 0);
  const fs::path journal = folder_ / "killed/journal.csv";
  const auto on_disk = [&] {
    const std::string text = test::text_of(journal);
    return std::count(text.begin(), text.end(), '\n');
  };
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (chdir(folder_.c_str()) != 0) _exit(1);
    execl(TRAIN_DERAIL_CLI, "derail", "validate", "table.csv", "--study", "study.yaml", "--out", "killed", "--jobs",
          "1", "--quiet", nullptr);
    _exit(1);
  }
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (on_disk() < 20 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_GE(on_disk(), 20);
  ASSERT_LT(on_disk(), 91);
  EXPECT_FALSE(fs::exists(folder_ / "killed/rows.csv"));
  std::ofstream(journal, std::ios::app) << "60,2";  // torn
  const test::Result resumed = derail("validate table.csv --study study.yaml --out killed --resume --jobs 2");
  ASSERT_EQ(resumed.code, 0) << resumed.out;
  for (const char* name : {"rows.csv", "members.csv", "validation.json"}) {
    EXPECT_EQ(test::text_of(folder_ / "killed" / name), test::text_of(folder_ / "whole" / name)) << name;
  }
  EXPECT_EQ(derail("validate table.csv --study study.yaml --out killed --resume --quiet").code, 0)
      << "nothing is missing";
}

TEST_F(Validate, WhatWasChangedInTheJournalIsComputedAnew) {
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out whole --quiet").code, 0);
  fs::copy(folder_ / "whole", folder_ / "bad", fs::copy_options::recursive);
  std::string text = test::text_of(folder_ / "bad/journal.csv");
  const std::size_t line = text.find('\n', text.find('\n') + 1) + 1;  // the third
  text[text.find(',', line) - 1] ^= 1;
  std::ofstream(folder_ / "bad/journal.csv", std::ios::binary) << text;
  const test::Result r = derail("validate table.csv --study study.yaml --out bad --resume --quiet");
  EXPECT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("journal.csv:3: the checksum does not fit the line; computed again"), std::string::npos)
      << r.out;
  for (const char* name : {"rows.csv", "members.csv", "validation.json"})
    EXPECT_EQ(test::text_of(folder_ / "bad" / name), test::text_of(folder_ / "whole" / name)) << name;
  EXPECT_EQ(test::text_of(folder_ / "whole/members.csv")
                .find("line,member,seed,rails.derail_ratio,ground.in_line_friction,derailed_without_locomotives,"),
            0U);
}

TEST_F(Validate, MembersThatCannotDifferAreRefused) {
  study::Study s = validation::seeds_only(study());
  s.perturbation = {};
  const std::atomic<bool> stop{false};
  const auto error = [&] {
    try {
      validation::run(
          s, table(), 1, [](const study::Progress&) {}, stop);
    } catch (const inputs::InputError& e) {
      return e.key() + ": " + e.problem();
    }
    return std::string("no error");
  };
  EXPECT_EQ(error(),
            "replicates: members that differ by their seed alone cannot differ: there is no perturbation, neither of "
            "the study nor of its scenario");
  s.replicates = 1'000'000;
  EXPECT_EQ(error(), "samples: 3 rows with so many members each are too many runs");
}

TEST_F(Validate, Stopped) {
  const std::atomic<bool> stop{true};
  const validation::Ensembles e = validation::run(
      study(), table(), 2, [](const study::Progress&) { FAIL(); }, stop);
  EXPECT_TRUE(e.stopped);
}

}  // namespace
}  // namespace train_derail
