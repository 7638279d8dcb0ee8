#include "train_derail/study/journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/checksum.hpp"
#include "study/json_file.hpp"
#include "study/warnings.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/files/printable.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;
using inputs::InputError;

namespace {

constexpr const char* kStudyMakesIt = "derail study";
constexpr int kFormat = 2;

[[noreturn]] void fail(const std::string& path, const std::string& problem) { throw std::runtime_error(path + ": " + problem); }
[[noreturn]] void fail_errno(const std::string& path) { fail(path, std::strerror(errno)); }
[[noreturn]] void refuse(const std::string& where, const std::string& problem, const std::string& allowed = "") {
  throw InputError(where, "", "", problem, allowed);
}

std::string journal_name(const Shard& s) {
  return s.count == 1 ? "journal.csv" : fmt::format("journal.{}-of-{}.csv", s.index, s.count);
}

/// Of a name as journal_name() makes it; count 0: of no journal.
Shard shard_of(const fs::path& path) {
  const std::string name = path.filename().string();
  Shard s;
  const char* end = name.data() + name.size();
  if (name == journal_name(s)) return s;
  constexpr std::string_view kBegin = "journal.", kOf = "-of-";
  if (name.compare(0, kBegin.size(), kBegin) != 0) return {0, 0};
  const auto index = std::from_chars(name.data() + kBegin.size(), end, s.index);
  const auto of = static_cast<std::size_t>(index.ptr - name.data());
  if (index.ec != std::errc() || name.compare(of, kOf.size(), kOf) != 0) return {0, 0};
  std::from_chars(index.ptr + kOf.size(), end, s.count);
  return s.count > 1 && name == journal_name(s) ? s : Shard{0, 0};
}

/// Names of results, of studies and validations.
bool would_be_written(const fs::path& path) {
  constexpr const char* kNames[] = {"runs.csv", "summary.csv", "sobol.csv", "about.json", "rows.csv", "members.csv", "validation.json"};
  return shard_of(path).count > 0 || std::find(std::begin(kNames), std::end(kNames), path.filename()) != std::end(kNames);
}

/// In the order of their names.
std::vector<fs::path> journals_in(const std::string& folder) {
  std::vector<fs::path> paths;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (shard_of(entry.path()).count > 0) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

std::string in(const std::string& folder, const char* name) { return (fs::path(folder) / name).string(); }

/// Locks of ranges of study.json: the shards', and beyond them that of whatever is put together from the journals. They belong to
/// an open file, end with it, and work over a network. The journals themselves can then be replaced.
class Lock {
 public:
  Lock() = default;
  explicit Lock(int file) : file_(file) {}
  static int open(const std::string& folder) {
    const std::string path = in(folder, "study.json");
    const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (file < 0) fail_errno(path);
    return file;
  }
  bool try_shard(const Shard& s) const { return set(F_OFD_SETLK, F_WRLCK, place(s), 1); }
  bool try_all_shards() const { return set(F_OFD_SETLK, F_WRLCK, 1, 0); }
  void wait_for_tables() const { set(F_OFD_SETLKW, F_WRLCK, 0, 1); }
  void release_shard(const Shard& s) const { set(F_OFD_SETLK, F_UNLCK, place(s), 1); }

 private:
  static off_t place(const Shard& s) { return (static_cast<off_t>(s.count) << 31) + s.index; }
  bool set(int command, short type, off_t from, off_t length) const {
    struct flock range {};
    range.l_type = type;
    range.l_whence = SEEK_SET;
    range.l_start = from;
    range.l_len = length;
    while (fcntl(file_, command, &range) != 0) {
      if (errno == EINTR) continue;
      if (errno == EAGAIN || errno == EACCES) return false;
      fail("study.json", fmt::format("cannot be locked: {}", std::strerror(errno)));
    }
    return true;
  }
  int file_ = -1;
};

/// Closed at the end of its life, and with it what is locked by it.
struct HeldLock : Lock {
  explicit HeldLock(const std::string& folder) : HeldLock(Lock::open(folder)) {}
  ~HeldLock() { close(file); }
  HeldLock(const HeldLock&) = delete;
  HeldLock& operator=(const HeldLock&) = delete;
  const int file;

 private:
  explicit HeldLock(int f) : Lock(f), file(f) {}
};

std::string fingerprint_of(const JournalFormat& format) { return crc64_text(format.identity); }

std::string head_of(const JournalFormat& format) {
  std::vector<std::string> names = format.columns;
  names.emplace_back("wall_time");
  names.push_back(fmt::format("crc64 (journal {}; study {})", kFormat, fingerprint_of(format)));
  return files::csv_row(names);
}

/// A row with its checksum, without a line end.
std::string line_of(const std::vector<std::string>& fields, double wall_time, const std::string& fingerprint) {
  std::string line = files::csv_row(fields) + fmt::format(",{}", wall_time);
  return line + "," + crc64_text(fingerprint, line);
}

/// The part of a line that says what came out, without computing time and checksum.
std::string_view outcome_part(std::string_view line) {
  line = line.substr(0, line.rfind(','));
  return line.substr(0, line.rfind(','));
}

/// What is wrong with a line of a journal; "" if nothing, `row` is then what it says.
std::string flaw_of(std::string_view line, const JournalFormat& format, const std::string& fingerprint, JournalRow& row) {
  const std::size_t comma = line.rfind(',');
  if (comma == std::string_view::npos) return "no checksum";
  if (crc64_text(fingerprint, line.substr(0, comma)) != line.substr(comma + 1)) return "the checksum does not fit the line";
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

/// Where a good row lies.
struct Place {
  std::int64_t run;
  std::size_t journal;   // in a list of paths
  std::uintmax_t offset;
  std::size_t line;
  std::uint64_t crc;     // of what came out
};

struct Scan {
  std::vector<Place> rows;            // journal by journal
  std::vector<std::string> problems;  // "file:line: what is wrong"
  bool damaged = false;               // ... or the head: the journal is to be written anew
  std::uintmax_t whole = 0;           // bytes up to the end of the last whole line
  bool head = false;                  // there is a first line
};

/// Reads lines up to a bound; longer ones are cut.
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
    refuse(path + ":1", "a journal of version 0.1, whose lines have no checksum: nothing shows that they are what was computed",
           "another folder; or remove this file and compute anew");
  }
  const std::string mark = "crc64 (journal ";
  const std::size_t place = head.find(mark);
  if (place == std::string::npos) refuse(path + ":1", "not a journal of this program", "another folder, or remove this file");
  if (head.compare(place + mark.size(), 2, fmt::format("{};", kFormat)) != 0) {
    refuse(path + ":1", "a journal of another format", fmt::format("format {}", kFormat));
  }
  if (head.find(fingerprint_of(format)) == std::string::npos) refuse(path + ":1", "a journal of another study");
  refuse(path + ":1", "a journal with other columns: of another version of the program");
}

/// A torn last line is passed over. Throws InputError if it is no journal of this study.
Scan scan(const fs::path& path, std::size_t number, const JournalFormat& format, const std::function<void(const JournalRow&)>& use) {
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
      s.rows.push_back({row.run, number, s.whole, n, crc64(outcome_part(line))});
      if (use) use(row);
    } else {
      s.damaged = true;
      s.problems.push_back(fmt::format("{}:{}: {}", path.string(), n, problem));
    }
  }
  if (s.damaged && s.rows.empty() && head != expected) require_this_journal(path.string(), head, format);
  return s;
}

