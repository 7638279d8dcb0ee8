// The extended model under the node: what the messages say of derailments, broken couplers and impacts is what the
// simulation has noted.
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include <visualization_msgs/MarkerArray.h>

#include "marker_check.hpp"
#include "node_client.hpp"
#include "train_derail/Event.h"
#include "train_derail/Impacts.h"
#include "train_derail/Inputs.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::test {
namespace {

/// One whole run, recorded once for all tests, and the same run in this process.
class Accident : public RecordedOnce<Accident> {
 public:
  static void record() {
    const NodeClient node("/train_derail");
    cars = new Record<CarStates>("/train_derail/cars");
    couplers = new Record<CouplerForces>("/train_derail/couplers");
    markers = new Record<visualization_msgs::MarkerArray>("/train_derail/markers");
    events = new Record<Event>("/train_derail/events");
    impacts = new Record<Impacts>("/train_derail/impacts");
    outcome = new Record<Outcome>("/train_derail/outcome");
    const Record<Inputs> inputs("/train_derail/inputs");
    ASSERT_TRUE(node.wait_until_up());
    ASSERT_TRUE(wait_for([&] {
      return !cars->empty() && !couplers->empty() && !markers->empty() && !impacts->empty() && !outcome->empty() &&
             !inputs.empty() && events->connected();
    }));
    // A new run after all are connected: the first car derails at its first point.
    ASSERT_TRUE(node.restart({}, false).success);
    ASSERT_TRUE(
        wait_for([] { return outcome->last().run_id == 2 && outcome->last().ended != Outcome::RUNNING; }, 60.0));
    const ros::Time end = outcome->last().header.stamp;
    ASSERT_TRUE(wait_for([&] {
      return cars->last().header.stamp == end && couplers->last().header.stamp == end &&
             events->last().type == Event::END;
    })) << "streams do not reach the end of the run";
    forget_first_run(cars->messages);
    forget_first_run(couplers->messages);
    forget_first_run(events->messages);
    forget_first_run(impacts->messages);
    scenario = new inputs::Scenario(inputs::read_scenario(YAML::Load(inputs.last().yaml), "~inputs"));
    simulation = new simulation::Simulation(*scenario);
    simulation->run();
    // Its last message may still be under way.
    ASSERT_TRUE(wait_for([] {
      const auto& seen = impacts->last().impacts;
      const auto& noted = simulation->incidents().impacts;
      const auto over = [](const Impact& a, const model::Impact& e) { return a.end == e.end; };
      return std::equal(seen.begin(), seen.end(), noted.begin(), noted.end(), over);
    }));
  }

  template <class Message>
  static void forget_first_run(std::vector<Message>& messages) {
    messages.erase(messages.begin(),
                   std::find_if(messages.begin(), messages.end(), [](const Message& m) { return m.run_id == 2; }));
  }

  static inline Record<CarStates>* cars = nullptr;
  static inline Record<CouplerForces>* couplers = nullptr;
  static inline Record<visualization_msgs::MarkerArray>* markers = nullptr;
  static inline Record<Event>* events = nullptr;
  static inline Record<Impacts>* impacts = nullptr;
  static inline Record<Outcome>* outcome = nullptr;
  static inline inputs::Scenario* scenario = nullptr;
  static inline simulation::Simulation* simulation = nullptr;  // at the end
};

TEST_F(Accident, StatesForcesAndCausesEqualASimulationInThisProcess) {
  expect_equal_to_simulation(cars->messages, couplers->messages, *scenario);
  std::set<int> causes;
  for (const CarState& car : cars->last().cars) {
    EXPECT_EQ(car.derailed, car.cause != CarState::NONE) << "car " << car.number;
    causes.insert(car.cause);
  }
  EXPECT_EQ(causes, (std::set<int>{CarState::NONE, CarState::POD, CarState::LATERAL, CarState::TORN_TRACK}));
}

TEST_F(Accident, ImpactsAreThoseThatTheModelNoted) {
  const std::vector<model::Impact>& expected = simulation->incidents().impacts;
  const Impacts& m = impacts->last();
  ASSERT_GT(expected.size(), 5U);
  ASSERT_EQ(m.impacts.size(), expected.size());
  const std::map<model::Face, int> faces{{model::Face::front, Impact::FRONT},
                                         {model::Face::rear, Impact::REAR},
                                         {model::Face::left, Impact::LEFT},
                                         {model::Face::right, Impact::RIGHT}};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Impact& a = m.impacts[i];
    const model::Impact& e = expected[i];
    EXPECT_TRUE(a.time == e.time && a.end == e.end && a.x == e.x && a.y == e.y && a.z == e.z) << i;
    EXPECT_TRUE(a.car_a == e.car_a + 1 && a.car_b == e.car_b + 1) << i;
    EXPECT_TRUE(a.face_a == faces.at(e.face_a) && a.face_b == faces.at(e.face_b)) << i;
    EXPECT_TRUE(a.along_a == e.along_a && a.along_b == e.along_b) << i;
    EXPECT_TRUE(a.closing_speed == e.closing_speed && a.closing_speed_normal == e.closing_speed_normal) << i;
    EXPECT_TRUE(a.impulse == e.impulse && a.peak_force == e.peak_force) << i;
  }
}

