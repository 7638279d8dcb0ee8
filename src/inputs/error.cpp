#include "train_derail/inputs/error.hpp"

#include <utility>

namespace train_derail::inputs {

namespace {

std::string compose(const std::string& where, const std::string& key, const std::string& value,
                    const std::string& problem, const std::string& allowed) {
  std::string text = printable(where) + ": ";
  if (!key.empty()) text += printable(key, kShownMax);
  if (!value.empty()) text += (key.empty() ? "'" : " = '") + printable(value, kShownMax) + "'";
  if (!key.empty() || !value.empty()) text += ": ";
  text += printable(problem);
  if (!allowed.empty()) text += "; allowed: " + printable(allowed);
  return text;
}

std::string compose(const std::string& where, const std::string& problem, const std::vector<InputError>& each) {
  std::string text = printable(where) + ": " + printable(problem);
  for (const InputError& e : each) text += std::string("\n  ") + e.what();
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

InputError::InputError(std::string where, std::string problem, const std::vector<InputError>& each)
    : std::runtime_error(compose(where, problem, each)), where_(std::move(where)), problem_(std::move(problem)) {}

}  // namespace train_derail::inputs
