#include "train_derail/ros/publishers.hpp"

#include <utility>

#include <ros/message_traits.h>
#include <ros/serialization.h>

// roscpp takes bytes for a message of any type.
namespace ros {
namespace message_traits {
template <>
struct MD5Sum<train_derail::ros_face::MessageBytes> {
  static const char* value(const train_derail::ros_face::MessageBytes&) { return "*"; }
};
template <>
struct DataType<train_derail::ros_face::MessageBytes> {
  static const char* value(const train_derail::ros_face::MessageBytes&) { return "*"; }
};
}  // namespace message_traits
namespace serialization {
template <>
SerializedMessage serializeMessage(const train_derail::ros_face::MessageBytes& message) {
  return message.bytes;
}
}  // namespace serialization
}  // namespace ros

namespace train_derail::ros_face {

namespace {

/// Whether the parameters leave a topic on.
template <class Topic>
bool is_on(const NodeParameters& parameters) {
  if (std::is_same_v<Topic, ClockTopic>) return parameters.publish_clock;
  if (std::is_same_v<Topic, TfTopic> || std::is_same_v<Topic, TfStaticTopic>) return parameters.publish_tf;
  if (std::is_same_v<Topic, MarkersTopic> || std::is_same_v<Topic, TrackMarkersTopic>) {
    return parameters.stream.markers_every > 0;
  }
  return true;
}

}  // namespace

Publishers::Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters) {
  for_each_topic([&](auto topic) {
    using Topic = decltype(topic);
    if (!is_on<Topic>(parameters)) return;
    ::ros::AdvertiseOptions options;
    options.init<typename Topic::Message>(topic_name(Topic::facts, private_handle.getNamespace()), Topic::facts.queue);
    options.latch = Topic::facts.latched == Latched::yes;
    if (std::is_same_v<Topic, MarkersTopic>) {
      options.connect_cb = [this](const ::ros::SingleSubscriberPublisher&) { has_newcomers_ = true; };
      options.callback_queue = &newcomers_;
    }
    publishers_[topic_number<Topic>()] = private_handle.advertise(options);
  });
}

void Publishers::receive(const AnyMessage& message) {
  const std::size_t topic = message.index();
  if (!publishers_[topic] || (topic_facts(topic).latched == Latched::no && !has_listeners(topic))) return;
  std::visit(
      [&](const auto* content) {
        waiting_.push_back({topic, {::ros::serialization::serializeMessage(*content)}});
      },
      message);
}

void Publishers::publish_waiting() {
  for (const auto& [topic, message] : waiting_) {
    publishers_[topic].publish(message);
    before_[topic] = std::exchange(newest_[topic], message);
  }
  waiting_.clear();
}

void Publishers::idle(const rosgraph_msgs::Clock& clock, const tf2_msgs::TFMessage& frames) {
  send<ClockTopic>(clock);
  send<TfTopic>(frames);
}

bool Publishers::has_listeners(std::size_t topic) const {
  return publishers_[topic] && publishers_[topic].getNumSubscribers() > 0;
}

bool Publishers::take_newcomers() {
  newcomers_.callAvailable();
  return std::exchange(has_newcomers_, false);
}

bool Publishers::wants_markers() const { return has_listeners(topic_number<MarkersTopic>()); }

bool Publishers::is_watched() const {
  const bool no_markers = !publishers_[topic_number<MarkersTopic>()];
  return (no_markers || wants_markers()) && has_listeners(topic_number<CouplersTopic>());
}

bool Publishers::has_subscribers() const {
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (i == topic_number<ClockTopic>() || i == topic_number<TfStaticTopic>()) continue;
    if (has_listeners(i)) return true;
  }
  return false;
}

bool Publishers::all_but_newest_sent() const {
  // The newest is held by latches, and roscpp keeps what a socket was given last.
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (has_listeners(i) && before_[i].bytes.buf.use_count() > 1) return false;
  }
  return true;
}

}  // namespace train_derail::ros_face