/// Good rows of journals in the order of runs, each run once. Throws InputError if two rows of a run differ.
void sort_out(std::vector<Place>& rows, const std::vector<fs::path>& journals) {
  std::stable_sort(rows.begin(), rows.end(), [](const Place& a, const Place& b) { return a.run < b.run; });
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Place &a = rows[i - 1], &b = rows[i];
    if (a.run != b.run || a.crc == b.crc) continue;
    refuse(fmt::format("{}:{}", journals[a.journal].string(), a.line),
           fmt::format("run {} differs from that in {}:{}; which of them is right cannot be told", a.run, journals[b.journal].string(), b.line),
           "one of the two, or equal ones");
  }
  rows.erase(std::unique(rows.begin(), rows.end(), [](const Place& a, const Place& b) { return a.run == b.run; }), rows.end());
}

/// Lines of journals by their places.
class Lines {
 public:
  explicit Lines(const std::vector<fs::path>& journals) : paths_(journals), files_(journals.size()) {}
  const std::string& at(const Place& place) {
    std::ifstream& file = files_[place.journal];
    if (!file.is_open()) file.open(paths_[place.journal], std::ios::binary);
    file.seekg(static_cast<std::streamoff>(place.offset));
    if (!std::getline(file, line_)) fail(paths_[place.journal].string(), "cannot be read a second time");
    return line_;
  }

