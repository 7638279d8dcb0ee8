// Journals: nothing that was changed on disk is believed, and nothing that is good is lost.
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <map>
#include <thread>

#include <fmt/format.h>
#include <boost/crc.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>

#include "study_fixtures.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using test::lines_of;
using test::text_of;

std::uint64_t crc64(const std::string& text) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693ULL, 0xFFFFFFFFFFFFFFFFULL, 0xFFFFFFFFFFFFFFFFULL, true, true> crc;
  crc.process_bytes(text.data(), text.size());
  return crc.checksum();
}

class JournalTest : public test::StudyFolder {
 protected:
  fs::path journal(const std::string& out = "out") const { return folder_ / out / "journal.csv"; }
  /// A line that was changed, with the checksum that goes with it: only the plan can tell.
  std::string sealed(const std::string& line) {
    const std::string head = lines_of(text_of(journal())).front();
    const std::string fingerprint = head.substr(head.rfind("study ") + 6, 16);
    const std::string body = line.substr(0, line.rfind(','));
    return fmt::format("{},{:016x}", body, crc64(fingerprint + body));
  }
  void rewrite(const std::function<void(std::vector<std::string>&)>& change) {
    std::vector<std::string> lines = lines_of(text_of(journal()));
    change(lines);
    std::ofstream file(journal(), std::ios::binary);
    for (const std::string& line : lines) file << line << "\n";
  }
};

TEST_F(JournalTest, EveryLineHasItsChecksumAndTheHeadItsFormat) {
  EXPECT_EQ(crc64("123456789"), 0x995DC9BBDF1939FAULL) << "CRC-64/XZ, as the catalogue has it";
  run(read(), "out", 1);
  const std::vector<std::string> lines = lines_of(text_of(journal()));
  ASSERT_EQ(lines.size(), 31U);
  EXPECT_NE(lines[0].find(",wall_time,crc64 (journal 2; study "), std::string::npos) << lines[0];
  for (std::size_t i = 1; i < lines.size(); ++i) EXPECT_EQ(sealed(lines[i]), lines[i]);
}

TEST_F(JournalTest, OfAThousandCorruptionsNoneIsBelievedAndNoGoodLineIsLost) {
  const study::Study s = read();
  run(s, "out", 2);
  const study::JournalFormat format = study::journal_format(s);
  const std::string good = text_of(journal());
  std::map<std::int64_t, std::vector<std::string>> rows;
  {
    study::Journal(path("out"), format, {}, true, [&](const study::JournalRow& r) { rows[r.run] = r.fields; });
  }
  ASSERT_EQ(rows.size(), 30U);

  boost::random::mt19937_64 generator(2026);
  const auto any = [&](std::size_t below) {
    return boost::random::uniform_int_distribution<std::size_t>(0, below - 1)(generator);
  };
  int refused = 0, named = 0;
  for (int i = 0; i < 1000; ++i) {
    std::string text = good;
    std::vector<std::string> lines = lines_of(good);
    const std::size_t at = any(text.size()), other = any(text.size());
    bool whole_lines = false;  // still the same lines
    switch (i % 9) {
      case 0: text[at] = static_cast<char>(text[at] ^ (1 << any(8))); break;
      case 1: text.erase(at, 1 + any(4)); break;
      case 2: text.insert(at, 1, static_cast<char>(any(256))); break;
      case 3: text.insert(at, 1, text[at]); break;
      case 4: std::swap(text[at], text[other]); break;
      case 5: text[at] = "0123456789,\"\n-."[any(15)]; break;
      case 6: text.resize(at); break;
      case 7:
        lines[1 + any(30)] = lines[1 + any(30)];
        whole_lines = true;
        break;
      case 8:
        std::swap(lines[any(31)], lines[any(31)]);
        whole_lines = true;
        break;
    }
    if (whole_lines) {
      text.clear();
      for (const std::string& line : lines) text += line + "\n";
    }
    std::ofstream(journal(), std::ios::binary) << text;
    std::map<std::int64_t, std::vector<std::string>> now;
    try {
      const study::Journal opened(path("out"), format, {}, true,
                                  [&](const study::JournalRow& r) { now[r.run] = r.fields; });
      named += opened.problems().empty() ? 0 : 1;
    } catch (const inputs::InputError&) {
      ++refused;
      continue;
    }
    for (const auto& [run, fields] : now) EXPECT_EQ(fields, rows[run]) << "corruption " << i;
    std::size_t intact = 0;
    const std::vector<std::string> originals = lines_of(good);
    const std::vector<std::string> there = lines_of(text.substr(0, text.rfind('\n') + 1));
    for (std::size_t k = 1; k < originals.size(); ++k)
      intact += std::count(there.begin(), there.end(), originals[k]) > 0 ? 1 : 0;
    EXPECT_EQ(now.size(), intact) << "corruption " << i;
  }
  EXPECT_EQ(refused, 0) << "with so many good lines the rest is clear";
  EXPECT_GT(named, 500);
}

