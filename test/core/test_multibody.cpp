// The second opinion: the multibody engine against closed forms and against the model, mistakes that it has to notice,
// the limit of rigid couplers, and the statistics of the verdict.
#include <dlfcn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "fixtures.hpp"
#include "folder.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/multibody/two_sample.hpp"
#include "train_derail/multibody/verify.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/study/runner.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;

using inputs::OnTrackLaw;
using multibody::Engine;
using multibody::Fault;
using multibody::Verdict;

const auto kQuietly = [](double, const std::string&) {};

TEST(TwoSample, SmallSamplesHaveTheirExactProbabilities) {
  // Two samples of three apart: 2 of the 20 ways to deal six values.
  const multibody::TwoSample apart = multibody::compare({1, 2, 3}, {4, 5, 6});
  EXPECT_DOUBLE_EQ(apart.distance, 1.0);
  EXPECT_DOUBLE_EQ(apart.precedence, 1.0);
  EXPECT_NEAR(apart.p_distance, 0.1, 0.004);
  EXPECT_NEAR(apart.p_precedence, 0.1, 0.004);
  // 1 2 | 2 3: of the six ways to deal 1, 2, 2, 3 only {1, 3} and {2, 2} are more even.
  const multibody::TwoSample tied = multibody::compare({1, 2}, {2, 3});
  EXPECT_DOUBLE_EQ(tied.distance, 0.5);
  EXPECT_DOUBLE_EQ(tied.precedence, 0.875);
  EXPECT_NEAR(tied.p_precedence, 4.0 / 6.0, 0.006);
  const multibody::TwoSample same = multibody::compare({7, 7, 7}, {7, 7});
  EXPECT_DOUBLE_EQ(same.p_distance, 1.0);
  EXPECT_DOUBLE_EQ(same.p_precedence, 1.0);
}

TEST(TwoSample, FindsAShiftAndASpreadAndHasFewFalseAlarms) {
  test::Random random(5);
  const auto normal = [&] {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += random.uniform(0.0, 1.0);
    return sum;
  };
  const auto sample = [&](double mean, double sd) {
    std::vector<double> x(40);
    for (double& v : x) v = mean + sd * normal();
    return x;
  };
  EXPECT_LT(multibody::compare(sample(0, 1), sample(1.5, 1), 9999).p_precedence, 0.001);
  EXPECT_LT(multibody::compare(sample(0, 1), sample(0, 8), 9999).p_distance, 0.01) << "the same median, another spread";
  int alarms = 0;
  for (int i = 0; i < 200; ++i)
    alarms += multibody::compare(sample(0, 1), sample(0, 1), 499).p_precedence <= 0.05 ? 1 : 0;
  EXPECT_GE(alarms, 2);
  EXPECT_LE(alarms, 22);  // 10 expected, sd 3.1
}

TEST(TwoSample, CorrectionAndPower) {
  const std::vector<double> adjusted = multibody::holm({0.04, 0.01, 0.03, 0.5});
  EXPECT_DOUBLE_EQ(adjusted[0], 0.09);  // not below that of the smaller one before it
  EXPECT_DOUBLE_EQ(adjusted[1], 0.04);
  EXPECT_DOUBLE_EQ(adjusted[2], 0.09);
  EXPECT_DOUBLE_EQ(adjusted[3], 0.5);
  // Two-sided 5 %, 80 %: d = 0.5 needs 66 a group (the t test's 64, over the efficiency 0.955).
  EXPECT_NEAR(multibody::detectable_shift(66, 0.05, 0.8), 0.5, 0.01);
  EXPECT_TRUE(std::isinf(multibody::detectable_shift(4, 0.001, 0.8)));
  const multibody::MeanDifference d = multibody::mean_difference({1, 2, 3}, {3, 4, 5}, 0.95);
  EXPECT_DOUBLE_EQ(d.value, 2.0);
  EXPECT_NEAR(d.half_width, 2.776 * std::sqrt(2.0 / 3.0), 0.001);  // t of 4 degrees of freedom
  const std::vector<double> equal(40, 0.2);
  EXPECT_EQ(multibody::mean_difference(equal, equal, 0.95).half_width, 0.0);
  EXPECT_EQ(multibody::pooled_deviation(equal, equal), 0.0);
}

