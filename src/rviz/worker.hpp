#pragma once

#include <chrono>
#include <functional>
#include <memory>

namespace train_derail::rviz_panel {

/// A thread that does one job after the other, and `idle` every `period` between them. Its destructor gives a job that
/// hangs in the network a short while and then leaves it behind: a window must close. So jobs own what they touch.
class Worker {
 public:
  using Job = std::function<void()>;

  explicit Worker(Job idle = {}, std::chrono::milliseconds period = std::chrono::seconds(1));
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void post(Job job);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace train_derail::rviz_panel
