/// \file
/// What is between a car in space and the ground.
#pragma once

#include <array>
#include <ostream>
#include <vector>

#include <Simbody.h>

#include "multibody/car_body.hpp"
#include "multibody/spatial_events.hpp"
#include "multibody/start.hpp"
#include "multibody/strained.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

/// Where a truck is.
enum class Stand : char { on_rails, off_rails, lost };

/// Damping coefficient at which a mass on a spring just does not swing.
double critical_damping(double stiffness, double mass);

/// Springs and dampers under both sides of a car's trucks, rails sideways and along, and corners of its body on the
/// ground. Numbers: strains of the ground, three of every point; then of every truck how far it strains the rails along
/// them, and for how long it has been overloaded, and has hung in the air [s].
class Support final : public Strained {
 public:
  /// What the track under all cars and the train have in common; must outlive the supports.
  struct Common {
    const inputs::Scenario& scenario;
    const SimTK::GeneralForceSubsystem& forces;
    const Alignment& alignment;
    const BrakePipe& pipe;
    const TornTrack& torn;
    double settle_time;  // friction of a point that slides comes to its limit within this
    double lever_sign;   // -1: a mistake is put in
  };
  /// Of car `number`.
  Support(const Common& common, std::size_t number, const model::Car& car, const CarBody& body);

  Stand stand(const SimTK::State& state, std::size_t truck) const { return stands(state).of[truck]; }
  void set_stand(SimTK::State& state, std::size_t truck, Stand stand) const;
  /// Positive while a truck off the rails stays with its body.
  double holds_on(const SimTK::State& state, std::size_t truck) const;
  /// Positive while a truck on the rails is on whole track, before the point of derailment if the rail is broken there
  /// for this car, and has not been overloaded, or hung in the air, for too long.
  double stays(const SimTK::State& state, std::size_t truck) const;
  /// It has come to the broken rail.
  bool at_the_end(const SimTK::State& state, std::size_t truck) const;
  double along_track(const SimTK::State& state, std::size_t truck) const;

  void realizeTopology(SimTK::State& state) const override;
  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<SimTK::Vec3>&,
                 SimTK::Vector&) const override;

 private:
  static constexpr int kBody = -1;
  struct Point {
    int truck;  // or kBody
    SimTK::Vec3 station;
    double stiffness, damping;
    double reach;  // how far below the station it is without load [m]
  };
  struct Stands {
    std::array<Stand, 2> of{Stand::on_rails, Stand::on_rails};
  };
  friend std::ostream& operator<<(std::ostream& out, const Stands& s) {
    return out << static_cast<int>(s.of[0]) << ' ' << static_cast<int>(s.of[1]);
  }
  struct Moving;
  struct Pressing {
    double push;  // along `up`; none below zero
    SimTK::Vec3 up, velocity;
  };
  /// A point's force, and how fast friction strains the ground under it.
  struct Touch {
    SimTK::Vec3 force, strain_rate;
  };

  Moving moving(const SimTK::State& state) const;
  const Stands& stands(const SimTK::State& state) const;
  void pull_at(SimTK::SpatialVec& sum, const Moving& car, SimTK::Vec3 station, int truck,
               const SimTK::Vec3& force) const;
  Pressing pressing(const Moving& car, const Point& p, bool on_rails) const;
  Touch touch(const Moving& car, const Stands& stands, const Point& p, const SimTK::Vec3& strain) const;
  /// What slows a truck on the rails down, at most `most`: force along them, and how fast it strains them.
  struct Drag {
    double force, strain_rate;
  };
  Drag drag(double speed, double most, double strain) const;
  /// Coefficient of friction of a point that is pulled that way.
  double friction(const Moving& car, const Point& p, const SimTK::Vec3& pull) const;

  /// On the rails: load of both sides, and how much more of it the left one has.
  struct Load {
    double both = 0.0, more_left = 0.0;
  };
  /// The rail is broken for this car.
  bool derails() const;
  /// Lateral force of the rails.
  double held(const Moving& car, std::size_t truck) const;
  bool overloaded(double lateral, const Load& load) const;
  bool hangs(const Moving& car, std::size_t truck, const Load& load) const;

  const Common common_;
  const inputs::Scenario& scenario_;
  const std::size_t number_;
  const CarBody body_;
  const double settle_time_, lever_sign_;
  const double rail_damping_, ground_damping_;
  std::vector<Point> points_;
  std::vector<SimTK::Vec3> trucks_;  // middles at the top of the rails
  mutable SimTK::DiscreteVariableIndex stands_;
};

}  // namespace train_derail::multibody
