#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "train_derail/files/text.hpp"

namespace train_derail::inputs {

/// A mistake in an input, said so that it can be mended: where, which key, what stands there, what may.
/// what() is one line (of several mistakes: a line each) that can be printed: control characters are escaped, key and
/// value are cut.
class InputError : public std::runtime_error {
 public:
  InputError(std::string where, std::string key, std::string value, std::string problem, std::string allowed);
  /// Several mistakes of one file: a line that sums up, then a line each.
  InputError(std::string where, std::string problem, const std::vector<InputError>& each);

  const std::string& where() const { return where_; }  // "file:line", "--set", or a parameter's full name
  const std::string& key() const { return key_; }      // "coupler.slack", "consist[0].count"
  const std::string& value() const { return value_; }  // as written; empty if there is none
  const std::string& problem() const { return problem_; }
  const std::string& allowed() const { return allowed_; }  // range, choices or keys; empty if not applicable

 private:
  std::string where_, key_, value_, problem_, allowed_;
};

using files::kShownMax;
using files::printable;

}  // namespace train_derail::inputs