 private:
  const std::vector<fs::path>& paths_;
  std::vector<std::ifstream> files_;
  std::string line_;
};

/// A journal of the head and these lines, whole.
void write_journal(const fs::path& path, const JournalFormat& format, const std::vector<Place>& rows, Lines& lines) {
  files::OutputFile out(path.string(), files::Existing::replace);
  out.stream() << head_of(format) << "\n";
  for (const Place& row : rows) out.stream() << lines.at(row) << "\n";
  out.commit();
}

void write_all(int file, const std::string& path, const std::string& text) {
  const off_t before = lseek(file, 0, SEEK_END);
  const ssize_t written = write(file, text.data(), text.size());
  if (written == static_cast<ssize_t>(text.size())) return;
  const std::string why = written < 0 ? std::strerror(errno) : "no space for a whole line";
  if (ftruncate(file, before) != 0) fail(path, why + ", and the torn line cannot be cut off");
  fail(path, why);
}

std::string first_difference(const nlohmann::json& was, const nlohmann::json& is) {
  const nlohmann::json patch = nlohmann::json::diff(was, is);
  if (patch.empty()) return "";
  const nlohmann::json& change = patch.at(0);
  const nlohmann::json::json_pointer place(change.at("path").get<std::string>());
  const auto at = [&](const nlohmann::json& j) {
    if (!j.contains(place)) return std::string("nothing");
    constexpr std::size_t kLong = 120;
    const std::string text = j.at(place).dump(-1, ' ', true);  // ASCII: a cut hits no character
    return text.size() > kLong ? text.substr(0, kLong) + "..." : text;
  };
  return fmt::format("{}: was {}, is now {}", files::printable(place.to_string().empty() ? "" : place.to_string().substr(1)), at(was), at(is));
}

/// How the study in a folder differs; "" if it is this one.
std::string difference(const std::string& folder, const std::string& identity) {
  const nlohmann::json was = read_json(in(folder, "study.json"), kStudyMakesIt);
  const std::string found = first_difference(was, nlohmann::json::parse(identity));
  return found.empty() ? "" : "holds results of another study; " + found;
}

