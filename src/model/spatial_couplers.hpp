/// \file
/// Couplers of the spatial model: bars between pins, with stops in yaw, pitch and roll, that slip or break.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "model/air_brakes.hpp"
#include "model/coupler_butts.hpp"
#include "model/part.hpp"
#include "model/rest.hpp"
#include "model/spatial_cars.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/model/observation.hpp"

namespace train_derail::model {

/// A bar between two pins, as seen from both cars.
struct Bar {
  Eigen::Vector3d arm_lead, arm_trail, u;  // from the centres to the pins; from the trail car's pin to the lead car's
  Eigen::Vector3d own[2];                  // u along the axes of the lead and the trail car
  double gap;
  Butts<double> butts;

  double yaw(int end) const { return std::atan2(own[end].y(), own[end].x()); }
  double pitch(int end) const { return std::asin(std::clamp(own[end].z(), -1.0, 1.0)); }
  /// Change of the length that acts [m/s].
  double rate(const SpatialMotion& lead, const SpatialMotion& trail) const {
    const Eigen::Vector3d tilts = butts.lead * lead.axes.col(2) + butts.trail * trail.axes.col(2);
    const Eigen::Vector3d parting =
        lead.velocity + lead.rotation.cross(arm_lead) - trail.velocity - trail.rotation.cross(arm_trail);
    return parting.dot(u - (tilts - tilts.dot(u) * u) / gap) -
           butts.lead * lead.rotation.dot(lead.axes.col(2).cross(u)) -
           butts.trail * trail.rotation.dot(trail.axes.col(2).cross(u));
  }
};

class SpatialCouplers {
 public:
  SpatialCouplers(SpatialCars& cars, const std::vector<Car>& train, AirBrakes& brakes, Record& record, Waker& waker);

  std::size_t count() const { return alive_.size(); }
  bool broken(std::size_t i) const { return alive_[i] == 0.0; }
  const ArrayX& axial() const { return axial_; }
  /// Of two cars, wherever they are.
  Bar bar(const SpatialMotion& lead, const SpatialMotion& trail, std::size_t i) const;
  /// Stored in a coupler that holds [J].
  double axial_energy_of(const Bar& b) const;
  double stop_energy_of(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b, std::size_t i) const;
  /// As people see it; forces that are not of the bar itself are left at zero if it is broken.
  CouplerObservation observe(const SpatialMotion& lead, const SpatialMotion& trail, std::size_t i) const;

  /// Forces along the couplers, by the wide loops.
  void pull() { peaks_ = cars_.wide.couple(cars_.arrays, cars_.state); }
  /// What the wide loops leave of a coupler: stops, and what may break it. Wakes a car that lies if it pulls otherwise.
  void couple(std::size_t i);
  /// The same for all of them.
  void couple_all();
  /// One of its cars comes to rest: it is held against what it does from now on.
  void hold(std::size_t i);
  /// Breaks those that are beyond a limit; whether any has.
  bool give_way(double t);
  void note_peaks(double t);

  void walk(files::Archive& archive);

 private:
  struct Stops {
    double swing = 0.0, moment = 0.0, vertical = 0.0, twist = 0.0;
    double effort = 0.0;  // of all stops, as a force [N]
    std::int64_t round = 0;
  };

  void show();
  static double roll(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b);
  bool turned_far(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) const;
  void engage_stops(std::size_t i, const Bar& b);
  bool break_coupler(double t, std::size_t i);
  void note_peak(double t, std::size_t i, double force);

  SpatialCars& cars_;
  AirBrakes& brakes_;
  Record& record_;
  Waker& waker_;
  ArrayX axial_;
  std::vector<double> alive_, damping_, far_, rise_, bars_, about_lead_, about_trail_, pin_axial_, pin_damper_;
  CouplerExtremes peaks_;
  std::vector<unsigned char> engaged_;  // 1 where stops were found engaged, else 0
  std::vector<Stops> stops_;            // what may break or slip, as found last
  std::vector<inputs::CouplerHold> holds_;
  double least_slip_ = inputs::kInfinity;  // at which any of them slips [m]
  std::vector<Held> held_;                 // where one of the two cars lies still: axial force, effort of the stops
};

}  // namespace train_derail::model
