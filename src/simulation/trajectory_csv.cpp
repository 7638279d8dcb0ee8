#include "train_derail/simulation/trajectory_csv.hpp"

#include <ostream>

#include <fmt/format.h>

#include "train_derail/outcome/incidents_csv.hpp"

namespace train_derail::simulation {

void write_csv_header(std::ostream& out) {
  out << "time_s,car,x_m,y_m,theta_rad,vx_m_s,vy_m_s,omega_rad_s,past_pod,off_track,front_truck_y_m,rear_truck_y_m,"
         "coupler_gap_m,coupler_angle_rad,coupler_axial_N,coupler_lateral_N,swing_lead_rad,swing_trail_rad,"
         "moment_lead_N_m,moment_trail_N_m,buff_peak_N,draft_peak_N,broken,derailed,cause\n";
}

void write_csv_rows(std::ostream& out, const Snapshot& s) {
  std::string text;
  for (std::size_t k = 0; k < s.cars.size(); ++k) {
    const CarSnapshot& c = s.cars[k];
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{:d},{:d},{},{},", s.time, k + 1, c.x, c.y,
                   c.theta, c.vx, c.vy, c.omega, c.past_pod, c.off_track, c.front_truck_offset, c.rear_truck_offset);
    if (k < s.couplers.size()) {
      const CouplerSnapshot& b = s.couplers[k];
      fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{:d}", b.gap, b.angle, b.axial_force,
                     b.lateral_force, b.swing_lead, b.swing_trail, b.moment_lead, b.moment_trail, b.buff_peak,
                     b.draft_peak, b.broken);
    } else {
      text += ",,,,,,,,,,";
    }
    fmt::format_to(std::back_inserter(text), ",{:d},{}\n", c.derailed, outcome::to_string(c.cause));
  }
  out << text;
}

}  // namespace train_derail::simulation
