#include "study/html.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "train_derail/files/recognise.hpp"

namespace train_derail::study::html {

namespace fs = std::filesystem;

namespace {

constexpr const char* kStyle = R"(
body { font: 10pt/1.4 "DejaVu Sans", Verdana, sans-serif; color: #000; background: #fff; }
body { max-width: 60em; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; }
h2 { font-size: 1.15em; margin-top: 2em; border-bottom: 1px solid #000; }
h3 { font-size: 1em; margin-top: 1.5em; }
table { border-collapse: collapse; font-size: 0.85em; margin: 0.7em 0; }
th, td { text-align: left; vertical-align: top; padding: 0.2em 0.9em 0.2em 0; }
th, td { border-bottom: 1px solid #bbb; overflow-wrap: break-word; }
thead th { border-bottom: 1px solid #000; vertical-align: bottom; }
tbody th { font-weight: normal; }
.n { text-align: right; }
figure { margin: 1.2em 0; break-inside: avoid; } figcaption { font-size: 0.85em; margin-top: 0.3em; }
img { max-width: 100%; height: auto; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 9pt; } h2, h3 { break-after: avoid; }
tr { break-inside: avoid; } thead { display: table-header-group; } @page { margin: 18mm; } }
)";

/// Length in bytes of the UTF-8 character at `i`; 0 if none begins there.
std::size_t character(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u; };
  const unsigned lead = byte(i);
  const std::size_t length = lead < 0x80                   ? 1
                             : lead >= 0xc2 && lead < 0xe0 ? 2
                             : lead >= 0xe0 && lead < 0xf0 ? 3
                             : lead >= 0xf0 && lead < 0xf5 ? 4
                                                           : 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(i + k) & 0xc0) != 0x80) return 0;
  }
  return length;
}

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Replaces the five entities that XML knows by their characters.
std::string unescape(const std::string& text) {
  constexpr std::pair<std::string_view, char> kEntities[]{
      {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}};
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::string_view rest = std::string_view(text).substr(i);
    std::size_t used = 1;
    char c = text[i];
    for (const auto& [entity, meant] : kEntities) {
      if (rest.compare(0, entity.size(), entity) == 0) {
        used = entity.size();
        c = meant;
      }
    }
    out += c;
    i += used;
  }
  return out;
}

std::string title_of(const std::string& svg, const std::string& otherwise) {
  constexpr std::string_view kOpen = "<title>", kClose = "</title>";
  const std::size_t begin = svg.find(kOpen);
  const std::size_t end = begin == std::string::npos ? begin : svg.find(kClose, begin);
  if (end == std::string::npos) return otherwise;
  return unescape(svg.substr(begin + kOpen.size(), end - begin - kOpen.size()));
}

std::string cells(const char* tag, const std::vector<PageColumn>& columns, const std::vector<std::string>& texts) {
  std::string row = "<tr>";
  for (std::size_t i = 0; i < columns.size(); ++i) {
    row += fmt::format("<{}{}>{}</{}>", tag, columns[i].numeric ? " class=\"n\"" : "", escape(texts.at(i)), tag);
  }
  return row + "</tr>\n";
}

}  // namespace

std::string escape(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = character(text, i);
    const char c = text[i];
    const bool control = static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t';
    if (length == 0 || control) out += "\xEF\xBF\xBD";
    else if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out.append(text, i, length);
    i += length == 0 ? 1 : length;
  }
  return out;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= count ? kDigits[bits >> (18 - 6 * k) & 63u] : '=';
  }
  return out;
}

std::string table(const std::vector<PageColumn>& columns, const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::string> titles;
  for (const PageColumn& column : columns) titles.push_back(column.title);
  std::string out = "<table>\n<thead>" + cells("th", columns, titles) + "</thead>\n<tbody>\n";
  for (const auto& row : rows) out += cells("td", columns, row);
  return out + "</tbody>\n</table>\n";
}

std::string facts(const std::vector<std::pair<std::string, std::string>>& lines) {
  std::string out = "<table>\n<tbody>\n";
  for (const auto& [name, value] : lines) {
    out += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", escape(name), escape(value));
  }
  return out + "</tbody>\n</table>\n";
}

std::vector<std::string> pictures_in(const std::string& folder) {
  std::map<std::string, std::string> found;
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(folder, missing)) {
    const std::string kind = entry.path().extension().string();
    if (kind == ".svg") found[entry.path().stem().string()] = entry.path().string();
    else if (kind == ".png") found.try_emplace(entry.path().stem().string(), entry.path().string());
  }
  std::vector<std::string> paths;
  for (const auto& [stem, path] : found) paths.push_back(path);
  return paths;
}

std::string figure(const std::string& path) {
  const std::string bytes = read(path), stem = fs::path(path).stem().string();
  const bool svg = fs::path(path).extension() == ".svg";
  const std::string caption = escape(svg ? title_of(bytes, stem) : stem);
  return fmt::format(
      "<figure><img alt=\"{}\" src=\"data:image/{};base64,{}\" />\n"
      "<figcaption>{}</figcaption></figure>\n",
      caption, svg ? "svg+xml" : "png", base64(bytes), caption);
}

std::string page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n<title>{}</title>\n"
      "{}\n<style>{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
      escape(title), files::kReportMark, kStyle, body);
}

}  // namespace train_derail::study::html
