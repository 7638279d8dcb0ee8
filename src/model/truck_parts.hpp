/// \file
/// Force laws that act under every truck in every step, written for several trucks side by side. B is a double or a
/// batch of them (simd/batch.hpp). A part has
///   kWork    the term of the energy ledger that takes its work,
///   kKept    how many numbers a truck it keeps from the force to the work of a step,
///   pull()   its force on the trucks,
///   taken()  the power that this force takes from the train at the velocities given.
/// A new part goes into TruckParts below; the loops and the arrays follow that list.
#pragma once

#include <cstddef>
#include <type_traits>

#include "model/extended_kernels.hpp"
#include "model/kernels_impl.hpp"
#include "model/rail_frame.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/tie_law.hpp"

namespace train_derail::model {

/// A force in the world frame [N].
template <class B>
using Pull = Plan<B>;

/// Some trucks, as the parts see them.
template <class B, bool straight>
struct TruckView {
  using L = Lanes<B>;
  const ExtendedArrays& a;
  std::ptrdiff_t car, i;  ///< places in arrays of cars and of trucks
  B cosine, sine;         ///< of the cars' headings
  B u, v;                 ///< velocity, world frame [m/s]
  RailFrame<B, straight> rail;
  B along, across;  ///< the same along the rails and to their left

  /// `arm`: from the centres of the cars, forward [m]; (vx, vy, omega): motion of the cars.
  TruckView(const ExtendedArrays& arrays, std::ptrdiff_t k, std::ptrdiff_t truck, const B& c, const B& s, const B& vx,
            const B& vy, const B& omega, const B& rx, const B& ry)
      : a(arrays),
        car(k),
        i(truck),
        cosine(c),
        sine(s),
        u(vx - omega * ry),
        v(vy + omega * rx),
        rail(arrays.trucks, truck),
        along(rail.along(u, v)),
        across(rail.across(u, v)) {}

  B get(const double* column) const { return L::load(column + i); }
  auto on_track() const { return get(a.trucks.on_track) > B(0.5); }
  auto guided() const { return get(a.trucks.guided) > B(0.5); }
};

/// What a part keeps of some trucks.
template <class B, bool straight>
class Kept {
 public:
  /// `first`: the first column of the part.
  Kept(const TruckView<B, straight>& truck, std::ptrdiff_t first)
      : at_(truck.a.trucks.kept + first * 2 * truck.a.cars + truck.i), trucks_(2 * truck.a.cars) {}
  void put(std::ptrdiff_t k, const B& value) const { Lanes<B>::store(value, at_ + k * trucks_); }
  B get(std::ptrdiff_t k) const { return Lanes<B>::load(at_ + k * trucks_); }

 private:
  double* at_;
  std::ptrdiff_t trucks_;
};

/// A part that keeps its force does not act on any of some trucks.
template <class B, bool straight>
Pull<B> none(const Kept<B, straight>& kept) {
  kept.put(0, B(0.0));
  kept.put(1, B(0.0));
  return {B(0.0), B(0.0)};
}

/// Friction or brakes and rolling resistance along the track; across it too if the law is isotropic.
struct TrackResistance {
  static constexpr double EnergyLedger::*kWork = &EnergyLedger::work_on_track;
  static constexpr std::ptrdiff_t kKept = 2;
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    if (!any(t.on_track())) return none(kept);
    const bool isotropic = !t.a.rails_on && t.a.ground->on_track_law == inputs::OnTrackLaw::isotropic;
    const B load = Lanes<B>::load(t.a.brake_share + t.car) * t.get(t.a.trucks.load);
    const auto f = friction<B>(load, t.along, isotropic ? t.across : B(0.0), t.a.regularization_speed);
    const B along = select(t.on_track(), f.x, B(0.0)), across = select(t.on_track(), f.y, B(0.0));
    kept.put(0, along);
    kept.put(1, across);
    return t.rail.world(along, across);
  }
  template <class B, bool straight>
  static B taken(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    return -(kept.get(0) * t.along + kept.get(1) * t.across);
  }
};

/// Rails that yield hold the truck sideways.
struct RailHold {
  static constexpr double EnergyLedger::*kWork = &EnergyLedger::work_rails;
  static constexpr std::ptrdiff_t kKept = 1;
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    if (!t.a.rails_on) return {B(0.0), B(0.0)};
    const B held = rail_force<B>(*t.a.rails, t.get(t.a.trucks.rail_damping), t.get(t.a.trucks.offset), t.across);
    const B lateral = select(t.on_track(), held, B(0.0));
    kept.put(0, lateral);
    return t.rail.world(B(0.0), lateral);
  }
  template <class B, bool straight>
  static B taken(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    return t.a.rails_on ? B(-kept.get(0) * t.across) : B(0.0);
  }
};

