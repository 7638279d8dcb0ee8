#include "rviz/study_link.hpp"

#include <chrono>
#include <mutex>

#include <actionlib/client/simple_action_client.h>

#include "train_derail/RunStudyAction.h"

namespace train_derail::rviz_panel {

namespace {

using Clock = std::chrono::steady_clock;  // simulated time stands still while the node is paused
using Client = actionlib::SimpleActionClient<RunStudyAction>;
using State = StudyView::State;

constexpr std::chrono::milliseconds kPeriod(100);
/// A node that has not been seen for so long is not there.
constexpr std::chrono::seconds kSilenceMax(15);

}  // namespace

/// The client lives in the worker's thread; what it hears comes in a thread of its own.
struct StudyLink::Core {
  mutable std::mutex mutex;
  StudyView data;
  std::string node, text;
  bool cancel = false, ended = false;
  RunStudyResult result;  // once it has ended

  // Worker only.
  std::unique_ptr<Client> client;
  bool sent = false;
  Clock::time_point seen;

  void tick() {
    std::string name;
    RunStudyGoal goal;
    bool give_up = false, over = false;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!data.under_way()) return;
      name = node;
      goal.text = text;
      goal.folder = data.folder;
      give_up = cancel;
      over = ended;
    }
    if (over) return finish();
    if (!client) {
      client = std::make_unique<Client>(name + "/run_study", true);
      seen = Clock::now();
    }
    if (client->isServerConnected()) seen = Clock::now();
    if (Clock::now() - seen > kSilenceMax) return fail(name + "/run_study: no answer");
    if (!sent && give_up) return close(State::cancelled, "cancelled before it began");
    if (!sent && client->isServerConnected()) {
      sent = true;
      client->sendGoal(
          goal,
          [this](const actionlib::SimpleClientGoalState& state, const RunStudyResultConstPtr& r) {
            const std::lock_guard<std::mutex> lock(mutex);
            if (r) result = *r;
            if (!r || result.message.empty()) result.message = state.getText();
            ended = true;
          },
          [this] {
            const std::lock_guard<std::mutex> lock(mutex);
            data.state = State::running;
          },
          [this](const RunStudyFeedbackConstPtr& f) {
            const std::lock_guard<std::mutex> lock(mutex);
            data.done = f->done;
            data.total = f->total;
            data.failed = f->failed;
            data.eta = f->eta;
          });
    } else if (sent && give_up) {
      client->cancelGoal();
      const std::lock_guard<std::mutex> lock(mutex);
      cancel = false;  // once is enough
    }
  }

  void finish() {
    std::shared_ptr<const SweepResult> read;
    std::string unreadable;
    const bool done = result.status == RunStudyResult::DONE && !result.table.empty();
    if (done) {
      try {
        read = std::make_shared<SweepResult>(read_sweep(text, result.folder));
      } catch (const std::exception& e) {
        unreadable = e.what();
      }
    }
    {
      const std::lock_guard<std::mutex> lock(mutex);
      data.table = result.table;
      if (!result.folder.empty()) data.folder = result.folder;
      data.result = read;
      data.unreadable = unreadable;
      data.failed = result.failed;
    }
    close(done                                       ? State::done
          : result.status == RunStudyResult::STOPPED ? State::cancelled
                                                     : State::failed,
          result.message);
  }
  void fail(const std::string& why) { close(State::failed, why); }
  void close(State state, const std::string& message) {
    client.reset();
    sent = false;
    const std::lock_guard<std::mutex> lock(mutex);
    data.state = state;
    data.message = message;
  }
};

StudyLink::StudyLink() : core_(std::make_shared<Core>()), worker_([core = core_] { core->tick(); }, kPeriod) {}

StudyLink::~StudyLink() = default;

void StudyLink::start(const std::string& node, const std::string& study_text, const std::string& folder) {
  const std::lock_guard<std::mutex> lock(core_->mutex);
  if (core_->data.under_way()) return;
  core_->data = {};
  core_->data.state = State::waiting;
  core_->data.folder = folder;
  core_->node = node;
  core_->text = study_text;
  core_->cancel = core_->ended = false;
  core_->result = {};
}

void StudyLink::cancel() {
  const std::lock_guard<std::mutex> lock(core_->mutex);
  if (core_->data.under_way()) core_->cancel = true;
}

StudyView StudyLink::view() const {
  const std::lock_guard<std::mutex> lock(core_->mutex);
  return core_->data;
}

}  // namespace train_derail::rviz_panel
