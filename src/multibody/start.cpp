#include "multibody/start.hpp"

#include <cmath>
#include <cstdint>
#include <random>

namespace train_derail::multibody {

Start drawn_start(const inputs::Scenario& scenario, const std::vector<model::Car>& train) {
  const inputs::Perturbation& jitter = scenario.initial.perturbation;
  std::seed_seq seeds{static_cast<std::uint32_t>(jitter.seed), static_cast<std::uint32_t>(jitter.seed >> 32),
                      0x51b0d1u};
  std::mt19937_64 engine(seeds);
  const auto normal = [&engine] {  // Box and Muller's method: the same with every standard library
    const auto uniform = [&engine] { return (static_cast<double>(engine() >> 11U) + 0.5) * 0x1.0p-53; };
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  };
  Start start;
  start.yaw_rate = scenario.initial.yaw_rate * (1.0 + jitter.yaw_rate * normal());
  double mid_slack = 0.0;
  for (std::size_t k = 0; k < train.size(); ++k) {
    if (k > 0) mid_slack -= 0.5 * (train[k - 1].length + train[k].length) + scenario.coupler.length;
    start.x.push_back(mid_slack - (k > 0 ? jitter.spacing * std::abs(normal()) : 0.0));
  }
  return start;
}

}  // namespace train_derail::multibody
