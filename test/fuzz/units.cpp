// A number with its unit.
#include <cmath>

#include "fuzz.hpp"
#include "train_derail/inputs/units.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  for (const char* unit : {"m", "m/s", "N", "kg m^2", "rad", "1", "Pa"}) {
    fuzz::may_refuse<std::invalid_argument>(
        [&] { fuzz::expect(!std::isnan(inputs::to_si(text, unit)), "not a number: " + text); });
  }
  fuzz::may_refuse<std::invalid_argument>([&] { inputs::from_si(1.0, "m", text); });
  return 0;
}
