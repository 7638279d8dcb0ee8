#include "train_derail/ros/study_action.hpp"

#include <algorithm>
#include <atomic>
#include <thread>

#include <actionlib/server/action_server_base.h>
#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/spinner.h>

#include "train_derail/RunStudyAction.h"
#include "train_derail/inputs/error.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/study_process.hpp"

namespace train_derail::ros_face {

namespace {

constexpr const char* kName = "run_study";
constexpr std::size_t kTextMax = 1U << 20;  // bytes
constexpr double kFeedbackInterval = 0.1;   // wall [s], at least
constexpr double kStatusInterval = 0.2;     // wall [s]
constexpr std::uint32_t kQueueSize = 50;
constexpr std::ptrdiff_t kEndedKept = 10;  // goals, in ~run_study/status

}  // namespace

/// actionlib's own server goes by ROS time. Here that is the simulated one: it stands still while the run is paused,
/// and two clients that name their goals by it may give the same name twice. So status is sent by the wall clock, and a
/// goal that has ended makes way for a new one of its name.
class StudyAction::Server : public actionlib::ActionServerBase<RunStudyAction> {
 public:
  Server(const ::ros::NodeHandle& private_handle, const FileBounds& bounds)
      : ActionServerBase([this](GoalHandle goal) { on_goal(goal); }, [this](GoalHandle) { stop_ = true; }),
        bounds_(bounds),
        handle_(private_handle, kName),
        spinner_(1, &queue_) {
    handle_.setCallbackQueue(&queue_);
    start();
    spinner_.start();
  }
  ~Server() override {
    spinner_.stop();
    stop_ = true;
    if (worker_.joinable()) worker_.join();
  }

 private:
  void initialize() override {
    status_ = handle_.advertise<actionlib_msgs::GoalStatusArray>("status", kQueueSize, true);
    feedback_ = handle_.advertise<ActionFeedback>("feedback", kQueueSize);
    result_ = handle_.advertise<ActionResult>("result", kQueueSize);
    goals_ = handle_.subscribe<ActionGoal>("goal", kQueueSize, [this](const ActionGoalConstPtr& goal) {
      // A study that has ended holds its goal until its thread is through; until then the goal could not be forgotten.
      if (!busy_ && worker_.joinable()) worker_.join();
      forget_ended(goal->goal_id.id);
      goalCallback(goal);
    });
    cancels_ = handle_.subscribe<actionlib_msgs::GoalID>(
        "cancel", kQueueSize, [this](const actionlib_msgs::GoalIDConstPtr& id) { cancelCallback(id); });
    timer_ = handle_.createWallTimer(::ros::WallDuration(kStatusInterval),
                                     [this](const ::ros::WallTimerEvent&) { publishStatus(); });
  }

  void forget_ended(const std::string& id) {
    const boost::recursive_mutex::scoped_lock lock(lock_);
    status_list_.remove_if([&](const auto& tracker) {
      return tracker.status_.goal_id.id == id && tracker.handle_destruction_time_ != ::ros::Time();
    });
  }

  // One thread calls it: the spinner's.
  void on_goal(GoalHandle goal) {
    if (const std::string problem = why_refused(*goal.getGoal()); !problem.empty()) {
      RunStudyResult refused;
      refused.status = RunStudyResult::INPUT_WRONG;
      refused.message = problem;
      goal.setRejected(refused, problem);
      return;
    }
    if (worker_.joinable()) worker_.join();
    busy_ = true;
    stop_ = false;
    goal.setAccepted();
    worker_ = std::thread([this, goal]() mutable { work(goal); });
  }

  /// What can be said at once; empty if the goal may try.
  std::string why_refused(const RunStudyGoal& goal) {
    const std::string where = std::string("~") + kName;
    if (busy_) return fmt::format("{}: another study is under way, in {}; cancel it first", where, folder_);
    try {
      if (goal.text.size() > kTextMax) {
        throw inputs::InputError(where, "text", fmt::format("{} bytes", goal.text.size()), "too long",
                                 fmt::format("at most {} bytes", kTextMax));
      }
      if (goal.jobs > study_jobs_max()) {
        throw inputs::InputError(where, "jobs", std::to_string(goal.jobs), "out of range",
                                 fmt::format("0 to {} on this machine", study_jobs_max()));
      }
      folder_ = bounds_.writable(where, "folder", goal.folder);
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return {};
  }

  void work(GoalHandle& goal) {
    WallTime next{};
    const auto on_feedback = [&](const RunStudyFeedback& m) {
      const WallTime now = WallClock::now();
      if (now < next && m.done < m.total) return;
      next = now + wall_seconds(kFeedbackInterval);
      goal.publishFeedback(m);
    };
    const RunStudyResult result = run_study_process(*goal.getGoal(), bounds_, on_feedback, stop_);
    busy_ = false;  // before the client knows: its next goal is welcome
    switch (result.status) {
      case RunStudyResult::DONE: goal.setSucceeded(result, result.message); break;
      case RunStudyResult::STOPPED: goal.setCanceled(result, result.message); break;
      default: goal.setAborted(result, result.message);
    }
    ROS_INFO_NAMED("study", "~%s: %s", kName, result.message.c_str());
  }

  void publishResult(const actionlib_msgs::GoalStatus& status, const Result& result) override {
    const boost::recursive_mutex::scoped_lock lock(lock_);
    ActionResult m;
    m.header.stamp = ::ros::Time::now();
    m.status = status;
    m.result = result;
    result_.publish(m);
    publishStatus();
  }

  void publishFeedback(const actionlib_msgs::GoalStatus& status, const Feedback& feedback) override {
    ActionFeedback m;
    m.header.stamp = ::ros::Time::now();
    m.status = status;
    m.feedback = feedback;
    feedback_.publish(m);
  }

  void publishStatus() override {
    const boost::recursive_mutex::scoped_lock lock(lock_);
    actionlib_msgs::GoalStatusArray m;
    m.header.stamp = ::ros::Time::now();
    for (const auto& tracker : status_list_) m.status_list.push_back(tracker.status_);
    status_.publish(m);
    // The deleter of the last handle sets the time; from then on nothing refers to the entry.
    const auto ended = [](const auto& tracker) { return tracker.handle_destruction_time_ != ::ros::Time(); };
    auto surplus = std::count_if(status_list_.begin(), status_list_.end(), ended) - kEndedKept;
    status_list_.remove_if([&](const auto& tracker) { return ended(tracker) && surplus-- > 0; });
  }

  const FileBounds bounds_;
  ::ros::CallbackQueue queue_;
  ::ros::NodeHandle handle_;
  ::ros::Publisher status_, feedback_, result_;
  ::ros::Subscriber goals_, cancels_;
  ::ros::WallTimer timer_;
  ::ros::AsyncSpinner spinner_;

  std::thread worker_;
  std::atomic<bool> busy_{false}, stop_{false};
  std::string folder_;  // of the study under way
};

StudyAction::StudyAction(const ::ros::NodeHandle& private_handle, const FileBounds& bounds)
    : server_(std::make_unique<Server>(private_handle, bounds)) {}

StudyAction::~StudyAction() = default;

}  // namespace train_derail::ros_face
