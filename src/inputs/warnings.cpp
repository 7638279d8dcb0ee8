#include "train_derail/inputs/warnings.hpp"

namespace train_derail::inputs {

std::string to_string(const Warning& w) {
  std::string text = w.key;
  if (!w.value.empty()) text += " = " + w.value;
  return text.empty() ? w.text : text + ": " + w.text;
}

std::vector<Warning> warnings(const Scenario&) { return {}; }

}  // namespace train_derail::inputs
