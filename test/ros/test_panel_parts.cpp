// What the panel is made of, without RViz, node or master: forces over time, inputs as typed, the thread that may hang.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>

#include <gtest/gtest.h>

#include "rviz/force_record.hpp"
#include "rviz/input_table.hpp"
#include "rviz/scenario_files.hpp"
#include "rviz/sweep.hpp"
#include "rviz/ticks.hpp"
#include "rviz/worker.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail::rviz_panel {
namespace {

CouplerForces forces(std::uint32_t run_id, double time, const std::vector<double>& axial) {
  CouplerForces message;
  message.run_id = run_id;
  message.time = time;
  for (const double force : axial) {
    message.couplers.emplace_back();
    message.couplers.back().axial_force = force;
  }
  return message;
}

TEST(ForceRecord, KeepsThePeaksOfEachCouplerAndOfTheTrain) {
  ForceRecord record;
  record.add(forces(1, 0.00, {10.0, -5.0, 0.0}));
  record.add(forces(1, 0.02, {-20.0, 3.0, 0.0}));
  EXPECT_EQ(record.now, (std::vector<double>{-20.0, 3.0, 0.0}));
  EXPECT_EQ(record.buff_peak, (std::vector<double>{10.0, 3.0, 0.0}));
  EXPECT_EQ(record.draft_peak, (std::vector<double>{20.0, 5.0, 0.0}));
  EXPECT_EQ(record.buff_max(), 10.0);
  EXPECT_EQ(record.draft_max(), 20.0);
  ASSERT_EQ(record.history.size(), 2U);
  EXPECT_EQ(record.history[1].time, 0.02);
  EXPECT_EQ(record.history[1].buff, 3.0);
  EXPECT_EQ(record.history[1].draft, 20.0);
}

TEST(ForceRecord, APeakBetweenTwoMessagesIsOne) {
  ForceRecord record;
  CouplerForces message = forces(1, 0.02, {10.0, -5.0});
  message.couplers[0].buff_peak = 300.0;
  message.couplers[1].draft_peak = 200.0;
  record.add(message);
  EXPECT_EQ(record.now, (std::vector<double>{10.0, -5.0}));
  EXPECT_EQ(record.buff_peak, (std::vector<double>{300.0, 0.0}));
  EXPECT_EQ(record.draft_peak, (std::vector<double>{0.0, 200.0}));
  EXPECT_EQ(record.history.back().buff, 300.0);
  EXPECT_EQ(record.history.back().draft, 200.0);
}

TEST(ForceRecord, BeginsAnewWithAnotherRun) {
  ForceRecord record;
  record.add(forces(2, 5.0, {100.0}));
  record.add(forces(3, 0.0, {1.0}));
  EXPECT_EQ(record.buff_max(), 1.0);
  EXPECT_EQ(record.history.size(), 1U);
  record.add(forces(4, 0.0, {}));  // a lone car
  EXPECT_EQ(record.buff_max(), 0.0);
}

TEST(ForceRecord, LookingBackShowsThatMomentAndLosesNothing) {
  ForceRecord record;
  for (int k = 0; k <= 10; ++k) record.add(forces(1, 0.1 * k, {10.0 * k, -1.0 * k}));
  const auto history = record.history.size();
  record.add(forces(1, 0.3, {30.0, -3.0}));
  EXPECT_EQ(record.time, 0.3);
  EXPECT_EQ(record.time_max, 1.0);
  EXPECT_EQ(record.now, (std::vector<double>{30.0, -3.0}));
  EXPECT_EQ(record.buff_max(), 100.0);
  EXPECT_EQ(record.draft_max(), 10.0);
  record.add(forces(1, 0.8, {80.0, -8.0}));  // forward again, still before the end
  EXPECT_EQ(record.history.size(), history);
  record.add(forces(1, 1.1, {110.0, -11.0}));  // and on
  EXPECT_EQ(record.history.size(), history + 1);
  EXPECT_EQ(record.buff_max(), 110.0);
  EXPECT_EQ(record.time_max, 1.1);
}

TEST(ForceRecord, LongRunsStayShortAndLoseNoPeak) {
  ForceRecord record;
  constexpr int kPoints = 20000;
  for (int k = 0; k < kPoints; ++k) record.add(forces(1, 0.02 * k, {k == 12345 ? 999.0 : 1.0}));
  EXPECT_LE(record.history.size(), ForceRecord::kSamplesMax);
  EXPECT_GE(record.history.size(), ForceRecord::kSamplesMax / 4);
  double largest = 0.0, at = 0.0;
  for (std::size_t i = 0; i < record.history.size(); ++i) {
    if (i > 0) {
      EXPECT_GT(record.history[i].time, record.history[i - 1].time);
    }
    if (record.history[i].buff > largest) {
      largest = record.history[i].buff;
      at = record.history[i].time;
    }
  }
  EXPECT_EQ(largest, 999.0);
  EXPECT_NEAR(at, 0.02 * 12345, 2.0 * record.sample_width);
}

class TypedInputs : public testing::Test {
 protected:
  CheckedInput check(const std::string& key, const std::string& typed) { return check_input(tree, table, key, typed); }

