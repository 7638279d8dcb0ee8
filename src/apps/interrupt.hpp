// Interrupted, a command ends soon, after writing what it has. Interrupted again, it ends at once.
#pragma once

#include <atomic>
#include <csignal>

#include <signal.h>

namespace train_derail::apps {

inline constexpr int kInterrupted = 130;

inline std::atomic<bool> stop{false};  // written by the signal handler, hence here

inline void stop_on_signals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { stop = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // of a pipe whose reader has gone: an error of that file
}

/// For what follows the computing: it does not look at `stop`, and leaves nothing half when it is killed.
inline void end_on_signals() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace train_derail::apps
