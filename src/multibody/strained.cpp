#include "multibody/strained.hpp"

namespace train_derail::multibody {

using Rates = SimTK::Value<SimTK::Vector>;

void Strained::allocate(SimTK::State& state, int strains, int others) const {
  const SimTK::Vector none(strains + others, 0.0);
  strains_ = strains;
  first_ = forces_.allocateZ(state, none);
  rates_ = forces_.allocateCacheEntry(state, SimTK::Stage::Dynamics, new Rates(none));
}

void Strained::set_weights(SimTK::State& state) const {
  SimTK::Vector& weights = state.updZWeights(forces_.getMySubsystemIndex());
  for (int i = 0; i < strains_; ++i) weights[first_ + i] = 0.01;
}

SimTK::Real* Strained::rates(const SimTK::State& state) const {
  return &Rates::updDowncast(forces_.updCacheEntry(state, rates_)).upd()[0];
}

void Strained::realizeAcceleration(const SimTK::State& state) const {
  const SimTK::Vector& rates = Rates::downcast(forces_.getCacheEntry(state, rates_)).get();
  forces_.updZDot(state)(first_, rates.size()) = rates;
}

}  // namespace train_derail::multibody