/// One line, whatever stands in it.
std::string on_one_line(std::string text) {
  std::replace_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

std::string runs_text(const std::vector<std::int64_t>& runs) {
  constexpr std::size_t kShown = 10;
  std::string text;
  std::size_t shown = 0;
  for (std::size_t i = 0; i < runs.size();) {
    std::size_t end = i + 1;
    while (end < runs.size() && runs[end] == runs[end - 1] + 1) ++end;
    if (shown++ == kShown) return text + ", ...";
    text += text.empty() ? "" : ", ";
    text += end == i + 1 ? fmt::format("{}", runs[i]) : fmt::format("{} to {}", runs[i], runs[end - 1]);
    i = end;
  }
  return text;
}

/// Which runs, and which shards, are not there.
std::string missing_text(const std::vector<bool>& have, const std::vector<fs::path>& journals) {
  std::vector<std::int64_t> runs;
  for (std::size_t i = 0; i < have.size(); ++i) {
    if (!have[i]) runs.push_back(static_cast<std::int64_t>(i));
  }
  if (runs.empty()) return "";
  std::string text = fmt::format("{} of {} runs are missing: {}", runs.size(), have.size(), runs_text(runs));
  std::map<int, std::set<int>> shards;  // count: those that have a journal
  for (const fs::path& path : journals) {
    const Shard s = shard_of(path);
    if (s.count > 1) shards[s.count].insert(s.index);
  }
  for (const auto& [count, there] : shards) {
    std::map<int, std::int64_t> lacking;
    for (const std::int64_t run : runs) ++lacking[static_cast<int>(run % count) + 1];
    std::string list;
    int shown = 0;
    for (const auto& [index, n] : lacking) {
      constexpr int kShown = 20;
      if (shown++ == kShown) {
        list += ", ...";
        break;
      }
      list += fmt::format("{}{}/{} {} ({} runs)", list.empty() ? "" : ", ", index, count, there.count(index) > 0 ? "is not complete" : "is not there", n);
    }
    text += "; shard " + list;
  }
  return text;
}

}  // namespace

std::string flaw_of_count(const std::string& column, const std::string& text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size() && value >= 0;
  return whole ? "" : fmt::format("{} = '{}': not a whole number from 0 on", column, files::printable(text));
}

std::string flaw_of_number(const std::string& column, const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? "" : fmt::format("{} = '{}': not a number", column, files::printable(text));
}

std::string flaw_of_ended(const std::string& text) {
  for (const auto ended : {outcome::Ended::at_rest, outcome::Ended::time_max, outcome::Ended::integration_failed}) {
    if (text == outcome::to_string(ended)) return "";
  }
  return fmt::format("ended = '{}': unknown", files::printable(text));
}

JournalFormat journal_format(const Study& study) {
  JournalFormat format{"study", to_json(study), {"run", "point", "replicate", "seed"}, {}};
  for (const auto& q : outcome::kQuantities) format.columns.emplace_back(q.name);
  for (const char* name : {"ended", "steps", "rhs_evaluations", "warnings", "message"}) format.columns.emplace_back(name);
  Study plan;  // what run_of() needs
  plan.seed = study.seed;
  plan.replicates = study.replicates;
  format.flaw = [plan, runs = run_count(study), columns = format.columns](const std::vector<std::string>& fields) -> std::string {
    const std::int64_t index = std::stoll(fields[0]);
    if (index >= runs) return fmt::format("run {}: the study has {} runs", index, runs);
    const Run run = run_of(plan, index);
    if (fields[1] != fmt::format("{}", run.point) || fields[2] != fmt::format("{}", run.replicate) || fields[3] != fmt::format("{}", run.seed)) {
      return fmt::format("run {}: point, replicate or seed are not those of the plan", index);
    }
    std::string problem;
    constexpr std::size_t kFirst = 4, kEnded = kFirst + outcome::kQuantities.size();
    for (std::size_t i = kFirst; i < kEnded && problem.empty(); ++i) problem = flaw_of_number(columns[i], fields[i]);
    if (problem.empty()) problem = flaw_of_ended(fields[kEnded]);
    for (std::size_t i = kEnded + 1; i < kEnded + 3 && problem.empty(); ++i) problem = flaw_of_count(columns[i], fields[i]);
    return problem;
  };
  return format;
}

std::vector<std::string> journal_fields(const Run& run, const outcome::Outcome& o) {
  std::vector<std::string> fields;
  for (const std::int64_t n : {run.index, run.point, static_cast<std::int64_t>(run.replicate), run.seed}) fields.push_back(fmt::format("{}", n));
  for (const auto& q : outcome::kQuantities) fields.push_back(fmt::format("{}", q.value(o)));
  fields.emplace_back(outcome::to_string(o.ended));
  fields.push_back(fmt::format("{}", o.solver.steps));
  fields.push_back(fmt::format("{}", o.solver.rhs_evaluations));
  fields.push_back(warnings_field(o.warnings));
  fields.push_back(o.message);
  return fields;
}

