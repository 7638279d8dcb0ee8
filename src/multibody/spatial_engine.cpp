/// \file
/// The multibody engine in three dimensions. It was written from the equations, not from src/model, so that the two do
/// not share mistakes: Simbody moves the bodies, stops of couplers are the slope of their energy found by differences,
/// and friction is a differential equation.
#include "multibody/spatial_engine.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Simbody.h>
#include <Eigen/Geometry>

#include "multibody/car_body.hpp"
#include "multibody/simbody_run.hpp"
#include "multibody/spatial_bar.hpp"
#include "multibody/spatial_contact.hpp"
#include "multibody/spatial_events.hpp"
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
  explicit WrongGyroscope(std::vector<CarBody> bodies) : bodies_(std::move(bodies)) {}
  void calcForce(const State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<Vec3>&,
                 SimTK::Vector&) const override {
    for (const CarBody& car : bodies_) {
      const MobilizedBody& body = car.now(state);
      const Rotation& axes = body.getBodyRotation(state);
      const Vec3 rates = ~axes * body.getBodyAngularVelocity(state);
      const Vec3 spin = body.getBodyMassProperties(state).getInertia() * rates;
      body.applyBodyTorque(state, axes * (2.0 * SimTK::cross(rates, spin)), forces);
    }
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

 private:
  const std::vector<CarBody> bodies_;
};

/// Event: something that holds, a positive number, does not hold any more.
class GivesWay final : public SimTK::TriggeredEventHandler {
 public:
  GivesWay(std::function<double(const State&)> holds, std::function<void(State&)> then)
      : TriggeredEventHandler(Stage::Velocity), holds_(std::move(holds)), then_(std::move(then)) {
    getTriggerInfo().setTriggerOnRisingSignTransition(false).setRequiredLocalizationTimeWindow(1e-6);
  }
  Real getValue(const State& state) const override { return holds_(state); }
  void handleEvent(State& state, Real, bool&) const override { then_(state); }

 private:
  const std::function<double(const State&)> holds_;
  const std::function<void(State&)> then_;
};
constexpr double kGone = 1.0;  // what has given way does so once

Vec3 from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d to_eigen(const Vec3& v) { return {v[0], v[1], v[2]}; }

/// How a body, a box, lies: its corners.
class Box {
 public:
  Box(const model::Car& car, const BodyMotion& m)
      : centre_(m.centre + m.axes.col(2) * (0.5 * (car.floor_height + car.roof_height) - car.centre_height)),
        upright_(m.axes(2, 2)),
        underframe_(inputs::kInfinity) {
    const Eigen::Vector3d ahead(m.axes(0, 0), m.axes(1, 0), 0.0);
    axis_ = ahead.norm() > 0.0 ? Eigen::Vector3d(ahead.normalized()) : Eigen::Vector3d::UnitX();
    const Eigen::Vector3d half(0.5 * car.length, 0.5 * car.width, 0.5 * (car.roof_height - car.floor_height));
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d way(corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0);
      corners_.push_back(m.axes * half.cwiseProduct(way));
      if (car.underframe_height >= car.floor_height) continue;
      const Eigen::Vector3d below(way.x() * half.x(), way.y() * 0.5 * car.underframe_width,
                                  car.underframe_height - car.centre_height);
      underframe_ = std::min(underframe_, (m.centre + m.axes * below).z());
    }
  }
  model::Footprint footprint() const {
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(axis_);
    return {{centre_.x(), centre_.y()}, {axis_.x(), axis_.y()}, reach(axis_), reach(left)};
  }
  model::Attitude attitude() const {
    return {std::acos(std::min(std::max(upright_, -1.0), 1.0)), centre_.z(),
            std::min(underframe_, centre_.z() - reach(Eigen::Vector3d::UnitZ()))};
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
  double underframe_;     // its lowest point
  Eigen::Vector3d axis_;  // flat
  std::vector<Eigen::Vector3d> corners_;
};

class SpatialRun final : public SimbodyRun {
 public:
  SpatialRun(const inputs::Scenario& s, const EngineOptions& o, const std::vector<BodyMotion>* start)
      : SimbodyRun(s),
        drawn_(drawn_start(scenario_, train_)),
        alignment_(scenario_.initial.perturbation, drawn_.x.back() - kFarthest, kFarthest),
        past_(train_.size(), 0),
        parted_(train_.size() - 1, 0) {
    build(o);
    State state = system_.realizeTopology();
    for (const Support* support : supports_) support->set_weights(state);
    if (contacts_ != nullptr) contacts_->set_weights(state);
    for (const CarBody& body : bodies_) body.begin(state);
    place(state, start != nullptr ? *start : in_line());
    let_go(state);
    begin(state, o.accuracy > 0.0 ? o.accuracy : kUsualAccuracy);
    follow();
  }

