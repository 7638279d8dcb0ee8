// How cars lie at the end: by hand-made cars, in a run, and against tables of posture.
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "spatial_fixtures.hpp"
#include "train_derail/outcome/posture.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/validation/posture.hpp"
#include "validation_fixtures.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using outcome::Standing;
using validation::PostureCount;

constexpr double kDegree = inputs::kDegree;

Standing standing(double x, double tilt, double height = 2.6, double lowest = 1.0) {
  return {{Vector2d(x, 0.0), Vector2d(1.0, 0.0), 8.0, 1.5}, {tilt, height, lowest}};
}

TEST(Posture, CountsByTheAngle) {
  const outcome::Posture p =
      outcome::posture({standing(0, 0.0), standing(100, 9.9 * kDegree), standing(200, 10.1 * kDegree),
                        standing(300, 44.9 * kDegree), standing(400, 45.1 * kDegree), standing(500, 134.9 * kDegree),
                        standing(600, 135.1 * kDegree), standing(700, 180.0 * kDegree)});
  EXPECT_EQ(p.upright, 2);
  EXPECT_EQ(p.leaning, 2);
  EXPECT_EQ(p.on_side, 2);
  EXPECT_EQ(p.inverted, 2);
  EXPECT_EQ(p.over(), 4);
  EXPECT_EQ(p.cars(), 8);
  EXPECT_EQ(p.on_top, 0);
  EXPECT_EQ(p.drop_max, 0.0) << "nothing is below the rails";
}

TEST(Posture, ACarIsOnTopIfItIsAboveOneBelowIt) {
  EXPECT_EQ(outcome::posture({standing(0, 0.0), standing(10, 0.0, 4.2)}).on_top, 1);
  EXPECT_EQ(outcome::posture({standing(0, 0.0), standing(10, 0.0, 4.0)}).on_top, 0) << "not high enough";
  EXPECT_EQ(outcome::posture({standing(0, 0.0), standing(17, 0.0, 9.0)}).on_top, 0) << "beside it";
}

TEST(Posture, DropIsThatOfTheLowestPoint) {
  EXPECT_EQ(outcome::posture({standing(0, 0.0, 2.6, -0.5), standing(100, 1.0, 0.0, -2.5)}).drop_max, 2.5);
}

TEST(LateralReach, CountsCarsThatReachFar) {
  outcome::LateralReach all;
  for (const double reach : {3.0, 10.0, 10.1, 20.1, 30.1}) all.add(reach);
  EXPECT_EQ(all.farthest, 30.1);
  EXPECT_EQ(all.beyond_10, 3);
  EXPECT_EQ(all.beyond_20, 2);
  EXPECT_EQ(all.beyond_30, 1);
}

TEST(Attitude, OfACarOnItsSideIsThatOfItsBox) {
  const inputs::Scenario s = test::spatial(1);
  const model::SpatialModel model(s);
  const model::Car& car = model.cars()[0];
  model::StateVector y = model.initial_state();
  // Turned to its left side, one metre up: the middle of the body is to the left of the centre of mass or to its right
  // by how much it was above it.
  const double above = 0.5 * (car.floor_height + car.roof_height) - car.centre_height;
  model.place(y.data(), 0, test::at({40.0, 5.0, 1.0}, test::turned(-90.0 * kDegree, Vector3d::UnitX())));
  const auto attitude = model.attitude(y.data(), 0);
  ASSERT_TRUE(attitude);
  EXPECT_NEAR(attitude->tilt, 90.0 * kDegree, 1e-12);
  EXPECT_NEAR(attitude->height, 1.0, 1e-12);
  EXPECT_NEAR(attitude->lowest, 1.0 - 0.5 * car.width, 1e-12);
  const model::Footprint f = model.footprint(y.data(), 0);
  EXPECT_NEAR(f.centre.y(), 5.0 + above, 1e-12) << "its roof points to the left";
  EXPECT_NEAR(f.half_width, 0.5 * (car.roof_height - car.floor_height), 1e-12);
  EXPECT_NEAR(f.half_length, 0.5 * car.length, 1e-12);
}

