// Interrupted, a command ends after the runs in flight.
#pragma once

#include <atomic>
#include <csignal>

namespace train_derail::apps {

inline constexpr int kInterrupted = 130;

inline std::atomic<bool> stop{false};  // written by the signal handler, hence here

inline void stop_on_signals() {
  std::signal(SIGINT, [](int) { stop = true; });
  std::signal(SIGTERM, [](int) { stop = true; });
}

}  // namespace train_derail::apps
