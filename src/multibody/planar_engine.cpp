/// \file
/// The multibody engine in the plane. It was written from the free-body diagrams (paper, figures 1 to 4; docs/model.md,
/// sections 2 and 3), not from src/model, so that the two do not share mistakes.
#include "multibody/planar_engine.hpp"

#include <algorithm>
#include <cmath>

#include <Simbody.h>
#include <Eigen/Geometry>

#include "multibody/simbody_run.hpp"
#include "multibody/start.hpp"

namespace train_derail::multibody {

namespace {

using SimTK::MobilizedBody;
using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vec3;

using BodyForces = SimTK::Vector_<SimTK::SpatialVec>;
using Flags = SimTK::Array_<char>;

/// A coupler: a massless bar between the rear pin of the car ahead and the front pin of the car behind (figures 2 to
/// 4).
class Bar final : public SimTK::Force::Custom::Implementation {
 public:
  Bar(const inputs::Coupler& law, bool rigid, double lateral_sign, const MobilizedBody& ahead, const Vec3& rear_pin,
      const MobilizedBody& behind, const Vec3& front_pin)
      : law_(law),
        rigid_(rigid),
        lateral_sign_(lateral_sign),
        ahead_(ahead),
        behind_(behind),
        rear_pin_(rear_pin),
        front_pin_(front_pin) {}

  bool dependsOnlyOnPositions() const override { return true; }

  void calcForce(const State& state, BodyForces& forces, SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    const Line line = line_of(state);
    const double on_ahead = stop_moment(swing(state, ahead_, line)),
                 on_behind = stop_moment(swing(state, behind_, line));
    const Vec3 left(-line.along[1], line.along[0], 0.0);
    const Vec3 force = push(line.length) * line.along + side(line, on_ahead + on_behind) * left;
    ahead_.applyForceToBodyPoint(state, rear_pin_, force, forces);
    behind_.applyForceToBodyPoint(state, front_pin_, -force, forces);
    ahead_.applyBodyTorque(state, Vec3(0.0, 0.0, on_ahead), forces);
    behind_.applyBodyTorque(state, Vec3(0.0, 0.0, on_behind), forces);
  }

  /// Forces of the coupler, with the signs of CouplerForce.
  CouplerForce force(const State& state) const {
    const Line line = line_of(state);
    return {push(line.length),
            -side(line, stop_moment(swing(state, ahead_, line)) + stop_moment(swing(state, behind_, line)))};
  }

  Real calcPotentialEnergy(const State& state) const override { return strain(state) + stop_energy(state); }

  /// Strain energy of the spring and of the two swing stops [J].
  double strain(const State& state) const {
    if (rigid_) return 0.0;
    const double beyond = std::max(std::abs(gap(state).length - law_.length) - 0.5 * law_.slack, 0.0);
    return 0.5 * law_.stiffness * beyond * beyond;
  }
  double stop_energy(const State& state) const {
    const Line line = line_of(state);
    double energy = 0.0;
    for (const MobilizedBody* body : {&ahead_, &behind_}) {
      const double beyond = std::max(std::abs(swing(state, *body, line)) - law_.swing_limit, 0.0);
      const double yield =
          law_.swing_stiffness > 0.0 ? law_.swing_moment_max / law_.swing_stiffness : inputs::kInfinity;
      const double bent = std::min(beyond, yield);
      energy +=
          0.5 * law_.swing_stiffness * bent * bent + (beyond > bent ? law_.swing_moment_max * (beyond - bent) : 0.0);
    }
    return energy;
  }

  Gap gap(const State& state) const {
    const Line line = line_of(state);
    const Vec3 parting =
        ahead_.findStationVelocityInGround(state, rear_pin_) - behind_.findStationVelocityInGround(state, front_pin_);
    return {line.length, SimTK::dot(parting, line.along)};
  }

  /// Axial force at a length of the bar, buff positive (figure 3) [N].
  double push(double length) const {
    if (rigid_) return 0.0;  // a rod is a constraint, which has its own force
    const double stretch = length - law_.length, free = 0.5 * law_.slack;
    if (std::abs(stretch) <= free) return 0.0;
    return -law_.stiffness * (stretch > 0.0 ? stretch - free : stretch + free);
  }

 private:
  struct Line {
    double length;
    Vec3 along;  // unit vector from the car behind to the car ahead
  };
  Line line_of(const State& state) const {
    const Vec3 between =
        ahead_.findStationLocationInGround(state, rear_pin_) - behind_.findStationLocationInGround(state, front_pin_);
    const double length = between.norm();
    return {length, between / length};
  }

