// What the tests of the running node share: waiting for conditions, keeping all that a topic says, calling services.
#pragma once

#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include "train_derail/CarStates.h"
#include "train_derail/CouplerForces.h"
#include "train_derail/Outcome.h"
#include "train_derail/Restart.h"
#include "train_derail/RunInfo.h"
#include "train_derail/SetColours.h"
#include "train_derail/SetRate.h"
#include "train_derail/Step.h"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::test {

/// Serves callbacks until `condition` holds; false after `limit` seconds of wall time. A condition on a message that
/// has not come yet (std::out_of_range) does not hold yet.
inline bool wait_for(const std::function<bool()>& wanted, double limit = 150.0) {
  const auto condition = [&wanted] {
    try {
      return wanted();
    } catch (const std::out_of_range&) {
      return false;
    }
  };
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(limit);
  while (ros::ok() && !condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.02));
  }
  return condition();
}

/// Every message of a topic since it was made.
template <class Message>
class Record {
 public:
  explicit Record(const std::string& topic)
      : subscriber_(ros::NodeHandle().subscribe<Message>(
            topic, 100000, [this](const boost::shared_ptr<const Message>& m) { messages.push_back(*m); })) {}
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  bool connected() const { return subscriber_.getNumPublishers() > 0; }
  bool empty() const { return messages.empty(); }
  const Message& last() const { return messages.at(messages.size() - 1); }  // throws std::out_of_range if there is none

  std::vector<Message> messages;

 private:
  ros::Subscriber subscriber_;
};

/// Fixture of tests that look at one run: Derived::record() records it before the first of them.
template <class Derived>
class RecordedOnce : public testing::Test {
 protected:
  void SetUp() override {
    static const bool recorded = (Derived::record(), !HasFailure());
    ASSERT_TRUE(recorded);
  }
};

/// One node under test, all of whose services answer.
class NodeClient {
 public:
  explicit NodeClient(std::string name) : name_(std::move(name)) {}

  std::string topic(const std::string& name) const { return name_ + "/" + name; }

  bool wait_until_up() const {
    return wait_for([&] { return ros::service::exists(topic("get_inputs"), false); });
  }

  template <class Service>
  typename Service::Response call(const std::string& name, const typename Service::Request& request) const {
    Service service;
    service.request = request;
    // Persistent, or roscpp now and then drops the answer to what has been done (docs/node.md).
    EXPECT_TRUE(ros::service::createClient<Service>(topic(name), true).call(service)) << name << ": no answer";
    return service.response;
  }
  std_srvs::Trigger::Response trigger(const std::string& name) const { return call<std_srvs::Trigger>(name, {}); }
  Step::Response step(std::uint32_t ticks, double seconds) const {
    Step::Request request;
    request.ticks = ticks;
    request.seconds = seconds;
    return call<Step>("step", request);
  }
  SetRate::Response set_rate(double rate) const {
    SetRate::Request request;
    request.rate = rate;
    return call<SetRate>("set_rate", request);
  }
  SetColours::Response set_colours(const std::string& colours) const {
    SetColours::Request request;
    request.colours = colours;
    return call<SetColours>("set_colours", request);
  }
  Restart::Response restart(const std::vector<std::string>& overrides = {}, bool start_paused = true,
                            const std::string& scenario = "", bool reload = false) const {
    Restart::Request request;
    request.overrides = overrides;
    request.start_paused = start_paused;
    request.scenario = scenario;
    request.reload_parameters = reload;
    return call<Restart>("restart", request);
  }

 private:
  std::string name_;
};

inline void expect_refused(bool success, const std::string& message, const std::vector<std::string>& said) {
  EXPECT_FALSE(success) << message;
  for (const std::string& text : said) EXPECT_NE(message.find(text), std::string::npos) << message << " lacks " << text;
}

/// The messages of one run against a simulation of the same scenario in this process, bit for bit.
inline void expect_equal_to_simulation(const std::vector<CarStates>& cars, const std::vector<CouplerForces>& couplers,
                                       const inputs::Scenario& scenario) {
  simulation::Simulation simulation(scenario);
  ASSERT_EQ(cars.size(), couplers.size());
  for (std::size_t i = 0; i < cars.size(); ++i) {
    ASSERT_EQ(cars[i].header.stamp, couplers[i].header.stamp);
    ASSERT_EQ(cars[i].time, couplers[i].time);
    simulation.advance(cars[i].time);
    ASSERT_EQ(simulation.time(), cars[i].time);
    const simulation::Snapshot expected = simulation.snapshot();
    ASSERT_EQ(cars[i].cars.size(), expected.cars.size());
    ASSERT_EQ(couplers[i].couplers.size(), expected.couplers.size());
    for (std::size_t k = 0; k < expected.cars.size(); ++k) {
      const CarState& m = cars[i].cars[k];
      const simulation::CarSnapshot& e = expected.cars[k];
      ASSERT_EQ(m.number, k + 1);
      const geometry_msgs::Pose& p = m.pose;
      const geometry_msgs::Twist& v = m.twist;
      ASSERT_TRUE(p.position.x == e.x && p.position.y == e.y && p.position.z == e.z && p.orientation.x == e.qx &&
                  p.orientation.y == e.qy && p.orientation.z == e.qz && p.orientation.w == e.qw && v.linear.x == e.vx &&
                  v.linear.y == e.vy && v.linear.z == e.vz && v.angular.x == e.wx && v.angular.y == e.wy &&
                  v.angular.z == e.omega && m.theta == e.theta && m.past_pod == e.past_pod &&
                  m.off_track == e.off_track && m.front_truck_offset == e.front_truck.offset &&
                  m.rear_truck_offset == e.rear_truck.offset && m.derailed == e.derailed &&
                  m.cause == static_cast<int>(e.cause))
          << "car " << k + 1 << " at " << expected.time << " s";
    }
    for (std::size_t k = 0; k < expected.couplers.size(); ++k) {
      const CouplerForce& m = couplers[i].couplers[k];
      const simulation::CouplerSnapshot& e = expected.couplers[k];
      ASSERT_EQ(m.number, k + 1);
      ASSERT_TRUE(m.gap == e.gap && m.angle == e.angle && m.axial_force == e.axial_force &&
                  m.lateral_force == e.lateral_force && m.swing_lead == e.swing_lead &&
                  m.swing_trail == e.swing_trail && m.moment_lead == e.moment_lead &&
                  m.moment_trail == e.moment_trail && m.broken == e.broken)
          << "coupler " << k + 1 << " at " << expected.time << " s";
    }
  }
}

inline void expect_strictly_newer(const std::vector<rosgraph_msgs::Clock>& clocks) {
  for (std::size_t i = 0; i < clocks.size(); ++i) {
    ASSERT_GT(clocks[i].clock, i == 0 ? ros::Time(0) : clocks[i - 1].clock) << "clock " << i;
  }
}

}  // namespace train_derail::test
