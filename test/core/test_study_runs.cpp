// Runs of a study: results that survive threads, kills, shards, stops and full disks.
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "study_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail {
namespace {

using test::text_of;

class StudyRuns : public test::StudyFolder {
 protected:
  /// A child process computes the study and is killed once some runs are on disk.
  void compute_and_kill(const study::Study& s, const std::string& out, std::size_t lines) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const std::atomic<bool> stop{false};
      study::run_study(
          s, {(folder_ / out).string(), 1, false, {}}, [](const study::Progress&) {}, stop);
      _exit(0);
    }
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    const auto on_disk = [&] {
      const std::string text = text_of(folder_ / out / "journal.csv");
      return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    };
    while (on_disk() < lines && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_GE(on_disk(), lines);
  }
};

TEST_F(StudyRuns, ResultsDoNotDependOnThreads) {
  const study::Study s = read();
  EXPECT_EQ(run(s, "one", 1).computed, 30);
  EXPECT_EQ(run(s, "four", 4).computed, 30);
  const std::string one = runs_csv(s, "one");
  EXPECT_EQ(std::count(one.begin(), one.end(), '\n'), 31);
  EXPECT_EQ(one, runs_csv(s, "four"));
}

TEST_F(StudyRuns, AKilledStudyResumesToTheSameTable) {
  const study::Study s = read();
  compute_and_kill(s, "killed", 6);
  // The worst that a kill can leave: half a line.
  std::ofstream(folder_ / "killed" / "journal.csv", std::ios::app) << "29,5,4,123";
  EXPECT_THROW(run(s, "killed", 2), std::runtime_error) << "not without --resume";
  const study::RunReport report = run(s, "killed", 2, true);
  EXPECT_LE(report.computed, 30 - 5);
  EXPECT_EQ(report.runs, 30);
  run(s, "whole", 2);
  EXPECT_EQ(runs_csv(s, "killed"), runs_csv(s, "whole"));
  EXPECT_EQ(run(s, "killed", 2, true).computed, 0) << "nothing is left to do";
}

TEST_F(StudyRuns, AChangedStudyIsRefusedByNameOfTheChange) {
  run(read(), "used", 2);
  std::string changed = kStudy;
  changed.replace(changed.find("0.7"), 3, "0.8");
  write("changed.yaml", changed);
  try {
    run(read("changed.yaml"), "used", 2, true);
    FAIL() << "not refused";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("factors/1/values/2: was \"0.7\", is now \"0.8\""), std::string::npos)
        << e.what();
  }
}

TEST_F(StudyRuns, ShardsTogetherAreTheWhole) {
  const study::Study s = read();
  run(s, "whole", 2);
  std::int64_t sum = 0;
  for (int i = 1; i <= 3; ++i) sum += run(s, "shard" + std::to_string(i), 1, false, {i, 3}).computed;
  EXPECT_EQ(sum, 30);
  study::gather((folder_ / "merged").string(),
                {(folder_ / "shard1").string(), (folder_ / "shard2").string(), (folder_ / "shard3").string()}, s);
  EXPECT_EQ(runs_csv(s, "merged"), runs_csv(s, "whole"));
}

TEST_F(StudyRuns, ShardsMayBeginAtTheSameMoment) {
  const study::Study s = read();
  constexpr int kShards = 4;
  for (int round = 0; round < 50; ++round) {
    const std::string out = (folder_ / std::to_string(round)).string();
    std::vector<pid_t> shards;
    for (int i = 1; i <= kShards; ++i) {
      shards.push_back(fork());
      ASSERT_GE(shards.back(), 0);
      if (shards.back() != 0) continue;
      try {
        study::claim_folder(out, study::to_json(s));
        const study::Journal journal(out, study::journal_format(s), {i, kShards}, false,
                                     [](const study::JournalRow&) {});
        _exit(0);
      } catch (const std::exception& e) {
        std::fprintf(stderr, "shard %d: %s\n", i, e.what());
        _exit(1);
      }
    }
    for (const pid_t shard : shards) {
      int status = 0;
      waitpid(shard, &status, 0);
      EXPECT_EQ(status, 0);
    }
  }
}

