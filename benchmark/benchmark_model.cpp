// Cost of the right-hand side, of a step of the integrator, of monitoring and of whole runs, over the length of the
// train; of whole runs side by side on several threads as well.
#include <benchmark/benchmark.h>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/derailment_model.hpp"
#include "train_derail/outcome/monitor.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace {

using namespace train_derail;

inputs::Scenario scenario(std::int64_t cars) {
  inputs::Scenario s = inputs::read_scenario_file(TRAIN_DERAIL_SOURCE_DIR "/config/baseline.yaml");
  s.consist.at(0).count = static_cast<int>(cars);
  return s;
}

/// In the middle of the pile-up: some couplers loaded, some swung beyond their limit.
model::StateVector pile_up(const inputs::Scenario& s) {
  simulation::Simulation simulation(s);
  simulation.advance(4.0);
  return simulation.state();
}

void right_hand_side(benchmark::State& state, const std::string& instruction_set) {
  const inputs::Scenario s = scenario(state.range(0));
  const model::DerailmentModel m(s, instruction_set);
  const model::StateVector y = pile_up(s);
  model::StateVector rate(y.size());
  for (auto _ : state) {
    m.derivative(y.data(), rate.data());
    benchmark::DoNotOptimize(rate.data());
    benchmark::ClobberMemory();
  }
  state.counters["per car"] = benchmark::Counter(
      static_cast<double>(state.range(0)), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void gaps(benchmark::State& state) {
  const inputs::Scenario s = scenario(state.range(0));
  const model::DerailmentModel m(s);
  const model::StateVector y = pile_up(s);
  Eigen::ArrayXd gap, rate;
  for (auto _ : state) {
    m.gaps(y.data(), gap, rate);
    benchmark::DoNotOptimize(gap.data());
    benchmark::ClobberMemory();
  }
}

void monitor_sample(benchmark::State& state) {
  const inputs::Scenario s = scenario(state.range(0));
  const model::DerailmentModel m(s);
  const model::StateVector y = pile_up(s);
  outcome::Monitor monitor(m, s.outcome, 0.0, y);
  double t = 0.0;
  for (auto _ : state) monitor.sample(t += 0.01, y.data());
}

void monitor_step(benchmark::State& state) {
  const inputs::Scenario s = scenario(state.range(0));
  const model::DerailmentModel m(s);
  const model::StateVector y = pile_up(s);
  outcome::Monitor monitor(m, s.outcome, 0.0, y);
  double t = 0.0;
  for (auto _ : state) monitor.step(t += 0.001, y.data());
}

/// All that a step takes, in the middle of the pile-up.
void step(benchmark::State& state) {
  simulation::Simulation simulation(scenario(state.range(0)));
  simulation.advance(4.0);
  const std::int64_t before = simulation.outcome().solver.steps;
  for (auto _ : state) simulation.advance(simulation.time() + 0.001);
  state.counters["per step"] = benchmark::Counter(static_cast<double>(simulation.outcome().solver.steps - before),
                                                  benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void whole_run(benchmark::State& state) {
  const inputs::Scenario s = scenario(state.range(0));
  double steps = 0.0;
  for (auto _ : state) {
    simulation::Simulation simulation(s);
    simulation.run();
    steps += static_cast<double>(simulation.outcome().solver.steps);
  }
  state.counters["per car and step"] = benchmark::Counter(steps * static_cast<double>(state.range(0)),
                                                          benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

}  // namespace

BENCHMARK(gaps)->Arg(60)->Arg(1000);
BENCHMARK(monitor_sample)->Arg(60)->Arg(1000);
BENCHMARK(monitor_step)->Arg(60)->Arg(1000);
BENCHMARK(step)->Arg(60)->Arg(1000)->Iterations(3000);
BENCHMARK(whole_run)->Arg(10)->Arg(60)->Arg(100)->Arg(300)->Arg(1000)->ThreadRange(1, 2)->UseRealTime()->Unit(
    benchmark::kMillisecond);

int main(int argc, char** argv) {
  for (const std::string& name : model::DerailmentModel::instruction_sets(60)) {
    benchmark::RegisterBenchmark(("right_hand_side/" + name).c_str(), right_hand_side, name)->Arg(60)->Arg(1000);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
