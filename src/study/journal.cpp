#include "train_derail/study/journal.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/csv.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const std::string& path, const std::string& problem) {
  throw std::runtime_error(path + ": " + problem);
}
[[noreturn]] void fail_errno(const std::string& path) { fail(path, std::strerror(errno)); }

// The computing time stands last: it is what differs between two runs of the same study, and is left out of runs.csv.
std::string header(const Study& study) {
  std::string line = "run,point,replicate,seed";
  for (const Factor& f : study.factors) line += "," + quoted(f.key);
  for (const auto& q : outcome::kQuantities) line += fmt::format(",{}", q.name);
  return line + ",ended,steps,rhs_evaluations,message";
}

std::string row(const Point& point, const Run& run, const outcome::Outcome& o) {
  std::string line = fmt::format("{},{},{},{}", run.index, run.point, run.replicate, run.seed);
  for (const std::string& value : point.values) line += "," + value;
  for (const auto& q : outcome::kQuantities) line += fmt::format(",{}", q.value(o));
  return line + fmt::format(",{},{},{},{}", outcome::to_string(o.ended), o.solver.steps, o.solver.rhs_evaluations,
                            quoted(o.message));
}

std::string journal_name(const Shard& s) {
  return s.count == 1 ? "journal.csv" : fmt::format("journal.{}-of-{}.csv", s.index, s.count);
}

bool is_journal(const fs::path& path) {
  return path.extension() == ".csv" && path.filename().string().compare(0, 8, "journal.") == 0;
}

/// Names of results, of studies and validations.
bool would_be_written(const fs::path& path) {
  constexpr const char* kNames[] = {"runs.csv", "summary.csv", "sobol.csv", "about.json", "rows.csv", "members.csv", "validation.json"};
  return is_journal(path) || std::find(std::begin(kNames), std::end(kNames), path.filename()) != std::end(kNames);
}

/// Calls use(index, place, line) for every whole row of a journal, `place` being where in the file the line starts;
/// returns the length of the part that holds whole lines.
template <class Use>
std::uintmax_t read_rows(const fs::path& path, const std::string& expected_header, Use use) {
  std::ifstream file(path, std::ios::binary);
  if (!file) fail(path.string(), "cannot be read");
  std::uintmax_t whole = 0;
  bool first = true;
  for (std::string line; std::getline(file, line);) {
    if (file.eof()) break;  // no newline: torn
    const std::uintmax_t place = whole;
    whole += line.size() + 1;
    if (first) {
      if (line != expected_header + ",wall_time") fail(path.string(), "is not a journal of this study (its header differs)");
      first = false;
      continue;
    }
    std::int64_t index = -1;
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), index);
    if (error != std::errc() || *end != ',') fail(path.string(), "line '" + line + "' does not start with a run's number");
    use(index, place, line);
  }
  return whole;
}

void write_all(int file, const std::string& path, const std::string& text) {
  const off_t before = lseek(file, 0, SEEK_END);
  const ssize_t written = write(file, text.data(), text.size());
  if (written == static_cast<ssize_t>(text.size())) return;
  const std::string why = written < 0 ? std::strerror(errno) : "no space for a whole line";
  if (ftruncate(file, before) != 0) fail(path, why + ", and the torn line cannot be cut off");
  fail(path, why);
}

/// Calls write(stream) on a new file that takes the place of `path` when it is whole.
template <class Write>
void write_file(const std::string& path, Write write) {
  files::OutputFile file(path, files::Existing::replace);  // of a folder that has been claimed
  write(file.stream());
  file.commit();
}

std::string first_difference(const nlohmann::json& was, const nlohmann::json& is) {
  const nlohmann::json patch = nlohmann::json::diff(was, is);
  if (patch.empty()) return "";
  const nlohmann::json& change = patch.at(0);
  const nlohmann::json::json_pointer place(change.at("path").get<std::string>());
  const auto at = [&](const nlohmann::json& j) {
    if (!j.contains(place)) return std::string("nothing");
    constexpr std::size_t kLong = 120;
    const std::string text = j.at(place).dump();
    return text.size() > kLong ? text.substr(0, kLong) + "..." : text;
  };
  return fmt::format("{}: was {}, is now {}", place.to_string().substr(1), at(was), at(is));
}

}  // namespace

