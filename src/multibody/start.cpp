#include "multibody/start.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace train_derail::multibody {

namespace {

std::mt19937_64 generator(std::int64_t seed, std::int64_t purpose) {
  std::seed_seq seeds{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(purpose)};
  return std::mt19937_64(seeds);
}

/// A normal random number by Box and Muller's method: the same with every standard library.
double normal(std::mt19937_64& engine) {
  const auto uniform = [&engine] { return (static_cast<double>(engine() >> 11U) + 0.5) * 0x1.0p-53; };
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(6.283185307179586 * uniform());
}

}  // namespace

Start drawn_start(const inputs::Scenario& scenario, const std::vector<model::Car>& train) {
  const inputs::Perturbation& jitter = scenario.initial.perturbation;
  std::mt19937_64 engine = generator(jitter.seed, 0x51b0d1);
  Start start;
  start.yaw_rate = scenario.initial.yaw_rate * (1.0 + jitter.yaw_rate * normal(engine));
  double mid_slack = 0.0;
  for (std::size_t k = 0; k < train.size(); ++k) {
    if (k > 0) mid_slack -= 0.5 * (train[k - 1].length + train[k].length) + scenario.coupler.length;
    start.x.push_back(mid_slack - (k > 0 ? jitter.spacing * std::abs(normal(engine)) : 0.0));
  }
  const double first = start.x[static_cast<std::size_t>(scenario.initial.cars_ahead)];
  for (double& x : start.x) x -= first;
  start.crew_delay = std::exp(jitter.emergency_time * normal(engine));
  for (std::size_t truck = 0; truck < 2 * train.size(); ++truck) start.kicks.push_back(jitter.kick * normal(engine));
  return start;
}

constexpr double kApart = 20.0 * inputs::kFoot;  // of independent deviations

Alignment::Alignment(const inputs::Perturbation& p, double from, double to) : from_(from) {
  if (p.alignment == 0.0) return;
  std::mt19937_64 engine = generator(p.seed, 0xa119);
  for (double place = from; place < to + kApart; place += kApart) deviations_.push_back(p.alignment * normal(engine));
}

double Alignment::at(double place) const {
  if (deviations_.empty()) return 0.0;
  const double last = static_cast<double>(deviations_.size() - 1);
  const double number = std::min(std::max((place - from_) / kApart, 0.0), last), before = std::floor(number);
  const auto knot = static_cast<std::size_t>(before);
  if (knot + 1 == deviations_.size()) return deviations_.back();
  const double share = 0.5 - 0.5 * std::cos(3.141592653589793 * (number - before));
  return deviations_[knot] + share * (deviations_[knot + 1] - deviations_[knot]);
}

}  // namespace train_derail::multibody
