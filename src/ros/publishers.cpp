#include "train_derail/ros/publishers.hpp"

namespace train_derail::ros_face {

namespace {

/// Whether the parameters leave a topic on.
template <class Topic>
bool is_on(const NodeParameters& parameters) {
  if (std::is_same_v<Topic, ClockTopic>) return parameters.publish_clock;
  if (std::is_same_v<Topic, TfTopic> || std::is_same_v<Topic, TfStaticTopic>) return parameters.publish_tf;
  if (std::is_same_v<Topic, MarkersTopic>) return parameters.stream.markers_every > 0;
  return true;
}

}  // namespace

Publishers::Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters) {
  for_each_topic([&](auto topic) {
    using Topic = decltype(topic);
    if (!is_on<Topic>(parameters)) return;
    publishers_[topic_number<Topic>()] =
        private_handle.advertise<typename Topic::Message>(topic_name(Topic::facts, private_handle.getNamespace()),
                                                          Topic::facts.queue, Topic::facts.latched == Latched::yes);
  });
}

void Publishers::receive(const AnyMessage& message) {
  const ::ros::Publisher& publisher = publishers_[message.index()];
  if (publisher) std::visit([&](const auto* content) { publisher.publish(*content); }, message);
}

void Publishers::idle(const rosgraph_msgs::Clock& clock, const tf2_msgs::TFMessage& frames) {
  send<ClockTopic>(clock);
  send<TfTopic>(frames);
}

bool Publishers::wants_markers() const {
  const ::ros::Publisher& markers = publishers_[topic_number<MarkersTopic>()];
  return markers && markers.getNumSubscribers() > 0;
}

bool Publishers::has_subscribers() const {
  for (std::size_t i = 0; i < publishers_.size(); ++i) {
    if (i == topic_number<ClockTopic>() || i == topic_number<TfStaticTopic>()) continue;
    if (publishers_[i] && publishers_[i].getNumSubscribers() > 0) return true;
  }
  return false;
}

}  // namespace train_derail::ros_face
