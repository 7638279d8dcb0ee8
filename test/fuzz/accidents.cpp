// A table of accidents.
#include "train_derail/validation/accidents.hpp"
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const inputs::Scenario base = inputs::read_scenario_file(FUZZ_SOURCE_DIR "/../../config/accident.yaml");
  const std::filesystem::path path = fuzz::folder() / "table.csv";
  fuzz::write(path, fuzz::text_of(data, size));
  fuzz::may_refuse<std::runtime_error>([&] {
    const validation::AccidentTable table = validation::read_accidents(path.string());
    for (std::size_t i = 0; i < std::min<std::size_t>(table.rows.size(), 20); ++i)
      fuzz::may_refuse<inputs::InputError>([&] { inputs::validate(validation::scenario_of(base, table.rows[i])); });
  });
  return 0;
}
