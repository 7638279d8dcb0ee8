// The action ~run_study with a real client: the table, the live run beside it, cancelling, refusals, a killed node.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <sys/resource.h>

#include <actionlib/client/simple_action_client.h>

#include "child_process.hpp"
#include "node_client.hpp"
#include "train_derail/RunStudyAction.h"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {
namespace {

namespace fs = std::filesystem;

using State = actionlib::SimpleClientGoalState;

std::string g_scenario_file;

constexpr int kRuns = 2 * 2 * 60;

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A client that keeps all feedback of its goal.
class StudyClient {
 public:
  explicit StudyClient(const std::string& node) : client_(node + "/run_study", false) {}

  bool wait_until_up() {
    return wait_for([this] { return client_.isServerConnected(); });
  }
  void send(const RunStudyGoal& goal) {
    feedback.clear();
    client_.sendGoal(goal, {}, {}, [this](const RunStudyFeedbackConstPtr& m) { feedback.push_back(*m); });
  }
  bool wait_until_done() {
    return wait_for([this] { return client_.getState().isDone(); }, 90.0);
  }
  bool wait_for_runs(std::int64_t count) {
    return wait_for([&] { return feedback.at(feedback.size() - 1).done >= count; });
  }
  RunStudyResult result_of(const RunStudyGoal& goal) {
    send(goal);
    EXPECT_TRUE(wait_until_done());
    return result();
  }
  void cancel() { client_.cancelGoal(); }
  State state() const { return client_.getState(); }
  RunStudyResult result() const {
    const RunStudyResultConstPtr r = client_.getResult();
    return r ? *r : RunStudyResult();
  }

  std::vector<RunStudyFeedback> feedback;

 private:
  actionlib::SimpleActionClient<RunStudyAction> client_;
};

class RosStudy : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(ros::param::get("/train_derail/results_folder", results_));
    fs::create_directories(results_);
    std::string pattern = results_ + "/XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("scenario.yaml",
          "consist:\n  - {count: 12, length: 61.1 ft, weight: 150 kip}\n"
          "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 3 s}\n");
    // Half of the runs fail: their rows belong to the table too.
    write("study.yaml",
          "title: beside the live run\nscenario: scenario.yaml\nplan: grid\nfactors:\n"
          "  - {key: initial.speed, values: [20 mph, 30 mph]}\n  - {key: solver.steps_max, values: [20, 100000]}\n"
          "replicates: 60\nperturbation: {spacing: 3 mm, yaw_rate: 0.01}\n");
    ASSERT_TRUE(node.wait_until_up());
    ASSERT_TRUE(client.wait_until_up());
  }
  void TearDown() override { fs::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  RunStudyGoal goal(const std::string& out, bool resume = false, std::uint32_t jobs = 1) const {
    RunStudyGoal g;
    g.file = path("study.yaml");
    g.folder = path(out);
    g.jobs = jobs;
    g.resume = resume;
    return g;
  }

  /// What the command line prints on standard error, without the program's name.
  std::string command_line(const std::string& study, const std::string& out, const std::string& more = "") const {
    const std::string command =
        std::string(TRAIN_DERAIL_CLI) + " study '" + study + "' --out '" + out + "' --quiet " + more + " 2>&1";
    std::string said;
    FILE* const pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return "no pipe";
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) said += static_cast<char>(c);
    pclose(pipe);
    const std::string name = "derail: ";
    return said.compare(0, name.size(), name) == 0 ? said.substr(name.size(), said.find('\n') - name.size()) : said;
  }
  void expect_table_of_command_line(const std::string& out) {
    command_line(path("study.yaml"), path("alone"), "--jobs 2");
    for (const char* name : {"runs.csv", "summary.csv"}) {
      const std::string expected = text_of(folder_ / "alone" / name);
      ASSERT_FALSE(expected.empty());
      EXPECT_EQ(text_of(folder_ / out / name), expected) << name;
    }
  }

  std::string results_;
  fs::path folder_;
  NodeClient node{"/train_derail"};
  StudyClient client{"/train_derail"};
};

