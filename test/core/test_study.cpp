// What a study is: points, seeds, ranges, mistakes.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <set>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "study_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;

using test::text_of;

using StudyTest = test::StudyFolder;

TEST_F(StudyTest, OneAtATimeChangesOneFactorFromTheBase) {
  const study::Study s = read();
  const auto points = study::points(s);
  ASSERT_EQ(points.size(), 1u + 2u + 3u);  // the scale 1.0 is the base
  EXPECT_EQ(points[0].factor, -1);
  EXPECT_DOUBLE_EQ(std::stod(points[1].values[0]), 10.0 * inputs::kMph);
  EXPECT_EQ(points[1].values[1], points[0].values[1]);
  EXPECT_DOUBLE_EQ(std::stod(points[4].values[1]), 0.3);
  const study::Run run = study::run_of(s, 7);
  EXPECT_EQ(run.point, 1);
  EXPECT_EQ(run.replicate, 2);
  const inputs::Scenario scenario = study::scenario_of(s, points[1], run);
  EXPECT_DOUBLE_EQ(scenario.initial.speed, 10.0 * inputs::kMph);
  EXPECT_EQ(scenario.initial.perturbation.seed, run.seed);
  EXPECT_DOUBLE_EQ(scenario.initial.perturbation.spacing, 0.003);
}

TEST_F(StudyTest, TheScenarioMayStandInTheStudyItself) {
  std::string own;
  for (const std::string& line : test::lines_of(text_of(folder_ / "scenario.yaml"))) own += "  " + line + "\n";
  std::string text = text_of(folder_ / "study.yaml");
  const std::string named = "scenario: scenario.yaml\n";
  ASSERT_NE(text.find(named), std::string::npos);
  text.replace(text.find(named), named.size(), "scenario:\n" + own);
  EXPECT_EQ(study::to_json(study::read_study_text(text, path("study.yaml"))), study::to_json(read()));
  // With a base, from the folder of the study; mistakes are found where they stand.
  const std::string head =
      "factors: []\nreplicates: 2\nperturbation: {spacing: 3 mm}\nscenario:\n  base: scenario.yaml\n";
  const study::Study based = study::read_study_text(head + "  initial: {speed: 30 mph}\n", path("study.yaml"));
  EXPECT_DOUBLE_EQ(based.base.initial.speed, 30.0 * inputs::kMph);
  EXPECT_EQ(based.base.consist.at(0).count, 4);
  EXPECT_EQ(error_of(head + "  initial: {speed: 30 kip}\n").find(":6: initial.speed = '30 kip'"), 0U)
      << error_of(head + "  initial: {speed: 30 kip}\n");
  EXPECT_NE(error_of("scenario: [1, 2]\nfactors: []\n").find(":1: scenario = "), std::string::npos);
}

TEST_F(StudyTest, SpreadsAreThoseOfTheSummary) {
  const study::Study s = read();
  run(s, "out", 2);
  study::write_results(path("out"), s, 1.0);
  const std::vector<std::string> rows = test::lines_of(text_of(folder_ / "out" / "summary.csv"));
  const std::vector<study::PointSpread> spreads = study::spreads(path("out"), s);
  ASSERT_EQ(spreads.size() + 1, rows.size());
  for (std::size_t i = 0; i < spreads.size(); ++i) {
    const study::PointSpread& p = spreads[i];
    const std::string begin = fmt::format("{},{},{},", p.point, p.name, p.outcome);
    EXPECT_EQ(rows[i + 1].rfind(begin, 0), 0U) << rows[i + 1];
    const std::string middle = fmt::format(",{},{},{},", p.spread.q25, p.spread.median, p.spread.q75);
    EXPECT_NE(rows[i + 1].find(middle), std::string::npos) << rows[i + 1] << " lacks " << middle;
  }
}

TEST_F(StudyTest, SeedsAreAllDifferentAndDependOnTheStudysSeed) {
  study::Study s = read();
  std::set<std::int64_t> seeds;
  for (int i = 0; i < 10000; ++i) seeds.insert(study::run_of(s, i).seed);
  EXPECT_EQ(seeds.size(), 10000u);
  const auto before = study::run_of(s, 0).seed;
  s.seed = 8;
  EXPECT_NE(study::run_of(s, 0).seed, before);
}

