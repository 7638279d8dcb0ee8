// Paths of the command line: what they are, and what must not be written over.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "train_derail/files/output_file.hpp"
#include "train_derail/files/recognise.hpp"

namespace train_derail::apps {

/// A path and the option that gave it ("FILE", "--csv").
struct NamedPath {
  std::string option, path;
};

/// Throws inputs::InputError if an output is an input, or two outputs are one file.
void require_apart(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

/// Throws inputs::InputError if the path is recognised as something else: "PATH: is a study (derail study takes it);
/// allowed: a scenario". What is not recognised is left to its reader.
void expect(files::FileKind wanted, const std::string& path);

/// A folder that is removed again, with those made above it, if nothing has been put into it.
class NewFolder {
 public:
  /// Throws std::runtime_error.
  explicit NewFolder(const std::string& path);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

 private:
  std::vector<std::string> made_;  // the innermost last
};

/// An option that takes a path: not an empty one.
template <class Value>
CLI::Option* add_path(CLI::App* command, const std::string& name, Value& value, const std::string& meaning) {
  return command->add_option(name, value, meaning)->check([](const std::string& text) {
    return text.empty() ? std::string("an empty path") : std::string();
  });
}

CLI::Option* add_force(CLI::App* command, bool& force);

inline files::Existing existing(bool force) { return force ? files::Existing::replace : files::Existing::refuse; }

}  // namespace train_derail::apps
