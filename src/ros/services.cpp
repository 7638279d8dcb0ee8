#include "train_derail/ros/services.hpp"

#include <ros/this_node.h>

namespace train_derail::ros_face {

namespace {

using std_srvs::Trigger;

/// One for ~step, which may take its time, and one for what may cut it short.
constexpr std::uint32_t kThreads = 2;
/// A busy simulation may take this long to begin with what it is asked for, wall [s].
constexpr double kTimeout = 30.0;

/// `work` runs in the simulation thread; what it throws becomes a refusal. Always true: the transport works.
template <class Response, class Work>
bool ask(CommandQueue& commands, Response& response, Work work) {
  const Answer answer = commands.call(
      [&](const CommandQueue::TicketPtr& ticket) {
        try {
          commands.answer(ticket, work());
        } catch (const std::exception& e) {
          commands.answer(ticket, {false, e.what()});
        }
      },
      wall_seconds(kTimeout));
  response.success = answer.success;
  response.message = answer.message;
  return true;
}

}  // namespace

Services::Services(const ::ros::NodeHandle& private_handle, SimulationLoop& loop)
    : loop_(loop), handle_(private_handle), spinner_(kThreads, &queue_) {
  handle_.setCallbackQueue(&queue_);
  servers_ = {
      handle_.advertiseService("pause", &Services::pause, this),
      handle_.advertiseService("resume", &Services::resume, this),
      handle_.advertiseService("step", &Services::step, this),
      handle_.advertiseService("restart", &Services::restart, this),
      handle_.advertiseService("set_rate", &Services::set_rate, this),
      handle_.advertiseService("get_inputs", &Services::get_inputs, this),
  };
  spinner_.start();
}

Services::~Services() {
  loop_.commands().close();
  spinner_.stop();
}

bool Services::pause(Trigger::Request& /*request*/, Trigger::Response& response) {
  return ask(loop_.commands(), response, [&] { return loop_.pause(); });
}

bool Services::resume(Trigger::Request& /*request*/, Trigger::Response& response) {
  return ask(loop_.commands(), response, [&] { return loop_.resume(); });
}

bool Services::step(Step::Request& request, Step::Response& response) {
  CommandQueue& commands = loop_.commands();
  const Answer answer = commands.call(
      [&](const CommandQueue::TicketPtr& ticket) {
        loop_.step(request.ticks, request.seconds, [&, ticket](const Answer& done, const StepProgress& progress) {
          response.ticks = progress.ticks;
          response.time = progress.time;
          commands.answer(ticket, done);
        });
      },
      wall_seconds(kTimeout));
  response.success = answer.success;
  response.message = answer.message;
  return true;
}

bool Services::restart(Restart::Request& request, Restart::Response& response) {
  RestartRequest wanted{request.scenario, {}, request.overrides, request.start_paused != 0};
  // Asked for here: the simulation need not wait for the master.
  if (request.reload_parameters) wanted.parameters = fetch_parameters(::ros::this_node::getName());
  return ask(loop_.commands(), response, [&] {
    response.run_id = loop_.run_id();
    const Answer answer = loop_.restart(wanted);
    response.run_id = loop_.run_id();
    return answer;
  });
}

bool Services::set_rate(SetRate::Request& request, SetRate::Response& response) {
  return ask(loop_.commands(), response, [&] { return loop_.set_rate(request.rate); });
}

bool Services::get_inputs(GetInputs::Request& /*request*/, GetInputs::Response& response) {
  return ask(loop_.commands(), response, [&] {
    response.inputs = loop_.inputs();
    return Answer{true, "run " + std::to_string(loop_.run_id())};
  });
}

}  // namespace train_derail::ros_face
