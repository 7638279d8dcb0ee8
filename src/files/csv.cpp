#include "train_derail/files/csv.hpp"

#include <algorithm>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"

namespace train_derail::files {

namespace {

/// Splits rows into fields. It is fed line by line, because a field may hold line ends.
class Parser {
 public:
  explicit Parser(std::vector<std::string>& fields) : fields_(fields) { fields_.assign(1, ""); }

  /// Takes one line without its end. Returns false if it is wrong; `problem` then says why.
  bool add(std::string_view line, std::string& problem) {
    for (const char c : line) {
      if (state_ == State::quoted) {
        if (c == '"') state_ = State::after_quote;
        else fields_.back() += c;
      } else if (c == ',') {
        fields_.emplace_back();
        state_ = State::start;
      } else if (c == '"' && state_ == State::start) {
        state_ = State::quoted;
      } else if (c == '"' && state_ == State::after_quote) {  // two double quotes stand for one
        fields_.back() += c;
        state_ = State::quoted;
      } else if (c == '"') {
        problem = fmt::format("field {}: a double quote within a field that does not begin with one", fields_.size());
        return false;
      } else if (state_ == State::after_quote) {
        problem = fmt::format("field {}: text after the closing double quote", fields_.size());
        return false;
      } else if (c == '\r') {
        problem = fmt::format("field {}: a carriage return in the middle of a line", fields_.size());
        return false;
      } else {
        fields_.back() += c;
        state_ = State::plain;
      }
    }
    return true;
  }
  /// Adds the line end `end` to the open field: the row continues in the next line.
  bool open() const { return state_ == State::quoted; }
  void line_end(std::string_view end) { fields_.back() += end; }

 private:
  enum class State { start, plain, quoted, after_quote };
  std::vector<std::string>& fields_;
  State state_ = State::start;
};

constexpr const char* kOpen = "a double quote is not closed";

}  // namespace

CsvError::CsvError(const std::string& path, std::size_t line, const std::string& problem)
    : std::runtime_error(line > 0 ? fmt::format("{}:{}: {}", path, line, problem) : path + ": " + problem),
      line_(line),
      problem_(problem) {}

std::string csv_field(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t'; };
  const bool plain = text.find_first_of(",\"\r\n") == std::string_view::npos &&
                     (text.empty() || (!blank(text.front()) && !blank(text.back())));
  if (plain) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + "\"";
}

std::string csv_row(const std::vector<std::string>& fields) {
  if (fields.size() == 1 && fields.front().empty()) return "\"\"";  // an empty line would not be read as a row
  std::string row;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (i > 0) row += ',';
    row += csv_field(fields[i]);
  }
  return row;
}

bool csv_fields(std::string_view text, std::vector<std::string>& fields, std::string& problem) {
  Parser parser(fields);
  for (;;) {
    const std::size_t end = text.find('\n');
    if (!parser.add(text.substr(0, end), problem)) return false;
    if (end == std::string_view::npos) break;
    if (!parser.open()) {
      problem = "a line end outside of double quotes";
      return false;
    }
    parser.line_end("\n");
    text.remove_prefix(end + 1);
  }
  if (parser.open()) problem = kOpen;
  return !parser.open();
}

CsvReader::CsvReader(const std::string& path) : path_(path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw CsvError(path, 0, "cannot be read: no such file");
  if (!std::filesystem::is_regular_file(status)) throw CsvError(path, 0, "cannot be read: not a plain file");
  file_.open(path, std::ios::binary);
  if (!file_) throw CsvError(path, 0, "cannot be read");
}

bool CsvReader::next(std::vector<std::string>& fields) {
  std::string line;
  const auto take = [&] {
    line.clear();
    // std::getline is not used here: it would read a whole file without line ends into memory.
    for (int c = file_.rdbuf()->sbumpc(); c != std::char_traits<char>::eof(); c = file_.rdbuf()->sbumpc()) {
      if (c == '\n') {
        ++lines_;
        return true;
      }
      if (line.size() == kRowMax) throw CsvError(path_, lines_ + 1, fmt::format("longer than {} bytes", kRowMax));
      line += static_cast<char>(c);
    }
    if (!line.empty()) ++lines_;
    return !line.empty();
  };
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  do {
    if (!take()) return false;
    if (lines_ == 1 && line.compare(0, kMark.size(), kMark) == 0) line.erase(0, kMark.size());
  } while (line.empty() || line == "\r");
  begin_ = lines_;
  Parser parser(fields);
  std::size_t size = 0;
  for (;;) {
    size += line.size() + 1;
    if (size > kRowMax + 1) throw CsvError(path_, begin_, fmt::format("longer than {} bytes", kRowMax));
    const bool windows = !line.empty() && line.back() == '\r';
    if (windows) line.pop_back();
    if (!is_utf8(line)) throw CsvError(path_, lines_, "not UTF-8");
    std::string problem;
    if (!parser.add(line, problem)) throw CsvError(path_, lines_, problem);
    if (!parser.open()) return true;
    parser.line_end(windows ? "\r\n" : "\n");
    if (!take()) throw CsvError(path_, begin_, kOpen);
  }
}

CsvTable::CsvTable(const std::string& path) : reader_(path) {
  if (!reader_.next(names_)) throw CsvError(path, 0, "is empty");
  std::set<std::string> seen;
  for (const std::string& name : names_) {
    if (!name.empty() && !seen.insert(name).second)
      throw CsvError(path, reader_.line(), fmt::format("two columns have the name '{}'", printable(name, kShownMax)));
  }
}

std::size_t CsvTable::column(const std::string& name) const {
  const auto place = std::find(names_.begin(), names_.end(), name);
  if (place == names_.end()) throw CsvError(reader_.path(), 1, fmt::format("no column '{}'", name));
  return static_cast<std::size_t>(place - names_.begin());
}

bool CsvTable::has(const std::string& name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool CsvTable::next(std::vector<std::string>& fields) {
  if (!reader_.next(fields)) return false;
  if (fields.size() != names_.size()) fail(fmt::format("{} fields, but {} columns", fields.size(), names_.size()));
  return true;
}

void CsvTable::fail(const std::string& problem) const { throw CsvError(reader_.path(), reader_.line(), problem); }

double CsvTable::number(const std::vector<std::string>& fields, std::size_t column) const {
  const std::string& text = fields[column];
  const auto value = files::number<double>(text);
  if (!value)
    fail(fmt::format("{} = '{}': not a number", printable(names_[column], kShownMax), printable(text, kShownMax)));
  return *value;
}

}  // namespace train_derail::files
