#include "train_derail/ros/simulation_loop.hpp"
#include "train_derail/ros/messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <ros/console.h>
#include <ros/init.h>
#include <ros/this_node.h>

#include "train_derail/outcome/report.hpp"

namespace train_derail::ros_face {

namespace {

/// Longest that a stop request goes unseen, wall [s].
constexpr double kWaitMax = 0.1;
/// For subscribers to take what is kept for them before the process exits, wall [s]; between two looks; for the newest.
constexpr double kLingerMax = 20.0, kLingerInterval = 0.01, kLinger = 0.5;
/// Grids that are no more than rounding beyond a point belong to it.
constexpr double kTickRounding = 1.0e-9;
constexpr double kStepTicksMax = 1.0e9;

/// Between two times that all markers are sent to those who listen: who records them can begin anywhere, wall [s].
constexpr double kRepeatInterval = 10.0;
/// Between two looks whether those who are to watch have come, wall [s].
constexpr double kViewersInterval = 0.05;

/// For which messages are gathered while the run goes as fast as it can, wall [s].
constexpr double kGatherTime = 2.0e-3;

/// Between two messages of /clock after the end of a run, wall [s].
constexpr double kIdleInterval = 0.05;

std::unique_ptr<BagRecorder> open_bag(const std::string& bag, const FileBounds& bounds) {
  if (bag.empty()) return nullptr;
  const std::string path = bounds.writable(::ros::this_node::getName(), "bag", bag, true);
  try {
    std::filesystem::create_directories(bounds.results());
    return std::make_unique<BagRecorder>(bag_path(path), ::ros::this_node::getName());
  } catch (const std::runtime_error& e) {
    throw inputs::InputError(::ros::this_node::getName(), "bag", bag, e.what(), "a file or folder that can be written");
  }
}

std::vector<MessageSink*> sinks(Publishers& publishers, BagRecorder* bag) {
  std::vector<MessageSink*> all{&publishers};
  if (bag != nullptr) all.push_back(bag);
  return all;
}

}  // namespace

NextRun prepare(const RestartRequest& request, const ScenarioSource& current,
                const std::shared_ptr<const FileBounds>& bounds) {
  ScenarioSource next = current;
  if (!request.scenario.empty()) {
    next = {};
    next.name = "~restart";
    next.folder = bounds->results();
    next.bounds = bounds;
    next.tree = std::make_shared<const YAML::Node>(inputs::load_text(request.scenario, next.name));
  } else if (request.parameters) {
    // Everybody can have changed them since the node started.
    next = read_scenario_source(*request.parameters, ::ros::this_node::getName());
    next.bounds = bounds;
  }
  next.add_overrides(request.overrides);
  simulation::Simulation simulation(next.read());
  return {std::move(next), std::move(simulation), request.start_paused};
}

SimulationLoop::SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters,
                               const FileBounds& bounds, LoopControl& control)
    : parameters_(parameters),
      control_(control),
      bag_(open_bag(parameters.bag, bounds)),
      publishers_(private_handle, parameters),
      diagnostics_(private_handle, parameters.diagnostics_period, parameters.overload_threshold),
      stream_(parameters.stream, sinks(publishers_, bag_.get())),
      pacer_(parameters.rate, 1.0) {}

SimulationLoop::SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters,
                               const FileBounds& bounds, const ScenarioSource& source, LoopControl& control)
    : SimulationLoop(private_handle, parameters, bounds, control) {
  source_ = source;
  FileBounds known = bounds;
  for (const std::string& file : source.files()) known.allow(file);
  scenario_bounds_ = std::make_shared<const FileBounds>(std::move(known));
  simulation_.emplace(source.read());
  view_ = std::make_shared<SimulationView>(*simulation_, parameters.event_coupler_force);
}

SimulationLoop::SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters,
                               const FileBounds& bounds, std::unique_ptr<Recording> recording, LoopControl& control)
    : SimulationLoop(private_handle, parameters, bounds, control) {
  recording_ = std::move(recording);
  view_ = recording_;
}

