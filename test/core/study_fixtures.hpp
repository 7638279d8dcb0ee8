// A folder with a small study, and what tests do with it.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::test {

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class StudyFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "derail_study_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("scenario.yaml",
          "consist:\n  - {count: 4, length: 61.1 ft, weight: 150 kip}\n"
          "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 2 s}\n");
    write("study.yaml", kStudy);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name, std::ios::binary) << text; }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  study::Study read(const std::string& name = "study.yaml") { return study::read_study_file(path(name)); }
  /// Of a study that is wrong, without the path.
  std::string error_of(const std::string& text) {
    write("wrong.yaml", text);
    try {
      read("wrong.yaml");
    } catch (const inputs::InputError& e) {
      return std::string(e.what()).substr(path("wrong.yaml").size());
    }
    return "no error";
  }
  /// What the InputError of a call says.
  template <class Call>
  static std::string refusal(const Call& call) {
    try {
      call();
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "no error";
  }
  study::RunReport run(const study::Study& s, const std::string& out, int jobs, bool resume = false, study::Shard shard = {}) {
    const std::atomic<bool> stop{false};
    return study::run_study(s, {path(out), jobs, resume, shard}, [](const study::Progress&) {}, stop);
  }
  std::string runs_csv(const study::Study& s, const std::string& out) {
    study::write_runs(path(out), s);
    return text_of(folder_ / out / "runs.csv");
  }
  std::set<std::string> files_in(const std::string& out) const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / out)) names.insert(entry.path().filename().string());
    return names;
  }
  struct Result {
    int code;
    std::string out;
  };
  /// The program itself, in the folder.
  Result derail(const std::string& arguments) {
    const int status = std::system(("cd " + folder_.string() + " && " + TRAIN_DERAIL_CLI + " " + arguments + " > said 2>&1").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(folder_ / "said")};
  }

  static constexpr const char* kStudy =
      "title: test\nscenario: scenario.yaml\nplan: one_at_a_time\nfactors:\n"
      "  - {key: initial.speed, scale: [0.5, 1.0, 1.5]}\n"
      "  - {key: ground.off_track_friction, values: [0.3, 30 %, 0.7]}\n"
      "replicates: 5\nperturbation: {spacing: 3 mm, yaw_rate: 0.01}\nseed: 7\n";
  std::filesystem::path folder_;
};

}  // namespace train_derail::test
