#include "train_derail/study/members.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/json_file.hpp"
#include "study/results.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

using inputs::InputError;
using nlohmann::ordered_json;

namespace {

struct Share {
  double p;
  const char* name;
};
constexpr Share kShares[] = {{0.05, "small (5 %)"}, {0.5, "median"}, {0.95, "large (95 %)"}};

/// The study, as far as its runs depend on it, from about.json.
Study study_of(const Results& r) {
  Study study;
  study.title = r.study.at("title");
  const std::string path = in_folder(r.folder, "about.json");
  study.base = base_of(r);
  for (const Number& factor : r.factors) study.factors.emplace_back().key = factor.name;
  const ordered_json& p = r.study.at("perturbation");
  study.perturbation = study.base.initial.perturbation;
  study.perturbation.spacing = p.at("spacing");
  study.perturbation.yaw_rate = p.at("yaw_rate");
  study.perturbation.kick = p.at("kick");
  study.perturbation.alignment = p.at("alignment");
  return study;
}

const Number& outcome_of(const Results& r, const std::optional<std::string>& name) {
  if (!name) return r.outcomes.at(0);
  std::string known;
  for (const Number& outcome : r.outcomes) {
    if (outcome.name == *name) return outcome;
    known += (known.empty() ? "" : ", ") + outcome.name;
  }
  throw InputError("command line", "--outcome", *name, "not an outcome of this study", known);
}

/// A row of runs.csv that may be chosen.
struct Candidate {
  double value;
  Row row;
};

std::vector<Candidate> candidates(const Results& r, const std::string& outcome,
                                  const std::optional<std::string>& point) {
  files::CsvTable table(in_folder(r.folder, "runs.csv"));
  const std::size_t points = table.column("point"), ended = table.column("ended"), wanted = table.column(outcome);
  std::vector<Candidate> found;
  for (Row row; table.next(row);) {
    if (point && row[points] != *point) continue;
    if (row[ended] == outcome::to_string(outcome::Ended::integration_failed)) continue;
    const double value = table.number(row, wanted);
    if (std::isfinite(value)) found.push_back({value, row});
  }
  return found;
}

std::string name_of_point(const Results& r, const std::string& point) {
  for (const Row& row : r.summary.rows) {
    if (row[r.summary.column("point")] == point) return row[r.summary.column("name")];
  }
  return "point " + point;
}

Members choose(const Results& r, const MemberChoice& choice) {
  if (r.study.at("engine") != to_string(EngineChoice::purpose_built))
    throw InputError(r.folder, "", "", "was computed by the multibody engine, which makes no page",
                     "a study of the model");
  const Number& outcome = outcome_of(r, choice.outcome);
  std::optional<std::string> point;
  if (choice.point) point = fmt::format("{}", *choice.point);
  else if (r.by_point()) point = "0";

  std::vector<Candidate> runs = candidates(r, outcome.name, point);
  if (runs.empty() && choice.point)
    throw InputError("command line", "--point", *point, "no run of this point that did not fail",
                     "the numbers in the column point of runs.csv");
  if (runs.empty()) throw InputError(r.folder, "", "", "no run that did not fail", "");
  std::stable_sort(runs.begin(), runs.end(), [](const Candidate& a, const Candidate& b) { return a.value < b.value; });

  Members members;
  const Study study = study_of(r);
  members.title = study.title;
  members.outcome = outcome.name;
  members.version = r.about.at("version");
  members.chosen = fmt::format(
      "Out of {} runs{}{}: those nearest to the 5 %, 50 % and 95 % quantile of \"{}\" ({}), computed again from their "
      "seeds.",
      runs.size(), point && !r.factors.empty() ? " of " + name_of_point(r, *point) : "",
      r.failed > 0 ? " that did not fail" : "", outcome.title, outcome.name);
  files::CsvTable table(in_folder(r.folder, "runs.csv"));
  std::vector<std::size_t> inputs;
  for (const Number& factor : r.factors) inputs.push_back(table.column(factor.name));
  for (const Share& share : kShares) {
    const auto rank = static_cast<std::size_t>(std::llround(share.p * static_cast<double>(runs.size() - 1)));
    const Row& row = runs[rank].row;
    const auto count = [&](const char* name) {
      return files::number<std::int64_t>(row[table.column(name)]).value_or(0);
    };
    Member member{count("run"), "", row[table.column(outcome.name)], {}};
    if (!members.members.empty() && members.members.back().run == member.run) continue;
    member.caption = fmt::format("{}: {}, run {}", share.name, outcome.text(member.si), member.run);
    Point at;
    for (const std::size_t column : inputs) at.values.push_back(row[column]);
    member.scenario =
        scenario_of(study, at, {member.run, count("point"), static_cast<int>(count("replicate")), count("seed")});
    members.members.push_back(member);
  }
  return members;
}

}  // namespace

Members typical_members(const std::string& folder, const MemberChoice& choice) {
  const Results r = read_results(folder);
  try {
    return checked_json(in_folder(folder, "about.json"), kResultsWriter, [&] { return choose(r, choice); });
  } catch (const files::CsvError& e) {
    throw InputError(e.what(), "", "", fmt::format("{} writes this table", kResultsWriter), "");
  }
}

void require_same(const Members& members, const Member& member, const outcome::Outcome& outcome) {
  const outcome::Quantity* quantity = outcome::find_quantity(members.outcome);
  const std::string now = fmt::format("{}", quantity == nullptr ? std::nan("") : quantity->value(outcome));
  if (files::number<double>(now) == files::number<double>(member.si)) return;
  throw std::runtime_error(fmt::format(
      "run {} gives {} = {} now, but {} in the study: it was computed by train_derail {}, this is " TRAIN_DERAIL_VERSION
      ", or on another kind of machine",
      member.run, members.outcome, now, member.si, members.version));
}

}  // namespace train_derail::study