TEST_F(StudyTest, RandomPlansFillTheirRanges) {
  for (const char* plan : {"latin_hypercube", "sobol", "saltelli"}) {
    write("random.yaml", std::string("scenario: scenario.yaml\nplan: ") + plan +
                             "\nsamples: 64\nfactors:\n  - {key: initial.speed, low: 10 mph, high: 20 mph}\n"
                             "  - {key: \"consist[0].count\", low: 2, high: 9}\n"
                             "  - {key: coupler.stiffness, distribution: log_uniform, low: 1e6, high: 1e8}\n");
    const study::Study s = read("random.yaml");
    const auto points = study::points(s);
    ASSERT_EQ(points.size(), std::string(plan) == "saltelli" ? 64u * 5u : 64u) << plan;
    double mean = 0.0, mean_log = 0.0;
    for (const auto& p : points) {
      const double v = std::stod(p.values[0]), k = std::stod(p.values[2]);
      EXPECT_GE(v, 10.0 * inputs::kMph);
      EXPECT_LE(v, 20.0 * inputs::kMph);
      EXPECT_EQ(p.values[1].find_first_not_of("0123456789"), std::string::npos) << "cars come whole";
      mean += v / static_cast<double>(points.size());
      mean_log += std::log10(k) / static_cast<double>(points.size());
    }
    EXPECT_NEAR(mean, 15.0 * inputs::kMph, 0.1) << plan;  // a stratified mean is far closer than 1/sqrt(64)
    EXPECT_NEAR(mean_log, 7.0, 0.05) << plan;
    if (std::string(plan) == "latin_hypercube") {
      std::set<int> strata;
      for (const auto& p : points) {
        strata.insert(static_cast<int>((std::stod(p.values[0]) / inputs::kMph - 10.0) / 10.0 * 64.0));
      }
      EXPECT_EQ(strata.size(), 64u) << "one point a stratum";
    }
    EXPECT_EQ(study::points(s)[17].values, points[17].values) << "the same study, the same points";
  }
}

TEST_F(StudyTest, MistakesAreNamed) {
  const std::string head = "scenario: scenario.yaml\nfactors:\n";
  EXPECT_EQ(error_of("scenario: scenario.yaml\n"),
            ":1: factors: missing; allowed: a list of groups; [] for an ensemble of the scenario itself");
  EXPECT_EQ(error_of(head + "  - {key: initial.sped, scale: [1]}\n").substr(0, 60),
            ":3: factors.key = 'initial.sped': unknown key, or it has no ");
  EXPECT_EQ(error_of(head + "  - {key: initial.speed, scale: [-1]}\n"),
            ":3: initial.speed = '-8.9408': out of range; allowed: [0, 200] m/s");
  EXPECT_EQ(error_of(head + "  - {key: initial.speed, values: [5 ft]}\n"),
            ":3: initial.speed = '5 ft': wrong dimension: 'ft' cannot be converted to 'm/s'; allowed: [0, 200] m/s (a "
            "number, or "
            "with a unit as in \"1 mph\")");
  EXPECT_EQ(error_of(head + "  - {key: initial.speed}\n"),
            ":3: initial.speed: the plan needs either values or scale; allowed: values: [...] or scale: [...]");
  EXPECT_EQ(error_of("plan: sobol\n" + head + "  - {key: initial.speed, low: 1, high: 2}\n"),
            ": samples = '0': the plan needs samples; allowed: >= 1");
  EXPECT_EQ(error_of("plan: sobol\nsamples: 4\n" + head + "  - {key: initial.speed, low: 2, high: 1}\n"),
            ":5: initial.speed = '2': low is not below high; allowed: low < 1");
  EXPECT_EQ(error_of(head + "  - {key: contact.friction, values: [0.2, 0.4]}\n"),
            ":3: contact.friction: has no effect in this scenario; allowed: with contact.law: elastic");
  EXPECT_EQ(error_of("replicas: 4\n" + head + "  - {key: initial.speed, scale: [1]}\n").substr(0, 29),
            ":1: replicas = '4': unknown k");
  EXPECT_EQ(error_of("outcomes: [fun]\n" + head + "  - {key: initial.speed, scale: [1]}\n").substr(0, 37),
            ":1: outcomes = 'fun': unknown outcome");
}

