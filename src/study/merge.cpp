/// \file
/// Makes the table of runs from journals, and one results folder from several.
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>

#include "study/journal_lines.hpp"
#include "study/results_folder.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/study/journal.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;

namespace {

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

/// Returns which runs and which shards are missing.
std::string missing_text(const std::vector<bool>& have, const std::vector<fs::path>& journals) {
  std::vector<std::int64_t> runs;
  for (std::size_t i = 0; i < have.size(); ++i) {
    if (!have[i]) runs.push_back(static_cast<std::int64_t>(i));
  }
  if (runs.empty()) return "";
  std::string text = fmt::format("{} of {} runs are missing: {}", runs.size(), have.size(), runs_text(runs));
  std::map<int, std::set<int>> shards;  // for each number of shards: those that have a journal
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
      list += fmt::format("{}{}/{} {} ({} runs)", list.empty() ? "" : ", ", index, count,
                          there.count(index) > 0 ? "is not complete" : "is not there", n);
    }
    text += "; shard " + list;
  }
  return text;
}

}  // namespace

std::int64_t write_runs(const std::string& folder, const Study& study, const std::atomic<bool>* stop) {
  const JournalFormat format = journal_format(study);
  const HeldLock lock(folder);
  lock.wait_for_tables();
  const std::vector<fs::path> journals = journals_in(folder);
  std::vector<RowPlace> rows;
  for (std::size_t j = 0; j < journals.size(); ++j) {
    const std::vector<RowPlace> some = scan(journals[j], j, format, {}).rows;
    rows.insert(rows.end(), some.begin(), some.end());
  }
  sort_out(rows, journals);

  constexpr std::size_t kPlan = 4;  // run, point, replicate and seed come before the inputs
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
  for (const RowPlace& place : rows) {
    if (stop != nullptr && *stop) throw Stopped();
    std::string problem;
    if (!files::csv_fields(outcome_part(lines.at(place)), fields, problem))
      fail(journals[place.journal].string(), problem);
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
    const bool again =
        std::any_of(folders.begin(), folders.end(), [&](const std::string& f) { return files::same_file(f, other); });
    if (!again && !files::same_file(other, folder)) folders.push_back(other);
  }
  if (folders.empty()) check_folder(folder, format.identity);

  Gathered gathered;
  std::vector<fs::path> journals;
  std::vector<RowPlace> rows;
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
  std::vector<RowPlace> theirs = rows;
  sort_out(theirs, journals);  // rows that differ are reported before anything is created

  claim_folder(folder, format.identity);
  const HeldLock lock(folder);
  if (!lock.try_all_shards()) fail(folder, "a study is being computed in it; merge when it has ended");
  const std::size_t first = journals.size();
  read(folder);
  std::vector<bool> have(total, false), held(total, false);
  for (const RowPlace& row : rows) {
    if (row.journal >= first) held[static_cast<std::size_t>(row.run)] = true;
  }
  const std::vector<RowPlace> in_order_read = rows;
  sort_out(rows, journals);
  for (const RowPlace& row : rows) have[static_cast<std::size_t>(row.run)] = true;
  gathered.runs = static_cast<std::int64_t>(rows.size());
  gathered.total = static_cast<std::int64_t>(total);
  gathered.missing = missing_text(have, journals);

  std::vector<RowPlace> added;
  for (const RowPlace& row : rows) {
    if (!held[static_cast<std::size_t>(row.run)]) added.push_back(row);
  }
  gathered.added = static_cast<std::int64_t>(added.size());
  const fs::path target = fs::path(folder) / journal_name({});
  Lines lines(journals);
  bool written = false;
  for (std::size_t j = first; j < journals.size(); ++j) {
    const bool takes = journals[j] == target && !added.empty();
    if (!damaged[j] && !takes) continue;
    std::vector<RowPlace> now;
    for (const RowPlace& row : in_order_read) {
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
