#include "verify_command.hpp"

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "count_option.hpp"
#include "exit_codes.hpp"
#include "files.hpp"
#include "interrupt.hpp"
#include "progress.hpp"
#include "scenario_input.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;

struct VerifyArguments {
  std::string file;
  std::optional<std::string> json, out;
  std::vector<std::string> set;
  multibody::VerifyOptions options;
  bool force = false, quiet = false;
};

int verify(VerifyArguments a) {
  multibody::require();
  a.options.source = a.file;
  expect(files::FileKind::scenario, a.file);
  std::vector<inputs::Override> overrides;
  for (const std::string& text : a.set) overrides.push_back(inputs::parse_override(text));
  const inputs::Scenario scenario = inputs::read_scenario_file(a.file, overrides);
  say_warnings(scenario, overrides);
  std::vector<NamedPath> paths;
  if (a.json) paths.push_back({"--json", *a.json});
  std::optional<NewFolder> folder;
  if (a.out) {
    for (const char* name : {"verify.json", "differences.csv"})
      paths.push_back({"--out", (fs::path(*a.out) / name).string()});
    folder.emplace(*a.out);
  }
  require_apart({{"FILE", a.file}}, paths);
  stop_on_signals();
  std::vector<files::OutputFile> outputs;  // opened before the computing
  for (const NamedPath& p : paths) outputs.emplace_back(p.path, existing(a.force));
  multibody::Verification v;
  {
    ProgressLine progress(!a.quiet);
    v = multibody::verify(
        scenario, a.options, [&](double done, const std::string& what) { progress.update(done, what); }, &stop);
  }
  end_on_signals();
  if (stop) {
    std::cerr << "derail: interrupted; nothing has been written\n";
    return kInterrupted;
  }
  // First what needs no disk, which may be full by now.
  if (!a.quiet && !(a.json && files::same_file(*a.json, "-")))
    std::cout << (scenario.title.empty() ? a.file : scenario.title) << "\n" << multibody::to_table(v) << std::flush;
  const std::string json = multibody::to_json(v) + "\n";
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const bool differences = a.out && i + 1 == outputs.size();
    outputs[i].stream() << (differences ? multibody::differences_csv(v) : json);
    outputs[i].commit();
  }
  return v.verdict() == multibody::Verdict::agrees ? kOk : kDiffers;
}

}  // namespace

void add_verify_command(CLI::App& app, std::function<int()>& command) {
  const auto arguments = std::make_shared<VerifyArguments>();
  VerifyArguments& a = *arguments;
  CLI::App* sub = app.add_subcommand(
      "verify",
      "Check the paper's model, or the one in three dimensions, against a general multibody engine (Simbody).\n"
      "Exit code 4: they differ. Parts that the engine lacks are refused: all their keys are named.");
  add_path(sub, "FILE", a.file, "Scenario, YAML (keys: derail keys)")->required();
  sub->add_option("--set", a.set, "Change an input: key=value; may be repeated")->allow_extra_args(false);
  sub->add_option("--runs", a.options.runs,
                  "Runs of either engine in the ensembles; fewer than 8 are reported, not judged")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  add_jobs(sub, a.options.jobs);
  add_path(sub, "--json", a.json, "Write everything as JSON in SI units; - is standard output");
  add_path(sub, "--out", a.out, "Folder for verify.json and differences.csv, from which plot_verify.py draws");
  add_force(sub, a.force);
  sub->add_flag("--quiet", a.quiet, "No progress and no table");
  sub->callback([&command, arguments] { command = [arguments] { return verify(*arguments); }; });
}

}  // namespace train_derail::apps
