/// \file
/// Bodies of cars that press on each other in the spatial model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "model/body_manifold.hpp"
#include "model/box_contact.hpp"
#include "model/cylinder_contact.hpp"
#include "model/part.hpp"
#include "model/rest.hpp"
#include "model/spatial_cars.hpp"
#include "train_derail/files/archive.hpp"

namespace train_derail::model {

class SpatialContacts {
 public:
  SpatialContacts(SpatialCars& cars, Record& record, Waker& waker);

  /// Adds the forces of a step of length h [s] from time t.
  void press_all(double t, double h);
  /// A car comes to rest: it is held against what its neighbours do from now on.
  void hold(std::size_t car);
  /// It moves again: what it leant on all the time is no new impact.
  void resume(std::size_t car);

  void walk(files::Archive& archive);

 private:
  struct Pair {
    int a, b;
    int axis = -1;
    std::int64_t round = 0;
    double apart = 0.0;  // at least [m]
    double crushed = 0.0;
    Eigen::Vector3d sheared = Eigen::Vector3d::Zero();  // how far friction has been strained
    int impact = -1;
    double overlapped = 0.0;  // when they last overlapped, from the impact on [s]
    double pressed = 0.0;     // when they last pressed on each other [s]
    double since = 0.0;       // when they began to: pauses as between touches of one impact do not count [s]
    Held held = {};           // where one of the two lies still

    bool has(std::size_t car) const { return static_cast<std::size_t>(a) == car || static_cast<std::size_t>(b) == car; }
    /// One of the two comes to rest. From cars that are apart any force is new to it.
    void hold() {
      held = {};
      held.known = axis < 0;
    }
  };

  void find_pairs();
  Box box(std::size_t k) const;
  Cylinder cylinder(std::size_t k) const;
  BodyContact meet(const Pair& pair) const;
  bool touch(double t, double h, Pair& pair);
  bool leans(double t, const Pair& pair) const;
  double bearable(double h, const Pair& pair, const BodyManifold& m, double damping, double rub_damping);
  bool wakes(Pair& pair, const Eigen::Vector3d& force);
  void note(double t, double h, Pair& pair, const BodyManifold& m, const Eigen::Vector3d& velocity, double force);

  SpatialCars& cars_;
  Record& record_;
  Waker& waker_;
  std::vector<int> by_x_;
  std::vector<Pair> pairs_, old_pairs_;
  // What all bodies that lean on a car would damp of its speed per second, in this step and in the one before [1/s].
  std::vector<double> damped_, damped_before_;
  double moved_ = inputs::kInfinity;
};

}  // namespace train_derail::model
