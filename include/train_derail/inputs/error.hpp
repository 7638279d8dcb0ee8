/// \file
/// The error that reports a wrong input.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "train_derail/files/text.hpp"

namespace train_derail::inputs {

/// A mistake in an input, with all that is needed to correct it: where it is, which key, its value, what is wrong and
/// what is allowed. what() is one line of text, or one line for each of several mistakes. It is safe to print: control
/// characters are escaped, long keys and values are cut.
class InputError : public std::runtime_error {
 public:
  /// One mistake; the arguments are explained at the functions of the same names.
  InputError(std::string where, std::string key, std::string value, std::string problem, std::string allowed);
  /// Several mistakes in one file: `problem` sums them up in the first line, then each has a line.
  InputError(std::string where, std::string problem, const std::vector<InputError>& each);

  /// Where the mistake is: "file:line", "--set", or the full name of a ROS parameter.
  const std::string& where() const { return where_; }
  /// Key of the input, "coupler.slack", "consist[0].count"; empty if no single key is meant.
  const std::string& key() const { return key_; }
  /// Value as it was written; empty if there is none.
  const std::string& value() const { return value_; }
  /// What is wrong.
  const std::string& problem() const { return problem_; }
  /// What is allowed: a range, choices or keys; empty if there is nothing to say.
  const std::string& allowed() const { return allowed_; }

 private:
  std::string where_, key_, value_, problem_, allowed_;
};

using files::kShownMax;
using files::printable;

}  // namespace train_derail::inputs
