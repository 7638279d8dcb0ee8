/// \file
/// Trucks of the spatial model: on the rails, on the ties or on the ground, or parted from their body; and what leaves
/// the rails. A truck on the ties is carried as high as one on the rails.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "model/air_brakes.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/spatial_cars.hpp"
#include "model/tie_runs.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/model/spatial_bed.hpp"

namespace train_derail::model {

class SpatialTrucks {
 public:
  /// A truck on the ties may open the pipe of `brakes`. What is handed in must outlive the object.
  SpatialTrucks(SpatialCars& cars, const std::vector<Car>& train, SpatialBed& bed, AirBrakes& brakes,
                const ExtendedKernels& loops, Record& record);

  /// What has happened before the first step: trucks that start past the point of derailment are off the rails.
  void start();
  /// The ground under all trucks that it carries, but of cars that lie.
  void find_ground();
  /// Finds all trucks on the track after a step; those that have come to its broken or torn parts leave it.
  void pass(double t, double h, double* y);
  /// Trucks that are overloaded leave the rails, those that hang part from their body; whether any has.
  bool give_way(double t, double h);
  /// A step ends: strain of the brakes and of the ground and lateral forces become the past.
  void keep_strain();
  void keep_lateral();
  /// A car comes to rest, or moves again: what the ground does to its trucks is added to what acts on it.
  void hold(std::size_t car);
  void release(std::size_t car);
  /// Derailments of this step in the order of their time.
  void order_derailments();

  /// A truck of the car is off the rails, on the ties or beside them.
  bool off(std::size_t car) const { return derailed(car) || derailed(cars_.n + car); }
  /// The ground carries a truck of the car, or would.
  bool grounded(std::size_t car) const { return on_ground(car) || on_ground(cars_.n + car); }
  /// Its trucks are on the rails or on the ties, and brakes, rolling resistance or the drag of the ties hold them.
  bool held_by_brakes(std::size_t car) const;
  bool lost(std::size_t truck) const { return lost_[truck]; }
  bool lost_both(std::size_t car) const { return lost_[car] && lost_[cars_.n + car]; }
  bool past(std::size_t car) const { return past_[car]; }
  Cause cause(std::size_t car) const { return first_cause_[car]; }
  double arc(std::size_t truck) const { return arc_[truck]; }
  double load(std::size_t truck) const { return load_[truck]; }
  double leaning(std::size_t truck) const { return leaning_[truck]; }
  /// The first of the last cars that stand on the rails.
  std::size_t standing() const { return standing_; }
  /// Stored in the springs of a truck [J].
  double energy(std::size_t truck, const SpatialMotion& q) const;

  void walk(files::Archive& archive);
  /// The rest of what is restored, from the state.
  void restored();

 private:
  void show();
  Eigen::Vector3d wheel(const SpatialMotion& q, std::size_t truck, bool left) const {
    const double half_base = cars_.scenario.suspension.half_base;
    return q.point(cars_.truck_place(truck) + Eigen::Vector3d(0.0, left ? half_base : -half_base, 0.0));
  }
  void find_ground_under(std::size_t truck);
  /// Whether loops over wheels on the ground have to look at the trucks of a car.
  void find_grounded(std::size_t car);
  void forget_taken(std::size_t car);
  void show_strain();
  bool derailed(std::size_t truck) const { return cause_[truck] != Cause::none; }
  bool on_ground(std::size_t truck) const { return on_rails_[truck] == 0.0; }
  void leave(double t, std::size_t truck, Cause cause, double* y);
  /// The ground carries the truck from now on.
  void drop(std::size_t truck);
  void leave_bed(double t, std::size_t truck, TieRun::End by, double* y);
  /// Trucks on the ties follow the force; those that have drifted too far leave the track bed at time t.
  void drift(double t);
  void run_on_ties(double t, double h, std::size_t truck, double* y);
  void push_sideways(std::size_t truck, double speed, double* y);
  bool find_holding_load();
  /// Trucks with wheels above the flange for too long leave the rails in the step of length h from t on; true if any.
  bool lift(double t, double h);
  double height_of_wheels(std::size_t truck) const;
  void find_offsets();
  void find_standing();

  SpatialCars& cars_;
  SpatialBed& bed_;
  AirBrakes& brakes_;
  const ExtendedKernels& loops_;
  Record& record_;
  TieRuns ties_;
  const std::vector<double> bad_places_;
  const double cos_part_;
  std::vector<bool> lost_, past_;
  std::vector<std::size_t> loose_;  // trucks that are neither on the rails nor on the ties, in order
  std::vector<Cause> first_cause_, cause_;
  std::vector<double> rail_dampings_, on_rails_, arc_, arc_before_, offset_, tangent_x_, tangent_y_, place_x_, place_y_,
      overloaded_, lifted_, lateral_, lateral_before_, kick_;              // lifted: how long so far, s
  std::vector<double> rail_height_, rail_slope_, rail_tilt_, rail_twist_;  // empty where all rails are flat
  std::vector<double> load_held_, leaning_held_;  // of trucks off the rails, of cars that lie; else 0
  std::vector<double> grounded_, grip_, under_, feet_, sheared_, sheared_next_, pushed_damped_, rubbed_;
  std::vector<double> load_, leaning_, brake_, damper_, rocker_, braked_, braked_next_;
  // By the weight of the car: of friction on the ground, of what rails hold.
  std::vector<double> ground_share_, rail_share_;
  std::vector<double> holding_load_;
  bool lifted_before_ = false;  // a truck on the rails stood on one of them at most when forces were found last
  std::size_t ordered_ = 0, standing_ = 0;  // ordered: derailments
};

}  // namespace train_derail::model
