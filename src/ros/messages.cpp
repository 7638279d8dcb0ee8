#include "train_derail/ros/messages.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/ros/message_fields.hpp"
#include "train_derail/scene/car_shape.hpp"
#include "train_derail/simulation/fields.hpp"

namespace train_derail::ros_face {

namespace {

std::uint8_t to_constant(model::Face face) {
  switch (face) {
    case model::Face::front: return Impact::FRONT;
    case model::Face::rear: return Impact::REAR;
    case model::Face::left: return Impact::LEFT;
    case model::Face::right: return Impact::RIGHT;
    case model::Face::top: return Impact::TOP;
    case model::Face::bottom: return Impact::BOTTOM;
  }
  return 0;
}

model::Face to_face(std::uint8_t constant) {
  switch (constant) {
    case Impact::REAR: return model::Face::rear;
    case Impact::LEFT: return model::Face::left;
    case Impact::RIGHT: return model::Face::right;
    case Impact::TOP: return model::Face::top;
    case Impact::BOTTOM: return model::Face::bottom;
    default: return model::Face::front;
  }
}

/// Width of a bin of the impacts' histogram [m/s].
constexpr double kSpeedBin = 5.0 * inputs::kMph;

void fill_histogram(Impacts& m) {
  for (const Impact& impact : m.impacts) {
    const auto bin = static_cast<std::size_t>(std::max(0.0, impact.closing_speed_normal) / kSpeedBin);
    if (bin >= m.counts.size()) m.counts.resize(bin + 1, 0);
    ++m.counts[bin];
  }
  if (m.counts.empty()) return;
  for (std::size_t i = 0; i <= m.counts.size(); ++i) m.bin_edges.push_back(static_cast<double>(i) * kSpeedBin);
}

/// Of the point of the car that is `below` its centre of mass [m], with the height that the point has above where it is
/// on the rails. `position`: a Point or a Vector3.
template <class Position>
void set_pose(const simulation::CarSnapshot& car, double below, Position& position,
              geometry_msgs::Quaternion& orientation) {
  // The car's own vertical axis; exactly (0, 0, 1) in models of the plane.
  position.x = car.x - below * 2.0 * (car.qx * car.qz + car.qw * car.qy);
  position.y = car.y - below * 2.0 * (car.qy * car.qz - car.qw * car.qx);
  position.z = car.z + below * 2.0 * (car.qx * car.qx + car.qy * car.qy);
  orientation.x = car.qx;
  orientation.y = car.qy;
  orientation.z = car.qz;
  orientation.w = car.qw;
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
    fill(to, simulation::car_fields(), from);
    set_pose(from, 0.0, to.pose.position, to.pose.orientation);
    to.twist.linear.x = from.vx;
    to.twist.linear.y = from.vy;
    to.twist.linear.z = from.vz;
    to.twist.angular.x = from.wx;
    to.twist.angular.y = from.wy;
    to.twist.angular.z = from.omega;
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
    m.couplers[i].number = static_cast<std::uint32_t>(i + 1);
    fill(m.couplers[i], simulation::coupler_fields(), couplers[i]);
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
    to.z = from.z;
    to.closing_speed = from.closing_speed;
    to.closing_speed_normal = from.closing_speed_normal;
    to.impulse = from.impulse;
    to.peak_force = from.peak_force;
  }
  fill_histogram(m);
  return m;
}

PileUp to_message(const scene::Heap& heap, double time, const std_msgs::Header& header, std::uint32_t run_id) {
  PileUp m;
  m.header = header;
  m.run_id = run_id;
  m.time = time;
  m.pose.position.x = heap.x;
  m.pose.position.y = heap.y;
  m.pose.position.z = heap.z;
  m.pose.orientation.z = std::sin(0.5 * heap.yaw);
  m.pose.orientation.w = std::cos(0.5 * heap.yaw);
  m.length = heap.length;
  m.width = heap.width;
  m.first_car = static_cast<std::uint32_t>(heap.first_car);
  m.last_car = static_cast<std::uint32_t>(heap.last_car);
  return m;
}

std::string why_ended(const outcome::Outcome& o) {
  return o.message.empty() ? std::string(outcome::kEndedTexts[static_cast<std::size_t>(o.ended)]) : o.message;
}

Outcome to_message(const outcome::Outcome& o, const std_msgs::Header& header, std::uint32_t run_id) {
  Outcome m;
  m.header = header;
  m.run_id = run_id;
  fill(m, outcome::outcome_fields(), o);
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
    m.car_length.push_back(car.length);
    m.car_width.push_back(car.width);
    m.car_height.push_back(car.roof_height);
    m.car_body.push_back(car.body);
  }
  m.track_heading = s.track.heading.value_or(std::numeric_limits<double>::quiet_NaN());
  m.speed = s.initial.speed;
  m.yaw_rate = s.initial.yaw_rate;
  m.on_track_friction = s.ground.on_track_friction;
  m.off_track_friction = s.ground.off_track_friction;
  m.on_track_law = inputs::key_value(s, "ground.on_track_law").value;
  m.coupler_length = s.coupler.length;
  m.coupler_slack = s.coupler.slack;
  m.coupler_stiffness = s.coupler.stiffness;
  m.coupler_swing_limit = s.coupler.swing_limit;
  m.off_track_threshold = s.outcome.off_track_threshold;
  m.output_interval = s.output.interval;
  inputs::Scenario settled = s;
  settled.model = inputs::model_of(s);
  m.model = inputs::key_value(settled, "model").value;
  m.method = inputs::key_value(s, "solver.method").value;
  m.rtol = s.solver.rtol;
  m.atol = s.solver.atol;
  m.seed = s.initial.perturbation.seed;
  return m;
}