TEST_F(RosStudy, TableIsThatOfTheCommandLineAndTheLiveRunIsNotDisturbed) {
  Record<CarStates> cars(node.topic("cars"));
  Record<CouplerForces> couplers(node.topic("couplers"));
  Record<RunInfo> run_info(node.topic("run_info"));
  ASSERT_TRUE(wait_for([&] { return cars.connected() && couplers.connected() && !run_info.empty(); }));
  const Restart::Response restarted = node.restart({}, true);
  ASSERT_TRUE(restarted.success) << restarted.message;
  ASSERT_TRUE(
      wait_for([&] { return cars.last().run_id == restarted.run_id && couplers.last().run_id == restarted.run_id; }));

  // As text; the file's name says where the base scenario is.
  RunStudyGoal g = goal("results", false, 2);
  g.text = text_of(g.file);
  g.file = path("not_there.yaml");
  client.send(g);
  ASSERT_TRUE(client.wait_for_runs(1));
  ASSERT_TRUE(node.trigger("resume").success);
  ASSERT_TRUE(client.wait_until_done());
  EXPECT_EQ(client.state(), State::SUCCEEDED) << client.result().message;
  const RunStudyResult r = client.result();
  EXPECT_EQ(r.status, RunStudyResult::DONE);
  EXPECT_EQ(r.folder, g.folder);
  EXPECT_EQ(r.runs, kRuns);
  EXPECT_EQ(r.computed, kRuns);
  EXPECT_EQ(r.failed, kRuns / 2);
  EXPECT_GT(r.wall_time, 0.0);
  EXPECT_NE(r.message.find("120 of 240 failed"), std::string::npos) << r.message;
  EXPECT_NE(r.table.find("5 to 95 % of 60 runs"), std::string::npos) << r.table;
  expect_table_of_command_line("results");
  EXPECT_TRUE(fs::exists(folder_ / "results" / "about.json"));

  const auto& all = client.feedback;
  ASSERT_GE(all.size(), 2u);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].total, kRuns);
    EXPECT_GT(all[i].done, i == 0 ? 0 : all[i - 1].done);
    EXPECT_GT(all[i].rate, 0.0);
    EXPECT_NEAR(all[i].eta, static_cast<double>(kRuns - all[i].done) / all[i].rate, 1e-9);
  }
  EXPECT_EQ(all.back().done, kRuns);
  EXPECT_EQ(all.back().failed, kRuns / 2);
  EXPECT_NE(all.back().message.find("20"), std::string::npos) << "steps_max: " << all.back().message;

  ASSERT_TRUE(
      wait_for([&] { return run_info.last().run_id == restarted.run_id && run_info.last().state == RunInfo::ENDED; }));
  ASSERT_TRUE(
      wait_for([&] { return cars.last().time == run_info.last().time && couplers.last().time == cars.last().time; }));
  const auto of_another_run = [&](const auto& m) { return m.run_id != restarted.run_id; };
  cars.messages.erase(std::remove_if(cars.messages.begin(), cars.messages.end(), of_another_run), cars.messages.end());
  couplers.messages.erase(std::remove_if(couplers.messages.begin(), couplers.messages.end(), of_another_run),
                          couplers.messages.end());
  EXPECT_GT(cars.messages.size(), 100u);
  expect_equal_to_simulation(cars.messages, couplers.messages, inputs::read_scenario_file(g_scenario_file));
}

TEST_F(RosStudy, CancelledGoalKeepsWhatIsDoneAndTheNextGoesOn) {
  // Seconds of computing: the word to stop must not come after the end.
  write("scenario.yaml",
        "consist:\n  - {count: 120, length: 61.1 ft, weight: 150 kip}\n"
        "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 60 s}\n");
  client.send(goal("results"));
  ASSERT_TRUE(client.wait_for_runs(3));
  client.cancel();
  ASSERT_TRUE(client.wait_until_done());
  EXPECT_EQ(client.state(), State::PREEMPTED);
  const RunStudyResult stopped = client.result();
  EXPECT_EQ(stopped.status, RunStudyResult::STOPPED);
  EXPECT_GE(stopped.runs, 3);
  ASSERT_LT(stopped.runs, kRuns) << "done before it was cancelled";
  EXPECT_NE(stopped.message.find(std::to_string(stopped.runs) + " runs on disk"), std::string::npos) << stopped.message;
  EXPECT_FALSE(fs::exists(folder_ / "results" / "runs.csv"));

  const RunStudyResult refused = client.result_of(goal("results"));
  EXPECT_EQ(client.state(), State::ABORTED);
  EXPECT_EQ(refused.status, RunStudyResult::OUTPUT_FAILED);
  std::string said = command_line(path("study.yaml"), path("results"));
  const std::string option = "; --resume computes";
  ASSERT_NE(said.find(option), std::string::npos) << said;
  EXPECT_EQ(refused.message, said.replace(said.find(option), option.size(), "; resume computes"))
      << "a field of the goal";

  const RunStudyResult resumed = client.result_of(goal("results", true));
  EXPECT_EQ(client.state(), State::SUCCEEDED) << resumed.message;
  EXPECT_EQ(resumed.runs, kRuns);
  EXPECT_EQ(resumed.computed, kRuns - stopped.runs);
  expect_table_of_command_line("results");
}

