// The page that `derail report` writes: whole, true to the tables, closed in itself, and safe against what users type.
#include <atomic>
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

#include "folder.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/report.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t n = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++n;
  return n;
}

/// What is wrong with a page as XML, as far as tags go: every one closed, in order, attributes in quotes.
std::string flaw(const std::string& page) {
  std::vector<std::string> open;
  std::size_t at = page.find("<html");
  while ((at = page.find('<', at)) != std::string::npos) {
    const std::size_t end = page.find('>', at);
    if (end == std::string::npos) return "a tag without end";
    const std::string tag = page.substr(at + 1, end - at - 1), name = tag.substr(0, tag.find_first_of(" /", 1));
    if (tag.find('<') != std::string::npos || count(tag, "\"") % 2 != 0) return "inside of <" + tag + ">";
    if (tag[0] == '/') {
      if (open.empty()) return "<" + tag + "> closes nothing";
      if ("/" + open.back() != tag) return "<" + tag + "> closes " + open.back();
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(name);
    }
    at = end;
  }
  return open.empty() ? "" : "not closed: " + open.back();
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
  std::string page() const { return study::to_html(results()); }
  std::string error() const {
    try {
      page();
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

TEST_F(ReportTest, IsClosedInItself) {
  finish(kStudy);
  write("results/pictures/tornado_coupler_force_peak.svg",
        "<svg xmlns=\"http://www.w3.org/2000/svg\"><title>Force &amp; &lt;i&gt;</title></svg>");
  write("results/pictures/tornado_coupler_force_peak.png", "not this one: there is an SVG");
  write("results/pictures/own.png", "fooba");
  const std::string html = page();
  EXPECT_EQ(flaw(html), "");
  EXPECT_EQ(html.compare(0, 15, "<!DOCTYPE html>"), 0);
  EXPECT_EQ(count(html, "<img "), 2u);
  EXPECT_EQ(count(html, "src="), count(html, "src=\"data:image/"));
  for (const char* loads : {"http://", "https://", "href=", "<link", "@import", "url(", "<script", "<iframe"}) {
    EXPECT_EQ(count(html, loads), 0u) << loads;
  }
  EXPECT_EQ(count(html, "src=\"data:image/png;base64,Zm9vYmE=\""), 1u);
  EXPECT_EQ(count(html, "<figcaption>Force &amp; &lt;i&gt;</figcaption>"), 1u) << "the title of the SVG";
  EXPECT_LT(html.find("<figcaption>own<"), html.find("<h3>peak coupler force</h3>"));
  EXPECT_LT(html.find("<h3>peak coupler force</h3>"), html.find("<figcaption>Force"));
}

TEST_F(ReportTest, PicturesAreEncodedWhole) {
  finish(kStudy);
  const std::pair<const char*, const char*> vectors[]{// RFC 4648
                                                      {"f", "Zg=="},          {"fo", "Zm8="},
                                                      {"foo", "Zm9v"},        {"foob", "Zm9vYg=="},
                                                      {"foobar", "Zm9vYmFy"}, {"\xff\xfe", "//4="}};
  for (const auto& [bytes, encoded] : vectors) {
    write("results/pictures/p.png", bytes);
    EXPECT_NE(page().find(fmt::format("base64,{}\"", encoded)), std::string::npos) << encoded;
  }
}

TEST_F(ReportTest, WhatUsersTypeStaysText) {
  finish(kStudy);
  const std::string html = page();
  EXPECT_EQ(flaw(html), "");
  EXPECT_EQ(count(html, "&lt;script&gt;alert('x')&lt;/script&gt; &amp; &quot;more&quot;"), 2u) << "title and heading";
  EXPECT_GE(count(html, "&lt;b&gt;speed&lt;/b&gt;"), 3u);
  EXPECT_GE(count(html, "a &lt; b"), 2u);
  EXPECT_EQ(count(html, "<b>"), 0u);
}

TEST_F(ReportTest, BytesThatAreNoTextAreReplaced) {
  finish(kStudy);
  write("results/pictures/p.svg",
        "<svg><title>a\x01"
        "b\xff"
        "c\xe2\x82</title></svg>");
  EXPECT_NE(page().find("<figcaption>a\uFFFDb\uFFFDc\uFFFD\uFFFD</figcaption>"), std::string::npos);
}

TEST_F(ReportTest, NumbersAreThoseOfTheRunsInUnitsThatPeopleRead) {
  const study::Study s = finish(kStudy);
  const std::string html = page();
  std::vector<double> peaks;
  for (int i = 0; i < 3; ++i) {
    simulation::Simulation run(study::scenario_of(s, study::points(s)[0], study::run_of(s, i)));
    run.run();
    peaks.push_back(run.outcome().coupler_force_peak() / inputs::kKip);
  }
  const study::Spread spread = study::spread(peaks);
  const std::string nbsp = "\u00A0";
  EXPECT_NE(html.find(fmt::format("{:.4g} ({:.4g}{}to{}{:.4g})", spread.median, spread.q05, nbsp, nbsp, spread.q95)),
            std::string::npos);
  EXPECT_NE(html.find("peak coupler force (kip)"), std::string::npos);
  EXPECT_NE(html.find("30" + nbsp + "mph</td><td class=\"n\">+50" + nbsp +
                      "%</td><td class=\"n\">3</td><td class=\"n\">0</td>"),
            std::string::npos);
  EXPECT_NE(html.find("<td>9, of which failed: 0</td>"), std::string::npos);
  EXPECT_NE(html.find("<tr><th>initial.speed</th><td>8.9408</td></tr>"), std::string::npos);
}

TEST_F(ReportTest, FailedRunsStandWithTheirReason) {
  finish(
      "factors:\n  - {key: solver.steps_max, values: [20]}\nreplicates: 2\nperturbation: {spacing: 3 mm}\noutcomes: "
      "[stop_time]\n");
  const std::string html = page();
  EXPECT_EQ(flaw(html), "");
  EXPECT_NE(html.find("<h2>Failed runs</h2>"), std::string::npos);
  EXPECT_EQ(count(html, "solver.steps_max = 20"), 2u);
  EXPECT_EQ(count(html, "nan"), 0u) << "no median where no run is left";
}

TEST_F(ReportTest, SaysHowToMakePictures) {
  finish(kStudy);
  EXPECT_NE(page().find("rosrun train_derail plot_study.py " + results()), std::string::npos);
  EXPECT_EQ(count(page(), "<img"), 0u);
}

TEST_F(ReportTest, EveryPlanHasItsTables) {
  finish(
      "plan: grid\nfactors:\n  - {key: initial.speed, values: [10 mph, 20 mph]}\n"
      "  - {key: ground.on_track_law, values: [isotropic, guided]}\noutcomes: [stop_time]\n");
  EXPECT_EQ(flaw(page()), "");
  EXPECT_EQ(count(page(), "<td class=\"n\">guided</td>"), 2u);
  fs::remove_all(results());
  finish(
      "plan: saltelli\nsamples: 4\nfactors:\n  - {key: initial.speed, low: 10 mph, high: 20 mph}\n"
      "  - {key: initial.yaw_rate, low: 0.1, high: 0.3}\noutcomes: [coupler_force_peak, stop_time]\n");
  const std::string html = page();
  EXPECT_EQ(flaw(html), "");
  EXPECT_NE(html.find("<h2>Sobol indices</h2>"), std::string::npos);
  EXPECT_EQ(count(html, "<td>initial.yaw_rate</td>"), 4u) << "title and key of the input, an index an outcome";
  EXPECT_NE(html.find("uniform: 10\u00A0mph\u00A0to\u00A0"
                      "20\u00A0mph"),
            std::string::npos);
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
  const std::string html = page();
  EXPECT_EQ(flaw(html), "");
  EXPECT_NE(html.find("None varies"), std::string::npos);
  EXPECT_NE(html.find("<h2>Warnings</h2>"), std::string::npos) << "a train that stands: all runs are the same";
  EXPECT_NE(html.find("all runs are equal"), std::string::npos);
}

}  // namespace
}  // namespace train_derail
