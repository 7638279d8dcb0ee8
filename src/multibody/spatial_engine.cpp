/// \file
/// The multibody engine in three dimensions. It was written from the equations, not from src/model, so that the two do
/// not share mistakes: Simbody moves the bodies, stops of couplers are the slope of their energy found by differences,
/// and friction is a differential equation.
#include "multibody/spatial_engine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <Simbody.h>
#include <Eigen/Geometry>

#include "multibody/simbody_run.hpp"
#include "multibody/spatial_bar.hpp"
#include "multibody/spatial_support.hpp"
#include "multibody/start.hpp"
#include "train_derail/outcome/posture.hpp"

namespace train_derail::multibody {

namespace {

using SimTK::MobilizedBody;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::Stage;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

constexpr double kUsualAccuracy = 1e-5;

/// A mistake that is put in: twice the gyroscopic moment, so that with the right one that Simbody has its sign is
/// wrong.
class WrongGyroscope final : public SimTK::Force::Custom::Implementation {
 public:
  explicit WrongGyroscope(std::vector<MobilizedBody> bodies) : bodies_(std::move(bodies)) {}
  void calcForce(const State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<Vec3>&,
                 SimTK::Vector&) const override {
    for (const MobilizedBody& body : bodies_) {
      const Rotation& axes = body.getBodyRotation(state);
      const Vec3 rates = ~axes * body.getBodyAngularVelocity(state);
      const Vec3 spin = body.getBodyMassProperties(state).getInertia() * rates;
      body.applyBodyTorque(state, axes * (2.0 * SimTK::cross(rates, spin)), forces);
    }
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

 private:
  const std::vector<MobilizedBody> bodies_;
};

/// Event: a truck comes to the point of derailment, or hangs from a body that has rolled and carries nothing.
class TruckLeaves final : public SimTK::TriggeredEventHandler {
 public:
  TruckLeaves(const Support& support, std::size_t truck, Stand from, Stand to)
      : TriggeredEventHandler(Stage::Velocity), support_(support), truck_(truck), from_(from), to_(to) {
    getTriggerInfo().setTriggerOnRisingSignTransition(false).setRequiredLocalizationTimeWindow(1e-6);
  }
  Real getValue(const State& state) const override {
    if (support_.stand(state, truck_) != from_) return 1.0;
    return from_ == Stand::on_rails ? -support_.along_track(state, truck_) : support_.holds_on(state, truck_);
  }
  void handleEvent(State& state, Real, bool&) const override { support_.set_stand(state, truck_, to_); }

 private:
  const Support& support_;
  const std::size_t truck_;
  const Stand from_, to_;
};

/// Event: a coupler breaks or slips out.
class CouplerParts final : public SimTK::TriggeredEventHandler {
 public:
  explicit CouplerParts(const SpatialBar& bar) : TriggeredEventHandler(Stage::Velocity), bar_(bar) {
    getTriggerInfo().setTriggerOnRisingSignTransition(false).setRequiredLocalizationTimeWindow(1e-6);
  }
  Real getValue(const State& state) const override { return bar_.broken(state) ? 1.0 : bar_.holds(state); }
  void handleEvent(State& state, Real, bool&) const override { bar_.part(state); }

 private:
  const SpatialBar& bar_;
};

Vec3 from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d to_eigen(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// How a body, a box, lies: its corners.
class Box {
 public:
  Box(const model::Car& car, const BodyMotion& m)
      : centre_(m.centre + m.axes.col(2) * (0.5 * (car.floor_height + car.roof_height) - car.centre_height)),
        upright_(m.axes(2, 2)) {
    const Eigen::Vector3d ahead(m.axes(0, 0), m.axes(1, 0), 0.0);
    axis_ = ahead.norm() > 0.0 ? Eigen::Vector3d(ahead.normalized()) : Eigen::Vector3d::UnitX();
    const Eigen::Vector3d half(0.5 * car.length, 0.5 * car.width, 0.5 * (car.roof_height - car.floor_height));
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d way(corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0);
      corners_.push_back(m.axes * half.cwiseProduct(way));
    }
  }
  model::Footprint footprint() const {
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(axis_);
    return {{centre_.x(), centre_.y()}, {axis_.x(), axis_.y()}, reach(axis_), reach(left)};
  }
  model::Attitude attitude() const {
    return {std::acos(std::min(std::max(upright_, -1.0), 1.0)), centre_.z(),
            centre_.z() - reach(Eigen::Vector3d::UnitZ())};
  }

 private:
  /// Of the farthest corner from the centre.
  double reach(const Eigen::Vector3d& direction) const {
    double most = 0.0;
    for (const Eigen::Vector3d& corner : corners_) most = std::max(most, corner.dot(direction));
    return most;
  }
  const Eigen::Vector3d centre_;
  const double upright_;
  Eigen::Vector3d axis_;  // flat
  std::vector<Eigen::Vector3d> corners_;
};

class SpatialRun final : public SimbodyRun {
 public:
  SpatialRun(const inputs::Scenario& s, const EngineOptions& o, const std::vector<BodyMotion>* start)
      : SimbodyRun(s), past_(train_.size(), 0), parted_(train_.size() - 1, 0) {
    build(o);
    State state = system_.realizeTopology();
    for (const Support* support : supports_) support->set_weights(state);
    place(state, start != nullptr ? *start : in_line());
    let_go(state);
    begin(state, o.accuracy > 0.0 ? o.accuracy : kUsualAccuracy);
    follow();
  }