TEST_F(RosStudy, WhatIsWrongIsSaidAsOnTheCommandLine) {
  write("unknown_key.yaml", "scenario: scenario.yaml\nfactors:\n  - {key: initial.sped, values: [1]}\n");
  write("not_yaml.yaml", "factors: [\n");
  write("no_scenario.yaml", "scenario: none.yaml\nfactors:\n  - {key: initial.speed, values: [1]}\n");
  write("lacks_scenario.yaml", "factors:\n  - {key: initial.speed, values: [1]}\n");
  write("a_file", "");
  for (const char* name :
       {"missing.yaml", "unknown_key.yaml", "not_yaml.yaml", "no_scenario.yaml", "lacks_scenario.yaml"}) {
    RunStudyGoal g = goal("wrong");
    g.file = path(name);
    const RunStudyResult r = client.result_of(g);
    EXPECT_EQ(client.state(), State::ABORTED) << name;
    EXPECT_EQ(client.state().getText(), r.message);
    EXPECT_EQ(r.status, RunStudyResult::INPUT_WRONG) << name;
    EXPECT_EQ(r.message, command_line(g.file, g.folder)) << name;
    if (!fs::exists(g.file)) continue;
    g.text = text_of(g.file);
    EXPECT_EQ(client.result_of(g).message, r.message) << name << " as text";
  }
  EXPECT_FALSE(fs::exists(folder_ / "wrong"));

  RunStudyGoal g = goal("a_file");
  RunStudyResult r = client.result_of(g);
  EXPECT_EQ(client.state(), State::ABORTED);
  EXPECT_EQ(r.status, RunStudyResult::OUTPUT_FAILED);
  EXPECT_EQ(r.message, command_line(g.file, g.folder));
  EXPECT_NE(r.message.find("a_file"), std::string::npos) << r.message;

  const std::string few = "scenario: scenario.yaml\nfactors:\n  - {key: initial.speed, values: [20 mph]}\nseed: ";
  write("study.yaml", few + "1\n");
  EXPECT_EQ(client.result_of(goal("used")).status, RunStudyResult::DONE);
  write("study.yaml", few + "2\n");
  r = client.result_of(goal("used", true));
  EXPECT_EQ(client.state(), State::ABORTED);
  EXPECT_NE(r.message.find("seed: was 1, is now 2"), std::string::npos) << r.message;
  EXPECT_EQ(r.message, command_line(path("study.yaml"), path("used"), "--resume"));

  // What the command line takes and a node does not.
  g = goal("x");
  g.folder = "";
  expect_refused(false, client.result_of(g).message, {"~run_study", "folder", "missing", "below " + results_});
  EXPECT_EQ(client.state(), State::REJECTED);
  g = goal("x", false, 5000);
  expect_refused(false, client.result_of(g).message, {"~run_study", "jobs = '5000'", "0 to "});
  g = goal("x");
  g.text = std::string((1U << 20) + 1, '#');
  expect_refused(false, client.result_of(g).message, {"~run_study", "text", "1048577 bytes", "at most 1048576 bytes"});
}

