// Under a locale that writes 1,5 for 1.5, as RViz runs in, inputs and outputs stay the same.
#include <clocale>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "fixtures.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

/// German, generated for this test alone and in force while it lives, in C and in C++.
class German {
 public:
  German() : folder_(fs::temp_directory_path() / ("train_derail_locale_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
    const std::string command = "localedef -i de_DE -f UTF-8 '" + (folder_ / "de_DE.UTF-8").string() + "' 2>&1";
    made_ = std::system(command.c_str()) == 0;
    ::setenv("LOCPATH", folder_.c_str(), 1);
    in_force_ = std::setlocale(LC_ALL, "de_DE.UTF-8") != nullptr;
    if (in_force_) before_ = std::locale::global(std::locale("de_DE.UTF-8"));
  }
  ~German() {
    std::locale::global(before_);
    std::setlocale(LC_ALL, "C");
    ::unsetenv("LOCPATH");
    fs::remove_all(folder_);
  }
  bool in_force() const { return made_ && in_force_; }

 private:
  const fs::path folder_;
  std::locale before_;
  bool made_ = false, in_force_ = false;
};

std::string everything() {
  const auto scenario = inputs::read_scenario_file(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/baseline.yaml",
                                                   {{"consist[0].count", "3"},
                                                    {"stop.time_max", "0.5"},
                                                    {"initial.speed", "12.5 knots"},
                                                    {"coupler.stiffness", "1.5e6 kgf/m"},
                                                    {"initial.perturbation.spacing", "1.5 mm"}});
  std::ostringstream out;
  out << inputs::to_yaml(scenario) << inputs::describe_keys();
  for (const auto& v : inputs::key_values(scenario)) out << v.key << v.value << "\n";
  simulation::Simulation simulation(scenario);
  simulation::write_csv_header(out);
  simulation.advance(0.1);
  simulation::write_csv_rows(out, simulation.snapshot());
  simulation.run();
  auto outcome = simulation.outcome();
  outcome.wall_time = 0.0;
  out << outcome::to_json(outcome) << outcome::to_table(outcome);
  return out.str();
}

// The database of units is read within this test for the first time.
TEST(Locale, ADecimalCommaChangesNothing) {
  std::string german;
  {
    const German locale;
    ASSERT_TRUE(locale.in_force()) << "localedef (package locales) is needed";
    ASSERT_EQ(std::string(std::localeconv()->decimal_point), ",");
    std::ostringstream comma;
    comma << 1234.5;
    ASSERT_EQ(comma.str(), "1.234,5");
    for (const auto& [text, unit, value] :
         {std::tuple{"37.5 mph", "m/s", 37.5 * inputs::kMph},
          {"50 knots", "m/s", 25.7222222222222},
          {"130000 kgf", "N", 1274864.5},
          {"4.25 deg/(100.5 ft)", "1/m", 4.25 * inputs::kDegree / (100.5 * inputs::kFoot)},
          {"7.5 nautical_mile", "m", 13890.0}}) {
      EXPECT_NEAR(inputs::to_si(text, unit), value, 1e-12 * value) << text;
    }
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([] {
        for (int k = 0; k < 50; ++k) EXPECT_NEAR(inputs::to_si("7.5 nautical_mile", "m"), 13890.0, 1e-9);
      });
    for (auto& t : threads) t.join();
    EXPECT_EQ(std::string(std::localeconv()->decimal_point), ",") << "the caller's locale is left as it was";
    german = everything();
  }
  EXPECT_EQ(german, everything());
}

}  // namespace
}  // namespace train_derail

// setlocale() of the C library keeps what it has read of LOCPATH.
extern "C" const char* __lsan_default_suppressions() { return "leak:argz_add_sep"; }
