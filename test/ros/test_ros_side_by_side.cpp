// Two simulators under one master, told apart by namespace and frame prefix.
#include <map>
#include <set>

#include "node_client.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {
namespace {

std::string g_scenario_file;

TEST(SideBySide, EachRunsItsOwnScenario) {
  const NodeClient left("/left/train_derail"), right("/right/train_derail");
  Record<CarStates> left_cars("/left/train_derail/cars"), right_cars("/right/train_derail/cars");
  Record<CouplerForces> left_couplers("/left/train_derail/couplers"), right_couplers("/right/train_derail/couplers");
  Record<tf2_msgs::TFMessage> tf("/tf");
  Record<rosgraph_msgs::Clock> clock("/clock");
  Record<RunInfo> left_info("/left/train_derail/run_info"), right_info("/right/train_derail/run_info");
  ASSERT_TRUE(left.wait_until_up());
  ASSERT_TRUE(right.wait_until_up());
  ASSERT_TRUE(wait_for([&] {
    return !left_cars.empty() && !right_cars.empty() && !left_couplers.empty() && !right_couplers.empty() &&
           clock.connected() && !left_info.empty() && !right_info.empty() && tf.messages.size() >= 2;
  }));
  ASSERT_TRUE(left.trigger("resume").success);
  ASSERT_TRUE(right.trigger("resume").success);
  ASSERT_TRUE(wait_for([&] {
    return left_info.last().state == RunInfo::ENDED && right_info.last().state == RunInfo::ENDED &&
           left_couplers.last().time == left_info.last().time && right_couplers.last().time == right_info.last().time &&
           left_cars.last().time == left_info.last().time && right_cars.last().time == right_info.last().time;
  }));

  expect_equal_to_simulation(left_cars.messages, left_couplers.messages, inputs::read_scenario_file(g_scenario_file));
  expect_equal_to_simulation(
      right_cars.messages, right_couplers.messages,
      inputs::read_scenario_file(
          g_scenario_file, {{"initial.speed", "20 mph"}, {"consist[0].count", "5"}, {"initial.yaw_rate", "0.1"}}));
  std::map<std::string, std::set<std::string>> frames;
  std::map<std::string, ros::Time> last;
  for (const auto& m : tf.messages) {
    for (const auto& t : m.transforms) {
      EXPECT_GT(t.header.stamp, last[t.child_frame_id]) << t.child_frame_id;
      last[t.child_frame_id] = t.header.stamp;
      frames[t.child_frame_id.substr(0, t.child_frame_id.find('/'))].insert(t.child_frame_id);
    }
  }
  EXPECT_EQ(frames["left"].size(), 13U);
  EXPECT_EQ(frames["right"].size(), 6U);
  EXPECT_EQ(frames.size(), 2U);
  expect_strictly_newer(clock.messages);
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_side_by_side");
  if (argc < 2) return 2;
  train_derail::test::g_scenario_file = argv[1];
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
