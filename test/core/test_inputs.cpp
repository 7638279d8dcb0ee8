// Reading and checking scenarios: units, defaults, overrides, and one file per mistake.
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <string>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

const fs::path kSource = TRAIN_DERAIL_SOURCE_DIR;
const std::string kBaseline = (kSource / "config/baseline.yaml").string();

std::string message_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const inputs::InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Units, ConvertExactly) {
  EXPECT_DOUBLE_EQ(inputs::to_si("37 mph", "m/s"), 37.0 * 0.44704);
  EXPECT_DOUBLE_EQ(inputs::to_si("150 kip", "N"), 150e3 * 4.4482216152605);
  EXPECT_DOUBLE_EQ(inputs::to_si("0.25 ft", "m"), 0.0762);
  EXPECT_DOUBLE_EQ(inputs::to_si("50e6 lbf/ft", "N/m"), 50e6 * 4.4482216152605 / 0.3048);
  EXPECT_DOUBLE_EQ(inputs::to_si("180 deg", "rad"), test::kPi);
  EXPECT_DOUBLE_EQ(inputs::to_si("30 deg/s", "rad/s"), test::kPi / 6.0);
  EXPECT_DOUBLE_EQ(inputs::to_si("3.0e4 lbf ft/rad", "N m/rad"), 3e4 * 4.4482216152605 * 0.3048);
  EXPECT_DOUBLE_EQ(inputs::to_si("72 km/h", "m/s"), 20.0);
  EXPECT_DOUBLE_EQ(inputs::to_si("15 %", "1"), 0.15);
  EXPECT_DOUBLE_EQ(inputs::to_si("75 tonf", "N"), 150e3 * 4.4482216152605);
  EXPECT_DOUBLE_EQ(inputs::to_si("1e-6", "m"), 1e-6);
  EXPECT_DOUBLE_EQ(inputs::to_si(" +1.0e8 ", "N/m"), 1e8);
  EXPECT_DOUBLE_EQ(inputs::to_si("2 1/s", "rad/s"), 2.0);
  EXPECT_DOUBLE_EQ(inputs::from_si(16.54048, "m/s", "mph"), 37.0);
}

// In parentheses they are looked up in the database of UDUNITS.
TEST(Units, CommonOnesAreThoseOfTheDatabase) {
  const std::pair<const char*, const char*> units[] = {
      {"ft", "m"},       {"ft/s", "m/s"},           {"mph", "m/s"}, {"kip", "N"}, {"lbf/ft", "N/m"},
      {"lbf ft", "N m"}, {"lbf ft/rad", "N m/rad"}, {"deg", "rad"}, {"m", "m"},   {"m/s", "m/s"},
      {"s", "s"},        {"rad/s", "rad/s"}};
  for (const auto& [unit, si] : units) {
    const std::string looked_up = "(" + std::string(unit) + ")";
    EXPECT_DOUBLE_EQ(inputs::to_si("3.7 " + std::string(unit), si), inputs::to_si("3.7 " + looked_up, si)) << unit;
    EXPECT_DOUBLE_EQ(inputs::from_si(3.7, si, unit), inputs::from_si(3.7, si, looked_up)) << unit;
  }
}

TEST(Units, RefuseWhatIsNotAQuantity) {
  for (const char* text : {"", " ", "fast", "1,5", "0.15.2", "3 4", "37 mphs", "1e999", "--1", "0x10", "37 mph;"}) {
    EXPECT_THROW(inputs::to_si(text, "m/s"), std::invalid_argument) << text;
  }
}

TEST(Inputs, BaselineIsTableOneOfThePaper) {
  const inputs::Scenario s = inputs::read_scenario_file(kBaseline);
  ASSERT_EQ(s.consist.size(), 1u);
  EXPECT_EQ(s.consist[0].count, 60);
  EXPECT_DOUBLE_EQ(s.consist[0].weight, 150e3 * 4.4482216152605);
  EXPECT_DOUBLE_EQ(s.initial.speed, 37.0 * 0.44704);
  EXPECT_DOUBLE_EQ(s.initial.yaw_rate, 0.2);
  EXPECT_DOUBLE_EQ(s.ground.on_track_friction, 0.15);
  EXPECT_DOUBLE_EQ(s.ground.off_track_friction, 0.50);
  EXPECT_DOUBLE_EQ(s.coupler.length, 4.0 * 0.3048);
  EXPECT_DOUBLE_EQ(s.coupler.slack, 0.25 * 0.3048);
  EXPECT_DOUBLE_EQ(s.coupler.stiffness, 50e6 * 4.4482216152605 / 0.3048);
  EXPECT_DOUBLE_EQ(s.coupler.swing_limit, 17.5 * test::kPi / 180.0);
}