TEST_F(StudyRuns, ThousandsOfThreadsAreNotStarted) {
  const study::Study s = read();
  EXPECT_LE(study::jobs_max(), 4096);
  EXPECT_EQ(run(s, "many", 4096).runs, 30);
  EXPECT_EQ(run(s, "one", 1).runs, 30);
  EXPECT_EQ(runs_csv(s, "many"), runs_csv(s, "one"));
}

// In three dimensions: the model in which cars share most.
TEST_F(StudyRuns, TheBytesDoNotDependOnTheThreads) {
  write("spatial.yaml",
        "consist:\n  - {name: tank_car, count: 5, length: 59.5 ft, weight: 263 kip}\nmodel: spatial\n"
        "ground: {on_track_law: rails}\ninitial: {speed: 30 mph, yaw_rate: 0}\nstop: {time_max: 2 s}\n"
        "track: {curves: [{start: -100 m, length: 200 m, curvature: 0.002}]}\n"
        "solver: {method: semi_implicit, fixed_step: 1 ms}\n");
  write("study.yaml",
        "scenario: spatial.yaml\nfactors:\n  - {key: initial.speed, values: [20 mph, 40 mph]}\n"
        "replicates: 4\nperturbation: {kick: 1 ft/s, alignment: 0.02 ft}\n");
  const study::Study s = read();
  const auto bytes = [&](int jobs) {
    const std::string out = "jobs" + std::to_string(jobs);
    EXPECT_EQ(run(s, out, jobs).failed, 0);
    study::write_results(path(out), s, 0.0);
    return runs_csv(s, out) + text_of(folder_ / out / "summary.csv");
  };
  const std::string one = bytes(1);
  EXPECT_GT(one.size(), 1000U);
  for (const int jobs : {2, 5}) EXPECT_EQ(bytes(jobs), one) << jobs;
}

// One run that takes long is given up; it is not in the journal.
TEST_F(StudyRuns, ALongRunIsGivenUpWhenStopped) {
  write("long.yaml",
        "consist:\n  - {count: 200, length: 61.1 ft, weight: 150 kip}\ninitial: {speed: 60 mph, yaw_rate: 0.2}\n"
        "stop: {time_max: 100000 s, speed: 0}\noutput: {interval: 1 s}\noutcome: {sample_interval: 1 s}\nsolver: "
        "{rtol: 1e-13, atol: 1e-13, steps_max: 1000000000}\n");
  write("one.yaml", "scenario: long.yaml\nfactors: []\n");
  const study::Study s = read("one.yaml");
  std::atomic<bool> stop{false};
  std::chrono::steady_clock::time_point asked;
  std::thread stopper([&] {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (text_of(folder_ / "out/journal.csv").empty() && std::chrono::steady_clock::now() < give_up)
      std::this_thread::yield();
    asked = std::chrono::steady_clock::now();
    stop = true;
  });
  const study::RunReport report = study::run_study(
      s, {path("out"), 1, false, {}}, [](const study::Progress&) {}, stop);
  stopper.join();
  EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(2));
  EXPECT_TRUE(report.stopped);
  EXPECT_EQ(report.computed, 0);
  EXPECT_EQ(test::lines_of(text_of(folder_ / "out/journal.csv")).size(), 1U);
}

TEST_F(StudyRuns, PointsAndTablesAreGivenUpWhenStopped) {
  const std::atomic<bool> stop{true};
  study::Study s = read();
  write("sobol.yaml",
        "scenario: scenario.yaml\nplan: saltelli\nsamples: 100000\nfactors:\n  - {key: initial.speed, low: 10 mph, "
        "high: 20 mph}\n");
  EXPECT_THROW(study::Points(read("sobol.yaml"), &stop), study::Stopped);
  EXPECT_THROW(study::check(s, &stop), study::Stopped);
  const study::RunReport report = study::run_study(
      s, {path("out"), 1, false, {}}, [](const study::Progress&) {}, stop);
  EXPECT_TRUE(report.stopped);
  run(s, "whole", 1);
  EXPECT_THROW(study::write_results(path("whole"), s, 0.0, &stop), study::Stopped);
  const std::vector<double> sample(10, 1.0);
  EXPECT_THROW(study::sobol_indices(sample, sample, {sample}, 500, &stop), study::Stopped);
}

