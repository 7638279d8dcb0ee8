// The beginnings of motions that both engines are to agree on, and the numbers that play a role in them.
#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "spatial_fixtures.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail::early {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kInfinity;
using test::at;
using test::turned;

struct Case {
  const char* name;
  inputs::Scenario scenario;
  std::vector<model::SpatialMotion> start;
  double until;
  multibody::Steps whole = {};
};
inline const multibody::Steps kForBlows{multibody::Steps().step, 1e-7, 5e-5};

/// Loaded tank cars on a bank of 3 m, with every part that the second opinion has.
inline inputs::Scenario on_the_bank(int cars) {
  inputs::Scenario s = test::accident(cars);
  s.model = inputs::Model::spatial;
  s.contact.law = inputs::ContactLaw::none;
  s.brakes.force = s.brakes.rolling_resistance = 0.0;
  s.initial.perturbation = {};
  s.rails.derail_ratio = 1e3;
  s.rails.torn_length = 0.0;
  s.rails.flange_height = kInfinity;
  s.coupler.break_draft = s.coupler.break_swing = s.coupler.break_twist = kInfinity;
  s.coupler.vertical_hold = kInfinity;
  s.coupler.draft_gear_travel = 0.02;  // soon used up
  s.terrain.bank_left = 3.0;
  return s;
}
/// Centre of mass of a car that stands on the crown.
inline Vector3d standing(const inputs::Scenario& s, double x, double y) {
  return {x, y, test::height_of(s) - s.terrain.rail_height};
}

/// Thrown off the crown sideways, turning; it goes over on the bank.
inline Case one_car() {
  inputs::Scenario s = on_the_bank(1);
  s.terrain.ballast_height = 0.3;
  s.consist[0].underframe_height = 0.25;  // low enough to come to the ground as it goes over
  return {"one car",
          s,
          {at(standing(s, 50.0, 0.5), turned(0.2, Vector3d::UnitZ()), {6.0, 4.0, 0.0}, {-0.3, 0.0, 0.4})},
          1.8,
          {2e-5}};
}
/// The lead car leaves the crown and pulls the next one round.
inline Case two_cars() {
  const inputs::Scenario s = on_the_bank(2);
  return {"two cars",
          s,
          {at(standing(s, 60.0, 1.0), turned(0.15, Vector3d::UnitZ()), {9.0, 2.5, 0.0}, {-0.2, 0.0, 0.3}),
           at(standing(s, 60.0 - test::kPitch, 0.0), Matrix3d::Identity(), {10.0, 0.0, 0.0})},
          2.0};
}
/// How far a car's centre is behind the next one's if it stands that much aside of it and the coupler is at rest.
inline double behind(double aside) {
  const double length = inputs::Coupler{}.length;
  return test::kPitch - length + std::sqrt(length * length - aside * aside);
}
/// The first car goes over on the bank and takes the others, which have only come to its edge, along. The farther from
/// the track, the faster they go sideways.
inline Case three_cars() {
  const inputs::Scenario s = on_the_bank(3);
  const auto car = [&](double x, double aside, double roll_rate) {
    return at(standing(s, x, aside), Matrix3d::Identity(), {8.0, aside, 0.0}, {roll_rate, 0.0, 0.0});
  };
  const double second = 80.0 - behind(0.3), third = second - behind(0.2);
  return {"three cars", s, {car(80.0, 1.9, -3.0), car(second, 1.6, 0.0), car(third, 1.4, 0.0)}, 2.0};
}
/// Rocking on the rails, the train comes to their end: truck after truck drops to the ground.
inline Case off_the_rails() {
  const inputs::Scenario s = on_the_bank(3);
  const double height = test::height_of(s);
  const auto car = [&](int k) {
    const double way = k % 2 == 0 ? 1.0 : -1.0;
    return at({-8.0 - k * (test::kPitch - 0.05), 0.005 * way, height + 0.01 * way}, Matrix3d::Identity(),
              {12.0 + k, 0.0, 0.0}, {0.1 * way, 0.02, 0.05});
  };
  return {"off the rails", s, {car(0), car(1), car(2)}, 2.0};
}

/// On the rails, one higher than the next, cars run into each other: butts hold them level, or do not.
inline Case in_buff() {
  Case c = off_the_rails();
  c.name = "in buff";
  c.until = 0.5;
  const double height = test::height_of(c.scenario);
  c.start.clear();
  for (int k = 0; k < 3; ++k)
    c.start.push_back(at({-60.0 - k * (test::kPitch - 0.03), 0.0, height + (k == 1 ? 0.03 : -0.02)},
                         Matrix3d::Identity(), {10.0 + 0.6 * k, 0.0, 0.0}));
  return c;
}

