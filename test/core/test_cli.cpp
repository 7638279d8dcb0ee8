// The command line as a user meets it: a real process, its exit code, what it prints and leaves behind.
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "command_line.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/model/train.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using test::Cli;
using test::derail;
using test::Result;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;
const std::string kBaseline = kSource + "/config/baseline.yaml";

const std::string kShort = " --set \"consist[0].count=5\" --set \"stop.time_max=1 s\"";

TEST_F(Cli, JsonHoldsTheOutcomeOfTheSameRun) {
  const Result r = derail("run " + kBaseline + kShort + " --json - --quiet", false);
  ASSERT_EQ(r.code, 0) << r.out;
  const auto j = nlohmann::json::parse(r.out);
  simulation::Simulation s(
      inputs::read_scenario_file(kBaseline, {{"consist[0].count", "5"}, {"stop.time_max", "1 s"}}));
  s.run();
  const outcome::Outcome o = s.outcome();
  EXPECT_EQ(j.at("cars_past_pod"), o.cars_past_pod);
  EXPECT_EQ(j.at("cars_off_track"), o.cars_off_track);
  EXPECT_EQ(j.at("closing_speed_max"), o.closing_speed_max.speed);
  EXPECT_EQ(j.at("relative_speed_max"), o.relative_speed_max.speed);
  EXPECT_EQ(j.at("coupler_buff_peak"), o.coupler_buff_peak.force);
  EXPECT_EQ(j.at("coupler_draft_peak"), o.coupler_draft_peak.force);
  EXPECT_EQ(j.at("stop_time"), 1.0);
  EXPECT_EQ(j.at("ended"), "time_max");
  EXPECT_EQ(j.at("steps"), o.solver.steps);
  EXPECT_EQ(j.at("rhs_evaluations"), o.solver.rhs_evaluations);
  EXPECT_EQ(j.at("energy_residual"), o.energy_residual);
  EXPECT_GT(j.at("wall_time"), 0.0);
  EXPECT_GT(o.coupler_buff_peak.force, 0.0);
}

TEST_F(Cli, JsonFileAndTable) {
  const fs::path json = folder_ / "outcome.json";
  const Result r = derail("run " + kBaseline + kShort + " --json " + json.string());
  ASSERT_EQ(r.code, 0) << r.out;
  for (const char* word :
       {"cars past the point of derailment", "cars off the track", "kip", "mph", "ft", "time limit reached"}) {
    EXPECT_NE(r.out.find(word), std::string::npos) << word << " is missing in\n" << r.out;
  }
  std::ifstream file(json);
  EXPECT_EQ(nlohmann::json::parse(file).at("cars"), 5);
}

TEST_F(Cli, AWarningIsSaidOnce) {
  // The first is allowed and not usual; the second has no effect where bodies pass through each other.
  const std::string odd = "run " + kBaseline + kShort + " --set \"consist[0].width=5 m\" --set contact.friction=0.1";
  const auto count = [](const std::string& text, const std::string& word) {
    std::size_t times = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++times;
    return times;
  };
  for (const std::string& options : {std::string(), std::string(" --quiet"), " --quiet --json " + at("o.json")}) {
    const Result r = derail(odd + options);
    ASSERT_EQ(r.code, 0) << r.out;
    EXPECT_EQ(count(r.out, "consist[0].width"), 1U) << r.out;
    EXPECT_EQ(count(r.out, "contact.friction"), 1U) << r.out;
  }
  EXPECT_EQ(count(derail(odd, false).out, "consist[0].width"), 1U) << "in the table, with the numbers";
  EXPECT_EQ(count(derail("check " + kBaseline + " --set \"consist[0].width=5 m\"").out, "warning: "), 1U);
}

TEST_F(Cli, CsvIsTheOutputGrid) {
  const fs::path csv = folder_ / "states.csv";
  const Result r = derail("run " + kBaseline + kShort + " --quiet --csv " + csv.string());
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_EQ(r.out, "");
  std::ifstream file(csv);
  std::string line;
  std::getline(file, line);
  const auto columns = std::count(line.begin(), line.end(), ',');
  int rows = 0;
  std::string last;
  while (std::getline(file, line)) {
    EXPECT_EQ(std::count(line.begin(), line.end(), ','), columns);
    ++rows;
    last = line;
  }
  EXPECT_EQ(rows, 5 * 51);  // t = 0, 0.02, ..., 1 s
  EXPECT_EQ(last.substr(0, 4), "1,5,");
}

TEST_F(Cli, WrongInputsExitWithTwoAndStartNothing) {
  const fs::path csv = folder_ / "states.csv";
  for (const auto& entry : fs::directory_iterator(kSource + "/test/bad_inputs")) {
    const Result r = derail("run " + entry.path().string() + " --csv " + csv.string());
    EXPECT_EQ(r.code, 2) << entry.path();
    EXPECT_EQ(r.out.compare(0, 8, "derail: "), 0) << r.out;
    EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), 1) << "one error, one line: " << r.out;
  }
  EXPECT_FALSE(fs::exists(csv));
  EXPECT_EQ(derail("run").code, 2);
  EXPECT_EQ(derail("").code, 2);
  EXPECT_EQ(derail("fly " + kBaseline).code, 2);
  EXPECT_EQ(derail("run " + kBaseline + " --fast").code, 2);
  EXPECT_EQ(derail("run " + kBaseline + " --set initial.speed=fast").code, 2);
  EXPECT_EQ(derail("run no_such_file.yaml").code, 2);
}