// The documented file and the defaults in the code may not drift apart.
TEST(Inputs, BaselineSpellsOutEveryDefault) {
  const inputs::Scenario s = inputs::read_scenario_file(kBaseline);
  inputs::Scenario bare = s;
  bare.coupler = {};
  bare.ground = {};
  bare.stop = {};
  bare.outcome = {};
  bare.output = {};
  bare.solver = {};
  for (auto& block : bare.consist) block.truck_spacing_factor = block.yaw_inertia_factor = std::nullopt;
  // The last digits differ with the order of conversion.
  const std::regex last_digits("(\\.[0-9]{4})[0-9]+");
  const auto rounded = [&](const inputs::Scenario& x) {
    return std::regex_replace(inputs::to_yaml(x), last_digits, "$1");
  };
  EXPECT_EQ(rounded(bare), rounded(s));
}

TEST(Inputs, ShippedFilesShowEveryKey) {
  std::string text;  // the paper's keys stand in the first, those of the parts beyond it in the others
  for (const std::string& path :
       {std::string(kBaseline), std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/accident.yaml",
        std::string(TRAIN_DERAIL_SOURCE_DIR) + "/docs/accident_model.md",
        std::string(TRAIN_DERAIL_SOURCE_DIR) + "/docs/running_on_ties.md",
        std::string(TRAIN_DERAIL_SOURCE_DIR) + "/docs/spatial_model.md"}) {
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    text.append((std::istreambuf_iterator<char>(file)), {});
  }
  std::istringstream keys(inputs::describe_keys());
  int count = 0;
  for (std::string line; std::getline(keys, line);) {
    if (line.empty() || line[0] == ' ') continue;
    const std::string name = line.substr(line.find_last_of('.') + 1);
    EXPECT_NE(text.find(name), std::string::npos) << line << " is shown nowhere";
    ++count;
  }
  EXPECT_GT(count, 30);
}

TEST(Inputs, EveryScenarioIsValidAndSaysWhereItsNumbersComeFrom) {
  int count = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "config")) {
    if (entry.path().extension() != ".yaml") continue;
    EXPECT_NO_THROW(inputs::read_scenario_file(entry.path().string())) << entry.path();
    std::ifstream file(entry.path());
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    EXPECT_NE(text.find("\"assumed\""), std::string::npos) << entry.path() << " does not say what is assumed";
    ++count;
  }
  EXPECT_GE(count, 2);
}

TEST(Inputs, MixedTrainHasAHundredCarsOfEveryBody) {
  std::map<std::string, int> cars;
  int all = 0;
  for (const auto& block : inputs::read_scenario_file((kSource / "config/mixed_train.yaml").string()).consist) {
    cars[block.name] += block.count;
    all += block.count;
  }
  EXPECT_EQ(all, 100);
  for (const char* body : {"tank_car", "hopper", "boxcar", "locomotive"}) EXPECT_GT(cars[body], 0) << body;
}

TEST(Inputs, WrittenScenarioReadsBackTheSame) {
  inputs::Scenario s = test::mixed_train();
  s.title = "quotes \" # and: colons\n";
  s.consist[0].yaw_inertia = 1.23456789012345e6;
  s.consist[0].yaw_inertia_factor.reset();
  s.consist[1].truck_spacing = 9.1 + 0.2;
  s.consist[1].truck_spacing_factor.reset();
  s.coupler.swing_moment_max = inputs::kInfinity;
  s.ground.on_track_law = inputs::OnTrackLaw::along_track;
  s.solver.method = inputs::Method::cash_karp;
  s.solver.fixed_step = 1e-3 / 3.0;
  s.initial.perturbation = {0.001, 0.1, 123456789};
  const std::string once = inputs::to_yaml(s);
  const inputs::Scenario again = inputs::read_scenario(YAML::Load(once), "again");
  EXPECT_EQ(inputs::to_yaml(again), once);
  EXPECT_EQ(again.title, s.title);
  EXPECT_EQ(again.consist[1].truck_spacing, s.consist[1].truck_spacing);
  EXPECT_EQ(again.solver.fixed_step, s.solver.fixed_step);
  EXPECT_EQ(again.coupler.stiffness, s.coupler.stiffness);
}

