// The model in three dimensions under the node: frames, markers and outcome are those of cars that roll over.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <visualization_msgs/MarkerArray.h>
#include <Eigen/Geometry>

#include "marker_check.hpp"
#include "node_client.hpp"
#include "train_derail/Inputs.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::test {
namespace {

constexpr double kOver = M_PI / 4.0;  // tilt of a car on its side or over [rad]

Eigen::Quaterniond rotation(const geometry_msgs::Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

/// One whole run, recorded once for all tests.
class Spatial : public RecordedOnce<Spatial> {
 public:
  static void record() {
    const NodeClient node("/train_derail");
    cars = new Record<CarStates>("/train_derail/cars");
    couplers = new Record<CouplerForces>("/train_derail/couplers");
    frames = new Record<tf2_msgs::TFMessage>("/tf");
    markers = new Record<visualization_msgs::MarkerArray>("/train_derail/markers");
    track = new Record<visualization_msgs::MarkerArray>("/train_derail/track_markers");
    outcome = new Record<Outcome>("/train_derail/outcome");
    const Record<Inputs> inputs("/train_derail/inputs");
    ASSERT_TRUE(node.wait_until_up());
    ASSERT_TRUE(wait_for([&] {
      return !cars->empty() && !couplers->empty() && !frames->empty() && !markers->empty() && !track->empty() &&
             !outcome->empty() && !inputs.empty();
    }));
    ASSERT_TRUE(node.trigger("resume").success);
    ASSERT_TRUE(wait_for([] { return outcome->last().ended != Outcome::RUNNING; }));
    const ros::Time end = outcome->last().header.stamp;
    ASSERT_TRUE(wait_for([&] {
      return cars->last().header.stamp == end && couplers->last().header.stamp == end && frame_of(1, end) != nullptr;
    })) << "streams do not reach the end of the run";
    scenario = new inputs::Scenario(inputs::read_scenario(YAML::Load(inputs.last().yaml), "~inputs"));
  }

  /// The frame of a car at a time; null if it has not come.
  static const geometry_msgs::Transform* frame_of(std::size_t number, const ros::Time& time) {
    char name[16];
    std::snprintf(name, sizeof(name), "car_%03zu", number);
    for (auto message = frames->messages.rbegin(); message != frames->messages.rend(); ++message) {
      for (const auto& t : message->transforms) {
        if (t.header.stamp == time && t.child_frame_id == name) return &t.transform;
      }
    }
    return nullptr;
  }

  static inline Record<CarStates>* cars = nullptr;
  static inline Record<CouplerForces>* couplers = nullptr;
  static inline Record<tf2_msgs::TFMessage>* frames = nullptr;
  static inline Record<visualization_msgs::MarkerArray>*markers = nullptr, *track = nullptr;
  static inline Record<Outcome>* outcome = nullptr;
  static inline inputs::Scenario* scenario = nullptr;
};

TEST_F(Spatial, StatesAndForcesEqualASimulationInThisProcess) {
  ASSERT_EQ(inputs::model_of(*scenario), inputs::Model::spatial);
  expect_equal_to_simulation(cars->messages, couplers->messages, *scenario);
}

TEST_F(Spatial, FramesOfCarsRollWithTheirCars) {
  const std::vector<model::Car> train = model::expand(scenario->consist);
  ASSERT_EQ(train.size(), cars->last().cars.size());
  int over = 0;
  for (const std::size_t moment : {cars->messages.size() / 2, cars->messages.size() - 1}) {
    const CarStates& states = cars->messages[moment];
    for (std::size_t k = 0; k < train.size(); ++k) {
      const CarState& car = states.cars[k];
      const geometry_msgs::Transform* frame = frame_of(k + 1, states.header.stamp);
      ASSERT_TRUE(frame) << k;
      // The frame lies on the top of the rails as long as the car does, and turns with it. The pose counts the height
      // from where the centre of mass is then.
      const Eigen::Quaterniond q = rotation(car.pose.orientation);
      const Eigen::Vector3d foot = Eigen::Vector3d(car.pose.position.x, car.pose.position.y, car.pose.position.z) -
                                   q * Eigen::Vector3d(0.0, 0.0, train[k].centre_height) +
                                   Eigen::Vector3d(0.0, 0.0, train[k].centre_height);
      const auto& p = frame->translation;
      EXPECT_LT((Eigen::Vector3d(p.x, p.y, p.z) - foot).norm(), 1e-6) << k;
      EXPECT_LT(q.angularDistance(rotation(frame->rotation)), 1e-6) << k;
      EXPECT_NEAR((q * Eigen::Vector3d::UnitZ()).z(), std::cos(car.tilt), 1e-6) << k;
      over += car.tilt > kOver ? 1 : 0;
    }
  }
  EXPECT_GT(over, 0) << "no car has rolled over";
}

TEST_F(Spatial, MarkersLieInTheFramesOfTheirCarsOnTheBank) {
  const auto shown = [](const Record<visualization_msgs::MarkerArray>& record) {
    Shown all;
    for (const auto& array : record.messages) all.receive(array);
    return all;
  };
  for (const auto* record : {markers, track}) {
    for (const auto& array : record->messages) expect_valid(array, cars->last().header.frame_id);
  }
  const Shown train = shown(*markers);
  for (const CarState& car : cars->last().cars) {
    const visualization_msgs::Marker* body = train.find("cars", static_cast<int>(car.number));
    ASSERT_TRUE(body) << car.number;
    EXPECT_TRUE(body->frame_locked) << "it rolls with its frame";
    EXPECT_EQ(body->pose.orientation.w, 1.0) << car.number;
  }
  const Shown place = shown(*track);
  double lowest = 0.0;
  for (const auto& [key, marker] : place.all()) {
    if (key.first != "ground") continue;
    for (const auto& p : marker.points) lowest = std::min(lowest, marker.pose.position.z + p.z);
  }
  EXPECT_LT(lowest, -scenario->terrain.bank_left) << "the ground is drawn at the foot of the bank";
}

TEST_F(Spatial, OutcomeCountsTheCarsThatLie) {
  simulation::Simulation simulation(*scenario);
  simulation.run();
  const outcome::Outcome expected = simulation.outcome();
  const Outcome& o = outcome->last();
  EXPECT_EQ(o.ended, Outcome::AT_REST);
  EXPECT_GT(o.cars_over, 0U);
  EXPECT_EQ(o.cars_over, static_cast<unsigned>(expected.posture.over()));
  EXPECT_EQ(o.cars_over, o.cars_on_side + o.cars_inverted);
  EXPECT_EQ(o.cars_upright + o.cars_leaning + o.cars_over, static_cast<unsigned>(expected.posture.cars()));
  EXPECT_EQ(o.drop_max, expected.posture.drop_max);
  const auto& last = cars->last().cars;
  EXPECT_EQ(o.cars_over, std::count_if(last.begin(), last.end(), [](const CarState& c) { return c.tilt >= kOver; }));
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_spatial");
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
