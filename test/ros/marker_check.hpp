// What RViz accepts without a complaint.
#pragma once

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <visualization_msgs/MarkerArray.h>

namespace train_derail::test {

inline void expect_valid(const visualization_msgs::MarkerArray& array, const std::string& frame) {
  using visualization_msgs::Marker;
  std::set<std::pair<std::string, int>> keys;
  for (std::size_t i = 0; i < array.markers.size(); ++i) {
    const Marker& m = array.markers[i];
    const std::string name = m.ns + "/" + std::to_string(m.id);
    EXPECT_EQ(m.header.frame_id, frame) << name;
    EXPECT_EQ(m.header.stamp, array.markers[0].header.stamp) << name;
    EXPECT_TRUE(keys.insert({m.ns, m.id}).second) << name << " twice";
    if (m.action == Marker::DELETEALL) {
      EXPECT_EQ(i, 0U) << "must come first";
    }
    if (m.action != Marker::ADD) continue;
    const auto& q = m.pose.orientation;
    EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-9) << name;
    EXPECT_GT(m.color.a, 0.0F) << name;
    EXPECT_EQ(m.lifetime, ros::Duration(0.0)) << name;
    if (m.type == Marker::TEXT_VIEW_FACING) {
      EXPECT_GT(m.scale.z, 0.0) << name;
      EXPECT_FALSE(m.text.empty()) << name;
      continue;
    }
    EXPECT_GT(m.scale.x, 0.0) << name;
    const bool lines = m.type == Marker::LINE_LIST;
    if (!lines) {
      EXPECT_GT(m.scale.y, 0.0) << name;
      EXPECT_GT(m.scale.z, 0.0) << name;
    }
    if (!lines && m.type != Marker::TRIANGLE_LIST) continue;
    EXPECT_FALSE(m.points.empty()) << name;
    EXPECT_EQ(m.points.size() % (lines ? 2 : 3), 0U) << name;
    EXPECT_TRUE(m.colors.empty() || m.colors.size() == m.points.size()) << name;
    for (const auto& p : m.points) EXPECT_TRUE(std::isfinite(p.x + p.y + p.z)) << name;
  }
}

}  // namespace train_derail::test
