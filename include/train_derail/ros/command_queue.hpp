// How service threads ask the simulation thread for something and wait for the answer.
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

struct Answer {
  bool success = false;
  std::string message;
};

class CommandQueue {
 public:
  /// One question under way. Answered once, by the simulation thread; later answers are dropped.
  class Ticket;
  using TicketPtr = std::shared_ptr<Ticket>;
  /// Runs in the simulation thread; answers the ticket at once or keeps it to answer later.
  using Work = std::function<void(const TicketPtr&)>;

  /// `attention`, if there is one, is set when work has waited for a while, until all is done.
  explicit CommandQueue(std::atomic<bool>* attention = nullptr) : attention_(attention) {}

  /// Service threads: blocks until answered. Work that is not begun within `timeout` is withdrawn and never runs, so
  /// that `work` may refer to the caller's locals.
  Answer call(Work work, WallClock::duration timeout);

  /// Simulation thread: returns when there is work, or at `deadline`.
  void wait_until(WallTime deadline);
  /// Simulation thread: does all work that waits.
  void execute();
  void answer(const TicketPtr& ticket, Answer answer);
  /// Simulation thread, at its end: no work is accepted any more, what waits is refused.
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
