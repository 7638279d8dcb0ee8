// derail verify on trains in three dimensions, and what both programs make of their motions.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "command_line.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/multibody/verify.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

using multibody::Fault;

inputs::Scenario shipped() { return inputs::read_scenario_file(TRAIN_DERAIL_SOURCE_DIR "/config/verify3d.yaml"); }

/// The whole train of the scenario that is shipped, with a mistake in Simbody's forces.
multibody::PairOfRuns followed(Fault fault, double judged) {
  multibody::VerifyOptions options;
  options.fault = fault;
  return multibody::follow(shipped(), options, judged + 0.005, judged);
}

TEST(VerifyInSpace, FollowsTheShippedTrainAndSeesMistakes) {
  const multibody::PairOfRuns right = followed(Fault::none, 1.0);
  EXPECT_EQ(right.verdict, multibody::Verdict::agrees);
  EXPECT_NEAR(right.worst.time, 1.0, 1e-9) << "the limit is worth it all the time";
  EXPECT_LT(right.worst.position, 5e-5);
  EXPECT_GT(right.worst.force_peak, 1e5) << "couplers have been loaded";
  EXPECT_LT(right.force_share, 1e-3);
  EXPECT_EQ(right.purpose_built.cars_derailed, right.multibody.cars_derailed);
  const multibody::PairOfRuns wrong = followed(Fault::centre_below_rail, 0.3);
  EXPECT_EQ(wrong.verdict, multibody::Verdict::differs);
  EXPECT_GT(wrong.worst.position, 10.0 * wrong.worst.position_allowed);
}

// What both make of a motion, number by number: the same car, thrown down the bank until it lies.
TEST(VerifyInSpace, BothCountAlike) {
  inputs::Scenario s = shipped();
  s.consist[0].count = 1;
  s.initial.yaw_rate = 0.25;
  s.solver.fixed_step = 1e-4;
  s.stop.time_max = 30.0;
  simulation::Simulation model(s);
  multibody::Engine engine(s, {1e-6, false, Fault::none, 1e-4});
  model.run();
  engine.run();
  const outcome::Outcome a = model.outcome(), b = engine.outcome();
  EXPECT_EQ(a.ended, b.ended);
  EXPECT_EQ(a.posture.cars(), 1);
  for (const std::string& name : multibody::judged_quantities(inputs::Model::spatial)) {
    const double here = outcome::find_quantity(name)->value(a), there = outcome::find_quantity(name)->value(b);
    EXPECT_NEAR(there, here, 0.02 * std::abs(here)) << name;
  }
  EXPECT_TRUE(std::isnan(b.energy.kinetic_translation)) << "no ledger is kept";
}

class VerifyInSpaceCommand : public test::Folder {
 protected:
  test::Result verify(const std::string& arguments) { return test::derail("verify " + arguments); }
};

TEST_F(VerifyInSpaceCommand, VerifiesTheShippedScenario) {
  const std::string out = (folder_ / "v").string();
  const test::Result r =
      verify(TRAIN_DERAIL_SOURCE_DIR "/config/verify3d.yaml --runs 2 --set stop.time_max=1.0 --out " + out);
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("3 cars, the first 1.00 s, steps of 0.04 and 0.02 ms"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("cars on their side or over"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("Verdict: agrees, as far as judged"), std::string::npos) << r.out;
  const std::string rows = test::text_of(folder_ / "v" / "differences.csv");
  EXPECT_EQ(
      rows.rfind("cars,time_s,position_m,angle_rad,force_N,force_peak_N,position_allowed_m,angle_allowed_rad\n", 0),
      0U);
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 1 + 3 * 101);
}

// With all parts, and cars ahead of the broken rail: the short trains are of those that derail.
TEST_F(VerifyInSpaceCommand, VerifiesAnAccident) {
  const test::Result r =
      verify(TRAIN_DERAIL_SOURCE_DIR
             "/config/accident3d.yaml --set \"consist=[{name: locomotive, count: 2, length: 70 ft, weight: 420 kip}, "
             "{name: tank_car, count: 3, length: 55 ft, weight: 286 kip, brake_source: remote}]\" "
             "--set initial.cars_ahead=2 --set stop.time_max=0.5 --set solver.fixed_step=0.0005 --runs 2");
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("5 cars, the first 0.50 s"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("Verdict: agrees, as far as judged"), std::string::npos) << r.out;
  EXPECT_EQ(r.out.find("differs"), std::string::npos) << r.out;
}

TEST_F(VerifyInSpaceCommand, SaysWhatToLeaveOut) {
  const std::string file = TRAIN_DERAIL_SOURCE_DIR "/config/accidents/lac_megantic_2013.yaml";
  const test::Result r = verify(file + " --set model=spatial --set consist[1].shape=cylinder");
  EXPECT_EQ(r.code, 2) << r.out;
  for (const char* key : {"track.curves = '1 item'", "consist[1].shape = 'cylinder'"})
    EXPECT_NE(r.out.find(file + ": " + key), std::string::npos) << key << r.out;
}

}  // namespace
}  // namespace train_derail
