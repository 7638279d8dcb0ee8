#include "train_derail/ros/run_stream.hpp"

#include <algorithm>
#include <cmath>

#include "train_derail/ros/messages.hpp"
#include "train_derail/ros/track_markers.hpp"

namespace train_derail::ros_face {

namespace {

/// Spacing of ~outcome and of ~impacts, which is long, while the run is under way, simulated [s].
constexpr double kOutcomeInterval = 0.1, kImpactsInterval = 1.0;
/// Spacing of whole scenes in a bag, simulated [s].
constexpr double kWholeInterval = 4.0;
/// By which a moment that is shown again is later than the one before on /clock: tf takes nothing twice [s].
constexpr double kShowStep = 1.0e-3;

}  // namespace

RunStream::RunStream(const StreamOptions& options, std::vector<MessageSink*> sinks)
    : options_(options), sinks_(std::move(sinks)), history_(options.history_bytes) {}

void RunStream::start_run(RunView& run, const RunState& state) {
  ++run_id_;
  clock_.start_run();
  pile_up_ = PileUpFollower();
  const inputs::Scenario& scenario = run.scenario();
  cars_ = run.cars();
  scene_.emplace(scenario, run.cars(), options_.frames, scenario.output.interval * std::max(1, options_.markers_every),
                 options_.colours);
  forget();
  grid_points_ = 0;
  markers_empty_ = true;
  looked_back_ = false;
  whole_markers_ = 0.0;
  if (run_id_ == 1) {
    tf2_msgs::TFMessage fixed;
    fixed.transforms.push_back(make_transform(header(), options_.frames.pod(), 0.0, 0.0, 0.0));
    send<TfStaticTopic>(fixed);
  }
  inputs_ = to_message(scenario, run.cars(), header(), run_id_);
  send<InputsTopic>(inputs_);
  run_info(run, state);
  if (options_.markers_every > 0) {
    send<TrackMarkersTopic>(track_markers(scenario, run.cars(), options_.frames.world));
  }
  send_grid_point(run);
  send_impacts(run);
  send_outcome();
}

void RunStream::grid_point(RunView& run) {
  clock_.advance(run.time());
  send_grid_point(run);
  if (run.ended()) return;
  if (is_due(run, kImpactsInterval)) send_impacts(run);
  if (is_due(run, kOutcomeInterval)) send_outcome();
}

bool RunStream::is_due(const RunView& run, double spacing) const {
  const auto every = std::max<std::int64_t>(1, std::llround(spacing / run.scenario().output.interval));
  return (grid_points_ - 1) % every == 0;
}

void RunStream::send_outcome() { send<OutcomeTopic>(to_message(*outcome_, header(), run_id_)); }

void RunStream::end_run(RunView& run, const outcome::Outcome& outcome, const RunState& state) {
  // Finds nothing but the end itself if the last grid point has seen it.
  send_events(run.take_last_events(last_, outcome));
  complete_markers();
  send_impacts(run);
  outcome_ = std::make_shared<const outcome::Outcome>(outcome);
  history_.conclude(outcome_);
  send_outcome();
  run_info(run, state, why_ended(outcome));
}

void RunStream::idle(double seconds) {
  clock_.advance_by(seconds);
  rosgraph_msgs::Clock clock;
  clock.clock = clock_.now();
  const tf2_msgs::TFMessage frames = moving_frames(header());
  for (MessageSink* sink : sinks_) sink->idle(clock, frames);
}

void RunStream::show(const RunView& run, const simulation::Snapshot& moment, const outcome::Outcome& outcome) {
  showing_ = looked_back_ = true;
  clock_.slip(kShowStep);
  last_ = moment;
  // A camera that sits on the heap jumps with the time.
  pile_up_ = PileUpFollower();
  send_moment(run);
  if (options_.markers_every > 0) send_markers(true);
  send<OutcomeTopic>(to_message(outcome, header(), run_id_));
  showing_ = false;
}

tf2_msgs::TFMessage RunStream::moving_frames(const std_msgs::Header& header) const {
  tf2_msgs::TFMessage moving = to_transforms(cars_, last_.cars, header, options_.frames);
  moving.transforms.push_back(make_transform(header, options_.frames.pile_up(), pile_up_.x(), pile_up_.y(), 0.0));
  return moving;
}

void RunStream::send_moment(const RunView& run) {
  const std_msgs::Header h = header();
  const std::vector<outcome::FirstTouch>& touches = run.touches();
  touches_.clear();
  for (auto touch = touches.rbegin(); touch != touches.rend(); ++touch) {
    if (touch->time > last_.time) continue;
    if (last_.time - touch->time >= scene_->flash_time()) break;
    touches_.push_back(*touch);
  }
  heap_ = scene::find_heap(run.cars(), last_.cars);
  pile_up_.update(heap_, last_.time);
  rosgraph_msgs::Clock clock;
  clock.clock = h.stamp;
  send<ClockTopic>(clock);
  send<TfTopic>(moving_frames(h));
  send<CarsTopic>(to_message(last_.cars, last_.time, h, run_id_));
  send<CouplersTopic>(to_message(last_.couplers, last_.time, h, run_id_));
  send<PileUpTopic>(to_message(heap_, last_.time, h, run_id_));
  markers_sent_ = false;
}

void RunStream::send_grid_point(RunView& run) {
  last_ = run.snapshot();
  ++grid_points_;
  if (is_due(run, kOutcomeInterval) || run.ended()) outcome_ = std::make_shared<const outcome::Outcome>(run.outcome());
  history_.add(last_, outcome_);
  send_moment(run);
  if (options_.markers_every > 0 &&
      (markers_empty_ || ((grid_points_ - 1) % options_.markers_every == 0 && markers_wanted()))) {
    send_markers(false);
    repeat_for_readers();
  }
  send_events(run.take_events(last_));
}

void RunStream::send_events(const std::vector<scene::Occurrence>& events) {
  for (const scene::Occurrence& occurrence : events) {
    send<EventsTopic>(to_message(occurrence, header(), run_id_));
  }
}

void RunStream::send_impacts(const RunView& run) {
  Impacts now = to_message(run.impacts(), run.time(), header(), run_id_);
  if (now.run_id == impacts_.run_id && now.impacts == impacts_.impacts) return;
  impacts_ = std::move(now);
  send<ImpactsTopic>(impacts_);
}

void RunStream::complete_markers() {
  if (options_.markers_every > 0 && !markers_sent_) send_markers(true);
}

void RunStream::colour_by(scene::Colours colours) {
  options_.colours = colours;
  if (!scene_) return;
  scene_->colour_by(colours);
  scene_->update(last_, touches_);
  if (options_.markers_every > 0) send_markers(true);
}

void RunStream::repeat_markers() {
  if (!scene_ || options_.markers_every == 0) return;
  // Whatever is still to be sent must not get lost between the two.
  send_markers(true);
  send_whole(false);
}

void RunStream::repeat_for_readers() {
  // After a look back changes are those against the moment that was shown, of which readers know nothing.
  if (!looked_back_ && last_.time < whole_markers_ + kWholeInterval) return;
  whole_markers_ = last_.time;
  send_whole(true);
  looked_back_ = false;
}

void RunStream::send_whole(bool to_readers) {
  const auto wants = [&](const MessageSink* sink) { return sink->is_read_from_the_middle() == to_readers; };
  if (std::none_of(sinks_.begin(), sinks_.end(), wants)) return;
  const visualization_msgs::MarkerArray whole =
      stamped(to_readers && looked_back_ ? scene_->whole_on_empty() : scene_->whole());
  for (MessageSink* sink : sinks_) {
    if (wants(sink)) sink->send<MarkersTopic>(whole);
  }
}

void RunStream::send_markers(bool all) {
  scene_->update(last_, touches_);
  const visualization_msgs::MarkerArray changes = stamped(scene_->take_changes(all || markers_empty_));
  if (markers_empty_) {
    send<MarkersTopic>(stamped(scene_->whole_on_empty()));
  } else if (!changes.markers.empty()) {
    send<MarkersTopic>(changes);
  }
  markers_empty_ = false;
  markers_sent_ = all;
}

visualization_msgs::MarkerArray RunStream::stamped(visualization_msgs::MarkerArray array) const {
  // RViz waits for the frames of this moment, but would give up those of no moment once tf is ten seconds old.
  for (visualization_msgs::Marker& marker : array.markers) marker.header.stamp = clock_.now();
  return array;
}

bool RunStream::markers_wanted() const {
  return std::any_of(sinks_.begin(), sinks_.end(), [](const MessageSink* sink) { return sink->wants_markers(); });
}

void RunStream::run_info(const RunView& run, const RunState& state, const std::string& message) {
  RunInfo info;
  info.header = header();
  info.run_id = run_id_;
  info.state = state.state;
  info.message = message;
  info.start = clock_.start();
  info.time = run.time();
  info.rate = state.rate;
  info.colours = to_string(options_.colours);
  info.clock_publishers = state.clock_publishers;
  info.interval = run.scenario().output.interval;
  info.cars = static_cast<std::uint32_t>(run.cars().size());
  info.title = run.scenario().title;
  info.kept_until = state.kept_until;
  info.replay = state.replay ? 1 : 0;
  send<RunInfoTopic>(info);
}

std_msgs::Header RunStream::header() const {
  std_msgs::Header h;
  h.stamp = clock_.now();
  h.frame_id = options_.frames.world;
  return h;
}

}  // namespace train_derail::ros_face
