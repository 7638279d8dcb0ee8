/// \file
/// The command line program. It uses the same library as the node, without ROS.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "bag_output.hpp"
#include "check_command.hpp"
#include "count_option.hpp"
#include "ensemble.hpp"
#include "exit_codes.hpp"
#include "files.hpp"
#include "import_command.hpp"
#include "interrupt.hpp"
#include "kept_run.hpp"
#include "page.hpp"
#include "progress.hpp"
#include "replay_command.hpp"
#include "scenario_input.hpp"
#include "study_commands.hpp"
#include "table_options.hpp"
#include "train_derail/fields/reference.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/outcome/incidents_csv.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/scene/replay.hpp"
#include "train_derail/simulation/fields.hpp"
#include "train_derail/simulation/output_grid.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/simulation/times.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"
#include "validate_command.hpp"
#include "verify_command.hpp"

namespace {

using namespace train_derail;

struct RunArguments {
  std::string file;
  std::optional<std::string> json, csv, incidents, bag, html, from, checkpoint, checkpoint_time;
  std::vector<std::string> set;
  apps::TableOptions table;
  int seeds = 0, jobs = 0;
  bool force = false, quiet = false;
};

inputs::Scenario read(const RunArguments& a) {
  apps::expect(files::FileKind::scenario, a.file);
  inputs::Scenario scenario = inputs::read_scenario_file(a.file, apps::overrides(a.set));
  model::check_step(scenario, a.file);
  return scenario;
}

/// Returns how far the run has got, in [0, 1]: the share of speed that is lost, or of stop.time_max that is over. The
/// time of stopping is not known before.
double progress_of(const simulation::Simulation& s) {
  const double v0 = s.scenario().initial.speed;
  double v = 0.0;
  for (const simulation::CarSnapshot& car : s.snapshot().cars) v += std::hypot(car.vx, car.vy);
  v /= static_cast<double>(s.cars().size());
  const double by_speed = v0 > 0.0 ? 1.0 - v / v0 : 0.0;
  return std::min(std::max(by_speed, s.time() / s.scenario().stop.time_max), 1.0);
}

/// When the run is to be saved: at --checkpoint-time [s]; left out: at its end.
double checkpoint_time(const RunArguments& a) {
  if (!a.checkpoint_time) return inputs::kInfinity;
  const auto refuse = [&a](const std::string& problem) {
    throw inputs::InputError("command line", "--checkpoint-time", *a.checkpoint_time, problem,
                             "a time of the run, as in \"5 s\", with --checkpoint");
  };
  if (!a.checkpoint) refuse("nothing is to be saved");
  double t = 0.0;
  try {
    t = inputs::to_si(*a.checkpoint_time, "s");
  } catch (const std::invalid_argument& e) {
    refuse(e.what());
  }
  if (const std::string flaw = simulation::flaw_of_time(t); !flaw.empty()) refuse(flaw);
  return t;
}

/// The files that `derail run` writes. They are opened before the computing, so that a path that cannot be written is
/// reported at once.
class Outputs {
 public:
  explicit Outputs(const RunArguments& a) : existing_(apps::existing(a.force)), name_(a.file) {
    std::vector<apps::NamedPath> paths;
    const auto add = [&paths](const char* option, const std::optional<std::string>& path) {
      if (path) paths.push_back({option, *path});
    };
    add("--csv", a.csv);
    add("--incidents", a.incidents);
    add("--json", a.json);
    add("--bag", a.bag);
    add("--html", a.html);
    add("--checkpoint", a.checkpoint);
    std::vector<apps::NamedPath> inputs{{"FILE", a.file}};
    if (a.from) inputs.push_back({"--from", *a.from});
    apps::require_apart(inputs, paths);
    if (a.bag == "-") throw inputs::InputError("command line", "--bag", "-", "a bag needs a file of its own", "a path");
    open(a.csv, csv_);
    open(a.incidents, incidents_);
    open(a.json, json_);
    open(a.html, html_);
    if (html_) apps::require_page_maker("replay");
    open(a.checkpoint, checkpoint_, files::Compression::never);
  }