TEST_F(Accident, HistogramHoldsEveryImpactOnce) {
  for (const Impacts& m : impacts->messages) {
    EXPECT_EQ(std::accumulate(m.counts.begin(), m.counts.end(), 0U), m.impacts.size());
    if (m.impacts.empty()) continue;
    ASSERT_EQ(m.bin_edges.size(), m.counts.size() + 1);
    EXPECT_GT(m.counts.back(), 0U) << "up to the fastest";
    for (std::size_t bin = 0; bin < m.counts.size(); ++bin) {
      const auto in_bin = [&](const Impact& i) {
        return i.closing_speed_normal < m.bin_edges[bin + 1] &&
               (bin == 0 || i.closing_speed_normal >= m.bin_edges[bin]);
      };
      EXPECT_EQ(m.counts[bin], std::count_if(m.impacts.begin(), m.impacts.end(), in_bin)) << "bin " << bin;
    }
  }
}

TEST_F(Accident, BrokenCouplersAreMarkedAndCarryNothing) {
  std::set<std::uint32_t> broken, expected;
  for (const model::BrokenCoupler& b : simulation->incidents().broken) {
    expected.insert(static_cast<std::uint32_t>(b.coupler) + 1);
  }
  for (const CouplerForce& c : couplers->last().couplers) {
    if (!c.broken) continue;
    broken.insert(c.number);
    EXPECT_EQ(c.axial_force, 0.0) << c.number;
    EXPECT_EQ(c.moment_lead, 0.0) << c.number;
  }
  ASSERT_FALSE(expected.empty());
  EXPECT_EQ(broken, expected);
  EXPECT_EQ(outcome->last().couplers_broken, expected.size());

  // The last changes may still be under way.
  Shown shown;
  const auto all_there = [&] {
    shown = {};
    for (const auto& array : markers->messages) shown.receive(array);
    return std::all_of(cars->last().cars.begin(), cars->last().cars.end(), [&](const CarState& car) {
      const scene::Look look =
          scene::look_of(true, car.past_pod != 0, car.off_track != 0, static_cast<model::Cause>(car.cause));
      const visualization_msgs::Marker* body = shown.find("cars", static_cast<int>(car.number));
      return body != nullptr && std::abs(body->color.r - scene::facts_of(look).colour.r / 255.0) < 1e-6;
    });
  };
  EXPECT_TRUE(wait_for(all_there));
  for (std::size_t i = 0; i < couplers->last().couplers.size(); ++i) {
    if (!couplers->last().couplers[i].broken) continue;
    EXPECT_FALSE(shown.find("couplers_rear", static_cast<int>(i) + 1)) << i;
    EXPECT_FALSE(shown.find("couplers_front", static_cast<int>(i) + 2)) << i;
  }
  std::set<scene::Look> looks;
  for (const CarState& car : cars->last().cars) {
    const scene::Look look =
        scene::look_of(true, car.past_pod != 0, car.off_track != 0, static_cast<model::Cause>(car.cause));
    const visualization_msgs::Marker* body = shown.find("cars", static_cast<int>(car.number));
    ASSERT_TRUE(body) << car.number;
    EXPECT_NEAR(body->color.r, scene::facts_of(look).colour.r / 255.0, 1e-6) << car.number;
    EXPECT_NEAR(body->color.b, scene::facts_of(look).colour.b / 255.0, 1e-6) << car.number;
    looks.insert(look);
  }
  EXPECT_EQ(looks.size(), 4U) << "on the track, and derailed in three ways";
}