TEST_F(RosStudy, FilesAreReadAndWrittenWhereTheyMayBeAndNowhereElse) {
  // A secret of the node's user, right beside the folder of results and reachable from it.
  const fs::path outside = fs::path(results_ + ".outside");
  fs::create_directories(outside);
  const std::string secret = "very-secret-token-4711: {";
  std::ofstream(outside / "secret") << secret << "\n";
  std::ofstream(outside / "scenario.yaml") << text_of(folder_ / "scenario.yaml");
  fs::create_symlink(outside, folder_ / "link");
  fs::create_symlink(outside / "secret", folder_ / "secret_link");
  fs::create_symlink(outside / "new", folder_ / "dangling");
  const std::string absolute = outside.string(), nul("/etc/passwd\0/x", 13);

  for (const std::string& file :
       {absolute + "/secret", absolute + "/not_there", std::string("/etc/passwd"),
        std::string("../") + "derail ros study.outside/secret", path("link/secret"), path("secret_link"),
        path("../../derail ros study.outside/secret"), nul, std::string("/proc/self/environ"), results_ + "/"}) {
    RunStudyGoal g = goal("x");
    g.file = file;
    const RunStudyResult r = client.result_of(g);
    EXPECT_EQ(r.status, RunStudyResult::INPUT_WRONG) << file;
    expect_refused(false, r.message, {"file"});
    EXPECT_EQ(r.message.find("secret-token"), std::string::npos) << r.message;
    EXPECT_EQ(r.message.find("root:"), std::string::npos) << r.message;
    EXPECT_EQ(r.message.find('\0'), std::string::npos) << r.message;
  }
  // Whether it is there is not told either.
  RunStudyGoal g = goal("x");
  g.file = absolute + "/secret";
  const std::string there = client.result_of(g).message;
  g.file = absolute + "/absent";
  std::string not_there = client.result_of(g).message;
  not_there.replace(not_there.find("absent"), 6, "secret");
  EXPECT_EQ(not_there, there);

  for (const std::string& scenario : {absolute + "/scenario.yaml", std::string("link/scenario.yaml"),
                                      std::string("secret_link"), std::string("\"../x\\0y\"")}) {
    g = goal("x");
    g.text = "scenario: " + scenario + "\nfactors:\n  - {key: initial.speed, values: [1]}\n";
    const RunStudyResult r = client.result_of(g);
    EXPECT_EQ(r.status, RunStudyResult::INPUT_WRONG) << scenario;
    expect_refused(false, r.message, {"scenario"});
    EXPECT_EQ(r.message.find("secret-token"), std::string::npos) << r.message;
  }

  // A study that another one starts from, a train of the scenario, and a restart of the node keep to the same.
  for (const std::string& secret_file : {absolute + "/secret", absolute + "/absent"}) {
    for (const std::string& text :
         {"base: " + secret_file, "{scenario: {consist: {file: " + secret_file + "}}, factors: []}"}) {
      g = goal("x");
      g.text = text + "\n";
      const RunStudyResult r = client.result_of(g);
      EXPECT_EQ(r.status, RunStudyResult::INPUT_WRONG) << text;
      expect_refused(false, r.message, {"outside of what may be read"});
    }
    const Restart::Response r = node.restart({}, true, "base: " + secret_file + "\n");
    expect_refused(r.success, r.message, {"~restart: base", "outside of what may be read"});
  }

  for (const std::string& folder :
       {absolute + "/x", std::string("/tmp/x"), std::string("../x"), path("../../x"), path("link/x"), path("dangling"),
        results_, std::string("."), results_ + "/", std::string("x\ny"), nul, std::string(5000, 'x')}) {
    g = goal("x");
    g.folder = folder;
    const RunStudyResult r = client.result_of(g);
    EXPECT_EQ(r.status, RunStudyResult::INPUT_WRONG) << folder;
    expect_refused(false, r.message, {"folder", "below " + results_});
  }
  EXPECT_FALSE(fs::exists(outside / "x"));
  EXPECT_FALSE(fs::exists(outside / "new"));
  EXPECT_FALSE(fs::exists(folder_ / "x"));

  // The shipped studies may be read, by a path from their folder too; and a relative folder is below the results.
  g = goal("x");
  g.folder = folder_.filename().string() + "/relative";
  g.file = "";
  g.text = "scenario: " + std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/baseline.yaml\n" +
           "factors:\n  - {key: stop.time_max, values: [0.1 s]}\n";
  const RunStudyResult r = client.result_of(g);
  EXPECT_EQ(r.status, RunStudyResult::DONE) << r.message;
  EXPECT_EQ(r.folder, path("relative"));
  EXPECT_TRUE(fs::exists(folder_ / "relative" / "runs.csv"));
  g.text = "";
  g.file = "studies/not_there.yaml";
  expect_refused(false, client.result_of(g).message, {"config/studies/not_there.yaml"});
  fs::remove_all(outside);
}

/// The process of the study under way; 0 if there is none.
int study_process() {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    if (text_of(entry.path() / "cmdline").rfind("train_derail_study", 0) == 0)
      return std::stoi(entry.path().filename().string());
  }
  return 0;
}

