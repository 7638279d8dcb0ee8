/// \file
/// Points of cars that press on the ground in the spatial model: sides of trucks off the rails, edges of bodies.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "model/spatial_cars.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/model/spatial_bed.hpp"

namespace train_derail::model {

/// Forces of the ground on some points of a car.
struct OnGround {
  Wrench all{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()}, damping = all, friction = all;
  bool any = false;
};

class SpatialGround {
 public:
  /// Points of a car: four sides of trucks, then those of the body: of a box at its edges, of a cylinder what three
  /// balls touch.
  static constexpr std::size_t kWheels = 4, kCorners = 12, kBalls = 3, kBallPoints = 5,
                               kBody = kBalls * kBallPoints + 1, kPoints = kWheels + kBody;

  SpatialGround(SpatialCars& cars, const SpatialBed& bed);

  /// The body of a car that is near arc length s of the track.
  void press_body(std::size_t car, double s) {
    // Nothing of the body can reach the ground: the usual case.
    above_[car] -=
        1.05 * cars_.step *
        (std::abs(cars_.state[SVZ * cars_.n + car]) + bed_.profile.steepest() * cars_.fastest + cars_.swirl[car]);
    if (!(above_[car] > 0.0)) press_near(car, s);
  }

  /// Adds the forces on a wheel of a car, `spring` [N/m] at first pressed by `sag` more than its height tells, to a
  /// sum; returns the normal force. mu: friction coefficient for a force of friction.
  template <class Friction>
  double press_wheel(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t wheel,
                     const Eigen::Vector3d& place, double s, const Friction& mu) {
    const Body& b = cars_.bodies[car];
    const std::size_t point = kPoints * car + wheel;
    const Under under = ground_under(point, place, s);
    const double depth = b.sag - (place.z() - under.z);
    if (depth <= 0.0) {
      sheared_next_[point].setZero();
      return 0.0;
    }
    return press_on(sum, q, car, point, place, under.up, b.spring * depth, b.spring_damping, mu);
  }
  /// Puts forces on a car, their damping into an account.
  void lie(std::size_t car, Account damping, const OnGround& sum);

  /// What friction with the ground has strained becomes the past.
  void keep_strain();

  /// Stored under the body of a car [J].
  double energy(std::size_t car, const SpatialMotion& q, double s) const;

  void walk(files::Archive& archive);

 private:
  void press_near(std::size_t car, double s);
  Under ground_under(std::size_t point, const Eigen::Vector3d& p, double s) {
    return bed_.ground(p, s, 2.0 * cars_.bodies[point / kPoints].radius, feet_[point]);
  }
  void press_edges(OnGround& sum, const SpatialMotion& q, std::size_t car, double s, double highest);
  void press_shell(OnGround& sum, const SpatialMotion& q, std::size_t car, double s);
  void resist_rolling(OnGround& sum, const SpatialMotion& q, std::size_t car, double load);
  /// Forces on a point of the body that is `depth` in the ground, straight down; returns the load.
  double press_body_point(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t point,
                          const Eigen::Vector3d& place, const Eigen::Vector3d& up, double depth, double s);
  /// Centres of the balls by which a cylinder presses on the ground: its heads, and one in the middle.
  static Eigen::Vector3d ball_of(const Body& b, const SpatialMotion& q, std::size_t i) {
    return q.point(b.box_centre + Eigen::Vector3d((static_cast<double>(i) - 1.0) * b.shell_half(), 0.0, 0.0));
  }
  /// What a ball touches at the same time has points of its own: numbers that differ by less than kBallPoints.
  static std::size_t ball_point(std::size_t car, std::size_t ball, std::size_t number) {
    return kPoints * car + kWheels + kBallPoints * ball + number % kBallPoints;
  }
  /// The last of a car's points keeps the strain of rolling, as x.
  static std::size_t rolling_point(std::size_t car) { return ball_point(car, kBalls, 0); }
  /// A point of the body's edges, from the centre of mass along the car's axes.
  static Eigen::Vector3d corner_of(const Body& b, std::size_t i) {
    const Eigen::Vector3d sign(static_cast<double>(i / 4) - 1.0, (i & 1U) != 0 ? 1.0 : -1.0,
                               (i & 2U) != 0 ? 1.0 : -1.0);
    return b.box_centre + sign.cwiseProduct(b.box_half);
  }

  /// Adds the forces on a point of a car on the ground, where `spring` is its springs' part along `up`, and `damping`
  /// [N s/m]; returns the normal force.
  template <class Friction>
  double press_on(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t point,
                  const Eigen::Vector3d& place, const Eigen::Vector3d& up, double spring, double damping,
                  const Friction& mu) {
    using Eigen::Vector3d;
    const Vector3d arm = place - q.centre, v = q.velocity + q.rotation.cross(arm), turning = arm.cross(up);
    const double up_square = bed_.level() ? 1.0 : up.squaredNorm(), up_rate = v.dot(up);
    const double total = std::max(spring - damping * up_rate, 0.0), carried = total * std::sqrt(up_square);
    const Vector3d slip = v - up_rate / up_square * up;
    const Vector3d rub = hold(car, point, up, up_square, slip, carried, mu), rub_turning = arm.cross(rub);
    sum.any = true;
    sum.all.force += total * up + rub;
    sum.all.torque += total * turning + rub_turning;
    sum.damping.force += (total - spring) * up;
    sum.damping.torque += (total - spring) * turning;
    sum.friction.force += rub;
    sum.friction.torque += rub_turning;
    return carried;
  }

  /// Friction of a point on the ground, at most mu(force) times the load: the ground is strained until it gives way. A
  /// force that grew with the speed instead would let cars creep down a bank.
  template <class Friction>
  Eigen::Vector3d hold(std::size_t car, std::size_t point, const Eigen::Vector3d& up, double up_square,
                       const Eigen::Vector3d& slip, double carried, const Friction& mu) {
    const double stiffness = cars_.scenario.terrain.body_stiffness;
    Eigen::Vector3d strain = sheared_[point] - sheared_[point].dot(up) / up_square * up + cars_.step * slip;
    Eigen::Vector3d rub = -stiffness * strain - cars_.bodies[car].ground_damping * slip;
    const double square = rub.squaredNorm(), limit = mu(rub) * carried;
    if (square > limit * limit) {
      rub *= limit / std::sqrt(square);
      strain = rub * (-1.0 / stiffness);
    }
    sheared_next_[point] = strain;
    return rub;
  }

  SpatialCars& cars_;
  const SpatialBed& bed_;
  // How far friction with the ground has strained it, kPoints a car [m]; the next values belong to the forces found.
  std::vector<Eigen::Vector3d> sheared_, sheared_next_;
  std::vector<double> feet_;   // arc lengths at which these points were last [m]
  std::vector<bool> lies_;     // anything of the car is on the ground
  std::vector<double> above_;  // so high at least a body is above it, as far as is known [m]
};

}  // namespace train_derail::model
