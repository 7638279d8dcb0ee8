// A study on the node, by its action ~run_study. Knows neither Qt nor RViz.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "rviz/sweep.hpp"
#include "rviz/worker.hpp"

namespace train_derail::rviz_panel {

/// What is known of the study at one instant.
struct StudyView {
  enum class State { none, waiting, running, done, failed, cancelled };
  State state = State::none;
  std::int64_t done = 0, total = 0, failed = 0;  // runs; total 0: not known yet
  double eta = 0.0;                              // wall time that is left [s]
  std::string message;                           // of the node, or why there is no answer
  std::string folder;                            // of the results, on the node's machine
  std::string table;                             // medians and ranges as text
  std::shared_ptr<const SweepResult> result;     // null: not done, or the folder cannot be read on this machine
  std::string unreadable;                        // then: why

  bool under_way() const { return state == State::waiting || state == State::running; }
};

/// One study at a time. Never makes the caller wait; all methods are for one thread.
class StudyLink {
 public:
  StudyLink();
  ~StudyLink();
  StudyLink(const StudyLink&) = delete;
  StudyLink& operator=(const StudyLink&) = delete;

  /// `folder`: below the node's folder of results. Nothing happens while a study is under way.
  void start(const std::string& node, const std::string& study_text, const std::string& folder);
  /// What is done stays on disk.
  void cancel();
  StudyView view() const;

 private:
  struct Core;
  std::shared_ptr<Core> core_;
  Worker worker_;
};

}  // namespace train_derail::rviz_panel
