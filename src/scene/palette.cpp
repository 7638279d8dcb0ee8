#include "train_derail/scene/palette.hpp"

#include <algorithm>

#include <fmt/ranges.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::scene {

Colours colours_of(const std::string& where, const std::string& key, const std::string& name) {
  const auto found = std::find(kColoursNames.begin(), kColoursNames.end(), name);
  if (found == kColoursNames.end())
    throw inputs::InputError(where, key, name, "no such colours", fmt::format("{}", fmt::join(kColoursNames, ", ")));
  return static_cast<Colours>(found - kColoursNames.begin());
}

}  // namespace train_derail::scene