  const inputs::Scenario scenario =
      inputs::read_scenario_file(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/baseline.yaml");
  const YAML::Node tree = YAML::Load(inputs::to_yaml(scenario));
  const InputTable table = make_input_table(scenario);
};

TEST_F(TypedInputs, AreShownInTheUnitThatPeopleReadAndInSi) {
  const InputItem& speed = table.at("initial.speed");
  EXPECT_EQ(speed.value, "37 mph");
  EXPECT_EQ(speed.value_si, "16.54 m/s");
  EXPECT_EQ(speed.allowed, "[0, 447.387] mph");
  EXPECT_FALSE(speed.meaning.empty());
  EXPECT_EQ(table.at("consist[0].weight").value, "150 kip");
  EXPECT_EQ(table.at("consist[0].weight").value_si, "667.2 kN");
  EXPECT_EQ(table.at("coupler.swing_limit").allowed, "[0, 180] deg");
  EXPECT_EQ(table.at("ground.on_track_law").choices,
            (std::vector<std::string>{"isotropic", "along_track", "guided", "rails"}));
  EXPECT_EQ(table.at("ground.on_track_law").value, "isotropic");
  EXPECT_EQ(table.at("coupler.swing_moment_max").value, ".inf");
  EXPECT_EQ(table.at("consist[0].count").value, "60");
}

TEST_F(TypedInputs, ABareNumberIsInTheUnitThatIsShown) {
  const CheckedInput speed = check("initial.speed", " 50 ");
  EXPECT_EQ(speed.error, "");
  EXPECT_EQ(speed.text, "50 mph");
  EXPECT_EQ(speed.value_si, "22.35 m/s");
  EXPECT_FALSE(speed.as_before);
  EXPECT_EQ(check("ground.on_track_friction", "0.2").text, "0.2") << "has no unit";
  EXPECT_EQ(check("consist[0].count", "61").text, "61");
}

TEST_F(TypedInputs, MayCarryTheirOwnUnit) {
  const CheckedInput speed = check("initial.speed", "80 km/hour");
  EXPECT_EQ(speed.error, "");
  EXPECT_EQ(speed.text, "80 km/hour");
  EXPECT_EQ(speed.value_si, "22.22 m/s");
  EXPECT_TRUE(check("initial.speed", "16.54048 m/s").as_before);
  EXPECT_TRUE(check("initial.speed", "37").as_before);
  EXPECT_FALSE(check("initial.speed", "37.000001").as_before) << "to the last digit";
}

TEST_F(TypedInputs, MistakesAreSaidAsTheReaderSaysThem) {
  for (const auto& [key, typed] : std::vector<std::pair<std::string, std::string>>{{"initial.speed", "-1"},
                                                                                   {"initial.speed", "fast"},
                                                                                   {"initial.speed", "50 kip"},
                                                                                   {"initial.speed", " "},
                                                                                   {"consist[0].count", "1.5"},
                                                                                   {"consist[0].count", "1001"},
                                                                                   {"ground.on_track_friction", "11"},
                                                                                   {"ground.on_track_law", "magnetic"},
                                                                                   {"coupler.slack", "9 ft"}}) {
    const CheckedInput checked = check(key, typed);
    EXPECT_NE(checked.error.find(key), std::string::npos) << typed << ": " << checked.error;
    EXPECT_NE(checked.error.find("allowed"), std::string::npos) << typed << ": " << checked.error;
  }
  EXPECT_NE(check("no.such_key", "1").error, "");
}

TEST(Ticks, TheOneAtZeroIsNeverAlone) {
  for (const auto& [low, high] :
       std::vector<std::pair<double, double>>{{0, 1}, {-1, 0}, {-10, 10}, {-3, 97}, {-44.5, 89}}) {
    for (const double part : {0.2, 0.35, 0.5}) {
      const double interval = tick_interval(low, high, part);
      EXPECT_GE(std::floor(high / interval) - std::ceil(low / interval) + 1.0, 2.0)
          << low << " " << high << " " << part;
    }
  }
}

TEST_F(TypedInputs, SweepsSayTheirMistakesAndHoldTheWholeScenario) {
  const auto refusal = [&](const Sweep& sweep) -> std::string {
    try {
      sweep_study(scenario, sweep);
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "none";
  };
  EXPECT_NE(refusal({"initial.speed", "60", "20", 3, 2}).find("not below"), std::string::npos);
  EXPECT_NE(refusal({"initial.speed", "fast", "20", 3, 2}).find("fast"), std::string::npos);
  EXPECT_NE(refusal({"initial.speed", "1", "9000", 3, 2}).find("allowed: [0, 200] m/s"), std::string::npos);
  EXPECT_NE(refusal({"initial.speed", "1", "9", 1, 2}).find("points"), std::string::npos);
  const study::Study study =
      study::read_study_text(sweep_study(scenario, {"initial.speed", "10", "30 mph", 5, 3}), "sweep");
  EXPECT_EQ(study.replicates, 3);
  ASSERT_EQ(study.factors.size(), 1U);
  EXPECT_EQ(study.factors[0].shown, (std::vector<std::string>{"10 mph", "15 mph", "20 mph", "25 mph", "30 mph"}));
  EXPECT_EQ(study.base.consist.at(0).count, scenario.consist.at(0).count);
  EXPECT_EQ(study::run_count(study), 15);
  // Whole numbers stay whole, and none stands twice.
  const study::Study cars =
      study::read_study_text(sweep_study(scenario, {"consist[0].count", "4", "6", 9, 1}), "sweep");
  EXPECT_EQ(cars.factors.at(0).shown, (std::vector<std::string>{"4", "5", "6"}));
}

TEST_F(TypedInputs, TheCommandNamesTheFileWhereFewInputsDifferAndElseHoldsTheScenario) {
  const std::string file = std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/baseline.yaml";
  inputs::Scenario changed = scenario;
  changed.initial.speed = 13.1234567890125;
  EXPECT_EQ(command_line(inputs::to_yaml(changed), {"/not/there.yaml", file}),
            "rosrun train_derail derail run '" + file + "' --set 'initial.speed=13.1234567890125'\n");
  changed.consist.push_back(changed.consist.front());  // a block that the file has not
  const std::string command = command_line(inputs::to_yaml(changed), {file});
  EXPECT_NE(command.find("<<'END_OF_SCENARIO'\n" + inputs::to_yaml(changed)), std::string::npos) << command;
  EXPECT_EQ(command.find(file), std::string::npos);
}

TEST(ScenarioFiles, AreThePresetsByTitle) {
  const auto files = scenario_files(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config");
  ASSERT_GE(files.size(), 5U);
  EXPECT_NE(std::find_if(files.begin(), files.end(),
                         [](const ScenarioFile& f) { return f.title == "Loaded unit train over a broken rail"; }),
            files.end());
  EXPECT_TRUE(scenario_files("/not/there").empty());
  // Bases are filled in.
  const std::string whole =
      whole_scenario(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/accidents/lac_megantic_2013.yaml");
  EXPECT_EQ(YAML::Load(whole)["base"].IsDefined(), false);
  EXPECT_EQ(inputs::model_of(inputs::read_scenario(YAML::Load(whole), "whole")), inputs::Model::extended);
}

TEST(SplitOverrides, AtSemicolons) {
  EXPECT_EQ(split_overrides(" a=1 ;; b = 2 mph;"), (std::vector<std::string>{"a=1", "b = 2 mph"}));
  EXPECT_TRUE(split_overrides("  ").empty());
}

TEST(Worker, DoesItsJobsInOrderAndIdlesBetween) {
  std::promise<void> idled;
  std::atomic<int> idle_count{0};
  std::vector<int> done;
  std::promise<void> all;
  {
    Worker worker(
        [&] {
          if (++idle_count == 3) idled.set_value();
        },
        std::chrono::milliseconds(1));
    EXPECT_EQ(idled.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
    for (int i = 0; i < 10; ++i) worker.post([&, i] { done.push_back(i); });
    worker.post([&] { all.set_value(); });
    EXPECT_EQ(all.get_future().wait_for(std::chrono::seconds(30)), std::future_status::ready);
  }
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(Worker, ItsEndWaitsForAShortJobButNotForOneThatHangs) {
  const auto release = std::make_shared<std::promise<void>>();
  const auto released = std::make_shared<std::future<void>>(release->get_future());
  const auto started = std::make_shared<std::promise<void>>();
  const auto begin = std::chrono::steady_clock::now();
  {
    Worker worker;
    worker.post([=] {
      started->set_value();
      released->wait();
    });
    started->get_future().wait();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
  release->set_value();

  const auto finished = std::make_shared<std::atomic<bool>>(false);
  const auto begun = std::make_shared<std::promise<void>>();
  {
    Worker worker;
    worker.post([=] {
      begun->set_value();
      *finished = true;
    });
    begun->get_future().wait();
  }
  EXPECT_TRUE(*finished);
}

}  // namespace
}  // namespace train_derail::rviz_panel

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
