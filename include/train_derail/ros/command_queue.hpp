/// \file
/// How threads of services ask the thread of the simulation for something and wait for the answer.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "train_derail/ros/pacer.hpp"

namespace train_derail::ros_face {

/// Answer to a service call.
struct Answer {
  bool success = false;  ///< whether what was asked for has been done
  std::string message;   ///< what has been done, or why it was refused; one sentence
};

/// Questions that wait for the thread of the simulation, in the order in which they came.
class CommandQueue {
 public:
  /// One question under way. The simulation thread answers it once; later answers are dropped.
  class Ticket;
  using TicketPtr = std::shared_ptr<Ticket>;
  /// Runs in the simulation thread. Answers the ticket at once, or keeps it and answers later.
  using Work = std::function<void(const TicketPtr&)>;

  /// `attention` may be null. Else it is set once work has waited for a while, and reset when all work is done: a long
  /// step of the simulation looks at it. It must outlive the queue.
  explicit CommandQueue(std::atomic<bool>* attention = nullptr) : attention_(attention) {}

  /// For threads of services: hands `work` over and blocks until it is answered. Work that has not begun within
  /// `timeout` (wall time) is withdrawn and never runs, and the answer says so. So `work` may refer to local variables
  /// of the caller.
  Answer call(Work work, WallClock::duration timeout);

  /// For the simulation thread: returns when there is work, or at `deadline`.
  void wait_until(WallTime deadline);
  /// For the simulation thread: does all work that waits.
  void execute();
  /// For the simulation thread: answers a ticket and wakes the caller.
  void answer(const TicketPtr& ticket, Answer answer);
  /// For the simulation thread, at its end: refuses what waits, and all later work.
  void close();

 private:
  std::mutex mutex_;
  std::condition_variable work_arrived_, answered_;
  std::deque<TicketPtr> waiting_;
  bool closed_ = false;
  std::atomic<bool>* const attention_;
};

class CommandQueue::Ticket {
  friend class CommandQueue;
  Work work;
  Answer result;
  bool done = false;
};

}  // namespace train_derail::ros_face
