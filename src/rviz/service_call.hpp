#pragma once

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <ros/connection.h>
#include <ros/serialization.h>
#include <ros/service_manager.h>
#include <ros/service_server_link.h>
#include <ros/service_traits.h>

namespace train_derail::rviz_panel {

/// Service calls under way, which another thread can break off; ros::service::call() would wait as long as the node
/// holds the connection, even one that is stopped in a debugger.
class BreakableCalls {
 public:
  /// False if nobody answered. Blocks.
  template <class Service>
  bool call(const std::string& name, const typename Service::Request& request, typename Service::Response& response) {
    namespace traits = ::ros::service_traits;
    // Else the node closes the connection with its answer, and roscpp drops an answer that it is not yet waiting for
    // when it sees that, as on a busy machine (ros_comm issue 1976): done, and "no answer".
    constexpr bool kPersistent = true;
    const auto link = ::ros::ServiceManager::instance()->createServiceServerLink(
        name, kPersistent, traits::md5sum<Service>(), traits::md5sum<Service>(), {});
    if (!link || !link->isValid()) return false;
    const Entry entry(*this, link);
    ::ros::SerializedMessage answer;
    if (!link->call(::ros::serialization::serializeMessage(request), answer)) return false;
    try {
      ::ros::serialization::deserializeMessage(answer, response);
    } catch (const ::ros::serialization::StreamOverrunException&) {
      return false;
    }
    return true;
  }

  void break_off() {
    std::vector<::ros::ServiceServerLinkPtr> links;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      links = links_;
    }
    for (const auto& link : links) drop(link);
  }
  /// The same, for later ones too.
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    break_off();
  }

 private:
  static void drop(const ::ros::ServiceServerLinkPtr& link) {
    link->getConnection()->drop(::ros::Connection::Destructing);
  }

  class Entry {
   public:
    Entry(BreakableCalls& calls, const ::ros::ServiceServerLinkPtr& link) : calls_(calls), link_(link) {
      const std::lock_guard<std::mutex> lock(calls_.mutex_);
      calls_.links_.push_back(link_);
      if (calls_.closed_) drop(link_);
    }
    ~Entry() {
      {
        const std::lock_guard<std::mutex> lock(calls_.mutex_);
        auto& links = calls_.links_;
        links.erase(std::find(links.begin(), links.end(), link_));
      }
      drop(link_);
    }
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;

   private:
    BreakableCalls& calls_;
    ::ros::ServiceServerLinkPtr link_;
  };

  std::mutex mutex_;
  std::vector<::ros::ServiceServerLinkPtr> links_;
  bool closed_ = false;
};

}  // namespace train_derail::rviz_panel