// A study without a perturbation of its own has its scenario's; runs of a point that cannot differ are refused.
TEST_F(StudyTest, ReplicatesDifferOrAreRefused) {
  const std::string head = "consist:\n  - {count: 4, length: 61.1 ft, weight: 150 kip}\nstop: {time_max: 100 s}\n";
  const auto with = [&](const std::string& initial, const std::string& study, int cars = 4) {
    std::string text = head;
    text.replace(text.find("count: 4"), 8, "count: " + std::to_string(cars));
    write("base.yaml", text + "initial: " + initial + "\n");
    write("ensemble.yaml", "scenario: base.yaml\nfactors: []\nreplicates: 5\n" + study);
    return read("ensemble.yaml");
  };
  const auto refused = [&](const study::Study& s) {
    const std::string error = refusal([&] { run(s, "refused", 1); });
    EXPECT_FALSE(fs::exists(folder_ / "refused"));
    return error.substr(std::min(path("ensemble.yaml: ").size(), error.size()));
  };
  study::Study s = with("{speed: 20 mph, yaw_rate: 0.2, perturbation: {spacing: 3 mm, seed: 4}}", "");
  EXPECT_DOUBLE_EQ(s.perturbation.spacing, 0.003);
  EXPECT_EQ(run(s, "out", 2).runs, 5);
  std::set<std::string> outcomes;
  for (const std::string& line : test::lines_of(runs_csv(s, "out")))
    outcomes.insert(line.substr(line.find(',', line.find(',', line.find(',', line.find(',') + 1) + 1) + 1)));
  EXPECT_EQ(outcomes.size(), 6U) << "all differ";
  EXPECT_TRUE(study::write_results(path("out"), s, 0.0).warnings.empty());
  EXPECT_EQ(with("{speed: 20 mph, yaw_rate: 0.2, perturbation: {spacing: 3 mm}}", "perturbation: {yaw_rate: 0.01}\n")
                .perturbation.spacing,
            0.0)
      << "its own, whole";

  const std::string cannot = "replicates = '5': the runs of a point cannot differ: ",
                    allowed = "; allowed: 1, or a perturbation that acts";
  EXPECT_EQ(refused(with("{speed: 20 mph, yaw_rate: 0.2}", "")),
            cannot + "there is no perturbation, neither of the study nor of its scenario" + allowed);
  EXPECT_EQ(refused(with("{speed: 20 mph, yaw_rate: 0.2, perturbation: {spacing: 3 mm}}", "perturbation: {}\n")),
            cannot + "there is no perturbation, neither of the study nor of its scenario" + allowed);
  EXPECT_EQ(refused(with("{speed: 20 mph, yaw_rate: 0.2}", "perturbation: {spacing: 3 mm}\n", 1)),
            cannot + "perturbation: spacing needs two cars or more" + allowed);
  EXPECT_EQ(refused(with("{speed: 20 mph, yaw_rate: 0}", "perturbation: {yaw_rate: 0.1}\n")),
            cannot + "perturbation: yaw_rate multiplies initial.yaw_rate, which is 0" + allowed);
  // Kicks without rails are refused by the scenario.
  EXPECT_NE(refused(with("{speed: 20 mph, yaw_rate: 0.2}", "perturbation: {spacing: 3 mm, kick: 1 ft/s}\n"))
                .find("initial.perturbation.kick"),
            std::string::npos);
  s = with("{speed: 20 mph, yaw_rate: 0.2}", "perturbation: {spacing: 3 mm}\n");
  s.factors = {{"initial.perturbation.seed", "", {"1", "2"}, {"1", "2"}, {}, 0.0, 0.0, "1", ""}};
  EXPECT_EQ(refused(s),
            "replicates = '5': the runs of a point cannot differ: initial.perturbation.seed is one of the factors; "
            "allowed: 1");

  // Where only some points are so, it is said.
  write("some.yaml",
        "scenario: base.yaml\nplan: grid\nfactors:\n  - {key: initial.yaw_rate, values: [0, 0.2]}\nreplicates: "
        "3\nperturbation: {yaw_rate: 0.1}\n");
  const std::vector<std::string> warnings = study::check(read("some.yaml"));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("1 of 2 points have runs that cannot differ: initial.yaw_rate=0: "), std::string::npos)
      << warnings[0];
  run(read("some.yaml"), "some", 2);
  const study::Totals totals = study::write_results(path("some"), read("some.yaml"), 0.0);
  ASSERT_EQ(totals.warnings.size(), 1U) << "and seen in what came out";
  EXPECT_NE(totals.warnings[0].find("1 of 2 points: all runs are equal"), std::string::npos) << totals.warnings[0];
}

