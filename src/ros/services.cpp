#include "train_derail/ros/services.hpp"

#include <malloc.h>

#include <memory>

#include <fmt/format.h>
#include <ros/this_node.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::ros_face {

namespace {

using std_srvs::Trigger;

/// One for ~step and one for ~restart, which may take their time, and one for what may cut them short.
constexpr std::uint32_t kThreads = 3;
/// Of what a restart may bring along, bytes: a scenario has some thousand.
constexpr std::size_t kTextMax = 1U << 20;
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

void check_size(const char* key, std::size_t size) {
  if (size <= kTextMax) return;
  throw inputs::InputError("~restart", key, fmt::format("{} bytes", size), "too long",
                           fmt::format("at most {} bytes", kTextMax));
}

/// Throws inputs::InputError.
RestartRequest to_request(const Restart::Request& request) {
  std::size_t size = 0;
  for (const std::string& text : request.overrides) size += text.size();
  check_size("overrides", size);
  check_size("scenario", request.scenario.size());
  if (!request.scenario.empty() && request.reload_parameters != 0) {
    throw inputs::InputError("~restart", "scenario", "", "given beside reload_parameters", "at most one of the two");
  }
  RestartRequest wanted{request.scenario, {}, request.overrides, request.start_paused != 0};
  if (request.reload_parameters != 0) wanted.parameters = fetch_parameters(::ros::this_node::getName());
  return wanted;
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
      handle_.advertiseService("seek", &Services::seek, this),
      handle_.advertiseService("set_rate", &Services::set_rate, this),
      handle_.advertiseService("set_colours", &Services::set_colours, this),
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
  // The run that is under way need not wait while the next one is read and built.
  const std::lock_guard<std::mutex> one_at_a_time(restart_mutex_);
  // The tree of a long text leaves holes in the heap: they go back to the system.
  constexpr std::size_t kLongText = 16384;
  const std::unique_ptr<void, void (*)(void*)> give_back(request.scenario.size() > kLongText ? this : nullptr,
                                                         [](void*) { malloc_trim(0); });
  ScenarioSource current;
  ask(loop_.commands(), response, [&] {
    current = loop_.source();
    response.run_id = loop_.run_id();
    return loop_.can_restart();
  });
  if (response.success == 0) return true;
  std::optional<NextRun> next;
  try {
    next = prepare(to_request(request), current, loop_.scenario_bounds());
  } catch (const std::exception& e) {
    response.success = 0;
    response.message = e.what();
    return true;
  }
  return ask(loop_.commands(), response, [&] {
    const Answer answer = loop_.restart(std::move(*next));
    response.run_id = loop_.run_id();
    return answer;
  });
}

bool Services::seek(Seek::Request& request, Seek::Response& response) {
  return ask(loop_.commands(), response, [&] { return loop_.seek(request.time, response.time); });
}

bool Services::set_colours(SetColours::Request& request, SetColours::Response& response) {
  return ask(loop_.commands(), response, [&] { return loop_.set_colours(request.colours); });
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