TEST(MultibodyEngine, ALoneCarSlidesAsFarAsTheClosedFormSays) {
  inputs::Scenario s = test::baseline(1);
  s.initial.yaw_rate = 0.0;
  Engine engine(s, {1e-9});
  engine.run();
  const double a = s.ground.off_track_friction * inputs::kStandardGravity, e = s.ground.regularization_speed;
  const multibody::BodyMotion end = engine.cars()[0];
  EXPECT_NEAR(end.centre.x(),
              (test::slide_distance(s.initial.speed, e) - test::slide_distance(end.velocity.x(), e)) / a, 1e-6);
  EXPECT_NEAR(engine.time(), (test::slide_time(s.initial.speed, e) - test::slide_time(end.velocity.x(), e)) / a, 1e-6);
  const outcome::Outcome o = engine.outcome();
  EXPECT_EQ(o.ended, outcome::Ended::at_rest);
  EXPECT_EQ(o.cars_past_pod, 1);
  EXPECT_LT(o.energy_residual, 1e-7);
}

// Simbody's library exports functions of an old SUNDIALS under the same names; the order of linking decides who is
// called.
TEST(MultibodyEngine, LeavesTheModelsIntegratorsTheirSundials) {
  Dl_info found{};
  void* function = dlsym(RTLD_DEFAULT, "N_VDestroy_Serial");
  ASSERT_NE(function, nullptr);
  ASSERT_NE(dladdr(function, &found), 0);
  EXPECT_NE(std::string(found.dli_fname).find("libsundials"), std::string::npos) << found.dli_fname;
}

TEST(MultibodyEngine, FollowsTheScenarioAndSaysWhyItStops) {
  inputs::Scenario s = test::mixed_train();
  s.initial.perturbation = {0.01, 0.1, 7};
  Engine engine(s), again(s);
  const std::vector<multibody::BodyMotion> cars = engine.cars();
  ASSERT_EQ(cars.size(), 7U);
  const double pitch[] = {18.0, 16.0, 14.0, 14.0, 12.0, 10.0};
  double x = 0.0;
  for (std::size_t k = 0; k < 7; ++k) {
    if (k > 0) {
      x -= pitch[k - 1] + s.coupler.length;
      EXPECT_LT(cars[k].centre.x(), x);
      EXPECT_GT(cars[k].centre.x(), x - 0.05);
    }
    EXPECT_EQ(cars[k].centre.x(), again.cars()[k].centre.x()) << "one seed, one start";
  }
  EXPECT_NE(cars[0].rotation.z(), s.initial.yaw_rate);
  EXPECT_NEAR(cars[0].rotation.z(), s.initial.yaw_rate, 0.5 * s.initial.yaw_rate);
  s.solver.steps_max = 5;
  Engine short_of_steps(s);
  short_of_steps.run();
  EXPECT_EQ(short_of_steps.outcome().ended, outcome::Ended::integration_failed);
  EXPECT_NE(short_of_steps.outcome().message.find("solver.steps_max = 5"), std::string::npos);
  s.solver.steps_max = 1000000;
  s.stop.time_max = 0.05;
  Engine short_of_time(s);
  short_of_time.run();
  EXPECT_EQ(short_of_time.outcome().ended, outcome::Ended::time_max);
  EXPECT_DOUBLE_EQ(short_of_time.time(), 0.05);
}

multibody::VerifyOptions quick() {
  multibody::VerifyOptions options;
  options.runs = 1;
  options.jobs = 2;
  options.follow = 0.6;
  return options;
}

class Readings : public testing::TestWithParam<OnTrackLaw> {};

TEST_P(Readings, TheTwoEnginesMoveAMixedTrainAlike) {
  inputs::Scenario s = test::mixed_train();
  s.ground.on_track_law = GetParam();
  s.coupler.swing_moment_max = 1.5e4;
  const multibody::PairOfRuns pair = multibody::follow(s, quick(), 1.5, 1.45);
  EXPECT_EQ(pair.verdict, Verdict::agrees);
  EXPECT_LT(pair.worst.position, 1e-5);
  EXPECT_LT(pair.force_share, 1e-3);
  EXPECT_GT(pair.worst.force_peak, 1e5) << "couplers have been loaded";
  EXPECT_GT(pair.purpose_built.cars_past_pod, 1) << "a second car has passed the point of derailment";
  EXPECT_NEAR(pair.multibody.energy.work_on_track, pair.purpose_built.energy.work_on_track,
              1e-5 * pair.multibody.energy_initial);
  EXPECT_NEAR(pair.multibody.energy.work_off_track, pair.purpose_built.energy.work_off_track,
              1e-5 * pair.multibody.energy_initial);
  EXPECT_NEAR(pair.multibody.energy.coupler_swing, pair.purpose_built.energy.coupler_swing,
              1e-6 * pair.multibody.energy_initial);
  EXPECT_LT(pair.multibody.energy_residual, 1e-6);
  EXPECT_TRUE(pair.counts_equal);
  for (const outcome::Quantity& q : outcome::quantities()) {  // a new one has to be observed by both
    if (q.name == "energy_residual") continue;
    const double a = q.value(pair.purpose_built), b = q.value(pair.multibody);
    EXPECT_NEAR(a, b, 1e-3 * std::abs(a)) << q.name;
  }
  EXPECT_GT(pair.purpose_built.centre_speed_max.speed, 0.0);
  EXPECT_EQ(pair.multibody.centre_speed_max.coupler, pair.purpose_built.centre_speed_max.coupler);
}

