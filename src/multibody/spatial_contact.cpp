#include "multibody/spatial_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace train_derail::multibody {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vec3;

using Names = SimTK::Array_<int>;

BodyContacts::BodyContacts(const inputs::Scenario& s, const std::vector<model::Car>& train,
                           const std::vector<CarBody>& bodies, const SimTK::GeneralForceSubsystem& forces,
                           double settle_time, bool at_centre)
    : Strained(forces),
      law_(s.contact),
      quiet_(s.ground.regularization_speed),
      settle_time_(settle_time),
      at_centre_(at_centre),
      bodies_(bodies) {
  for (const model::Car& car : train) {
    const double height = car.roof_height - car.floor_height;
    half_.emplace_back(0.5 * car.length, 0.5 * car.width, 0.5 * height);
    centre_.emplace_back(0.0, 0.0, car.floor_height + 0.5 * height - car.centre_height);
    radius_.push_back(half_.back().norm());
  }
}

void BodyContacts::realizeTopology(State& state) const {
  allocate(state, kNumbers * pairs());
  pushes_ = forces_.allocateCacheEntry(state, Stage::Dynamics, new SimTK::Value<std::vector<Push>>());
  axes_ = state.allocateAutoUpdateDiscreteVariable(forces_.getMySubsystemIndex(), Stage::Dynamics,
                                                   new SimTK::Value<Names>(Names(pairs(), -1)), Stage::Velocity);
}

Block BodyContacts::block(const State& state, std::size_t car) const {
  const SimTK::Transform& at = bodies_[car].now(state).getBodyTransform(state);
  return {at * centre_[car], at.R(), half_[car]};
}

void BodyContacts::calcForce(const State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<Vec3>&,
                             SimTK::Vector&) const {
  const SimTK::SubsystemIndex here = forces_.getMySubsystemIndex();
  const Names& before = SimTK::Value<Names>::downcast(forces_.getDiscreteVariable(state, axes_)).get();
  Names& axes = SimTK::Value<Names>::updDowncast(state.updDiscreteVarUpdateValue(here, axes_)).upd();
  const Real* z = numbers(state);
  Real* rate = rates(state);
  auto& pushes = SimTK::Value<std::vector<Push>>::updDowncast(forces_.updCacheEntry(state, pushes_)).upd();
  pushes.clear();
  std::vector<Block> blocks;
  for (std::size_t k = 0; k < bodies_.size(); ++k) blocks.push_back(block(state, k));
  int pair = 0;
  for (std::size_t a = 0; a < blocks.size(); ++a) {
    for (std::size_t b = a + 1; b < blocks.size(); ++b, ++pair, z += kNumbers, rate += kNumbers) {
      const Strain now{z[0], Vec3(z[1], z[2], z[3])};
      Strain change{-now.crushed / settle_time_, -now.sheared / settle_time_};  // without a touch they are forgotten
      axes[pair] = -1;
      if ((blocks[a].centre - blocks[b].centre).norm() < radius_[a] + radius_[b]) {
        const Patch patch = patch_of(blocks[a], blocks[b], before[pair]);
        axes[pair] = patch.axis;
        if (patch.count > 0) change = press(state, a, b, patch, now, forces, pushes);
      }
      rate[0] = change.crushed;
      for (int c = 0; c < 3; ++c) rate[1 + c] = change.sheared[c];
    }
  }
  state.markDiscreteVarUpdateValueRealized(here, axes_);
}

bool BodyContacts::at_end(const State& state, std::size_t car, const Vec3& normal) const {
  const Vec3 own = (~bodies_[car].now(state).getBodyRotation(state) * normal).abs();
  return own[0] > own[1] && own[0] >= own[2];
}

BodyContacts::Strain BodyContacts::press(const State& state, std::size_t a, std::size_t b, const Patch& patch,
                                         const Strain& now, SimTK::Vector_<SimTK::SpatialVec>& forces,
                                         std::vector<Push>& pushes) const {
  const Vec3& n = patch.normal;
  const SimTK::MobilizedBody &first = bodies_[a].now(state), &second = bodies_[b].now(state);
  const auto station = [&state](const SimTK::MobilizedBody& body, const Vec3& point) {
    return ~body.getBodyTransform(state) * point;
  };
  const bool ends = at_end(state, a, n) && at_end(state, b, n);
  const double yields = (ends ? law_.crush_force : std::min(law_.side_crush_force, law_.crush_force)) / law_.stiffness;
  const double returned = law_.restitution * law_.restitution, share = 1.0 / patch.count;
  std::array<double, 8> push{};
  std::array<Vec3, 8> slip;
  std::array<double, 8> closing{};
  double force = 0.0, crushed = now.crushed;
  Push whole{a, b, patch.point[0], Vec3(0.0), -inputs::kInfinity};
  Vec3 sliding(0.0);
  for (int i = 0; i < patch.count; ++i) {
    const Vec3& p = patch.point[i];
    const Vec3 relative = first.findStationVelocityInGround(state, station(first, p)) -
                          second.findStationVelocityInGround(state, station(second, p));
    closing[i] = -SimTK::dot(relative, n);
    slip[i] = relative + closing[i] * n;
    if (closing[i] > whole.closing) {
      whole.velocity = relative;
      whole.closing = closing[i];
    }
    if (closing[i] > 0.0) crushed = std::max(crushed, patch.depth[i] - yields);
  }
  for (int i = 0; i < patch.count; ++i) {
    const double elastic = std::min(std::max(patch.depth[i] - crushed, 0.0), yields);
    const double way = closing[i] / std::hypot(closing[i], quiet_);  // 1 while it is loaded, -1 while it is unloaded
    push[i] = share * law_.stiffness * elastic * (0.5 * (1.0 + way) + 0.5 * (1.0 - way) * returned);
    sliding += push[i] * slip[i];
    force += push[i];
  }
  Strain change{(crushed - now.crushed) / settle_time_, -now.sheared / settle_time_};
  if (force <= 0.0) return change;
  pushes.push_back(whole);
  const Vec3 along = now.sheared - SimTK::dot(now.sheared, n) * n;
  const double most = law_.friction * force / law_.stiffness;
  const Vec3 held = along.norm() > most ? Vec3(most / along.norm() * along) : along;
  change.sheared = sliding / force + (held - now.sheared) / settle_time_;
  // Three tenths of what is critical.
  const double mass_a = first.getBodyMass(state), mass_b = second.getBodyMass(state);
  const double damping = 0.3 * 2.0 * std::sqrt(law_.stiffness * mass_a * mass_b / (mass_a + mass_b));
  for (int i = 0; i < patch.count; ++i) {
    Vec3 rub = -push[i] / force * (law_.stiffness * held + damping * slip[i]);
    const double limit = law_.friction * push[i];
    if (rub.norm() > limit) rub *= limit / rub.norm();
    const Vec3 pull = push[i] * n + rub;
    const Vec3 nowhere(0.0);
    first.applyForceToBodyPoint(state, at_centre_ ? nowhere : station(first, patch.point[i]), pull, forces);
    second.applyForceToBodyPoint(state, at_centre_ ? nowhere : station(second, patch.point[i]), -pull, forces);
  }
  return change;
}

const std::vector<BodyContacts::Push>& BodyContacts::pushes(const State& state) const {
  return SimTK::Value<std::vector<Push>>::downcast(forces_.getCacheEntry(state, pushes_)).get();
}

}  // namespace train_derail::multibody