TEST_F(Cli, AFailedIntegrationExitsWithThreeAndStillReports) {
  const Result r = derail("run " + kBaseline + " --set solver.steps_max=50 --json - --quiet", false);
  EXPECT_EQ(r.code, 3);
  const auto j = nlohmann::json::parse(r.out);
  EXPECT_EQ(j.at("ended"), "integration_failed");
  EXPECT_EQ(j.at("steps"), 50);
  EXPECT_NE(j.at("message").get<std::string>().find("solver.steps_max"), std::string::npos);
}

TEST_F(Cli, OutputThatCannotBeWrittenExitsWithOne) {
  const Result r = derail("run " + kBaseline + kShort + " --csv " + (folder_ / "none" / "states.csv").string());
  EXPECT_EQ(r.code, 1);
  EXPECT_NE(r.out.find("cannot be written"), std::string::npos) << r.out;
  if (fs::exists("/dev/full")) {
    EXPECT_EQ(derail("run " + kBaseline + kShort + " --csv /dev/full").code, 1);
    EXPECT_EQ(derail("run " + kBaseline + kShort + " > /dev/full", false).code, 1);
    // What many runs have come to is said nevertheless.
    const Result many =
        derail("run " + kBaseline + kShort + " --set initial.perturbation.spacing=0.01 --seeds 2 --json /dev/full");
    EXPECT_EQ(many.code, 1);
    EXPECT_NE(many.out.find("peak coupler force"), std::string::npos) << many.out;
    EXPECT_NE(many.out.find("No space left on device"), std::string::npos) << many.out;
  }
}

TEST_F(Cli, CheckPrintsAScenarioThatChecksTheSame) {
  const fs::path file = folder_ / "full.yaml";
  ASSERT_EQ(derail("check " + kBaseline + " > " + file.string(), false).code, 0);
  const Result first = derail("check " + file.string());
  const Result direct = derail("check " + kBaseline);
  EXPECT_EQ(first.code, 0) << first.out;
  EXPECT_EQ(first.out, direct.out);
  EXPECT_NE(direct.out.find("37 mph"), std::string::npos);
}

TEST_F(Cli, CheckTellsOfATrainInSpaceWhatFollowsFromOtherKeys) {
  write("rotary.yaml", "base: " + kSource + "/config/accident3d.yaml\ncoupler: {roll_limit: .inf}\n");
  const std::string arguments = "check " + at("rotary.yaml") + " --set consist[1].coupler_type=F";
  const Result r = derail(arguments);
  ASSERT_EQ(r.code, 0) << r.out;
  // Without the signs of comments it is a scenario with the same cars and couplers, to the last bit.
  const inputs::Scenario plain = inputs::read_scenario_file(at("rotary.yaml"), {{"consist[1].coupler_type", "F"}});
  std::string filled = std::regex_replace(r.out, std::regex("# ([a-z_]+: )"), "$1");
  write("filled.yaml", filled);
  const inputs::Scenario all = inputs::read_scenario_file(at("filled.yaml"));
  EXPECT_EQ(model::expand(all.consist), model::expand(plain.consist));
  for (std::size_t i = 0; i < plain.consist.size(); ++i) {
    EXPECT_FALSE(plain.consist[i].centre_height);
    EXPECT_EQ(all.consist[i].centre_height, model::expand({plain.consist[i]})[0].centre_height);
    EXPECT_TRUE(all.consist[i].floor_height && all.consist[i].roof_height && all.consist[i].roll_inertia);
  }
  const inputs::CouplerHold hold = inputs::coupler_hold(plain.coupler, "", "");
  EXPECT_EQ(all.coupler.pitch_limit, hold.pitch_limit);
  EXPECT_EQ(all.coupler.vertical_hold, hold.vertical_hold);
  // As it stands it is the scenario itself, and says the same again.
  write("full.yaml", r.out);
  EXPECT_EQ(inputs::to_yaml(inputs::read_scenario_file(at("full.yaml"))), inputs::to_yaml(plain));
  EXPECT_EQ(derail("check " + at("full.yaml")).out, r.out);
  EXPECT_NE(r.out.find("\n# Coupler E_shelf to F: pitch_limit 6.5 deg, slip_height .inf, vertical_hold 200 kip, "
                       "roll_limit .inf\n"),
            std::string::npos)
      << r.out;
  EXPECT_EQ(derail("check " + kSource + "/config/accident.yaml").out.find("# centre_height"), std::string::npos);
}

TEST_F(Cli, VersionIsThatOfThePackage) {
  std::ifstream file(kSource + "/package.xml");
  const std::string package((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const std::size_t at = package.find("<version>") + 9;
  const Result r = derail("--version");
  EXPECT_EQ(r.code, 0) << r.out;
  EXPECT_EQ(r.out, "train_derail " + package.substr(at, package.find('<', at) - at) + "\n");
}

TEST_F(Cli, HelpTeaches) {
  const Result r = derail("--help");
  for (const char* model : {"in the plane by the equations", "model: spatial"})
    EXPECT_NE(r.out.find(model), std::string::npos) << r.out;
  EXPECT_EQ(r.code, 0);
  EXPECT_NE(r.out.find("derail run config/baseline.yaml"), std::string::npos);
  EXPECT_EQ(derail("run --help").code, 0);
  const std::string keys = derail("keys").out;
  EXPECT_EQ(keys.rfind("base\n", 0), 0U) << "the file to start from comes first";
  EXPECT_NE(keys.find("coupler.swing_limit"), std::string::npos);
}

}  // namespace
}  // namespace train_derail