void claim_folder(const std::string& folder, const std::string& identity) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder, error)) fail(folder, error ? error.message() : "is no folder");
  const std::string file = in(folder, "study.json");
  if (!fs::exists(file, error)) {
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      // Looked for again: another shard may have begun in the meantime.
      if (would_be_written(entry.path()) && !fs::exists(file, error)) {
        fail(folder, "holds " + entry.path().filename().string() + " but no study.json: not a folder of this program");
      }
    }
    try {
      files::write_file(file, identity + "\n");
      return;
    } catch (const files::ExistsError&) {  // ... and been faster
    }
  }
  if (const std::string other = difference(folder, identity); !other.empty()) fail(folder, other);
}

void check_folder(const std::string& folder, const std::string& identity) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) refuse(folder, "no such folder", "a folder that derail study has written");
  if (const std::string other = difference(folder, identity); !other.empty()) refuse(folder, other);
}

Journal::Journal(const std::string& folder, const JournalFormat& format, const Shard& shard, bool resume,
                 const std::function<void(const JournalRow&)>& use)
    : path_(in(folder, journal_name(shard).c_str())), fingerprint_(fingerprint_of(format)), lock_(Lock::open(folder)) {
  try {
    const Lock lock(lock_);
    if (!lock.try_shard(shard)) fail(path_, "another process is writing it");
    std::vector<fs::path> journals = journals_in(folder);
    std::vector<Place> rows;
    std::vector<Scan> scans;
    const auto read_all = [&](const std::function<void(const JournalRow&)>& to) {
      rows.clear();
      scans.clear();
      for (std::size_t j = 0; j < journals.size(); ++j) {
        scans.push_back(scan(journals[j], j, format, to));
        rows.insert(rows.end(), scans.back().rows.begin(), scans.back().rows.end());
      }
      sort_out(rows, journals);
    };
    read_all(use);
    bool lines = false;
    for (const Scan& s : scans) {
      lines |= !s.rows.empty() || !s.problems.empty();
      problems_.insert(problems_.end(), s.problems.begin(), s.problems.end());
    }
    if (lines && !resume) {
      fail(folder, fmt::format("holds {} finished runs of this {}; --resume computes what is missing", rows.size(), format.what));
    }
    for (std::size_t j = 0; j < journals.size(); ++j) {
      const Shard owner = shard_of(journals[j]);
      const bool own = journals[j] == path_;
      if (!scans[j].damaged || (!own && !lock.try_shard(owner))) continue;
      // Nobody else writes it now; read again, as it was not ours while it was read.
      const Scan now = own ? std::move(scans[j]) : scan(journals[j], j, format, {});
      Lines text(journals);
      write_journal(journals[j], format, now.rows, text);
      if (!own) lock.release_shard(owner);
    }
    file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    if (file_ < 0) fail_errno(path_);
    const Scan now = scan(path_, 0, format, {});
    if (ftruncate(file_, static_cast<off_t>(now.whole)) != 0) fail_errno(path_);
    if (!now.head) write_all(file_, path_, head_of(format) + "\n");
  } catch (...) {
    if (file_ >= 0) close(file_);
    close(lock_);
    throw;
  }
}

Journal::~Journal() {
  close(file_);
  close(lock_);
}

void Journal::append(const std::vector<std::string>& fields, double wall_time) {
  std::vector<std::string> lines = fields;
  for (std::string& field : lines) field = on_one_line(std::move(field));
  write_all(file_, path_, line_of(lines, wall_time, fingerprint_) + "\n");
}

