#include "train_derail/ros/bag_recorder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <fmt/chrono.h>
#include <boost/make_shared.hpp>

namespace train_derail::ros_face {

namespace {

namespace fs = std::filesystem;

constexpr char kNoFile[] = ": is not a file; a bag needs one";

std::string active(const std::string& path) { return path + ".active"; }

/// When a message was sent; 0 if it does not say. A type without a header needs a function of its own here.
template <class Message>
::ros::Time stamp_of(const Message& m) {
  return m.header.stamp;
}
::ros::Time stamp_of(const rosgraph_msgs::Clock& m) { return m.clock; }
::ros::Time stamp_of(const tf2_msgs::TFMessage& m) { return m.transforms.at(0).header.stamp; }
::ros::Time stamp_of(const visualization_msgs::MarkerArray& /*m*/) { return {}; }

/// What a bag says of a topic.
template <class Message>
boost::shared_ptr<::ros::M_string> make_connection(const Message&, const TopicFacts& topic, const std::string& node) {
  namespace traits = ::ros::message_traits;
  auto connection = boost::make_shared<::ros::M_string>();
  *connection = {{"topic", topic_name(topic, node)},
                 {"type", traits::datatype<Message>()},
                 {"md5sum", traits::md5sum<Message>()},
                 {"message_definition", traits::definition<Message>()},
                 {"callerid", node},
                 {"latching", topic.latched == Latched::yes ? "1" : "0"}};
  return connection;
}

}  // namespace

std::string bag_path(const std::string& bag) {
  if (!fs::is_directory(bag)) return fs::absolute(bag);
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  const std::string name = fmt::format("train_derail_{:%Y-%m-%d-%H-%M-%S}", fmt::localtime(now));
  fs::path path = fs::absolute(fs::path(bag) / (name + ".bag"));
  for (int i = 2; fs::exists(path) || fs::exists(active(path)); ++i)
    path.replace_filename(fmt::format("{}_{}.bag", name, i));
  return path;
}

BagRecorder::BagRecorder(files::OutputFile file, std::string node)
    : path_(file.path()), node_(std::move(node)), file_(std::move(file)) {
  const std::string name = file_->name_so_far();
  if (name.empty()) throw std::runtime_error(path_ + kNoFile);
  begin(name);
}

BagRecorder::BagRecorder(std::string path, std::string node) : path_(std::move(path)), node_(std::move(node)) {
  struct stat status;
  if (stat(path_.c_str(), &status) == 0) {
    if (!S_ISREG(status.st_mode)) throw std::runtime_error(path_ + kNoFile);
    throw files::ExistsError(path_ + ": exists already and is not overwritten");
  }
  const std::string name = active(path_);
  lock_ = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  const bool there = lock_ < 0 && errno == EEXIST;
  if (there) lock_ = open(name.c_str(), O_RDWR | O_CLOEXEC);
  if (lock_ < 0) throw std::runtime_error(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    unlock();
    throw std::runtime_error(name + ": another process is recording it");
  }
  struct stat locked, named;
  if (fstat(lock_, &locked) != 0 || stat(name.c_str(), &named) != 0 || locked.st_ino != named.st_ino) {
    unlock();
    throw std::runtime_error(name + ": another process has just finished it");
  }
  if (there) {
    unlock();
    throw files::ExistsError(name +
                             ": exists already, from a recording that was cut off; `rosbag reindex` makes it whole");
  }
  begin(name);
}

void BagRecorder::begin(const std::string& name) {
  bag_ = std::make_unique<rosbag::Bag>();
  try {
    bag_->open(name, rosbag::bagmode::Write);
    bag_->setCompression(rosbag::compression::LZ4);
  } catch (const std::exception& e) {
    unlock();
    throw std::runtime_error(path_ + ": cannot be written: " + e.what());
  }
}

void BagRecorder::unlock() {
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
}

void BagRecorder::close() {
  if (!bag_) return;
  try {
    bag_->close();
    bag_.reset();
    if (file_) {
      file_->commit();
    } else {
      if (fsync(lock_) != 0) throw std::runtime_error(std::strerror(errno));
      files::move_into_place(active(path_), path_, files::Existing::refuse);
      unlock();
    }
  } catch (const std::exception& e) {
    fail(e.what());
  }
}

void BagRecorder::discard() {
  try {
    if (bag_) bag_->close();
    bag_.reset();
  } catch (const std::exception& e) {
    fail(e.what());
  }
  file_.reset();
}

void BagRecorder::fail(const std::string& what) {
  error_ = path_ + ": could not be written whole: " + what;
  if (!file_) error_ += "; what there is: " + active(path_);
  // The destructor of a bag that cannot be closed would throw, and end the process: it is left open instead.
  static_cast<void>(bag_.release());
}

void BagRecorder::receive(const AnyMessage& message) {
  // `rosbag play --clock` makes /clock.
  if (!bag_ || message.index() == topic_number<ClockTopic>()) return;
  std::visit(
      [&](const auto* content) {
        auto& connection = connections_[message.index()];
        if (!connection) connection = make_connection(*content, topic_facts(message.index()), node_);
        try {
          now_ = std::max(now_, stamp_of(*content));
          bag_->write(connection->at("topic"), now_, *content, connection);
        } catch (const std::exception& e) {
          fail(e.what());
        }
      },
      message);
}

}  // namespace train_derail::ros_face
