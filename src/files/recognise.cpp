#include "train_derail/files/recognise.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <sstream>
#include <string_view>

#include "train_derail/files/text.hpp"

namespace train_derail::files {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLooked = 1 << 16;

struct Start {
  std::string_view bytes;
  const char* what;
  const char* hint;
};
constexpr std::array<Start, 9> kStarts{{{"#ROSBAG", "a bag of messages", "rosbag play takes it"},
                                        {"\x89PNG", "a picture", ""},
                                        {"\xff\xd8\xff", "a picture", ""},
                                        {"%PDF", "a PDF", ""},
                                        {"\x1f\x8b", "a compressed file", ""},
                                        {"PK\x03\x04", "a compressed file", ""},
                                        {"BZh", "a compressed file", ""},
                                        {"\xfd"
                                         "7zXZ",
                                         "a compressed file", ""},
                                        {"\x7f"
                                         "ELF",
                                         "a program", ""}}};

/// Tables that this program writes or reads, each with the names of two columns that only it has.
struct TableMark {
  FileKind kind;
  const char* what;
  const char* hint;
  std::array<const char*, 2> names;
};
constexpr std::array<TableMark, 10> kTables{{
    {FileKind::other,
     "a table of predicted accidents",
     "plot_validate.py takes its folder",
     {"cars_derailed", "predicted_median"}},
    {FileKind::accidents, "a table of accidents", "derail validate takes it", {"speed_mph", "cars_derailed"}},
    {FileKind::accidents,
     "a table of reports of accidents (form 6180.54)",
     "derail validate takes it",
     {"INCDTNO", "TRNSPD"}},
    {FileKind::accidents,
     "a table of posture in accidents",
     "derail validate takes it",
     {"on_side_or_over", "cars_in_train"}},
    {FileKind::other, "a table of the runs of a study", "derail report takes its folder", {"run", "replicate"}},
    {FileKind::other,
     "a table of the runs of a validation",
     "plot_validate.py takes its folder",
     {"member", "derailed_locomotives"}},
    {FileKind::other, "a table of the summary of a study", "derail report takes its folder", {"point", "median"}},
    {FileKind::other, "a table of the states of a run", "plot_run.py takes it", {"time_s", "car"}},
    {FileKind::other, "a table of the incidents of a run", "", {"time_s", "what"}},
    {FileKind::other,
     "a table of the differences of a verification",
     "plot_verify.py takes its folder",
     {"time_s", "position_m"}},
}};

bool has(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

/// Returns the first line that is neither empty, nor a comment, nor a YAML line "---".
std::string first_line(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto first = line.find_first_not_of(" \t\r\xef\xbb\xbf");
    if (first != std::string::npos && line[first] != '#' && line.compare(first, 3, "---") != 0)
      return line.substr(first);
  }
  return "";
}

Recognised table(const std::string& line) {
  std::string fields = ",";  // without quotes: ",time_s,car,"
  for (const char c : line) {
    if (c != '"' && c != '\r') fields += c;
  }
  fields += ',';
  const auto column = [&](const char* name) { return has(fields, std::string(",") + name + ","); };
  for (const TableMark& t : kTables) {
    if (column(t.names[0]) && column(t.names[1])) return {t.kind, t.what, t.hint};
  }
  return {FileKind::other, kTable, ""};
}

/// Whether the text has this key of YAML at the beginning of a line.
bool key(const std::string& text, std::string_view name) {
  for (std::size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    const std::size_t end = at + name.size();
    if ((at == 0 || text[at - 1] == '\n') && end < text.size() && text[end] == ':') return true;
  }
  return false;
}

/// Whether the text has one of these keys.
bool any_key(const std::string& text, std::initializer_list<std::string_view> names) {
  return std::any_of(names.begin(), names.end(), [&text](std::string_view name) { return key(text, name); });
}

Recognised document(const std::string& text) {
  const std::string line = first_line(text);
  if (line.empty()) {
    if (text.size() == kLooked) return {};  // the content may begin after the part that was read
    return {FileKind::other, text.empty() ? "an empty file" : "a file without content", ""};
  }
  const std::string start = lower_case(line.substr(0, 15));
  if (start.compare(0, 9, "<!doctype") == 0 || start.compare(0, 5, "<html") == 0) {
    return {FileKind::other, has(text, kReportMark) ? kReport : "a page of HTML", ""};
  }
  if (start.compare(0, 7, "<launch") == 0) return {FileKind::other, "a launch file", "roslaunch takes it"};
  if (start[0] == '<') return {FileKind::other, "a file of XML", ""};
  if (line[0] == '{') {
    if (has(text, "\"cars_past_pod\"")) return {FileKind::other, "a file of the outcome of a run (JSON)", ""};
    if (has(text, "\"plan\""))
      return {FileKind::other, "a description of a study (JSON)", "derail report takes its folder"};
    if (has(text, "\"interval\"") && has(text, "\"table\"")) {
      return {FileKind::other, "a file of the scores of a validation (JSON)", "plot_validate.py takes its folder"};
    }
    return {};
  }
  // The first line of a scenario or study always has a colon; a line with commas and without a colon is a table.
  const auto colon = line.find(':');
  if (std::count(line.begin(), line.end(), ',') >= 2 && colon == std::string::npos) return table(line);
  const Recognised scenario{FileKind::scenario, "a scenario", "derail run takes it"};
  if (key(text, "consist")) return scenario;
  if ((key(text, "causes") && key(text, "groups")) || (key(text, "base") && key(text, "studies"))) {
    return {FileKind::study, "a file of ways by cause", "derail validate takes it"};
  }
  if ((key(text, "scenario") || key(text, "base")) &&
      any_key(text, {"factors", "fitted_on", "plan", "samples", "spread", "replicates", "outcomes"}))
    return {FileKind::study, "a study", "derail study takes it"};
  // A scenario that changes another one may have any of its groups.
  if (key(text, "base") && any_key(text, {"model", "initial", "track", "terrain", "ground", "coupler", "brakes",
                                          "contact", "stop", "solver", "output", "outcome"}))
    return scenario;
  return {};
}

Recognised folder(const fs::path& path) {
  const auto there = [&](const char* name) {
    std::error_code error;
    return fs::exists(path / name, error);
  };
  if (there("rows.csv") || there("validation.json")) {
    return {FileKind::validation_results, "a folder with results of a validation", "plot_validate.py draws them"};
  }
  if (there("verify.json")) {
    return {FileKind::verification_results, "a folder with results of a verification", "plot_verify.py draws them"};
  }
  // study.json also describes the journal of a validation that was stopped.
  if (there("study.json")) {
    std::ifstream file(path / "study.json");
    std::string text(kLooked, '\0');
    file.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (has(text, "\"of each row\"")) {
      return {FileKind::validation_results, "a folder with results of a validation that was stopped",
              "derail validate --resume goes on"};
    }
    if (!there("runs.csv")) {
      return {FileKind::study_results, "a folder with results of a study that was stopped, or a shard",
              "derail study --resume goes on, derail merge joins shards"};
    }
    return {FileKind::study_results, "a folder with results of a study", "derail report takes it"};
  }
  return {FileKind::other, "a folder without results", ""};
}

}  // namespace

Recognised recognise(const std::string& path) {
  if (path == "-") return {FileKind::other, "standard input", "a file is needed"};
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error || !fs::exists(status)) return {};
  if (fs::is_directory(status)) return folder(path);
  if (fs::is_fifo(status) || fs::is_socket(status)) return {FileKind::other, "a pipe", "a file is needed"};
  if (!fs::is_regular_file(status)) return {FileKind::other, "a device", "a file is needed"};
  std::ifstream file(path, std::ios::binary);
  std::string text(kLooked, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (!file && !file.eof())) return {};
  text.resize(static_cast<std::size_t>(file.gcount()));
  for (const Start& s : kStarts) {
    if (text.compare(0, s.bytes.size(), s.bytes) == 0) return {FileKind::other, s.what, s.hint};
  }
  if (has(text, std::string_view("\0", 1))) return {FileKind::other, "a binary file", ""};
  return document(text);
}

}  // namespace train_derail::files