  std::vector<BodyMotion> cars() const override {
    system_.realize(state(), Stage::Velocity);
    std::vector<BodyMotion> result;
    for (const MobilizedBody& body : bodies_) {
      BodyMotion& m = result.emplace_back();
      m.centre = to_eigen(body.getBodyOriginLocation(state()));
      for (int c = 0; c < 3; ++c) m.axes.col(c) = to_eigen(body.getBodyRotation(state()).col(c).asVec3());
      m.velocity = to_eigen(body.getBodyOriginVelocity(state()));
      m.rotation = to_eigen(body.getBodyAngularVelocity(state()));
    }
    return result;
  }

  std::vector<CouplerForce> coupler_forces() const override {
    system_.realize(state(), Stage::Velocity);
    std::vector<CouplerForce> result;
    for (const SpatialBar* bar : bars_) result.push_back({bar->broken(state()) ? 0.0 : bar->buff(state()), 0.0});
    return result;
  }

 private:
  void build(const EngineOptions& o) {
    // A slope of the whole track pulls along it; heights stay those of a level one.
    const double slope = std::sin(std::atan(scenario_.track.grade)), g = inputs::kStandardGravity;
    SimTK::Force::Gravity(forces_, matter_, Vec3(-g * slope, 0.0, -g));
    for (const model::Car& car : train_) {
      // As of a bar: the same about the lateral and the vertical axis.
      const SimTK::MassProperties mass(car.mass, Vec3(0.0),
                                       SimTK::Inertia(car.roll_inertia, car.yaw_inertia, car.yaw_inertia));
      const MobilizedBody& body = bodies_.emplace_back(matter_.updGround(), SimTK::Body::Rigid(mass));
      auto support = std::make_unique<Support>(scenario_, car, body, forces_, o.settle_time,
                                               o.fault == Fault::centre_below_rail ? -1.0 : 1.0);
      supports_.push_back(support.get());
      SimTK::Force::Custom(forces_, support.release());
      for (const std::size_t truck : {0U, 1U}) {
        system_.addEventHandler(new TruckLeaves(*supports_.back(), truck, Stand::on_rails, Stand::off_rails));
        system_.addEventHandler(new TruckLeaves(*supports_.back(), truck, Stand::off_rails, Stand::lost));
      }
    }
    const inputs::Coupler& law = scenario_.coupler;
    const double first_stiffness = law.draft_gear_travel > 0.0 ? law.draft_gear_stiffness : law.stiffness;
    for (std::size_t k = 1; k < train_.size(); ++k) {
      const model::Car &a = train_[k - 1], &b = train_[k];
      const Vec3 rear(-0.5 * a.length, 0.0, law.height - a.centre_height),
          front(0.5 * b.length, 0.0, law.height - b.centre_height);
      const double both = a.mass * b.mass / (a.mass + b.mass);
      auto bar = std::make_unique<SpatialBar>(law, inputs::coupler_hold(law, a.coupler_type, b.coupler_type), forces_,
                                              law.damping_ratio * critical_damping(first_stiffness, both),
                                              o.fault != Fault::no_roll_stop, bodies_[k - 1], rear, bodies_[k], front);
      bars_.push_back(bar.get());
      system_.addEventHandler(new CouplerParts(*bar));
      SimTK::Force::Custom(forces_, bar.release());
    }
    if (o.fault == Fault::gyroscopic_sign)
      SimTK::Force::Custom(forces_, new WrongGyroscope({bodies_.begin(), bodies_.end()}));
  }

  /// Cars on the rails, as the scenario starts them: the front truck of the first one has come to the point of
  /// derailment, and it turns about its rear truck.
  std::vector<BodyMotion> in_line() const {
    const Start drawn = drawn_start(scenario_, train_);
    const double half = 0.5 * train_.front().truck_spacing;
    std::vector<BodyMotion> result;
    for (std::size_t k = 0; k < train_.size(); ++k) {
      result.push_back({{drawn.x[k] - half, 0.0, train_[k].centre_height},
                        Eigen::Matrix3d::Identity(),
                        {scenario_.initial.speed, 0.0, 0.0},
                        Eigen::Vector3d::Zero()});
    }
    result.front().velocity.y() = half * drawn.yaw_rate;
    result.front().rotation.z() = drawn.yaw_rate;
    return result;
  }

