#pragma once

#include <stdexcept>
#include <string>

namespace train_derail::inputs {

/// A mistake in an input, said so that it can be mended: where, which key, what stands there, what may.
class InputError : public std::runtime_error {
 public:
  InputError(std::string where, std::string key, std::string value, std::string problem, std::string allowed);

  const std::string& where() const { return where_; }      // "file:line", "--set", or a parameter's full name
  const std::string& key() const { return key_; }          // "coupler.slack", "consist[0].count"
  const std::string& value() const { return value_; }      // as written; empty if there is none
  const std::string& problem() const { return problem_; }
  const std::string& allowed() const { return allowed_; }  // range, choices or keys; empty if not applicable

 private:
  std::string where_, key_, value_, problem_, allowed_;
};

}  // namespace train_derail::inputs
