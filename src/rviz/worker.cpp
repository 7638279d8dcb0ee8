#include "rviz/worker.hpp"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace train_derail::rviz_panel {

namespace {

constexpr std::chrono::seconds kPatience(2);

}  // namespace

struct Worker::State {
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Job> jobs;
  bool stop = false, stopped = false;

  void run(const Job& idle, std::chrono::milliseconds period) {
    std::unique_lock<std::mutex> lock(mutex);
    while (!stop) {
      Job job = idle;
      if (!jobs.empty()) {
        job = std::move(jobs.front());
        jobs.pop_front();
      }
      if (job) {
        lock.unlock();
        job();
        lock.lock();
      }
      const auto woken = [&] { return stop || !jobs.empty(); };
      if (idle) changed.wait_for(lock, period, woken);
      else changed.wait(lock, woken);
    }
    stopped = true;
    changed.notify_all();
  }
};

Worker::Worker(Job idle, std::chrono::milliseconds period) : state_(std::make_shared<State>()) {
  // Detached: the destructor waits for `stopped`, but not for ever.
  std::thread([state = state_, idle = std::move(idle), period] { state->run(idle, period); }).detach();
}

Worker::~Worker() {
  std::unique_lock<std::mutex> lock(state_->mutex);
  state_->stop = true;
  state_->jobs.clear();
  state_->changed.notify_all();
  state_->changed.wait_for(lock, kPatience, [this] { return state_->stopped; });
}

void Worker::post(Job job) {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  state_->jobs.push_back(std::move(job));
  state_->changed.notify_all();
}

}  // namespace train_derail::rviz_panel
