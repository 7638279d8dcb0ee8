/// \file
/// derail replay: pages of runs that were recorded, or that stand for a study.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace train_derail::apps {

/// Adds the command; `chosen` is set to what it does if it is chosen.
void add_replay_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace train_derail::apps