TEST_F(Accident, OutcomeIsThatOfTheSimulation) {
  const outcome::Outcome e = simulation->outcome();
  const Outcome& m = outcome->last();
  EXPECT_EQ(m.ended, Outcome::AT_REST);
  EXPECT_EQ(m.cars, 24U);
  EXPECT_EQ(m.cars_derailed, static_cast<unsigned>(e.cars_derailed));
  EXPECT_EQ(m.derailed_by_pod, static_cast<unsigned>(e.derailed_by.pod));
  EXPECT_EQ(m.derailed_by_lateral, static_cast<unsigned>(e.derailed_by.lateral));
  EXPECT_EQ(m.derailed_by_torn_track, static_cast<unsigned>(e.derailed_by.torn_track));
  EXPECT_EQ(m.cars_derailed, m.derailed_by_pod + m.derailed_by_lateral + m.derailed_by_torn_track);
  EXPECT_GT(m.impacts, 0U);
  EXPECT_EQ(m.impacts, static_cast<unsigned>(e.impacts.count));
  EXPECT_EQ(m.impact_speed_max, e.impacts.closing_speed_normal_max);
  EXPECT_EQ(m.impact_force_peak, e.impacts.peak_force);
  EXPECT_EQ(m.impact_impulse_max, e.impacts.impulse_max);
  EXPECT_GT(m.blockage_force, 0.0);
  EXPECT_EQ(m.blockage_force, e.blockage_force);
  EXPECT_GT(m.pile_up_area, 0.0);
  EXPECT_EQ(m.pile_up_area, e.pile_up.area);
  EXPECT_EQ(m.cars_across, static_cast<unsigned>(e.pile_up.cars_across));
  EXPECT_EQ(m.groups, static_cast<unsigned>(e.pile_up.groups));
  EXPECT_EQ(m.main_pile_cars, static_cast<unsigned>(e.pile_up.main_cars));
  EXPECT_EQ(m.main_pile_length, e.pile_up.main_length);
  EXPECT_GT(m.work_impact_normal, 0.0);
  EXPECT_GT(m.work_coupler_break, 0.0);
  const double sum = m.energy_kinetic_translation + m.energy_kinetic_rotation + m.energy_coupler_axial +
                     m.energy_coupler_swing + m.work_on_track + m.work_off_track + m.work_rails +
                     m.work_coupler_damping + m.work_coupler_break + m.work_impact_normal + m.work_impact_friction +
                     m.work_grade + m.work_kicks;
  EXPECT_NEAR(std::abs(sum - m.energy_initial) / m.energy_initial, m.energy_residual, 1e-12) << "nothing is left out";
}

TEST_F(Accident, EventsSayEachDerailmentAndEachBrokenCouplerOnce) {
  std::map<std::uint32_t, std::string> derailed, broken;
  for (const Event& e : events->messages) {
    if (e.type == Event::CAR_DERAILED) {
      EXPECT_TRUE(derailed.emplace(e.car, e.text).second) << e.text;
    }
    if (e.type == Event::COUPLER_BROKEN) {
      EXPECT_TRUE(broken.emplace(e.coupler, e.text).second) << e.text;
    }
  }
  EXPECT_EQ(derailed.size(), outcome->last().cars_derailed);
  EXPECT_EQ(broken.size(), outcome->last().couplers_broken);
  const std::map<int, std::string> words{
      {CarState::POD, "point"}, {CarState::LATERAL, "lateral"}, {CarState::TORN_TRACK, "torn"}};
  for (const CarState& car : cars->last().cars) {
    if (!car.derailed) continue;
    EXPECT_NE(derailed[car.number].find(words.at(car.cause)), std::string::npos) << derailed[car.number];
  }
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_accident");
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