TEST_F(StudyRuns, AnEnsembleByTheCommandLine) {
  write("jitter.yaml", text_of(folder_ / "scenario.yaml")
                           .insert(text_of(folder_ / "scenario.yaml").find("yaw_rate: 0.2") + 13,
                                   ", perturbation: {spacing: 3 mm, seed: 5}"));
  const test::Result table = derail("run jitter.yaml --seeds 7 --csv runs.csv --json out.json --jobs 2");
  ASSERT_EQ(table.code, 0) << table.out;
  EXPECT_NE(table.out.find("7 runs, each with a seed of its own"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("kip"), std::string::npos);
  EXPECT_NE(table.out.find(" kN "), std::string::npos) << "SI beside it, in the units of a single run's table";
  EXPECT_EQ(table.out.find("e+0"), std::string::npos) << "no powers of ten: " << table.out;
  EXPECT_NE(table.out.find("lowest to highest of 7 runs"), std::string::npos) << "too few for quantiles: " << table.out;
  const std::vector<std::string> runs = test::lines_of(text_of(folder_ / "runs.csv"));
  ASSERT_EQ(runs.size(), 8U);
  EXPECT_EQ(runs[0].find("run,point,replicate,seed,cars_past_pod,"), 0U);
  EXPECT_NE(text_of(folder_ / "out.json").find("\"runs\": 7"), std::string::npos);
  // The runs are those of a study of the same scenario and seed, and one of them alone is the run of its seed.
  write("same.yaml", "scenario: jitter.yaml\nfactors: []\nreplicates: 7\nseed: 5\n");
  const study::Study s = read("same.yaml");
  run(s, "same", 1);
  EXPECT_EQ(runs_csv(s, "same"), text_of(folder_ / "runs.csv"));
  EXPECT_EQ(derail("run jitter.yaml --seeds 7 --csv again.csv --jobs 1 --quiet").code, 0);
  EXPECT_EQ(text_of(folder_ / "again.csv"), text_of(folder_ / "runs.csv"));

  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const test::Result r = derail(arguments);
    EXPECT_EQ(r.code, 2) << arguments << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
  };
  refused("run scenario.yaml --seeds 7", "the runs of a point cannot differ: there is no perturbation");
  refused("run jitter.yaml --seeds 7 --bag x.bag", "--bag = 'x.bag': records one run");
  refused("run jitter.yaml --seeds 1", "--seeds");
  refused("run jitter.yaml --jobs 2", "--jobs = '2': one run is computed by one thread");
  const test::Result failing = derail("run jitter.yaml --seeds 3 --set solver.steps_max=20 --quiet");
  EXPECT_EQ(failing.code, 3) << failing.out;
  EXPECT_NE(failing.out.find("3 of 3 runs failed, the first: "), std::string::npos) << failing.out;
}

// Runs with a warning are counted; warnings that differ in numbers alone are one, also where one run has several.
TEST_F(StudyRuns, WarningsOfRunsAreCounted) {
  const study::Study s = read();
  const study::JournalFormat format = study::journal_format(s);
  study::claim_folder(path("out"), format.identity);
  {
    study::Journal journal(path("out"), format, {}, false, [](const study::JournalRow&) {});
    for (int i = 0; i < 10; ++i) {
      outcome::Outcome o;
      o.ended = outcome::Ended::at_rest;
      o.stop_time = i;
      if (i < 3) o.warnings.push_back("energy residual " + std::to_string(0.01 * i) + ", more than 1e-3");
      if (i == 2) o.warnings.emplace_back("coupler.slack = 5 ft, unusual: \"long\"");
      if (i > 7) o.warnings.insert(o.warnings.end(), {"consist[0].width = 9 m: more", "consist[1].width = 9 m: more"});
      journal.append(study::journal_fields(study::run_of(s, i), o), 0.1);
    }
  }
  const study::Totals totals = study::write_results(path("out"), s, 0.0);
  EXPECT_EQ(totals.warnings, (std::vector<std::string>{"3 of 10 runs: energy residual 0.000000, more than 1e-3",
                                                       "1 of 10 runs: coupler.slack = 5 ft, unusual: \"long\"",
                                                       "2 of 10 runs: consist[0].width = 9 m: more"}));
  EXPECT_NE(text_of(folder_ / "out/about.json").find("3 of 10 runs: energy residual"), std::string::npos);
}

