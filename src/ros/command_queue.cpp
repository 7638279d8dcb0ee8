#include "train_derail/ros/command_queue.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace train_derail::ros_face {

namespace {

constexpr std::chrono::milliseconds kPatience(200);
const Answer kClosed{false, "the node is shutting down"};

}  // namespace

Answer CommandQueue::call(Work work, WallClock::duration timeout) {
  const auto ticket = std::make_shared<Ticket>();
  ticket->work = std::move(work);
  std::unique_lock lock(mutex_);
  if (closed_) return kClosed;
  waiting_.push_back(ticket);
  work_arrived_.notify_one();
  const auto done = [&] { return ticket->done; };
  const auto place = [&] { return std::find(waiting_.begin(), waiting_.end(), ticket); };
  // A step of the usual length is let go to its end, a point of the output grid.
  if (attention_ != nullptr && !answered_.wait_for(lock, kPatience, done) && place() != waiting_.end())
    *attention_ = true;
  if (!answered_.wait_for(lock, timeout, done)) {
    if (const auto here = place(); here != waiting_.end()) {
      waiting_.erase(here);
      return {false, "the simulation was busy for too long; nothing was done"};
    }
    answered_.wait(lock, done);
  }
  return ticket->result;
}

void CommandQueue::wait_until(WallTime deadline) {
  std::unique_lock lock(mutex_);
  work_arrived_.wait_until(lock, deadline, [&] { return !waiting_.empty(); });
}

void CommandQueue::execute() {
  for (;;) {
    TicketPtr ticket;
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.empty()) {
        if (attention_ != nullptr) *attention_ = false;
        return;
      }
      ticket = std::move(waiting_.front());
      waiting_.pop_front();
    }
    ticket->work(ticket);
  }
}

void CommandQueue::answer(const TicketPtr& ticket, Answer answer) {
  const std::lock_guard lock(mutex_);
  if (ticket->done) return;
  ticket->result = std::move(answer);
  ticket->done = true;
  answered_.notify_all();
}

void CommandQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  for (const TicketPtr& ticket : waiting_) {
    ticket->result = kClosed;
    ticket->done = true;
  }
  waiting_.clear();
  answered_.notify_all();
}

}  // namespace train_derail::ros_face