// A seed without a perturbation is an input without effect: runs that need none are not warned of it.
TEST_F(StudyTest, RunsWithoutPerturbationHaveNoSeedToBeWarnedOf) {
  write("plain.yaml",
        "scenario: {base: scenario.yaml, stop: {time_max: 100 s}}\nplan: grid\nfactors:\n  - {key: initial.speed, "
        "values: [10 mph, 20 mph]}\n");
  const study::Study s = read("plain.yaml");
  EXPECT_EQ(study::scenario_of(s, study::Points(s)[0], study::run_of(s, 0)).initial.perturbation.seed, 0);
  run(s, "out", 1);
  EXPECT_TRUE(study::write_results(path("out"), s, 0.0).warnings.empty());
}

TEST_F(StudyTest, TheAccidentsPerturbationActsInAStudyOverIt) {
  write("accident.yaml", "scenario: " + kSource + "/config/accidents/arcadia_2011.yaml\nfactors: []\nreplicates: 5\n");
  const study::Study s = read("accident.yaml");
  EXPECT_GT(s.perturbation.kick, 0.0);
  EXPECT_EQ(s.perturbation.kick, s.base.initial.perturbation.kick);
  const study::Points points(s);
  ASSERT_EQ(points.size(), 1);
  EXPECT_EQ(study::scenario_of(s, points[0], study::run_of(s, 1)).initial.perturbation.alignment,
            s.base.initial.perturbation.alignment);
  EXPECT_NE(study::run_of(s, 0).seed, study::run_of(s, 1).seed);
}

TEST_F(StudyTest, HugeStudiesAreRefusedByTheirNumber) {
  std::string factors;
  for (const char* key : {"initial.speed", "initial.yaw_rate", "coupler.length", "coupler.slack", "stop.speed",
                          "stop.time_max", "ground.off_track_friction", "ground.on_track_friction",
                          "ground.regularization_speed", "outcome.off_track_threshold"}) {
    factors += std::string("  - {key: ") + key + ", values: [1, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9]}\n";
  }
  EXPECT_EQ(error_of("scenario: scenario.yaml\nplan: grid\nreplicates: 3\nperturbation: {spacing: 3 mm}\nfactors:\n" +
                     factors),
            ": plan: 10000000000 points with 3 runs each are 30000000000 runs; allowed: at most 4000000 runs");
  const std::string two =
      "factors:\n  - {key: initial.speed, low: 10 mph, high: 20 mph}\n  - {key: initial.yaw_rate, low: 0.1, high: "
      "0.3}\n";
  EXPECT_EQ(error_of("scenario: scenario.yaml\nplan: saltelli\nsamples: 2000000\n" + two),
            ": plan: 8000000 points with 1 runs each are 8000000 runs; allowed: at most 4000000 runs");
  EXPECT_EQ(error_of("scenario: scenario.yaml\nplan: sobol\nsamples: 5\nreplicates: 1000000\n" + two),
            ": replicates: 5 points with 1000000 runs each are 5000000 runs; allowed: at most 4000000 runs");
  study::Study s = read();
  s.plan = study::Plan::grid;
  s.factors.assign(200, s.factors.front());  // 3^200 points: beyond all integers
  EXPECT_NE(refusal([&] { study::Points points(s); }).find("2.66e+95 points with 5 runs each are 1.33e+96 runs"),
            std::string::npos)
      << refusal([&] { study::Points points(s); });
  s.plan = study::Plan::latin_hypercube;
  s.samples = 400'000;
  s.replicates = 1;
  EXPECT_NE(refusal([&] {
              study::Points points(s);
            }).find("400000 samples of 200 inputs are 80000000 numbers; allowed: at most 20000000 numbers"),
            std::string::npos);
  std::string values = "1";
  for (int i = 0; i < 10000; ++i) values += ", 1";
  EXPECT_NE(error_of("scenario: scenario.yaml\nfactors:\n  - {key: initial.speed, values: [" + values + "]}\n")
                .find("10001 values in all; allowed: at most 10000"),
            std::string::npos);
}

