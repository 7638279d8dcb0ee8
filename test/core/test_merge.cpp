// Merging only adds: nothing that was computed is lost, whatever is merged into what, and whenever it is killed.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "study_fixtures.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using test::lines_of;
using test::text_of;

class MergeTest : public test::StudyFolder {
 protected:
  study::Gathered gather(const std::string& to, const std::vector<std::string>& from) {
    std::vector<std::string> paths;
    for (const std::string& name : from) paths.push_back(path(name));
    return study::gather(path(to), paths, read());
  }
  /// Some of the runs of the study, as a run that was stopped leaves them.
  void some(const std::string& out, std::int64_t runs) {
    std::atomic<bool> stop{false};
    study::run_study(
        read(), {path(out), 1, false, {}}, [&](const study::Progress& p) { stop = p.done >= runs; }, stop);
  }
  std::string runs(const std::string& out) { return runs_csv(read(), out); }
};

TEST_F(MergeTest, AnOlderCopyTakesNothingAway) {
  some("old", 4);
  run(read(), "whole", 1);
  const std::string before = runs("whole"), journal = text_of(folder_ / "whole/journal.csv");
  const study::Gathered g = gather("whole", {"old"});
  EXPECT_EQ(g.runs, 30);
  EXPECT_EQ(g.added, 0);
  EXPECT_EQ(g.missing, "");
  EXPECT_EQ(runs("whole"), before);
  EXPECT_EQ(text_of(folder_ / "whole/journal.csv"), journal);
  EXPECT_EQ(gather("old", {"whole", "whole", "old"}).added, 26) << "the same folder twice, and itself";
  EXPECT_EQ(runs("old"), before);
  EXPECT_EQ(gather("old", {"whole"}).added, 0) << "a second time";
}

TEST_F(MergeTest, TwoHalvesWithoutShardsAreTheWhole) {
  run(read(), "whole", 1);
  some("first", 15);
  run(read(), "second", 1, false, {1, 2});  // every other run
  fs::rename(folder_ / "second/journal.1-of-2.csv", folder_ / "second/journal.csv");
  const study::Gathered g = gather("both", {"first", "second"});
  EXPECT_EQ(g.runs, 22);
  EXPECT_EQ(g.total, 30);
  EXPECT_EQ(g.missing, "8 of 30 runs are missing: 15, 17, 19, 21, 23, 25, 27, 29");
  EXPECT_EQ(run(read(), "both", 1, true).computed, 8);
  EXPECT_EQ(runs("both"), runs("whole"));
}

TEST_F(MergeTest, OverlappingShardsOfDifferentCounts) {
  run(read(), "whole", 1);
  run(read(), "a", 1, false, {1, 2});
  run(read(), "b", 1, false, {2, 3});
  run(read(), "c", 1, false, {1, 3});
  const study::Gathered g = gather("abc", {"a", "b", "c"});
  EXPECT_EQ(
      g.missing,
      "5 of 30 runs are missing: 5, 11, 17, 23, 29; shard 2/2 is not there (5 runs); shard 3/3 is not there (5 runs)");
  run(read(), "d", 1, false, {3, 3});
  EXPECT_EQ(gather("abc", {"d"}).missing, "");
  EXPECT_EQ(runs("abc"), runs("whole"));
}

TEST_F(MergeTest, FoldersThatAreNotThisStudysAreRefusedAndNothingIsCreated) {
  run(read(), "whole", 1);
  write("other.yaml", std::string(kStudy) + "outcomes: [stop_time]\n");
  run(read("other.yaml"), "other", 1);
  fs::create_directory(folder_ / "empty");
  const auto error = [&](const std::string& from) { return refusal([&] { gather("to", {from}); }); };
  EXPECT_NE(error("nowhere").find("nowhere: no such folder"), std::string::npos) << error("nowhere");
  EXPECT_NE(error("empty").find("study.json: missing"), std::string::npos) << error("empty");
  EXPECT_NE(error("other").find("other: holds results of another study; outcomes/"), std::string::npos)
      << error("other");
  EXPECT_NE(refusal([&] { gather("to", {}); }).find("to: no such folder"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "to"));
  EXPECT_TRUE(files_in("empty").empty());
}

TEST_F(MergeTest, RowsOfOneRunThatDifferAreAnErrorThatNamesBoth) {
  const study::Study s = read();
  some("a", 6);
  const study::JournalFormat format = study::journal_format(s);
  {
    study::claim_folder(path("b"), format.identity);
    study::Journal b(path("b"), format, {}, false, [](const study::JournalRow&) {});
    outcome::Outcome o;
    o.ended = outcome::Ended::at_rest;
    b.append(study::journal_fields(study::run_of(s, 3), o), 0.1);
  }
  const std::string error = refusal([&] { gather("to", {"a", "b"}); });
  EXPECT_EQ(error.find(path("a") + "/journal.csv:5: run 3 differs from the one in " + path("b") + "/journal.csv:2"), 0U)
      << error;
  EXPECT_FALSE(fs::exists(folder_ / "to"));
  const std::string before = text_of(folder_ / "a/journal.csv");
  EXPECT_NE(refusal([&] { gather("a", {"b"}); }).find("run 3 differs"), std::string::npos);
  EXPECT_EQ(text_of(folder_ / "a/journal.csv"), before);
}

