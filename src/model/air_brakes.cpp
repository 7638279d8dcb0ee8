#include "model/air_brakes.hpp"

#include <algorithm>
#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "train_derail/model/brake_law.hpp"

namespace train_derail::model {

namespace {

/// By how much the crew of this seed is slower than the scenario's.
double crew_delay_factor(const inputs::Perturbation& p) {
  if (p.emergency_time == 0.0) return 1.0;
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(p.seed) ^ 0xc5e3ULL);
  return std::exp(p.emergency_time * boost::random::normal_distribution<double>()(generator));
}

}  // namespace

AirBrakes::AirBrakes(const inputs::Scenario& scenario, const std::vector<Car>& cars, const ExtendedKernels& loops)
    : law_(scenario.brakes), loops_(loops) {
  const auto n = static_cast<Eigen::Index>(cars.size());
  for (auto* a : {&ratio_, &pipe_}) *a = ArrayX::Zero(n);
  signal_ = ArrayX::Constant(n, inputs::kInfinity);
  share_ = ArrayX::Constant(n, scenario.ground.on_track_friction);
  Eigen::Index car = 0;
  double place = 0.0;
  for (const inputs::CarBlock& block : scenario.consist) {
    for (int i = 0; i < block.count; ++i, ++car) {
      source_.push_back(block.brake_source == inputs::BrakeSource::remote);
      ratio_[car] = brake_ratio(law_, block);
      pipe_[car] = place + 0.5 * block.length;
      place += block.length + scenario.coupler.length;
    }
  }
  if (law_.emergency_time) {
    vent(emergency_moment(law_, scenario.initial.speed) * crew_delay_factor(scenario.initial.perturbation), -1);
  }
}

void AirBrakes::prepare(double t) {
  if (law_.law != inputs::BrakeLaw::air || (known_ && (t < changes_from_ || found_at_ > changes_to_))) return;
  loops_.brake(share_.size(), law_, t, ratio_.data(), signal_.data(), share_.data());
  known_ = true;
  found_at_ = t;
}

double AirBrakes::full_share(Eigen::Index car) const {
  if (law_.law != inputs::BrakeLaw::air) return share_[car];
  return law_.rolling_resistance + (signal_[car] < inputs::kInfinity ? ratio_[car] : 0.0);
}

void AirBrakes::vent(double t, Eigen::Index coupler) {
  open(t, coupler < 0 ? 0.0 : 0.5 * (pipe_[coupler] + pipe_[coupler + 1]));
}

void AirBrakes::part(double t, Eigen::Index car) { open(t, pipe_[car]); }

void AirBrakes::open(double t, double place) {
  if (law_.law != inputs::BrakeLaw::air) return;
  const auto spread = [&](double at, double from) {
    for (Eigen::Index k = 0; k < signal_.size(); ++k)
      signal_[k] = std::min(signal_[k], at + brake_signal_delay(law_, pipe_[k] - from));
  };
  spread(t, place);
  for (Eigen::Index k = 0; k < pipe_.size(); ++k) {
    if (source_[static_cast<std::size_t>(k)]) spread(t + law_.radio_delay, pipe_[k]);
  }
  find_changes();
}

void AirBrakes::find_changes() {
  known_ = false;
  changes_from_ = inputs::kInfinity;
  changes_to_ = -inputs::kInfinity;
  for (const double signal : signal_) {
    if (!(signal < inputs::kInfinity)) continue;
    changes_from_ = std::min(changes_from_, signal + law_.dead_time);
    changes_to_ = std::max(changes_to_, signal + law_.dead_time + law_.build_up_time);
  }
}

void AirBrakes::walk(files::Archive& archive) {
  archive.column("signal", signal_);
  find_changes();
}

}  // namespace train_derail::model
