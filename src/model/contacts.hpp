/// \file
/// Contact of all cars with each other: who may touch (a list of near pairs, renewed when cars have moved far enough),
/// forces, and a record of every impact.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/planar_rest.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

class Contacts final : public Part {
 public:
  /// `loops`, `record` and `rest` must outlive the part.
  Contacts(const inputs::Contact& law, const std::vector<Car>& cars, double regularization_speed,
           const ExtendedKernels& loops, Record& record, PlanarRest& rest);

  void add(double t, double h, const CarColumns& cars, const Wrenches& sum) override;
  void account(double h, const CarColumns& before, const CarColumns& after) override;
  void walk(files::Archive& archive) override;
  /// Marks cars with `asked` (one a car) that another body is nearer to than kNear.
  void mark_near(const CarColumns& cars, const std::vector<bool>& asked, std::vector<bool>& near);
  /// Whether a body has pushed one of these cars in this step.
  bool touches(const BusyCars& cars) const;
  static constexpr double kNear = 0.5;  ///< m; less than coupled cars are apart

 private:
  struct Pair {
    int a = 0, b = 0;
    double crushed = 0.0;  // m, of this touch
    double apart = 0.0;    // for so long a way they need not be looked at [m]
    int impact = -1;       // index in the record
    int still = -1;        // index in leaning_ while both cars lie
    double seen = 0.0;     // time of the last touch [s]
  };
  /// What two cars that lie do to each other: fx, fy, moment. Kept apart: pairs are many, and looked at in every step.
  struct Leaning {
    Eigen::Vector3d on_a = Eigen::Vector3d::Zero(), on_b = Eigen::Vector3d::Zero();
  };
  struct Push {
    int a, b;
    Vector2 point, normal, friction;  // forces on a [N]
  };

  void find_pairs(const CarColumns& cars);
  /// What pairs that are no longer listed had of leaning_ is free.
  void free_leanings();
  /// Parts the pairs into those that may move and those of which both cars lie, from time t [s] on.
  void sort_out(double t, const CarColumns& q);
  void place(std::size_t car, const CarColumns& q);
  void press_pair(double t, double h, Pair& pair, const CarColumns& q, const Wrenches& loads);
  /// contact_force() of bodies that lean on each other: it does not jump where they begin to close, at `rate` 0, but
  /// rises within what one step can follow: `speed_per_force` is what a force changes of the rate in one [m/s/N].
  double leaning_force(double depth, double rate, double speed_per_force, double& crushed) const;
  /// What two cars that lie do to each other.
  void find_still(Pair& pair, const CarColumns& q);
  void add_still(const Wrenches& loads) const;
  void note(double t, double h, Pair& pair, const Manifold& m, const Vector2& velocity, double force);

  const inputs::Contact law_;
  const double regularization_speed_;
  const ExtendedKernels& loops_;
  Record& record_;
  std::vector<Footprint> boxes_;
  std::vector<double> radius_, mass_;
  // Of when the list was made: how far any car may have come since then from where its velocity of then would have
  // brought it [m], how long ago that was [s], these velocities [m/s].
  double moved_, age_ = 0.0;
  std::vector<double> vx_then_, vy_then_;
  std::vector<Eigen::Vector4d> bounds_;  // x from, x to, y from, y to
  std::vector<int> by_x_;
  std::vector<Pair> pairs_, old_pairs_;  // sorted by a, b
  std::vector<Push> pushes_;             // of the last step
  PlanarRest& rest_;
  bool sorted_ = false;      // the two lists below are those of pairs_
  std::size_t changes_ = 0;  // of rest_, when they were made
  std::vector<std::size_t> moving_, still_;
  std::vector<Leaning> leaning_;
  std::vector<int> free_;  // places in it
};

}  // namespace train_derail::model
