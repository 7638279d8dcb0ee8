#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "train_derail/multibody/verify.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"

namespace train_derail::multibody {

namespace {

using nlohmann::ordered_json;

const outcome::Quantity& quantity(const std::string& name) {
  const outcome::Quantity* found = outcome::find_quantity(name);
  if (found == nullptr) throw std::logic_error(name);
  return *found;
}

double mean(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double v : x) sum += v;
  return sum / static_cast<double>(x.size());
}

/// Time at which the two runs are farther apart than `position`; NaN if they never are.
double apart_at(const PairOfRuns& pair, double position) {
  for (const Difference& d : pair.differences) {
    if (d.position > position) return d.time;
  }
  return std::nan("");
}

std::string cost_ratio(double purpose_built, double multibody) {
  return purpose_built > 0.0 ? fmt::format("{:.0f}", multibody / purpose_built) : "-";
}

ordered_json json_of(const PairOfRuns& pair) {
  return {{"cars", pair.cars},
          {"time_judged", pair.worst.time},
          {"judged_to_the_end", pair.to_the_end},
          {"position_worst", pair.worst.position},
          {"position_allowed", pair.worst.position_allowed},
          {"angle_worst", pair.worst.angle},
          {"angle_allowed", pair.worst.angle_allowed},
          {"force_worst", pair.worst.force},
          {"force_worst_share", pair.force_share},
          {"relative_worst", pair.relative},
          {"counts_equal", pair.counts_equal},
          {"failed", pair.failed},
          {"verdict", to_string(pair.verdict)},
          {"purpose_built", ordered_json::parse(outcome::to_json(pair.purpose_built))},
          {"multibody", ordered_json::parse(outcome::to_json(pair.multibody))}};
}

bool in_space(const Verification& v) { return inputs::model_of(v.scenario) == inputs::Model::spatial; }

double jitter_of_yaw_rate(const Verification& v) {
  return in_space(v) ? v.options.yaw_rate_in_space : v.options.yaw_rate;
}

using Text = std::back_insert_iterator<std::string>;

void say_if_failed(Text out, const PairOfRuns& pair) {
  if (!pair.failed.empty()) fmt::format_to(out, "   failed: {}\n", pair.failed);
}

/// How both were computed that are compared at each time.
std::string fineness(const Verification& v) {
  const VerifyOptions& o = v.options;
  if (!in_space(v)) return fmt::format("tolerance {:.0e} in both", o.accuracy);
  const Steps half = o.whole.halved();
  return fmt::format("steps of {:g} and {:g} ms, tolerance {:.0e} and {:.0e}", 1e3 * o.whole.step, 1e3 * half.step,
                     o.whole.accuracy, half.accuracy);
}

void add_early(Text out, const Verification& v) {
  const Criteria& c = v.options.criteria;
  const PairOfRuns& early = v.early;
  fmt::format_to(out, "1. Early, point by point: {} car{}, the first {:.2f} s, {}: {}\n", early.cars,
                 early.cars == 1 ? "" : "s", early.worst.time, fineness(v), to_string(early.verdict));
  fmt::format_to(out, "   largest difference of a car's position      {:10.2e} m    allowed {:.{}e} m\n",
                 early.worst.position, early.worst.position_allowed, in_space(v) ? 2 : 0);
  if (in_space(v)) {
    fmt::format_to(out, "   by which a car is turned against its twin   {:10.2e} rad  allowed {:.2e} rad\n",
                   early.worst.angle, early.worst.angle_allowed);
    fmt::format_to(out,
                   "   allowed: twice what halving the steps changes in both, {0:g} mm and mrad at least; judged while "
                   "that is below {1:g} mm and mrad\n",
                   1e3 * c.least, 1e3 * c.worth);
  } else {
    fmt::format_to(out, "   of a coupler force, of the largest so far   {:10.2e}      allowed {:.0e}\n",
                   early.force_share, c.force);
  }
  for (const double apart : {1e-6, 1e-3, 1.0}) {
    const double when = apart_at(early, apart);
    fmt::format_to(out, "   apart by more than {:<7g} m: {}\n", apart,
                   std::isnan(when) ? fmt::format("not within {:.2f} s", early.differences.back().time)
                                    : fmt::format("after {:.2f} s", when));
  }
  say_if_failed(out, early);
}

void add_short_trains(Text out, const Verification& v) {
  const Criteria& c = v.options.criteria;
  fmt::format_to(out, "2. Short trains{}\n",
                 in_space(v) ? ", as long as that is worth it" : ", whole runs at the same tolerance");
  fmt::format_to(out, "   {:>4} {:>13} {:>10} {:>13} {:>16} {:>16} {:>12} {:>12}\n", "cars", "position, m", "judged",
                 "stops after", "peak force, kip", "the same (mb)", "largest rel.", "");
  for (const PairOfRuns& pair : v.short_trains) {
    const bool stops = pair.purpose_built.ended == outcome::Ended::at_rest;
    fmt::format_to(out, "   {:>4} {:>13.2e} {:>8.2f} s {:>13} {:>16.2f} {:>16.2f} {:>12.1e} {:>12}\n", pair.cars,
                   pair.worst.position, pair.worst.time,
                   stops ? fmt::format("{:.2f} s", pair.purpose_built.stop_time) : "-",
                   pair.purpose_built.coupler_force_peak() / inputs::kKip,
                   pair.multibody.coupler_force_peak() / inputs::kKip, pair.relative, to_string(pair.verdict));
    say_if_failed(out, pair);
  }
  fmt::format_to(
      out,
      "   allowed: {:.0e} m at any time{}; to the end {:.0e} relative in speeds, peak force, stop time; equal "
      "counts\n",
      c.short_position, in_space(v) ? fmt::format(", {:.0e} rad", c.short_angle) : "", c.short_relative);
}

void add_one_run(Text out, const Verification& v) {
  fmt::format_to(out, "3. One run of each at {}: reported, not judged (the motion is chaotic)\n",
                 in_space(v) ? "the usual steps" : "the scenario's tolerance");
  fmt::format_to(out, "   {:<40} {:>14} {:>14}\n", "", "purpose-built", "multibody");
  const std::vector<std::string>& judged = judged_quantities(inputs::model_of(v.scenario));
  for (const outcome::Quantity& q : outcome::quantities()) {
    // In space the multibody engine does not find all.
    if (in_space(v) && std::find(judged.begin(), judged.end(), q.name) == judged.end()) continue;
    fmt::format_to(out, "   {:<40} {:>14.4g} {:>14.4g} {}\n", q.title, q.value(v.purpose_built) / q.per_shown,
                   q.value(v.multibody) / q.per_shown, q.shown_unit);
  }
  fmt::format_to(out, "   {:<40} {:>14} {:>14}\n", "ended", outcome::to_string(v.purpose_built.ended),
                 outcome::to_string(v.multibody.ended));
  fmt::format_to(out, "   {:<40} {:>14} {:>14}\n", "steps", v.purpose_built.solver.steps, v.multibody.solver.steps);
  fmt::format_to(out, "   {:<40} {:>14.3f} {:>14.3f} s   1 : {}\n", "processor time", v.purpose_built_seconds,
                 v.multibody_seconds, cost_ratio(v.purpose_built_seconds, v.multibody_seconds));
}

/// Of ensembles that agree: in how many outcomes so few runs could not have been counted on to differ; "" if in none.
std::string unseen(const Ensemble& e) {
  const auto blind = std::count_if(e.quantities.begin(), e.quantities.end(),
                                   [](const QuantityComparison& q) { return !std::isfinite(q.detectable); });
  if (e.verdict != Verdict::agrees || blind == 0) return "";
  return fmt::format("; {} runs of each are too few to show a difference reliably in {} of {} outcomes", e.runs, blind,
                     e.quantities.size());
}

void add_ensembles(Text out, const Verification& v) {
  const VerifyOptions& o = v.options;
  const Criteria& c = o.criteria;
  const Ensemble& e = v.ensemble;
  fmt::format_to(out, "4. Ensembles: {} runs of each, spacing jittered by {:g} mm, yaw rate by {:g} %: {}{}\n", e.runs,
                 1e3 * o.spacing, 1e2 * jitter_of_yaw_rate(v), to_string(e.verdict), unseen(e));
  if (e.failed > 0) fmt::format_to(out, "   {} runs failed\n", e.failed);
  fmt::format_to(out, "   {:<36} {:>8} {:>8} {:>19} {:>9} {:>9} {:>11}\n", "", "p.-built", "multib.",
                 "difference, 95 %", "p (KS)", "p (MW)", "detectable");
  for (const QuantityComparison& q : e.quantities) {
    const outcome::Quantity& about = quantity(q.name);
    fmt::format_to(out, "   {:<36} {:>8.4g} {:>8.4g} {:>+9.3g} +/- {:<5.3g} {:>9.2g} {:>9.2g} {:>11}{}\n", about.title,
                   mean(q.purpose_built) / about.per_shown, mean(q.multibody) / about.per_shown,
                   q.mean.value / about.per_shown, q.mean.half_width / about.per_shown, q.p_distance, q.p_precedence,
                   std::isfinite(q.detectable) ? fmt::format("{:.3g}", q.detectable / about.per_shown) : "none",
                   std::isfinite(q.detectable) ? fmt::format(" {}", about.shown_unit) : "");
  }
  if (e.verdict == Verdict::not_judged) {
    fmt::format_to(out, "   not judged: {} runs of each are too few, {} are needed\n", e.runs, c.runs_least);
  } else {
    fmt::format_to(out,
                   "   p: Kolmogorov-Smirnov and Mann-Whitney, by permutation, all {} corrected together (Holm); "
                   "differs if any is below\n"
                   "   alpha = {:g}. Equal engines fail in at most {:g} % of such comparisons. detectable: shift of "
                   "the mean that {} runs of each\n"
                   "   would have shown with probability {:g}; a smaller one can be there unseen; none: too few runs\n",
                   2 * e.quantities.size(), c.alpha, 100.0 * c.alpha, e.runs, c.power);
  }
}

}  // namespace

