#include "multibody/spatial_events.hpp"

#include <algorithm>
#include <cmath>

namespace train_derail::multibody {

using SimTK::Stage;
using SimTK::State;

namespace {

double emergency_time(const inputs::Brakes& law, double speed) {
  if (!law.emergency_time) return inputs::kInfinity;
  constexpr double kDay = 86400.0;  // s; a train that stands is not infinitely late
  const double slower = std::pow(law.reference_speed / speed, law.emergency_speed_exponent);
  return *law.emergency_time == 0.0 ? 0.0 : std::min(*law.emergency_time * slower, kDay);
}

}  // namespace

BrakePipe::BrakePipe(const inputs::Scenario& s, const SimTK::GeneralForceSubsystem& forces, double crew_delay)
    : law_(s.brakes), forces_(forces), emergency_(crew_delay * emergency_time(s.brakes, s.initial.speed)) {
  double end = 0.0;
  for (const inputs::CarBlock& block : s.consist) {
    for (int i = 0; i < block.count; ++i) {
      const double heavier = block.loaded_weight ? *block.loaded_weight / block.weight : 1.0;
      full_.push_back(law_.force * block.brake_share * heavier);
      by_radio_.push_back(block.brake_source == inputs::BrakeSource::remote);
      place_.push_back(end + 0.5 * block.length);
      end += block.length + s.coupler.length;
    }
  }
}

void BrakePipe::realizeTopology(State& state) const {
  SimTK::Vector signals(static_cast<int>(full_.size()), inputs::kInfinity);
  if (emergency_ < inputs::kInfinity) open_at(signals, emergency_, 0.0);
  signals_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<SimTK::Vector>(signals));
}

void BrakePipe::open(State& state, std::size_t coupler) const {
  SimTK::Vector& signals = SimTK::Value<SimTK::Vector>::updDowncast(forces_.updDiscreteVariable(state, signals_)).upd();
  open_at(signals, state.getTime(), 0.5 * (place_[coupler] + place_[coupler + 1]));
}

void BrakePipe::open_at(SimTK::Vector& signals, double time, double place) const {
  const auto run = [&](double from, double when) {
    for (std::size_t k = 0; k < place_.size(); ++k) {
      const bool by_wire = law_.signal == inputs::BrakeSignal::electronic;
      const double arrives = when + (by_wire ? 0.0 : std::abs(place_[k] - from) / law_.propagation_speed);
      double& signal = signals[static_cast<int>(k)];
      signal = std::min(signal, arrives);
    }
  };
  run(place, time);
  for (std::size_t k = 0; k < place_.size(); ++k)
    if (by_radio_[k]) run(place_[k], time + law_.radio_delay);
}

double BrakePipe::share(const State& state, std::size_t car) const {
  const SimTK::Vector& signals =
      SimTK::Value<SimTK::Vector>::downcast(forces_.getDiscreteVariable(state, signals_)).get();
  const double since = state.getTime() - signals[static_cast<int>(car)] - law_.dead_time;
  if (since < 0.0) return law_.rolling_resistance;
  const double built = law_.build_up_time > 0.0 ? std::min(since / law_.build_up_time, 1.0) : 1.0;
  return law_.rolling_resistance + built * full_[car];
}

void TornTrack::realizeTopology(State& state) const {
  torn_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<Stretches>(Stretches()));
}

int TornTrack::stretch(double place) const { return static_cast<int>(std::floor(place / length_)); }

void TornTrack::tear(State& state, double place) const {
  if (length_ <= 0.0) return;
  SimTK::Value<Stretches>::updDowncast(forces_.updDiscreteVariable(state, torn_)).upd().push_back(stretch(place));
}

bool TornTrack::torn(const State& state, double place) const {
  if (length_ <= 0.0) return false;
  const Stretches& all = SimTK::Value<Stretches>::downcast(forces_.getDiscreteVariable(state, torn_)).get();
  return std::find(all.begin(), all.end(), stretch(place)) != all.end();
}

}  // namespace train_derail::multibody
