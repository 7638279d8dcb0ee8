#include "verify_command.hpp"

#include <filesystem>
#include <iostream>
#include <memory>

#include "files.hpp"
#include "progress.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;

constexpr int kDiffers = 4;

struct Arguments {
  std::string file, json, out;
  std::vector<std::string> set;
  multibody::VerifyOptions options;
  bool quiet = false;
};

[[noreturn]] void unwritable(const fs::path& path) { throw std::runtime_error(path.string() + ": cannot be written"); }

/// To be said before the computing, not after it. Leaves what lies there as it is.
void require_writable(const fs::path& path) {
  const bool there = fs::exists(path);
  if (!std::ofstream(path, std::ios::app)) unwritable(path);
  if (!there) fs::remove(path);
}

int verify(const Arguments& a) {
  multibody::require();
  std::vector<inputs::Override> overrides;
  for (const std::string& text : a.set) overrides.push_back(inputs::parse_override(text));
  const inputs::Scenario scenario = inputs::read_scenario_file(a.file, overrides);
  const fs::path summary = fs::path(a.out) / "verify.json", differences = fs::path(a.out) / "differences.csv";
  if (!a.out.empty()) {
    std::error_code error;
    fs::create_directories(a.out, error);
    if (error) throw std::runtime_error(a.out + ": " + error.message());
    require_writable(summary);
    require_writable(differences);
  }
  if (!a.json.empty() && a.json != "-") require_writable(a.json);
  multibody::Verification v;
  {
    Progress progress(!a.quiet);
    v = multibody::verify(scenario, a.options,
                          [&](double done, const std::string& what) { progress.update(done, what); });
  }
  const std::string json = multibody::to_json(v) + "\n";
  if (!a.out.empty()) {
    write_file(summary.string(), json);
    write_file(differences.string(), multibody::differences_csv(v));
  }
  if (a.json == "-") std::cout << json;
  else if (!a.json.empty()) write_file(a.json, json);
  if (!a.quiet && a.json != "-")
    std::cout << (scenario.title.empty() ? a.file : scenario.title) << "\n" << multibody::to_table(v);
  std::cout.flush();
  if (!std::cout) throw std::runtime_error("standard output: could not be written whole");
  return v.verdict() == multibody::Verdict::agrees ? 0 : kDiffers;
}

}  // namespace

void add_verify_command(CLI::App& app, std::function<int()>& command) {
  const auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  CLI::App* sub = app.add_subcommand(
      "verify", "Check the model against a general multibody engine (Simbody); exit code 4: they differ");
  sub->add_option("FILE", a.file, "Scenario, YAML (keys: derail keys)")->required();
  sub->add_option("--set", a.set, "Change an input: key=value; may be repeated")->allow_extra_args(false);
  sub->add_option("--runs", a.options.runs,
                  "Runs of either engine in the ensembles; fewer than 8 are reported, not judged")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  sub->add_option("--jobs", a.options.jobs, "Threads; default: one a core")->check(CLI::Range(1, 4096));
  sub->add_option("--json", a.json, "Write everything as JSON in SI units; - is standard output");
  sub->add_option("--out", a.out, "Folder for verify.json and differences.csv, from which plot_verify.py draws");
  sub->add_flag("--quiet", a.quiet, "No progress and no table");
  sub->callback([&command, arguments] { command = [arguments] { return verify(*arguments); }; });
}

}  // namespace train_derail::apps
