#include "train_derail/study/counts.hpp"

#include <fmt/format.h>

#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::study {

int count(const Bounds& bounds, const std::string& where, const std::string& key, const std::string& text) {
  const auto refuse = [&](const char* problem) {
    throw inputs::InputError(where, key, text, problem,
                             fmt::format("a whole number from {} to {}", bounds.least, bounds.most));
  };
  const auto number = files::number<int>(text);
  // More digits than an int holds are out of range, too.
  const bool digits =
      !text.empty() && text.find_first_not_of("0123456789", text[0] == '-' ? 1 : 0) == std::string::npos;
  if (!number && (!digits || text == "-")) refuse("not a whole number");
  if (!number || *number < bounds.least || *number > bounds.most) refuse("out of range");
  return *number;
}

}  // namespace train_derail::study
