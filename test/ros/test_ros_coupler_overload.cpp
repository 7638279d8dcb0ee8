// The example coupler_overload_monitor beside a real simulator: its reports against simulations in this process.
#include <map>

#include <diagnostic_msgs/DiagnosticArray.h>

#include "node_client.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {
namespace {

using diagnostic_msgs::DiagnosticArray;
using diagnostic_msgs::DiagnosticStatus;

constexpr double kThreshold = 100.0 * inputs::kKip;

std::string g_scenario_file;

std::string value(const DiagnosticStatus& status, const std::string& key) {
  for (const auto& pair : status.values) {
    if (pair.key == key) return pair.value;
  }
  ADD_FAILURE() << status.name << " has no " << key;
  return "0";
}

double number(const DiagnosticStatus& status, const std::string& key) { return std::stod(value(status, key)); }

/// Last report of a run, under way or not. Throws std::out_of_range if there is none.
const DiagnosticArray& last_of(const Record<DiagnosticArray>& reports, const std::string& run_id) {
  for (auto r = reports.messages.rbegin(); r != reports.messages.rend(); ++r) {
    if (value(r->status.at(0), "run_id") == run_id) return *r;
  }
  throw std::out_of_range("no report");
}

/// What the report must say of one coupler in one direction.
struct Expected {
  double first = -1.0, above = 0.0, peak = 0.0, peak_time = 0.0;
};

/// From the snapshots up to time `end`: by (coupler, direction), only those above the threshold.
std::map<std::pair<std::string, std::string>, Expected> expected_loads(const inputs::Scenario& scenario, double end) {
  std::map<std::pair<std::string, std::string>, Expected> all;
  simulation::Simulation simulation(scenario);
  for (int tick = 0;; ++tick) {
    simulation.advance(tick * scenario.output.interval);
    const simulation::Snapshot now = simulation.snapshot();
    for (std::size_t i = 0; i < now.couplers.size(); ++i) {
      const simulation::CouplerSnapshot& c = now.couplers[i];
      for (const auto& [direction, force] : {std::pair("buff", std::max(c.buff_peak, c.axial_force)),
                                             std::pair("draft", std::max(c.draft_peak, -c.axial_force))}) {
        Expected& e = all[{std::to_string(i + 1), direction}];
        if (force > e.peak) {
          e.peak = force;
          e.peak_time = now.time;
        }
        if (force <= kThreshold) continue;
        if (e.first < 0.0) e.first = now.time;
        e.above += scenario.output.interval;
      }
    }
    if (simulation.ended() || simulation.time() >= end) break;
  }
  for (auto i = all.begin(); i != all.end();) i = i->second.first < 0.0 ? all.erase(i) : std::next(i);
  return all;
}

void expect_report(const DiagnosticArray& report, const inputs::Scenario& scenario, bool complete) {
  const DiagnosticStatus& summary = report.status.at(0);
  EXPECT_EQ(value(summary, "complete"), complete ? "true" : "false");
  EXPECT_EQ(value(summary, "points_missed"), "0");
  EXPECT_DOUBLE_EQ(number(summary, "threshold_N"), kThreshold);
  auto expected = expected_loads(scenario, number(summary, "time_s"));
  EXPECT_EQ(summary.level, expected.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN);
  EXPECT_EQ(report.status.size() - 1, expected.size());
  for (std::size_t i = 1; i < report.status.size(); ++i) {
    const DiagnosticStatus& s = report.status[i];
    const auto found = expected.find({value(s, "coupler"), value(s, "direction")});
    ASSERT_NE(found, expected.end()) << s.name;
    EXPECT_EQ(s.level, DiagnosticStatus::WARN);
    EXPECT_EQ(number(s, "first_time_s"), found->second.first) << s.name;
    EXPECT_NEAR(number(s, "time_above_s"), found->second.above, 1e-9) << s.name;
    EXPECT_EQ(number(s, "peak_N"), found->second.peak) << s.name;
    EXPECT_EQ(number(s, "peak_time_s"), found->second.peak_time) << s.name;
    expected.erase(found);
  }
}

TEST(CouplerOverload, EveryRunIsReportedWithItsOwnGrid) {
  const NodeClient node("/train_derail");
  const Record<DiagnosticArray> reports("/coupler_overload_monitor/report");
  const auto complete = [&](const std::string& run_id) {
    return wait_for([&] { return value(last_of(reports, run_id).status.at(0), "complete") == "true"; });
  };
  ASSERT_TRUE(node.wait_until_up());
  ASSERT_TRUE(complete("1")) << "resumed by the monitor, run to its end";
  expect_report(last_of(reports, "1"), inputs::read_scenario_file(g_scenario_file), true);
  EXPECT_GT(last_of(reports, "1").status.size(), 5U) << "a scenario in which nothing happens tests nothing";

  ASSERT_TRUE(node.restart({"output.interval=0.01", "initial.speed=60 mph", "consist[0].count=8"}, false).success);
  ASSERT_TRUE(complete("2"));
  expect_report(
      last_of(reports, "2"),
      inputs::read_scenario_file(g_scenario_file,
                                 {{"output.interval", "0.01"}, {"initial.speed", "60 mph"}, {"consist[0].count", "8"}}),
      true);

  // Cut short by the restart after it.
  ASSERT_TRUE(node.restart({"output.interval=0.02"}, true).success);
  ASSERT_TRUE(node.step(60, 0.0).success);
  ASSERT_TRUE(node.restart({"initial.speed=0", "initial.yaw_rate=0"}, false).success);
  ASSERT_TRUE(complete("4"));
  ASSERT_TRUE(wait_for([&] { return last_of(reports, "3").status.size() > 0; }));
  const DiagnosticArray& cut = last_of(reports, "3");
  EXPECT_NEAR(number(cut.status.at(0), "time_s"), 1.2, 1e-12);
  expect_report(
      cut,
      inputs::read_scenario_file(g_scenario_file,
                                 {{"output.interval", "0.02"}, {"initial.speed", "60 mph"}, {"consist[0].count", "8"}}),
      false);
  EXPECT_EQ(last_of(reports, "4").status.size(), 1U) << "a train at rest loads no coupler";
  EXPECT_EQ(last_of(reports, "4").status[0].level, DiagnosticStatus::OK);
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_coupler_overload");
  if (argc < 2) return 2;
  train_derail::test::g_scenario_file = argv[1];
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
