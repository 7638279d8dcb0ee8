// The parts of the ROS face that need no master: pace, clock, frames, heap, history, stream, commands.
#include <cmath>
#include <thread>

#include <gtest/gtest.h>

#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/messages.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/run_history.hpp"
#include "train_derail/ros/run_stream.hpp"
#include "train_derail/ros/sim_clock.hpp"
#include "train_derail/ros/simulation_loop.hpp"

namespace train_derail::ros_face {
namespace {

const WallTime kStart{std::chrono::hours(5)};
WallTime at(double s) { return kStart + wall_seconds(s); }

TEST(Pacer, IsDueAlongTheRate) {
  Pacer pacer(2.0, 0.02);
  pacer.anchor(at(0.0), 10.0);
  EXPECT_NEAR(to_seconds(pacer.due(13.0) - at(0.0)), 1.5, 1e-6);
  pacer.set_rate(0.5);
  pacer.anchor(at(4.0), 13.0);
  EXPECT_NEAR(to_seconds(pacer.due(14.0) - at(4.0)), 2.0, 1e-6);
}

TEST(Pacer, NeverBurstsAfterASlowSpell) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(0.0), 0.0);
  // Ten ticks in time, one that takes 5 s, then the machine is quick again: waits as its loop does.
  double wall = 0.0, last_sent = 0.0;
  for (int tick = 1; tick <= 200; ++tick) {
    const double t = 0.02 * tick;
    wall = std::max(wall, to_seconds(pacer.due(t) - at(0.0)));
    wall += tick == 11 ? 5.0 : 1e-4;
    pacer.done(at(wall), t);
    if (tick > 12) {
      EXPECT_GT(wall - last_sent, 0.019) << "tick " << tick;
    }
    last_sent = wall;
  }
  EXPECT_NEAR(pacer.take_lost(), 5.0, 0.001);
  EXPECT_EQ(pacer.take_lost(), 0.0);
}

TEST(Pacer, CatchesUpWithOrdinaryJitter) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(0.0), 0.0);
  double wall = 0.0;
  for (int tick = 1; tick <= 1000; ++tick) {
    wall = std::max(wall, to_seconds(pacer.due(0.02 * tick) - at(0.0))) + (tick % 7 == 0 ? 0.004 : 0.0002);
    EXPECT_LE(pacer.done(at(wall), 0.02 * tick), 0.0041);
  }
  EXPECT_EQ(pacer.take_lost(), 0.0);
  EXPECT_NEAR(wall, 20.0, 0.01) << "the pace is the anchor's, not a sum of waits";
}

TEST(Pacer, MeasuresTheAchievedRate) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(1.0), 0.0);
  EXPECT_NEAR(pacer.take_achieved_rate(at(3.0), 1.0), 0.5, 1e-9);
  EXPECT_NEAR(pacer.take_achieved_rate(at(4.0), 3.0), 2.0, 1e-9);
}

TEST(SimClock, StampsAreOnTheGridAndNeverGoBack) {
  SimClock clock;
  clock.start_run();
  EXPECT_GT(clock.now(), ros::Time(0));
  ros::Time last = clock.now();
  for (int run = 0; run < 3; ++run) {
    for (int tick = 1; tick <= 170; ++tick) {
      clock.advance(tick * 0.02);
      EXPECT_EQ((clock.now() - clock.start()).toNSec(), tick * 20000000LL);
      EXPECT_GT(clock.now(), last);
      last = clock.now();
    }
    clock.start_run();
    EXPECT_GT(clock.now(), last);
    EXPECT_EQ(clock.start().nsec, 0U);
    last = clock.now();
  }
}

TEST(Frames, NumbersHaveThreeDigitsAtLeast) {
  const Frames frames{"map", "a/"};
  EXPECT_EQ(frames.car(7), "a/car_007");
  EXPECT_EQ(frames.car(1000), "a/car_1000");
}

TEST(Frames, OfACarRollsWithIt) {
  // On its right side: what was above the rails is now to the right, as far.
  std::vector<model::Car> train(1);
  train[0].centre_height = 2.0;
  simulation::CarSnapshot car;
  car.x = 10.0;
  car.y = 5.0;
  car.z = -0.5;  // its centre of mass is 1.5 m above the top of the rails
  car.qx = car.qw = std::sqrt(0.5);
  const geometry_msgs::Transform t = to_transforms(train, {car}, {}, {}).transforms.at(0).transform;
  EXPECT_NEAR(t.translation.x, 10.0, 1e-12);
  EXPECT_NEAR(t.translation.y, 5.0 + 2.0, 1e-12) << "the wheels point to the left";
  EXPECT_NEAR(t.translation.z, 1.5, 1e-12);
  EXPECT_EQ(t.rotation.x, car.qx);
  car.qx = 0.0;
  car.qw = 1.0;
  EXPECT_EQ(to_transforms(train, {car}, {}, {}).transforms.at(0).transform.translation.z, car.z);
}

