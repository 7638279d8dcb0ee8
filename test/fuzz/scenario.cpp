// A scenario's file.
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"
#include "train_derail/inputs/writer.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::may_refuse<inputs::InputError>([&] {
    const inputs::Scenario scenario =
        inputs::read_scenario(inputs::load_text(fuzz::text_of(data, size), "input"), "input");
    for (const inputs::Warning& w : inputs::warnings(scenario)) fuzz::expect_readable(inputs::to_string(w));
    inputs::key_values(scenario);
    const std::string written = inputs::to_yaml(scenario);
    const std::string again = inputs::to_yaml(inputs::read_scenario(inputs::load_text(written, "written"), "written"));
    fuzz::expect(again == written, "another scenario is read than was written:\n" + written + again);
  });
  return 0;
}
