/// \file
/// Trucks of the extended model: where they are by the track, whether rails hold them, and how they leave them.
#pragma once

#include <vector>

#include "model/air_brakes.hpp"
#include "model/car_ranges.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/tie_runs.hpp"
#include "train_derail/model/planar_model.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail::model {

/// Where the rails hold a truck.
struct PathPoint {
  Vector2 place;  ///< m
  Vector2 slope;  ///< by how much it moves for each metre along the track
  double bend;    ///< curvature of its path, left positive [1/m]
};
/// The same of both trucks of a car.
struct TruckPath {
  PathPoint front, rear;
};

/// Trucks are numbered: the front ones of all cars, then the rear ones. The loops find the forces under them.
class Trucks final : public Part {
 public:
  /// `cars`: the arrays of `train`. A truck on the ties may open the pipe of `brakes`. `train`, `loops`, `brakes` and
  /// `record` must outlive the part.
  Trucks(const PlanarModel& train, const PlanarArrays& cars, const inputs::Scenario& scenario,
         const ExtendedKernels& loops, AirBrakes& brakes, Record& record);

  /// What the loops need; valid as long as the part lives.
  TruckArrays arrays();
  bool rails_on() const { return rails_on_; }
  const Track& track() const { return track_; }
  const inputs::Rails& rails() const { return rails_; }
  const TieRuns& ties() const { return ties_; }
  /// Places of the trucks, which the loops find [m].
  double* place_x() { return px_.data(); }
  double* place_y() { return py_.data(); }

  bool derailed(Eigen::Index car) const;
  bool past_pod(Eigen::Index car) const { return past_pod_[static_cast<std::size_t>(car)]; }
  Cause cause(Eigen::Index car) const { return first_cause_[static_cast<std::size_t>(car)]; }
  TrackPlace place(Eigen::Index car, const Vector2& point) const;
  /// Both trucks are on the rails.
  bool sound(Eigen::Index car) const { return on_rails(truck(car, FRONT)) && on_rails(truck(car, REAR)); }
  /// Lateral force over what makes a truck leave the rails, as found last; of the truck that has more. Only on rails.
  double lateral_share(Eigen::Index car) const;
  /// Both trucks are on the rails, with a lateral force of at most `share` of what makes them leave.
  bool sits_easily(Eigen::Index car, double share) const {
    return sound(car) && (!rails_on_ || lateral_share(car) <= share);
  }
  /// No truck of the car is within `way` [m] of torn track, of a place where it leaves the rails, or of one where the
  /// curvature changes by more than `bend` [1/m].
  bool clear(Eigen::Index car, double way, double bend) const;
  /// Puts both trucks of a car on the rails as they are where its centre is.
  TruckPath seat(Eigen::Index car, const Vector2& centre);
  /// Lateral forces of the rails, of a car that the loops leave out [N].
  void set_lateral(Eigen::Index car, double front, double rear);
  /// Arc lengths of a car's trucks [m], and the direction of the track at the front one.
  double front_arc(Eigen::Index car) const { return arc_[truck(car, FRONT)]; }
  double rear_arc(Eigen::Index car) const { return arc_[truck(car, REAR)]; }
  Vector2 tangent(Eigen::Index car) const { return {tangent_x_[truck(car, FRONT)], tangent_y_[truck(car, FRONT)]}; }
  /// The foremost car that stands on the rails behind what has derailed; -1: none.
  Eigen::Index standing() const { return standing_; }

  /// Of which cars the trucks are looked after from now on; `busy` must outlive the part.
  void look_at(const CarRanges& busy) {
    busy_ = &busy.cars();
    busy_trucks_ = &busy.trucks();
  }
  /// State `y` of the start, places known: trucks past the point of derailment are off the rails.
  void start(const double* y);
  /// The step is done, places at its end known: who has passed the point of derailment, or come to torn track.
  void pass(const Step& step);
  /// Where the trucks are on the track, from the places that pass() has seen.
  void locate();
  /// The loops are about to find new lateral forces: those that are there become the ones before.
  void keep_lateral();
  /// Lateral forces beyond rails.derail_ratio for longer than rails.derail_time push trucks off the rails.
  bool give_way(const Step& step) override;
  /// Puts what has derailed in this step on in the order of time.
  void order_derailments();
  void walk(files::Archive& archive) override;

 private:
  enum End { FRONT, REAR };
  Eigen::Index truck(Eigen::Index car, End end) const { return end == FRONT ? car : cars_.cars + car; }
  Eigen::Index car_of(Eigen::Index truck) const { return truck < cars_.cars ? truck : truck - cars_.cars; }
  bool on_rails(Eigen::Index truck) const { return cause_[static_cast<std::size_t>(truck)] == Cause::none; }
  /// Arc lengths that belong to the places as they are now [m].
  const ArrayX& now() const { return track_.straight() ? px_ : new_arc_; }
  /// Finds them, on a track that is not straight.
  void find_places();
  void pass_pod(const double* y);
  void pass_pod(Eigen::Index car);
  PathPoint seat_truck(Eigen::Index truck, double s);
  void start_derailment();
  /// Trucks on the ties meet obstacles and part the brake pipe.
  void run_on_ties(const Step& step);
  bool passes_bad_place() const;
  void leave_bed(double t, Eigen::Index truck, TieRun::End by, double* y);
  void push_sideways(Eigen::Index truck, double speed, double* y);
  /// At the point of derailment or on torn track.
  void leave_bad_track(const Step& step);
  bool leave_overloaded(const Step& step);
  void leave(double t, Eigen::Index truck, Cause cause, double* y);
  void find_standing();
  /// Lateral forces of the rails, as the loops have found them last [N].
  const double* lateral() const;

  const PlanarModel& train_;
  const PlanarArrays cars_;
  const ExtendedKernels& loops_;
  const BusyCars *busy_ = nullptr, *busy_trucks_ = nullptr;
  const inputs::Rails rails_;
  const bool rails_on_;
  const inputs::Mechanism mechanism_;
  const bool front_first_;    // the truck that is off first
  const Eigen::Index ahead_;  // cars that have passed the point of derailment unharmed
  AirBrakes& brakes_;
  Record& record_;
  TieRuns ties_;
  Track track_;
  const std::vector<inputs::GroundPatch> patches_;
  // One a car.
  std::vector<bool> past_pod_;
  std::vector<Cause> first_cause_;
  Eigen::Index standing_ = -1;
  std::size_t ordered_ = 0;  // derailments of the record
  // One a truck; see TruckArrays.
  std::vector<Cause> cause_;
  const std::vector<double> bad_places_;
  std::vector<Eigen::Index> drifted_off_;  // to leave the track bed in this step
  ArrayX new_arc_, bed_offset_;  // of the places as they are now, offsets from the centre line; only on curved track
  ArrayX ground_load_, kick_, arc_, overloaded_, on_track_, offset_, tangent_x_, tangent_y_, load_, holding_load_,
      rail_damping_, patch_, px_, py_;
  ArrayX lateral_before_;  // lateral forces of the rails at the end of the step before [N]
  ArrayX kept_;            // column after column
};

}  // namespace train_derail::model
