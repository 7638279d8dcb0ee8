// Contact of all cars with each other: who may touch (a list of near pairs, renewed when cars have moved far enough),
// forces, and a record of every impact.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Force and moment on every car, to be added to [N, N, N m].
struct Loads {
  double *fx, *fy, *moment;
};

/// Positions and velocities of all cars with their headings, as pointers to arrays.
struct CarColumns {
  const double *x, *y, *cosine, *sine, *vx, *vy, *omega;
};

class Contacts {
 public:
  Contacts(const inputs::Contact& law, const std::vector<Car>& cars, double regularization_speed);

  /// Adds the contact forces at time t of a step of length h.
  void add_forces(double t, double h, const CarColumns& q, const Loads& loads, Incidents& incidents);

  /// Work that the forces of the last step took [J]: velocities before and after it.
  struct Work {
    double normal = 0.0, friction = 0.0;
  };
  Work work(double h, const CarColumns& before, const CarColumns& after) const;

 private:
  struct Pair {
    int a, b;
    double crushed = 0.0;  // m, of this touch
    int impact = -1;       // index in the record
    double seen = 0.0;     // time of the last touch [s]
  };
  struct Push {
    int a, b;
    Vector2 point, normal, friction;  // forces on a [N]
  };

  void find_pairs();
  void note(double t, double h, Pair& pair, const Manifold& m, const Vector2& velocity, double force,
            Incidents& incidents) const;

  const inputs::Contact law_;
  const double regularization_speed_;
  std::vector<Footprint> boxes_;
  std::vector<double> radius_, mass_;
  double moved_;                         // how far any car may have come since the list was made [m]
  std::vector<Eigen::Vector4d> bounds_;  // x from, x to, y from, y to
  std::vector<int> by_x_;
  std::vector<Pair> pairs_, old_pairs_;  // sorted by a, b
  std::vector<Push> pushes_;             // of the last step
};

}  // namespace train_derail::model