  /// Force to the left of the bar on the car ahead [N]. The bar has no mass and must be in balance about its rear end:
  /// the force at its other end, times its length, undoes the moment `turning` with which it turns the two cars.
  double side(const Line& line, double turning) const { return -lateral_sign_ * turning / line.length; }

  /// Returns the swing: the angle from the car's heading to the bar, counter-clockwise, in (-pi, pi].
  static double swing(const State& state, const MobilizedBody& body, const Line& line) {
    const Vec3 heading = body.getBodyRotation(state).x().asVec3();
    return std::atan2(heading[0] * line.along[1] - heading[1] * line.along[0], SimTK::dot(heading, line.along));
  }

  /// Moment of the swing stop on the car, which turns it towards the bar (figure 4) [N m].
  double stop_moment(double swing) const {
    const double beyond = std::abs(swing) - law_.swing_limit;
    if (beyond <= 0.0) return 0.0;
    return std::copysign(std::min(law_.swing_stiffness * beyond, law_.swing_moment_max), swing);
  }

  const inputs::Coupler law_;
  const bool rigid_;
  const double lateral_sign_;
  const MobilizedBody ahead_, behind_;
  const Vec3 rear_pin_, front_pin_;
};

/// Friction of the ground: half the weight of a car presses on the ground under each truck (figure 1).
class GroundForces final : public SimTK::Force::Custom::Implementation {
 public:
  struct Truck {
    MobilizedBody body;
    std::size_t car;
    Vec3 station;
    double load;  // load on the ground [N]
  };

  GroundForces(const inputs::Ground& law, const SimTK::GeneralForceSubsystem& forces, std::size_t cars,
               std::vector<Truck> trucks)
      : law_(law), forces_(forces), cars_(cars), trucks_(std::move(trucks)) {}

  bool past(const State& state, std::size_t car) const { return flags(state)[static_cast<unsigned>(car)] != 0; }
  void set_past(State& state, std::size_t car) const {
    SimTK::Value<Flags>::updDowncast(forces_.updDiscreteVariable(state, flags_)).upd()[static_cast<unsigned>(car)] = 1;
  }

  void realizeTopology(State& state) const override {
    flags_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics,
                                              new SimTK::Value<Flags>(Flags(static_cast<unsigned>(cars_), char(0))));
    work_ = forces_.allocateZ(state, SimTK::Vector(2, 0.0));
  }

  void calcForce(const State& state, BodyForces& forces, SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    for (const Truck& truck : trucks_) {
      const Vec3 velocity = truck.body.findStationVelocityInGround(state, truck.station);
      truck.body.applyForceToBodyPoint(state, truck.station, rub(truck, past(state, truck.car), velocity), forces);
    }
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

  /// The work against friction, before and past the point of derailment, is integrated with the motion.
  void realizeAcceleration(const State& state) const override {
    SimTK::Vector& rate = forces_.updZDot(state);
    rate[work_] = rate[work_ + 1] = 0.0;
    for (const Truck& truck : trucks_) {
      const Vec3 velocity = truck.body.findStationVelocityInGround(state, truck.station);
      const bool derailed = past(state, truck.car);
      rate[work_ + (derailed ? 1 : 0)] -= SimTK::dot(rub(truck, derailed, velocity), velocity);
    }
  }
  double work(const State& state, bool past) const { return forces_.getZ(state)[work_ + (past ? 1 : 0)]; }
  /// The work does not influence the step size.
  void set_weights(State& state) const { state.updZWeights(forces_.getMySubsystemIndex()) = 1e-20; }

 private:
  const Flags& flags(const State& state) const {
    return SimTK::Value<Flags>::downcast(forces_.getDiscreteVariable(state, flags_)).get();
  }

  /// Force on a truck that moves with `velocity` [N].
  Vec3 rub(const Truck& truck, bool derailed, Vec3 velocity) const {
    const double most = truck.load * (derailed ? law_.off_track_friction : law_.on_track_friction);
    if (!derailed && law_.on_track_law != inputs::OnTrackLaw::isotropic)
      velocity[1] = 0.0;  // friction acts along the rails only
    return -most * velocity / std::sqrt(velocity.normSqr() + law_.regularization_speed * law_.regularization_speed);
  }

  const inputs::Ground law_;
  const SimTK::GeneralForceSubsystem& forces_;
  const std::size_t cars_;
  const std::vector<Truck> trucks_;
  mutable SimTK::DiscreteVariableIndex flags_;  // belongs to the model, not to a state
  mutable SimTK::ZIndex work_;
};

/// Event: the centre of a car reaches the point of derailment. From here on the off-track friction acts, and the rails
/// let the car go.
class Crossing final : public SimTK::TriggeredEventHandler {
 public:
  Crossing(const MobilizedBody::Planar& body, std::size_t car, const GroundForces& ground,
           std::vector<SimTK::Constraint> rails)
      : TriggeredEventHandler(Stage::Position), body_(body), car_(car), ground_(ground), rails_(std::move(rails)) {
    getTriggerInfo().setTriggerOnFallingSignTransition(false).setRequiredLocalizationTimeWindow(kWindow);
  }
  Real getValue(const State& state) const override { return ground_.past(state, car_) ? 1.0 : body_.getQ(state)[1]; }
  void handleEvent(State& state, Real, bool&) const override {
    ground_.set_past(state, car_);
    for (const SimTK::Constraint& rail : rails_) rail.disable(state);
  }

