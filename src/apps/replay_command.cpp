#include "replay_command.hpp"

#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bag_input.hpp"
#include "exit_codes.hpp"
#include "files.hpp"
#include "interrupt.hpp"
#include "kept_run.hpp"
#include "page.hpp"
#include "progress.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/scene/replay.hpp"
#include "train_derail/simulation/output_grid.hpp"
#include "train_derail/study/members.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;

struct ReplayArguments {
  std::string what, html;
  std::optional<int> run;
  study::MemberChoice choice;
  bool force = false, quiet = false;
};

/// Names the first option that is given but does not go with what is replayed.
void refuse(const std::vector<std::pair<const char*, bool>>& options, const std::string& what,
            const std::string& with) {
  for (const auto& [option, given] : options) {
    if (given) throw inputs::InputError("command line", option, "", "does not go with " + what, "with " + with);
  }
}

std::string page_of_bag(const ReplayArguments& a) {
  refuse({{"--outcome", a.choice.outcome.has_value()}, {"--point", a.choice.point.has_value()}}, "a bag",
         "the results of a study");
  const files::Recognised r = files::recognise(a.what);
  if (r.kind != files::FileKind::unknown && r.kind != files::FileKind::other) {
    throw inputs::InputError(a.what, "", "", "is " + r.what + (r.hint.empty() ? "" : " (" + r.hint + ")"),
                             "a bag, or a folder with the results of derail study");
  }
  const std::vector<std::string> runs =
      read_bag(a.what, static_cast<std::uint32_t>(a.run.value_or(0)), fs::path(a.what).filename().string());
  return scene::page_document({fs::path(a.what).filename().string(), {}}, runs);
}

/// Computes a member again; nothing if it was interrupted.
std::optional<std::string> document_of(const study::Members& all, const study::Member& member, ProgressLine& progress) {
  simulation::Simulation simulation(member.scenario);
  KeptRun kept(simulation);
  for (simulation::OutputGrid grid(simulation); !simulation.ended() && !stop;) {
    if (grid.advance(&stop)) kept.add(simulation);
    progress.update(simulation.time() / member.scenario.stop.time_max,
                    fmt::format("run {}: {:.1f} s simulated", member.run, simulation.time()));
  }
  if (stop) return std::nullopt;
  const outcome::Outcome outcome = simulation.outcome();
  study::require_same(all, member, outcome);
  return kept.document({all.title, member.caption}, simulation, outcome);
}

std::optional<std::string> page_of_study(const ReplayArguments& a) {
  refuse({{"--run", a.run.has_value()}}, "the results of a study", "a bag");
  expect(files::FileKind::study_results, a.what);
  const study::Members members = study::typical_members(a.what, a.choice);
  std::vector<std::string> runs;
  ProgressLine progress(!a.quiet);
  for (const study::Member& member : members.members) {
    const auto document = document_of(members, member, progress);
    if (!document) return std::nullopt;
    runs.push_back(*document);
  }
  return scene::page_document({members.title, {members.chosen}}, runs);
}

int replay(const ReplayArguments& a) {
  require_apart({{"WHAT", a.what}}, {{"--html", a.html}});
  require_page_maker("replay");
  stop_on_signals();
  files::OutputFile page(a.html, existing(a.force), &stop);
  const std::optional<std::string> document =
      fs::is_directory(a.what) ? page_of_study(a) : std::optional(page_of_bag(a));
  if (!document) {
    std::cerr << "derail: interrupted; no page was written\n";
    return kInterrupted;
  }
  page.stream() << make_page("replay", *document);
  page.commit();
  if (!a.quiet && !files::same_file(a.html, "-")) std::cout << a.html << "\n";
  return 0;
}

}  // namespace

void add_replay_command(CLI::App& app, std::function<int()>& chosen) {
  const auto arguments = std::make_shared<ReplayArguments>();
  ReplayArguments& a = *arguments;
  CLI::App* command = app.add_subcommand(
      "replay", "Write a page that replays the runs of a bag, or a small, a median and a large run of a study");
  add_path(command, "WHAT", a.what, "Bag of the node or of derail run --bag; or folder of the results of derail study")
      ->required();
  add_path(command, "--html", a.html, "File of the page; - is standard output")->required();
  command->add_option("--run", a.run, "Of a bag: the run of this number; default: all of them in one page")
      ->check(CLI::Range(1, 1000000000));
  command->add_option("--outcome", a.choice.outcome,
                      "Of a study: what the runs are chosen by; default: the first outcome of the study");
  command
      ->add_option("--point", a.choice.point,
                   "Of a study: the point whose runs are chosen from, a number in runs.csv; default: all points of a "
                   "random plan, else the first one")
      ->check(CLI::NonNegativeNumber);
  add_force(command, a.force);
  command->add_flag("--quiet", a.quiet, "No progress, and not the path of the page");
  command->callback([arguments, &chosen] { chosen = [arguments] { return replay(*arguments); }; });
}

}  // namespace train_derail::apps
