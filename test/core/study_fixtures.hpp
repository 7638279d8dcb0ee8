// A folder with a small study, and what tests do with it.
#pragma once

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "folder.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::test {

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class StudyFolder : public Folder {
 protected:
  void SetUp() override {
    write("scenario.yaml",
          "consist:\n  - {count: 4, length: 61.1 ft, weight: 150 kip}\n"
          "initial: {speed: 20 mph, yaw_rate: 0.2}\nstop: {time_max: 2 s}\n");
    write("study.yaml", kStudy);
  }

  std::string path(const std::string& name) const { return at(name); }
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
  study::RunReport run(const study::Study& s, const std::string& out, int jobs, bool resume = false,
                       study::Shard shard = {}) {
    const std::atomic<bool> stop{false};
    return study::run_study(
        s, {path(out), jobs, resume, shard}, [](const study::Progress&) {}, stop);
  }
  std::string runs_csv(const study::Study& s, const std::string& out) {
    study::write_runs(path(out), s);
    return text_of(folder_ / out / "runs.csv");
  }
  std::set<std::string> files_in(const std::string& out) const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / out))
      names.insert(entry.path().filename().string());
    return names;
  }
  /// The program itself, in the folder.
  Result derail(const std::string& arguments) const { return derail_in(folder_, arguments); }

  static constexpr const char* kStudy =
      "title: test\nscenario: scenario.yaml\nplan: one_at_a_time\nfactors:\n"
      "  - {key: initial.speed, scale: [0.5, 1.0, 1.5]}\n"
      "  - {key: ground.off_track_friction, values: [0.3, 30 %, 0.7]}\n"
      "replicates: 5\nperturbation: {spacing: 3 mm, yaw_rate: 0.01}\nseed: 7\n";
};

}  // namespace train_derail::test
