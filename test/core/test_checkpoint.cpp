// A run that is saved and gone on with ends bit for bit like one that was not; with other inputs it branches.
#include <filesystem>
#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::simulation {
namespace {

inputs::Scenario in_a_curve() {
  inputs::Scenario s = test::accident(20);
  s.track.curves = {{-200.0, 400.0, 0.002}};
  s.track.grade = -0.01;
  return s;
}

inputs::Scenario paper() {
  inputs::Scenario s = test::mixed_train();
  s.initial.yaw_rate = 0.4;
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 2e-4;
  s.stop.time_max = 4.0;
  return s;
}

/// Everything that came out, in one text.
std::string all_of(const Simulation& s) {
  outcome::Outcome o = s.outcome();
  o.wall_time = 0.0;
  std::string text = outcome::to_json(o);
  for (const model::Derailment& d : s.incidents().derailments) text += fmt::format("{} {}\n", d.time, d.car);
  for (const model::Impact& i : s.incidents().impacts) text += fmt::format("{} {} {}\n", i.time, i.peak_force, i.end);
  for (Eigen::Index i = 0; i < s.state().size(); ++i) text += fmt::format("{}\n", s.state()[i]);
  return text;
}

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const inputs::InputError& e) {
    return e.what();
  }
  return "no error";
}

void save(const Simulation& s, const std::string& path) {
  files::OutputFile file(path, files::Existing::replace);
  write_checkpoint(s.checkpoint(), file.stream());
  file.commit();
}

class Saved : public testing::TestWithParam<inputs::Scenario (*)()> {};

TEST_P(Saved, RunGoesOnBitForBit) {
  const inputs::Scenario s = GetParam()();
  Simulation whole(s);
  whole.run();
  const double end = whole.time();
  ASSERT_GT(end, 2.0);
  // At the start, between two steps, in the middle, at the end; and twice, with a file between.
  for (const double t : {0.0, 0.3333, 0.5 * end, end}) {
    Simulation first(s);
    first.advance(t);
    Simulation second(s, first.checkpoint());
    EXPECT_EQ(second.time(), first.time());
    EXPECT_EQ(all_of(second), all_of(first));
    second.advance(t + 0.1234);
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "run.checkpoint";
    save(second, file.string());
    Simulation third(s, read_checkpoint(file.string()));
    third.run();
    EXPECT_EQ(all_of(third), all_of(whole)) << "saved at " << t;
    first.run();
    EXPECT_EQ(all_of(first), all_of(whole)) << "saving leaves the run alone";
    std::filesystem::remove(file);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, Saved, testing::Values([] { return test::accident(30); }, in_a_curve, paper));

TEST(Checkpoint, BranchesWithOtherInputs) {
  inputs::Scenario s = test::accident(30);
  Simulation run(s);
  run.advance(3.0);
  const Checkpoint saved = run.checkpoint();
  run.run();
  s.ground.broadside_friction *= 1.1;
  Simulation branch(s, saved);
  EXPECT_EQ(branch.time(), 3.0);
  branch.run();
  EXPECT_LT(branch.time(), run.time());
  EXPECT_NE(branch.outcome().energy.work_off_track, run.outcome().energy.work_off_track);
}

TEST(Checkpoint, GoesOnInStepsOfAnotherLengthAndForLonger) {
  inputs::Scenario s = test::accident(30);
  s.stop.time_max = 2.0;
  Simulation run(s);
  run.run();
  ASSERT_EQ(run.outcome().ended, outcome::Ended::time_max);
  const Checkpoint saved = run.checkpoint();
  s.stop.time_max = 2.5;
  s.solver.fixed_step = 0.001;
  Simulation longer(s, saved);
  longer.run();
  EXPECT_EQ(longer.time(), 2.5);
  EXPECT_NEAR(static_cast<double>(longer.outcome().solver.steps - run.outcome().solver.steps), 500.0, 1.0);
  EXPECT_LT(longer.outcome().energy_residual, 1e-3);
}

TEST(Checkpoint, RefusesWhatDoesNotFit) {
  const inputs::Scenario s = test::accident(30);
  Simulation run(s);
  run.advance(1.0);
  const Checkpoint saved = run.checkpoint();
  const auto from = [&saved](const std::function<void(inputs::Scenario&)>& change) {
    inputs::Scenario other = test::accident(30);
    change(other);
    return refusal([&] { Simulation(other, saved); });
  };
  EXPECT_EQ(from([](inputs::Scenario&) {}), "no error");
  EXPECT_EQ(from([](inputs::Scenario& o) { o.consist[0].weight *= 2.0; }),
            "checkpoint: consist: another train; allowed: the train that was saved");
  EXPECT_EQ(from([](inputs::Scenario& o) { o.contact.law = inputs::ContactLaw::none; }), "no error");
  inputs::Scenario smooth = test::baseline();
  EXPECT_EQ(refusal([&] { Simulation(smooth).checkpoint(); }),
            "scenario: solver.method: the history that error control keeps cannot be saved; allowed: semi_implicit");
}

TEST(Checkpoint, BelievesNoDamagedFile) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / "damaged.checkpoint").string();
  Simulation run(test::accident(5));
  run.advance(0.5);
  save(run, path);
  std::ifstream in(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), {}};
  test::Random random(3);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = whole;
    if (i % 2 == 0)
      damaged[static_cast<std::size_t>(random.index(static_cast<int>(whole.size())))] ^= 1 << random.index(8);
    else damaged.resize(static_cast<std::size_t>(random.index(static_cast<int>(whole.size()))));
    std::ofstream(path, std::ios::binary) << damaged;
    EXPECT_NE(refusal([&] { read_checkpoint(path); }), "no error") << i;
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace train_derail::simulation