static_assert(int{scene::kCarPastPod} == int{Event::CAR_PAST_POD});
static_assert(int{scene::kCarOffTrack} == int{Event::CAR_OFF_TRACK});
static_assert(int{scene::kContact} == int{Event::CONTACT});
static_assert(int{scene::kCouplerPeak} == int{Event::COUPLER_PEAK});
static_assert(int{scene::kEnd} == int{Event::END});
static_assert(int{scene::kCarDerailed} == int{Event::CAR_DERAILED});
static_assert(int{scene::kCouplerBroken} == int{Event::COUPLER_BROKEN});

Event to_message(const scene::Occurrence& o, const std_msgs::Header& header, std::uint32_t run_id) {
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

std::vector<simulation::CarSnapshot> from_message(const CarStates& message) {
  std::vector<simulation::CarSnapshot> cars;
  cars.reserve(message.cars.size());
  for (const CarState& from : message.cars) {
    simulation::CarSnapshot& to = cars.emplace_back(read<simulation::CarSnapshot>(from, simulation::car_fields()));
    to.x = from.pose.position.x;
    to.y = from.pose.position.y;
    to.z = from.pose.position.z;
    to.qx = from.pose.orientation.x;
    to.qy = from.pose.orientation.y;
    to.qz = from.pose.orientation.z;
    to.qw = from.pose.orientation.w;
    to.vx = from.twist.linear.x;
    to.vy = from.twist.linear.y;
    to.vz = from.twist.linear.z;
    to.wx = from.twist.angular.x;
    to.wy = from.twist.angular.y;
    to.omega = from.twist.angular.z;
  }
  return cars;
}

std::vector<simulation::CouplerSnapshot> from_message(const CouplerForces& message) {
  std::vector<simulation::CouplerSnapshot> couplers;
  couplers.reserve(message.couplers.size());
  for (const CouplerForce& from : message.couplers) {
    couplers.push_back(read<simulation::CouplerSnapshot>(from, simulation::coupler_fields()));
  }
  return couplers;
}

std::vector<model::Impact> from_message(const Impacts& message) {
  std::vector<model::Impact> impacts;
  impacts.reserve(message.impacts.size());
  for (const Impact& from : message.impacts) {
    impacts.push_back({from.time, from.end, static_cast<Eigen::Index>(from.car_a) - 1,
                       static_cast<Eigen::Index>(from.car_b) - 1, to_face(from.face_a), to_face(from.face_b),
                       from.along_a, from.along_b, from.x, from.y, from.z, from.closing_speed,
                       from.closing_speed_normal, from.impulse, from.peak_force});
  }
  return impacts;
}

outcome::Outcome from_message(const Outcome& message) {
  return read<outcome::Outcome>(message, outcome::outcome_fields());
}

scene::Occurrence from_message(const Event& message) {
  return {message.type,
          message.time,
          static_cast<int>(message.car),
          static_cast<int>(message.other_car),
          static_cast<int>(message.coupler),
          message.value,
          message.text};
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

tf2_msgs::TFMessage to_transforms(const std::vector<model::Car>& train,
                                  const std::vector<simulation::CarSnapshot>& cars, const std_msgs::Header& header,
                                  const Frames& frames) {
  tf2_msgs::TFMessage m;
  m.transforms.reserve(cars.size() + 1);
  for (std::size_t i = 0; i < cars.size(); ++i) {
    geometry_msgs::TransformStamped& t = m.transforms.emplace_back();
    t.header = header;
    t.child_frame_id = frames.car(static_cast<int>(i) + 1);
    set_pose(cars[i], train[i].centre_height, t.transform.translation, t.transform.rotation);
  }
  return m;
}

}  // namespace train_derail::ros_face
