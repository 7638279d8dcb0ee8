#include "train_derail/inputs/error.hpp"

#include <utility>

namespace train_derail::inputs {

namespace {

std::string compose(const std::string& where, const std::string& key, const std::string& value,
                    const std::string& problem, const std::string& allowed) {
  std::string text = where + ": ";
  if (!key.empty()) text += key;
  if (!value.empty()) text += (key.empty() ? "'" : " = '") + value + "'";
  if (!key.empty() || !value.empty()) text += ": ";
  text += problem;
  if (!allowed.empty()) text += "; allowed: " + allowed;
  return text;
}

}  // namespace

InputError::InputError(std::string where, std::string key, std::string value, std::string problem, std::string allowed)
    : std::runtime_error(compose(where, key, value, problem, allowed)),
      where_(std::move(where)),
      key_(std::move(key)),
      value_(std::move(value)),
      problem_(std::move(problem)),
      allowed_(std::move(allowed)) {}

}  // namespace train_derail::inputs
