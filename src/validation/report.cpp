#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/warnings.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/validation/validation.hpp"
#include "validation/member_text.hpp"

namespace train_derail::validation {

using nlohmann::ordered_json;

namespace {

std::string number(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

/// Returns a number as a field of a table; NaN is an empty field.
std::string field(double value) { return std::isnan(value) ? "" : fmt::format("{}", value); }

study::PredictiveRanks ranks_of(const Validation& v) {
  return study::predictive_ranks(static_cast<std::size_t>(v.members), kIntervalShare);
}

std::string interval_text(const Validation& v) {
  const study::PredictiveRanks r = ranks_of(v);
  return fmt::format(
      "90 % interval: from member {} to member {} of {}, sorted; holds {:.0f} % of counts that are drawn as the "
      "members are",
      r.low, r.high, v.members, 100.0 * r.held);
}

std::string title(const Rated& r) {
  if (r.name == "simulation") return "simulation, median of the members";
  if (r.name == "mean") return "  their mean instead";
  if (r.name == "stretched") return "  its interval stretched to hold 90 %";
  const auto fit = std::find_if(kFitTexts.begin(), kFitTexts.end(), [&](const FitText& t) { return t.name == r.name; });
  return fmt::format("{}, {}", fit == kFitTexts.end() ? r.name : fit->title,
                     r.rows == "these" ? "in sample" : "left out");
}

/// Returns the number of rows outside of the fitted class; null if the class is not known.
ordered_json outside_count(const Validation& v) {
  if (!v.fitted.known()) return {};
  return std::count_if(v.outside.begin(), v.outside.end(), [](const std::string& o) { return !o.empty(); });
}

ordered_json to_json(const std::vector<Remark>& remarks) {
  ordered_json j = ordered_json::array();
  for (const Remark& r : remarks) j.push_back({{"line", r.line}, {"text", r.text}});
  return j;
}

ordered_json to_json(const Group& g) {
  ordered_json j{{"name", g.name}, {"rows", g.rows}};
  for (const Rated& r : g.rated) {
    ordered_json s{{"name", r.name},        {"made_from", r.rows},
                   {"rows", r.score.count}, {"mean_absolute_error", r.score.mean_absolute_error},
                   {"bias", r.score.bias},  {"root_mean_square_error", r.score.root_mean_square_error},
                   {"r2", r.score.r2}};
    if (r.crps) s["crps"] = *r.crps;
    if (r.coverage) {
      s["coverage"] = r.coverage->share;
      s["interval_width"] = r.coverage->mean_width;
    }
    j["scores"].push_back(s);
  }
  j["speed_exponent"] = {{"real", g.exponent_real}, {"predicted", g.exponent_predicted}};
  for (const Fit& f : g.fits) {
    j["fits"].push_back(
        {{"name", to_string(f.kind)}, {"terms", text_of(f.kind).terms}, {"coefficients", f.coefficients}});
  }
  for (const SpeedBand& b : g.bands) {
    j["speeds"].push_back({{"from_mph", b.from},
                           {"to_mph", b.to},
                           {"rows", b.count},
                           {"mean_mph", b.speed},
                           {"real", b.real},
                           {"real_sd", b.real_sd},
                           {"predicted", b.predicted},
                           {"error", b.error}});
  }
  return j;
}

}  // namespace

std::string to_table(const Validation& v) {
  std::string text = fmt::format("{} accidents, {} members each{}\n", v.accidents.rows.size(), v.members,
                                 v.failed > 0 ? fmt::format(", {} runs failed", v.failed) : "");
  for (const Remark& note : v.accidents.notes) text += fmt::format("line {}: {}\n", note.line, note.text);
  for (const std::string& warning : v.warnings) text += "warning: " + warning + "\n";
  text += interval_text(v) + "\n";
  for (const Group& g : v.groups) {
    text += fmt::format("\n{} ({} rows)\n    {:<42}{:>8}{:>9}{:>9}{:>9}{:>8}{:>10}{:>8}\n", g.name, g.rows, "", "MAE",
                        "bias", "RMSE", "R2", "CRPS", "in 90 %", "width");
    for (const Rated& r : g.rated) {
      text += fmt::format("    {:<42}{:>8}{:>9}{:>9}{:>9}{:>8}{:>10}{:>8}\n", title(r),
                          number(r.score.mean_absolute_error, "{:.2f}"), number(r.score.bias, "{:+.2f}"),
                          number(r.score.root_mean_square_error, "{:.2f}"), number(r.score.r2, "{:.3f}"),
                          r.crps ? number(*r.crps, "{:.2f}") : "",
                          r.coverage ? number(100.0 * r.coverage->share, "{:.0f} %") : "",
                          r.coverage ? number(r.coverage->mean_width, "{:.1f}") : "");
    }
    text += fmt::format("    cars ~ speed^b: b = {} real, {} predicted\n", number(g.exponent_real, "{:.2f}"),
                        number(g.exponent_predicted, "{:.2f}"));
  }
  if (!v.posture.empty()) text += to_table(v.posture);
  if (v.groups.empty()) return text;
  const Group& last = v.groups.back();
  text += fmt::format("\n{}\n    {:>10}{:>6}{:>10}{:>6}{:>11}{:>9}\n", last.name, "mph", "rows", "real", "sd",
                      "predicted", "error");
  for (const SpeedBand& b : last.bands) {
    text +=
        fmt::format("    {:>10}{:>6}{:>10.1f}{:>6}{:>11.1f}{:>7.0f} %\n", fmt::format("{:.0f}-{:.0f}", b.from, b.to),
                    b.count, b.real, number(b.real_sd, "{:.1f}"), b.predicted, 100.0 * b.error);
  }
  return text;
}

std::string to_json(const Validation& v) {
  const study::PredictiveRanks ranks = ranks_of(v);
  ordered_json j{
      {"table", v.accidents.path},
      {"study", v.plan.title()},
      {"rows", v.accidents.rows.size()},
      {"members", v.members},
      {"failed", v.failed},
      {"interval",
       {{"wanted", kIntervalShare}, {"low_rank", ranks.low}, {"high_rank", ranks.high}, {"held_by_ranks", ranks.held}}},
      {"stretched_by", v.stretched.factor},
      {"fitted_on", v.fitted.title},
      {"outside", outside_count(v)},
      {"warnings", v.warnings},
      {"left_out_counts", left_out_counts(v.accidents)},
      {"left_out", to_json(v.accidents.left_out)},
      {"notes", to_json(v.accidents.notes)}};
  for (const Group& g : v.groups) j["groups"].push_back(to_json(g));
  for (const PostureBand& b : v.posture) {
    ordered_json band{{"from_mph", b.from}, {"to_mph", std::isinf(b.to) ? ordered_json() : ordered_json(b.to)}};
    for (const auto& [name, s] : {std::pair{"real", b.real}, {"predicted", b.predicted}}) {
      band[name] = {
          {"count", s.count}, {"over", s.over}, {"sd", s.sd}, {"none_over", s.none_over}, {"all_over", s.all_over}};
    }
    j["posture"].push_back(band);
  }
  return j.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

std::string rows_csv(const Validation& v) {
  std::vector<std::string> names{"line"};
  names.insert(names.end(), v.accidents.columns.begin(), v.accidents.columns.end());
  for (const char* name : {"predicted_mean", "predicted_sd", "predicted_low", "predicted_median", "predicted_high",
                           "predicted_members", "crps", "stretched_low", "stretched_high", "outside"}) {
    names.emplace_back(name);
  }
  if (v.plan.by_cause()) names.emplace_back("cause_group");
  for (const Fit& f : v.fits) {
    names.emplace_back(to_string(f.kind));
    names.push_back(names.back() + "_left_out");
  }
  std::string text = files::csv_row(names) + "\n";
  for (std::size_t i = 0; i < v.accidents.rows.size(); ++i) {
    const Accident& a = v.accidents.rows[i];
    const study::Spread& p = v.predicted[i];
    std::vector<std::string> fields{fmt::format("{}", a.line)};
    fields.insert(fields.end(), a.fields.begin(), a.fields.end());
    for (const double value : {p.mean, p.sd, v.intervals[i].low, p.median, v.intervals[i].high})
      fields.push_back(field(value));
    fields.push_back(fmt::format("{}", p.count));
    for (const double value : {v.crps[i], v.stretched.low[i], v.stretched.high[i]}) fields.push_back(field(value));
    fields.push_back(v.outside[i]);
    if (v.plan.by_cause()) fields.push_back(v.plan.group_of(a));
    for (const Fit& f : v.fits) {
      fields.push_back(field(f.fitted[i]));
      fields.push_back(field(f.left_out[i]));
    }
    text += files::csv_row(fields) + "\n";
  }
  return text;
}

namespace {

constexpr std::size_t kBeforeInputs = 3;  // line, member, seed; without the number of the run
constexpr std::size_t kLine = 1, kMember = 2, kSeed = 3, kCars = 4, kLocomotives = 5,
                      kQuantities = 6;  // indices in a row of the journal
std::size_t ended_place() {
  return kQuantities + outcome::quantities().size();
}  // index of `ended`; warnings and message follow

std::vector<std::string> journal_columns() {
  std::vector<std::string> names{
      "run", "line", "member", "seed", "derailed_without_locomotives", "derailed_locomotives"};
  for (const auto& q : outcome::quantities()) names.emplace_back(q.name);
  for (const char* name : {"ended", "warnings", "message"}) names.emplace_back(name);
  return names;
}

}  // namespace

std::int64_t run_number(const Accident& accident, std::int64_t members, std::int64_t member) {
  return static_cast<std::int64_t>(accident.line) * members + member;
}

study::JournalFormat journal_format(const Plan& plan, const AccidentTable& accidents, const std::string& identity) {
  struct Limits {
    int cars, locomotives;
  };
  std::map<std::int64_t, Limits> rows;
  for (const Accident& a : accidents.rows) {
    rows[static_cast<std::int64_t>(a.line)] = {a.n_cars, a.head_end_locos + a.mid_locos + a.rear_locos};
  }
  study::Study seeds;  // run_of() needs only these two
  seeds.seed = plan.first().seed;
  seeds.replicates = plan.first().replicates;
  study::JournalFormat format{"validation", identity, journal_columns(), {}};
  format.flaw = [seeds, rows, members = members_a_row(plan),
                 columns = format.columns](const std::vector<std::string>& fields) -> std::string {
    const std::int64_t number = std::stoll(fields[0]), line = number / members;
    const auto row = rows.find(line);
    if (row == rows.end()) return fmt::format("run {}: no row of the table", number);
    if (fields[kLine] != fmt::format("{}", line) || fields[kMember] != fmt::format("{}", number % members) ||
        fields[kSeed] != fmt::format("{}", study::run_of(seeds, number).seed)) {
      return fmt::format("run {}: line, member or seed are not those of the plan", number);
    }
    std::string problem;
    const auto count = [&](std::size_t column, int most) {
      if (problem.empty()) problem = study::flaw_of_count(columns[column], fields[column]);
      if (problem.empty() && std::stoll(fields[column]) > most) {
        problem = fmt::format("{} = '{}': the train has {}", columns[column], fields[column], most);
      }
    };
    count(kCars, row->second.cars);
    count(kLocomotives, row->second.locomotives);
    for (std::size_t i = kQuantities; i < ended_place() && problem.empty(); ++i)
      problem = study::flaw_of_number(columns[i], fields[i]);
    return problem.empty() ? study::flaw_of_ended(fields[ended_place()]) : problem;
  };
  return format;
}

std::vector<std::string> fields_of(const Accident& accident, std::int64_t number, const Member& m) {
  std::vector<std::string> fields;
  for (const std::int64_t n :
       {number, static_cast<std::int64_t>(accident.line), m.member, m.seed, static_cast<std::int64_t>(m.derailed.cars),
        static_cast<std::int64_t>(m.derailed.locomotives)}) {
    fields.push_back(fmt::format("{}", n));
  }
  for (const auto& q : outcome::quantities()) fields.push_back(fmt::format("{}", q.value(m.outcome)));
  fields.emplace_back(outcome::to_string(m.outcome.ended));
  fields.push_back(study::warnings_field(m.outcome.warnings));
  fields.push_back(m.outcome.message);
  return fields;
}

Member member_from(const std::vector<std::string>& fields) {
  Member m;
  m.member = std::stoll(fields[kMember]);
  m.seed = std::stoll(fields[kSeed]);
  m.derailed = {std::stoi(fields[kCars]), std::stoi(fields[kLocomotives])};
  const auto count = [&](std::string_view name) {
    const auto place = outcome::find_quantity(name) - outcome::quantities().data();
    return std::stoi(fields[kQuantities + static_cast<std::size_t>(place)]);
  };
  m.posture.over = count("cars_over");
  m.posture.cars = m.posture.over + count("cars_upright") + count("cars_leaning");
  for (const outcome::Ended ended : outcome::kEnds) {
    if (fields[ended_place()] == outcome::to_string(ended)) m.outcome.ended = ended;
  }
  m.outcome.message = fields[ended_place() + 2];
  if (!fields[ended_place() + 1].empty()) m.outcome.warnings = {fields[ended_place() + 1]};
  return m;
}

std::string line_of(std::vector<std::string> fields, const Plan& plan, const Way& way, const study::Point& point,
                    const Accident& accident) {
  std::vector<std::string> inputs;
  if (plan.by_cause()) inputs = {way.name, fmt::format("{}", accident.first_car_position)};
  for (const std::string& key : plan.keys()) {
    const auto& factors = way.study.factors;
    const auto of = std::find_if(factors.begin(), factors.end(), [&](const study::Factor& f) { return f.key == key; });
    inputs.push_back(of == factors.end() ? "" : point.values[static_cast<std::size_t>(of - factors.begin())]);
  }
  fields.erase(fields.begin());
  fields.insert(fields.begin() + kBeforeInputs, inputs.begin(), inputs.end());
  return files::csv_row(fields);
}

std::string members_csv(const Plan& plan, const Ensembles& ensembles) {
  std::vector<std::string> names = journal_columns(), inputs = plan.keys();
  if (plan.by_cause()) inputs.insert(inputs.begin(), {"way", "first_car_position"});
  names.erase(names.begin());
  names.insert(names.begin() + kBeforeInputs, inputs.begin(), inputs.end());
  std::string text = files::csv_row(names) + "\n";
  for (const Member& m : ensembles.members) text += m.text + "\n";
  return text;
}

}  // namespace train_derail::validation
