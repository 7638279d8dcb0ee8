#include "train_derail/ros/bag_recorder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

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
void BagRecorder::tf_static(const tf2_msgs::TFMessage& m) { write("/tf_static", m, m.transforms.at(0).header.stamp); }
void BagRecorder::cars(const CarStates& m) { write(node_ + "/cars", m, m.header.stamp); }
void BagRecorder::couplers(const CouplerForces& m) { write(node_ + "/couplers", m, m.header.stamp); }
void BagRecorder::markers(const visualization_msgs::MarkerArray& m) { write(node_ + "/markers", m, now_); }
void BagRecorder::event(const Event& m) { write(node_ + "/events", m, m.header.stamp, false); }
void BagRecorder::inputs(const Inputs& m) { write(node_ + "/inputs", m, m.header.stamp); }
void BagRecorder::impacts(const Impacts& m) { write(node_ + "/impacts", m, m.header.stamp); }
void BagRecorder::outcome(const Outcome& m) { write(node_ + "/outcome", m, m.header.stamp); }
void BagRecorder::run_info(const RunInfo& m) { write(node_ + "/run_info", m, m.header.stamp); }

}  // namespace train_derail::ros_face
