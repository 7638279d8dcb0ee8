#include "multibody/car_body.hpp"

namespace train_derail::multibody {

using SimTK::Inertia;
using SimTK::MassProperties;
using SimTK::Vec3;

namespace {

constexpr double kAxles = 0.4572;  // above the rail, where the trucks have their centre of mass [m]

/// As of a bar: the same about the lateral and the vertical axis.
Inertia about_centre(const model::Car& car, double share) {
  return {share * car.roll_inertia, share * car.yaw_inertia, share * car.yaw_inertia};
}

/// Trucks and the rest balance each other about the centre of mass of the whole car.
MassProperties bare_body(const model::Car& car) {
  const double trucks = 2.0 * car.truck_mass, rest = car.mass - trucks;
  const Vec3 centre(0.0, 0.0, trucks * (car.centre_height - kAxles) / rest);
  return {rest, centre, about_centre(car, rest / car.mass).shiftFromMassCenter(centre, rest)};
}

}  // namespace

CarBody::CarBody(SimTK::SimbodyMatterSubsystem& matter, const model::Car& car)
    : share_(1.0 - 2.0 * car.truck_mass / car.mass),
      whole_(matter.updGround(), SimTK::Body::Rigid(MassProperties(car.mass, Vec3(0.0), about_centre(car, 1.0)))),
      bare_(matter.updGround(), SimTK::Body::Rigid(bare_body(car))) {}

void CarBody::lose_trucks(SimTK::State& state) const {
  const SimTK::Transform place = whole_.getBodyTransform(state);
  const SimTK::SpatialVec motion = whole_.getBodyVelocity(state);
  bare_.unlock(state);
  bare_.setQToFitTransform(state, place);
  bare_.setUToFitVelocity(state, motion);
  whole_.lock(state);
}

}  // namespace train_derail::multibody