TEST(Attitude, LooksForTheLowestPointAboveTheRailsBesideIt) {
  // On a grade a car on its side lies as low as on the level; the lowest part of one that stands is its underframe.
  inputs::Scenario s = test::spatial(1);
  s.consist[0].name = "hopper";
  for (const double grade : {0.0, 0.02, -0.04}) {
    s.track.grades.clear();
    if (grade != 0.0) s.track.grades = {{-2000.0, 4000.0, grade}};
    const model::SpatialModel model(s);
    const model::Car& car = model.cars()[0];
    ASSERT_LT(car.underframe_height, car.floor_height);
    model::StateVector y = model.initial_state();
    const Matrix3d uphill = test::turned(-std::atan(grade), Vector3d::UnitY());
    const Vector3d rails(-300.0, 0.0, -300.0 * grade);
    model.place(y.data(), 0, test::at(rails + uphill * Vector3d(0.0, 0.0, car.centre_height), uphill));
    EXPECT_NEAR(model.attitude(y.data(), 0)->lowest, car.underframe_height, 1e-3) << grade;
    const Matrix3d on_side = uphill * test::turned(-90.0 * kDegree, Vector3d::UnitX());
    model.place(y.data(), 0, test::at(rails + uphill * Vector3d(0.0, 0.0, 1.0), on_side));
    EXPECT_NEAR(model.attitude(y.data(), 0)->lowest, 1.0 - 0.5 * car.width, 1e-3) << grade;
    EXPECT_NEAR(model.attitude(y.data(), 0)->height, 1.0, 1e-3) << grade;
  }
}

TEST(Attitude, IsNotKnownInThePlane) {
  const model::ExtendedModel model(test::on_rails(1));
  const model::StateVector y = model.initial_state();
  EXPECT_FALSE(model.attitude(y.data(), 0));
}

TEST(LateralReach, IsThatOfTheFarthestCorner) {
  inputs::Scenario s = test::on_rails(1);
  simulation::Simulation upright(s);
  EXPECT_NEAR(upright.snapshot().cars.at(0).lateral_reach, 0.5 * s.consist[0].width, 1e-9);
  EXPECT_EQ(upright.snapshot().cars.at(0).tilt(), 0.0);
}

TEST(Tilt, IsTheAngleOfTheCarsOwnVertical) {
  simulation::CarSnapshot car;
  for (const double angle : {0.0, 0.3, 1.5, 3.0}) {
    const Eigen::Quaterniond turn = Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) *
                                    Eigen::AngleAxisd(angle, Vector3d(1.0, 2.0, 0.0).normalized()) *
                                    Eigen::AngleAxisd(-1.1, Vector3d::UnitZ());
    car.qx = turn.x();
    car.qy = turn.y();
    car.qz = turn.z();
    car.qw = turn.w();
    EXPECT_NEAR(car.tilt(), angle, 1e-7);
  }
}