int SimulationLoop::run() {
  const bool wait = parameters_.viewers_wait > 0.0 && !parameters_.start_paused;
  start_run(parameters_.start_paused || wait);
  if (wait) viewers_due_ = WallClock::now() + wall_seconds(parameters_.viewers_wait);
  while (!control_.stop && ::ros::ok()) {
    commands_.execute();
    const WallTime now = WallClock::now();
    watch_clock();
    watch_for_viewers(now);
    if (publishers_.take_newcomers() || (now >= repeat_due_ && publishers_.wants_markers())) {
      stream_.repeat_markers();
      repeat_due_ = now + wall_seconds(kRepeatInterval);
    }
    if (now >= diagnostics_.due()) report(now);
    if (has_ended() && parameters_.exit_when_done) break;

    if (has_ended() && now >= idle_due_) keep_time_going(now);
    WallTime wait_until = std::min(now + wall_seconds(kWaitMax), diagnostics_.due());
    if (viewers_due_ != WallTime()) wait_until = std::min(wait_until, now + wall_seconds(kViewersInterval));
    if (has_ended()) wait_until = std::min(wait_until, idle_due_);
    if (state_ == State::running && !stepping_ && pacer_.paced()) {
      wait_until = std::min(wait_until, pacer_.due(static_cast<double>(tick_ + 1) * interval()));
    } else if (state_ == State::running || stepping_) {
      wait_until = now;
    }
    if (wait_until > now || now >= publish_due_) {
      publishers_.publish_waiting();
      publish_due_ = now + wall_seconds(kGatherTime);
    }
    if (wait_until > now) {
      commands_.wait_until(wait_until);
    } else if (state_ == State::running || stepping_) {
      tick();
    }
  }
  if (stepping_) finish_step({false, "the node is shutting down"});
  commands_.close();
  publishers_.publish_waiting();
  if (bag_) {
    control_.saving = true;
    bag_->close();
    control_.saving = false;
    watch_bag();
    if (!bag_failed_) ROS_INFO_NAMED("run", "recorded %s", bag_->path().c_str());
  }
  if (!has_ended() || !parameters_.exit_when_done) return 0;
  const std::string table = outcome::to_table(outcome());
  std::fwrite(table.data(), 1, table.size(), stdout);
  std::fflush(stdout);
  const WallTime leave_at = WallClock::now() + wall_seconds(kLingerMax);
  while (!publishers_.all_but_newest_sent() && !control_.stop && ::ros::ok() && WallClock::now() < leave_at)
    std::this_thread::sleep_for(wall_seconds(kLingerInterval));
  if (publishers_.has_subscribers()) std::this_thread::sleep_for(wall_seconds(kLinger));
  if (state_ == State::failed) return 3;
  return bag_failed_ ? 1 : 0;
}

void SimulationLoop::watch_for_viewers(WallTime now) {
  if (viewers_due_ == WallTime()) return;
  if (state_ == State::paused && !stepping_) {
    if (!publishers_.is_watched() && now < viewers_due_) return;
    resume();
  }
  viewers_due_ = {};
}

double SimulationLoop::kept_until() const { return recording_ ? recording_->until() : stream_.history().until(); }

void SimulationLoop::start_run(bool paused) {
  tick_ = std::llround(view_->time() / interval());
  exception_.clear();
  viewers_due_ = {};
  state_ = paused ? State::paused : State::running;
  pacer_.set_interval(interval());
  stream_.forget();  // before the state of the new run is told
  stream_.start_run(*view_, run_state());
  anchor();
  const inputs::Scenario& scenario = view_->scenario();
  ROS_INFO_NAMED("run", "run %u: %s%s, %zu cars at %.1f mph, rate %g%s", run_id(), is_replay() ? "replay of " : "",
                 scenario.title.c_str(), view_->cars().size(), scenario.initial.speed / inputs::kMph, pacer_.rate(),
                 paused ? ", paused" : "");
}

void SimulationLoop::tick() {
  const double before = view_->time();
  const double target = static_cast<double>(tick_ + 1) * interval();
  try {
    if (recording_) recording_->advance(target);
    else simulation_->advance(target, &control_.attention);
  } catch (const std::exception& e) {
    exception_ = e.what();
  }
  const bool interrupted = !is_replay() && view_->time() < target && !view_->ended() && exception_.empty();
  if (interrupted) return;  // the rest when the one who waits is served
  ++tick_;
  if (view_->time() > before) stream_.grid_point(*view_);
  watch_bag();
  if (stepping_) {
    ++stepping_->progress.ticks;
    --stepping_->left;
  } else {
    late_max_ = std::max(late_max_, pacer_.done(WallClock::now(), target));
  }
  if (view_->ended() || !exception_.empty()) {
    end_run();
  } else if (stepping_ && stepping_->left == 0) {
    stream_.complete_markers();
    publish_run_info();  // how much of the run can be shown again
    finish_step({true, "now at " + at_time()});
  }
}

