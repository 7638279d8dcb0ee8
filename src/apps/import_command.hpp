/// \file
/// derail import: train lists and lines of tracks become scenarios.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace train_derail::apps {

/// How a file names another one: from its own folder, if it has one.
std::string seen_from(const std::string& file, const std::string& other);

/// Prints what was assumed on standard error, one line each.
void say_assumptions(const std::string& heading, const std::vector<std::string>& assumptions);

/// Adds the command; `chosen` is set to what it does if it is chosen.
void add_import_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace train_derail::apps