TEST_F(StudyRuns, FailedRunsStayWithTheirReason) {
  write("failing.yaml",
        "scenario: scenario.yaml\nfactors:\n  - {key: solver.steps_max, values: [20]}\nreplicates: 2\nperturbation: "
        "{spacing: 3 mm}\n");
  const study::Study s = read("failing.yaml");
  const study::RunReport report = run(s, "failing", 2);
  EXPECT_EQ(report.runs, 4);
  EXPECT_EQ(report.failed, 2);
  const std::string text = runs_csv(s, "failing");
  EXPECT_NE(text.find("integration_failed,20,"), std::string::npos) << text;
  EXPECT_NE(text.find("solver.steps_max = 20"), std::string::npos);
  study::write_summary((folder_ / "failing").string(), s);
  EXPECT_NE(text_of(folder_ / "failing" / "summary.csv").find(",0,2,nan"), std::string::npos)
      << "no mean of failed runs";
}

TEST_F(StudyRuns, AStudyOfWhichEveryRunFailedDoesNotEndWell) {
  write("some.yaml",
        "scenario: scenario.yaml\nfactors:\n  - {key: solver.steps_max, values: [20, 100000]}\nplan: grid\n"
        "perturbation: {spacing: 3 mm}\n");
  const test::Result some = derail("study some.yaml --out some");
  EXPECT_EQ(some.code, 0) << some.out;
  EXPECT_NE(some.out.find("1 of 2 runs failed"), std::string::npos) << some.out;
  write("all.yaml", "scenario: scenario.yaml\nfactors: []\nreplicates: 2\nperturbation: {spacing: 3 mm}\n");
  const std::string all = "study all.yaml --set solver.steps_max=20 --out ";
  const test::Result failed = derail(all + "all");
  EXPECT_EQ(failed.code, 3) << failed.out;
  EXPECT_NE(failed.out.find("derail: all: every run failed"), std::string::npos) << failed.out;
  EXPECT_EQ(failed.out.find("nan"), std::string::npos) << failed.out;
  EXPECT_EQ(derail(all + "shards --shard 1/2").code, 0) << "its cluster has to go on to the merge";
  const std::string merge = "merge all.yaml --set solver.steps_max=20 --out shards";
  EXPECT_EQ(derail(merge).code, 5);
  EXPECT_EQ(derail(all + "shards --resume --shard 2/2").code, 0);
  EXPECT_EQ(derail(merge).code, 3);
}

TEST_F(StudyRuns, AJournalThatCannotBeWrittenIsSaidAndStaysWhole) {
  const study::Study s = read();
  run(s, "whole", 2);
  const auto size_of = [this](const char* file) { return std::filesystem::file_size(folder_ / "whole" / file); };
  // Room for the file that is written before the journal, not for the journal.
  const rlim_t room = size_of("study.json") + 500;
  ASSERT_GT(size_of("journal.csv"), room);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {  // a full disk, as far as this process can tell
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{room, room};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      run(s, "full", 1);
    } catch (const std::runtime_error& e) {
      _exit(std::string(e.what()).find("journal.csv: ") != std::string::npos ? 42 : 43);
    }
    _exit(44);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 42);
  const std::string text = text_of(folder_ / "full" / "journal.csv");
  ASSERT_FALSE(text.empty());
  EXPECT_EQ(text.back(), '\n');
  EXPECT_EQ(run(s, "full", 2, true).runs, 30) << "goes on when there is room again";
}

}  // namespace
}  // namespace train_derail