  void place(State& state, const std::vector<BodyMotion>& start) const {
    if (train_.size() != start.size()) throw std::invalid_argument("a motion must be given for every car");
    for (std::size_t k = 0; k < train_.size(); ++k) {
      const BodyMotion& m = start[k];
      const SimTK::Mat33 axes(from_eigen(m.axes.col(0)), from_eigen(m.axes.col(1)), from_eigen(m.axes.col(2)));
      bodies_[k].setQToFitTransform(state, Transform(Rotation(axes), from_eigen(m.centre)));
      bodies_[k].setUToFitVelocity(state, SimTK::SpatialVec(from_eigen(m.rotation), from_eigen(m.velocity)));
    }
  }

  /// What is past its limit at the start: trucks past the point of derailment, couplers.
  void let_go(State& state) const {
    system_.realize(state, Stage::Velocity);
    for (const Support* support : supports_) {
      for (const std::size_t truck : {0U, 1U})
        if (support->along_track(state, truck) >= 0.0) support->set_stand(state, truck, Stand::off_rails);
    }
    for (const SpatialBar* bar : bars_) {
      system_.realize(state, Stage::Velocity);
      if (bar->holds(state) < 0.0) bar->part(state);
    }
  }

  std::vector<PlanMotion> from_above() const override {
    std::vector<PlanMotion> result;
    for (const BodyMotion& m : cars()) {
      result.push_back({m.centre.x(), m.centre.y(), std::atan2(m.axes(1, 0), m.axes(0, 0)), m.velocity.x(),
                        m.velocity.y(), m.rotation.z()});
    }
    return result;
  }

  void follow() override {
    system_.realize(state(), Stage::Velocity);
    for (std::size_t k = 0; k < bodies_.size(); ++k)
      if (bodies_[k].getBodyOriginLocation(state())[0] >= 0.0) past_[k] = 1;
    for (std::size_t i = 0; i < bars_.size(); ++i) {
      const int coupler = static_cast<int>(i) + 1;
      if (bars_[i]->broken(state())) {
        parted_[i] = 1;
        observer_.part(i);
        continue;
      }
      const double buff = bars_[i]->buff(state());
      if (buff > buff_peak_.force) buff_peak_ = {buff, coupler, time()};
      if (-buff > draft_peak_.force) draft_peak_ = {-buff, coupler, time()};
    }
  }

  bool derailed(std::size_t car) const {
    return supports_[car]->stand(state(), 0) != Stand::on_rails || supports_[car]->stand(state(), 1) != Stand::on_rails;
  }

  void report(outcome::Outcome& o) const override {
    Fates fates{past_, {}};
    for (std::size_t k = 0; k < train_.size(); ++k) fates.derailed.push_back(derailed(k) ? 1 : 0);
    const std::vector<BodyMotion> motion = cars();
    std::vector<model::Footprint> footprints;
    std::vector<outcome::Standing> standing;
    for (std::size_t k = 0; k < train_.size(); ++k) {
      const Box box(train_[k], motion[k]);
      footprints.push_back(box.footprint());
      if (observer_.counts(fates, k)) standing.push_back({box.footprint(), box.attitude()});
    }
    observer_.report(footprints, fates, o);
    o.posture = outcome::posture(standing);
    o.coupler_buff_peak = buff_peak_;
    o.coupler_draft_peak = draft_peak_;
    o.couplers_broken = static_cast<int>(std::count(parted_.begin(), parted_.end(), 1));
    // No ledger is kept, and nobody looks at what blocks the cars that stand.
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    o.energy_initial = o.energy_residual = o.blockage_force = kUnknown;
    for (const model::EnergyTerm& term : model::kEnergyTerms) o.energy.*term.term = kUnknown;
  }

  std::vector<MobilizedBody::Free> bodies_;
  std::vector<const Support*> supports_;  // the force subsystem owns these
  std::vector<const SpatialBar*> bars_;
  std::vector<char> past_, parted_;
  outcome::PeakForce buff_peak_, draft_peak_;
};

}  // namespace

std::unique_ptr<EngineRun> start_spatial_engine(const inputs::Scenario& scenario, const EngineOptions& options,
                                                const std::vector<BodyMotion>* start) {
  return std::make_unique<SpatialRun>(scenario, options, start);
}

}  // namespace train_derail::multibody
