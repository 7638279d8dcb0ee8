// What commands do with paths: nothing is written over, nothing is left half, wrong files are told by name.
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <map>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "command_line.hpp"
#include "train_derail/files/csv.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
using test::derail;
using test::Result;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;
const std::string kBaseline = kSource + "/config/baseline.yaml";
const std::string kStudy = kSource + "/config/studies/monte_carlo.yaml";
const std::string kAccidents = kSource + "/config/accidents/example.csv";
const std::string kShort = " --set \"consist[0].count=5\" --set \"stop.time_max=1 s\"";

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// A running `derail`; what it prints goes into a file.
class Running {
 public:
  Running(const std::vector<std::string>& arguments, const std::string& errors) {
    std::vector<char*> argv;
    static std::string program = TRAIN_DERAIL_CLI;
    argv.push_back(program.data());
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(open(errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDERR_FILENO);
      dup2(STDERR_FILENO, STDOUT_FILENO);
      execv(program.c_str(), argv.data());
      _exit(127);
    }
  }
  /// Waits until it would end in good order on this signal; false if that does not come within a minute.
  bool catches(int number) const {
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::minutes(1)) {
      const std::string status = content("/proc/" + std::to_string(pid_) + "/status");
      const auto caught = status.find("SigCgt:");
      if (caught != std::string::npos && (std::stoull(status.substr(caught + 7), nullptr, 16) >> (number - 1) & 1) == 1)
        return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  void signal(int number) const { kill(pid_, number); }
  /// Of its end, which has to come within a minute.
  int code() {
    int status = -1;
    const auto start = std::chrono::steady_clock::now();
    while (waitpid(pid_, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() - start > std::chrono::minutes(1)) return -1;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  ~Running() {
    if (pid_ < 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

 private:
  pid_t pid_ = -1;
};

class CliFiles : public test::Cli {
 protected:
  void SetUp() override {
    Cli::SetUp();
    fs::copy_file(kBaseline, at("train.yaml"));
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
  }
  std::ptrdiff_t count() const { return std::distance(fs::directory_iterator(folder_), fs::directory_iterator()); }
  /// Starts a run with these arguments, kills it once it has begun to write to the pipe `pipe`, and looks that nothing
  /// is left of it after the next run in the folder.
  void kill_in_the_middle(const std::vector<std::string>& arguments, const std::string& pipe) {
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const std::ptrdiff_t before = count();
    const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    Running run(arguments, "/dev/null");
    pollfd ready{reader, POLLIN, 0};
    ASSERT_EQ(poll(&ready, 1, 60000), 1);
    run.signal(SIGKILL);
    EXPECT_EQ(run.code(), 128 + SIGKILL);
    close(reader);
    EXPECT_EQ(derail("run " + at("train.yaml") + kShort + " --json " + at("next.json")).code, 0);
    EXPECT_EQ(count(), before + 1);
  }
};

TEST_F(CliFiles, WhatExistsIsWrittenOverOnlyByForce) {
  const std::string names = " --csv " + at("a.csv") + " --json " + at("o.json") + " --incidents " + at("i.csv");
  put("i.csv", "mine");
  const Result refused = derail("run " + at("train.yaml") + kShort + names);
  EXPECT_EQ(refused.code, 1);
  EXPECT_EQ(refused.out, "derail: " + at("i.csv") + ": exists already and is not overwritten; --force replaces it\n");
  EXPECT_EQ(content(at("i.csv")), "mine");
  EXPECT_FALSE(fs::exists(at("a.csv")));
  EXPECT_EQ(derail("run --force " + at("train.yaml") + kShort + names).code, 0);
  EXPECT_EQ(content(at("i.csv")).substr(0, 7), "time_s,");
  EXPECT_EQ(count(), 4);
}

TEST_F(CliFiles, APageThatFailsDoesNotLoseTheOtherFiles) {
  for (const auto& [end, said] : {std::pair{"os._exit(7)", "make_page.py: exit code 7"},
                                  std::pair{"os.kill(os.getpid(), 9)", "make_page.py: killed by signal 9"}}) {
    put("sitecustomize.py",
        std::string("import os, sys\nif '--check' not in sys.orig_argv: ") + end + "\n");  // while the page is made
    const Result r = test::run("PYTHONPATH=" + at("") + " " + TRAIN_DERAIL_CLI + " run --force " + at("train.yaml") +
                               kShort + " --csv " + at("a.csv") + " --json " + at("o.json") + " --incidents " +
                               at("i.csv") + " --html " + at("p.html") + " 2>&1");
    EXPECT_EQ(r.code, 1);
    EXPECT_NE(r.out.find(said), std::string::npos) << r.out;
    EXPECT_FALSE(fs::exists(at("p.html")));
    for (const char* name : {"a.csv", "o.json", "i.csv"}) {
      EXPECT_TRUE(fs::exists(at(name))) << name;
      fs::remove(at(name));
    }
  }
}

TEST_F(CliFiles, ACheckpointGoesOnWithTheRunAndIsRefusedBeforeTheComputing) {
  const std::string steps = " --set solver.method=semi_implicit --set solver.fixed_step=2e-4 --quiet";
  const std::string run = "run " + at("train.yaml") + kShort + steps;
  // All but the computing time is as in the run that was not saved.
  const auto outcome = [&](const std::string& options) {
    const Result r = derail(run + options + " --json -");
    EXPECT_EQ(r.code, 0) << r.out;
    auto json = nlohmann::json::parse(r.out);
    json.erase("wall_time");
    return json;
  };
  const auto whole = outcome("");
  EXPECT_EQ(outcome(" --checkpoint " + at("half") + " --checkpoint-time \"0.5 s\""), whole);
  EXPECT_EQ(outcome(" --from " + at("half")), whole);
  EXPECT_EQ(outcome(" --checkpoint " + at("end")), whole);
  EXPECT_EQ(outcome(" --from " + at("end")), whole);

  const std::string before = content(at("half"));
  const Result existing = derail("run " + at("train.yaml") + steps +
                                 " --set consist[0].count=1000 --set stop.time_max=1000 --checkpoint " + at("half"));
  EXPECT_EQ(existing.code, 1);
  EXPECT_EQ(content(at("half")), before);
  for (const auto& [options, says] : {std::pair{" --checkpoint-time \"5 s\"", "nothing is to be saved"},
                                      std::pair{" --checkpoint-time soon --checkpoint c", "--checkpoint-time = 'soon'"},
                                      std::pair{" --checkpoint-time=-1 --checkpoint c", "before the run begins"},
                                      std::pair{" --seeds 3 --checkpoint c", "--checkpoint"}}) {
    const Result wrong = derail(run + options);
    EXPECT_EQ(wrong.code, 2) << options;
    EXPECT_NE(wrong.out.find(says), std::string::npos) << wrong.out;
  }
  const Result smooth = derail("run " + at("train.yaml") + " --checkpoint " + at("smooth"));
  EXPECT_EQ(smooth.code, 2);
  EXPECT_FALSE(fs::exists(at("smooth")));
  EXPECT_EQ(derail("run " + at("train.yaml") + kShort + " --from " + at("half")).code, 2);
  EXPECT_EQ(derail(run + " --from " + at("train.yaml")).code, 2);
}

TEST_F(CliFiles, OutputsAreNeitherInputsNorEachOther) {
  const std::string before = content(at("train.yaml"));
  fs::create_symlink(at("train.yaml"), at("link"));
  for (const std::string option : {"--csv ", "--json ", "--incidents ", "--bag "}) {
    for (const char* name : {"train.yaml", "link", "./train.yaml"}) {
      const Result r = derail("run --force " + at("train.yaml") + kShort + " " + option + at(name));
      EXPECT_EQ(r.code, 2) << r.out;
      EXPECT_NE(r.out.find("is the same file as FILE"), std::string::npos) << r.out;
    }
  }
  const Result twice = derail("run " + at("train.yaml") + kShort + " --csv " + at("new") + " --json " + at("./new"));
  EXPECT_EQ(twice.code, 2);
  EXPECT_NE(twice.out.find("is the same file as --csv"), std::string::npos) << twice.out;
  EXPECT_EQ(derail("run " + at("train.yaml") + kShort + " --csv - --json -").code, 2);
  EXPECT_EQ(derail("run " + at("train.yaml") + kShort + " --csv ''").code, 2);
  EXPECT_EQ(derail("verify --force " + at("train.yaml") + " --json " + at("train.yaml")).code == 0, false);
  EXPECT_EQ(content(at("train.yaml")), before);
  EXPECT_EQ(count(), 2);
}

TEST_F(CliFiles, StandardOutputIsAFileLikeOthers) {
  const Result csv = derail("run " + at("train.yaml") + kShort + " --csv -", false);
  EXPECT_EQ(csv.code, 0);
  EXPECT_EQ(csv.out.substr(0, 11), "time_s,car,");
  EXPECT_EQ(csv.out.find("energy at the start"), std::string::npos) << "a table among the rows";
  EXPECT_EQ(derail("run --quiet " + at("train.yaml") + kShort + " --csv /dev/stdout | cat", false).out, csv.out);
  derail("run --quiet " + at("train.yaml") + kShort + " --csv /dev/stdout > " + at("a.csv"), false);
  EXPECT_EQ(content(at("a.csv")), csv.out);
}

TEST_F(CliFiles, AFullDeviceIsToldByEveryCommand) {
  for (const std::string& command :
       {std::string("--version"), std::string("--help"), std::string("keys"), std::string("run --help"),
        "check " + at("train.yaml"), "run " + at("train.yaml") + kShort,
        "run " + at("train.yaml") + kShort + " --json -"}) {
    for (const char* where : {" > /dev/full", " >&-"}) {
      const Result r = derail(command + where, false);
      EXPECT_EQ(r.code, 1) << command << where;
    }
  }
  // A stream that is closed does not lend its number to a file.
  EXPECT_EQ(derail("run " + at("train.yaml") + kShort + " --csv " + at("a.csv") + " >&-", false).code, 1);
  EXPECT_EQ(content(at("a.csv")).find("energy at the start"), std::string::npos);
}

TEST_F(CliFiles, WrongFilesAreToldByName) {
  put("empty", "");
  put("blank", "\n# nothing\n\n");
  put("bin", std::string("\0\1\2\3", 4));
  put("bag.bag", "#ROSBAG V2.0\n");
  put("page.html", "<!DOCTYPE html>\n<html>");
  put("sim.launch", "<launch>\n</launch>");
  ASSERT_EQ(mkfifo(at("pipe").c_str(), 0600), 0);
  fs::create_directory(at("folder"));
  const std::string outputs =
      " --csv " + at("states.csv") + " --incidents " + at("incidents.csv") + " --json " + at("outcome.json");
  ASSERT_EQ(derail("run " + at("train.yaml") + kShort + outputs).code, 0);
  put("huge.csv", "a,b,c\n" + std::string(2000000, 'x'));
  put("train.csv", "Position,Car Kind,L/E\n1,locomotive,\n");
  put("less.yaml", "base: one.study.yaml\nreplicates: 3\n");
  const std::ptrdiff_t files = count();
  const std::string study = " --study " + kStudy, changed = kSource + "/config/accident3d.yaml";
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"run " + kStudy, "is a study (derail study takes it); allowed: a scenario"},
      {"check " + kStudy, "is a study"},
      {"verify " + kStudy, ""},
      {"run " + kAccidents, "is a table of accidents (derail validate takes it)"},
      {"run " + at("states.csv"), "is a table of the states of a run (plot_run.py takes it)"},
      {"run " + at("incidents.csv"), "is a table of the incidents of a run"},
      {"run " + at("outcome.json"), "is a file of the outcome of a run (JSON)"},
      {"run " + at("huge.csv"), "is a table (CSV)"},
      {"run " + at("folder"), "is a folder without results"},
      {"run -", "is standard input"},
      {"run " + at("empty"), "is an empty file"},
      {"run " + at("blank"), "is a file without content"},
      {"run " + at("bin"), "is a binary file"},
      {"run " + at("bag.bag"), "is a bag of messages"},
      {"run " + at("page.html"), "is a page of HTML"},
      {"run " + at("sim.launch"), "is a launch file (roslaunch takes it)"},
      {"run " + at("pipe"), "is a pipe"},
      {"run /dev/zero", "is a device"},
      {"study " + at("train.yaml"), "is a scenario (derail run takes it); allowed: a study"},
      {"study " + changed, "is a scenario (derail run takes it); allowed: a study"},
      {"validate " + kAccidents + " --study " + changed, "is a scenario (derail run takes it); allowed: a study"},
      {"run " + at("less.yaml"), "is a study (derail study takes it); allowed: a scenario"},
      {"validate " + at("train.csv") + study,
       "train.csv:1: missing columns: speed_mph, n_cars, tons_per_car, head_end_locos, mid_locos, rear_locos, "
       "first_car_position, cars_from_pod_to_rear, cars_derailed; allowed: a table of accidents, CSV"},
      {"run " + changed + " --set \"intial.speed=40 mph\"",
       "derail: --set: intial.speed = '40 mph': unknown key 'intial'"},
      {"run " + changed + " --set \"initial.speed=-1\"", "derail: --set: initial.speed = '-1': out of range"},
      {"run --hlep", "--hlep: no such option; help: derail run --help"},
      {"study --hlep", "--hlep: no such option; help: derail study --help"},
      {"--hlep", "--hlep: no such option; help: derail --help"},
      {"study " + at("states.csv"), "allowed: a study"},
      {"merge " + at("train.yaml"), "is a scenario"},
      {"merge " + kStudy + " " + at("folder"),
       "is a folder without results; allowed: a folder with the results of derail study"},
      {"merge " + kStudy + " " + at("none"), "does not exist"},
      {"report " + at("folder"), "is a folder without results"},
      {"report " + at("none"), "does not exist"},
      {"report " + at("states.csv"), "is a table of the states of a run"},
      {"report -", "is standard input"},
      {"validate " + at("train.yaml") + study, "is a scenario (derail run takes it); allowed: a table of accidents"},
      {"validate " + at("folder") + study, "is a folder"},
      {"validate " + kAccidents + " --study " + at("train.yaml"),
       "is a scenario (derail run takes it); allowed: a study"},
      {"fly " + at("train.yaml"),
       "'fly' is not a command; commands: run, check, keys, fields, study, merge, report, validate, verify"},
      {"run " + at("train.yaml") + " --fast", "--fast"},
      {"", "subcommand is required"}};
  for (const auto& [command, said] : wrong) {
    const Result r = derail("" + command);
    if (command.compare(0, 6, "verify") == 0 && r.code == 1) continue;  // a build without the engine
    EXPECT_EQ(r.code, 2) << command;
    EXPECT_NE(r.out.find(said), std::string::npos) << command << ": " << r.out;
    EXPECT_EQ(std::count(r.out.begin(), r.out.end(), '\n'), 1) << r.out;
    EXPECT_LT(r.out.size(), 400U) << command;
  }
  EXPECT_EQ(count(), files) << "something has been created";
}

TEST_F(CliFiles, ResultsOfOthersAreNoStudys) {
  put("one.study.yaml", "scenario: train.yaml\nfactors:\n  - {key: initial.speed, values: [10 mph]}\nplan: grid\n");
  for (const char* name : {"runs.csv", "summary.csv", "about.json", "rows.csv", "validation.json"}) {
    fs::create_directory(at("out"));
    put(std::string("out/") + name, "mine");
    const Result r = derail("study " + at("one.study.yaml") + " --set stop.time_max=1 --out " + at("out"));
    EXPECT_EQ(r.code, 1) << r.out;
    EXPECT_EQ(r.out, "derail: " + at("out") + ": holds " + name + " but no study.json: not a folder of this program\n");
    EXPECT_EQ(content(at(std::string("out/") + name)), "mine");
    EXPECT_FALSE(fs::exists(at("out/study.json")));
    fs::remove_all(at("out"));
  }
}

TEST_F(CliFiles, AReportReplacesItselfAlone) {
  put("one.study.yaml", "scenario: train.yaml\nfactors:\n  - {key: initial.speed, values: [10 mph]}\nplan: grid\n");
  ASSERT_EQ(derail("study " + at("one.study.yaml") + " --set stop.time_max=1 --out " + at("out")).code, 0);
  EXPECT_EQ(derail("report " + at("out")).code, 0);
  EXPECT_EQ(derail("report " + at("out")).code, 0) << "a page of its own";
  ASSERT_EQ(derail("report " + at("out") + " --out " + at("named.html")).code, 0);
  const Result again = derail("report " + at("out") + " --out " + at("named.html"));
  EXPECT_EQ(again.code, 1);
  EXPECT_NE(again.out.find("--force replaces it"), std::string::npos) << again.out;
  EXPECT_EQ(derail("report --force " + at("out") + " --out " + at("named.html")).code, 0);
  put("page.html", "<html>mine</html>");
  EXPECT_EQ(derail("report " + at("out") + " --out " + at("page.html")).code, 1);
  EXPECT_EQ(content(at("page.html")), "<html>mine</html>");
  const std::string before = content(at("out/runs.csv"));
  EXPECT_EQ(derail("report --force " + at("out") + " --out " + at("out/runs.csv")).code, 2);
  EXPECT_EQ(content(at("out/runs.csv")), before);
  EXPECT_EQ(derail("run " + at("out")).code, 2);
}

/// The rows of a table, without its header.
std::vector<std::vector<std::string>> rows(const std::string& path) {
  files::CsvTable table(path);
  std::vector<std::vector<std::string>> all;
  for (std::vector<std::string> row; table.next(row);) all.push_back(row);
  return all;
}

TEST_F(CliFiles, AThinnedTableHasRowsOfTheWholeOneAndThePeaksOfItsIntervals) {
  const std::string run = "run --quiet " + at("train.yaml") + " --set \"consist[0].count=5\" --set stop.time_max=1.05";
  ASSERT_EQ(derail(run + " --csv " + at("all.csv")).code, 0);
  ASSERT_EQ(derail(run + " --csv " + at("some.csv") + " --every 0.1s --cars 2-3,5").code, 0);
  const files::CsvTable table(at("all.csv"));
  EXPECT_EQ(files::CsvTable(at("some.csv")).names(), table.names());
  const std::array<std::size_t, 2> peaks{table.column("buff_peak_N"), table.column("draft_peak_N")};
  const auto all = rows(at("all.csv")), some = rows(at("some.csv"));
  std::vector<double> times;
  std::size_t next = 0, larger = 0;
  std::map<std::pair<std::string, std::size_t>, double> largest;  // by car and column, since its last row
  for (const auto& row : all) {
    for (const std::size_t p : peaks) {
      double& most = largest[{row[1], p}];
      if (!row[p].empty()) most = std::max(most, std::stod(row[p]));
    }
    ASSERT_LE(next, some.size());
    if (next == some.size() || some[next][0] != row[0] || some[next][1] != row[1]) continue;
    times.push_back(std::stod(row[0]));
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (std::find(peaks.begin(), peaks.end(), c) == peaks.end() || row[c].empty()) {
        EXPECT_EQ(some[next][c], row[c]) << row[0] << " " << table.names()[c];
        continue;
      }
      EXPECT_EQ(std::stod(some[next][c]), (largest[{row[1], c}])) << row[0] << " " << table.names()[c];
      if (some[next][c] != row[c]) ++larger;
      largest[{row[1], c}] = 0.0;
    }
    ++next;
  }
  EXPECT_EQ(next, some.size()) << "a row that the whole table does not have";
  EXPECT_GT(larger, 0U);
  ASSERT_EQ(times.size(), 3 * 12U);  // 0, 0.1, ... 1.0, and the last state
  for (std::size_t i = 0; i < times.size(); ++i)
    EXPECT_NEAR(times[i], i / 3 < 11 ? 0.1 * static_cast<double>(i / 3) : 1.05, 1e-9);
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_EQ(some[i][1], (std::array{"2", "3", "5"})[i % 3]);
}

TEST_F(CliFiles, ATableHasTheColumnsThatAreAskedFor) {
  const std::string run = "run --quiet " + at("train.yaml") + kShort + " --csv ";
  ASSERT_EQ(derail(run + at("two.csv") + " --columns x_m,buff_peak --columns time_s,y_m").code, 0);
  EXPECT_EQ(files::CsvTable(at("two.csv")).names(),
            (std::vector<std::string>{"time_s", "car", "x_m", "buff_peak_N", "y_m"}));
  const std::ptrdiff_t before = count();
  for (const auto& [options, says] :
       {std::pair{"--columns x_n", "no column 'x_n'; near it: x_m"},
        std::pair{"--columns force", "near it: axial_force_N, lateral_force_N, vertical_force_N"},
        std::pair{"--columns nothing", "the columns are: x_m, y_m"}, std::pair{"--columns x_m,x", "asked for twice"},
        std::pair{"--cars 3-2", "'3-2': the train has 5 cars"}, std::pair{"--cars 6", "'6': the train has 5 cars"},
        std::pair{"--cars first", "'first' is not a number or range"}, std::pair{"--cars ''", "no car"},
        std::pair{"--every 0.05", "not a multiple of output.interval, 0.02 s; allowed: 0.04 s, 0.06 s"},
        std::pair{"--every 0", "allowed: 0.02 s"}, std::pair{"--every soon", "--every = 'soon'"},
        std::pair{"--every 1ft", "--every = '1ft'"}, std::pair{"--seeds 2 --every 1", "chooses what of one run"}}) {
    const Result wrong = derail(run + at("wrong.csv") + " " + options);
    EXPECT_EQ(wrong.code, 2) << options << wrong.out;
    EXPECT_NE(wrong.out.find(says), std::string::npos) << options << ": " << wrong.out;
    EXPECT_LT(wrong.out.size(), 1200U);
  }
  EXPECT_EQ(derail("run --quiet " + at("train.yaml") + kShort + " --cars 1").code, 2);
  EXPECT_EQ(count(), before);
}

#ifdef TRAIN_DERAIL_GZIP
TEST_F(CliFiles, ACompressedTableIsTheSameTable) {
  const std::string run = "run --quiet " + at("train.yaml") + kShort;
  ASSERT_EQ(derail(run + " --csv " + at("a.csv") + " --incidents " + at("i.csv")).code, 0);
  ASSERT_EQ(derail(run + " --csv " + at("a.csv.gz") + " --incidents " + at("i.csv.gz")).code, 0);
  for (const char* name : {"a.csv", "i.csv"}) {
    EXPECT_EQ(test::run("gzip -cd " + at(name) + ".gz").out, content(at(name)));
    EXPECT_EQ(content(at(name) + ".gz").substr(0, 2), "\x1f\x8b");
  }
  EXPECT_LT(fs::file_size(at("a.csv.gz")) * 2, fs::file_size(at("a.csv")));
  const std::string first = content(at("a.csv.gz"));
  ASSERT_EQ(derail(run + " --force --csv " + at("a.csv.gz")).code, 0);
  EXPECT_EQ(content(at("a.csv.gz")), first);
  EXPECT_EQ(derail(run + " --csv /dev/full").code, 1);
  ASSERT_EQ(derail(run + " --set initial.perturbation.spacing=0.01 --seeds 2 --csv " + at("seeds.csv.gz")).code, 0);
  EXPECT_EQ(test::run("gzip -cd " + at("seeds.csv.gz")).out.substr(0, 4), "run,");
}

TEST_F(CliFiles, KilledARunLeavesNoHalfCompressedTable) {
  const std::string pipe = at("states");
  // The checkpoint, which the pipe holds up, comes when there are rows.
  kill_in_the_middle({"run", kBaseline, "--set", "solver.method=semi_implicit", "--set", "solver.fixed_step=2e-4",
                      "--csv", at("a.csv.gz"), "--checkpoint", pipe, "--checkpoint-time", "0.1 s"},
                     pipe);
}
#endif

// The pipe holds the run up until the signal has been sent.
TEST_F(CliFiles, InterruptedARunIsWrittenAsFarAsItCame) {
  for (const int number : {SIGINT, SIGTERM}) {
    const std::string pipe = at("states"), json = at("o.json"), incidents = at("i.csv");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    Running run(
        {"run", kBaseline, "--set", "output.interval=1 ms", "--csv", pipe, "--json", json, "--incidents", incidents},
        at("errors"));
    pollfd ready{reader, POLLIN, 0};
    ASSERT_EQ(poll(&ready, 1, 60000), 1);
    run.signal(number);
    fcntl(reader, F_SETFL, 0);
    std::string states;
    std::array<char, 4096> buffer;
    for (ssize_t n; (n = read(reader, buffer.data(), buffer.size())) > 0;) {
      states.append(buffer.data(), static_cast<std::size_t>(n));
    }
    close(reader);
    EXPECT_EQ(run.code(), 130) << content(at("errors"));
    EXPECT_EQ(states.back(), '\n');
    const auto j = nlohmann::json::parse(content(json));
    EXPECT_EQ(j.at("ended"), "running");
    EXPECT_EQ(j.at("message"), "interrupted");
    EXPECT_NE(j.at("warnings").back().get<std::string>().find("interrupted at "), std::string::npos);
    EXPECT_EQ(content(incidents).substr(0, 7), "time_s,");
    EXPECT_NE(content(at("errors")).find("written up to there: " + pipe + ", " + incidents + ", " + json),
              std::string::npos)
        << content(at("errors"));
    for (const std::string& name : {pipe, json, incidents}) fs::remove(name);
  }
}

TEST_F(CliFiles, AnEnsembleThatIsStoppedBeforeItsFirstRunHasNoNumbers) {
  Running run({"run", kBaseline, "--set", "consist[0].count=1000", "--set", "initial.perturbation.spacing=1 cm",
               "--seeds", "2", "--csv", at("runs.csv"), "--json", at("summary.json")},
              at("errors"));
  ASSERT_TRUE(run.catches(SIGINT));
  run.signal(SIGINT);
  EXPECT_EQ(run.code(), 130);
  EXPECT_EQ(content(at("errors")), "derail: stopped before any of 2 runs was finished; nothing has been written\n");
  EXPECT_FALSE(fs::exists(at("runs.csv")) || fs::exists(at("summary.json")));
}

TEST_F(CliFiles, APipeThatNobodyReadsOnDoesNotHoldUpTheEnd) {
  const std::string pipe = at("states");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  Running run({"run", kBaseline, "--set", "output.interval=1 ms", "--csv", pipe, "--json", at("o.json")}, at("errors"));
  pollfd ready{reader, POLLIN, 0};
  ASSERT_EQ(poll(&ready, 1, 60000), 1);
  const auto start = std::chrono::steady_clock::now();
  run.signal(SIGTERM);
  EXPECT_EQ(run.code(), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));  // generous; it takes one or two
  // The file that failed does not keep the other from being written.
  EXPECT_EQ(nlohmann::json::parse(content(at("o.json"))).at("message"), "interrupted");
  close(reader);
}

TEST_F(CliFiles, KilledARunLeavesNothing) {
  const std::string pipe = at("states");
  kill_in_the_middle({"run", kBaseline, "--csv", pipe, "--json", at("o.json"), "--incidents", at("i.csv")}, pipe);
}

}  // namespace
}  // namespace train_derail