INSTANTIATE_TEST_SUITE_P(OnTrackLaws, Readings,
                         testing::Values(OnTrackLaw::isotropic, OnTrackLaw::along_track, OnTrackLaw::guided),
                         testing::PrintToStringParamName());

inputs::Scenario four_cars() {
  inputs::Scenario s = test::baseline(4);
  s.stop.time_max = 2.0;
  return s;
}

TEST(Verify, AgreesOnAShortTrainAndJudgesNoSingleRuns) {
  const multibody::Verification v = multibody::verify(four_cars(), quick(), kQuietly);
  EXPECT_EQ(v.early.verdict, Verdict::agrees);
  ASSERT_EQ(v.short_trains.size(), 3U);
  for (const multibody::PairOfRuns& pair : v.short_trains) {
    EXPECT_EQ(pair.verdict, Verdict::agrees) << pair.cars;
    EXPECT_EQ(pair.purpose_built.touches, pair.multibody.touches);
  }
  EXPECT_EQ(v.ensemble.verdict, Verdict::not_judged);
  EXPECT_EQ(v.verdict(), Verdict::agrees);
  EXPECT_NE(multibody::to_table(v).find("not judged: 1 runs of each are too few"), std::string::npos);
}

const char* name_of(Fault fault) {
  constexpr std::array kNames{"none",           "lateral_force_sign", "coupler_arm",
                              "no_front_truck", "friction_swapped",   "yaw_inertia"};
  return kNames[static_cast<std::size_t>(fault)];
}

/// The time that is judged point by point, of six cars, with a mistake in the multibody engine.
multibody::PairOfRuns first_moments(Fault fault) {
  multibody::VerifyOptions options = quick();
  options.fault = fault;
  const multibody::PairOfRuns pair = multibody::follow(test::baseline(6), options, 0.4, options.criteria.early);
  std::printf("%s: %.1e m apart, force %.1e of the largest\n", name_of(fault), pair.worst.position, pair.force_share);
  return pair;
}

TEST(Verify, AgreesPointByPointWithoutAMistake) { EXPECT_EQ(first_moments(Fault::none).verdict, Verdict::agrees); }

class Faults : public testing::TestWithParam<Fault> {};

TEST_P(Faults, AreSeenPointByPoint) {
  EXPECT_EQ(first_moments(GetParam()).verdict, Verdict::differs);
  multibody::VerifyOptions options = quick();
  options.fault = GetParam();
  EXPECT_EQ(multibody::verify(four_cars(), options, kQuietly).verdict(), Verdict::differs);
}

INSTANTIATE_TEST_SUITE_P(Seeded, Faults,
                         testing::Values(Fault::lateral_force_sign, Fault::coupler_arm, Fault::no_front_truck,
                                         Fault::friction_swapped, Fault::yaw_inertia),
                         [](const auto& fault) { return std::string(name_of(fault.param)); });

TEST(Verify, EnsemblesOfEqualEnginesAgreeAndOfUnequalOnesDiffer) {
  multibody::VerifyOptions options = quick();
  options.runs = 12;
  inputs::Scenario s = four_cars();
  s.stop.time_max = 1.5;
  const multibody::Ensemble same = multibody::compare_ensembles(s, options, kQuietly);
  EXPECT_EQ(same.verdict, Verdict::agrees);
  options.fault = Fault::no_front_truck;
  EXPECT_EQ(multibody::compare_ensembles(s, options, kQuietly).verdict, Verdict::differs);
  options.fault = Fault::none;
  s.solver.steps_max = 20;
  const multibody::Ensemble failing = multibody::compare_ensembles(s, options, kQuietly);
  EXPECT_EQ(failing.failed, 24);
  EXPECT_EQ(failing.verdict, Verdict::differs);
}

