#include "study/warnings.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace train_derail::study {

namespace {

constexpr std::string_view kBetween = " | ";
constexpr std::size_t kKindsMax = 100;

/// Returns a text with each number replaced by #; "1.2e-05" is one number.
std::string kind_of(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789";
  std::string kind;
  for (std::size_t i = 0; i < text.size();) {
    if (kDigits.find(text[i]) == std::string_view::npos) {
      kind += text[i++];
      continue;
    }
    i = std::min(text.find_first_not_of("0123456789.e+-", i), text.size());
    kind += '#';
  }
  return kind;
}

}  // namespace

std::string warnings_field(const std::vector<std::string>& warnings) {
  std::string field;
  for (const std::string& w : warnings) field += (field.empty() ? "" : std::string(kBetween)) + w;
  return field;
}

void WarningCount::add(const std::string& field) {
  ++added_;
  for (std::size_t begin = 0; begin < field.size();) {
    const std::size_t end = std::min(field.find(kBetween, begin), field.size());
    const std::string text = field.substr(begin, end - begin);
    begin = end + kBetween.size();
    const auto [place, fresh] = kinds_.try_emplace(kind_of(text), found_.size());
    if (fresh && found_.size() < kKindsMax) found_.push_back({text, 0, 0});
    if (place->second >= found_.size()) continue;
    Found& found = found_[place->second];
    if (found.last != added_) ++found.runs;
    found.last = added_;
  }
}

std::vector<std::string> WarningCount::texts(std::int64_t runs) const {
  std::vector<std::string> texts;
  for (const Found& f : found_) texts.push_back(fmt::format("{} of {} runs: {}", f.runs, runs, f.text));
  return texts;
}

}  // namespace train_derail::study
