#include "train_derail/study/journal.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

#include "study/journal_lines.hpp"
#include "study/results_folder.hpp"
#include "study/warnings.hpp"
#include "train_derail/outcome/quantities.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;

namespace {

void write_all(int file, const std::string& path, const std::string& text) {
  const off_t before = lseek(file, 0, SEEK_END);
  const ssize_t written = write(file, text.data(), text.size());
  if (written == static_cast<ssize_t>(text.size())) return;
  const std::string why = written < 0 ? std::strerror(errno) : "no space left for the line";
  if (ftruncate(file, before) != 0) fail(path, why + ", and the incomplete line cannot be removed");
  fail(path, why);
}

/// Replaces line ends by blanks, so that a row is one line.
std::string on_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

}  // namespace

JournalFormat journal_format(const Study& study) {
  JournalFormat format{"study", to_json(study), {"run", "point", "replicate", "seed"}, {}};
  for (const auto& q : outcome::quantities()) format.columns.emplace_back(q.name);
  for (const char* name : {"ended", "steps", "rhs_evaluations", "warnings", "message"})
    format.columns.emplace_back(name);
  Study plan;  // run_of() needs only these two
  plan.seed = study.seed;
  plan.replicates = study.replicates;
  format.flaw = [plan, runs = run_count(study),
                 columns = format.columns](const std::vector<std::string>& fields) -> std::string {
    const std::int64_t index = std::stoll(fields[0]);
    if (index >= runs) return fmt::format("run {}: the study has {} runs", index, runs);
    const Run run = run_of(plan, index);
    if (fields[1] != fmt::format("{}", run.point) || fields[2] != fmt::format("{}", run.replicate) ||
        fields[3] != fmt::format("{}", run.seed)) {
      return fmt::format("run {}: point, replicate or seed are not those of the plan", index);
    }
    std::string problem;
    constexpr std::size_t kFirst = 4;
    const std::size_t kEnded = kFirst + outcome::quantities().size();
    for (std::size_t i = kFirst; i < kEnded && problem.empty(); ++i) problem = flaw_of_number(columns[i], fields[i]);
    if (problem.empty()) problem = flaw_of_ended(fields[kEnded]);
    for (std::size_t i = kEnded + 1; i < kEnded + 3 && problem.empty(); ++i)
      problem = flaw_of_count(columns[i], fields[i]);
    return problem;
  };
  return format;
}

std::vector<std::string> journal_fields(const Run& run, const outcome::Outcome& o) {
  std::vector<std::string> fields;
  for (const std::int64_t n : {run.index, run.point, static_cast<std::int64_t>(run.replicate), run.seed})
    fields.push_back(fmt::format("{}", n));
  for (const auto& q : outcome::quantities()) fields.push_back(fmt::format("{}", q.value(o)));
  fields.emplace_back(outcome::to_string(o.ended));
  fields.push_back(fmt::format("{}", o.solver.steps));
  fields.push_back(fmt::format("{}", o.solver.rhs_evaluations));
  fields.push_back(warnings_field(o.warnings));
  fields.push_back(o.message);
  return fields;
}

Journal::Journal(const std::string& folder, const JournalFormat& format, const Shard& shard, bool resume,
                 const std::function<void(const JournalRow&)>& use)
    : path_(in(folder, journal_name(shard))), fingerprint_(fingerprint_of(format)), lock_(Lock::open(folder)) {
  try {
    const Lock lock(lock_);
    if (!lock.try_shard(shard)) fail(path_, "another process is writing it");
    std::vector<fs::path> journals = journals_in(folder);
    std::vector<RowPlace> rows;
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
      fail(folder, fmt::format("holds {} finished runs of this {}; --resume computes what is missing", rows.size(),
                               format.what));
    }
    for (std::size_t j = 0; j < journals.size(); ++j) {
      const Shard owner = shard_of(journals[j]);
      const bool own = journals[j] == path_;
      if (!scans[j].damaged || (!own && !lock.try_shard(owner))) continue;
      // Now that it is locked, no other process writes it. It is read again, because it was not locked when it was read
      // before.
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

}  // namespace train_derail::study
