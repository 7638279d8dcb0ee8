#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/csv.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/validation/validation.hpp"
#include "validation/member_text.hpp"

namespace train_derail::validation {

using nlohmann::ordered_json;

namespace {

std::string number(double value, const char* format) {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

/// Empty where there is none.
std::string field(double value) { return std::isnan(value) ? "" : fmt::format("{}", value); }

study::PredictiveRanks ranks_of(const Validation& v) {
  return study::predictive_ranks(static_cast<std::size_t>(v.members), kIntervalShare);
}

std::string interval_text(const Validation& v) {
  const study::PredictiveRanks r = ranks_of(v);
  return fmt::format("90 % interval: from member {} to member {} of {}, sorted; holds {:.0f} % of counts that are drawn as the members are",
                     r.low, r.high, v.members, 100.0 * r.held);
}

std::string title(const Rated& r) {
  if (r.name == "simulation") return "simulation, median of the members";
  if (r.name == "mean") return "  their mean instead";
  if (r.name == "stretched") return "  its interval stretched to hold 90 %";
  const char* what = r.name == to_string(FitKind::straight_line) ? "straight line in speed"
                     : r.name == to_string(FitKind::linear)      ? "linear in speed, tail, tons"
                                                                 : "log-log in speed, tail, tons";
  return fmt::format("{}, {}", what, r.rows == "these" ? "in sample" : "left out");
}

std::string terms_of(FitKind kind) {
  switch (kind) {
    case FitKind::straight_line: return "cars = c0 + c1 mph";
    case FitKind::linear: return "cars = c0 + c1 mph + c2 tail + c3 tons";
    case FitKind::log_log: return "ln cars = c0 + c1 ln mph + c2 ln tail + c3 ln tons";
  }
  return "";
}

/// Rows outside of the fitted class; null if that is not known.
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
    ordered_json s{{"name", r.name},
                   {"made_from", r.rows},
                   {"rows", r.score.count},
                   {"mean_absolute_error", r.score.mean_absolute_error},
                   {"bias", r.score.bias},
                   {"root_mean_square_error", r.score.root_mean_square_error},
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
    j["fits"].push_back({{"name", to_string(f.kind)}, {"terms", terms_of(f.kind)}, {"coefficients", f.coefficients}});
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
    text += fmt::format("\n{} ({} rows)\n    {:<42}{:>8}{:>9}{:>9}{:>9}{:>8}{:>10}{:>8}\n", g.name, g.rows, "", "MAE", "bias", "RMSE", "R2",
                        "CRPS", "in 90 %", "width");
    for (const Rated& r : g.rated) {
      text += fmt::format("    {:<42}{:>8}{:>9}{:>9}{:>9}{:>8}{:>10}{:>8}\n", title(r), number(r.score.mean_absolute_error, "{:.2f}"),
                          number(r.score.bias, "{:+.2f}"), number(r.score.root_mean_square_error, "{:.2f}"),
                          number(r.score.r2, "{:.3f}"), r.crps ? number(*r.crps, "{:.2f}") : "", r.coverage ? number(100.0 * r.coverage->share, "{:.0f} %") : "",
                          r.coverage ? number(r.coverage->mean_width, "{:.1f}") : "");
    }
    text += fmt::format("    cars ~ speed^b: b = {} real, {} predicted\n", number(g.exponent_real, "{:.2f}"),
                        number(g.exponent_predicted, "{:.2f}"));
  }
  if (v.groups.empty()) return text;
  const Group& last = v.groups.back();
  text += fmt::format("\n{}\n    {:>10}{:>6}{:>10}{:>6}{:>11}{:>9}\n", last.name, "mph", "rows", "real", "sd", "predicted", "error");
  for (const SpeedBand& b : last.bands) {
    text += fmt::format("    {:>10}{:>6}{:>10.1f}{:>6}{:>11.1f}{:>7.0f} %\n", fmt::format("{:.0f}-{:.0f}", b.from, b.to), b.count,
                        b.real, number(b.real_sd, "{:.1f}"), b.predicted, 100.0 * b.error);
  }
  return text;
}

std::string to_json(const Validation& v) {
  const study::PredictiveRanks ranks = ranks_of(v);
  ordered_json j{{"table", v.accidents.path},
                 {"study", v.study.title},
                 {"rows", v.accidents.rows.size()},
                 {"members", v.members},
                 {"failed", v.failed},
                 {"interval", {{"wanted", kIntervalShare}, {"low_rank", ranks.low}, {"high_rank", ranks.high}, {"held_by_ranks", ranks.held}}},
                 {"stretched_by", v.stretched.factor},
                 {"fitted_on", v.fitted.title},
                 {"outside", outside_count(v)},
                 {"warnings", v.warnings},
                 {"left_out", to_json(v.accidents.left_out)},
                 {"notes", to_json(v.accidents.notes)}};
  for (const Group& g : v.groups) j["groups"].push_back(to_json(g));
  return j.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

std::string rows_csv(const Validation& v) {
  std::string text = "line";
  for (const std::string& column : v.accidents.columns) text += "," + study::quoted(column);
  text += ",predicted_mean,predicted_sd,predicted_low,predicted_median,predicted_high,predicted_members,crps,stretched_low,stretched_high"
          ",outside";
  for (const Fit& f : v.fits) text += fmt::format(",{0},{0}_left_out", to_string(f.kind));
  text += "\n";
  for (std::size_t i = 0; i < v.accidents.rows.size(); ++i) {
    const Accident& a = v.accidents.rows[i];
    const study::Spread& p = v.predicted[i];
    text += fmt::format("{}", a.line);
    for (const std::string& value : a.fields) text += "," + study::quoted(value);
    for (const double value : {p.mean, p.sd, v.intervals[i].low, p.median, v.intervals[i].high}) text += "," + field(value);
    text += fmt::format(",{},{},{},{}", p.count, field(v.crps[i]), field(v.stretched.low[i]), field(v.stretched.high[i]));
    text += "," + study::quoted(v.outside[i]);
    for (const Fit& f : v.fits) text += "," + field(f.fitted[i]) + "," + field(f.left_out[i]);
    text += "\n";
  }
  return text;
}

std::string columns_of_members(const study::Study& study) {
  std::string text = "line,member,seed";
  for (const study::Factor& f : study.factors) text += "," + study::quoted(f.key);
  text += ",derailed_without_locomotives,derailed_locomotives";
  for (const auto& q : outcome::kQuantities) text += fmt::format(",{}", q.name);
  return text + ",ended,message";
}

std::string line_of(const Accident& accident, std::int64_t member, const study::Point& point, const Member& m) {
  std::string text = fmt::format("{},{},{}", accident.line, member, m.seed);
  for (const std::string& value : point.values) text += "," + value;
  text += fmt::format(",{},{}", m.derailed.cars, m.derailed.locomotives);
  for (const auto& q : outcome::kQuantities) text += fmt::format(",{}", q.value(m.outcome));
  return text + fmt::format(",{},{}", outcome::to_string(m.outcome.ended), study::quoted(m.outcome.message));
}

Member member_from(const std::string& line, const std::string& columns) {
  const std::vector<std::string> fields = study::fields_of(line), names = study::fields_of(columns);
  const std::size_t first = names.size() - fields.size();  // the journal has the run's number before them
  const auto field = [&](const char* name) -> const std::string& {
    const auto place = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    return fields.at(place - first);
  };
  Member m;
  m.text = line;
  try {
    m.seed = std::stoll(field("seed"));
    m.derailed = {std::stoi(field("derailed_without_locomotives")), std::stoi(field("derailed_locomotives"))};
    m.outcome.message = field("message");
    for (const auto ended : {outcome::Ended::at_rest, outcome::Ended::time_max, outcome::Ended::integration_failed}) {
      if (field("ended") == outcome::to_string(ended)) m.outcome.ended = ended;
    }
  } catch (const std::logic_error&) {
    throw std::runtime_error("line '" + line + "' is not a run of a validation");
  }
  return m;
}

std::string members_csv(const study::Study& study, const Ensembles& ensembles) {
  std::string text = columns_of_members(study) + "\n";
  for (const Member& m : ensembles.members) text += m.text + "\n";
  return text;
}

}  // namespace train_derail::validation
