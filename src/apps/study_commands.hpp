#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace train_derail::apps {

/// Adds `study`, `merge` and `report`. `command` is set to what has to be called after parsing; it returns the exit
/// code.
void add_study_commands(CLI::App& app, std::function<int()>& command);

}  // namespace train_derail::apps
