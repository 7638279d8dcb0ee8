// Command line of the simulator: the same core as the node, without ROS.
#include <cmath>
#include <fstream>
#include <iostream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "bag_output.hpp"
#include "progress.hpp"
#include "study_commands.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/incidents_csv.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"
#include "validate_command.hpp"
#include "verify_command.hpp"

namespace {

using namespace train_derail;

constexpr int kOk = 0, kOutputFailed = 1, kInputWrong = 2, kIntegrationFailed = 3;

struct Arguments {
  std::string file, json, csv, incidents, bag;
  std::vector<std::string> set;
  bool quiet = false;
};

inputs::Scenario read(const Arguments& a) {
  std::vector<inputs::Override> overrides;
  for (const std::string& text : a.set) overrides.push_back(inputs::parse_override(text));
  return inputs::read_scenario_file(a.file, overrides);
}

std::ofstream open(const std::string& path) {
  std::ofstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be written");
  return file;
}

void close(std::ofstream& file, const std::string& path) {
  file.close();
  if (!file) throw std::runtime_error(path + ": could not be written whole");
}

/// How far the train has come to rest; the only measure of progress that needs no guess of the stopping time.
double progress_of(const simulation::Simulation& s) {
  const double v0 = s.scenario().initial.speed;
  const auto q = model::motion(s.state().data(), static_cast<Eigen::Index>(s.cars().size()));
  const double v = (q.col(model::VX).square() + q.col(model::VY).square()).sqrt().mean();
  const double by_speed = v0 > 0.0 ? 1.0 - v / v0 : 0.0;
  return std::min(std::max(by_speed, s.time() / s.scenario().stop.time_max), 1.0);
}

int run(const Arguments& a) {
  const inputs::Scenario scenario = read(a);
  // Outputs are opened first: an unwritable path is said before the computing, not after it.
  std::ofstream csv, incidents, json;
  if (!a.csv.empty()) csv = open(a.csv);
  if (!a.incidents.empty()) incidents = open(a.incidents);
  if (!a.json.empty() && a.json != "-") json = open(a.json);

  simulation::Simulation simulation(scenario);
  std::unique_ptr<apps::BagOutput> bag;
  if (!a.bag.empty()) bag = apps::open_bag(a.bag, simulation);
  {
    apps::Progress progress(!a.quiet);
    if (!progress.shown() && !csv.is_open() && !bag) simulation.run();  // nobody looks on
    if (csv.is_open()) {
      simulation::write_csv_header(csv);
      simulation::write_csv_rows(csv, simulation.snapshot());
    }
    for (std::int64_t tick = 1; !simulation.ended(); ++tick) {
      const double before = simulation.time();
      simulation.advance(static_cast<double>(tick) * scenario.output.interval);
      if (simulation.time() > before) {
        if (csv.is_open()) simulation::write_csv_rows(csv, simulation.snapshot());
        if (bag) bag->grid_point(simulation);
      }
      progress.update(progress_of(simulation), fmt::format("{:.1f} s simulated", simulation.time()));
    }
  }

  const outcome::Outcome outcome = simulation.outcome();
  if (csv.is_open()) close(csv, a.csv);
  if (incidents.is_open()) {
    outcome::write_incidents_csv(incidents, simulation.incidents());
    close(incidents, a.incidents);
  }
  if (bag) bag->close(simulation);
  if (a.json == "-") {
    std::cout << outcome::to_json(outcome) << "\n";
  } else if (json.is_open()) {
    json << outcome::to_json(outcome) << "\n";
    close(json, a.json);
  }
  if (!a.quiet && a.json != "-") {
    std::cout << (scenario.title.empty() ? a.file : scenario.title) << "\n" << outcome::to_table(outcome);
  }
  std::cout.flush();
  if (!std::cout) throw std::runtime_error("standard output: could not be written whole");
  if (outcome.ended == outcome::Ended::integration_failed) {
    std::cerr << "derail: integration failed: " << outcome.message << "\n";
    return kIntegrationFailed;
  }
  return kOk;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Simulates how a train derails: planar equations of motion of Jeong, Lyons, Orringer and Perlman (2007).\n\n"
      "  derail run config/baseline.yaml                                  the paper's baseline: table of the outcome\n"
      "  derail run config/baseline.yaml --set \"initial.speed=55.5 mph\"   the same, faster\n"
      "  derail run config/baseline.yaml --json - --csv states.csv        for programs: outcome, states over time\n"
      "  derail check my_train.yaml                                       what is understood, in SI, defaults filled in\n"
      "  derail keys                                                      every key of a scenario file\n"
      "  derail study config/studies/paper_sensitivity.yaml --out results  many runs: medians, ranges, tables\n"
      "  derail validate accidents.csv --study config/studies/accident_validation.yaml   against real accidents\n"
      "  derail verify config/baseline.yaml                               a general multibody engine's second opinion\n\n"
      "A long train is chaotic: one run is one draw. Compare ensembles (initial.perturbation), not single runs.\n"
      "Exit codes: 0 done, 1 output could not be written, 2 something is wrong with the input, 3 integration failed,\n"
      "4 derail verify: the two engines differ.",
      "derail"};
  app.set_version_flag("--version", "train_derail " TRAIN_DERAIL_VERSION, "Print the version and exit");
  app.require_subcommand(1);
  app.fallthrough();

  Arguments a;
  const auto add_inputs = [&a](CLI::App* command) {
    command->add_option("FILE", a.file, "Scenario, YAML (keys: derail keys)")->required();
    command->add_option("--set", a.set, "Change an input: key=value, as in \"consist[0].weight=286 kip\"; may be repeated")
        ->allow_extra_args(false);
  };
  CLI::App* run_command = app.add_subcommand("run", "Run one scenario to its end");
  add_inputs(run_command);
  run_command->add_option("--json", a.json, "Write the outcome as JSON in SI units; - is standard output");
  run_command->add_option("--csv", a.csv, "Write the states of cars and couplers on the output grid");
  run_command->add_option("--incidents", a.incidents, "Write what happened: trucks off the rails, broken couplers, impacts (CSV)");
  run_command->add_option("--bag", a.bag, "Record what the node would publish; a folder: named by date");
  run_command->add_flag("--quiet", a.quiet, "No progress and no table");
  CLI::App* check_command = app.add_subcommand("check", "Validate a scenario and print it in SI, all defaults filled in");
  add_inputs(check_command);
  CLI::App* keys_command = app.add_subcommand("keys", "List every key: allowed values, default, meaning");

  std::function<int()> further_command;
  apps::add_study_commands(app, further_command);
  apps::add_validate_command(app, further_command);
  apps::add_verify_command(app, further_command);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kOk : kInputWrong;
  }

  try {
    if (*run_command) return run(a);
    if (*check_command) std::cout << inputs::to_yaml(read(a));
    if (further_command) return further_command();
    if (*keys_command) std::cout << inputs::describe_keys();
    return kOk;
  } catch (const inputs::InputError& e) {
    std::cerr << "derail: " << e.what() << "\n";
    return kInputWrong;
  } catch (const std::exception& e) {
    std::cerr << "derail: " << e.what() << "\n";
    return kOutputFailed;
  }
}