TEST_F(StudyTest, NamesOfPointsAreWhatTheFileSays) {
  write("named.yaml",
        "scenario: scenario.yaml\nfactors:\n  - {key: initial.speed, values: [10 mph, 4]}\n"
        "  - {key: ground.off_track_friction, values: [22.5 %, 0.225], scale: []}\n  - {key: coupler.slack, scale: "
        "[1.5]}\n"
        "  - {key: initial.yaw_rate, scale: [3]}\n");
  const study::Study s = read("named.yaml");
  const study::Points points(s);
  std::vector<std::string> names;
  for (std::int64_t i = 0; i < points.size(); ++i) names.push_back(points.name(i));
  EXPECT_EQ(names, (std::vector<std::string>{"base", "initial.speed=10 mph", "initial.speed=4",
                                             "ground.off_track_friction=22.5 %", "ground.off_track_friction=0.225",
                                             names[5], "initial.yaw_rate=0.6 rad/s"}));
  EXPECT_EQ(names[5].find("coupler.slack="), 0U);
  EXPECT_EQ(names[5].substr(names[5].size() - 3), " ft") << names[5];
  EXPECT_EQ(points[1].values[0], "4.4704") << "in SI, exact";
}

TEST_F(StudyTest, TextFactorsWithWhateverStandsInThem) {
  write("text.yaml",
        "scenario: scenario.yaml\nplan: grid\nfactors:\n  - {key: \"consist[0].name\", values: [tank_car, \"hopper, "
        "steel\", 'say \"hi\"', "
        "\"two\\nlines\", \"a: b\", \"[x]\", \"# no\", \"~\"]}\noutcomes: [stop_time]\n");
  const study::Study s = read("text.yaml");
  EXPECT_EQ(s.factors[0].values, (std::vector<std::string>{"tank_car", "hopper, steel", "say \"hi\"", "two\nlines",
                                                           "a: b", "[x]", "# no", "~"}));
  run(s, "out", 2);
  study::write_results(path("out"), s, 0.0);
  const std::string summary = text_of(folder_ / "out/summary.csv");
  double first = 0.0;
  std::istringstream lines(summary);
  std::string line;
  std::getline(lines, line);
  int rows = 0;
  while (std::getline(lines, line)) {
    if (line.find("stop_time,s,1,0,") == std::string::npos) continue;  // the first half of a name with a line end
    const double mean = std::stod(line.substr(line.find("stop_time,s,1,0,") + 16));
    if (rows++ == 0) first = mean;
    EXPECT_EQ(mean, first) << "a name changes nothing";
  }
  EXPECT_EQ(rows, 8);
  EXPECT_GT(first, 0.0);
  EXPECT_LE(first, 2.0);
  for (const char* key : {"title", "values", "label"}) {
    const std::string bad = std::string("scenario: scenario.yaml\ntitle: ") +
                            (std::string(key) == "title" ? "\"\xFF\"" : "t") + "\nplan: grid\nfactors:\n" +
                            "  - {key: \"consist[0].name\", label: " + (std::string(key) == "label" ? "a\xFF" : "l") +
                            ", values: [" + (std::string(key) == "values" ? "a\xC0" : "v") + "]}\n";
    EXPECT_NE(error_of(bad).find("UTF-8"), std::string::npos) << key << error_of(bad);
  }
}

TEST_F(StudyTest, GivenTwice) {
  EXPECT_EQ(error_of("scenario: scenario.yaml\nfactors:\n  - {key: initial.speed, values: [1]}\n  - {key: "
                     "initial.speed, values: [2]}\n"),
            ":4: factors.key = 'initial.speed': given twice; allowed: every key once");
  EXPECT_EQ(error_of("scenario: scenario.yaml\noutcomes: [stop_time, stop_time]\nfactors: []\n"),
            ":2: outcomes = 'stop_time': given twice; allowed: every name once");
  EXPECT_EQ(
      error_of("scenario: scenario.yaml\nplan: sobol\nsamples: 4\nfactors: []\n"),
      ":4: factors = '[]': this plan samples inputs, but there are no factors; allowed: at least one, or another plan");
  EXPECT_NE(error_of("scenario: scenario.yaml\nfactors:\n  - {key: coupler.break_draft, scale: [0.5]}\n")
                .find("the base value is infinite, cannot be scaled"),
            std::string::npos);
  EXPECT_NE(error_of("scenario: scenario.yaml\nplan: sobol\nsamples: 4\nfactors:\n  - {key: coupler.swing_moment_max, "
                     "low: 1e5, high: .inf}\n")
                .find("not a finite number, cannot be sampled"),
            std::string::npos);
}