// Couplers as constraints, as in the model of Queen's University: springs without slack tend to rods like 1/K.
TEST(RigidCouplers, SpringsTendToRodsAsTheyGrowStiff) {
  inputs::Scenario s = test::baseline(3);
  s.coupler.slack = 0.0;
  s.initial.yaw_rate = 0.3;
  test::set_tolerance(s, 1e-11);
  const double end = 1.0;
  Engine rigid(s, {1e-11, true});
  rigid.advance(end);
  const std::vector<multibody::BodyMotion> limit = rigid.cars();
  for (std::size_t k = 0; k + 1 < limit.size(); ++k) {
    const double half = 0.5 * s.consist[0].length;
    const Eigen::Vector3d pins =
        limit[k].centre - half * limit[k].axes.col(0) - limit[k + 1].centre - half * limit[k + 1].axes.col(0);
    EXPECT_NEAR(pins.norm(), s.coupler.length, 1e-6);
  }
  EXPECT_GT(std::abs(rigid.coupler_forces()[0].axial), 1e4);
  std::vector<double> distance;
  for (const double stiffness : {1e8, 1e9, 1e10}) {
    s.coupler.stiffness = stiffness;
    simulation::Simulation springs(s);
    springs.advance(end);
    const simulation::Snapshot shot = springs.snapshot();
    double worst = 0.0;
    for (std::size_t k = 0; k < limit.size(); ++k)
      worst = std::max(worst, std::hypot(shot.cars[k].x - limit[k].centre.x(), shot.cars[k].y - limit[k].centre.y()));
    distance.push_back(worst);
    std::printf("K = %.0e N/m: %.3e m from the rods\n", stiffness, worst);
  }
  EXPECT_LT(distance.back(), 1e-4);
  for (std::size_t i = 1; i < distance.size(); ++i) EXPECT_NEAR(std::log10(distance[i - 1] / distance[i]), 1.0, 0.2);
}

class VerifyCommand : public test::Folder {
 protected:
  void SetUp() override {
    std::ofstream(folder_ / "train.yaml") << "consist:\n  - {count: 2, length: 61.1 ft, weight: 150 kip}\n"
                                             "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 0.8 s}\n";
    std::ofstream(folder_ / "study.yaml")
        << "scenario: train.yaml\nfactors:\n  - {key: initial.speed, scale: [1.0, 1.5]}\n";
  }
  int derail(const std::string& arguments) {
    const int status = std::system(
        (std::string(TRAIN_DERAIL_CLI) + " " + arguments + " > " + (folder_ / "out").string() + " 2>&1").c_str());
    out_ = test::text_of(folder_ / "out");
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  static nlohmann::json json(const fs::path& path) { return nlohmann::json::parse(test::text_of(path)); }
  std::string out_;
};

TEST_F(VerifyCommand, ExitCodeIsTheVerdict) {
  const std::string train = (folder_ / "train.yaml").string();
  ASSERT_EQ(derail("verify " + train + " --runs 2 --jobs 2 --out " + (folder_ / "v").string()), 0) << out_;
  EXPECT_NE(out_.find("Verdict: agrees, as far as judged"), std::string::npos) << out_;
  EXPECT_EQ(out_.find("none mph"), std::string::npos) << out_;
  EXPECT_NE(out_.find(" none\n"), std::string::npos) << "two runs are sure to show no shift of a speed\n" << out_;
  const nlohmann::json j = json(folder_ / "v" / "verify.json");
  EXPECT_EQ(j.at("verdict"), "agrees");
  EXPECT_EQ(j.at("ensemble").at("quantities").size(), 6U);
  EXPECT_EQ(j.at("ensemble").at("quantities")[0].at("multibody").size(), 2U);
  const std::string rows = test::text_of(folder_ / "v" / "differences.csv");
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 1 + 2 * 81);
  EXPECT_EQ(derail("verify " + train + " --runs 1 --set solver.steps_max=5"), 4) << out_;
  EXPECT_EQ(derail("verify " + train + " --runs 0"), 2) << out_;
  EXPECT_EQ(derail("verify nothing.yaml"), 2) << out_;
  EXPECT_EQ(derail("verify " + folder_.string()), 2) << out_;
  EXPECT_EQ(derail("verify " + train + " --set stop.time_max=0.2"), 2) << "nothing would be compared";
  EXPECT_NE(out_.find("stop.time_max = '0.2': too short"), std::string::npos) << out_;
}

