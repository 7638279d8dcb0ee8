// What `derail report` shows: true to the tables, and refused if they were changed. test_report_page.py looks at the
// page.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "folder.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/members.hpp"
#include "train_derail/study/report.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

/// The section of a document that has this name; null if there is none.
ordered_json section(const ordered_json& document, const std::string& name) {
  for (const ordered_json& s : document.at("sections")) {
    if (s.at("name") == name) return s;
  }
  return nullptr;
}

/// The texts of a row.
std::vector<std::string> texts(const ordered_json& row) {
  std::vector<std::string> all;
  for (const ordered_json& cell : row) all.push_back(cell.at("text"));
  return all;
}

class ReportTest : public test::Folder {
 protected:
  void SetUp() override {
    write("scenario.yaml",
          "title: \"a < b\"\nconsist:\n  - {count: 4, length: 61.1 ft, weight: 150 kip}\n"
          "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 2 s}\n");
  }

  void write(const std::string& name, const std::string& text) {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  /// Runs a study into results/ as `derail study` does.
  study::Study finish(const std::string& text) {
    write("study.yaml", "scenario: scenario.yaml\n" + text);
    const study::Study s = study::read_study_file((folder_ / "study.yaml").string());
    const std::atomic<bool> stop{false};
    const auto report = study::run_study(
        s, {results(), 2, false, {}}, [](const study::Progress&) {}, stop);
    study::write_results(results(), s, report.wall_time);
    return s;
  }
  std::string results() const { return (folder_ / "results").string(); }
  ordered_json document() const { return ordered_json::parse(study::report_document(results())); }
  std::string error() const {
    try {
      document();
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "no error";
  }

  static constexpr const char* kStudy =
      "title: \"<script>alert('x')</script> & \\\"more\\\"\"\nplan: one_at_a_time\nfactors:\n"
      "  - {key: initial.speed, label: <b>speed</b>, scale: [0.5, 1.5]}\nreplicates: 3\n"
      "perturbation: {spacing: 3 mm}\noutcomes: [cars_past_pod, coupler_force_peak]\n";
};

TEST_F(ReportTest, NumbersAreThoseOfTheRunsInUnitsThatPeopleRead) {
  const study::Study s = finish(kStudy);
  const ordered_json j = document(), outcomes = section(j, "outcomes");
  std::vector<double> peaks;
  for (int i = 0; i < 3; ++i) {
    simulation::Simulation run(study::scenario_of(s, study::points(s)[0], study::run_of(s, i)));
    run.run();
    peaks.push_back(run.outcome().coupler_force_peak() / inputs::kKip);
  }
  const study::Spread spread = study::spread(peaks);
  const std::string nbsp = "\u00A0";
  EXPECT_EQ(outcomes.at("columns").at(6).at("title"), "peak coupler force (kip)");
  const ordered_json& cell = outcomes.at("rows").at(0).at(6);
  EXPECT_EQ(cell.at("text"), fmt::format("{:.4g} ({:.4g}{}to {:.4g})", spread.median, spread.low, nbsp, spread.high));
  EXPECT_NEAR(cell.at("value").get<double>(), spread.median, 1e-12 * spread.median);
  const std::vector<std::string> faster = texts(outcomes.at("rows").at(2));
  EXPECT_EQ(std::vector<std::string>(faster.begin(), faster.begin() + 5),
            (std::vector<std::string>{"<b>speed</b>", "30" + nbsp + "mph", "+50" + nbsp + "%", "3", "0"}));
  EXPECT_EQ(outcomes.at("rows").at(2).at(1).at("value"), 30.0) << "sorted by the number in the unit that is shown";
  EXPECT_EQ(j.at("facts").at(1).at(1), "9, of which failed: 0");

  EXPECT_EQ(outcomes.at("note"), "Median of the runs of each point; in brackets: lowest to highest of 3 runs.");
  const ordered_json scenario = j.at("scenario");
  const auto weight = std::find_if(scenario.begin(), scenario.end(),
                                   [](const ordered_json& fact) { return fact.at(0) == "consist[0].weight"; });
  ASSERT_NE(weight, scenario.end());
  EXPECT_NE(weight->at(1).get<std::string>().find(" N; "), std::string::npos) << *weight;
  EXPECT_NE(weight->at(1).get<std::string>().find(" kip"), std::string::npos) << *weight;

  const ordered_json& chart = j.at("charts").at(1);
  EXPECT_EQ(chart.at("name"), "coupler_force_peak");
  EXPECT_EQ(chart.at("axis"), "peak coupler force (kip)");
  ASSERT_EQ(chart.at("rows").size(), 3U);
  EXPECT_EQ(chart.at("rows").at(2).at("label"), "<b>speed</b> 30" + nbsp + "mph");
  const auto near = [&](const ordered_json& number, double expected) {
    EXPECT_NEAR(number.get<double>(), expected, 1e-12 * expected);
  };
  near(chart.at("reference"), spread.median);
  near(chart.at("rows").at(0).at("low"), spread.low);
  near(chart.at("rows").at(0).at("dot"), spread.median);
  near(chart.at("rows").at(0).at("box").at(1), spread.q75);
}

TEST_F(ReportTest, FailedRunsStandWithTheirReason) {
  finish(
      "factors:\n  - {key: solver.steps_max, values: [20]}\nreplicates: 2\nperturbation: {spacing: 3 mm}\noutcomes: "
      "[stop_time]\n");
  const ordered_json j = document(), failed = section(j, "failed");
  ASSERT_EQ(failed.at("rows").size(), 2U);
  for (const ordered_json& row : failed.at("rows"))
    EXPECT_NE(texts(row).back().find("solver.steps_max = 20"), std::string::npos);
  const ordered_json none_left = section(j, "outcomes").at("rows").at(1).back();
  EXPECT_EQ(none_left.at("text"), "\u2013 (\u2013\u00A0to \u2013)");
  EXPECT_TRUE(none_left.at("value").is_null());
  EXPECT_EQ(j.dump().find("nan"), std::string::npos);
  EXPECT_EQ(j.at("charts").at(0).at("rows").size(), 1U) << "nothing is drawn of a point without runs";
}

TEST_F(ReportTest, HistogramsHoldEveryRunOnce) {
  finish(
      "factors: []\nreplicates: 12\nperturbation: {spacing: 30 mm}\noutcomes: [cars_past_pod, coupler_force_peak]\n");
  const ordered_json j = document();
  ASSERT_EQ(j.at("charts").size(), 2U);
  for (const ordered_json& chart : j.at("charts")) {
    EXPECT_EQ(chart.at("kind"), "histogram");
    std::int64_t all = 0;
    double end = chart.at("rows").front().at("low");
    for (const ordered_json& bar : chart.at("rows")) {
      all += bar.at("count").get<std::int64_t>();
      EXPECT_NEAR(bar.at("low").get<double>(), end, 1e-9 * std::abs(end));
      end = bar.at("high");
    }
    EXPECT_EQ(all, 12);
    EXPECT_GT(chart.at("rows").front().at("count").get<int>(), 0);
    EXPECT_GT(chart.at("rows").back().at("count").get<int>(), 0);
  }
  const ordered_json bar = j.at("charts").at(0).at("rows").at(0);
  EXPECT_EQ(bar.at("high").get<double>() - bar.at("low").get<double>(), 1.0) << "of whole cars";
  EXPECT_NE(section(j, "inputs").at("note").get<std::string>().find("None varies"), std::string::npos);
}

TEST_F(ReportTest, EveryPlanHasItsTables) {
  finish(
      "plan: grid\nfactors:\n  - {key: initial.speed, values: [10 mph, 20 mph]}\n"
      "  - {key: ground.on_track_law, values: [isotropic, guided]}\noutcomes: [stop_time]\n");
  EXPECT_EQ(section(document(), "outcomes").at("rows").at(1).at(1).at("text"), "guided");
  EXPECT_EQ(document().at("charts").at(0).at("rows").at(3).at("label"), "20\u00A0mph, guided");
  fs::remove_all(results());
  finish(
      "plan: saltelli\nsamples: 4\nfactors:\n  - {key: initial.speed, low: 10 mph, high: 20 mph}\n"
      "  - {key: initial.yaw_rate, low: 0.1, high: 0.3}\noutcomes: [coupler_force_peak, stop_time]\n");
  const ordered_json j = document();
  EXPECT_EQ(section(j, "sobol").at("rows").size(), 4U) << "an index an outcome and input";
  EXPECT_EQ(section(j, "inputs").at("rows").at(0).at(3).at("text"),
            "uniform: 10\u00A0mph\u00A0to\u00A0"
            "20\u00A0mph");
  ASSERT_EQ(j.at("charts").size(), 4U) << "a histogram and the indices of each outcome";
  EXPECT_EQ(j.at("charts").at(3).at("rows").size(), 4U);
}

TEST_F(ReportTest, MembersAreTheRunsAtTheQuantiles) {
  const study::Study s = finish(
      "factors: []\nreplicates: 21\nperturbation: {spacing: 30 mm}\noutcomes: [stop_time, coupler_force_peak]\n");
  std::vector<std::pair<double, std::int64_t>> peaks;
  for (std::int64_t i = 0; i < 21; ++i) {
    simulation::Simulation run(study::scenario_of(s, study::points(s)[0], study::run_of(s, i)));
    run.run();
    peaks.emplace_back(run.outcome().coupler_force_peak(), i);
  }
  std::sort(peaks.begin(), peaks.end());
  const study::Members members = study::typical_members(results(), {"coupler_force_peak", {}});
  ASSERT_EQ(members.members.size(), 3U);
  const std::size_t ranks[] = {1, 10, 19};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(members.members[k].run, peaks[ranks[k]].second);
    simulation::Simulation again(members.members[k].scenario);
    again.run();
    EXPECT_EQ(again.outcome().coupler_force_peak(), peaks[ranks[k]].first) << "the same run, bit for bit";
    study::require_same(members, members.members[k], again.outcome());
    EXPECT_THROW(study::require_same(members, members.members[(k + 1) % 3], again.outcome()), std::runtime_error);
  }
  EXPECT_NE(members.chosen.find("Out of 21 runs: those nearest to the 5 %, 50 % and 95 % quantile"), std::string::npos)
      << members.chosen;
}

TEST_F(ReportTest, MembersOfAPointHaveItsInputs) {
  finish(kStudy);
  for (const auto& [point, speed] : {std::pair(0, 20.0), std::pair(1, 10.0), std::pair(2, 30.0)}) {
    const study::Members members = study::typical_members(results(), {{}, point});
    ASSERT_EQ(members.members.size(), 3U);
    for (const study::Member& m : members.members) {
      EXPECT_NEAR(m.scenario.initial.speed, speed * inputs::kMph, 1e-12);
      EXPECT_EQ(m.run / 3, point);
    }
  }
  EXPECT_THROW(study::typical_members(results(), {{}, 7}), inputs::InputError);
  EXPECT_THROW(study::typical_members(results(), {"no_such_outcome", {}}), inputs::InputError);
}

TEST_F(ReportTest, WhatIsMissingIsNamed) {
  EXPECT_EQ(error(), results() + ": no such folder; allowed: a folder that derail study has written");
  finish(kStudy);
  for (const char* name : {"about.json", "runs.csv", "summary.csv"}) {
    fs::rename(folder_ / "results" / name, folder_ / "aside");
    EXPECT_EQ(error().find(results() + "/" + name), 0u) << error();
    write(std::string("results/") + name, "{,\n1\n");
    EXPECT_NE(error().find(name), std::string::npos) << error();
    fs::rename(folder_ / "aside", folder_ / "results" / name);
  }
  EXPECT_EQ(error(), "no error");
}

TEST_F(ReportTest, WhatWasChangedIsNotBelieved) {
  finish(kStudy);
  const auto with = [&](const char* name, const std::function<void(std::string&)>& change) {
    const fs::path path = folder_ / "results" / name;
    std::ifstream file(path, std::ios::binary);
    const std::string good{std::istreambuf_iterator<char>(file), {}};
    std::string text = good;
    change(text);
    write(std::string("results/") + name, text);
    const std::string said = error();
    write(std::string("results/") + name, good);
    EXPECT_EQ(said.find(results() + "/" + name), 0U) << said;
    return said;
  };
  const auto digit = [](std::string& text) {
    char& c = text[text.find_last_of("0123456789")];
    c = c == '9' ? '8' : '9';
  };
  EXPECT_NE(with("runs.csv", digit).find("was changed since it was written"), std::string::npos);
  EXPECT_NE(with("summary.csv", digit).find("was changed since it was written"), std::string::npos);
  const auto replaced = [](const std::string& was, const std::string& is) {
    return [was, is](std::string& text) { text.replace(text.find(was), was.size(), is); };
  };
  EXPECT_NE(with("about.json", replaced("\"factors\"", "\"factories\"")).find("an entry is missing"),
            std::string::npos);
  EXPECT_NE(with("about.json", replaced("\"replicates\": 3", "\"replicates\": [")).find(": not JSON"),
            std::string::npos);
  EXPECT_NE(with("about.json", replaced("\"crc32\"", "\"crc33\"")).find("an entry is missing"), std::string::npos);
  EXPECT_NE(
      with("about.json", replaced("\"perturbation\": {", "\"perturbation\": 3, \"p\": {")).find("has a wrong type"),
      std::string::npos);
  EXPECT_NE(with("about.json", [](std::string& text) { text = "[]"; }).find("has a wrong type"), std::string::npos);
  EXPECT_NE(
      with("about.json", [](std::string& text) { text = std::string(1000000, '['); }).find("nested more than 20 deep"),
      std::string::npos);
  EXPECT_EQ(error(), "no error");
}

TEST_F(ReportTest, OfAnEnsembleAndItsWarnings) {
  write("scenario.yaml",
        "consist:\n  - {count: 4, length: 61.1 ft, weight: 150 kip}\ninitial: {speed: 0, yaw_rate: 0}\nstop: "
        "{time_max: 2 s}\n");
  finish("factors: []\nreplicates: 3\nperturbation: {spacing: 3 mm}\noutcomes: [stop_time]\n");
  const ordered_json warnings = document().at("warnings");
  EXPECT_NE(warnings.dump().find("all runs are equal"), std::string::npos) << "of a train that stands: " << warnings;
}

}  // namespace
}  // namespace train_derail
