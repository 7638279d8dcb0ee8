/// \file
/// Options that say how many.
#pragma once

#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "train_derail/study/counts.hpp"

namespace train_derail::apps {

/// Adds an option that takes a whole number within bounds; it throws inputs::InputError for others.
inline CLI::Option* add_count(CLI::App* command, const std::string& option, int& value, const study::Bounds& bounds,
                              const std::string& meaning) {
  return command
      ->add_option_function<std::string>(
          option,
          [&value, option, bounds](const std::string& text) {
            value = study::count(bounds, "command line", option, text);
          },
          meaning)
      ->type_name(fmt::format("{} to {}", bounds.least, bounds.most));
}

/// Adds the option of the commands that compute on several cores.
inline CLI::Option* add_jobs(CLI::App* command, int& jobs,
                             const std::string& meaning = "Threads; default: one for each core") {
  return add_count(command, "--jobs", jobs, study::kJobs, meaning);
}

}  // namespace train_derail::apps
