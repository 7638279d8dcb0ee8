#include "train_derail/files/near_misses.hpp"

#include <algorithm>

#include "train_derail/files/text.hpp"

namespace train_derail::files {

bool one_slip(std::string_view a, std::string_view b) {
  const auto same = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  a.remove_prefix(static_cast<std::size_t>(same.first - a.begin()));
  b.remove_prefix(static_cast<std::size_t>(same.second - b.begin()));
  const auto rest = [](std::string_view s, std::size_t n) { return s.substr(std::min(n, s.size())); };
  const bool exchanged = a.size() >= 2 && b.size() >= 2 && a[0] == b[1] && a[1] == b[0] && rest(a, 2) == rest(b, 2);
  return exchanged || rest(a, 1) == rest(b, 1) || rest(a, 1) == b || a == rest(b, 1);
}

std::vector<std::string> near_misses(std::string_view written, const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 5, kPart = 3;  // shorter parts are in everything
  const std::string w = lower_case(written.substr(0, kShownMax));
  std::vector<std::string> near;
  for (const bool parts : {false, true}) {
    for (const std::string& name : names) {
      const std::string n = lower_case(name);
      const auto holds = [](const std::string& whole, const std::string& part) {
        return part.size() >= kPart && whole.find(part) != std::string::npos;
      };
      const bool is_near = parts ? holds(n, w) || holds(w, n) : n.size() > 1 && w.size() > 1 && one_slip(w, n);
      if (is_near && near.size() < kMost && std::find(near.begin(), near.end(), name) == near.end())
        near.push_back(name);
    }
  }
  return near;
}

}  // namespace train_derail::files
