#include "import_command.hpp"

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include "files.hpp"
#include "import_terrain.hpp"
#include "import_track.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/train_list.hpp"

namespace train_derail::apps {

namespace {

namespace fs = std::filesystem;

struct ConsistArguments {
  std::string file, out = "-";
  std::optional<std::string> types, base;
  bool force = false;
};

inputs::CarTypes types_of(const std::optional<std::string>& path) {
  return path ? inputs::car_types(*path) : inputs::car_types();
}

int import_consist(const ConsistArguments& a) {
  std::vector<NamedPath> read{{"TRAIN.csv", a.file}};
  if (a.types) read.push_back({"--types", *a.types});
  if (a.base) read.push_back({"--base", *a.base});
  require_apart(read, {{"--out", a.out}});
  const inputs::CarTypes types = types_of(a.types);
  double coupler_length = inputs::Coupler{}.length;
  if (a.base) {
    const std::string folder = fs::path(*a.base).parent_path().string();
    coupler_length = inputs::coupler_length(inputs::layers(inputs::load_file(*a.base), *a.base, folder), *a.base);
  }
  inputs::TrainList train = inputs::read_train_list(a.file, types, coupler_length);
  const std::string text = inputs::to_scenario(train, a.file, a.base ? seen_from(a.out, *a.base) : "");
  files::write_file(a.out, text, existing(a.force));
  say_assumptions("assumed, as the comments in the file say:", train.assumptions);
  return 0;
}

}  // namespace

std::string seen_from(const std::string& file, const std::string& other) {
  if (file == "-") return other;
  // By the names alone, as the reader of scenarios does it: links are not followed.
  const fs::path folder = fs::absolute(file).lexically_normal().parent_path();
  return fs::absolute(other).lexically_normal().lexically_relative(folder).string();
}

void say_assumptions(const std::string& heading, const std::vector<std::string>& assumptions) {
  std::cerr << "derail: " << heading << "\n";
  for (const std::string& a : assumptions) std::cerr << "  " << files::printable(a) << "\n";
}

void add_import_command(CLI::App& app, std::function<int()>& chosen) {
  CLI::App* command =
      app.add_subcommand("import", "Make a scenario of a train list, of a track file or of a map of heights");
  command->require_subcommand(1);

  auto consist = std::make_shared<ConsistArguments>();
  CLI::App* consist_command =
      command->add_subcommand("consist", "A table with one row a car (docs/import.md) becomes blocks of a scenario");
  add_path(consist_command, "TRAIN.csv", consist->file, "Table of the cars, the foremost first")->required();
  add_path(consist_command, "-o,--out", consist->out, "Scenario to be written; default: standard output");
  add_path(consist_command, "--types", consist->types,
           "Car types of your own, of the form of config/types/car_types.yaml");
  add_path(consist_command, "--base", consist->base, "Scenario for all but the consist, as config/accident.yaml");
  add_force(consist_command, consist->force);
  consist_command->callback([consist, &chosen] { chosen = [consist] { return import_consist(*consist); }; });

  add_import_track(command, chosen);
  add_import_terrain(command, chosen);

  auto types = std::make_shared<std::optional<std::string>>();
  CLI::App* types_command =
      command->add_subcommand("types", "List columns, units, car types and couplers of train lists");
  add_path(types_command, "--types", *types, "Car types of your own");
  types_command->callback([types, &chosen] {
    chosen = [types] {
      std::cout << inputs::describe_train_lists(types_of(*types));
      return 0;
    };
  });
}

}  // namespace train_derail::apps
