/// \file
/// Points of bodies that press on the ground in the spatial model: edges of boxes, shells of cylinders.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "model/ground_point.hpp"
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
  /// Points of a car: of a box at its edges and those of its underframe, of a cylinder what three balls touch.
  static constexpr std::size_t kCorners = 12, kUnderframe = 6, kBalls = 3, kBallPoints = 5,
                               kPoints = kCorners + kUnderframe;
  static_assert(kBalls * kBallPoints + 2 <= kPoints);

  SpatialGround(SpatialCars& cars, const SpatialBed& bed);

  /// The body of a car that is near arc length s of the track.
  void press_body(std::size_t car, double s) {
    // Nothing of the body can reach the ground: the usual case.
    above_[car] -=
        1.05 * cars_.step *
        (std::abs(cars_.state[SVZ * cars_.n + car]) + bed_.profile.steepest() * cars_.fastest + cars_.swirl[car]);
    if (!(above_[car] > 0.0)) press_near(car, s);
  }

  /// Calls use(place, radius) for what a body may lie on the ground by: points of a box and its underframe, radius 0;
  /// balls of a cylinder.
  template <class Use>
  static void each_point(const Body& b, const SpatialMotion& q, const Use& use) {
    if (b.cylinder) {
      for (std::size_t i = 0; i < kBalls; ++i) use(ball_of(b, q, i), b.shell_radius);
    } else {
      for (std::size_t i = 0; i < corners(b); ++i) use(q.point(corner_of(b, i)), 0.0);
    }
  }

  /// Where its points are from its centre of mass; again as that moves.
  void find_corners(std::size_t car);

  /// What friction with the ground has strained becomes the past.
  void keep_strain();

  /// Stored under the body of a car [J].
  double energy(std::size_t car, const SpatialMotion& q, double s) const;

  void walk(files::Archive& archive);

 private:
  void press_near(std::size_t car, double s);
  void lie(std::size_t car, const OnGround& sum);
  Under ground_under(std::size_t point, const Eigen::Vector3d& p, double s) {
    return bed_.ground(p, s, 2.0 * cars_.bodies[point / kPoints].radius, feet_[point]);
  }
  void press_edges(OnGround& sum, const SpatialMotion& q, std::size_t car, double s, double highest);
  void press_shell(OnGround& sum, const SpatialMotion& q, std::size_t car, double s);
  void resist_rolling(OnGround& sum, const SpatialMotion& q, std::size_t car, double load);
  void resist_rocking(OnGround& sum, const SpatialMotion& q, std::size_t car, double load);
  /// Forces on a point of the body that is `depth` in the ground, straight down; returns the load.
  double press_body_point(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t point,
                          const Eigen::Vector3d& place, const Eigen::Vector3d& up, double depth, double s);
  /// Centres of the balls by which a cylinder presses on the ground: its heads, and one in the middle.
  static Eigen::Vector3d ball_of(const Body& b, const SpatialMotion& q, std::size_t i) {
    return q.point(b.box_centre + Eigen::Vector3d((static_cast<double>(i) - 1.0) * b.shell_half(), 0.0, 0.0));
  }
  /// What a ball touches at the same time has points of its own: numbers that differ by less than kBallPoints.
  static std::size_t ball_point(std::size_t car, std::size_t ball, std::size_t number) {
    return kPoints * car + kBallPoints * ball + number % kBallPoints;
  }
  /// The last of a car's points keep the strain of rolling, as x, and that of rocking and turning.
  static std::size_t rolling_point(std::size_t car) { return ball_point(car, kBalls, 0); }
  static std::size_t rocking_point(std::size_t car) { return ball_point(car, kBalls, 1); }
  /// Points of a box that may lie on the ground.
  static std::size_t corners(const Body& b) { return kCorners + (b.narrow ? kUnderframe : 0); }
  /// A point of the edges of the body, or of its underframe, from the centre of mass along the car's axes; corner_ has
  /// them all.
  static Eigen::Vector3d corner_of(const Body& b, std::size_t i) {
    if (i >= kCorners) {
      const double along = static_cast<double>((i - kCorners) / 2) - 1.0, left = (i & 1U) != 0 ? 1.0 : -1.0;
      return {along * b.half_length, left * b.underframe.y(), b.underframe.z()};
    }
    const Eigen::Vector3d sign(static_cast<double>(i / 4) - 1.0, (i & 1U) != 0 ? 1.0 : -1.0,
                               (i & 2U) != 0 ? 1.0 : -1.0);
    return b.box_centre + sign.cwiseProduct(b.box_half);
  }

  SpatialCars& cars_;
  const SpatialBed& bed_;
  // How far friction with the ground has strained it, kPoints a car [m]; the next values belong to the forces found.
  std::vector<Three<double>> sheared_, sheared_next_;
  std::vector<std::size_t> strained_;    // cars whose next values were found since the last step
  std::vector<Eigen::Vector3d> corner_;  // kPoints a car
  std::vector<double> feet_;             // arc lengths at which these points were last [m]
  std::vector<bool> lies_;               // anything of the body is on the ground
  std::vector<double> above_;            // so high at least a body is above it, as far as is known [m]
};

}  // namespace train_derail::model
