/// \file
/// Paths on the command line: checks what they are, and that no input is overwritten.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "train_derail/files/output_file.hpp"
#include "train_derail/files/recognise.hpp"
#include "train_derail/inputs/expect.hpp"

namespace train_derail::apps {

/// A path and the option that gave it, "FILE" or "--csv".
struct NamedPath {
  std::string option, path;
};

/// Throws inputs::InputError if an output is the same file as an input or another output.
void require_apart(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

using inputs::expect;

/// Creates a folder, and removes it at the end of its life if it is empty, with the folders that were created above it.
class NewFolder {
 public:
  /// Throws std::runtime_error if the folder cannot be created.
  explicit NewFolder(const std::string& path);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

 private:
  std::vector<std::string> made_;  // folders that were created, the innermost last
};

/// Adds an option that takes a path and refuses an empty one.
template <class Value>
CLI::Option* add_path(CLI::App* command, const std::string& name, Value& value, const std::string& meaning) {
  return command->add_option(name, value, meaning)->check([](const std::string& text) {
    return text.empty() ? std::string("an empty path") : std::string();
  });
}

CLI::Option* add_force(CLI::App* command, bool& force);

inline files::Existing existing(bool force) { return force ? files::Existing::replace : files::Existing::refuse; }

}  // namespace train_derail::apps
