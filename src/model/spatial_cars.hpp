/// \file
/// What the parts of the spatial model share: the cars, how they move now, and what acts on them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "model/rest.hpp"
#include "model/rotation.hpp"
#include "model/spatial_kernels.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/spatial_model.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Where what a force takes is put in the ledger. What is stored comes from the state.
enum Account { ON_TRACK, OFF_TRACK, BODY_GROUND, IMPACT_NORMAL, IMPACT_FRICTION, kAccounts };

/// The same motion, of a point so far up along the car.
inline SpatialMotion lifted(SpatialMotion m, double up) {
  const Eigen::Vector3d by = up * m.axes.col(2);
  m.centre += by;
  m.velocity += m.rotation.cross(by);
  return m;
}

inline Three<double> three(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
inline Eigen::Vector3d vector(const Three<double>& v) { return {v.x, v.y, v.z}; }

struct Wrench {
  Eigen::Vector3d force, torque;  // N; about the centre of mass, world frame [N m]
};

/// What acts on each car in a step beside rails, couplers and what trucks stand on, by account.
class Accounts {
 public:
  explicit Accounts(std::size_t cars) : used_(cars, 0), of_(cars) {}

  void clear() { std::fill(used_.begin(), used_.end(), 0); }
  void clear(std::size_t car) { used_[car] = 0; }
  void add(std::size_t car, Account a, const Eigen::Vector3d& force, const Eigen::Vector3d& torque) {
    Wrench& w = of_[car][a];
    if (used(car, a)) {
      w.force += force;
      w.torque += torque;
    } else {
      w = {force, torque};
      used_[car] = static_cast<unsigned char>(used_[car] | 1U << a);
    }
  }
  bool any(std::size_t car) const { return used_[car] != 0; }
  bool used(std::size_t car, Account a) const { return (used_[car] & 1U << a) != 0; }
  const Wrench& of(std::size_t car, Account a) const { return of_[car][a]; }

 private:
  std::vector<unsigned char> used_;  // those that are not empty; apart, as most cars have none
  std::vector<std::array<Wrench, kAccounts>> of_;
};

/// A car; changes only as it loses its trucks.
struct Body {
  Body(const Car& c, const inputs::Scenario& s)
      : mass(c.mass),
        weight(c.weight),
        inertia(c.roll_inertia, c.yaw_inertia, c.yaw_inertia),
        half_length(0.5 * c.length),
        half_spacing(0.5 * c.truck_spacing),
        box_centre(0.0, 0.0, 0.5 * (c.floor_height + c.roof_height) - c.centre_height),
        box_half(half_length, 0.5 * c.width, 0.5 * (c.roof_height - c.floor_height)),
        underframe(0.0, 0.5 * c.underframe_width, c.underframe_height - c.centre_height),
        narrow(c.underframe_height < c.floor_height),
        centre_height(c.centre_height),
        spring(s.suspension.stiffness),
        spring_damping(side_damping(s.suspension, c.mass)),
        sag(0.25 * c.weight / spring),
        ground_damping(model::ground_damping(s.terrain, c.mass)),
        cylinder(c.cylinder),
        shell_radius(box_half.minCoeff()),
        radius(std::max(box_half.norm() + box_centre.norm(), std::hypot(half_length, underframe.norm()))) {}

  double mass, weight;
  Eigen::Vector3d inertia;  // about roll, pitch, yaw axes
  double half_length, half_spacing;
  Eigen::Vector3d box_centre, box_half;  // of the body, from the centre of mass
  Eigen::Vector3d underframe;            // its left edge, from the centre of mass; as long as the body
  bool narrow;                           // the underframe is below the floor
  double centre_height;
  double spring, spring_damping, sag;  // of a side of a truck; how far it is pressed at rest
  double ground_damping;
  bool cylinder;        // with domed heads the body is, instead of a box
  double shell_radius;  // of that cylinder
  double radius;        // of a sphere about the centre of mass, around the body

  /// Half the distance of the centres of a cylinder's heads.
  double shell_half() const { return half_length - shell_radius; }
  /// How far the body reaches from its centre along a unit vector that is given along the car's axes.
  double half_extent(const Eigen::Vector3d& direction) const {
    return cylinder ? shell_half() * std::abs(direction.x()) + shell_radius : direction.cwiseAbs().dot(box_half);
  }

  /// How high the lowest point of the box and its underframe is above the centre of mass, at most; `rise`: the
  /// vertical along the car's axes.
  double lowest(const Eigen::Vector3d& rise) const {
    const double box = rise.dot(box_centre) - rise.cwiseAbs().dot(box_half);
    if (!narrow || cylinder) return box;
    const Eigen::Vector3d reach(half_length, underframe.y(), 0.0);
    return std::min(box, rise.z() * underframe.z() - rise.cwiseAbs().dot(reach));
  }

  double kinetic(const SpatialMotion& q) const {
    return 0.5 * mass * q.velocity.squaredNorm() + 0.5 * q.body_rates.dot(inertia.cwiseProduct(q.body_rates));
  }
};

/// The cars of a run. Vectors in columns are three of them, one after the other, one entry a car each. Trucks are
/// numbered: the front trucks of all cars, then the rear ones.
class SpatialCars {
 public:
  SpatialCars(const inputs::Scenario& s, const std::vector<Car>& train, const SpatialKernels& kernels)
      : scenario(s),
        n(train.size()),
        step(s.solver.fixed_step.value_or(0.0)),
        wide(kernels),
        accounts(n),
        rest(n),
        train_(train),
        bare_(n, false) {
    for (const Car& c : train) bodies.emplace_back(c, s);
    for (auto* a : {&axes, &axes_before}) a->assign(9 * n, 0.0);
    for (auto* a : {&rotation, &spin, &force, &torque, &mean_rotation}) a->assign(3 * n, 0.0);
    swirl.assign(n, 0.0);
    motions_.resize(n);
    seen_at_.assign(n, 0);
    for (std::vector<double>& column : constants_) column.resize(n);
    inertia_.resize(3 * n);
    for (std::size_t k = 0; k < n; ++k) list(k);
    show();
  }
  SpatialCars(const SpatialCars&) = delete;
  SpatialCars& operator=(const SpatialCars&) = delete;

  const inputs::Scenario& scenario;
  const std::size_t n;
  const double step;  // s
  const SpatialKernels& wide;
  std::vector<Body> bodies;
  SpatialArrays arrays;  // what the wide loops see; each part shows its own
  std::vector<double> axes, axes_before, rotation, spin, force, torque, mean_rotation;
  Accounts accounts;  // of what acts on the cars in the step beside the wide loops
  Rest rest;
  const double* state = nullptr;  // known last
  std::int64_t round = 0;         // of forces; each force on a car is found once in it
  double now = 0.0;               // at which forces were found last [s]

  double fastest = 0.0, spinning = 0.0;  // largest speed of a centre, largest swirl [m/s]
  std::vector<double> swirl;             // speed of the farthest point of a body about its centre [m/s]

  std::size_t truck_of(std::size_t car, bool front) const { return front ? car : n + car; }
  std::size_t car_of(std::size_t truck) const { return truck < n ? truck : truck - n; }
  double arm_of(std::size_t truck) const {
    const Body& b = bodies[car_of(truck)];
    return truck < n ? b.half_spacing : -b.half_spacing;
  }
  /// From the centre of mass to the middle of a truck at the top of the rails, along the car's axes.
  Eigen::Vector3d truck_place(std::size_t truck) const {
    return {arm_of(truck), 0.0, -bodies[car_of(truck)].centre_height};
  }

  /// The state from now on; its axes and rotations are known.
  void look(const double* y) {
    state = y;
    ++moment_;
  }
  /// The same, and its axes and rotations are found.
  void look_anew(const double* y) {
    wide.look(arrays, y);
    look(y);
  }
  /// A car of the state, taken out when it is looked at.
  const SpatialMotion& at(std::size_t car) const {
    SpatialMotion& m = motions_[car];
    if (seen_at_[car] == moment_) return m;
    seen_at_[car] = moment_;
    m.centre = of_car(state + SX * n, car);
    m.velocity = of_car(state + SVX * n, car);
    m.body_rates = of_car(state + ROLL_RATE * n, car);
    for (Eigen::Index c = 0; c < 3; ++c) m.axes.col(c) = of_car(axes.data() + static_cast<std::size_t>(3 * c) * n, car);
    m.rotation = of_car(rotation.data(), car);
    return m;
  }
  Eigen::Vector3d centre(std::size_t k) const { return of_car(state + SX * n, k); }
  Eigen::Vector3d velocity(std::size_t k) const { return of_car(state + SVX * n, k); }
  /// Of three columns.
  Eigen::Vector3d of_car(const double* first, std::size_t k) const {
    return {first[k], first[n + k], first[2 * n + k]};
  }

  void add(std::size_t car, const Eigen::Vector3d& f, const Eigen::Vector3d& t) {
    for (std::size_t c = 0; c < 3; ++c) {
      force[c * n + car] += f[static_cast<Eigen::Index>(c)];
      torque[c * n + car] += t[static_cast<Eigen::Index>(c)];
    }
  }
  void push(std::size_t car, const Eigen::Vector3d& f, const Eigen::Vector3d& arm) { add(car, f, arm.cross(f)); }
  void push(std::size_t car, Account a, const Wrench& w) {
    add(car, w.force, w.torque);
    accounts.add(car, a, w.force, w.torque);
  }

  /// A car is without its trucks from now on, or has them; true if that changes it.
  bool bare(std::size_t car, bool without) {
    if (train_[car].truck_mass == 0.0 || bare_[car] == without) return false;
    bare_[car] = without;
    bodies[car] = Body(without ? without_trucks(train_[car]) : train_[car], scenario);
    list(car);
    return true;
  }
  /// How much higher the centre of mass is than that of the car with its trucks, along the car's vertical [m].
  double rise(std::size_t car) const { return bodies[car].centre_height - train_[car].centre_height; }
  /// Energy of a car's motion and height [J].
  double stored(std::size_t car) const {
    const Body& b = bodies[car];
    return b.kinetic(at(car)) + b.weight * (at(car).centre.z() - b.centre_height);
  }
  /// The centre of mass of a car in the state `y` is so far up along the car from now on.
  void move_centre(double* y, std::size_t car, double up) {
    const SpatialMotion m = lifted(at(car), up);
    for (std::size_t c = 0; c < 3; ++c) {
      y[(SX + c) * n + car] = m.centre[static_cast<Eigen::Index>(c)];
      y[(SVX + c) * n + car] = m.velocity[static_cast<Eigen::Index>(c)];
    }
    look_anew(y);
  }

  /// The last step is over: its axes are the ones before.
  void swap_axes() {
    axes_before.swap(axes);
    arrays.axes = axes.data();
    arrays.axes_before = axes_before.data();
  }

  /// Work of the last step's forces, by account, with the mean of the velocities before and after.
  void account(double h, const double* y, const double* after, EnergyLedger& spent) const {
    static constexpr std::array<double EnergyLedger::*, kAccounts> kTaken{
        &EnergyLedger::work_on_track, &EnergyLedger::work_off_track, &EnergyLedger::work_body_ground,
        &EnergyLedger::work_impact_normal, &EnergyLedger::work_impact_friction};
    wide.work(arrays, y, after, h, spent);
    std::array<double, kAccounts> given{};
    for (std::size_t k = 0; k < n; ++k) {
      if (!accounts.any(k)) continue;
      const Eigen::Vector3d v = of_car(y + SVX * n, k) + of_car(after + SVX * n, k);
      const Eigen::Vector3d w = of_car(mean_rotation.data(), k);
      for (const Account a : {ON_TRACK, OFF_TRACK, BODY_GROUND, IMPACT_NORMAL, IMPACT_FRICTION}) {
        if (!accounts.used(k, a)) continue;
        const Wrench& sum = accounts.of(k, a);
        given[a] += sum.force.dot(v) + sum.torque.dot(w);
      }
    }
    for (std::size_t a = 0; a < kAccounts; ++a) spent.*kTaken[a] -= 0.5 * h * given[a];
  }

  /// Sphere about each centre of mass, around the body [m].
  const double* radius() const { return constants_.back().data(); }

 private:
  /// The columns of a car that does not change with the state.
  void list(std::size_t car) {
    const Body& b = bodies[car];
    const double values[] = {b.half_length, b.half_spacing,   b.centre_height,  b.weight, 1.0 / b.mass,
                             b.sag,         b.spring_damping, b.ground_damping, b.radius};
    for (std::size_t c = 0; c < constants_.size(); ++c) constants_[c][car] = values[c];
    for (Eigen::Index c = 0; c < 3; ++c) inertia_[static_cast<std::size_t>(c) * n + car] = b.inertia[c];
  }
  void show() {
    SpatialArrays& a = arrays;
    a.cars = static_cast<std::ptrdiff_t>(n);
    a.step = step;
    const double** columns[] = {&a.half_length,  &a.half_spacing, &a.centre_height,  &a.weight,
                                &a.inverse_mass, &a.sag,          &a.spring_damping, &a.brake_damping};
    std::size_t next = 0;
    for (const double** column : columns) *column = constants_[next++].data();
    a.inertia = inertia_.data();
    a.axes = axes.data();
    a.axes_before = axes_before.data();
    a.rotation = rotation.data();
    a.spin = spin.data();
    a.force = force.data();
    a.torque = torque.data();
    a.mean_rotation = mean_rotation.data();
  }

  const std::vector<Car>& train_;
  std::vector<bool> bare_;                        // of those that weigh something
  std::array<std::vector<double>, 9> constants_;  // of the bodies, by columns
  std::vector<double> inertia_;
  mutable std::vector<SpatialMotion> motions_;
  mutable std::vector<std::int64_t> seen_at_;
  std::int64_t moment_ = 0;
};

}  // namespace train_derail::model