TEST_F(JournalTest, ABadLineIsNamedAndComputedAnew) {
  const study::Study s = read();
  run(s, "out", 2);
  const std::string runs = runs_csv(s, "out");
  rewrite([](std::vector<std::string>& lines) {
    const std::size_t place =
        lines[4].find("e+") == std::string::npos ? lines[4].find('.') - 1 : lines[4].find('.') - 1;
    lines[4][place] = lines[4][place] == '9' ? '8' : '9';
  });
  const study::RunReport report = run(s, "out", 2, true);
  EXPECT_EQ(report.computed, 1);
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0], journal().string() + ":5: the checksum does not fit the line");
  EXPECT_EQ(runs_csv(s, "out"), runs);
  const study::RunReport again = run(s, "out", 2, true);
  EXPECT_EQ(again.computed, 0);
  EXPECT_TRUE(again.problems.empty()) << "said once";
}

TEST_F(JournalTest, WhatDoesNotGoWithThePlanIsNotBelieved) {
  const study::Study s = read();
  run(s, "out", 2);
  const std::string runs = runs_csv(s, "out"), good = text_of(journal());
  const std::pair<std::function<void(std::vector<std::string>&)>, const char*> changes[]{
      {[](auto& f) { f[0] = "77"; }, "run 77: the study has 30 runs"},
      {[](auto& f) { f[0] = "-1"; }, "run = '-1': not a whole number >= 0"},
      {[](auto& f) { f[0] = "99999999999999999999"; }, "not a whole number"},
      {[](auto& f) { f[1] = "77"; }, "point, replicate or seed are not those of the plan"},
      {[](auto& f) {
         f[2] = "3";
         f[2] += "0";
       },
       "point, replicate or seed are not those of the plan"},
      {[](auto& f) { f[3] = "1"; }, "point, replicate or seed are not those of the plan"},
      {[](auto& f) { f[5] = "many"; }, "cars_off_track = 'many': not a number"},
      {[](auto& f) { f[4] = ""; }, "cars_past_pod = '': not a number"},
      {[](auto& f) {
         for (auto& x : f)
           if (x == "time_max" || x == "at_rest") x = "asleep";
       },
       "ended = 'asleep': unknown"},
      {[](auto& f) { f.erase(f.begin() + 6); }, "fields, but"},
      {[](auto& f) { f[f.size() - 2] = "long"; }, "wall_time = 'long': not a number"},
      {[](auto& f) { f[6] = "\"1"; }, "a double quote is not closed"}};
  for (const auto& [change, why] : changes) {
    std::ofstream(journal(), std::ios::binary) << good;
    rewrite([this, &change = change](std::vector<std::string>& lines) {
      std::vector<std::string> fields;
      std::istringstream in(lines[7]);
      for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
      change(fields);
      std::string line;
      for (const std::string& field : fields) line += (line.empty() ? "" : ",") + field;
      lines[7] = sealed(line);
    });
    const study::RunReport report = run(s, "out", 1, true);
    EXPECT_EQ(report.computed, 1) << why;
    ASSERT_EQ(report.problems.size(), 1U) << why;
    EXPECT_NE(report.problems[0].find(why), std::string::npos) << report.problems[0];
    EXPECT_NE(report.problems[0].find("journal.csv:8: "), std::string::npos) << report.problems[0];
    EXPECT_EQ(runs_csv(s, "out"), runs) << why;
  }
}

TEST_F(JournalTest, JournalsOfOthersAreRefused) {
  const study::Study s = read();
  run(s, "out", 2);
  const auto refused = [&] { return refusal([&] { run(s, "out", 1, true); }); };
  // As version 0.1 wrote it; its first row has a point that does not exist.
  const std::string old =
      "run,point,replicate,seed,\"initial.speed\",cars_past_pod,ended,steps,rhs_evaluations,message,wall_time\n0,3,0,"
      "33,5,1,at_rest,7,5,\"\",0.01\n";
  std::ofstream(journal(), std::ios::binary) << old;
  EXPECT_NE(refused().find("journal.csv:1: a journal of version 0.1: its lines have no checksum"), std::string::npos)
      << refused();
  EXPECT_EQ(text_of(journal()), old) << "left as it is";
  std::ofstream(journal(), std::ios::binary) << "shopping list\nmilk\n";
  EXPECT_NE(refused().find("journal.csv:1: not a journal of this program"), std::string::npos) << refused();
  EXPECT_EQ(text_of(journal()), "shopping list\nmilk\n");

  write("other.yaml", std::string(kStudy) + "outcomes: [stop_time]\n");
  run(read("other.yaml"), "other", 1);
  fs::copy_file(journal("other"), journal(), fs::copy_options::overwrite_existing);
  EXPECT_NE(refused().find("journal.csv:1: a journal of another study"), std::string::npos) << refused();
  rewrite([](std::vector<std::string>& lines) { lines[0].replace(lines[0].find("journal 2"), 9, "journal 3"); });
  EXPECT_NE(refused().find("journal.csv:1: a journal of another format; allowed: format 2"), std::string::npos)
      << refused();
}