 private:
  static constexpr double kWindow = 1e-4;  // time to which an event is located [s]
  const MobilizedBody::Planar body_;
  const std::size_t car_;
  const GroundForces& ground_;
  const std::vector<SimTK::Constraint> rails_;
};

class PlanarRun final : public SimbodyRun {
 public:
  PlanarRun(const inputs::Scenario& scenario, const EngineOptions& options) : SimbodyRun(scenario) {
    build(options);
    start(options);
  }

  std::vector<BodyMotion> cars() const override {
    std::vector<BodyMotion> result;
    for (const PlanMotion& m : from_above()) {
      result.push_back({{m.x, m.y, 0.0},
                        Eigen::AngleAxisd(m.theta, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
                        {m.vx, m.vy, 0.0},
                        {0.0, 0.0, m.omega}});
    }
    return result;
  }

  std::vector<CouplerForce> coupler_forces() const override {
    system_.realize(state(), rods_.empty() ? Stage::Velocity : Stage::Acceleration);
    std::vector<CouplerForce> result;
    for (const Bar* bar : bars_) result.push_back(bar->force(state()));
    for (std::size_t i = 0; i < rods_.size(); ++i) result[i].axial = -rods_[i].getRodTension(state());
    return result;
  }

 private:
  void build(const EngineOptions& o) {
    const Fault fault = o.fault;
    std::vector<GroundForces::Truck> trucks;
    for (std::size_t k = 0; k < train_.size(); ++k) {
      const model::Car& car = train_[k];
      const double yaw = car.yaw_inertia * (fault == Fault::yaw_inertia ? 1.2 : 1.0);
      // In the plane only the inertia about the vertical axis matters. The others must be those of a possible body,
      // here of a flat one.
      const SimTK::MassProperties mass(car.mass, Vec3(0.0), SimTK::Inertia(0.5 * yaw, 0.5 * yaw, yaw));
      bodies_.emplace_back(matter_.updGround(), SimTK::Body::Rigid(mass));
      const double half_load = 0.5 * car.weight;
      if (fault != Fault::no_front_truck)
        trucks.push_back({bodies_[k], k, Vec3(0.5 * car.truck_spacing, 0.0, 0.0), half_load});
      trucks.push_back({bodies_[k], k, Vec3(-0.5 * car.truck_spacing, 0.0, 0.0), half_load});
      rails_.emplace_back();
      if (k > 0 && scenario_.ground.on_track_law == inputs::OnTrackLaw::guided) {
        for (const int q : {0, 2}) {  // heading and lateral position
          rails_[k].push_back(SimTK::Constraint::ConstantCoordinate(bodies_[k], SimTK::MobilizerQIndex(q), 0.0));
        }
      }
    }
    const auto reach = [&](const model::Car& car) {
      return 0.5 * (fault == Fault::coupler_arm ? car.truck_spacing : car.length);
    };
    for (std::size_t k = 1; k < train_.size(); ++k) {
      const Vec3 rear(-reach(train_[k - 1]), 0.0, 0.0), front(reach(train_[k]), 0.0, 0.0);
      inputs::Coupler law = scenario_.coupler;
      if (fault == Fault::coupler_arm) {  // moved so that the coupler is still without force at the start
        law.length +=
            0.5 * (train_[k - 1].length - train_[k - 1].truck_spacing + train_[k].length - train_[k].truck_spacing);
      }
      auto bar = std::make_unique<Bar>(law, o.rods, fault == Fault::lateral_force_sign ? -1.0 : 1.0, bodies_[k - 1],
                                       rear, bodies_[k], front);
      bars_.push_back(bar.get());
      SimTK::Force::Custom(forces_, bar.release());
      if (o.rods) rods_.emplace_back(bodies_[k - 1], rear, bodies_[k], front, law.length);
    }
    inputs::Ground law = scenario_.ground;
    if (fault == Fault::friction_swapped) std::swap(law.on_track_friction, law.off_track_friction);
    auto friction = std::make_unique<GroundForces>(law, forces_, train_.size(), std::move(trucks));
    ground_ = friction.get();
    SimTK::Force::Custom(forces_, friction.release());
    for (std::size_t k = 0; k < train_.size(); ++k) {
      system_.addEventHandler(new Crossing(bodies_[k], k, *ground_, rails_[k]));
    }
  }

  void start(const EngineOptions& o) {
    State state = system_.realizeTopology();
    ground_->set_weights(state);
    const Start drawn = drawn_start(scenario_, train_);
    for (std::size_t k = 0; k < train_.size(); ++k) {
      bodies_[k].setQ(state, Vec3(0.0, drawn.x[k], 0.0));
      bodies_[k].setU(state, Vec3(k == 0 ? drawn.yaw_rate : 0.0, scenario_.initial.speed, 0.0));
      if (drawn.x[k] >= 0.0) ground_->set_past(state, k);
    }
    begin(state, o.accuracy > 0.0 ? o.accuracy : scenario_.solver.rtol);
    energy_initial_ = energy().total();
    follow();
  }

  std::vector<PlanMotion> from_above() const override {
    std::vector<PlanMotion> cars;
    for (const MobilizedBody::Planar& body : bodies_) {
      const Vec3 &q = body.getQ(state()), &u = body.getU(state());
      cars.push_back({q[1], q[2], q[0], u[1], u[2], u[0]});
    }
    return cars;
  }

  void follow() override {
    system_.realize(state(), Stage::Velocity);
    std::vector<Gap> gaps;
    for (const Bar* bar : bars_) gaps.push_back(bar->gap(state()));
    observer_.follow(time(), gaps);
  }

  model::EnergyLedger energy() const {
    system_.realize(state(), Stage::Velocity);
    model::EnergyLedger e;
    for (const MobilizedBody::Planar& body : bodies_) {
      const SimTK::MassProperties& mass = body.getBodyMassProperties(state());
      const Vec3& u = body.getU(state());
      e.kinetic_rotation += 0.5 * mass.getInertia().getMoments()[2] * u[0] * u[0];
      e.kinetic_translation += 0.5 * mass.getMass() * (u[1] * u[1] + u[2] * u[2]);
    }
    for (const Bar* bar : bars_) {
      e.coupler_axial += bar->strain(state());
      e.coupler_swing += bar->stop_energy(state());
    }
    e.work_on_track = ground_->work(state(), false);
    e.work_off_track = ground_->work(state(), true);
    return e;
  }

  void report(outcome::Outcome& o) const override {
    Fates fates;
    for (std::size_t k = 0; k < train_.size(); ++k) fates.past.push_back(ground_->past(state(), k) ? 1 : 0);
    fates.derailed = fates.past;
    observer_.report(observer_.footprints(from_above()), fates, o);
    if (!bars_.empty()) {
      const auto peak = [](const Observer::Extreme& e, double force) {
        return force > 0.0 ? outcome::PeakForce{force, e.coupler, e.time} : outcome::PeakForce{};
      };
      const Observer::Extreme &shortest = observer_.shortest(), &longest = observer_.longest();
      o.coupler_buff_peak = peak(shortest, bars_.front()->push(shortest.length));
      o.coupler_draft_peak = peak(longest, -bars_.front()->push(longest.length));
    }
    o.energy = energy();
    o.energy_initial = energy_initial_;
    if (o.energy_initial > 0.0) o.energy_residual = std::abs(o.energy.total() - o.energy_initial) / o.energy_initial;
  }

  std::vector<MobilizedBody::Planar> bodies_;
  std::vector<const Bar*> bars_;  // the force subsystem owns them
  std::vector<SimTK::Constraint::Rod> rods_;
  const GroundForces* ground_ = nullptr;
  std::vector<std::vector<SimTK::Constraint>> rails_;  // constraints of each car; on-track law guided
  double energy_initial_ = 0.0;
};

}  // namespace

std::unique_ptr<EngineRun> start_planar_engine(const inputs::Scenario& scenario, const EngineOptions& options) {
  return std::make_unique<PlanarRun>(scenario, options);
}

}  // namespace train_derail::multibody