  /// Must be called before the first step.
  void start(const RunArguments& a, const simulation::Simulation& s) {
    if (a.bag) bag_ = apps::open_bag(*a.bag, existing_, s);
    if (html_) replay_.emplace(s);
    if (!csv_) return;
    choice_ = a.table.choice(s.scenario());
    states_ = simulation::ThinnedStates(a.table.steps(s.scenario()));
    simulation::write_csv_header(csv_->stream(), choice_);
    write(states_.add(0, s.snapshot()));
  }
  /// Whether a file needs the states on the output grid.
  bool follows() const { return csv_ || bag_ || html_; }
  /// A run that cannot be recorded is not worth computing: throws if a file fails. But whoever has asked for the end of
  /// the run gets the other files; then finish() tells of it.
  void grid_point(std::int64_t tick, const simulation::Simulation& s) {
    try {
      if (csv_) write(states_.add(tick, s.snapshot()));
      if (bag_) bag_->grid_point();
      if (replay_) replay_->add(s);
    } catch (const std::exception&) {
      if (!apps::stop) throw;
      failure_ = std::current_exception();
    }
  }
  /// How large the table of states is so far, for people; "" without one.
  std::string table_size() const {
    return csv_ ? fmt::format(", {:.1f} MB in {}", static_cast<double>(csv_->size()) / 1e6, csv_->path()) : "";
  }
  /// The run is still to be saved, as --checkpoint asks.
  bool saves() const { return checkpoint_ && !saved_; }
  /// Saves it; the file is there from now on, whatever becomes of the rest of the run.
  void save(const simulation::Simulation& s) {
    simulation::write_checkpoint(s.checkpoint(), checkpoint_->stream());
    checkpoint_->commit();
    saved_ = true;
  }
  /// Returns the names of what has been written. One that fails does not keep the others from being written, the page
  /// last: another program makes it. Then throws what failed first.
  std::vector<std::string> finish(const simulation::Simulation& s, const outcome::Outcome& outcome) {
    std::vector<std::string> written;
    const auto attempt = [&](const auto& action) {
      try {
        written.push_back(action());
      } catch (const std::exception&) {
        if (!failure_) failure_ = std::current_exception();
      }
    };
    const auto complete = [&attempt](std::optional<files::OutputFile>& file, const auto& write_rest) {
      if (!file) return;
      attempt([&] {
        write_rest(file->stream());
        file->commit();
        return file->path();
      });
    };
    complete(csv_, [this](std::ostream&) { write(states_.last()); });
    complete(incidents_, [&s](std::ostream& out) { outcome::write_incidents_csv(out, s.incidents()); });
    complete(json_, [&outcome](std::ostream& out) { out << outcome::to_json(outcome) << "\n"; });
    if (saved_) written.push_back(checkpoint_->path());
    if (bag_) attempt([&] { return bag_->close(s, outcome); });
    complete(html_, [&](std::ostream& out) { out << replay_page(s, outcome); });
    if (failure_) std::rethrow_exception(failure_);
    return written;
  }
  /// Whether a file goes to standard output; nothing else may be printed then.
  bool on_standard_output() const {
    return std::any_of(paths_.begin(), paths_.end(),
                       [](const std::string& path) { return files::same_file(path, "-"); });
  }

 private:
  std::string replay_page(const simulation::Simulation& s, const outcome::Outcome& outcome) const {
    return apps::make_page("replay", scene::page_document({}, {replay_->document({name_, ""}, s, outcome)}));
  }
  void open(const std::optional<std::string>& path, std::optional<files::OutputFile>& file,
            files::Compression compression = files::Compression::by_name) {
    if (!path) return;
    file.emplace(*path, existing_, &apps::stop, compression);
    paths_.push_back(*path);
  }
  void write(const simulation::Snapshot* state) {
    if (state == nullptr) return;
    simulation::write_csv_rows(csv_->stream(), *state, choice_);
    csv_->check();
  }

