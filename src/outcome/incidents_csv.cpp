#include "train_derail/outcome/incidents_csv.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace train_derail::outcome {

void write_incidents_csv(std::ostream& out, const model::Incidents& incidents) {
  std::vector<std::pair<double, std::string>> rows;
  for (const model::Derailment& d : incidents.derailments) {
    rows.emplace_back(d.time, fmt::format("{},derailed,{},,{}_truck,,{},{},{},,,,,,,", d.time, d.car + 1,
                                          d.front ? "front" : "rear", model::to_string(d.cause), d.x, d.y));
  }
  for (const model::BrokenCoupler& b : incidents.broken) {
    rows.emplace_back(b.time, fmt::format("{},coupler_broken,{},{},,,{},,,,,,,,,{}", b.time, b.coupler + 1,
                                          b.coupler + 2, model::to_string(b.by), std::abs(b.axial_force)));
  }
  for (const model::Impact& i : incidents.impacts) {
    rows.emplace_back(
        i.time, fmt::format("{},impact,{},{},{},{},,{},{},{},{},{},{},{},{},{}", i.time, i.car_a + 1, i.car_b + 1,
                            model::to_string(i.face_a), model::to_string(i.face_b), i.x, i.y, i.z, i.along_a, i.along_b,
                            i.closing_speed, i.closing_speed_normal, i.impulse, i.peak_force));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  out << "time_s,what,car_a,car_b,where_a,where_b,cause,x_m,y_m,z_m,along_a_m,along_b_m,"
         "closing_speed_m_s,closing_speed_normal_m_s,impulse_N_s,peak_force_N\n";
  for (const auto& row : rows) out << row.second << '\n';
}

}  // namespace train_derail::outcome