TEST(PileUpFollower, GoesToTheMiddleOfTheHeap) {
  PileUpFollower follower;
  scene::Heap heap;
  follower.update(heap, 0.0);
  EXPECT_EQ(follower.x(), 0.0);
  heap.x = 20.0;
  heap.y = -3.0;
  for (int i = 1; i < 500; ++i) follower.update(heap, 0.02 * i);
  EXPECT_NEAR(follower.x(), 20.0, 1e-3);
  EXPECT_NEAR(follower.y(), -3.0, 1e-3);
}

TEST(RunHistory, KeepsEveryMomentWithinItsMemoryAndThinsOutBeyond) {
  const auto moment = [](int i) {
    simulation::Snapshot now{0.02 * i, {}, {}};
    now.cars.resize(100);
    return now;
  };
  const std::size_t one = 100 * sizeof(simulation::CarSnapshot);
  RunHistory history(50 * one);
  EXPECT_EQ(history.nearest(1.0), nullptr);
  for (int i = 0; i < 1000; ++i) {
    history.add(moment(i), {});
    ASSERT_LE(history.size() * one, 50 * one);
    ASSERT_EQ(history.until(), 0.02 * i) << "the newest is always there";
    ASSERT_EQ(history.nearest(0.0)->now.time, 0.0);
  }
  EXPECT_GT(history.size(), 20U);
  for (double t = 0.0; t < 20.0; t += 0.37) EXPECT_NEAR(history.nearest(t)->now.time, t, 0.5 * 0.02 * 32 + 1e-9) << t;
  double last = -1.0;
  for (double t = 0.0; t < 20.0; t += 0.01) {
    const double time = history.nearest(t)->now.time;
    EXPECT_GE(time, last);
    last = time;
  }
  history.clear();
  EXPECT_EQ(history.size(), 0U);
  RunHistory none(0);
  none.add(moment(0), {});
  EXPECT_EQ(none.nearest(0.0), nullptr);
}

/// Counts what it is sent.
struct CountingSink : MessageSink {
  explicit CountingSink(bool bag) : is_bag(bag) {}
  bool wants_markers() const override { return true; }
  bool is_read_from_the_middle() const override { return is_bag; }
  void receive(const AnyMessage& message) override {
    ++count[message.index()];
    if (message.index() == topic_number<MarkersTopic>()) markers = *std::get<topic_number<MarkersTopic>()>(message);
  }
  const bool is_bag;
  std::array<int, kTopicCount> count{};
  visualization_msgs::MarkerArray markers;  // the newest
};

TEST(RunStream, LookingBackIsNotWrittenToBags) {
  inputs::Scenario scenario;
  scenario.consist.emplace_back();
  scenario.consist[0].count = 3;
  scenario.consist[0].length = 18.0;
  scenario.consist[0].weight = 1.2e6;
  scenario.initial.speed = 16.0;
  scenario.initial.yaw_rate = 0.2;
  simulation::Simulation simulation(scenario);
  SimulationView view(simulation, 1.0e6);
  CountingSink bag(true), listener(false);
  StreamOptions options;
  options.history_bytes = 1U << 20;
  RunStream stream(options, {&bag, &listener});
  const auto go_to = [&](int point) {
    simulation.advance(point * scenario.output.interval);
    stream.grid_point(view);
  };
  stream.start_run(view, RunState());
  for (int point = 1; point <= 10; ++point) go_to(point);
  const auto recorded = bag.count, heard = listener.count;
  const RunHistory::Moment* moment = stream.history().nearest(0.1);
  ASSERT_TRUE(moment);
  stream.show(view, moment->now, *moment->outcome);
  EXPECT_EQ(bag.count, recorded);
  EXPECT_EQ(listener.count[topic_number<CarsTopic>()], heard[topic_number<CarsTopic>()] + 1);
  // Changes of the next point are those against the moment that was shown: the bag gets the whole scene.
  go_to(11);
  ASSERT_FALSE(bag.markers.markers.empty());
  EXPECT_EQ(bag.markers.markers.front().action, visualization_msgs::Marker::DELETEALL);
}

TEST(CommandQueue, AnswersWithdrawsAndCloses) {
  CommandQueue queue;
  bool ran = false;
  const Answer late = queue.call([&](const CommandQueue::TicketPtr&) { ran = true; }, std::chrono::milliseconds(20));
  EXPECT_FALSE(late.success);
  queue.execute();
  EXPECT_FALSE(ran) << "withdrawn work must not run";

  CommandQueue::TicketPtr kept;
  std::thread loop([&] {
    while (!kept) {
      queue.wait_until(WallClock::now() + std::chrono::seconds(10));
      queue.execute();
    }
    queue.answer(kept, {true, "later"});
    queue.answer(kept, {false, "too late"});
  });
  const Answer answer =
      queue.call([&](const CommandQueue::TicketPtr& ticket) { kept = ticket; }, std::chrono::seconds(10));
  loop.join();
  EXPECT_TRUE(answer.success);
  EXPECT_EQ(answer.message, "later");
  queue.close();
  EXPECT_FALSE(queue.call([](const CommandQueue::TicketPtr&) {}, std::chrono::seconds(10)).success);
}

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