std::string to_table(const Verification& v) {
  std::string t;
  const Text out = std::back_inserter(t);
  add_early(out, v);
  add_short_trains(out, v);
  add_one_run(out, v);
  add_ensembles(out, v);
  fmt::format_to(out, "Verdict: {}{}\n", to_string(v.verdict()),
                 v.verdict() == Verdict::agrees && v.ensemble.verdict == Verdict::not_judged
                     ? ", as far as judged (the ensembles are not)"
                 : v.verdict() == Verdict::agrees ? unseen(v.ensemble)
                                                  : "");
  return t;
}

std::string to_json(const Verification& v) {
  const Criteria& c = v.options.criteria;
  ordered_json j;
  j["title"] = v.scenario.title;
  j["model"] = in_space(v) ? "spatial" : "paper";
  j["verdict"] = to_string(v.verdict());
  j["criteria"] = {{"early", in_space(v) ? c.early_in_space : c.early},
                   {"position", c.position},
                   {"force", c.force},
                   {"force_least", c.force_least},
                   {"worth", c.worth},
                   {"least", c.least},
                   {"short_position", c.short_position},
                   {"short_angle", c.short_angle},
                   {"short_relative", c.short_relative},
                   {"alpha", c.alpha},
                   {"power", c.power},
                   {"runs_least", c.runs_least}};
  j["fineness"] = fineness(v);
  j["early"] = json_of(v.early);
  j["short_trains"] = ordered_json::array();
  for (const PairOfRuns& pair : v.short_trains) j["short_trains"].push_back(json_of(pair));
  j["one_run"] = {{"purpose_built", ordered_json::parse(outcome::to_json(v.purpose_built))},
                  {"multibody", ordered_json::parse(outcome::to_json(v.multibody))},
                  {"processor_time", {v.purpose_built_seconds, v.multibody_seconds}}};
  ordered_json& e = j["ensemble"];
  e = {{"runs", v.ensemble.runs},
       {"failed", v.ensemble.failed},
       {"spacing", v.options.spacing},
       {"yaw_rate", jitter_of_yaw_rate(v)},
       {"verdict", to_string(v.ensemble.verdict)},
       {"quantities", ordered_json::array()}};
  for (const QuantityComparison& q : v.ensemble.quantities) {
    const outcome::Quantity& about = quantity(q.name);
    e["quantities"].push_back({{"name", q.name},
                               {"title", about.title},
                               {"unit", about.unit},
                               {"shown_unit", about.shown_unit},
                               {"per_shown", about.per_shown},
                               {"distance", q.test.distance},
                               {"precedence", q.test.precedence},
                               {"p_distance", q.p_distance},
                               {"p_precedence", q.p_precedence},
                               {"mean_difference", {q.mean.value, q.mean.half_width}},
                               {"detectable", q.detectable},
                               {"purpose_built", q.purpose_built},
                               {"multibody", q.multibody}});
  }
  return j.dump(2, ' ', false, ordered_json::error_handler_t::replace);
}

std::string differences_csv(const Verification& v) {
  std::string text = "cars,time_s,position_m,angle_rad,force_N,force_peak_N,position_allowed_m,angle_allowed_rad\n";
  const auto add = [&text](const PairOfRuns& pair) {
    for (const Difference& d : pair.differences) {
      fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{}\n", pair.cars, d.time, d.position, d.angle,
                     d.force, d.force_peak, d.position_allowed, d.angle_allowed);
    }
  };
  for (const PairOfRuns& pair : v.short_trains) add(pair);
  if (v.short_trains.empty() || v.early.cars > v.short_trains.back().cars) add(v.early);
  return text;
}

}  // namespace train_derail::multibody