TEST(PostureShares, AreOfCarsAndOfAccidents) {
  const validation::PostureShares s =
      validation::shares({{5.0, 10, 0}, {5.0, 10, 10}, {5.0, 5, 2}, {5.0, 4, 4}});  // the last one is too small
  EXPECT_EQ(s.count, 3U);
  EXPECT_DOUBLE_EQ(s.over, 12.0 / 25.0);
  EXPECT_DOUBLE_EQ(s.none_over, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(s.all_over, 1.0 / 3.0);
  EXPECT_NEAR(s.sd, std::sqrt((0.4667 * 0.4667 + 0.5333 * 0.5333 + 0.0667 * 0.0667) / 2.0), 1e-3);
}

TEST(PostureShares, BandsEndWithTheirUpperSpeed) {
  const std::vector<PostureCount> real{{10.0, 10, 1}, {11.0, 10, 2}, {40.0, 10, 3}, {55.0, 10, 4}};
  const auto bands = validation::by_band(real, {{10.0, 10, 5}});
  ASSERT_EQ(bands.size(), 5U);
  EXPECT_DOUBLE_EQ(bands[0].real.over, 0.1);
  EXPECT_DOUBLE_EQ(bands[0].predicted.over, 0.5);
  EXPECT_DOUBLE_EQ(bands[1].real.over, 0.2);
  EXPECT_TRUE(std::isnan(bands[1].predicted.over));
  EXPECT_EQ(bands[2].to, 40.0);
  EXPECT_EQ(bands[3].from, 40.0);
  EXPECT_EQ(bands[4].real.count, 4U);
  EXPECT_NE(validation::to_table(bands).find("11-20"), std::string::npos);
  EXPECT_NE(validation::to_table(bands).find("> 40"), std::string::npos);
}

class PostureTable : public test::Validate {
 protected:
  static std::string rows(const std::string& all) {
    return "date,speed_mph,cars_in_train,cars_derailed_narrative,loads_derailed_form,empties_derailed_form,"
           "on_side_or_over,cause\n" +
           all;
  }
};

TEST_F(PostureTable, SaysWhatItAssumes) {
  const validation::AccidentTable t = table(rows("2002-01-30,10,61,8,6,2,3,T202\n"));
  ASSERT_EQ(t.rows.size(), 1U);
  const validation::Accident& a = t.rows[0];
  EXPECT_EQ(a.n_cars, 61);
  EXPECT_EQ(a.cars_derailed, 8);
  EXPECT_EQ(a.over, 3);
  EXPECT_NEAR(a.tons_per_car, (6 * 131.5 + 2 * 32.5) / 8, 1e-12);
  EXPECT_EQ(a.first_car_position - 1 + a.cars_from_pod_to_rear, a.n_cars);
  ASSERT_EQ(t.notes.size(), 1U);
  EXPECT_NE(t.notes[0].text.find("assumed"), std::string::npos);
}

TEST_F(PostureTable, MistakesNameColumnValueAndRange) {
  EXPECT_NE(refusal(rows("d,10,61,8,6,2,9,T\n")).find("on_side_or_over = '9': out of range"), std::string::npos)
      << refusal(rows("d,10,61,8,6,2,9,T\n"));
  EXPECT_NE(refusal(rows("d,10,6,8,6,2,3,T\n")).find("cars_derailed_narrative"), std::string::npos);
  EXPECT_NE(refusal(rows("d,nan,61,8,6,2,3,T\n")).find("speed_mph"), std::string::npos);
  EXPECT_NE(refusal("speed_mph,on_side_or_over\n1,1\n").find("cars_in_train"), std::string::npos);
}

TEST_F(PostureTable, IsScoredInSpaceAndNotInThePlane) {
  write("table.csv", rows("2002-01-30,25,12,8,8,0,3,T202\n2002-02-01,25,12,8,8,0,8,M105\n"));
  const test::Result plane = derail("validate table.csv --study study.yaml --out plane");
  EXPECT_EQ(plane.code, 0) << plane.out;
  EXPECT_EQ(plane.out.find("on their side"), std::string::npos);
  const test::Result space =
      derail("validate table.csv --study study.yaml --set model=spatial --set stop.time_max=6 --out space");
  EXPECT_EQ(space.code, 0) << space.out;
  EXPECT_NE(space.out.find("on their side or over"), std::string::npos) << space.out;
  const auto json = nlohmann::json::parse(test::text_of(folder_ / "space" / "validation.json"));
  ASSERT_TRUE(json.contains("posture"));
  const auto& band = json["posture"].at(0);
  EXPECT_EQ(band["from_mph"], 20.0);
  EXPECT_EQ(band["real"]["count"], 1) << "wind is left out";
  EXPECT_NEAR(band["real"]["over"].get<double>(), 3.0 / 8.0, 1e-12);
  // What the journal gives back is what the run has given.
  const test::Result again =
      derail("validate table.csv --study study.yaml --set model=spatial --set stop.time_max=6 --out space --resume");
  EXPECT_EQ(again.code, 0) << again.out;
  EXPECT_EQ(nlohmann::json::parse(test::text_of(folder_ / "space" / "validation.json"))["posture"], json["posture"]);
}

TEST_F(PostureTable, AValidationOfWhichEveryRunFailedDoesNotEndWell) {
  const test::Result r =
      derail("validate table.csv --study study.yaml --set solver.wall_time_max=1e-9 --out failed --quiet");
  EXPECT_EQ(r.code, 3) << r.out;
  EXPECT_NE(r.out.find("9 of 9 runs failed"), std::string::npos) << r.out;
}

}  // namespace
}  // namespace train_derail