void SimulationLoop::end_run() {
  const outcome::Outcome outcome = this->outcome();
  const bool failed = outcome.ended == outcome::Ended::integration_failed;
  state_ = failed ? State::failed : State::ended;
  stream_.end_run(*view_, outcome, run_state());
  idle_due_ = WallClock::now() + wall_seconds(kIdleInterval);
  report(WallClock::now());
  if (stepping_) finish_step({stepping_->left == 0, "the run has ended at " + at_time()});
  if (failed) {
    ROS_ERROR_NAMED("run", "run %u: integration failed at %s: %s", run_id(), at_time().c_str(),
                    outcome.message.c_str());
  } else {
    ROS_INFO_NAMED(
        "run", "run %u: ended at %s (%s): %d cars past the point of derailment, %d off the track, peak force %.0f kip",
        run_id(), at_time().c_str(), outcome::to_string(outcome.ended).data(), outcome.cars_past_pod,
        outcome.cars_off_track, outcome.coupler_force_peak() / inputs::kKip);
  }
}

outcome::Outcome SimulationLoop::outcome() const {
  outcome::Outcome outcome = view_->outcome();
  if (!exception_.empty()) {
    outcome.ended = outcome::Ended::integration_failed;
    outcome.message = exception_;
  }
  return outcome;
}

Answer SimulationLoop::pause() {
  if (stepping_) {
    publish_run_info();
    finish_step({false, "cut short by ~pause at " + at_time()});
    return {true, "steps cut short at " + at_time()};
  }
  switch (state_) {
    case State::running: break;
    case State::paused: return {true, "already paused at " + at_time()};
    case State::ended: return {true, "nothing to pause: the run has ended at " + at_time()};
    case State::failed: return {true, "nothing to pause: the integration has failed at " + at_time()};
  }
  state_ = State::paused;
  stream_.complete_markers();
  publish_run_info();
  return {true, "paused at " + at_time()};
}

Answer SimulationLoop::resume() {
  if (stepping_) return {false, "steps are under way; ~pause cuts them short"};
  if (is_replay() && has_ended()) {
    recording_->advance(0.0);
    start_run(false);
    return {true, "replayed from its beginning"};
  }
  switch (state_) {
    case State::paused: break;
    case State::running: return {true, "already running"};
    case State::ended: return {false, "the run has ended at " + at_time() + "; ~restart starts anew"};
    case State::failed: return {false, "the integration has failed at " + at_time() + "; ~restart starts anew"};
  }
  state_ = State::running;
  anchor();
  publish_run_info();
  return {true, "running from " + at_time()};
}

Answer SimulationLoop::set_rate(double rate) {
  check_rate(rate, "~set_rate");
  pacer_.set_rate(rate);
  anchor();
  publish_run_info();
  return {true, rate == 0.0 ? "as fast as the integrator goes" : fmt::format("rate {:g}", rate)};
}

Answer SimulationLoop::set_colours(const std::string& name) {
  stream_.colour_by(scene::colours_of("~set_colours", "colours", name));
  publish_run_info();
  return {true, "colours by " + name};
}

void SimulationLoop::step(std::uint32_t ticks, double seconds, StepDone done) {
  const auto refuse = [&](const std::string& why) { done({false, why}, {0, view_->time()}); };
  if (stepping_) return refuse("other steps are under way");
  if (state_ == State::running) return refuse("the run is not paused; ~pause first");
  if (has_ended()) return refuse("the run has ended at " + at_time() + "; ~restart starts anew");
  if ((ticks > 0) == (seconds != 0.0)) {
    return refuse(fmt::format("ticks = {}, seconds = {}: give one of the two, greater than 0", ticks, seconds));
  }
  double count = ticks;
  if (ticks == 0) {
    count = std::max(1.0, std::ceil(seconds / interval() - kTickRounding));
    if (!(seconds > 0.0) || !(count <= kStepTicksMax)) {
      return refuse(fmt::format("seconds = {}: out of range; allowed: more than 0, at most {:g}", seconds,
                                kStepTicksMax * interval()));
    }
  }
  stepping_ = Stepping{static_cast<std::int64_t>(count), {0, view_->time()}, std::move(done)};
}

void SimulationLoop::finish_step(const Answer& answer) {
  const Stepping finished = std::move(*stepping_);
  stepping_.reset();
  finished.done(answer, {finished.progress.ticks, view_->time()});
}

