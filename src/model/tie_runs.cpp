#include "model/tie_runs.hpp"

#include <algorithm>

#include <boost/random/exponential_distribution.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_01.hpp>

#include "train_derail/inputs/extent.hpp"
#include "train_derail/model/tie_law.hpp"

namespace train_derail::model {

namespace {

using Generator = boost::random::mt19937_64;

Generator generator_of(const inputs::Scenario& s, std::uint64_t salt) {
  return Generator(static_cast<std::uint64_t>(s.initial.perturbation.seed) ^ salt);
}

}  // namespace

TieRuns::TieRuns(const inputs::Scenario& scenario, const std::vector<Car>& cars, Record& record)
    : law_(scenario.ties), cars_(static_cast<Eigen::Index>(cars.size())), record_(record), run_(2 * cars.size(), -1) {
  for (auto* a : {&endurance_, &parts_at_, &throw_speed_, &guided_, &drift_, &damping_, &met_})
    *a = ArrayX::Zero(2 * cars_);
  if (!on()) return;
  Generator generator = generator_of(scenario, 0x71e5ULL);
  boost::random::exponential_distribution<double> exponential;
  boost::random::uniform_01<double> uniform;
  for (Eigen::Index i = 0; i < 2 * cars_; ++i) {
    damping_[i] = tie_damping(law_, cars[static_cast<std::size_t>(i < cars_ ? i : i - cars_)].mass);
    endurance_[i] = exponential(generator);
    const double far = exponential(generator);
    parts_at_[i] = law_.parting_rate > 0.0 ? far / law_.parting_rate : inputs::kInfinity;
    throw_speed_[i] = (uniform(generator) < 0.5 ? -1.0 : 1.0) * scenario.obstacles.throw_speed;
  }
  place_obstacles(scenario);
}

void TieRuns::place_obstacles(const inputs::Scenario& scenario) {
  const inputs::Obstacles& o = scenario.obstacles;
  const auto add = [&](double at, double probability) { obstacles_.push_back({at, obstacle_hazard(probability)}); };
  for (const inputs::ObstaclePlace& place : o.places)
    add(place.at, place.throw_probability.value_or(o.throw_probability));
  if (scenario.initial.mechanism == inputs::Mechanism::turnout)
    add(scenario.initial.frog_distance, o.throw_probability);
  constexpr double kRateMax = 1.0;  // 1/m, as of obstacles.rate: a train that stands meets none
  const double rate = std::min(obstacle_rate(o, scenario.initial.speed), kRateMax);
  if (rate > 0.0) {
    Generator generator = generator_of(scenario, 0x0b57ac1eULL);
    boost::random::exponential_distribution<double> gap(rate);
    const double end = inputs::track_extent(scenario).to;
    for (double at = gap(generator); at < end; at += gap(generator)) add(at, o.throw_probability);
  }
  std::stable_sort(obstacles_.begin(), obstacles_.end(),
                   [](const Obstacle& a, const Obstacle& b) { return a.at < b.at; });
}

void TieRuns::begin(double t, Eigen::Index truck, double offset) {
  const auto i = static_cast<std::size_t>(truck);
  std::vector<TieRun>& runs = record_.incidents.tie_runs;
  run_[i] = static_cast<int>(runs.size());
  runs.push_back({truck < cars_ ? truck : truck - cars_, truck < cars_, t, 0.0, 0, 0.0, TieRun::End::none});
  running_.push_back(truck);
  guided_[truck] = 1.0;
  drift_[truck] = offset;
}

TieRuns::Met TieRuns::run(Eigen::Index truck, double from, double to) {
  Met met;
  TieRun& run = run_of(truck);
  const double before = run.distance;
  run.distance += std::abs(to - from);
  const auto after = [](double s, const Obstacle& o) { return s < o.at; };
  for (auto o = std::upper_bound(obstacles_.begin(), obstacles_.end(), from, after);
       o != obstacles_.end() && o->at <= to && !met.thrown; ++o) {
    ++run.obstacles;
    met_[truck] += o->hazard;
    if (met_[truck] <= endurance_[truck]) continue;
    met.thrown = true;
    met.share = (o->at - from) / (to - from);
    run.distance = before + met.share * (to - from);
  }
  met.parted = before < parts_at_[truck] && run.distance >= parts_at_[truck];
  return met;
}

bool TieRuns::drift(Eigen::Index truck, double offset, double load) {
  drift_[truck] = tie_drift(law_, offset, drift_[truck], load);
  return std::abs(drift_[truck]) > law_.drift_max;
}

void TieRuns::end(double t, Eigen::Index truck, TieRun::End by) {
  TieRun& run = run_of(truck);
  run.end = by;
  run.end_time = t;
  guided_[truck] = 0.0;
  running_.erase(std::find(running_.begin(), running_.end(), truck));
}

std::vector<double> TieRuns::obstacles() const {
  std::vector<double> places;
  for (const Obstacle& o : obstacles_) places.push_back(o.at);
  return places;
}

void TieRuns::walk(files::Archive& archive) {
  archive.column("drift", drift_);
  archive.column("met", met_);
  if (!archive.restoring()) return;
  running_.clear();
  guided_.setZero();
  std::fill(run_.begin(), run_.end(), -1);
  const std::vector<TieRun>& runs = record_.incidents.tie_runs;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Eigen::Index truck = runs[r].front ? runs[r].car : cars_ + runs[r].car;
    run_[static_cast<std::size_t>(truck)] = static_cast<int>(r);
    if (!on() || runs[r].end != TieRun::End::none) continue;
    running_.push_back(truck);
    guided_[truck] = 1.0;
  }
}

}  // namespace train_derail::model