TEST_F(VerifyCommand, OneCarIsATrain) {
  const std::string arguments = "verify " + (folder_ / "train.yaml").string() + " --set consist[0].count=1 --runs 8";
  ASSERT_EQ(derail(arguments + " --out " + (folder_ / "v").string()), 0) << out_;
  EXPECT_NE(out_.find("1 car, the first 0.30 s"), std::string::npos) << out_;
  EXPECT_EQ(json(folder_ / "v" / "verify.json").at("short_trains").size(), 1U);
}

TEST_F(VerifyCommand, APlaceThatCannotBeWrittenIsSaidBeforeTheComputing) {
  const std::string long_run = "verify " TRAIN_DERAIL_SOURCE_DIR "/config/baseline.yaml --runs 1000 ";
  EXPECT_EQ(derail(long_run + "--out " + (folder_ / "train.yaml").string()), 1);
  EXPECT_NE(out_.find("train.yaml: cannot be written: Not a directory"), std::string::npos) << out_;
  fs::create_directories(folder_ / "v" / "differences.csv");
  EXPECT_EQ(derail(long_run + "--out " + (folder_ / "v").string()), 1);
  EXPECT_NE(out_.find("differences.csv: is a folder"), std::string::npos) << out_;
  EXPECT_FALSE(fs::exists(folder_ / "v" / "verify.json"));
  EXPECT_EQ(derail(long_run + "--json " + (folder_ / "nowhere" / "x.json").string()), 1);
  EXPECT_NE(out_.find("x.json: cannot be written"), std::string::npos) << out_;
}

TEST_F(VerifyCommand, AnInterruptLeavesEarlierResultsAsTheyWere) {
  const fs::path out = folder_ / "v";
  fs::create_directory(out);
  std::ofstream(out / "verify.json") << "of yesterday";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    execl(TRAIN_DERAIL_CLI, "derail", "verify", TRAIN_DERAIL_SOURCE_DIR "/config/baseline.yaml", "--quiet", "--force",
          "--out", out.c_str(), nullptr);
    _exit(127);
  }
  clockid_t clock{};
  ASSERT_EQ(clock_getcpuclockid(child, &clock), 0);
  timespec used{};  // the whole takes minutes
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (used.tv_sec < 1 && std::chrono::steady_clock::now() < give_up && clock_gettime(clock, &used) == 0)
    std::this_thread::yield();
  kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_GE(used.tv_sec, 1);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_EQ(test::text_of(out / "verify.json"), "of yesterday");
  EXPECT_FALSE(fs::exists(out / "differences.csv"));
}

TEST_F(VerifyCommand, AStudyRemembersItsEngine) {
  const std::string study = "study " + (folder_ / "study.yaml").string() + " --quiet --out ";
  const std::string folder = (folder_ / "results").string();
  ASSERT_EQ(derail(study + folder + " --engine multibody"), 0) << out_;
  EXPECT_EQ(json(folder_ / "results" / "about.json").at("study").at("engine"), "multibody");
  EXPECT_EQ(derail(study + folder + " --resume"), 1);
  EXPECT_NE(out_.find("engine: was \"multibody\", is now \"purpose_built\""), std::string::npos) << out_;
  EXPECT_EQ(derail(study + folder + " --resume --engine multibody"), 0) << out_;
  EXPECT_EQ(derail(study + (folder_ / "other").string() + " --engine magic"), 2) << out_;
}

TEST_F(VerifyCommand, AStudyOfWhatTheEngineHasNotIsRefusedBeforeItsFirstRun) {
  const fs::path out = folder_ / "refused";
  const std::string study =
      "study " + (folder_ / "study.yaml").string() + " --quiet --engine multibody --out " + out.string() + " --set ";
  const auto refused = [&](const std::string& set, const std::string& key, const std::string& why) {
    EXPECT_EQ(derail(study + set), 2) << out_;
    EXPECT_NE(out_.find(key), std::string::npos) << out_;
    EXPECT_NE(out_.find(why), std::string::npos) << out_;
    EXPECT_FALSE(fs::exists(out));
    EXPECT_EQ(derail("verify " + (folder_ / "train.yaml").string() + " --set " + set), 2) << out_;
    EXPECT_NE(out_.find(why), std::string::npos) << out_;
  };
  const std::string steps = " --set solver.method=semi_implicit --set solver.fixed_step=1e-3";
  refused("model=spatial --set ground.on_track_law=rails --set brakes.law=air --set consist[0].shape=cylinder" + steps,
          "consist[0].shape = 'cylinder'", "the multibody engine has no such part");
  refused("coupler.break_draft=1e6" + steps, "coupler.break_draft", "the multibody engine has no such part");
}

}  // namespace
}  // namespace train_derail