/// Friction on the ground off the track.
struct GroundFriction {
  static constexpr double EnergyLedger::*kWork = &EnergyLedger::work_off_track;
  static constexpr std::ptrdiff_t kKept = 2;
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    if (!any(t.get(t.a.trucks.on_track) < B(0.5))) return none(kept);
    B mu(t.a.ground->off_track_friction);
    if (t.a.by_slip) {
      mu =
          slip_friction<B>(*t.a.ground, t.u * t.u + t.v * t.v, t.v * t.cosine - t.u * t.sine, t.get(t.a.trucks.offset));
    }
    B load = t.get(t.a.trucks.ground_load);
    if (t.a.ties != nullptr) load = select(t.guided(), B(0.0), load);
    const auto f = friction<B>(mu * t.get(t.a.trucks.patch) * load, t.u, t.v, t.a.regularization_speed);
    const Pull<B> pull{select(t.on_track(), B(0.0), f.x), select(t.on_track(), B(0.0), f.y)};
    kept.put(0, pull.x);
    kept.put(1, pull.y);
    return pull;
  }
  template <class B, bool straight>
  static B taken(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    return -(kept.get(0) * t.u + kept.get(1) * t.v);
  }
};

/// Drag of the ties along the track, and how they hold the truck sideways.
struct TieGuidance {
  static constexpr double EnergyLedger::*kWork = &EnergyLedger::work_ties;
  static constexpr std::ptrdiff_t kKept = 2;
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    if (t.a.ties == nullptr) return {B(0.0), B(0.0)};
    const B load = t.get(t.a.trucks.load), offset = t.get(t.a.trucks.offset) - t.get(t.a.trucks.drift);
    const auto drag = friction<B>(t.a.ties->drag * load, t.along, B(0.0), t.a.regularization_speed);
    const B held = tie_force<B>(*t.a.ties, t.get(t.a.trucks.tie_damping), offset, t.across, load);
    const B along = select(t.guided(), drag.x, B(0.0)), across = select(t.guided(), held, B(0.0));
    kept.put(0, along);
    kept.put(1, across);
    return t.rail.world(along, across);
  }
  template <class B, bool straight>
  static B taken(const TruckView<B, straight>& t, const Kept<B, straight>& kept) {
    return t.a.ties == nullptr ? B(0.0) : B(-(kept.get(0) * t.along + kept.get(1) * t.across));
  }
};

/// The part of the weight that acts along a grade.
struct Slope {
  static constexpr double EnergyLedger::*kWork = &EnergyLedger::work_grade;
  static constexpr std::ptrdiff_t kKept = 0;
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t, const Kept<B, straight>&) {
    return t.rail.world(-t.a.grade * t.get(t.a.trucks.load), B(0.0));
  }
  template <class B, bool straight>
  static B taken(const TruckView<B, straight>& t, const Kept<B, straight>&) {
    return t.a.grade * t.get(t.a.trucks.load) * t.along;
  }
};

/// Calls part by part.
template <class... Parts>
struct PartList {
  static constexpr std::size_t count = sizeof...(Parts);
  /// Columns that all of them keep, and the first of `Part`.
  static constexpr std::ptrdiff_t kept = (Parts::kKept + ...);
  template <class Part>
  static constexpr std::ptrdiff_t first() {
    std::ptrdiff_t column = 0;
    bool found = false;
    ((found = found || std::is_same_v<Part, Parts>, column += found ? 0 : Parts::kKept), ...);
    return column;
  }
  /// Sum of the forces.
  template <class B, bool straight>
  static Pull<B> pull(const TruckView<B, straight>& t) {
    Pull<B> sum{B(0.0), B(0.0)};
    const auto add = [&sum](const Pull<B>& f) {
      sum.x = sum.x + f.x;
      sum.y = sum.y + f.y;
    };
    (add(Parts::template pull<B, straight>(t, {t, first<Parts>()})), ...);
    return sum;
  }
  /// Adds `share` of the power that each part takes to the sum of its own.
  template <class B, bool straight>
  static void add_taken(const TruckView<B, straight>& t, const B& share, B (&sums)[count]) {
    std::size_t part = 0;
    ((sums[part] = sums[part] + share * Parts::template taken<B, straight>(t, {t, first<Parts>()}), ++part), ...);
  }
  /// Puts h times the sums into the ledger.
  template <class B>
  static void account(double h, const B (&sums)[count], EnergyLedger& spent) {
    std::size_t part = 0;
    ((spent.*Parts::kWork += h * Lanes<B>::sum(sums[part++])), ...);
  }
};

using TruckParts = PartList<TrackResistance, RailHold, GroundFriction, TieGuidance, Slope>;

}  // namespace train_derail::model