  files::Existing existing_;
  const std::string name_;  // of the run, if its scenario has no title
  std::optional<files::OutputFile> csv_, incidents_, json_, checkpoint_, html_;
  std::exception_ptr failure_;  // the first
  std::optional<apps::KeptRun> replay_;
  simulation::TableChoice choice_;
  simulation::ThinnedStates states_{1};
  bool saved_ = false;
  std::unique_ptr<apps::BagOutput> bag_;
  std::vector<std::string> paths_;
};

int check(const RunArguments& a) {
  const inputs::Scenario scenario = read(a);
  apps::say_warnings(scenario, apps::overrides(a.set));
  std::cout << apps::explained(scenario);
  return apps::kOk;
}

int run(const RunArguments& a) {
  const inputs::Scenario scenario = read(a);
  for (const auto& [option, value] :
       {std::pair("--every", a.table.every), std::pair("--cars", a.table.cars),
        std::pair("--columns", a.table.columns.empty() ? std::nullopt : std::optional(a.table.columns.front()))}) {
    if (value && (!a.csv || a.seeds > 0))
      throw inputs::InputError("command line", option, *value, "chooses what of one run --csv writes",
                               "with --csv, without --seeds");
  }
  if (a.seeds > 0) {
    apps::say_warnings(scenario, apps::overrides(a.set));
    for (const auto& [option, value] :
         {std::pair("--bag", a.bag), std::pair("--html", a.html), std::pair("--incidents", a.incidents),
          std::pair("--from", a.from), std::pair("--checkpoint", a.checkpoint)}) {
      if (value)
        throw inputs::InputError("command line", option, *value, "records one run, but --seeds asks for many",
                                 "one of the two");
    }
    return apps::run_ensemble(scenario, {a.file, a.csv, a.json, a.seeds, a.jobs, a.force, a.quiet});
  }
  if (a.jobs > 0)
    throw inputs::InputError("command line", "--jobs", std::to_string(a.jobs), "one run is computed by one thread",
                             "with --seeds");
  const double save_at = checkpoint_time(a);
  apps::stop_on_signals();  // before there are files that could remain incomplete
  Outputs outputs(a);
  simulation::Simulation simulation = a.from ? simulation::Simulation(scenario, simulation::read_checkpoint(*a.from))
                                             : simulation::Simulation(scenario);
  if (a.checkpoint) static_cast<void>(simulation.checkpoint());  // refused, if at all, before the computing
  const bool table = !a.quiet && !outputs.on_standard_output();
  // Those of the outcome stand at the end of the table, with the numbers that they are about.
  apps::say_warnings(scenario, apps::overrides(a.set),
                     table ? simulation.outcome().warnings : std::vector<std::string>());
  outputs.start(a, simulation);
  {
    apps::ProgressLine progress(!a.quiet);
    if (!progress.shown() && !outputs.follows() && !outputs.saves())
      simulation.run(&apps::stop);  // without stops at the output grid, since nobody needs them
    for (simulation::OutputGrid grid(simulation); !simulation.ended() && !apps::stop;) {
      if (grid.advance(&apps::stop)) outputs.grid_point(grid.point(), simulation);
      if (outputs.saves() && (simulation.time() >= save_at || simulation.ended())) outputs.save(simulation);
      progress.update(progress_of(simulation),
                      fmt::format("{:.1f} s simulated{}", simulation.time(), outputs.table_size()));
    }
  }

  outcome::Outcome outcome = simulation.outcome();
  const bool interrupted = !simulation.ended();
  if (interrupted) {
    outcome.message = "interrupted";
    outcome.warnings.push_back(
        fmt::format("interrupted at {:.2f} s: numbers are those of the run so far", simulation.time()));
  }
  const std::vector<std::string> written = outputs.finish(simulation, outcome);
  if (table) {
    std::cout << inputs::printable(scenario.title.empty() ? a.file : scenario.title) << "\n"
              << outcome::to_table(outcome);
  }
  if (outcome.ended == outcome::Ended::integration_failed) {
    std::cerr << "derail: integration failed: " << outcome.message << "\n";
    return apps::kRunsFailed;
  }
  if (interrupted) {
    std::cerr << fmt::format(
        "derail: interrupted at {:.2f} s; written up to there: {}\n", simulation.time(),
        written.empty() ? "no files, as none were asked for" : fmt::format("{}", fmt::join(written, ", ")));
    return apps::kInterrupted;
  }
  return apps::kOk;
}

/// Returns the page docs/outcomes.md.
std::string describe_fields() {
  return "# What comes out\n\n"
         "Written by `derail fields`. A thing has the same name everywhere: JSON, CSV, studies, topics,\n"
         "panel, Python.\n"
         "Cars and couplers count from 1; 0 means none. Coupler i joins cars i (lead) and i + 1 (trail).\n\n"
         "## Outcome\n\n"
         "`derail run --json`, `~outcome` (without `wall_time`), tables, journals of studies.\n\n" +
         fields::reference(outcome::outcome_fields()) +
         "\n## Cars over time\n\n"
         "`derail run --csv`: one row for each car and time, after `time_s` and `car`; units are in the names\n"
         "of the columns (`x_m`). `~cars` has place and orientation as `pose`, velocities as `twist`.\n\n" +
         fields::reference(simulation::car_fields()) +
         "\n## Couplers over time\n\n"
         "In the same row of the CSV, of the coupler behind the car; empty for the last car. `~couplers`.\n\n" +
         fields::reference(simulation::coupler_fields());
}

/// Returns an error in the words of the command line.
std::string told(const inputs::InputError& e) {
  return e.where() == inputs::kOverride
             ? inputs::InputError("--set", e.key(), e.value(), e.problem(), e.allowed()).what()
             : e.what();
}

/// Returns an error of CLI11 on one line, with the command that prints help.
std::string one_line(const CLI::App* app, const CLI::Error& error) {
  std::string what = error.what();
  const std::vector<std::string> left = app->remaining(true);
  while (const CLI::App* chosen = app->get_subcommands().empty() ? nullptr : app->get_subcommands().front())
    app = chosen;
  const bool top = app->get_parent() == nullptr;
  // A slip in an option leaves other things missing, too.
  const auto option =
      std::find_if(left.begin(), left.end(), [](const std::string& l) { return l.size() > 1 && l[0] == '-'; });
  if (option != left.end()) what = fmt::format("{}: no such option", option->substr(0, 40));
  if (top && !left.empty() && left.front().front() != '-') {
    std::vector<std::string> names;
    for (const CLI::App* command : app->get_subcommands({})) names.push_back(command->get_name());
    what = fmt::format("'{}' is not a command; commands: {}", left.front().substr(0, 40), fmt::join(names, ", "));
  }
  std::replace(what.begin(), what.end(), '\n', ' ');
  return fmt::format("derail: {}; help: derail {}{}--help\n", what, top ? "" : app->get_name(), top ? "" : " ");
}

int command_line(int argc, char** argv) {
  CLI::App app{
      "Simulates how a train derails: in the plane by the equations of motion of Jeong, Lyons, Orringer and Perlman\n"
      "(2007), with further parts if a scenario asks for them, or in three dimensions (model: spatial).\n\n"
      "  derail run config/baseline.yaml                                  the paper's baseline: table of the outcome\n"
      "  derail run config/baseline.yaml --set \"initial.speed=55.5 mph\"   the same, faster\n"
      "  derail run config/baseline.yaml --json - --csv states.csv        for programs: outcome, states over time\n"
      "  derail run config/accident3d.yaml                                a train in three dimensions: cars roll over\n"
      "  derail check my_train.yaml                                       what is understood, in SI, defaults filled "
      "in\n"
      "  derail keys                                                      every key of a scenario file\n"
      "  derail fields                                                    all that comes out: names, units, meaning\n"
      "  derail study config/studies/paper_sensitivity.yaml --out results  many runs: medians, ranges, tables\n"
      "  derail validate accidents.csv --study config/studies/accident_validation.yaml   against real accidents\n"
      "  derail verify config/baseline.yaml                               a general multibody engine's second "
      "opinion;\n"
      "  derail verify config/verify3d.yaml                               the same in three dimensions\n\n"
      "A long train is chaotic: one run is one draw. Compare ensembles (initial.perturbation), not single runs.\n"
      "Exit codes: 0 done, 1 output could not be written, 2 something is wrong with the input, 3 integration failed,\n"
      "4 derail verify: the two engines differ, 5 derail merge: shards or runs are missing,\n"
      "130 interrupted (what there was has been written).\n"
      "Files are written whole or not at all, and never over others unless --force says so.",
      "derail"};
  app.set_version_flag("--version", "train_derail " TRAIN_DERAIL_VERSION, "Print the version and exit");
  app.require_subcommand(1);
  app.fallthrough();

  RunArguments a;
  const auto add_inputs = [&a](CLI::App* command) {
    apps::add_path(command, "FILE", a.file, "Scenario, YAML (keys: derail keys)")->required();
    command
        ->add_option("--set", a.set, "Change an input: key=value, as in \"consist[0].weight=286 kip\"; may be repeated")
        ->allow_extra_args(false);
  };
  CLI::App* run_command = app.add_subcommand("run", "Run one scenario to its end");
  add_inputs(run_command);
  apps::add_path(run_command, "--json", a.json, "Write the outcome as JSON in SI units; - is standard output");
  apps::add_path(run_command, "--csv", a.csv,
                 "Write the states of cars and couplers on the output grid; - is standard output; FILE.csv.gz is "
                 "compressed");
  a.table.add_to(run_command);
  apps::add_path(run_command, "--incidents", a.incidents,
                 "Write the incidents as CSV: trucks off the rails, broken couplers, impacts; - is standard output");
  apps::add_path(run_command, "--bag", a.bag, "Record what the node would publish; a folder: named by date");
  apps::add_path(run_command, "--html", a.html,
                 "Write one page that replays the run in any browser, without a network (docs/replay_page.md)");
  apps::add_path(run_command, "--checkpoint", a.checkpoint,
                 "Save the run at --checkpoint-time, to go on from there later; only with solver.method semi_implicit");
  run_command->add_option(
      "--checkpoint-time", a.checkpoint_time,
      "When, as in \"5 s\": at the first point of the output grid from then on; default: at the end");
  apps::add_path(
      run_command, "--from", a.from,
      "Go on from what --checkpoint has saved: bit for bit the same run, or with other inputs from there on");
  apps::add_force(run_command, a.force);
  apps::add_count(run_command, "--seeds", a.seeds, study::kSeeds,
                  "Compute this many runs that differ by their seed (initial.perturbation): medians and ranges; "
                  "--csv then writes one row for each run");
  apps::add_jobs(run_command, a.jobs, "Threads of --seeds; default: one for each core");
  run_command->add_flag("--quiet", a.quiet, "No progress and no table");
  CLI::App* check_command =
      app.add_subcommand("check", "Validate a scenario and print it in SI, all defaults filled in");
  add_inputs(check_command);
  CLI::App* keys_command = app.add_subcommand("keys", "List every key: allowed values, default, meaning");
  CLI::App* fields_command =
      app.add_subcommand("fields", "List all that comes out: name, unit, meaning (docs/outcomes.md)");

  std::function<int()> further_command;
  apps::add_study_commands(app, further_command);
  apps::add_validate_command(app, further_command);
  apps::add_verify_command(app, further_command);
  apps::add_import_command(app, further_command);
  apps::add_replay_command(app, further_command);

  app.failure_message(one_line);
  try {
    app.parse(argc, argv);
    if (*run_command) return run(a);
    if (*check_command) return check(a);
    if (further_command) return further_command();
    if (*keys_command) std::cout << inputs::describe_keys();
    if (*fields_command) std::cout << describe_fields();
    return apps::kOk;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? apps::kOk : apps::kInputWrong;
  } catch (const inputs::InputError& e) {
    std::cerr << "derail: " << told(e) << "\n";
    return apps::kInputWrong;
  } catch (const files::ExistsError& e) {
    std::cerr << "derail: " << e.what() << "; --force replaces it\n";
    return apps::kOutputFailed;
  } catch (const std::exception& e) {
    std::cerr << "derail: " << e.what() << "\n";
    return apps::kOutputFailed;
  }
}

/// Opens /dev/null for each standard stream that is closed. Otherwise the next file to be opened would get its number,
/// and printed tables would be written into it.
void occupy_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    const int useless = fd == STDIN_FILENO
                            ? O_WRONLY
                            : O_RDONLY;  // opened the wrong way round, so that reading or writing is still an error
    if (fcntl(fd, F_GETFD) < 0) static_cast<void>(open("/dev/null", useless));
  }
}

}  // namespace

int main(int argc, char** argv) {
  occupy_standard_streams();
  const int code = command_line(argc, argv);
  try {
    files::check_standard_output();
  } catch (const std::exception& e) {
    std::cerr << "derail: " << e.what() << "\n";
    return code == apps::kOk ? apps::kOutputFailed : code;
  }
  return code;
}
