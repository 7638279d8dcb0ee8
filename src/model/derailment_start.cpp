#include "model/derailment_start.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_01.hpp>

namespace train_derail::model {

using inputs::Mechanism;

namespace {

/// Trucks come to the place one after the other: front and rear one of each car, from the first car on. Where the one
/// before has left the rails the chance is `persistence`: a chain of Markov. The first truck of the run has.
template <class Uniform, class Generator>
void persist(const inputs::Scenario& s, Uniform& uniform, Generator& generator, std::vector<double>& places) {
  const auto cars = static_cast<int>(places.size() / 2);
  bool left = true;
  double at = 0.0;
  for (int i = 2 * s.initial.cars_ahead + (starts_with_front(s) ? 1 : 2); i < 2 * cars; ++i) {
    double& place = places[static_cast<std::size_t>(i % 2 == 0 ? i / 2 : cars + i / 2)];
    const double chance = uniform(generator);
    if (left) place = chance < *s.initial.persistence ? at : inputs::kInfinity;
    left = place < inputs::kInfinity;
    if (left) at = place;
  }
}

}  // namespace

bool starts_with_front(const inputs::Scenario& s) {
  if (s.initial.mechanism == inputs::Mechanism::broken_rail) return true;  // it comes to the broken rail first
  switch (s.initial.truck) {
    case inputs::FirstTruck::front: return true;
    case inputs::FirstTruck::rear: return false;
    case inputs::FirstTruck::either: break;
  }
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(s.initial.perturbation.seed) ^ 0xf1257ULL);
  return boost::random::uniform_01<double>()(generator) < 0.5;
}

bool starts_on_ties(const inputs::Scenario& s) {
  const Mechanism m = s.initial.mechanism;
  return s.ties.law == inputs::TieLaw::guided && m != Mechanism::broken_rail && m != Mechanism::train_forces;
}

Cause cause_of(Mechanism mechanism) {
  switch (mechanism) {
    case Mechanism::broken_rail: return Cause::pod;
    case Mechanism::bad_track:
    case Mechanism::turnout: return Cause::bad_track;
    case Mechanism::dragging_truck: return Cause::defect;
    case Mechanism::train_forces: return Cause::lateral;
  }
  return Cause::none;
}

std::vector<double> bad_places(const inputs::Scenario& s, std::size_t cars) {
  const inputs::InitialMotion& start = s.initial;
  if (start.mechanism == Mechanism::broken_rail) return std::vector<double>(2 * cars, 0.0);
  std::vector<double> places(2 * cars, inputs::kInfinity);
  const bool by_chance = start.mechanism == Mechanism::bad_track || start.mechanism == Mechanism::turnout;
  if (!by_chance) return places;
  const double length = start.mechanism == Mechanism::bad_track ? start.bad_track_length : 0.0;
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(start.perturbation.seed) ^ 0xbad7ac4ULL);
  boost::random::uniform_01<double> uniform;
  for (double& place : places) {
    const double chance = uniform(generator), share = uniform(generator);
    if (chance < start.truck_probability) place = share * length;
  }
  if (start.persistence) persist(s, uniform, generator, places);
  return places;
}

}  // namespace train_derail::model