void claim_folder(const std::string& folder, const Study& study) { claim_folder(folder, to_json(study)); }

void claim_folder(const std::string& folder, const std::string& now) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(folder, error.message());
  const fs::path file = fs::path(folder) / "study.json";
  if (!fs::exists(file)) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      // Looked for again: another shard may have begun in the meantime.
      if (would_be_written(entry.path()) && !fs::exists(file)) {
        fail(folder, "holds " + entry.path().filename().string() + " but no study.json: not a folder of this program");
      }
    }
    write_file(file.string(), [&](std::ostream& out) { out << now << "\n"; });
    return;
  }
  std::ifstream in(file);
  const nlohmann::json was = nlohmann::json::parse(in, nullptr, false);
  if (was.is_discarded()) fail(file.string(), "is not JSON");
  const std::string difference = first_difference(was, nlohmann::json::parse(now));
  if (!difference.empty()) fail(folder, "holds results of another study; " + difference);
}

Journal::Journal(const std::string& folder, const Study& study, const Shard& shard) : Journal(folder, header(study), shard) {}

Journal::Journal(const std::string& folder, const std::string& columns, const Shard& shard)
    : path_((fs::path(folder) / journal_name(shard)).string()) {
  file_ = open(path_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file_ < 0) fail_errno(path_);
  if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    close(file_);
    fail(path_, "another process is writing it");
  }
  try {
    const std::uintmax_t whole = read_rows(path_, columns, [this](std::int64_t index, std::uintmax_t, const std::string&) {
      finished_.push_back(index);
    });
    if (ftruncate(file_, static_cast<off_t>(whole)) != 0) fail_errno(path_);
    if (whole == 0) write_all(file_, path_, columns + ",wall_time\n");
  } catch (...) {
    close(file_);
    throw;
  }
}

Journal::~Journal() { close(file_); }

void Journal::append(const Point& point, const Run& run, const outcome::Outcome& outcome) {
  append(row(point, run, outcome), outcome.wall_time);
}

void Journal::append(const std::string& row, double wall_time) { write_all(file_, path_, row + fmt::format(",{}\n", wall_time)); }

void read_journals(const std::string& folder, const std::string& columns,
                   const std::function<void(std::int64_t, const std::string&)>& use) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!is_journal(entry.path())) continue;
    read_rows(entry.path(), columns, [&](std::int64_t index, std::uintmax_t, const std::string& line) {
      use(index, line.substr(0, line.rfind(',')));
    });
  }
}

std::int64_t write_runs(const std::string& folder, const Study& study) {
  // Where each row lies, not the row itself: a study may have more runs than fit into memory.
  struct Row {
    std::int64_t index;
    std::size_t journal;
    std::uintmax_t place;
  };
  std::vector<Row> rows;
  std::vector<std::ifstream> journals;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!is_journal(entry.path())) continue;
    read_rows(entry.path(), header(study), [&](std::int64_t index, std::uintmax_t place, const std::string&) {
      rows.push_back({index, journals.size(), place});
    });
    journals.emplace_back(entry.path(), std::ios::binary);
  }
  // The same run in two journals has the same row.
  std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.index < b.index; });
  rows.erase(std::unique(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.index == b.index; }), rows.end());
  write_file((fs::path(folder) / "runs.csv").string(), [&](std::ostream& out) {
    out << header(study) << "\n";
    std::string line;
    for (const Row& row : rows) {
      std::ifstream& journal = journals[row.journal];
      journal.seekg(static_cast<std::streamoff>(row.place));
      if (!std::getline(journal, line)) fail(folder, "a journal cannot be read a second time");
      out << line.substr(0, line.rfind(',')) << "\n";
    }
  });
  return static_cast<std::int64_t>(rows.size());
}

void gather(const std::string& folder, const std::vector<std::string>& others, const Study& study) {
  claim_folder(folder, study);
  for (const std::string& other : others) {
    if (fs::exists(folder) && fs::equivalent(other, folder)) continue;
    claim_folder(other, study);
    for (const auto& entry : fs::directory_iterator(other)) {
      if (is_journal(entry.path())) {
        fs::copy_file(entry.path(), fs::path(folder) / entry.path().filename(), fs::copy_options::overwrite_existing);
      }
    }
  }
}

}  // namespace train_derail::study
