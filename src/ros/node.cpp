#include "train_derail/ros/node.hpp"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/package.h>
#include <ros/this_node.h>
#include <CLI/CLI.hpp>

#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/services.hpp"
#include "train_derail/ros/simulation_loop.hpp"
#include "train_derail/ros/study_action.hpp"

namespace train_derail::ros_face {

namespace {

/// From a signal to the end of the process, whatever hangs [s].
constexpr double kEndWithin = 1.8;
constexpr double kSavingMax = 60.0;

/// SIGINT and SIGTERM, on a thread of its own. The first asks the node to end; if it has not ended soon after (a master
/// or peer that holds a connection without a word), it is ended.
class EndOnSignals {
 public:
  /// Before any other thread starts: all inherit what is blocked here.
  EndOnSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGINT);
    sigaddset(&signals_, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    thread_ = std::thread([this] { wait(); });
  }
  ~EndOnSignals() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ended_ = true;
    }
    changed_.notify_all();
    pthread_kill(thread_.native_handle(), SIGTERM);
    thread_.join();
  }
  EndOnSignals(const EndOnSignals&) = delete;
  EndOnSignals& operator=(const EndOnSignals&) = delete;

  LoopControl& control() { return control_; }
  /// From here on there is something to be ended in good order.
  void begin() {
    const std::lock_guard<std::mutex> lock(mutex_);
    begun_ = true;
  }
  /// Of the process, should it have to be ended.
  void set_code(int code) { code_ = code; }

 private:
  void wait() {
    int signal = 0;
    sigwait(&signals_, &signal);
    std::unique_lock<std::mutex> lock(mutex_);
    if (ended_) return;
    if (!begun_) {  // waits for a master, most likely: nothing is lost
      std::signal(signal, SIG_DFL);
      pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
      raise(signal);
    }
    control_.stop = true;
    control_.attention = true;
    const WallTime begin = WallClock::now();
    const auto out_of_time = [&](double limit) { return WallClock::now() >= begin + wall_seconds(limit); };
    while (!out_of_time(control_.saving ? kSavingMax : kEndWithin)) {
      if (changed_.wait_for(lock, wall_seconds(0.1), [this] { return ended_; })) return;
    }
    static_cast<void>(std::fputs("train_derail: did not end by itself; ended\n", stderr));
    _exit(code_);
  }

  sigset_t signals_{};
  std::mutex mutex_;
  std::condition_variable changed_;
  bool begun_ = false, ended_ = false;
  LoopControl control_;
  std::atomic<int> code_{1};
  std::thread thread_;
};

/// The shipped scenarios, and nothing else of the package.
std::vector<std::string> shipped_inputs() {
  const std::string package = ::ros::package::getPath("train_derail");
  if (package.empty()) return {};
  return {package + "/config"};
}

constexpr int kExitInput = 2;
constexpr int kExitOther = 1;

/// What stands on the command line besides ROS' own arguments.
struct Arguments {
  std::string replay;  // bag; "": a simulation
  std::uint32_t run = 0;
  double start = 0.0;  // simulated [s]
};

/// The bag is named by who starts the node, not by a parameter: everybody on the network can set those.
void describe(CLI::App& app, Arguments& arguments) {
  app.add_option("--replay", arguments.replay, "bag with a run of train_derail, shown instead of a simulation")
      ->check(CLI::ExistingFile);
  app.add_option("--replay-run", arguments.run, "number of the run in the bag; 0: the last one");
  app.add_option("--replay-start", arguments.start, "simulated time at which the replay begins [s]")
      ->check(CLI::NonNegativeNumber);
  app.footer("Everything else is told by parameters, topics and services: docs/node.md.");
}

/// Throws inputs::InputError before anything is advertised.
std::unique_ptr<SimulationLoop> make_loop(::ros::NodeHandle& handle, const NodeParameters& parameters,
                                          const FileBounds& bounds, const XmlRpc::XmlRpcValue& tree,
                                          const Arguments& arguments, LoopControl& control) {
  if (arguments.replay.empty()) {
    const ScenarioSource source = read_scenario_source(tree, ::ros::this_node::getName());
    return std::make_unique<SimulationLoop>(handle, parameters, bounds, source, control);
  }
  auto recording = std::make_unique<Recording>(arguments.replay, arguments.run);
  recording->advance(arguments.start);
  return std::make_unique<SimulationLoop>(handle, parameters, bounds, std::move(recording), control);
}

int run(::ros::NodeHandle& handle, const Arguments& arguments, EndOnSignals& signals) {
  const std::string& name = ::ros::this_node::getName();
  const XmlRpc::XmlRpcValue tree = fetch_parameters(name);
  const NodeParameters parameters = read_node_parameters(tree, name);
  const FileBounds bounds(parameters.results_folder, shipped_inputs());
  signals.begin();
  const std::unique_ptr<SimulationLoop> loop =
      make_loop(handle, parameters, bounds, tree, arguments, signals.control());
  if (parameters.publish_clock && !::ros::Time::isSimTime()) {
    ROS_WARN_NAMED("run", "/use_sim_time is not set: nodes that do not follow /clock will not match the stamps");
  }
  Services services(handle, *loop);
  StudyAction study_action(handle, bounds);
  const int code = loop->run();
  signals.set_code(code);
  return code;
}

}  // namespace

int run_node(int argc, char** argv) {
  EndOnSignals signals;
  ::ros::init(argc, argv, "train_derail", ::ros::init_options::NoSigintHandler);
  // Before a handle waits for a master.
  Arguments arguments;
  CLI::App app{"Simulates a train derailment live, or shows one that was recorded."};
  describe(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    ROS_FATAL_NAMED("run", "command line: %s", e.what());
    return kExitInput;
  }
  // Outlives what may throw: with the last handle goes the console.
  ::ros::NodeHandle handle("~");
  int code = kExitOther;
  try {
    code = run(handle, arguments, signals);
  } catch (const inputs::InputError& e) {
    ROS_FATAL_NAMED("run", "%s", e.what());
    code = kExitInput;
  } catch (const std::exception& e) {
    ROS_FATAL_NAMED("run", "%s", e.what());
  }
  ::ros::shutdown();
  return code;
}

}  // namespace train_derail::ros_face
