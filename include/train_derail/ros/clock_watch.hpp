/// \file
/// Looks whether /clock has more than one publisher.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/subscriber.h>

namespace train_derail::ros_face {

/// Finds who publishes /clock. With two of them (a simulator and a replay, say) time jumps back and forth for every
/// node that follows it, and ROS says nothing.
class ClockRivals {
 public:
  ClockRivals();
  /// Returns the names of all nodes that publish /clock if there is more than one, else an empty list. Asks the master,
  /// and may wait for it, but only while there is more than one connection. Only one thread at a time may call it.
  const std::vector<std::string>& look();

 private:
  ::ros::CallbackQueue queue_;  ///< never served, as only the connections count
  ::ros::Subscriber subscriber_;
  std::vector<std::string> found_;
};

/// Looks for publishers of /clock twice a second (wall time), on a thread of its own.
class ClockWatch {
 public:
  ClockWatch();
  ~ClockWatch();
  ClockWatch(const ClockWatch&) = delete;
  ClockWatch& operator=(const ClockWatch&) = delete;

  /// Returns what ClockRivals::look() has found last. Any thread may call it.
  std::vector<std::string> rivals() const;
  /// Returns a number that changes with every change of rivals().
  std::uint32_t changes() const { return changes_; }

 private:
  void watch();

  ClockRivals clock_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  std::vector<std::string> rivals_;
  std::atomic<std::uint32_t> changes_{0};
  std::thread thread_;
};

/// Returns a sentence for people: "time jumps: /clock is published by /a and /b, and one only may".
std::string rivals_text(const std::vector<std::string>& rivals);

}  // namespace train_derail::ros_face
