#include "train_derail/ros/clock_watch.hpp"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

#include <ros/master.h>
#include <ros/network.h>
#include <ros/node_handle.h>
#include <ros/this_node.h>
#include <rosgraph_msgs/Clock.h>

namespace train_derail::ros_face {

namespace {

constexpr std::chrono::milliseconds kPeriod(500);
constexpr int kConnectMs = 500;

void ignore(const rosgraph_msgs::ClockConstPtr& /*message*/) {}

/// Whether anything listens there: the master keeps the names of nodes that were killed.
bool is_alive(const std::string& uri) {
  std::string host;
  std::uint32_t port = 0;
  if (!::ros::network::splitURI(uri, host, port)) return false;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) return false;
  bool alive = false;
  for (const addrinfo* a = found; a != nullptr && !alive; a = a->ai_next) {
    const int s = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (s < 0) continue;
    alive = connect(s, a->ai_addr, a->ai_addrlen) == 0;
    pollfd connecting{s, POLLOUT, 0};
    if (!alive && errno == EINPROGRESS && poll(&connecting, 1, kConnectMs) == 1) {
      int error = 0;
      socklen_t size = sizeof error;
      alive = getsockopt(s, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0;
    }
    close(s);
  }
  freeaddrinfo(found);
  return alive;
}

/// What the master answers to `method`; false if it does not.
bool ask_master(const std::string& method, const std::string& argument, XmlRpc::XmlRpcValue& answer) {
  XmlRpc::XmlRpcValue request, response;
  request[0] = ::ros::this_node::getName();
  if (!argument.empty()) request[1] = argument;
  return ::ros::master::execute(method, request, response, answer, false);
}

/// False if the master does not answer.
bool publishers_of_clock(std::vector<std::string>& names) {
  XmlRpc::XmlRpcValue state;
  if (!ask_master("getSystemState", "", state)) return false;
  XmlRpc::XmlRpcValue& topics = state[0];
  for (int i = 0; i < topics.size(); ++i) {
    if (std::string(topics[i][0]) != "/clock") continue;
    for (int k = 0; k < topics[i][1].size(); ++k) {
      const std::string name = topics[i][1][k];
      XmlRpc::XmlRpcValue uri;
      if (ask_master("lookupNode", name, uri) && is_alive(uri)) names.push_back(name);
    }
  }
  std::sort(names.begin(), names.end());
  return true;
}

}  // namespace

ClockRivals::ClockRivals() {
  ::ros::NodeHandle handle;
  handle.setCallbackQueue(&queue_);
  subscriber_ = handle.subscribe<rosgraph_msgs::Clock>("/clock", 1, &ignore);
}

const std::vector<std::string>& ClockRivals::look() {
  std::vector<std::string> now;
  const bool known = subscriber_.getNumPublishers() < 2 || publishers_of_clock(now);
  if (now.size() < 2) now.clear();
  if (known) found_ = std::move(now);  // a master that is silent says nothing new
  return found_;
}

ClockWatch::ClockWatch() : thread_([this] { watch(); }) {}

ClockWatch::~ClockWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

std::vector<std::string> ClockWatch::rivals() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return rivals_;
}

void ClockWatch::watch() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!wake_.wait_for(lock, kPeriod, [this] { return stop_; })) {
    lock.unlock();
    const std::vector<std::string>& now = clock_.look();
    lock.lock();
    if (now == rivals_) continue;
    rivals_ = now;
    ++changes_;
  }
}

std::string rivals_text(const std::vector<std::string>& rivals) {
  std::string names;
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    names += (i == 0 ? "" : i + 1 == rivals.size() ? " and " : ", ") + rivals[i];
  }
  return "time jumps: /clock is published by " + names + ", and one only may";
}

}  // namespace train_derail::ros_face
