/// \file
/// derail import: train lists become scenarios.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace train_derail::apps {

/// Adds the command; `chosen` is set to what it does if it is chosen.
void add_import_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace train_derail::apps
