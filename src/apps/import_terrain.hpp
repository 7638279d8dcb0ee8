#pragma once

#include <functional>

#include <CLI/CLI.hpp>

namespace train_derail::apps {

/// Adds the subcommand `terrain` of `derail import`.
void add_import_terrain(CLI::App* import, std::function<int()>& chosen);

}  // namespace train_derail::apps
