/// \file
/// derail import track: a line of surveyed points becomes the track of a scenario.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace train_derail::apps {

/// Adds the command below `import`; `chosen` is set to what it does if it is chosen.
void add_import_track(CLI::App* import, std::function<int()>& chosen);

}  // namespace train_derail::apps
