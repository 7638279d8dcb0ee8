#include "validate_command.hpp"

#include <algorithm>
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
#include "progress.hpp"
#include "scenario_input.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/study/summary.hpp"
#include "train_derail/validation/validation.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;
using inputs::InputError;

struct ValidateArguments {
  std::string table, study, min_speed;
  std::optional<std::string> out;
  std::vector<std::string> set;
  std::optional<double> spread;
  int members = 0, jobs = 0, min_tail = 0, every = 1;  // members 0: as in the study file
  bool seeds_only = false, skip_invalid = false, resume = false, quiet = false;
};

validation::Plan read_plan(const ValidateArguments& a) {
  validation::PlanChanges changes;
  for (const std::string& text : a.set) changes.overrides.push_back(inputs::parse_override(text));
  changes.spread = a.spread;
  changes.members = a.members;
  changes.seeds_only = a.seeds_only;
  validation::Plan plan = validation::read_plan(a.study, changes);
  for (const validation::Way* w : plan.all_ways()) say_warnings(w->study.base, changes.overrides);
  return plan;
}

validation::AccidentTable read_table(const ValidateArguments& a) {
  validation::AccidentTable table = validation::read_accidents(a.table, a.skip_invalid);
  double slowest = 0.0;
  try {
    if (!a.min_speed.empty()) slowest = inputs::to_si(a.min_speed, "m/s") / inputs::kMph;
  } catch (const std::invalid_argument& e) {
    throw InputError("command line", "--min-speed", a.min_speed, e.what(), "a speed, as in \"10 mph\"");
  }
  std::vector<validation::Accident> wanted;
  for (const validation::Accident& row : table.rows) {
    const bool due = (row.line - 2) % static_cast<std::size_t>(a.every) == 0;
    if (due && row.speed_mph >= slowest - 1e-9 && row.cars_from_pod_to_rear >= a.min_tail) wanted.push_back(row);
  }
  if (wanted.empty())
    throw InputError(a.table, "", "", "no row fulfils the conditions of the command line", "at least one row");
  table.rows = std::move(wanted);
  return table;
}

void say_left_out(const validation::AccidentTable& table) {
  constexpr std::size_t kShown = 10;
  if (table.left_out.empty()) return;
  std::cerr << fmt::format("derail: {}: {} rows left out\n", table.path, table.left_out.size());
  for (const std::string& count : validation::left_out_counts(table)) std::cerr << "  " << count << "\n";
  for (std::size_t i = 0; i < std::min(kShown, table.left_out.size()); ++i) {
    std::cerr << fmt::format("  line {}: {}\n", table.left_out[i].line, table.left_out[i].text);
  }
  const std::size_t more = table.left_out.size() - std::min(kShown, table.left_out.size());
  if (more > 0) std::cerr << fmt::format("  and {} more (validation.json)\n", more);
}

int validate(const ValidateArguments& a) {
  expect(files::FileKind::accidents, a.table);
  expect(files::FileKind::study, a.study);
  validation::AccidentTable table = read_table(a);
  const validation::Plan plan = read_plan(a);
  validation::check_scenarios(plan, table, a.skip_invalid);
  if (!plan.fitted_on.empty())
    validation::read_fitted_class(plan.fitted_on);  // so that a mistake is reported before the computing
  say_left_out(table);
  const std::string folder = a.out.value_or(fs::path(a.table).stem().string() + ".validated");
  stop_on_signals();
  validation::Ensembles ensembles;
  {
    ProgressLine progress(!a.quiet);
    ensembles = validation::run(
        plan, table, {folder, useful_jobs(a.jobs), a.resume},
        [&](const study::Progress& p) {
          progress.update(static_cast<double>(p.done) / static_cast<double>(p.total),
                          fmt::format("{} of {} runs, {:.1f} a second{}", p.done, p.total, p.rate,
                                      p.failed > 0 ? fmt::format(", {} failed", p.failed) : ""));
        },
        stop);
  }
  end_on_signals();
  say_problems(ensembles.problems, "computed again");
  if (ensembles.stopped) {
    std::cerr << "derail: stopped; --resume goes on from here\n";
    return kInterrupted;
  }
  const validation::Validation v = validation::evaluate(plan, table, ensembles);
  const auto write = [&](const char* name,
                         const std::string& text) {  // the folder belongs to this validation: its files may be replaced
    files::write_file((fs::path(folder) / name).string(), text, files::Existing::replace);
  };
  write("rows.csv", validation::rows_csv(v));
  write("members.csv", validation::members_csv(plan, ensembles));
  write("validation.json", validation::to_json(v) + "\n");
  study::write_about(folder, plan.first(),
                     {static_cast<std::int64_t>(ensembles.members.size()), ensembles.failed, ensembles.warnings},
                     ensembles.wall_time, validation::described(plan));
  if (ensembles.failed > 0) {
    std::cerr << fmt::format("derail: {} of {} runs failed; their rows in members.csv say why\n", ensembles.failed,
                             ensembles.members.size());
  }
  if (!a.quiet) {
    std::cout << plan.title() << "\n"
              << validation::to_table(v)
              << fmt::format("{} runs in {} (rows.csv, members.csv, validation.json, about.json), {:.1f} s\n",
                             ensembles.members.size(), folder, ensembles.wall_time);
  }
  return !ensembles.members.empty() && ensembles.failed == static_cast<std::int64_t>(ensembles.members.size())
             ? kRunsFailed
             : kOk;
}

}  // namespace

void add_validate_command(CLI::App& app, std::function<int()>& command) {
  const auto arguments = std::make_shared<ValidateArguments>();
  ValidateArguments& a = *arguments;
  CLI::App* sub = app.add_subcommand(
      "validate",
      "Predict the cars derailed in real accidents, one ensemble for each row, and score it against what happened");
  add_path(sub, "DATA", a.table, "Table of accidents, CSV (columns: docs/validation.md; example: config/accidents)")
      ->required();
  add_path(sub, "--study", a.study,
           "Study whose points are the members: base scenario, inputs that vary; or a file of ways by cause")
      ->required();
  sub->add_option("--set", a.set, "Change an input of the base scenario: key=value; may be repeated")
      ->allow_extra_args(false);
  sub->add_option("--members", a.members, "Runs for each row, instead of the number in the study")
      ->check(CLI::Range(1, 100000));
  sub->add_option("--spread", a.spread,
                  "Factor on the half-width of every range, instead of the one in the study; the middles stay");
  sub->add_flag("--seeds-only", a.seeds_only, "Inputs stay at the base scenario's; members differ by their seed alone");
  sub->add_option("--min-speed", a.min_speed, "Only rows of this speed or more, as in \"10 mph\"");
  sub->add_option("--min-tail", a.min_tail,
                  "Only rows with at least this many cars from the first derailed one to the rear")
      ->check(CLI::Range(1, 1000));
  sub->add_option("--every", a.every, "Only every N-th row of the table")->check(CLI::Range(1, 1000000));
  add_path(sub, "--out", a.out, "Folder of the results; default: the table's name with .validated");
  add_jobs(sub, a.jobs);
  sub->add_flag("--skip-invalid", a.skip_invalid, "Leave out rows that cannot be used, and say which and why");
  sub->add_flag("--resume", a.resume, "Compute only what the folder lacks: after a kill or a stop");
  sub->add_flag("--quiet", a.quiet, "No progress and no table");
  sub->callback([&command, arguments] { command = [arguments] { return validate(*arguments); }; });
}

}  // namespace train_derail::apps
