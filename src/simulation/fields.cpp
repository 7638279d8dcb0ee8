#include "train_derail/simulation/fields.hpp"

#include "train_derail/fields/units.hpp"

namespace train_derail::simulation {

using namespace fields;

const Fields<CarSnapshot>& car_fields() {
  static const Fields<CarSnapshot> all = [] {
    Fields<CarSnapshot> f;
    f.add(
        "x", kLength, "along", "Centre of mass, along the track at the point of derailment.",
        [](auto& c) -> auto& { return c.x; });
    f.add(
        "y", kLength, "aside", "Centre of mass, left of the track at the point of derailment positive.",
        [](auto& c) -> auto& { return c.y; });
    f.add(
        "z", kLength, "up", "Centre of mass, above its height on the rails; 0 in models of the plane.",
        [](auto& c) -> auto& { return c.z; });
    f.add(
        "theta", kAngle, "heading", "Yaw against +x, counter-clockwise seen from above, not wrapped.",
        [](auto& c) -> auto& { return c.theta; });
    f.add(
        "qx", kRatio, "", "Orientation as a unit quaternion, first imaginary part.",
        [](auto& c) -> auto& { return c.qx; });
    f.add(
        "qy", kRatio, "", "Orientation as a unit quaternion, second imaginary part.",
        [](auto& c) -> auto& { return c.qy; });
    f.add(
        "qz", kRatio, "", "Orientation as a unit quaternion, third imaginary part.",
        [](auto& c) -> auto& { return c.qz; });
    f.add(
        "qw", kRatio, "", "Orientation as a unit quaternion, real part.", [](auto& c) -> auto& { return c.qw; });
    f.add(
        "vx", kSpeed, "speed along", "Velocity of the centre of mass, world frame.",
        [](auto& c) -> auto& { return c.vx; });
    f.add(
        "vy", kSpeed, "speed aside", "Velocity of the centre of mass, world frame.",
        [](auto& c) -> auto& { return c.vy; });
    f.add(
        "vz", kSpeed, "speed up", "Velocity of the centre of mass, world frame.",
        [](auto& c) -> auto& { return c.vz; });
    f.add(
        "wx", kYawRate, "", "Angular velocity about x, world frame.", [](auto& c) -> auto& { return c.wx; });
    f.add(
        "wy", kYawRate, "", "Angular velocity about y, world frame.", [](auto& c) -> auto& { return c.wy; });
    f.add(
        "omega", kYawRate, "yaw rate", "Angular velocity about z, counter-clockwise seen from above.",
        [](auto& c) -> auto& { return c.omega; });
    f.add(
        "front_truck_s", kLength, "front truck along the track",
        "Arc length along the centre line from the point of derailment.",
        [](auto& c) -> auto& { return c.front_truck.s; });
    f.add(
        "front_truck_offset", kLength, "front truck off the centre line",
        "Distance of the front truck from the centre line, left positive.",
        [](auto& c) -> auto& { return c.front_truck.offset; });
    f.add(
        "front_truck_height", kLength, "front truck above the rails",
        "Height of the front truck above the rails; 0 in models of the plane.",
        [](auto& c) -> auto& { return c.front_truck.height; });
    f.add(
        "front_truck_load", kForce, "load of the front truck", "Vertical force that the truck carries.",
        [](auto& c) -> auto& { return c.front_truck.load; });
    f.add(
        "rear_truck_s", kLength, "rear truck along the track",
        "Arc length along the centre line from the point of derailment.",
        [](auto& c) -> auto& { return c.rear_truck.s; });
    f.add(
        "rear_truck_offset", kLength, "rear truck off the centre line",
        "Distance of the rear truck from the centre line, left positive.",
        [](auto& c) -> auto& { return c.rear_truck.offset; });
    f.add(
        "rear_truck_height", kLength, "rear truck above the rails",
        "Height of the rear truck above the rails; 0 in models of the plane.",
        [](auto& c) -> auto& { return c.rear_truck.height; });
    f.add(
        "rear_truck_load", kForce, "load of the rear truck", "Vertical force that the truck carries.",
        [](auto& c) -> auto& { return c.rear_truck.load; });
    f.derive("tilt", kAngle, "tilt",
             "Angle between the car's own vertical axis and the vertical; 0 in models of the plane.",
             [](const CarSnapshot& c) { return c.tilt(); });
    f.add(
        "lateral_reach", kLength, "lateral reach", "Distance of its farthest corner from the centre line.",
        [](auto& c) -> auto& { return c.lateral_reach; });
    f.add(
        "past_pod", kNoUnit, "past the point",
        "The centre of mass has passed the point of derailment; not of cars that were ahead of it at the start.",
        [](auto& c) -> auto& { return c.past_pod; });
    f.add(
        "off_track", kNoUnit, "off the track",
        "A truck centre has been sideways by more than the scenario's outcome.off_track_threshold.",
        [](auto& c) -> auto& { return c.off_track; });
    f.add(
        "derailed", kNoUnit, "derailed", "A truck is off the rails; where rails never yield: past_pod.",
        [](auto& c) -> auto& { return c.derailed; });
    f.add(
         "cause", kNoUnit, "cause", "What took its first truck off the rails; none where rails never yield.",
         [](auto& c) -> auto& { return c.cause; })
        .named({model::kCauseNames.begin(), model::kCauseNames.end()});
    return f;
  }();
  return all;
}

const Fields<CouplerSnapshot>& coupler_fields() {
  static const Fields<CouplerSnapshot> all = [] {
    Fields<CouplerSnapshot> f;
    f.add(
        "gap", kGap, "gap", "Distance between the two coupler pins.", [](auto& c) -> auto& { return c.gap; });
    f.add(
        "angle", kAngle, "heading of the bar",
        "Heading of the bar in the world frame, from the trail car's pin to the lead car's.",
        [](auto& c) -> auto& { return c.angle; });
    f.add(
        "axial_force", kForce, "axial force", "Force along the bar, buff (compression) positive, draft negative.",
        [](auto& c) -> auto& { return c.axial_force; });
    f.add(
        "lateral_force", kForce, "lateral force",
        "Force across the bar; on the lead car it acts along the bar's direction turned by -90 deg.",
        [](auto& c) -> auto& { return c.lateral_force; });
    f.add(
        "vertical_force", kForce, "vertical force",
        "Force across the bar in the upright plane through it, of butts and pitch stops, on the lead car, up positive; "
        "0 in models of the plane.",
        [](auto& c) -> auto& { return c.vertical_force; });
    f.add(
        "swing_lead", kAngle, "swing against the lead car", "Yaw of the bar against the lead car, in (-pi, pi].",
        [](auto& c) -> auto& { return c.swing_lead; });
    f.add(
        "swing_trail", kAngle, "swing against the trail car", "Yaw of the bar against the trail car, in (-pi, pi].",
        [](auto& c) -> auto& { return c.swing_trail; });
    f.add(
        "pitch_lead", kAngle, "pitch against the lead car",
        "Pitch of the bar against the lead car; 0 in models of the plane.",
        [](auto& c) -> auto& { return c.pitch_lead; });
    f.add(
        "pitch_trail", kAngle, "pitch against the trail car",
        "Pitch of the bar against the trail car; 0 in models of the plane.",
        [](auto& c) -> auto& { return c.pitch_trail; });
    f.add(
        "moment_lead", kMoment, "moment on the lead car", "Moment of the swing stop on the lead car, about z.",
        [](auto& c) -> auto& { return c.moment_lead; });
    f.add(
        "moment_trail", kMoment, "moment on the trail car", "Moment of the swing stop on the trail car, about z.",
        [](auto& c) -> auto& { return c.moment_trail; });
    f.add(
        "buff_peak", kForce, "buff, peak",
        "Largest compression in the steps since the last row or message of the run, a magnitude.",
        [](auto& c) -> auto& { return c.buff_peak; });
    f.add(
        "draft_peak", kForce, "draft, peak",
        "Largest tension in the steps since the last row or message of the run, a magnitude.",
        [](auto& c) -> auto& { return c.draft_peak; });
    f.add(
        "broken", kNoUnit, "broken",
        "The coupler has broken and carries nothing any more; gap and angles are still those of the two pins.",
        [](auto& c) -> auto& { return c.broken; });
    return f;
  }();
  return all;
}

}  // namespace train_derail::simulation
