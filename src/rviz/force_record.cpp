#include "rviz/force_record.hpp"

#include <algorithm>

namespace train_derail::rviz_panel {

namespace {

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

void ForceRecord::add(const CouplerForces& message) {
  const std::size_t count = message.couplers.size();
  if (message.run_id != run_id || count != now.size()) {
    *this = {};
    run_id = message.run_id;
    now.resize(count);
    buff_peak.resize(count);
    draft_peak.resize(count);
  }
  const bool again = !history.empty() && message.time <= time_max;
  time = message.time;
  time_max = std::max(time_max, time);
  Sample sample{time, 0.0, 0.0};
  for (std::size_t i = 0; i < count; ++i) {
    const CouplerForce& coupler = message.couplers[i];
    now[i] = coupler.axial_force;
    if (again) continue;
    // Of the steps since the last message, not of the grid alone.
    const double buff = std::max(coupler.axial_force, coupler.buff_peak);
    const double draft = std::max(-coupler.axial_force, coupler.draft_peak);
    buff_peak[i] = std::max(buff_peak[i], buff);
    draft_peak[i] = std::max(draft_peak[i], draft);
    sample.buff = std::max(sample.buff, buff);
    sample.draft = std::max(sample.draft, draft);
  }
  if (again) return;
  if (!history.empty() && time <= history.back().time + sample_width) {
    history.back().buff = std::max(history.back().buff, sample.buff);
    history.back().draft = std::max(history.back().draft, sample.draft);
    return;
  }
  if (history.size() == kSamplesMax) join_pairs();
  history.push_back(sample);
}

void ForceRecord::join_pairs() {
  const double span = history.back().time - history.front().time;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < history.size(); i += 2, ++kept) {
    Sample joined = history[i];
    if (i + 1 < history.size()) {
      joined.buff = std::max(joined.buff, history[i + 1].buff);
      joined.draft = std::max(joined.draft, history[i + 1].draft);
    }
    history[kept] = joined;
  }
  history.resize(kept);
  sample_width = span / static_cast<double>(kept);
}

double ForceRecord::buff_max() const { return largest(buff_peak); }
double ForceRecord::draft_max() const { return largest(draft_peak); }

}  // namespace train_derail::rviz_panel
