// A run with extreme values that the reader lets pass: it ends, says why if it failed, and what it gives are numbers.
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/simulation.hpp"

using namespace train_derail;

namespace {

inputs::Scenario shortened(const char* path) {
  inputs::Scenario s = inputs::read_scenario_file(path);
  for (auto& block : s.consist) block.count = std::min(block.count, 3);
  s.stop.time_max = 20.0;
  return s;
}

std::string value_for(fuzz::Decisions& d, const std::string& now) {
  static const std::array<const char*, 22> kWords{"true",
                                                  "false",
                                                  "none",
                                                  "semi_implicit",
                                                  "bdf",
                                                  "cash_karp",
                                                  "dormand_prince",
                                                  "rails",
                                                  "guided",
                                                  "isotropic",
                                                  "along_track",
                                                  "by_slip",
                                                  "air",
                                                  "inf",
                                                  "1e300",
                                                  "1e-300",
                                                  "-1e300",
                                                  "5e-324",
                                                  "1.7976931348623157e308",
                                                  "-0.0",
                                                  "0",
                                                  "9007199254740991"};
  switch (d.byte() % 4) {
    case 0: return kWords[d.below(kWords.size())];
    case 1: {  // what it is, by powers of ten
      double value = 0.0;
      try {
        value = std::stod(now);
      } catch (const std::exception&) {
        return now;
      }
      return fmt::format("{}", value * std::pow(10.0, static_cast<double>(d.below(25)) - 12.0));
    }
    case 2: return fmt::format("{}", static_cast<int>(d.below(2000)) - 500);
    default: {
      const double mantissa = static_cast<double>(d.byte() + 1) / 25.6;
      return fmt::format(
          "{}", (d.byte() % 8 == 0 ? -mantissa : mantissa) * std::pow(10.0, static_cast<double>(d.below(41)) - 20.0));
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::array<inputs::Scenario, 3> kBases{shortened(FUZZ_SOURCE_DIR "/../../config/baseline.yaml"),
                                                      shortened(FUZZ_SOURCE_DIR "/../../config/accident.yaml"),
                                                      shortened(FUZZ_SOURCE_DIR "/../../config/mixed_train.yaml")};
  fuzz::Decisions d(data, size);
  inputs::Scenario scenario = kBases[d.byte() % kBases.size()];
  for (int changes = 0; d.more() && changes < 12; ++changes) {
    const std::vector<inputs::KeyValue> keys = inputs::key_values(scenario);
    const inputs::KeyValue& k = keys[d.below(keys.size())];
    fuzz::may_refuse<inputs::InputError>([&] {
      scenario = inputs::with_values(scenario, {{k.key, value_for(d, k.value)}});
    });
  }
  // So long that libFuzzer would be done with nothing else, but nothing that would hide an endless loop.
  int cars = 0;
  for (const auto& block : scenario.consist) cars += block.count;
  if (cars > 60) return 0;
  scenario.solver.steps_max = std::min<decltype(scenario.solver.steps_max)>(scenario.solver.steps_max, 5000);
  fuzz::may_refuse<inputs::InputError>([&] {
    const std::string file = inputs::to_yaml(scenario);
    simulation::Simulation simulation(scenario);
    simulation.run();
    const outcome::Outcome o = simulation.outcome();
    fuzz::expect(o.ended != outcome::Ended::running, "not ended:\n" + file);
    if (o.ended == outcome::Ended::integration_failed) fuzz::expect_readable(o.message);
    for (const std::string& w : o.warnings) fuzz::expect_readable(w);
    for (const auto& q : outcome::quantities())
      fuzz::expect(std::isfinite(q.value(o)), fmt::format("{} is {}:\n{}", q.name, q.value(o), file));
    if (o.ended != outcome::Ended::integration_failed && o.warnings.empty())
      fuzz::expect(o.energy_residual < 0.1,
                   fmt::format("an energy residual of {} without a word:\n{}", o.energy_residual, file));
    outcome::to_json(o);
    outcome::to_table(o);
  });
  return 0;
}