TEST(Inputs, OverridesChangeTheirKeyAlone) {
  const auto s = inputs::read_scenario_file(
      kBaseline, {{"initial.speed", "50 mph"}, {"consist[0].count", "7"}, {"solver.fixed_step", "1 ms"}});
  EXPECT_DOUBLE_EQ(s.initial.speed, 50.0 * 0.44704);
  EXPECT_EQ(s.consist[0].count, 7);
  ASSERT_TRUE(s.solver.fixed_step.has_value());
  EXPECT_DOUBLE_EQ(*s.solver.fixed_step, 1e-3);
  EXPECT_DOUBLE_EQ(s.initial.yaw_rate, 0.2);
  const auto whole_group = inputs::read_scenario_file(kBaseline, {{"stop", "{time_max: 3 s}"}});
  EXPECT_DOUBLE_EQ(whole_group.stop.time_max, 3.0);
}

TEST(Inputs, OverridesAreCheckedLikeTheFile) {
  const auto error = [](const char* text) {
    return message_of([&] { inputs::read_scenario_file(kBaseline, {inputs::parse_override(text)}); });
  };
  EXPECT_EQ(error("initial.speed=-1 mph"), "override: initial.speed = '-1 mph': out of range; allowed: [0, 200] m/s");
  EXPECT_EQ(error("initial.sped=1 mph").substr(0, 46), "override: initial.sped = '1 mph': unknown key;");
  // A group that only the override names is no mistake of the file.
  EXPECT_EQ(error("intial.speed=40 mph").substr(0, 73),
            "override: intial.speed = '40 mph': unknown key 'intial'; allowed: brakes,");
  EXPECT_EQ(error("initial.perturbtion.spacing=1 cm").substr(0, 87),
            "override: initial.perturbtion.spacing = '1 cm': unknown key 'initial.perturbtion'; allo");
  EXPECT_EQ(error("consist[3].count=5"), "override: consist[3].count = '5': there is no item [3]; allowed: [0] to [0]");
  EXPECT_EQ(error("initial.speed.x=5"), "override: initial.speed.x = '5': 'x' is not inside a group");
  EXPECT_EQ(error("title.[0]=5").substr(0, 48), "override: title.[0] = '5': not a valid key; allo");
  EXPECT_EQ(error("initial.speed=[1"), "override: initial.speed = '[1': not YAML: end of sequence flow not found");
  EXPECT_EQ(error("=5").substr(0, 43), "override: '=5': not of the form key=value; ");
  EXPECT_EQ(error("initial.speed").substr(0, 52), "override: 'initial.speed': not of the form key=value");
}

TEST(Inputs, AScenarioMadeInCodeIsChecked) {
  inputs::Scenario s = test::baseline();
  s.initial.speed = std::nan("");
  EXPECT_EQ(message_of([&] { simulation::Simulation sim(s); }),
            "scenario: initial.speed = 'nan': not a finite number; allowed: [0, 200] m/s");
}

TEST(Inputs, UnreadableFileIsNamed) {
  EXPECT_EQ(message_of([] { inputs::read_scenario_file("no/such/file.yaml"); }),
            "no/such/file.yaml: cannot be read: No such file or directory");
  EXPECT_EQ(message_of([] { inputs::read_scenario_file("/tmp"); }), "/tmp: cannot be read: a folder; allowed: a file");
}

// Every file holds one mistake; its first line says what has to be reported, behind the file's name.
TEST(BadInputs, EachIsReportedByFileLineKeyValueAndRange) {
  int files = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "test/bad_inputs")) {
    const std::string path = entry.path().string();
    std::ifstream file(path);
    std::string first;
    std::getline(file, first);
    const std::string marker = "# expect ";
    ASSERT_EQ(first.compare(0, marker.size(), marker), 0) << path;
    EXPECT_EQ(message_of([&] { inputs::read_scenario_file(path); }), path + first.substr(marker.size()));
    ++files;
  }
  EXPECT_GE(files, 60);
}

}  // namespace
}  // namespace train_derail
