#include "train_derail/ros/bag_recorder.hpp"

#include <chrono>
#include <filesystem>
#include <stdexcept>

#include <boost/make_shared.hpp>
#include <fmt/chrono.h>

namespace train_derail::ros_face {

namespace {

namespace fs = std::filesystem;

std::string active(const std::string& path) { return path + ".active"; }

}  // namespace

std::string bag_path(const std::string& bag) {
  if (!fs::is_directory(bag)) return fs::absolute(bag);
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return fs::absolute(fs::path(bag) / fmt::format("train_derail_{:%Y-%m-%d-%H-%M-%S}.bag", fmt::localtime(now)));
}

BagRecorder::BagRecorder(std::string path, std::string node)
    : path_(std::move(path)), node_(std::move(node)), bag_(std::make_unique<rosbag::Bag>()) {
  try {
    bag_->open(active(path_), rosbag::bagmode::Write);
    bag_->setCompression(rosbag::compression::LZ4);
  } catch (const std::exception& e) {
    throw std::runtime_error(path_ + ": cannot be written: " + e.what());
  }
}

void BagRecorder::close() {
  if (!bag_) return;
  try {
    bag_->close();
    bag_.reset();
    fs::rename(active(path_), path_);
  } catch (const std::exception& e) {
    fail(e.what());
  }
}

void BagRecorder::fail(const std::string& what) {
  error_ = path_ + ": could not be written whole: " + what;
  // The destructor of a bag that cannot be closed would throw, and end the process: it is left open instead.
  static_cast<void>(bag_.release());
}

template <class Message>
void BagRecorder::write(const std::string& topic, const Message& message, const ::ros::Time& stamp, bool latch) {
  if (!bag_) return;
  auto& connection = connections_[topic];
  if (!connection) {
    namespace traits = ::ros::message_traits;
    connection = boost::make_shared<::ros::M_string>();
    *connection = {{"topic", topic},
                   {"type", traits::datatype<Message>()},
                   {"md5sum", traits::md5sum<Message>()},
                   {"message_definition", traits::definition<Message>()},
                   {"callerid", node_},
                   {"latching", latch ? "1" : "0"}};
  }
  try {
    bag_->write(topic, stamp, message, connection);
  } catch (const std::exception& e) {
    fail(e.what());
  }
}

void BagRecorder::clock(const rosgraph_msgs::Clock& m) { now_ = m.clock; }
void BagRecorder::tf(const tf2_msgs::TFMessage& m) { write("/tf", m, now_); }
void BagRecorder::tf_static(const tf2_msgs::TFMessage& m) {
  write("/tf_static", m, m.transforms.at(0).header.stamp);
}
void BagRecorder::cars(const CarStates& m) { write(node_ + "/cars", m, m.header.stamp); }
void BagRecorder::couplers(const CouplerForces& m) { write(node_ + "/couplers", m, m.header.stamp); }
void BagRecorder::markers(const visualization_msgs::MarkerArray& m) { write(node_ + "/markers", m, now_); }
void BagRecorder::event(const Event& m) { write(node_ + "/events", m, m.header.stamp, false); }
void BagRecorder::inputs(const Inputs& m) { write(node_ + "/inputs", m, m.header.stamp); }
void BagRecorder::impacts(const Impacts& m) { write(node_ + "/impacts", m, m.header.stamp); }
void BagRecorder::outcome(const Outcome& m) { write(node_ + "/outcome", m, m.header.stamp); }
void BagRecorder::run_info(const RunInfo& m) { write(node_ + "/run_info", m, m.header.stamp); }

}  // namespace train_derail::ros_face