  std::vector<BodyMotion> cars() const override {
    system_.realize(state(), Stage::Velocity);
    std::vector<BodyMotion> result;
    for (const CarBody& car : bodies_) {
      const MobilizedBody& body = car.now(state());
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
    auto pipe = std::make_unique<BrakePipe>(scenario_, forces_, drawn_.crew_delay);
    auto torn = std::make_unique<TornTrack>(scenario_.rails.torn_length, forces_);
    pipe_ = pipe.get();
    torn_ = torn.get();
    SimTK::Force::Custom(forces_, pipe.release());
    SimTK::Force::Custom(forces_, torn.release());
    const Support::Common common{scenario_,
                                 forces_,
                                 alignment_,
                                 *pipe_,
                                 *torn_,
                                 o.settle_time,
                                 o.fault == Fault::centre_below_rail ? -1.0 : 1.0};
    for (const model::Car& car : train_) {
      const CarBody& body = bodies_.emplace_back(matter_, car);
      auto support = std::make_unique<Support>(common, supports_.size(), car, body);
      supports_.push_back(support.get());
      SimTK::Force::Custom(forces_, support.release());
      for (const std::size_t truck : {0U, 1U}) add_events(supports_.size() - 1, truck);
    }
    if (scenario_.contact.law != inputs::ContactLaw::none && train_.size() > 1) {
      auto contacts = std::make_unique<BodyContacts>(scenario_, train_, bodies_, forces_, o.settle_time,
                                                     o.fault == Fault::contact_at_centre);
      contacts_ = contacts.get();
      SimTK::Force::Custom(forces_, contacts.release());
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
      const SpatialBar* held = bar.get();
      system_.addEventHandler(new GivesWay([held](const State& s) { return held->broken(s) ? kGone : held->holds(s); },
                                           [this, held, k](State& s) {
                                             // No step ends before it is broken; the event is located just beyond.
                                             note_peaks(std::max(held->buff(s), -scenario_.coupler.break_draft),
                                                        static_cast<int>(k), s.getTime());
                                             held->part(s);
                                             pipe_->open(s, k - 1);
                                           }));
      SimTK::Force::Custom(forces_, bar.release());
    }
    if (o.fault == Fault::gyroscopic_sign) SimTK::Force::Custom(forces_, new WrongGyroscope(bodies_));
  }

  void add_events(std::size_t car, std::size_t truck) {
    const Support* support = supports_[car];
    system_.addEventHandler(new GivesWay(
        [=](const State& s) { return support->stand(s, truck) == Stand::on_rails ? support->stays(s, truck) : kGone; },
        [=](State& s) {
          if (support->at_the_end(s, truck)) kick(s, car, truck);
          leave(s, car, truck);
        }));
    system_.addEventHandler(new GivesWay(
        [=](const State& s) {
          return support->stand(s, truck) == Stand::off_rails ? support->holds_on(s, truck) : kGone;
        },
        [=](State& s) {
          support->set_stand(s, truck, Stand::lost);
          if (support->stand(s, 1 - truck) == Stand::lost) bodies_[car].lose_trucks(s);
        }));
  }

  /// A truck leaves the rails and tears them; so do those that stand there.
  void leave(State& state, std::size_t car, std::size_t truck) const {
    supports_[car]->set_stand(state, truck, Stand::off_rails);
    system_.realize(state, Stage::Velocity);
    torn_->tear(state, supports_[car]->along_track(state, truck));
    system_.realize(state, Stage::Velocity);
    for (std::size_t k = 0; k < supports_.size(); ++k) {
      for (const std::size_t t : {0U, 1U}) {
        if (supports_[k]->stand(state, t) != Stand::on_rails) continue;
        if (torn_->torn(state, supports_[k]->along_track(state, t))) leave(state, k, t);
      }
    }
  }

  /// The end of the rail pushes a truck aside: a blow across the car, at the height of its centre of mass.
  void kick(State& state, std::size_t car, std::size_t truck) const {
    system_.realize(state, Stage::Velocity);
    const MobilizedBody::Free& body = bodies_[car].now(state);
    const double arm = (truck == 0 ? 0.5 : -0.5) * train_[car].truck_spacing;
    const double mass = train_[car].mass, inertia = train_[car].yaw_inertia;
    const double blow = drawn_.kicks[2 * car + truck] / (1.0 / mass + arm * arm / inertia);
    SimTK::SpatialVec motion = body.getBodyVelocity(state);
    motion[0] += blow * arm / inertia * body.getBodyRotation(state).z().asVec3();
    motion[1] += blow / mass * body.getBodyRotation(state).y().asVec3();
    body.setUToFitVelocity(state, motion);
  }

  /// Cars on the rails, as the scenario starts them: the front truck of the first one to derail has come to the point
  /// of derailment, and it turns about its rear truck.
  std::vector<BodyMotion> in_line() const {
    const auto first = static_cast<std::size_t>(scenario_.initial.cars_ahead);
    const double speed = scenario_.initial.speed, lead = 0.5 * train_[first].truck_spacing;
    std::vector<BodyMotion> result;
    for (std::size_t k = 0; k < train_.size(); ++k) {
      // Both trucks are where the rails are, and follow them.
      const double x = drawn_.x[k] - lead, half = 0.5 * train_[k].truck_spacing, step = 0.01;
      const double front = alignment_.at(x + half), rear = alignment_.at(x - half);
      const double front_moves = (alignment_.at(x + half + step) - front) / step * speed,
                   rear_moves = (alignment_.at(x - half + step) - rear) / step * speed;
      const double heading = std::atan2(front - rear, 2.0 * half);
      BodyMotion m;
      m.centre = {x, 0.5 * (front + rear), train_[k].centre_height};
      m.axes = Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      m.velocity = {speed, 0.5 * (front_moves + rear_moves), 0.0};
      m.rotation = {0.0, 0.0, (front_moves - rear_moves) / (2.0 * half)};
      if (k == first) {
        m.velocity.y() += half * drawn_.yaw_rate;
        m.rotation.z() += drawn_.yaw_rate;
      }
      result.push_back(m);
    }
    return result;
  }

  void place(State& state, const std::vector<BodyMotion>& start) const {
    if (train_.size() != start.size()) throw std::invalid_argument("a motion must be given for every car");
    for (std::size_t k = 0; k < train_.size(); ++k) {
      const BodyMotion& m = start[k];
      const SimTK::Mat33 axes(from_eigen(m.axes.col(0)), from_eigen(m.axes.col(1)), from_eigen(m.axes.col(2)));
      const MobilizedBody::Free& body = bodies_[k].now(state);
      body.setQToFitTransform(state, Transform(Rotation(axes), from_eigen(m.centre)));
      body.setUToFitVelocity(state, SimTK::SpatialVec(from_eigen(m.rotation), from_eigen(m.velocity)));
    }
  }

  /// What is past its limit at the start: trucks past the point of derailment, couplers.
  void let_go(State& state) const {
    system_.realize(state, Stage::Velocity);
    for (std::size_t k = 0; k < supports_.size(); ++k) {
      for (const std::size_t truck : {0U, 1U}) {
        system_.realize(state, Stage::Velocity);
        if (supports_[k]->stand(state, truck) == Stand::on_rails && supports_[k]->at_the_end(state, truck))
          leave(state, k, truck);
      }
    }
    for (std::size_t i = 0; i < bars_.size(); ++i) {
      system_.realize(state, Stage::Velocity);
      if (bars_[i]->holds(state) >= 0.0) continue;
      bars_[i]->part(state);
      pipe_->open(state, i);
    }
  }

  std::vector<PlanMotion> from_above() const override {
    std::vector<PlanMotion> result;
    for (const BodyMotion& m : cars()) {
      result.push_back({m.centre.x(), m.centre.y(), std::atan2(m.axes(1, 0), m.axes(0, 0)), m.velocity.x(),
                        m.velocity.y(), m.rotation.z(), m});
    }
    return result;
  }

  void follow() override {
    system_.realize(state(), Stage::Velocity);
    for (auto k = static_cast<std::size_t>(scenario_.initial.cars_ahead); k < bodies_.size(); ++k)
      if (bodies_[k].now(state()).getBodyOriginLocation(state())[0] >= 0.0) past_[k] = 1;
    for (std::size_t i = 0; i < bars_.size(); ++i) {
      const int coupler = static_cast<int>(i) + 1;
      if (bars_[i]->broken(state())) {
        parted_[i] = 1;
        observer_.part(i);
        continue;
      }
      note_peaks(bars_[i]->buff(state()), coupler, time());
    }
    if (contacts_ != nullptr) follow_contacts();
  }

  void note_peaks(double buff, int coupler, double t) {
    if (buff > buff_peak_.force) buff_peak_ = {buff, coupler, t};
    if (-buff > draft_peak_.force) draft_peak_ = {-buff, coupler, t};
  }

  void follow_contacts() {
    system_.realize(state(), Stage::Dynamics);
    constexpr double kSameTouch = 0.25;  // s: of the same two cars, closer together
    for (const BodyContacts::Push& push : contacts_->pushes(state())) {
      const auto last = touched_.try_emplace(std::pair(push.a, push.b), -inputs::kInfinity).first;
      if (time() - last->second > kSameTouch) {
        observer_.note({push.velocity.norm(), push.closing, static_cast<int>(push.a) + 1, static_cast<int>(push.b) + 1,
                        time(), push.point[0], push.point[1]});
      }
      last->second = time();
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

  static constexpr double kFarthest = 2000.0;  // from its place at the start, the rails are as they are there [m]
  const Start drawn_;
  const Alignment alignment_;
  std::vector<CarBody> bodies_;
  std::vector<const Support*> supports_;  // the force subsystem owns these and what follows
  const BrakePipe* pipe_ = nullptr;
  const TornTrack* torn_ = nullptr;
  const BodyContacts* contacts_ = nullptr;  // none without a law of contact, or with one car
  std::vector<const SpatialBar*> bars_;
  std::vector<char> past_, parted_;
  std::map<std::pair<std::size_t, std::size_t>, double> touched_;  // when last [s]
  outcome::PeakForce buff_peak_, draft_peak_;
};

}  // namespace

std::unique_ptr<EngineRun> start_spatial_engine(const inputs::Scenario& scenario, const EngineOptions& options,
                                                const std::vector<BodyMotion>* start) {
  return std::make_unique<SpatialRun>(scenario, options, start);
}

}  // namespace train_derail::multibody