/// Uphill on the rails, two cars roll slower and slower until their rolling resistance holds them.
inline Case uphill() {
  Case c = off_the_rails();
  c.name = "uphill";
  c.until = 1.2;
  c.scenario = on_the_bank(2);
  c.scenario.track.grade = 0.02;
  c.scenario.brakes.rolling_resistance = 0.03;
  c.scenario.terrain.rest_speed = 0.0;  // Simbody does not lay still what hardly moves
  c.scenario.stop.speed = 1e-6;
  c.start.clear();
  for (int k = 0; k < 2; ++k)
    c.start.push_back(
        at({-60.0 - k * test::kPitch, 0.0, test::height_of(c.scenario)}, Matrix3d::Identity(), {0.35, 0.0, 0.0}));
  return c;
}

/// The same three cars with couplers of usual strength: one is twisted off.
inline Case a_coupler_breaks() {
  Case c = three_cars();
  c.name = "a coupler breaks";
  c.until = 1.0;
  const inputs::Coupler usual;
  c.scenario.coupler.break_twist = usual.break_twist;
  c.scenario.coupler.vertical_hold = usual.vertical_hold;
  c.scenario.coupler.break_draft = 650.0 * inputs::kKip;
  c.scenario.coupler.break_swing = 45.0 * inputs::kDegree;
  c.scenario.coupler.slip_height = 0.25;
  return c;
}

/// Bodies that press on each other. The coupler breaks at once and does nothing until then.
inline inputs::Scenario with_contact() {
  inputs::Scenario s = on_the_bank(2);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.restitution = 0.4;
  s.contact.crush_force = 300.0 * inputs::kKip;
  s.contact.side_crush_force = 250.0 * inputs::kKip;
  s.coupler.draft_gear_travel = s.coupler.damping_ratio = 0.0;
  s.coupler.swing_stiffness = s.coupler.pitch_stiffness = s.coupler.roll_stiffness = 0.0;
  s.coupler.stiffness = 1e3;
  s.coupler.break_draft = 100.0;
  return s;
}
/// A car runs into the side of one that lies across its way.
inline Case into_a_side() {
  const inputs::Scenario s = with_contact();
  return {"into a side",
          s,
          {at(standing(s, 60.0, 0.5), turned(1.2, Vector3d::UnitZ()), {0.0, 0.0, 0.0}),
           at(standing(s, 48.8, 0.2), turned(0.1, Vector3d::UnitZ()), {3.5, 0.0, 0.0}, {0.0, 0.0, 0.1})},
          0.38,
          kForBlows};
}
/// The same car meets the end of one that stands nearly in line with it.
inline Case into_an_end() {
  Case c = into_a_side();
  c.name = "into an end";
  c.until = 0.46;
  const inputs::Scenario& s = c.scenario;
  c.start = {at(standing(s, 60.0, 0.5), turned(0.15, Vector3d::UnitZ()), {1.0, 0.0, 0.0}, {0.3, 0.0, 0.0}),
             at(standing(s, 60.0 - 17.2, 0.1), turned(0.02, Vector3d::UnitZ()), {2.5, 0.0, 0.0})};
  return c;
}
/// One that has gone over lies across an edge of the other: edges that cross, and floors.
inline Case on_top() {
  Case c = into_a_side();
  c.name = "on top";
  c.until = 0.6;
  const inputs::Scenario& s = c.scenario;
  c.start = {at(standing(s, 60.0, 0.0), turned(0.0, Vector3d::UnitZ()), {0.0, 0.0, 0.0}),
             at(standing(s, 62.0, 1.0) + Vector3d(0.0, 0.0, 3.2), turned(1.3, Vector3d(0.1, 0.05, 1.0).normalized()),
                {0.0, 0.0, -1.0}, {0.2, 0.1, 0.0})};
  return c;
}

/// A coupler of a train on the rails is pulled off: the signal runs along the pipe, and cars brake one after the other.
inline Case brakes() {
  inputs::Scenario s = on_the_bank(3);
  s.brakes.force = 0.1;
  s.brakes.dead_time = 0.2;
  s.brakes.build_up_time = 0.5;
  s.brakes.propagation_speed = 100.0;
  s.brakes.radio_delay = 0.05;
  s.coupler.break_draft = 1e4;
  s.consist[0].brake_share = 0.9;
  inputs::CarBlock last = s.consist[0];
  s.consist[0].count = 2;
  last.count = 1;
  last.loaded_weight = 1.1 * last.weight;
  last.brake_source = inputs::BrakeSource::remote;
  s.consist.push_back(last);
  Case c{"brakes", s, {}, 1.2};
  for (int k = 0; k < 3; ++k)
    c.start.push_back(
        at({-100.0 - k * test::kPitch - (k > 0 ? 0.5 * s.coupler.slack + 1e-3 : 0.0), 0.0, test::height_of(s)},
           Matrix3d::Identity(), {10.0, 0.0, 0.0}));
  return c;
}

