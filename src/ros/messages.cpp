#include "train_derail/ros/messages.hpp"

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/writer.hpp"

namespace train_derail::ros_face {

namespace {

std::uint8_t to_constant(outcome::Ended ended) {
  switch (ended) {
    case outcome::Ended::running: return Outcome::RUNNING;
    case outcome::Ended::at_rest: return Outcome::AT_REST;
    case outcome::Ended::time_max: return Outcome::TIME_MAX;
    case outcome::Ended::integration_failed: return Outcome::INTEGRATION_FAILED;
  }
  return Outcome::RUNNING;
}

std::uint8_t to_constant(model::Cause cause) {
  switch (cause) {
    case model::Cause::none: return CarState::NONE;
    case model::Cause::pod: return CarState::POD;
    case model::Cause::lateral: return CarState::LATERAL;
    case model::Cause::torn_track: return CarState::TORN_TRACK;
  }
  return CarState::NONE;
}

std::uint8_t to_constant(model::Face face) {
  switch (face) {
    case model::Face::front: return Impact::FRONT;
    case model::Face::rear: return Impact::REAR;
    case model::Face::left: return Impact::LEFT;
    case model::Face::right: return Impact::RIGHT;
  }
  return 0;
}

/// Width of a bin of the impacts' histogram [m/s].
constexpr double kSpeedBin = 5.0 * inputs::kMph;

void fill_histogram(Impacts& m) {
  for (const Impact& impact : m.impacts) {
    const auto bin = static_cast<std::size_t>(std::max(0.0, impact.closing_normal) / kSpeedBin);
    if (bin >= m.counts.size()) m.counts.resize(bin + 1, 0);
    ++m.counts[bin];
  }
  if (m.counts.empty()) return;
  for (std::size_t i = 0; i <= m.counts.size(); ++i) m.bin_edges.push_back(static_cast<double>(i) * kSpeedBin);
}

const char* to_text(inputs::OnTrackLaw law) {
  switch (law) {
    case inputs::OnTrackLaw::isotropic: return "isotropic";
    case inputs::OnTrackLaw::along_track: return "along_track";
    case inputs::OnTrackLaw::guided: return "guided";
    case inputs::OnTrackLaw::rails: return "rails";
  }
  return "";
}

const char* to_text(inputs::Method method) {
  switch (method) {
    case inputs::Method::cash_karp: return "cash_karp";
    case inputs::Method::dormand_prince: return "dormand_prince";
    case inputs::Method::bdf: return "bdf";
    case inputs::Method::semi_implicit: return "semi_implicit";
  }
  return "";
}

}  // namespace

CarStates to_message(const std::vector<simulation::CarSnapshot>& cars, double time, const std_msgs::Header& header,
                     std::uint32_t run_id) {
  CarStates m;
  m.header = header;
  m.run_id = run_id;
  m.time = time;
  m.cars.resize(cars.size());
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const simulation::CarSnapshot& from = cars[i];
    CarState& to = m.cars[i];
    to.number = static_cast<std::uint32_t>(i + 1);
    to.x = from.x;
    to.y = from.y;
    to.theta = from.theta;
    to.vx = from.vx;
    to.vy = from.vy;
    to.omega = from.omega;
    to.past_pod = from.past_pod;
    to.off_track = from.off_track;
    to.front_truck_offset = from.front_truck_offset;
    to.rear_truck_offset = from.rear_truck_offset;
    to.derailed = from.derailed;
    to.cause = to_constant(from.cause);
  }
  return m;
}

CouplerForces to_message(const std::vector<simulation::CouplerSnapshot>& couplers, double time,
                         const std_msgs::Header& header, std::uint32_t run_id) {
  CouplerForces m;
  m.header = header;
  m.run_id = run_id;
  m.time = time;
  m.couplers.resize(couplers.size());
  for (std::size_t i = 0; i < couplers.size(); ++i) {
    const simulation::CouplerSnapshot& from = couplers[i];
    CouplerForce& to = m.couplers[i];
    to.number = static_cast<std::uint32_t>(i + 1);
    to.gap = from.gap;
    to.angle = from.angle;
    to.axial_force = from.axial_force;
    to.lateral_force = from.lateral_force;
    to.swing_lead = from.swing_lead;
    to.swing_trail = from.swing_trail;
    to.moment_lead = from.moment_lead;
    to.moment_trail = from.moment_trail;
    to.buff_peak = from.buff_peak;
    to.draft_peak = from.draft_peak;
    to.broken = from.broken;
  }
  return m;
}

