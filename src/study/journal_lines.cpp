#include "study/journal_lines.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "study/results_folder.hpp"
#include "train_derail/files/checksum.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;

namespace {

constexpr int kFormat = 2;

[[noreturn]] void refuse(const std::string& where, const std::string& problem, const std::string& allowed = "") {
  throw inputs::InputError(where, "", "", problem, allowed);
}

/// Returns what is wrong with a line of a journal; "" if nothing is, then `row` holds its content.
std::string flaw_of(std::string_view line, const JournalFormat& format, const std::string& fingerprint,
                    JournalRow& row) {
  const std::size_t comma = line.rfind(',');
  if (comma == std::string_view::npos) return "no checksum";
  if (files::crc64_text(fingerprint, line.substr(0, comma)) != line.substr(comma + 1))
    return "the checksum does not fit the line";
  std::string problem;
  if (!files::csv_fields(line.substr(0, comma), row.fields, problem)) return problem;
  if (row.fields.size() != format.columns.size() + 1) {
    return fmt::format("{} fields, but {} columns", row.fields.size() + 1, format.columns.size() + 2);
  }
  problem = flaw_of_number("wall_time", row.fields.back());
  row.fields.pop_back();
  if (problem.empty()) problem = flaw_of_count(format.columns.front(), row.fields.front());
  if (problem.empty()) problem = format.flaw(row.fields);
  if (problem.empty()) row.run = std::stoll(row.fields.front());
  return problem;
}

/// Reads the next line; false at the end of the file. Lines longer than kRowMax are cut. `torn`: the file ends within a
/// line.
bool next_line(std::filebuf& file, std::string& line, std::uintmax_t& offset, bool& torn) {
  line.clear();
  for (int c = file.sbumpc(); c != std::char_traits<char>::eof(); c = file.sbumpc()) {
    ++offset;
    if (c == '\n') return true;
    if (line.size() < files::CsvReader::kRowMax) line += static_cast<char>(c);
  }
  torn = !line.empty();
  return false;
}

void require_this_journal(const std::string& path, const std::string& head, const JournalFormat& format) {
  if (head.compare(0, 4, "run,") == 0 && head.find("crc64 (journal ") == std::string::npos) {
    refuse(path + ":1", "a journal of version 0.1: its lines have no checksum, so mistakes in them cannot be found",
           "another folder, or remove this file and compute the runs again");
  }
  const std::string mark = "crc64 (journal ";
  const std::size_t place = head.find(mark);
  if (place == std::string::npos)
    refuse(path + ":1", "not a journal of this program", "another folder, or remove this file");
  if (head.compare(place + mark.size(), 2, fmt::format("{};", kFormat)) != 0) {
    refuse(path + ":1", "a journal of another format", fmt::format("format {}", kFormat));
  }
  if (head.find(fingerprint_of(format)) == std::string::npos) refuse(path + ":1", "a journal of another study");
  refuse(path + ":1", "a journal with other columns: of another version of the program");
}

}  // namespace

std::string fingerprint_of(const JournalFormat& format) { return files::crc64_text(format.identity); }

std::string head_of(const JournalFormat& format) {
  std::vector<std::string> names = format.columns;
  names.emplace_back("wall_time");
  names.push_back(fmt::format("crc64 (journal {}; study {})", kFormat, fingerprint_of(format)));
  return files::csv_row(names);
}

std::string line_of(const std::vector<std::string>& fields, double wall_time, const std::string& fingerprint) {
  std::string line = files::csv_row(fields) + fmt::format(",{}", wall_time);
  return line + "," + files::crc64_text(fingerprint, line);
}

std::string_view outcome_part(std::string_view line) {
  line = line.substr(0, line.rfind(','));
  return line.substr(0, line.rfind(','));
}

std::string flaw_of_count(const std::string& column, const std::string& text) {
  return files::number<std::int64_t>(text).value_or(-1) >= 0
             ? ""
             : fmt::format("{} = '{}': not a whole number >= 0", column, files::printable(text, files::kShownMax));
}

std::string flaw_of_number(const std::string& column, const std::string& text) {
  return files::number<double>(text)
             ? ""
             : fmt::format("{} = '{}': not a number", column, files::printable(text, files::kShownMax));
}

std::string flaw_of_ended(const std::string& text) {
  for (const outcome::Ended ended : outcome::kEnds) {
    if (text == outcome::to_string(ended)) return "";
  }
  return fmt::format("ended = '{}': unknown", files::printable(text, files::kShownMax));
}

Scan scan(const fs::path& path, std::size_t number, const JournalFormat& format,
          const std::function<void(const JournalRow&)>& use) {
  Scan s;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) refuse(path.string(), "not a plain file");
  std::filebuf file;
  if (file.open(path, std::ios::in | std::ios::binary) == nullptr) refuse(path.string(), "cannot be read");
  const std::string fingerprint = fingerprint_of(format), expected = head_of(format);
  std::string line, head;
  std::uintmax_t offset = 0;
  bool torn = false;
  JournalRow row;
  for (std::size_t n = 1; next_line(file, line, offset, torn); s.whole = offset, ++n) {
    std::string problem;
    if (n == 1) {
      s.head = true;
      head = line;
      if (line == expected) continue;
      s.damaged = true;
    }
    problem = flaw_of(line, format, fingerprint, row);
    if (n == 1 && !problem.empty()) problem = "not the first line of this study's journals";
    if (problem.empty()) {
      s.rows.push_back({row.run, number, s.whole, n, files::crc64(outcome_part(line))});
      if (use) use(row);
    } else {
      s.damaged = true;
      s.problems.push_back(fmt::format("{}:{}: {}", path.string(), n, problem));
    }
  }
  if (s.damaged && s.rows.empty() && head != expected) require_this_journal(path.string(), head, format);
  return s;
}

void sort_out(std::vector<RowPlace>& rows, const std::vector<fs::path>& journals) {
  std::stable_sort(rows.begin(), rows.end(), [](const RowPlace& a, const RowPlace& b) { return a.run < b.run; });
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const RowPlace &a = rows[i - 1], &b = rows[i];
    if (a.run != b.run || a.crc == b.crc) continue;
    refuse(fmt::format("{}:{}", journals[a.journal].string(), a.line),
           fmt::format("run {} differs from the one in {}:{}; it is not known which of them is right", a.run,
                       journals[b.journal].string(), b.line),
           "one of the two, or equal ones");
  }
  rows.erase(std::unique(rows.begin(), rows.end(), [](const RowPlace& a, const RowPlace& b) { return a.run == b.run; }),
             rows.end());
}

const std::string& Lines::at(const RowPlace& place) {
  std::ifstream& file = files_[place.journal];
  if (!file.is_open()) file.open(paths_[place.journal], std::ios::binary);
  file.seekg(static_cast<std::streamoff>(place.offset));
  if (!std::getline(file, line_)) fail(paths_[place.journal].string(), "cannot be read a second time");
  return line_;
}

void write_journal(const fs::path& path, const JournalFormat& format, const std::vector<RowPlace>& rows, Lines& lines) {
  files::OutputFile out(path.string(), files::Existing::replace);
  out.stream() << head_of(format) << "\n";
  for (const RowPlace& row : rows) out.stream() << lines.at(row) << "\n";
  out.commit();
}

}  // namespace train_derail::study