/// Cars thrown sideways on the rails: a truck is overloaded, leaves them and tears them; others come to that place.
inline Case pushed_off() {
  inputs::Scenario s = on_the_bank(2);
  s.rails.derail_ratio = 1.2;
  s.rails.derail_time = 0.025;
  s.rails.torn_length = 2.0;
  Case c{"pushed off", s, {}, 1.0, kForBlows};
  for (int k = 0; k < 2; ++k)
    c.start.push_back(at({-70.0 - k * test::kPitch, k == 0 ? 0.07 : 0.0, test::height_of(s)}, Matrix3d::Identity(),
                         {12.0, 0.0, 0.0}, {k == 0 ? 0.1 : 0.0, 0.0, k == 0 ? 0.02 : 0.0}));
  return c;
}
/// A car on the rails rocks so hard that the wheels of one side come out.
inline Case rocked_off() {
  inputs::Scenario s = on_the_bank(1);
  s.rails.derail_ratio = 50.0;  // not by force
  s.rails.flange_height = 0.03;
  s.rails.derail_time = 0.2;  // longer than the rails push to one side
  return {"rocked off",
          s,
          {at({-70.0, 0.0, test::height_of(s)}, Matrix3d::Identity(), {12.0, 0.0, 0.0}, {4.0, 0.0, 0.0})},
          0.8};
}

