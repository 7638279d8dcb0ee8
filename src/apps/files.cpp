#include "files.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "train_derail/inputs/error.hpp"

namespace train_derail::apps {

namespace fs = std::filesystem;
using inputs::InputError;

void require_apart(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto refuse = [&](const NamedPath& other) {
      throw InputError("command line", outputs[i].option, outputs[i].path, "is the same file as " + other.option,
                       "another file");
    };
    for (const NamedPath& input : inputs) {
      if (files::same_file(outputs[i].path, input.path)) refuse(input);
    }
    for (std::size_t j = 0; j < i; ++j) {
      if (files::same_file(outputs[i].path, outputs[j].path)) refuse(outputs[j]);
    }
  }
}

NewFolder::NewFolder(const std::string& path) {
  std::vector<fs::path> missing;
  std::error_code error;
  for (fs::path p = fs::absolute(path).lexically_normal(); !fs::exists(p, error) && p.has_relative_path();
       p = p.parent_path()) {
    if (p.has_filename()) missing.push_back(p);
  }
  for (auto p = missing.rbegin(); p != missing.rend(); ++p) {
    if (fs::create_directory(*p, error)) made_.push_back(p->string());
    if (error) break;
  }
  if (!error && !fs::is_directory(path)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw std::runtime_error(path + ": cannot be written: " + error.message());
}

NewFolder::~NewFolder() {
  for (auto p = made_.rbegin(); p != made_.rend() && rmdir(p->c_str()) == 0; ++p) {
  }
}

CLI::Option* add_force(CLI::App* command, bool& force) {
  return command->add_flag("--force", force, "Replace files that exist already");
}

}  // namespace train_derail::apps
