// What commands that take a scenario share.
#pragma once

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"

namespace train_derail::apps {

/// Throws InputError.
inline std::vector<inputs::Override> overrides(const std::vector<std::string>& texts) {
  std::vector<inputs::Override> all;
  for (const std::string& text : texts) all.push_back(inputs::parse_override(text));
  return all;
}

/// What is odd about a scenario, and what was given and has no effect: on standard error, a line each.
/// `said_elsewhere`: those that need not be said here.
inline void say_warnings(const inputs::Scenario& scenario, const std::vector<inputs::Override>& given,
                         const std::vector<std::string>& said_elsewhere = {}) {
  for (const inputs::Warning& w : inputs::warnings(scenario, given)) {
    const std::string text = inputs::to_string(w);
    if (std::find(said_elsewhere.begin(), said_elsewhere.end(), text) == said_elsewhere.end())
      std::cerr << "derail: warning: " << text << "\n";
  }
}

}  // namespace train_derail::apps