TEST_F(MergeTest, NothingIsMergedIntoAFolderThatIsBeingComputed) {
  some("old", 4);
  const study::Study s = read();
  const study::JournalFormat format = study::journal_format(s);
  for (const study::Shard shard : {study::Shard{1, 1}, study::Shard{2, 3}}) {
    const std::string to = "to" + std::to_string(shard.count);
    study::claim_folder(path(to), format.identity);
    {
      const study::Journal held(path(to), format, shard, false, [](const study::JournalRow&) {});
      try {
        gather(to, {"old"});
        ADD_FAILURE() << "not refused";
      } catch (const std::runtime_error& e) {
        EXPECT_NE(std::string(e.what()).find("a study is being computed in it"), std::string::npos) << e.what();
      }
    }
    EXPECT_EQ(gather(to, {"old"}).runs, 4);
  }
}

TEST_F(MergeTest, BadLinesAreNamedAndLeftOut) {
  run(read(), "whole", 1);
  run(read(), "bad", 1);
  std::vector<std::string> lines = lines_of(text_of(folder_ / "bad/journal.csv"));
  lines[11][2] = '~';
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  std::ofstream(folder_ / "bad/journal.csv", std::ios::binary) << text;
  const study::Gathered g = gather("to", {"bad"});
  EXPECT_EQ(g.problems, std::vector<std::string>{path("bad") + "/journal.csv:12: the checksum does not fit the line"});
  EXPECT_EQ(g.missing, "1 of 30 runs are missing: 10");
  EXPECT_EQ(text_of(folder_ / "bad/journal.csv"), text) << "only the target is written";
  EXPECT_EQ(gather("bad", {"whole"}).missing, "");
  EXPECT_EQ(runs("bad"), runs("whole"));
  EXPECT_TRUE(gather("bad", {}).problems.empty()) << "taken out of the target";
}

TEST_F(MergeTest, KilledAtAnyMomentNothingIsLostAndNothingIsLeft) {
  const study::Study s = read();
  run(s, "whole", 2);
  study::write_results(path("whole"), s, 0.0);
  for (int i = 1; i <= 3; ++i) run(s, "shard" + std::to_string(i), 1, false, {i, 3});
  for (int moment = 0; moment < 25; ++moment) {
    const std::string to = "to" + std::to_string(moment);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (;;) {
        gather(to, {"shard1", "shard2"});
        gather(to, {"shard3"});
        study::write_results(path(to), s, 0.0);
        fs::remove(folder_ / to / "runs.csv");
        fs::remove(folder_ / to / "journal.csv");
      }
    }
    // The moment is that of a look at the folder: which one is the machine's choice.
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    int looks = 0;
    while (looks < moment * 7 && std::chrono::steady_clock::now() < give_up) {
      looks += fs::exists(folder_ / to / (moment % 2 == 0 ? "journal.csv" : "study.json")) ? 1 : 0;
    }
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(gather(to, {"shard1", "shard2", "shard3"}).missing, "") << "moment " << moment;
    study::write_results(path(to), s, 0.0);
    for (const char* name : {"runs.csv", "summary.csv"}) {
      EXPECT_EQ(text_of(folder_ / to / name), text_of(folder_ / "whole" / name)) << name << ", moment " << moment;
    }
    EXPECT_EQ(files_in(to), files_in("whole")) << "moment " << moment;
  }
}

TEST_F(MergeTest, TheCommandEndsWithACodeOfItsOwnIfAShardIsMissing) {
  ASSERT_EQ(derail("study study.yaml --out s1 --shard 1/2 --quiet").code, 0);
  const test::Result half = derail("merge study.yaml s1 --out to --quiet");
  EXPECT_EQ(half.code, 5) << half.out;
  EXPECT_NE(half.out.find("derail: to: 15 of 30 runs are missing: 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, ...; shard 2/2 is "
                          "not there (15 runs)"),
            std::string::npos)
      << half.out;
  EXPECT_EQ(lines_of(text_of(folder_ / "to/runs.csv")).size(), 16U) << "what there is, is written";
  ASSERT_EQ(derail("study study.yaml --out s2 --shard 2/2 --quiet").code, 0);
  EXPECT_EQ(derail("merge study.yaml s1 s2 --out to --quiet").code, 0);
  run(read(), "whole", 1);
  EXPECT_EQ(text_of(folder_ / "to/runs.csv"), runs("whole"));
  EXPECT_EQ(derail("merge study.yaml s3 --out to").code, 2);
}

}  // namespace
}  // namespace train_derail