TEST_F(RosStudy, RunsInAProcessOfItsOwnThatIsModestAndEndsWithItsGoal) {
  client.send(goal("results"));
  ASSERT_TRUE(client.wait_for_runs(1));
  const int pid = study_process();
  ASSERT_GT(pid, 0);
  EXPECT_EQ(getpriority(PRIO_PROCESS, static_cast<id_t>(pid)), 10);
  const std::string limits = text_of("/proc/" + std::to_string(pid) + "/limits");
  const std::string data = limits.substr(limits.find("Max data size"), 40);
  EXPECT_EQ(data.find("unlimited"), std::string::npos) << data;
  for (const auto& file : fs::directory_iterator("/proc/" + std::to_string(pid) + "/fd")) {
    const std::string target = fs::read_symlink(file).string();
    EXPECT_NE(target.rfind("socket:", 0), 0U) << "a connection of the node's: " << target;
  }
  // It dies of whatever: the goal says so, what is done is there, the node goes on.
  kill(pid, SIGKILL);
  ASSERT_TRUE(client.wait_until_done());
  EXPECT_EQ(client.state(), State::ABORTED);
  RunStudyResult r = client.result();
  EXPECT_EQ(r.status, RunStudyResult::OUTPUT_FAILED);
  expect_refused(false, r.message, {"~run_study", "signal 9", "runs are on disk", "resume"});
  EXPECT_GE(r.runs, 1);
  EXPECT_EQ(study_process(), 0);
  EXPECT_TRUE(node.trigger("pause").success);

  // It does not listen: it is killed.
  client.send(goal("results", true));
  ASSERT_TRUE(client.wait_for_runs(r.runs + 1));
  kill(study_process(), SIGSTOP);
  client.cancel();
  ASSERT_TRUE(wait_for([&] { return client.state().isDone(); }, 2.0));
  EXPECT_EQ(client.state(), State::PREEMPTED);
  EXPECT_EQ(client.result().status, RunStudyResult::STOPPED);
  EXPECT_EQ(study_process(), 0);
  r = client.result_of(goal("results", true));
  EXPECT_EQ(r.status, RunStudyResult::DONE) << r.message;
  expect_table_of_command_line("results");
}

TEST_F(RosStudy, OneAtATime) {
  client.send(goal("first"));
  ASSERT_TRUE(client.wait_for_runs(1));
  StudyClient other("/train_derail");
  ASSERT_TRUE(other.wait_until_up());
  const RunStudyResult refused = other.result_of(goal("second"));
  EXPECT_EQ(other.state(), State::REJECTED);
  expect_refused(false, refused.message, {"another study", path("first")});
  EXPECT_FALSE(fs::exists(folder_ / "second"));
  EXPECT_FALSE(client.state().isDone());
  client.cancel();
  ASSERT_TRUE(client.wait_until_done());
  EXPECT_EQ(other.result_of(goal("second", false, 2)).status, RunStudyResult::DONE);
}

TEST_F(RosStudy, GoalsOfTheSameNameAreTwoGoals) {
  // As two clients send that ask a clock which stands still.
  ros::Publisher goals = ros::NodeHandle().advertise<RunStudyActionGoal>(node.topic("run_study/goal"), 1);
  Record<RunStudyActionResult> results(node.topic("run_study/result"));
  ASSERT_TRUE(wait_for([&] { return goals.getNumSubscribers() > 0 && results.connected(); }));
  RunStudyActionGoal m;
  m.goal_id.id = "twice";
  m.goal.file = path("missing.yaml");
  for (std::size_t i = 1; i <= 2; ++i) {
    goals.publish(m);
    ASSERT_TRUE(wait_for([&] { return results.messages.size() >= i; })) << i;
    EXPECT_EQ(results.last().status.goal_id.id, "twice");
  }
}

TEST_F(RosStudy, KilledNodeLosesNothingButTheRunsInFlight) {
  const std::string name = "/doomed";
  XmlRpc::XmlRpcValue scenario;
  ASSERT_TRUE(ros::param::get("/train_derail/scenario", scenario));
  ros::param::set(name + "/scenario", scenario);
  ros::param::set(name + "/start_paused", true);
  ros::param::set(name + "/publish/clock", false);
  ros::param::set(name + "/results_folder", results_);
  const auto start = [&] {
    return std::make_unique<ChildProcess>(std::vector<std::string>{TRAIN_DERAIL_NODE, "__name:=doomed"});
  };
  const auto finished = [&] {
    const std::string text = text_of(folder_ / "results" / "journal.csv");
    return std::count(text.begin(), text.end(), '\n') - 1;
  };

  auto doomed = start();
  auto before = std::make_unique<StudyClient>(name);
  ASSERT_TRUE(before->wait_until_up());
  before->send(goal("results"));
  ASSERT_TRUE(before->wait_for_runs(3));
  doomed->kill_now();
  EXPECT_TRUE(wait_for([] { return study_process() == 0; })) << "the study outlives its node";
  before.reset();
  const auto saved = finished();
  EXPECT_GE(saved, 3);
  ASSERT_LT(saved, kRuns);

  doomed = start();
  StudyClient after(name);
  ASSERT_TRUE(after.wait_until_up());
  const RunStudyResult r = after.result_of(goal("results", true));
  EXPECT_EQ(after.state(), State::SUCCEEDED) << r.message;
  EXPECT_EQ(r.computed, kRuns - saved);
  expect_table_of_command_line("results");
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_study");
  if (argc < 2) return 2;
  train_derail::test::g_scenario_file = argv[1];
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
