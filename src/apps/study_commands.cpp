#include "study_commands.hpp"

#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "count_option.hpp"
#include "exit_codes.hpp"
#include "files.hpp"
#include "interrupt.hpp"
#include "jobs.hpp"
#include "page.hpp"
#include "progress.hpp"
#include "scenario_input.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/study/report.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;

struct StudyArguments {
  std::string file, folder, shard, engine;
  std::optional<std::string> out;
  std::vector<std::string> folders, set;
  int jobs = 0, replicates = 0;  // replicates 0: as in the study file
  bool resume = false, force = false, quiet = false;
};

study::Shard parse_shard(const std::string& text) {
  study::Shard shard;
  if (text.empty()) return shard;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  const auto second = first.ptr != end && *first.ptr == '/' ? std::from_chars(first.ptr + 1, end, shard.count) : first;
  if (second.ptr != end || shard.count < 1 || shard.index < 1 || shard.index > shard.count) {
    throw inputs::InputError("command line", "--shard", text, "not a shard", "i/N with 1 <= i <= N");
  }
  return shard;
}

std::string folder_of(const StudyArguments& a) { return a.out.value_or(fs::path(a.file).stem().string() + ".results"); }

/// Throws inputs::InputError unless the path is a folder with results of a study, complete or not.
void expect_results(const std::string& folder) {
  expect(files::FileKind::study_results, folder);
  if (fs::is_directory(folder)) return;
  const char* problem = fs::exists(folder) ? "is a file" : "does not exist";
  throw inputs::InputError(folder, "", "", problem, "a folder with the results of derail study");
}

study::Study read_study(const StudyArguments& a) {
  expect(files::FileKind::study, a.file);
  std::vector<inputs::Override> overrides;
  for (const std::string& text : a.set) overrides.push_back(inputs::parse_override(text));
  study::Study study = study::read_study_file(a.file, overrides);
  say_warnings(study.base, overrides);
  if (a.replicates > 0) study.replicates = a.replicates;
  if (a.engine == to_string(study::EngineChoice::multibody)) {
    study.engine = study::EngineChoice::multibody;
    study.title += " (multibody engine)";
  }
  return study;
}

int finish(const std::string& folder, const study::Study& study, double wall_time, bool quiet) {
  study::Totals totals;
  try {
    totals = study::write_results(folder, study, wall_time, &stop);
  } catch (const study::Stopped&) {
    std::cerr << "derail: stopped before all tables were written; --resume writes them\n";
    return kInterrupted;
  }
  for (const std::string& warning : totals.warnings) std::cerr << "derail: warning: " << warning << "\n";
  const bool none = totals.runs > 0 && totals.failed == totals.runs;  // then all numbers of the table are missing
  if (!quiet) {
    std::cout << study.title << "\n"
              << (none ? "" : study::to_table(folder, study))
              << fmt::format("{} of {} runs in {} (runs.csv, summary.csv, about.json){}\n", totals.runs,
                             study::run_count(study), folder,
                             wall_time > 0.0 ? fmt::format(", {:.1f} s", wall_time) : "");
  }
  if (!none) return kOk;
  std::cerr << fmt::format("derail: {}: every run failed\n", folder);
  return kRunsFailed;
}

int run(const StudyArguments& a) {
  const study::Study study = read_study(a);
  study::RunOptions options{folder_of(a), useful_jobs(a.jobs), a.resume, parse_shard(a.shard)};
  stop_on_signals();
  study::RunReport report;
  try {
    for (const std::string& warning : study::check(study, &stop)) std::cerr << "derail: warning: " << warning << "\n";
    ProgressLine progress(!a.quiet);
    report = study::run_study(
        study, options,
        [&](const study::Progress& p) {
          progress.update(static_cast<double>(p.done) / static_cast<double>(p.total),
                          fmt::format("{} of {} runs, {:.1f} a second{}", p.done, p.total, p.rate,
                                      p.failed > 0 ? fmt::format(", {} failed", p.failed) : ""));
        },
        stop);
  } catch (const study::Stopped&) {
    report.stopped = true;
  }
  say_problems(report.problems, "computed again");
  if (report.failed > 0) {
    std::cerr << fmt::format("derail: {} of {} runs failed; their rows in runs.csv say why\n", report.failed,
                             report.computed);
  }
  if (report.stopped) {
    std::cerr << fmt::format("derail: stopped with {} runs on disk; --resume computes the rest\n", report.runs);
    return kInterrupted;
  }
  if (options.shard.count > 1) {
    if (!a.quiet)
      std::cout << fmt::format("shard {}: {} runs in {}; when all shards are there: derail merge\n", a.shard,
                               report.runs, options.folder);
    return kOk;  // a cluster merges only after shards that ended well
  }
  return finish(options.folder, study, report.wall_time, a.quiet);
}

