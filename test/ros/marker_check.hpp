// What RViz accepts without a complaint, and what it then shows.
#pragma once

#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <visualization_msgs/MarkerArray.h>

namespace train_derail::test {

/// `world`: frame of what belongs to no car; all other frames end in "car_" and the marker's id.
inline void expect_valid(const visualization_msgs::MarkerArray& array, const std::string& world) {
  using visualization_msgs::Marker;
  std::set<std::pair<std::string, int>> keys;
  for (std::size_t i = 0; i < array.markers.size(); ++i) {
    const Marker& m = array.markers[i];
    const std::string name = m.ns + "/" + std::to_string(m.id);
    EXPECT_EQ(m.header.stamp, array.markers[0].header.stamp) << name;
    EXPECT_TRUE(keys.insert({m.ns, m.id}).second) << name << " twice";
    if (m.action == Marker::DELETEALL) {
      EXPECT_EQ(i, 0U) << "must come first";
    }
    if (m.action != Marker::ADD) continue;
    if (m.header.frame_id == world) {
      EXPECT_FALSE(m.frame_locked) << name;
    } else {
      char frame[16];
      std::snprintf(frame, sizeof(frame), "car_%03d", m.id);
      EXPECT_EQ(m.header.frame_id, frame) << name;
      EXPECT_TRUE(m.frame_locked) << name;
    }
    const auto& q = m.pose.orientation;
    EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-9) << name;
    EXPECT_GT(m.color.a, 0.0F) << name;
    EXPECT_EQ(m.lifetime, ros::Duration(0.0)) << name;
    EXPECT_GT(m.scale.z, 0.0) << name;
    if (m.type == Marker::TEXT_VIEW_FACING) {
      EXPECT_FALSE(m.text.empty()) << name;
      continue;
    }
    EXPECT_GT(m.scale.x, 0.0) << name;
    EXPECT_GT(m.scale.y, 0.0) << name;
    if (m.type != Marker::TRIANGLE_LIST) continue;
    EXPECT_FALSE(m.points.empty()) << name;
    EXPECT_EQ(m.points.size() % 3, 0U) << name;
    EXPECT_TRUE(m.colors.empty()) << name << ": unlit in RViz";
    for (const auto& p : m.points) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z)) << name;
  }
}

/// What somebody sees who has received one array after the other, as RViz keeps it.
class Shown {
 public:
  using Marker = visualization_msgs::Marker;

  void receive(const visualization_msgs::MarkerArray& array) {
    for (const Marker& m : array.markers) {
      if (m.action == Marker::DELETEALL) all_.clear();
      else if (m.action == Marker::DELETE) all_.erase({m.ns, m.id});
      else all_[{m.ns, m.id}] = m;
    }
  }
  /// Null if it is not shown.
  const Marker* find(const std::string& ns, int id) const {
    const auto found = all_.find({ns, id});
    return found == all_.end() ? nullptr : &found->second;
  }
  std::size_t count(const std::string& ns) const {
    std::size_t n = 0;
    for (const auto& [key, marker] : all_) n += key.first == ns ? 1 : 0;
    return n;
  }
  const std::map<std::pair<std::string, int>, Marker>& all() const { return all_; }
  /// Stamps aside.
  bool operator==(const Shown& other) const {
    if (all_.size() != other.all_.size()) return false;
    for (const auto& [key, marker] : all_) {
      const auto same = other.all_.find(key);
      if (same == other.all_.end()) return false;
      Marker a = marker, b = same->second;
      a.header.stamp = b.header.stamp = {};
      if (a != b) return false;
    }
    return true;
  }

 private:
  std::map<std::pair<std::string, int>, Marker> all_;
};

}  // namespace train_derail::test