/// One part of the scenario changed by a fiftieth.
struct Change {
  const char* name;
  Case (*of)();  // where it plays a role
  void (*change)(inputs::Scenario&);
};
inline constexpr double kMore = 1.02;
inline model::Car car_of(const inputs::Scenario& s) { return model::expand(s.consist)[0]; }
inline const Change kChanges[] = {
    {"mass", one_car, [](inputs::Scenario& s) { s.consist[0].weight *= kMore; }},
    {"roll inertia", one_car, [](inputs::Scenario& s) { s.consist[0].roll_inertia = kMore * car_of(s).roll_inertia; }},
    {"yaw inertia", one_car, [](inputs::Scenario& s) { s.consist[0].yaw_inertia = kMore * car_of(s).yaw_inertia; }},
    {"height", one_car, [](inputs::Scenario& s) { s.consist[0].centre_height = kMore * car_of(s).centre_height; }},
    {"width", one_car, [](inputs::Scenario& s) { s.consist[0].width *= kMore; }},
    {"trucks", one_car,
     [](inputs::Scenario& s) { s.consist[0].truck_weight = kMore * test::kGravity * car_of(s).truck_mass; }},
    {"underframe", one_car,
     [](inputs::Scenario& s) { s.consist[0].underframe_height = kMore * car_of(s).underframe_height; }},
    {"underframe width", one_car,
     [](inputs::Scenario& s) { s.consist[0].underframe_width = kMore * car_of(s).underframe_width; }},
    {"spring", one_car, [](inputs::Scenario& s) { s.suspension.stiffness *= kMore; }},
    {"damper", one_car, [](inputs::Scenario& s) { s.suspension.damping_ratio *= kMore; }},
    {"half base", one_car, [](inputs::Scenario& s) { s.suspension.half_base *= kMore; }},
    {"bank", one_car, [](inputs::Scenario& s) { s.terrain.bank_slope *= kMore; }},
    {"crown", one_car, [](inputs::Scenario& s) { s.terrain.crown *= kMore; }},
    {"ballast", one_car, [](inputs::Scenario& s) { s.terrain.ballast_height *= kMore; }},
    {"ballast width", one_car, [](inputs::Scenario& s) { s.terrain.ballast_half_width *= kMore; }},
    {"ballast slope", one_car, [](inputs::Scenario& s) { s.terrain.ballast_slope *= kMore; }},
    {"bank height", one_car, [](inputs::Scenario& s) { s.terrain.bank_left *= kMore; }},
    {"body friction", one_car, [](inputs::Scenario& s) { s.terrain.body_friction *= kMore; }},
    {"ground stiffness", one_car, [](inputs::Scenario& s) { s.terrain.body_stiffness *= kMore; }},
    {"ground damping", one_car, [](inputs::Scenario& s) { s.terrain.body_damping_ratio *= kMore; }},
    {"broadside", one_car, [](inputs::Scenario& s) { s.ground.broadside_friction *= kMore; }},
    {"in line", two_cars, [](inputs::Scenario& s) { s.ground.in_line_friction *= kMore; }},
    {"slip ratio", two_cars, [](inputs::Scenario& s) { s.ground.slip_ratio *= kMore; }},
    {"far", two_cars, [](inputs::Scenario& s) { s.ground.far_distance *= kMore; }},
    {"slack", two_cars, [](inputs::Scenario& s) { s.coupler.slack *= kMore; }},
    {"draft gear", two_cars, [](inputs::Scenario& s) { s.coupler.draft_gear_stiffness *= kMore; }},
    {"travel", two_cars, [](inputs::Scenario& s) { s.coupler.draft_gear_travel *= kMore; }},
    {"stiffness", two_cars, [](inputs::Scenario& s) { s.coupler.stiffness *= kMore; }},
    {"coupler damper", two_cars, [](inputs::Scenario& s) { s.coupler.damping_ratio *= kMore; }},
    {"coupler height", two_cars, [](inputs::Scenario& s) { s.coupler.height *= kMore; }},
    {"swing limit", two_cars, [](inputs::Scenario& s) { s.coupler.swing_limit *= kMore; }},
    {"swing stop", two_cars, [](inputs::Scenario& s) { s.coupler.swing_stiffness *= kMore; }},
    {"pitch limit", three_cars, [](inputs::Scenario& s) { s.coupler.pitch_limit = kMore * 7.0 * inputs::kDegree; }},
    {"pitch stop", three_cars, [](inputs::Scenario& s) { s.coupler.pitch_stiffness *= kMore; }},
    {"roll limit", three_cars, [](inputs::Scenario& s) { s.coupler.roll_limit = kMore * 10.0 * inputs::kDegree; }},
    {"roll stop", three_cars, [](inputs::Scenario& s) { s.coupler.roll_stiffness *= kMore; }},
    {"butt height", in_buff, [](inputs::Scenario& s) { s.coupler.butt_height *= kMore; }},
    {"rolling resistance", uphill, [](inputs::Scenario& s) { s.brakes.rolling_resistance *= kMore; }},
    {"grade", uphill, [](inputs::Scenario& s) { s.track.grade *= kMore; }},
    {"rails", off_the_rails, [](inputs::Scenario& s) { s.rails.stiffness *= kMore; }},
    {"rail damping", off_the_rails, [](inputs::Scenario& s) { s.rails.damping_ratio *= kMore; }},
    {"contact stiffness", into_a_side, [](inputs::Scenario& s) { s.contact.stiffness *= kMore; }},
    {"restitution", on_top, [](inputs::Scenario& s) { s.contact.restitution *= kMore; }},
    {"friction of bodies", into_a_side, [](inputs::Scenario& s) { s.contact.friction *= kMore; }},
    {"crush force of sides", into_a_side, [](inputs::Scenario& s) { s.contact.side_crush_force *= kMore; }},
    {"crush force", into_an_end, [](inputs::Scenario& s) { s.contact.crush_force *= kMore; }},
    {"length", into_an_end, [](inputs::Scenario& s) { s.consist[0].length *= kMore; }},
    {"roof", on_top, [](inputs::Scenario& s) { s.consist[0].roof_height = kMore * car_of(s).roof_height; }},
    {"floor", on_top, [](inputs::Scenario& s) { s.consist[0].floor_height = kMore * car_of(s).floor_height; }},
    {"brake force", brakes, [](inputs::Scenario& s) { s.brakes.force *= kMore; }},
    {"brake share", brakes, [](inputs::Scenario& s) { s.consist[0].brake_share *= kMore; }},
    {"loaded weight", brakes, [](inputs::Scenario& s) { *s.consist[1].loaded_weight *= kMore; }},
    {"dead time", brakes, [](inputs::Scenario& s) { s.brakes.dead_time *= kMore; }},
    {"build-up", brakes, [](inputs::Scenario& s) { s.brakes.build_up_time *= kMore; }},
    {"signal", brakes, [](inputs::Scenario& s) { s.brakes.propagation_speed *= kMore; }},
    {"radio", brakes, [](inputs::Scenario& s) { s.brakes.radio_delay *= kMore; }},
    {"L/V", pushed_off, [](inputs::Scenario& s) { s.rails.derail_ratio *= kMore; }},
    {"time of overload", pushed_off, [](inputs::Scenario& s) { s.rails.derail_time *= kMore; }},
    {"torn length", pushed_off, [](inputs::Scenario& s) { s.rails.torn_length *= kMore; }},
    {"flange", rocked_off, [](inputs::Scenario& s) { s.rails.flange_height *= kMore; }},
    {"rail height", off_the_rails, [](inputs::Scenario& s) { s.terrain.rail_height *= kMore; }},
};

}  // namespace train_derail::early
