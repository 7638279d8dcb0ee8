#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace train_derail::apps {

/// Adds `validate`. `command` is set to what has to be called after parsing; it returns the exit code.
void add_validate_command(CLI::App& app, std::function<int()>& command);

}  // namespace train_derail::apps
