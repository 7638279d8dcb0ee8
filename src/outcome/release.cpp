#include "train_derail/outcome/release.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_01.hpp>

namespace train_derail::outcome {

namespace {

/// Of every car; infinite: nothing to release.
std::vector<double> strengths(const std::vector<inputs::CarBlock>& consist) {
  std::vector<double> all;
  for (const inputs::CarBlock& b : consist) {
    const double named = b.name == "tank_car" ? 1.0 : inputs::kInfinity;
    all.insert(all.end(), static_cast<std::size_t>(b.count), b.tank_strength.value_or(named));
  }
  return all;
}

}  // namespace

double release_probability(const inputs::Release& law, double strength, double speed, model::Face face) {
  if (std::isinf(strength)) return 0.0;
  const bool end = face == model::Face::front || face == model::Face::rear;
  const double excess = speed / strength - law.threshold_speed, scale = end ? law.end_speed : law.side_speed;
  return excess > 0.0 ? -std::expm1(-excess / scale) : 0.0;
}

Released released(const inputs::Scenario& scenario, const model::Incidents& incidents) {
  Released sum;
  // Bodies that pass through each other are no tanks.
  if (scenario.contact.law == inputs::ContactLaw::none || incidents.derailments.empty()) return sum;
  const std::vector<double> strength = strengths(scenario.consist);
  std::vector<double> tight(strength.size(), 1.0);  // probability to release nothing
  for (const model::Derailment& d : incidents.derailments) {
    const auto k = static_cast<std::size_t>(d.car);
    if (!std::isinf(strength[k])) tight[k] = 1.0 - scenario.release.fittings;
  }
  for (const model::Impact& i : incidents.impacts) {
    const auto hit = [&](Eigen::Index car, model::Face face) {
      const auto k = static_cast<std::size_t>(car);
      tight[k] *= 1.0 - release_probability(scenario.release, strength[k], i.closing_speed_normal, face);
    };
    hit(i.car_a, i.face_a);
    hit(i.car_b, i.face_b);
  }
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(scenario.initial.perturbation.seed) ^ 0x5e1ea5eULL);
  boost::random::uniform_01<double> uniform;
  for (const double holds : tight) {
    const double chance = uniform(generator);
    sum.expected += 1.0 - holds;
    sum.cars += chance < 1.0 - holds ? 1 : 0;
  }
  return sum;
}

}  // namespace train_derail::outcome