TEST_F(JournalTest, TwoRowsOfARunThatDifferAreNamedBoth) {
  const study::Study s = read();
  run(s, "out", 1);
  rewrite([&](std::vector<std::string>& lines) {
    std::string line = lines[3];
    line.replace(line.rfind("time_max"), 8, "at_rest");
    lines.push_back(sealed(line));
  });
  const std::string error = refusal([&] { run(s, "out", 1, true); });
  EXPECT_NE(error.find("journal.csv:4: run 2 differs from the one in " + journal().string() + ":32"), std::string::npos)
      << error;
}

TEST_F(JournalTest, AStudyJsonThatIsBrokenIsNamed) {
  const study::Study s = read();
  run(s, "out", 1);
  const std::string good = text_of(folder_ / "out/study.json");
  const auto error = [&](const std::string& text) {
    std::ofstream(folder_ / "out/study.json", std::ios::binary) << text;
    return refusal([&] { run(s, "out", 1, true); });
  };
  EXPECT_NE(error("").find("study.json:1: not JSON"), std::string::npos);
  EXPECT_NE(error(good.substr(0, good.size() / 2)).find(": not JSON"), std::string::npos);
  EXPECT_NE(error("{\n\"title\": \xFF\n}").find("study.json:2: not JSON"), std::string::npos)
      << error("{\n\"title\": \xFF\n}");
  EXPECT_NE(error(std::string(100000, '[')).find("nested more than 20 deep"), std::string::npos);
  EXPECT_THROW(error("[]"), std::runtime_error);
  EXPECT_EQ(error(good), "no error");
  fs::remove(folder_ / "out/study.json");
  EXPECT_THROW(run(s, "out", 1, true), std::runtime_error) << "a journal but no study.json";
}

TEST_F(JournalTest, RunsThatAreInAnotherShardsJournalAreNotComputedAgain) {
  const study::Study s = read();
  run(s, "whole", 2);
  run(s, "out", 1, false, {1, 3});
  run(s, "out", 1, true, {2, 2});
  const study::RunReport rest = run(s, "out", 1, true);
  EXPECT_EQ(rest.computed, 10) << "every third is there, and of the others every second";
  EXPECT_EQ(runs_csv(s, "out"), runs_csv(s, "whole"));
}

TEST_F(JournalTest, OneProcessAShard) {
  const study::Study s = read();
  run(s, "out", 1, false, {1, 2});
  const study::JournalFormat format = study::journal_format(s);
  const study::Journal held(path("out"), format, {1, 2}, true, [](const study::JournalRow&) {});
  EXPECT_THROW(run(s, "out", 1, true, {1, 2}), std::runtime_error);
  EXPECT_NO_THROW(run(s, "out", 1, true, {2, 2}));
}

// Killed at any moment, from before the first file to after the last one, a study resumes to the same bytes, and
// nothing else is left.
TEST_F(JournalTest, KilledAtAnyMomentAStudyResumesToTheSameBytes) {
  const study::Study s = read();
  run(s, "whole", 2);
  study::write_results(path("whole"), s, 0.0);
  const auto compute = [&](const std::string& out, bool resume) {
    run(s, out, 1, resume);
    study::write_results(path(out), s, 0.0);
  };
  for (int moment = 0; moment < 34; ++moment) {
    const std::string out = "killed" + std::to_string(moment);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      compute(out, false);
      for (;;) study::write_results(path(out), s, 0.0);  // at whatever of it
    }
    const auto reached = [&] {
      if (moment == 0) return true;
      if (moment == 1) return fs::exists(folder_ / out / "study.json");
      const std::string text = text_of(journal(out));
      if (moment < 32) return std::count(text.begin(), text.end(), '\n') >= moment - 1;
      return fs::exists(folder_ / out / (moment == 32 ? "runs.csv" : "about.json"));
    };
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!reached() && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    ASSERT_TRUE(reached());
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    compute(out, true);
    for (const char* name : {"runs.csv", "summary.csv", "study.json"}) {
      EXPECT_EQ(text_of(folder_ / out / name), text_of(folder_ / "whole" / name)) << name << ", moment " << moment;
    }
    EXPECT_EQ(files_in(out), files_in("whole")) << "moment " << moment;
  }
}

TEST_F(JournalTest, TheCommandNamesBadLines) {
  ASSERT_EQ(derail("study study.yaml --out out --quiet").code, 0);
  const std::string runs = text_of(folder_ / "out/runs.csv");
  rewrite([](std::vector<std::string>& lines) { lines[9][3] = '!'; });
  const test::Result r = derail("study study.yaml --out out --resume --quiet");
  EXPECT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("journal.csv:10: the checksum does not fit the line; computed again"), std::string::npos)
      << r.out;
  EXPECT_EQ(text_of(folder_ / "out/runs.csv"), runs);
  EXPECT_EQ(derail("study study.yaml --out out --quiet").code, 1) << "not without --resume";
}

}  // namespace
}  // namespace train_derail
