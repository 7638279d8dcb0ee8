#include "model/spatial_ground.hpp"

namespace train_derail::model {

using Eigen::Vector3d;

SpatialGround::SpatialGround(SpatialCars& cars, const SpatialBed& bed) : cars_(cars), bed_(bed) {
  sheared_.assign(kPoints * cars.n, Vector3d::Zero());
  sheared_next_ = sheared_;
  feet_.assign(kPoints * cars.n, 0.0);
  lies_.assign(cars.n, false);
  above_.assign(cars.n, 0.0);
}

void SpatialGround::press_body(std::size_t car, double s) {
  const std::size_t n = cars_.n;
  // Nothing of the body can reach the ground: the usual case.
  above_[car] -= 1.05 * cars_.step *
                 (std::abs(cars_.state[SVZ * n + car]) + bed_.profile.steepest() * cars_.fastest + cars_.swirl[car]);
  if (above_[car] > 0.0) return;
  const Body& b = cars_.bodies[car];
  const Vector3d rise(cars_.axes[2 * n + car], cars_.axes[5 * n + car], cars_.axes[8 * n + car]);
  const double middle = cars_.state[SZ * n + car];
  const double lowest = middle + rise.dot(b.box_centre) - rise.cwiseAbs().dot(b.box_half);
  // Of all its points the first truck is no farther away than that.
  const double highest = bed_.highest_ground(s, 4.0 * b.radius);
  above_[car] = lowest - highest;
  if (lowest > highest) {
    if (lies_[car])
      std::fill_n(sheared_next_.begin() + static_cast<std::ptrdiff_t>(kPoints * car + kWheels), kCorners,
                  Vector3d::Zero());
    return;
  }
  const SpatialMotion& q = cars_.at(car);
  const inputs::Terrain& terrain = cars_.scenario.terrain;
  OnGround sum;
  for (std::size_t i = 0; i < kCorners; ++i) {
    const std::size_t point = kPoints * car + kWheels + i;
    const Vector3d own = corner_of(b, i);
    if (middle + rise.dot(own) < highest) {
      const Vector3d place = q.point(own);
      const Under under = ground_under(point, place, s);
      const double depth = under.z - place.z();
      if (depth > 0.0) {
        press_on(sum, q, car, point, place, under.up, terrain.body_stiffness * depth, b.ground_damping,
                 [&](const Vector3d&) { return terrain.body_friction; });
        continue;
      }
    }
    sheared_next_[point].setZero();
  }
  lie(car, BODY_GROUND, sum);
}

void SpatialGround::lie(std::size_t car, Account damping, const OnGround& sum) {
  if (!sum.any) return;
  cars_.add(car, sum.all.force, sum.all.torque);
  cars_.accounts[car].add(damping, sum.damping.force, sum.damping.torque);
  cars_.accounts[car].add(OFF_TRACK, sum.friction.force, sum.friction.torque);
  lies_[car] = true;
}

void SpatialGround::keep_strain() {
  for (std::size_t k = 0; k < cars_.n; ++k) {
    if (!lies_[k] || cars_.rest.lies(k)) continue;
    const auto first = static_cast<std::ptrdiff_t>(kPoints * k);
    std::copy_n(sheared_next_.begin() + first, kPoints, sheared_.begin() + first);
  }
}

double SpatialGround::energy(std::size_t car, const SpatialMotion& q, double s) const {
  double e = 0.0;
  for (std::size_t i = 0; i < kCorners; ++i) {
    const Vector3d place = q.point(corner_of(cars_.bodies[car], i));
    const double depth = bed_.ground(place, s).z - place.z();
    if (depth > 0.0) e += 0.5 * cars_.scenario.terrain.body_stiffness * depth * depth;
  }
  return e;
}

void SpatialGround::walk(files::Archive& archive) {
  archive.column("feet", feet_);
  archive.numbers("sheared", sheared_.data()->data(), static_cast<std::ptrdiff_t>(3 * sheared_.size()));
  if (!archive.restoring()) return;
  std::fill(above_.begin(), above_.end(), 0.0);
  for (std::size_t k = 0; k < cars_.n; ++k) {
    const auto first = sheared_.begin() + static_cast<std::ptrdiff_t>(kPoints * k);
    lies_[k] = std::any_of(first, first + kPoints, [](const Vector3d& v) { return !v.isZero(0.0); });
  }
}

}  // namespace train_derail::model