std::int64_t write_runs(const std::string& folder, const Study& study, const std::atomic<bool>* stop) {
  const JournalFormat format = journal_format(study);
  const HeldLock lock(folder);
  lock.wait_for_tables();
  const std::vector<fs::path> journals = journals_in(folder);
  std::vector<Place> rows;
  for (std::size_t j = 0; j < journals.size(); ++j) {
    const std::vector<Place> some = scan(journals[j], j, format, {}).rows;
    rows.insert(rows.end(), some.begin(), some.end());
  }
  sort_out(rows, journals);

  constexpr std::size_t kPlan = 4;  // run, point, replicate, seed stand before the inputs
  std::vector<std::string> fields = format.columns;
  const auto with_inputs = [&](const std::vector<std::string>& values) {
    fields.insert(fields.begin() + kPlan, values.begin(), values.end());
    return files::csv_row(fields);
  };
  std::vector<std::string> keys;
  for (const Factor& f : study.factors) keys.push_back(f.key);
  const Points points(study, stop);
  files::OutputFile out(in(folder, "runs.csv"), files::Existing::replace);
  out.stream() << with_inputs(keys) << "\n";
  Lines lines(journals);
  for (const Place& place : rows) {
    if (stop != nullptr && *stop) throw Stopped();
    std::string problem;
    if (!files::csv_fields(outcome_part(lines.at(place)), fields, problem)) fail(journals[place.journal].string(), problem);
    out.stream() << with_inputs(points[place.run / study.replicates].values) << "\n";
  }
  out.commit();
  return static_cast<std::int64_t>(rows.size());
}

Gathered gather(const std::string& folder, const std::vector<std::string>& others, const Study& study) {
  const JournalFormat format = journal_format(study);
  const auto total = static_cast<std::size_t>(run_count(study));
  std::vector<std::string> folders;
  for (const std::string& other : others) {
    check_folder(other, format.identity);
    const bool again = std::any_of(folders.begin(), folders.end(), [&](const std::string& f) { return files::same_file(f, other); });
    if (!again && !files::same_file(other, folder)) folders.push_back(other);
  }
  if (folders.empty()) check_folder(folder, format.identity);

  Gathered gathered;
  std::vector<fs::path> journals;
  std::vector<Place> rows;
  std::vector<bool> damaged;
  const auto read = [&](const std::string& of) {
    for (const fs::path& path : journals_in(of)) {
      const Scan s = scan(path, journals.size(), format, {});
      rows.insert(rows.end(), s.rows.begin(), s.rows.end());
      gathered.problems.insert(gathered.problems.end(), s.problems.begin(), s.problems.end());
      damaged.push_back(s.damaged);
      journals.push_back(path);
    }
  };
  for (const std::string& other : folders) read(other);
  std::vector<Place> theirs = rows;
  sort_out(theirs, journals);  // before anything is created

  claim_folder(folder, format.identity);
  const HeldLock lock(folder);
  if (!lock.try_all_shards()) fail(folder, "a study is being computed in it; merge when it has ended");
  const std::size_t first = journals.size();
  read(folder);
  std::vector<bool> have(total, false), held(total, false);
  for (const Place& row : rows) {
    if (row.journal >= first) held[static_cast<std::size_t>(row.run)] = true;
  }
  const std::vector<Place> in_order_read = rows;
  sort_out(rows, journals);
  for (const Place& row : rows) have[static_cast<std::size_t>(row.run)] = true;
  gathered.runs = static_cast<std::int64_t>(rows.size());
  gathered.total = static_cast<std::int64_t>(total);
  gathered.missing = missing_text(have, journals);

  std::vector<Place> added;
  for (const Place& row : rows) {
    if (!held[static_cast<std::size_t>(row.run)]) added.push_back(row);
  }
  gathered.added = static_cast<std::int64_t>(added.size());
  const fs::path target = fs::path(folder) / journal_name({});
  Lines lines(journals);
  bool written = false;
  for (std::size_t j = first; j < journals.size(); ++j) {
    const bool takes = journals[j] == target && !added.empty();
    if (!damaged[j] && !takes) continue;
    std::vector<Place> now;
    for (const Place& row : in_order_read) {
      if (row.journal == j) now.push_back(row);
    }
    if (takes) now.insert(now.end(), added.begin(), added.end());
    write_journal(journals[j], format, now, lines);
    written |= takes;
  }
  if (!added.empty() && !written) write_journal(target, format, added, lines);
  return gathered;
}

}  // namespace train_derail::study
