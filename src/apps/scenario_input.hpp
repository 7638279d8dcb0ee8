/// \file
/// Shared by the commands that read a scenario.
#pragma once

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"

namespace train_derail::apps {

/// Splits the texts of --set. Throws InputError.
inline std::vector<inputs::Override> overrides(const std::vector<std::string>& texts) {
  std::vector<inputs::Override> all;
  for (const std::string& text : texts) all.push_back(inputs::parse_override(text));
  return all;
}

/// Prints the warnings about a scenario and its changed inputs on standard error, one line each, without those in
/// `said_elsewhere`.
inline void say_warnings(const inputs::Scenario& scenario, const std::vector<inputs::Override>& given,
                         const std::vector<std::string>& said_elsewhere = {}) {
  for (const inputs::Warning& w : inputs::warnings(scenario, given)) {
    const std::string text = inputs::to_string(w);
    if (std::find(said_elsewhere.begin(), said_elsewhere.end(), text) == said_elsewhere.end())
      std::cerr << "derail: warning: " << text << "\n";
  }
}

}  // namespace train_derail::apps