int merge(const StudyArguments& a) {
  const study::Study study = read_study(a);
  for (const std::string& folder : a.folders) expect_results(folder);
  stop_on_signals();
  const study::Gathered gathered = study::gather(folder_of(a), a.folders, study);
  say_problems(gathered.problems, "left out; derail study --resume computes what is missing");
  const int code = finish(folder_of(a), study, 0.0, a.quiet);
  if ((code != kOk && code != kRunsFailed) || gathered.missing.empty()) return code;
  std::cerr << fmt::format("derail: {}: {}\n", folder_of(a), gathered.missing);
  return kIncomplete;
}

int report(const StudyArguments& a) {
  expect_results(a.folder);
  const fs::path folder = a.folder;
  const std::string path = a.out.value_or((folder / "report.html").string());
  std::vector<NamedPath> inputs;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& file = entry.path();
    if (entry.is_regular_file() && file.extension() != ".html")
      inputs.push_back({"a file of the results", file.string()});
  }
  require_apart(inputs, {{"--out", path}});
  const std::string page = make_page("report", study::report_document(a.folder));
  // An older report may be replaced in its own place, which nobody has named; any other file only with --force.
  const bool own = a.force || (!a.out && files::recognise(path).what == files::kReport);
  files::write_file(path, page, existing(own));
  if (!a.quiet && !files::same_file(path, "-")) std::cout << path << "\n";
  return kOk;
}

}  // namespace

void add_study_commands(CLI::App& app, std::function<int()>& command) {
  const auto arguments = std::make_shared<StudyArguments>();
  StudyArguments& a = *arguments;
  const auto common = [&a](CLI::App* sub) {
    add_path(sub, "FILE", a.file, "Study, YAML (examples: config/studies)")->required();
    sub->add_option("--set", a.set, "Change an input of the base scenario: key=value; may be repeated")
        ->allow_extra_args(false);
    add_count(sub, "--replicates", a.replicates, study::kReplicates,
              "Runs for each point, instead of the number in the study");
    add_path(sub, "--out", a.out, "Folder of the results; default: the file's name with .results");
    sub->add_option("--engine", a.engine, "What computes: the model, or the multibody engine that checks it (slow)")
        ->default_str(to_string(study::EngineChoice::purpose_built))
        ->check(CLI::IsMember(std::vector<std::string>(study::kEngineNames.begin(), study::kEngineNames.end())));
    sub->add_flag("--quiet", a.quiet, "No progress and no table");
  };
  CLI::App* study_command =
      app.add_subcommand("study", "Run a study: many scenarios, on all cores, one row for each run");
  common(study_command);
  add_jobs(study_command, a.jobs);
  study_command->add_flag("--resume", a.resume, "Compute only what the folder lacks");
  study_command->add_option("--shard", a.shard, "Part i/N of the runs, for several machines; then derail merge");
  study_command->callback([&command, arguments] { command = [arguments] { return run(*arguments); }; });
  CLI::App* merge_command = app.add_subcommand("merge", "Put the shards of a study together");
  common(merge_command);
  add_path(merge_command, "FOLDERS", a.folders, "Folders of shards; default: the shards that lie in --out");
  CLI::App* report_command =
      app.add_subcommand("report", "Write the results of a study as one self-contained page of HTML");
  add_path(report_command, "DIR", a.folder, "Folder of the results")->required();
  add_path(report_command, "--out", a.out,
           "File of the page; - is standard output; default: report.html in DIR, where it replaces an older report");
  add_force(report_command, a.force);
  report_command->add_flag("--quiet", a.quiet, "Do not print the path of the page");
  report_command->callback([&command, arguments] { command = [arguments] { return report(*arguments); }; });
  merge_command->callback([&command, arguments] { command = [arguments] { return merge(*arguments); }; });
}

}  // namespace train_derail::apps
