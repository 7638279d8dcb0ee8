#include "train_derail/ros/track_markers.hpp"

#include <algorithm>

#include "marker_parts.hpp"
#include "train_derail/scene/track_picture.hpp"

namespace train_derail::ros_face {

using namespace scene;

using visualization_msgs::Marker;

visualization_msgs::MarkerArray track_markers(const inputs::Scenario& scenario, const std::vector<model::Car>& cars,
                                              const std::string& world) {
  const TrackPicture picture = track_picture(scenario, cars);
  const auto triangles = [&world](const char* ns, int id, Rgb colour, const Points& points) {
    Marker m = make_triangles(world, ns, id, colour);
    m.points = to_message(points);
    return m;
  };
  Marker clear = make_deletion(world, "", 0);
  clear.action = Marker::DELETEALL;
  Marker pod_name = make_text(world, "point_of_derailment", 1, kPodTextHeight);
  pod_name.text = "point of derailment";
  pod_name.pose.position = message_point(picture.pod_name.x, picture.pod_name.y, picture.pod_name.z);

  visualization_msgs::MarkerArray all;
  all.markers = {clear,
                 triangles("ground", 0, kGround, picture.ground),
                 triangles("track", 0, kBallast, picture.ballast),
                 triangles("track", 1, kTie, picture.ties),
                 triangles("track", 2, kRail, picture.rails),
                 triangles("ruler", 0, kRuler, picture.ruler),
                 triangles("point_of_derailment", 0, kPod, picture.pod),
                 pod_name};
  for (auto m = all.markers.begin() + 1; m != all.markers.end(); ++m) m->pose.position.z += picture.height;
  all.markers.erase(std::remove_if(all.markers.begin() + 1, all.markers.end(),
                                   [](const Marker& m) { return m.type == Marker::TRIANGLE_LIST && m.points.empty(); }),
                    all.markers.end());
  return all;
}

}  // namespace train_derail::ros_face
