#include "study/json_file.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;

void wrong_json(const std::string& path, const std::string& made_by, const std::string& problem) {
  throw inputs::InputError(path, "", "", problem + "; " + made_by + " writes it", "");
}

nlohmann::ordered_json read_json(const std::string& path, const std::string& made_by) {
  constexpr std::uintmax_t kSizeMax = 64U << 20U;
  constexpr int kDepthMax = 20;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) wrong_json(path, made_by, "missing");
  if (!fs::is_regular_file(status)) wrong_json(path, made_by, "not a plain file");
  std::ifstream file(path, std::ios::binary);
  if (!file) wrong_json(path, made_by, "cannot be read");
  if (fs::file_size(path, error) > kSizeMax) wrong_json(path, made_by, fmt::format("larger than {} bytes", kSizeMax));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  struct TooDeep {};
  try {
    return nlohmann::ordered_json::parse(text,
                                         [](int depth, nlohmann::ordered_json::parse_event_t, nlohmann::ordered_json&) {
                                           if (depth > kDepthMax) throw TooDeep{};
                                           return true;
                                         });
  } catch (const TooDeep&) {
    wrong_json(path, made_by, fmt::format("nested more than {} deep", kDepthMax));
  } catch (const nlohmann::json::parse_error& e) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(e.byte, text.size()));
    wrong_json(fmt::format("{}:{}", path, 1 + std::count(text.begin(), end, '\n')), made_by, "not JSON");
  } catch (const nlohmann::json::exception&) {  // a number that is too large
    wrong_json(path, made_by, "not JSON");
  }
}

}  // namespace train_derail::study
