// Inputs changed by name: --set, ~set, ~restart. One key=value a line.
#include <sstream>

#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const YAML::Node tree = inputs::load_file(FUZZ_SOURCE_DIR "/../../config/accident.yaml");
  static const inputs::Scenario scenario = inputs::read_scenario(tree, "accident.yaml");
  std::vector<inputs::Override> overrides;
  std::istringstream lines(fuzz::text_of(data, size));
  for (std::string line; std::getline(lines, line);)
    fuzz::may_refuse<inputs::InputError>([&] { overrides.push_back(inputs::parse_override(line)); });
  fuzz::may_refuse<inputs::InputError>([&] { inputs::read_scenario(tree, "accident.yaml", overrides); });
  fuzz::may_refuse<inputs::InputError>([&] { inputs::with_values(scenario, overrides); });
  return 0;
}
