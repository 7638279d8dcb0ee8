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

void SpatialGround::press_near(std::size_t car, double s) {
  const std::size_t n = cars_.n;
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
  for (std::size_t i = 0; i < points_of(b); ++i) {
    const std::size_t point = kPoints * car + kWheels + i;
    const Vector3d own = corner_of(b, i);
    if (b.cylinder || middle + rise.dot(own) < highest) {
      const Vector3d place = b.cylinder ? lowest_of_ring(b, q, i, s) : q.point(own);
      const Under under = ground_under(point, place, s);
      const double depth = under.z - place.z();
      if (depth > 0.0) {
        const double patch = bed_.patch_factor(place, s);
        press_on(sum, q, car, point, place, under.up, terrain.body_stiffness * depth, b.ground_damping,
                 [&](const Vector3d&) { return terrain.body_friction * patch; });
        continue;
      }
    }
    sheared_next_[point].setZero();
  }
  lie(car, BODY_GROUND, sum);
}

/// What of a cylinder is deepest in the ground: against the ground's normal from the axis. As it rolls, other parts of
/// the shell come to be there, at the speed at which those that are there leave.
Vector3d SpatialGround::lowest_of_ring(const Body& b, const SpatialMotion& q, std::size_t i, double s) const {
  const Vector3d middle = q.point(b.box_centre + Vector3d((static_cast<double>(i) - 1.0) * b.half_length, 0.0, 0.0));
  const Vector3d up = bed_.ground(middle, s).up, along = q.axes.col(0);
  const Vector3d out = up - up.dot(along) * along;
  const double size = out.norm();
  if (!(size > 1e-9 * up.norm())) return middle;
  return middle - std::min(b.box_half.y(), b.box_half.z()) / size * out;
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
  const Body& b = cars_.bodies[car];
  for (std::size_t i = 0; i < points_of(b); ++i) {
    const Vector3d place = b.cylinder ? lowest_of_ring(b, q, i, s) : q.point(corner_of(b, i));
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
