#include "overload_watch.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::examples {

namespace {

/// A time that is no more than rounding beyond a point of the grid belongs to it.
constexpr double kRounding = 1.0e-9;

bool add(Load& load, double time, double force, double threshold) {
  if (force > load.peak) {
    load.peak = force;
    load.peak_time = time;
  }
  if (!(force > threshold)) return false;
  if (load.points_above == 0) load.first_time = time;
  return ++load.points_above == 1;
}

std::string line(std::size_t coupler, const char* direction, const RunReport& report, const Load& load) {
  const std::optional<double> above = report.time_above(load);
  return fmt::format("{:>7}  {:<9}  {:>9.3f}  {:>9}  {:>9.0f}  {:>10.0f}  {:>6.3f}\n", coupler, direction,
                     load.first_time, above ? fmt::format("{:.3f}", *above) : "?", load.peak / 1000.0,
                     load.peak / inputs::kKip, load.peak_time);
}

}  // namespace

std::optional<double> RunReport::time_above(const Load& load) const {
  if (!interval) return std::nullopt;
  return static_cast<double>(load.points_above) * *interval;
}

std::size_t RunReport::missed() const {
  if (!interval || points == 0) return 0;
  const auto all = static_cast<std::size_t>(std::ceil(time / *interval - kRounding)) + 1;
  return all - std::min(all, points);
}

std::size_t RunReport::overloaded() const {
  return static_cast<std::size_t>(std::count_if(loads.begin(), loads.end(), [](const CouplerLoads& l) {
    return l.buff.points_above + l.draft.points_above > 0;
  }));
}

void OverloadWatch::run_info(std::uint32_t run_id, double interval, std::optional<double> end) {
  infos_[run_id] = {interval, end};
}

bool OverloadWatch::observe(std::uint32_t run_id, double time, const std::vector<Peaks>& peaks) {
  if (run_ && run_->run_id == run_id && run_->time == time) return false;
  if (!run_ || run_->run_id != run_id || time < run_->time) {
    if (unfinished()) cut_short_.push_back(report());
    infos_.erase(infos_.begin(), infos_.lower_bound(run_id));
    // A simulator that was started anew counts its runs from 1 again.
    if (run_ && run_id < run_->run_id) infos_.erase(infos_.upper_bound(run_id), infos_.end());
    run_.emplace();
    run_->run_id = run_id;
    run_->threshold = threshold_;
    run_->loads.resize(peaks.size());
    reported_ = false;
  }
  run_->time = time;
  ++run_->points;
  bool news = false;
  for (std::size_t i = 0; i < std::min(peaks.size(), run_->loads.size()); ++i) {
    news |= add(run_->loads[i].buff, time, peaks[i].buff, threshold_);
    news |= add(run_->loads[i].draft, time, peaks[i].draft, threshold_);
  }
  return news;
}

bool OverloadWatch::ended() const {
  const auto info = infos_.find(run_->run_id);
  return info != infos_.end() && info->second.end && run_->time >= *info->second.end;
}

RunReport OverloadWatch::report() const {
  if (!run_) return {};
  RunReport report = *run_;
  if (const auto info = infos_.find(run_->run_id); info != infos_.end()) report.interval = info->second.interval;
  report.complete = ended();
  return report;
}

std::vector<RunReport> OverloadWatch::take_finished() {
  std::vector<RunReport> finished;
  finished.swap(cut_short_);
  if (unfinished() && ended()) {
    finished.push_back(report());
    reported_ = true;
  }
  return finished;
}

std::string to_table(const RunReport& report) {
  std::string out =
      fmt::format("run {}, {:.3f} s{}: ", report.run_id, report.time, report.complete ? "" : ", not to its end");
  const std::string threshold =
      fmt::format("{:.0f} kN ({:.0f} kip)", report.threshold / 1000.0, report.threshold / inputs::kKip);
  if (report.overloaded() == 0) {
    out += fmt::format("none of {} couplers above {}\n", report.loads.size(), threshold);
  } else {
    out += fmt::format("{} of {} couplers above {}\n", report.overloaded(), report.loads.size(), threshold);
    out += "coupler  direction  first [s]  above [s]  peak [kN]  peak [kip]  at [s]\n";
    for (std::size_t i = 0; i < report.loads.size(); ++i) {
      const CouplerLoads& l = report.loads[i];
      if (l.buff.points_above > 0) out += line(i + 1, "buff", report, l.buff);
      if (l.draft.points_above > 0) out += line(i + 1, "draft", report, l.draft);
    }
  }
  if (report.missed() > 0) {
    out += fmt::format("{} of {} points of the grid never came: times and peaks are too small\n", report.missed(),
                       report.missed() + report.points);
  }
  return out;
}

}  // namespace train_derail::examples
