#include "train_derail/ros/study_action.hpp"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <thread>

#include <actionlib/server/action_server_base.h>
#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/spinner.h>

#include "train_derail/RunStudyAction.h"
#include "train_derail/inputs/error.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::ros_face {

namespace {

constexpr const char* kName = "run_study";
constexpr std::uint32_t kJobsMax = 4096;
/// Of the study's threads: the live simulation goes first where cores are scarce.
constexpr int kNice = 10;
constexpr double kFeedbackInterval = 0.1;  // wall [s], at least
constexpr double kStatusInterval = 0.2;    // wall [s]
constexpr std::uint32_t kQueueSize = 50;
constexpr std::ptrdiff_t kEndedKept = 10;  // goals, in ~run_study/status

std::string absolute(const std::string& key, const std::string& path) {
  if (std::filesystem::path(path).is_absolute()) return path;
  throw inputs::InputError(std::string("~") + kName, key, path, path.empty() ? "missing" : "relative path",
                           "an absolute path on the node's machine");
}

study::Study read(const RunStudyGoal& goal) {
  if (goal.text.empty()) return study::read_study_file(absolute("file", goal.file));
  return study::read_study_text(goal.text, goal.file.empty() ? std::string("~") + kName : absolute("file", goal.file));
}

RunStudyFeedback to_message(const study::Progress& p) {
  RunStudyFeedback m;
  m.done = p.done;
  m.total = p.total;
  m.failed = p.failed;
  m.rate = p.rate;
  m.eta = p.rate > 0.0 ? static_cast<double>(p.total - p.done) / p.rate : 0.0;
  m.message = p.message;
  return m;
}

/// The whole of a goal. `feedback` is called from the study's threads, one at a time.
RunStudyResult run(const RunStudyGoal& goal, const std::function<void(const RunStudyFeedback&)>& feedback,
                   const std::atomic<bool>& stop) {
  RunStudyResult result;
  result.folder = goal.folder;
  try {
    if (goal.jobs > kJobsMax) {
      throw inputs::InputError(std::string("~") + kName, "jobs", std::to_string(goal.jobs), "out of range",
                               fmt::format("0 to {}", kJobsMax));
    }
    const study::Study study = read(goal);
    study::RunOptions options;
    options.folder = absolute("folder", goal.folder);
    options.jobs = static_cast<int>(goal.jobs);
    options.resume = goal.resume != 0;
    WallTime next{};
    const study::RunReport report = study::run_study(
        study, options,
        [&](const study::Progress& p) {
          if (const WallTime now = WallClock::now(); now >= next || p.done == p.total) {
            next = now + wall_seconds(kFeedbackInterval);
            feedback(to_message(p));
          }
        },
        stop);
    result.runs = report.runs;
    result.computed = report.computed;
    result.failed = report.failed;
    result.wall_time = report.wall_time;
    if (report.stopped) {
      result.status = RunStudyResult::STOPPED;
      result.message = fmt::format("stopped with {} runs on disk; resume computes the rest", report.runs);
      return result;
    }
    study::write_results(goal.folder, study, report.wall_time, &stop);
    result.table = study::to_table(goal.folder, study);
    result.status = RunStudyResult::DONE;
    result.message = fmt::format("{} runs in {}", report.runs, goal.folder);
    if (report.failed > 0) {
      result.message += fmt::format("; {} of {} failed, their rows in runs.csv say why", report.failed, report.computed);
    }
  } catch (const inputs::InputError& e) {
    result.status = RunStudyResult::INPUT_WRONG;
    result.message = e.what();
  } catch (const std::exception& e) {
    result.status = RunStudyResult::OUTPUT_FAILED;
    result.message = e.what();
  }
  return result;
}

}  // namespace

/// actionlib's own server goes by ROS time. Here that is the simulated one: it stands still while the run is paused, and
/// two clients that name their goals by it may give the same name twice. So status is sent by the wall clock, and a goal
/// that has ended makes way for a new one of its name.
class StudyAction::Server : public actionlib::ActionServerBase<RunStudyAction> {
 public:
  explicit Server(const ::ros::NodeHandle& private_handle)
      : ActionServerBase([this](GoalHandle goal) { on_goal(goal); }, [this](GoalHandle) { stop_ = true; }),
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
    timer_ = handle_.createWallTimer(::ros::WallDuration(kStatusInterval), [this](const ::ros::WallTimerEvent&) { publishStatus(); });
  }

  void forget_ended(const std::string& id) {
    const boost::recursive_mutex::scoped_lock lock(lock_);
    status_list_.remove_if([&](const auto& tracker) {
      return tracker.status_.goal_id.id == id && tracker.handle_destruction_time_ != ::ros::Time();
    });
  }

  // One thread calls it: the spinner's.
  void on_goal(GoalHandle goal) {
    if (busy_) {
      RunStudyResult refused;
      refused.status = RunStudyResult::INPUT_WRONG;
      refused.folder = goal.getGoal()->folder;
      refused.message = fmt::format("~{}: another study is under way, in {}; cancel it first", kName, folder_);
      goal.setRejected(refused, refused.message);
      return;
    }
    if (worker_.joinable()) worker_.join();
    busy_ = true;
    stop_ = false;
    folder_ = goal.getGoal()->folder;
    goal.setAccepted();
    worker_ = std::thread([this, goal]() mutable { work(goal); });
  }

  void work(GoalHandle& goal) {
    // The threads that the study starts inherit it.
    setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kNice);
    const RunStudyResult result =
        run(*goal.getGoal(), [&goal](const RunStudyFeedback& m) { goal.publishFeedback(m); }, stop_);
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

StudyAction::StudyAction(const ::ros::NodeHandle& private_handle) : server_(std::make_unique<Server>(private_handle)) {}

StudyAction::~StudyAction() = default;

}  // namespace train_derail::ros_face
