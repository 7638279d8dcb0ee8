#include "train_derail/ros/command_queue.hpp"

#include <algorithm>
#include <utility>

namespace train_derail::ros_face {

namespace {

const Answer kClosed{false, "the node is shutting down"};

}  // namespace

Answer CommandQueue::call(Work work, WallClock::duration timeout) {
  const auto ticket = std::make_shared<Ticket>();
  ticket->work = std::move(work);
  std::unique_lock lock(mutex_);
  if (closed_) return kClosed;
  waiting_.push_back(ticket);
  work_arrived_.notify_one();
  if (!answered_.wait_for(lock, timeout, [&] { return ticket->done; })) {
    const auto here = std::find(waiting_.begin(), waiting_.end(), ticket);
    if (here != waiting_.end()) {
      waiting_.erase(here);
      return {false, "the simulation was busy for too long; nothing was done"};
    }
    answered_.wait(lock, [&] { return ticket->done; });
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
      if (waiting_.empty()) return;
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
