/// \file
/// What can be seen of a train at one moment, whatever model moves it. Everybody outside of model/ reads this and
/// nothing of a state's layout. Models of the plane leave heights, vertical forces, roll and pitch at zero.
#pragma once

#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/model/incidents.hpp"

namespace train_derail::model {

/// Where a truck centre is, seen from the track.
struct TruckPlace {
  double s = 0.0;  ///< arc length along the centre line from the point of derailment, in the direction of travel [m]
  double offset = 0.0;  ///< from the centre line, left positive [m]
  double height = 0.0;  ///< above the top of the rails [m]
  double load = 0.0;    ///< vertical force that it carries [N]
};

/// One car. World frame: x forward along the track at the point of derailment, y left, z up; angles by the right hand.
struct CarObservation {
  double x = 0.0;   ///< centre of mass, forward [m]
  double y = 0.0;   ///< centre of mass, left [m]
  double z = 0.0;   ///< centre of mass, up [m]
  double qx = 0.0;  ///< orientation as a unit quaternion, first imaginary part; at (0, 0, 0, 1) the car heads along +x
  double qy = 0.0;  ///< second imaginary part
  double qz = 0.0;  ///< third imaginary part
  double qw = 1.0;  ///< real part
  double theta = 0.0;         ///< heading, yaw against +x, not wrapped [rad]
  double vx = 0.0;            ///< velocity of the centre of mass, forward [m/s]
  double vy = 0.0;            ///< velocity of the centre of mass, left [m/s]
  double vz = 0.0;            ///< velocity of the centre of mass, up [m/s]
  double wx = 0.0;            ///< angular velocity about x [rad/s]
  double wy = 0.0;            ///< angular velocity about y [rad/s]
  double omega = 0.0;         ///< angular velocity about z [rad/s]
  TruckPlace front_truck;     ///< where the front truck is
  TruckPlace rear_truck;      ///< where the rear truck is
  bool past_pod = false;      ///< the centre of mass has passed the point of derailment
  bool derailed = false;      ///< a truck is off the rails; where rails never yield: past_pod
  Cause cause = Cause::none;  ///< what took its first truck off; rails that yield only
};

/// One coupler, seen as a bar between the rear pin of the lead car and the front pin of the trail car.
struct CouplerObservation {
  double gap = 0.0;            ///< pin to pin [m]
  double angle = 0.0;          ///< heading of the bar, from the trail car's pin to the lead car's [rad]
  double axial_force = 0.0;    ///< along the bar, buff positive, draft negative [N]
  double lateral_force = 0.0;  ///< across it; on the lead car along the bar's direction turned by -90 deg [N]
  /// Across it in the upright plane through it, of butts and pitch stops; on the lead car, up positive [N].
  double vertical_force = 0.0;
  double swing_lead = 0.0;    ///< yaw of the bar against the lead car, in (-pi, pi] [rad]
  double swing_trail = 0.0;   ///< yaw of the bar against the trail car, in (-pi, pi] [rad]
  double pitch_lead = 0.0;    ///< pitch of the bar against the lead car [rad]
  double pitch_trail = 0.0;   ///< pitch of the bar against the trail car [rad]
  double moment_lead = 0.0;   ///< moment of the swing stop on the lead car, about z [N m]
  double moment_trail = 0.0;  ///< moment of the swing stop on the trail car, about z [N m]
  bool broken = false;        ///< for good: carries nothing any more
};

/// Cars in the order of the train; coupler i (from 0) joins cars i (lead) and i + 1 (trail).
struct Observation {
  std::vector<CarObservation> cars;          ///< from the foremost car back
  std::vector<CouplerObservation> couplers;  ///< one less than cars
};

/// All cars as seen from above, column by column, for loops over long trains. Valid until the state changes.
struct PlanColumns {
  const double* x;      ///< centre of mass, forward [m]
  const double* y;      ///< centre of mass, left [m]
  const double* vx;     ///< its velocity, forward [m/s]
  const double* vy;     ///< its velocity, left [m/s]
  const double* omega;  ///< yaw rate [rad/s]
};

/// What cars in space do that PlanColumns do not tell, column by column. Valid until the state changes.
struct SpaceColumns {
  const double *x, *y;              ///< midway between the truck centres of a car, seen from above [m]
  const double *ahead_x, *ahead_y;  ///< from its rear truck to its front one, so seen: of length 1 unless it is pitched
  const double* truck_speed_squared;  ///< of the faster one of its truck centres [m^2/s^2]
  /// Of car i against car i + 1, one less than cars: speeds of the facing pins and of the centres of mass, squared
  /// [m^2/s^2].
  const double *pins_squared, *centres_squared;
};

}  // namespace train_derail::model
