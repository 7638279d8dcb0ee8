/// \file
/// Reads JSON files of a results folder.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace train_derail::study {

/// Reads a JSON file. Throws inputs::InputError if it cannot be read, is not a regular file, is too large or nested too
/// deeply, or is not JSON (with the line). `made_by` says which command writes the file.
nlohmann::ordered_json read_json(const std::string& path, const std::string& made_by);

/// Calls use(), which reads entries of the JSON file `path`. If an entry is missing or has a wrong type, throws
/// inputs::InputError.
template <class Use>
auto checked_json(const std::string& path, const std::string& made_by, Use use);

[[noreturn]] void wrong_json(const std::string& path, const std::string& made_by, const std::string& problem);

template <class Use>
auto checked_json(const std::string& path, const std::string& made_by, Use use) {
  try {
    return use();
  } catch (const nlohmann::json::out_of_range&) {
    wrong_json(path, made_by, "an entry is missing");
  } catch (const nlohmann::json::type_error&) {
    wrong_json(path, made_by, "an entry has a wrong type");
  }
}

}  // namespace train_derail::study