Impacts to_message(const std::vector<model::Impact>& impacts, double time, const std_msgs::Header& header,
                   std::uint32_t run_id) {
  Impacts m;
  m.header = header;
  m.run_id = run_id;
  m.time = time;
  m.impacts.resize(impacts.size());
  for (std::size_t i = 0; i < impacts.size(); ++i) {
    const model::Impact& from = impacts[i];
    Impact& to = m.impacts[i];
    to.time = from.time;
    to.end = from.end;
    to.car_a = static_cast<std::uint32_t>(from.car_a + 1);
    to.car_b = static_cast<std::uint32_t>(from.car_b + 1);
    to.face_a = to_constant(from.face_a);
    to.face_b = to_constant(from.face_b);
    to.along_a = from.along_a;
    to.along_b = from.along_b;
    to.x = from.x;
    to.y = from.y;
    to.closing_speed = from.closing_speed;
    to.closing_normal = from.closing_normal;
    to.impulse = from.impulse;
    to.peak_force = from.peak_force;
  }
  fill_histogram(m);
  return m;
}

Outcome to_message(const outcome::Outcome& o, const std_msgs::Header& header, std::uint32_t run_id) {
  Outcome m;
  m.header = header;
  m.run_id = run_id;
  m.ended = to_constant(o.ended);
  m.message = o.message;
  m.warnings = o.warnings;
  m.stop_time = o.stop_time;
  m.cars = static_cast<std::uint32_t>(o.cars);
  m.cars_past_pod = static_cast<std::uint32_t>(o.cars_past_pod);
  m.cars_derailed = static_cast<std::uint32_t>(o.cars_derailed);
  m.derailed_by_pod = static_cast<std::uint32_t>(o.derailed_by.pod);
  m.derailed_by_lateral = static_cast<std::uint32_t>(o.derailed_by.lateral);
  m.derailed_by_torn_track = static_cast<std::uint32_t>(o.derailed_by.torn_track);
  m.cars_off_track = static_cast<std::uint32_t>(o.cars_off_track);
  m.closing_speed_max = o.closing_speed_max.speed;
  m.closing_normal_speed = o.closing_speed_max.normal_speed;
  m.closing_car_a = static_cast<std::uint32_t>(o.closing_speed_max.car_a);
  m.closing_car_b = static_cast<std::uint32_t>(o.closing_speed_max.car_b);
  m.closing_time = o.closing_speed_max.time;
  m.closing_x = o.closing_speed_max.x;
  m.closing_y = o.closing_speed_max.y;
  m.touches = static_cast<std::uint32_t>(o.touches);
  m.impacts = static_cast<std::uint32_t>(o.impacts.count);
  m.impact_speed_max = o.impacts.closing_normal_max;
  m.impact_force_peak = o.impacts.peak_force;
  m.impact_impulse_max = o.impacts.impulse_max;
  m.relative_speed_max = o.relative_speed_max.speed;
  m.relative_speed_coupler = static_cast<std::uint32_t>(o.relative_speed_max.coupler);
  m.relative_speed_time = o.relative_speed_max.time;
  m.coupler_buff_peak = o.coupler_buff_peak.force;
  m.coupler_buff_peak_coupler = static_cast<std::uint32_t>(o.coupler_buff_peak.coupler);
  m.coupler_buff_peak_time = o.coupler_buff_peak.time;
  m.coupler_draft_peak = o.coupler_draft_peak.force;
  m.coupler_draft_peak_coupler = static_cast<std::uint32_t>(o.coupler_draft_peak.coupler);
  m.coupler_draft_peak_time = o.coupler_draft_peak.time;
  m.couplers_broken = static_cast<std::uint32_t>(o.couplers_broken);
  m.blockage_force = o.blockage_force;
  m.pile_up_length = o.pile_up.length;
  m.pile_up_width = o.pile_up.width;
  m.pile_up_area = o.pile_up.area;
  m.cars_across = static_cast<std::uint32_t>(o.pile_up.cars_across);
  m.groups = static_cast<std::uint32_t>(o.pile_up.groups);
  m.main_pile_cars = static_cast<std::uint32_t>(o.pile_up.main_cars);
  m.main_pile_length = o.pile_up.main_length;
  m.energy_initial = o.energy_initial;
  m.energy_kinetic_translation = o.energy.kinetic_translation;
  m.energy_kinetic_rotation = o.energy.kinetic_rotation;
  m.energy_coupler_axial = o.energy.coupler_axial;
  m.energy_coupler_swing = o.energy.coupler_swing;
  m.work_on_track = o.energy.work_on_track;
  m.work_off_track = o.energy.work_off_track;
  m.work_rails = o.energy.work_rails;
  m.work_coupler_damping = o.energy.work_coupler_damping;
  m.work_coupler_break = o.energy.work_coupler_break;
  m.work_impact_normal = o.energy.work_impact_normal;
  m.work_impact_friction = o.energy.work_impact_friction;
  m.work_grade = o.energy.work_grade;
  m.work_kicks = o.energy.work_kicks;
  m.energy_residual = o.energy_residual;
  m.steps = static_cast<std::uint64_t>(o.solver.steps);
  m.rejected_steps = static_cast<std::uint64_t>(o.solver.rejected_steps);
  m.rhs_evaluations = static_cast<std::uint64_t>(o.solver.rhs_evaluations);
  m.jacobian_evaluations = static_cast<std::uint64_t>(o.solver.jacobian_evaluations);
  return m;
}

