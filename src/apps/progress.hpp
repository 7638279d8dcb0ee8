/// \file
/// A line that shows the progress, if standard error is a terminal.
#pragma once

#include <chrono>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

namespace train_derail::apps {

class ProgressLine {
 public:
  explicit ProgressLine(bool wanted) : shown_(wanted && isatty(STDERR_FILENO) == 1) {}
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool shown() const { return shown_; }

  /// Draws the line anew, at most ten times a second. `done` is in [0, 1].
  void update(double done, const std::string& what) {
    if (!shown_) return;
    const auto now = Clock::now();
    if (now - drawn_ < std::chrono::milliseconds(100)) return;
    drawn_ = now;
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    const double eta = done > 0.0 ? elapsed * (1.0 - done) / done : 0.0;
    fmt::print(stderr, "\r\033[K{:3.0f} %  {}  elapsed {:.1f} s  ETA {:.1f} s", 100.0 * done, what, elapsed, eta);
    std::fflush(stderr);
    dirty_ = true;
  }

  void clear() {
    if (dirty_) fmt::print(stderr, "\r\033[K");
    dirty_ = false;
  }

 private:
  using Clock = std::chrono::steady_clock;
  const bool shown_;
  bool dirty_ = false;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point drawn_{};
};

}  // namespace train_derail::apps