TEST_F(StudyTest, WidenedAboutTheMiddlesOfTheRanges) {
  write("ranges.yaml",
        "scenario: scenario.yaml\nplan: latin_hypercube\nsamples: 4\nfactors:\n"
        "  - {key: ground.on_track_friction, low: 0.3, high: 0.5}\n"
        "  - {key: coupler.stiffness, distribution: log_uniform, low: 2e6, high: 8e6}\n"
        "  - {key: ground.off_track_friction, low: 0.1, high: 0.7}\n");
  const study::Study s = read("ranges.yaml");
  const auto range = [](const study::Study& w, std::size_t i) {
    return std::make_pair(w.factors[i].low, w.factors[i].high);
  };
  const study::Study w = study::widened(s, 2.0);
  EXPECT_EQ(range(study::widened(s, 1.0), 1), range(s, 1));
  EXPECT_NEAR(range(w, 0).first, 0.2, 1e-12);  // 0.3 to 0.5
  EXPECT_NEAR(range(w, 0).second, 0.6, 1e-12);
  EXPECT_NEAR(range(w, 1).first, 1e6, 1e-6);  // log, 2e6 to 8e6
  EXPECT_NEAR(range(w, 1).second, 16e6, 1e-6);
  EXPECT_NEAR(range(w, 2).first, 0.02, 1e-12);  // 0.1 to 0.7: not below a twentieth of 0.4
  EXPECT_NEAR(range(w, 2).second, 1.0, 1e-12);
  EXPECT_THROW(study::widened(s, 40.0), inputs::InputError);  // friction above 10
  // The same from the file; asked for, another one.
  write("wide.yaml", text_of(folder_ / "ranges.yaml") + "spread: 2\n");
  EXPECT_EQ(range(read("wide.yaml"), 0), range(w, 0));
  EXPECT_EQ(range(study::read_study_file((folder_ / "wide.yaml").string(), {}, 1.0), 0), range(s, 0));
  for (const char* bad : {"0", "-1", ".nan", ".inf", "101", "wide"}) {
    write("bad.yaml", text_of(folder_ / "ranges.yaml") + "spread: " + bad + "\n");
    try {
      read("bad.yaml");
      ADD_FAILURE() << bad;
    } catch (const inputs::InputError& e) {
      EXPECT_EQ(e.key(), "spread") << bad;
    }
  }
  EXPECT_THROW(study::read_study_file((folder_ / "wide.yaml").string(), {}, std::nan("")), inputs::InputError);
  write("kick.yaml", text_of(folder_ / "ranges.yaml") + "perturbation: {kick: -1 ft/s}\n");
  try {
    read("kick.yaml");
    ADD_FAILURE() << "every run would fail";
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.key(), "perturbation.kick");
  }
  write(
      "grid.yaml",
      "scenario: scenario.yaml\nplan: grid\nspread: 2\nfactors:\n  - {key: ground.on_track_friction, values: [0.3]}\n");
  try {
    read("grid.yaml");
    ADD_FAILURE();
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.key(), "spread");
    EXPECT_EQ(e.value(), "2");
  }
}

TEST_F(StudyTest, TheBaseScenarioCanBeChangedFromOutside) {
  const std::string file = (folder_ / "study.yaml").string();
  const study::Study s = study::read_study_file(file, {inputs::parse_override("ground.on_track_friction=0.175")});
  EXPECT_EQ(s.base.ground.on_track_friction, 0.175);
  for (const study::Point& p : study::points(s)) {
    EXPECT_EQ(study::scenario_of(s, p, study::run_of(s, 0)).ground.on_track_friction, 0.175);
  }
  EXPECT_NE(study::to_json(s), study::to_json(read())) << "its results belong to another folder";
  EXPECT_THROW(study::read_study_file(file, {inputs::parse_override("ground.mu=1")}), inputs::InputError);
}

TEST(Studies, ThoseThatShipAreValid) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kSource + "/config/studies")) {
    const std::string name = entry.path().filename().string();
    if (name == "freight.yaml" || name == "posture_ways.yaml") continue;  // name other studies by cause: test_plan
    const study::Study s = study::read_study_file(entry.path().string());
    EXPECT_GT(study::points(s).size(), 1u) << entry.path();
    ++count;
  }
  EXPECT_GE(count, 20);
}

}  // namespace
}  // namespace train_derail
