// JSON that lies in a folder of results.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace train_derail::study {

/// Throws inputs::InputError: cannot be read, no plain file, too large, nested too deeply, not JSON (with the line).
/// `made_by` says how to get it anew.
nlohmann::ordered_json read_json(const std::string& path, const std::string& made_by);

/// Runs use(); what is missing or of a wrong kind in JSON that `path` holds becomes an inputs::InputError.
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
