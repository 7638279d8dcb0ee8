/// \file
/// Signals. After the first interrupt a command ends soon and writes what it has; after the second it ends at once.
#pragma once

#include <atomic>
#include <csignal>

#include <signal.h>

namespace train_derail::apps {

inline std::atomic<bool> stop{false};  // global, because the signal handler sets it

inline void stop_on_signals() {
  struct sigaction action = {};
  action.sa_handler = [](int) { stop = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);  // if the reader of a pipe has gone, writing gives an error instead
}

/// After the computing: the rest does not look at `stop`, and leaves no incomplete files when it is killed.
inline void end_on_signals() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

}  // namespace train_derail::apps