Inputs to_message(const inputs::Scenario& s, const std::vector<model::Car>& cars, const std_msgs::Header& header,
                  std::uint32_t run_id) {
  Inputs m;
  m.header = header;
  m.run_id = run_id;
  m.title = s.title;
  m.yaml = inputs::to_yaml(s);
  m.cars = static_cast<std::uint32_t>(cars.size());
  m.train_length = static_cast<double>(cars.size() - 1) * s.coupler.length;
  for (const model::Car& car : cars) {
    m.train_length += car.length;
    m.train_mass += car.mass;
  }
  m.speed = s.initial.speed;
  m.yaw_rate = s.initial.yaw_rate;
  m.on_track_friction = s.ground.on_track_friction;
  m.off_track_friction = s.ground.off_track_friction;
  m.on_track_law = to_text(s.ground.on_track_law);
  m.coupler_length = s.coupler.length;
  m.coupler_slack = s.coupler.slack;
  m.coupler_stiffness = s.coupler.stiffness;
  m.coupler_swing_limit = s.coupler.swing_limit;
  m.off_track_threshold = s.outcome.off_track_threshold;
  m.output_interval = s.output.interval;
  m.method = to_text(s.solver.method);
  m.rtol = s.solver.rtol;
  m.atol = s.solver.atol;
  m.seed = s.initial.perturbation.seed;
  return m;
}

Event to_message(const Occurrence& o, const std_msgs::Header& header, std::uint32_t run_id) {
  Event m;
  m.header = header;
  m.run_id = run_id;
  m.time = o.time;
  m.type = static_cast<std::uint8_t>(o.type);
  m.car = static_cast<std::uint32_t>(o.car);
  m.other_car = static_cast<std::uint32_t>(o.other_car);
  m.coupler = static_cast<std::uint32_t>(o.coupler);
  m.value = o.value;
  m.text = o.text;
  return m;
}

geometry_msgs::TransformStamped make_transform(const std_msgs::Header& header, const std::string& child, double x,
                                               double y, double yaw) {
  geometry_msgs::TransformStamped t;
  t.header = header;
  t.child_frame_id = child;
  t.transform.translation.x = x;
  t.transform.translation.y = y;
  t.transform.rotation.z = std::sin(0.5 * yaw);
  t.transform.rotation.w = std::cos(0.5 * yaw);
  return t;
}

tf2_msgs::TFMessage to_transforms(const std::vector<simulation::CarSnapshot>& cars, const std_msgs::Header& header,
                                  const Frames& frames) {
  tf2_msgs::TFMessage m;
  m.transforms.reserve(cars.size() + 1);
  for (std::size_t i = 0; i < cars.size(); ++i) {
    m.transforms.push_back(
        make_transform(header, frames.car(static_cast<int>(i) + 1), cars[i].x, cars[i].y, cars[i].theta));
  }
  return m;
}

}  // namespace train_derail::ros_face