Answer SimulationLoop::seek(double time, double& shown) {
  shown = view_->time();
  if (stepping_) return {false, "steps are under way; ~pause cuts them short"};
  if (state_ == State::running) return {false, "the run is not paused; ~pause first"};
  const double until = kept_until();
  if (!(time >= 0.0) || time > until + kTickRounding) {
    return {false, fmt::format("time = {}: out of range; allowed: 0 to {:g} s", time, until)};
  }
  if (recording_) {
    const simulation::Snapshot& moment = recording_->at(time);
    stream_.show(*view_, moment, recording_->outcome_at(time));
    shown = moment.time;
  } else {
    const RunHistory::Moment* moment = stream_.history().nearest(time);
    if (moment == nullptr) return {false, "no moments are kept: parameter history_memory is 0"};
    stream_.show(*view_, moment->now, *moment->outcome);
    shown = moment->now.time;
  }
  return {true, fmt::format("shown as it was at {:g} s", shown)};
}

Answer SimulationLoop::can_restart() const {
  if (is_replay()) return {false, "a recording is replayed: it cannot be run with other inputs"};
  return {true, ""};
}

Answer SimulationLoop::restart(NextRun next) {
  if (stepping_) finish_step({false, "cut short by ~restart at " + at_time()});
  source_ = std::move(next.source);
  view_.reset();
  simulation_ = std::move(next.simulation);
  view_ = std::make_shared<SimulationView>(*simulation_, parameters_.event_coupler_force);
  start_run(next.paused);
  return {true, fmt::format("run {} {}", run_id(), next.paused ? "waits, paused" : "has started")};
}

RunState SimulationLoop::run_state() const {
  RunState state;
  switch (state_) {
    case State::paused: state.state = RunInfo::PAUSED; break;
    case State::running: state.state = RunInfo::RUNNING; break;
    case State::ended: state.state = RunInfo::ENDED; break;
    case State::failed: state.state = RunInfo::FAILED; break;
  }
  state.rate = pacer_.rate();
  state.replay = is_replay();
  state.kept_until = kept_until();
  state.clock_publishers = clock_watch_.rivals();
  return state;
}

void SimulationLoop::publish_run_info() {
  const outcome::Outcome outcome = this->outcome();
  const bool over = state_ == State::ended || state_ == State::failed;
  stream_.run_info(*view_, run_state(), over ? why_ended(outcome) : "");
}

void SimulationLoop::keep_time_going(WallTime now) {
  idle_due_ = now + wall_seconds(kIdleInterval);  // never in bursts
  stream_.idle(kIdleInterval * (pacer_.paced() ? pacer_.rate() : 1.0));
}

void SimulationLoop::watch_clock() {
  const std::uint32_t changes = clock_watch_.changes();
  if (changes == clock_changes_seen_) return;
  clock_changes_seen_ = changes;
  if (const std::vector<std::string> rivals = clock_watch_.rivals(); rivals.empty()) {
    ROS_INFO_NAMED("clock", "/clock is published by one node again");
  } else {
    ROS_ERROR_NAMED("clock",
                    "%s; all nodes that follow it are led astray: end one of them, or give it publish_clock:=false",
                    rivals_text(rivals).c_str());
  }
  publish_run_info();
  report(WallClock::now());
}

void SimulationLoop::watch_bag() {
  if (!bag_ || bag_failed_ || bag_->error().empty()) return;
  bag_failed_ = true;
  ROS_ERROR_NAMED("run", "recording has ended: %s", bag_->error().c_str());
}

void SimulationLoop::report(WallTime now) {
  // A shorter stretch says nothing about the pace.
  const double window_min = 0.5 * parameters_.diagnostics_period;
  Health health;
  health.run_id = run_id();
  switch (state_) {
    case State::paused: health.state = stepping_ ? "stepping" : "paused"; break;
    case State::running: health.state = "running"; break;
    case State::ended: health.state = "ended"; break;
    case State::failed: health.state = "failed"; break;
  }
  health.time = view_->time();
  health.rate = pacer_.rate();
  if (const double window = pacer_.window(now); state_ == State::running && window >= window_min) {
    health.lost_share = pacer_.take_lost() / window;
    health.achieved_rate = pacer_.take_achieved_rate(now, view_->time());
  }
  health.late_max = late_max_;
  health.clock_publishers = clock_watch_.rivals();
  health.outcome = outcome();
  diagnostics_.report(now, stream_.now(), health);
  late_max_ = 0.0;
}

std::string SimulationLoop::at_time() const { return fmt::format("{:g} s", view_->time()); }

}  // namespace train_derail::ros_face
