#include "rviz/wreck_view.hpp"

#include <algorithm>
#include <cmath>

#include <OgreCamera.h>
#include <OgreMatrix3.h>
#include <OgreQuaternion.h>
#include <OgreViewport.h>
#include <rviz/ogre_helpers/ogre_vector.h>

#include <Eigen/Geometry>
#include <QEvent>

#include <ros/names.h>
#include <ros/node_handle.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/int_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/viewport_mouse_event.h>
#include <pluginlib/class_list_macros.hpp>

#include "train_derail/ros/topics.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr double kTimeConstant = 0.4;  // wall [s]
/// Of a lens between normal and long: a heap's near end is not much larger than its far one [rad].
constexpr double kFieldOfView = 0.61;
/// Nothing nearer is drawn, as a part of the distance: with less, depths far away are too coarse to tell ballast, ties
/// and rails apart.
constexpr double kNearPart = 0.02;
constexpr double kNearLeast = 0.1;  // m
/// About a car that is followed, along and across the track [m].
constexpr double kCarSurroundings = 26.0;
/// A long car, as far as a picture of the whole train is concerned [m].
constexpr double kHalfLongCar = 13.0;
constexpr double kHalfWideCar = 2.0;
/// Radians of turning and powers of e of zooming per pixel; the latter per unit of a mouse's wheel.
constexpr double kTurnPerPixel = 0.005, kZoomPerPixel = 0.01, kZoomPerWheel = 0.001;
constexpr float kPitchMax = static_cast<float>(M_PI_2);
constexpr float kZoomMin = 0.02F, kZoomMax = 50.0F;

Eigen::Vector3d to_eigen(const Ogre::Vector3& v) { return {v.x, v.y, v.z}; }
Ogre::Vector3 to_ogre(const Eigen::Vector3d& v) {
  const Eigen::Vector3f f = v.cast<float>();
  return {f.x(), f.y(), f.z()};
}

Eigen::Matrix3d turned(double heading) {
  return Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

double heading_of(const geometry_msgs::Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z));
}

template <class Position>
Eigen::Vector3d on_ground(const Position& p) {
  return {p.x, p.y, 0.0};
}

/// Along the line from the last car to the first.
Box train_box(const std::vector<CarState>& cars) {
  const Eigen::Vector3d line = on_ground(cars.front().pose.position) - on_ground(cars.back().pose.position);
  const double heading = line.isZero() ? 0.0 : std::atan2(line.y(), line.x());
  Eigen::AlignedBox3d around;
  for (const CarState& car : cars) around.extend(turned(-heading) * on_ground(car.pose.position));
  return {turned(heading) * around.center(), heading, around.sizes().x() + 2.0 * kHalfLongCar,
          around.sizes().y() + 2.0 * kHalfWideCar, kCarHeight};
}

}  // namespace

WreckView::WreckView() {
  show_ = new rviz::EnumProperty("Show", kShowFacts[0].choice, "What is kept in the picture.", this);
  for (std::size_t i = 0; i < kShows; ++i) show_->addOption(kShowFacts[i].choice, static_cast<int>(i));
  car_ = new rviz::IntProperty("Car", 1, "Its number, from 1, where a car is shown.", this);
  car_->setMin(1);
  const Direction usual = kShowFacts[0].direction;
  yaw_ = new rviz::FloatProperty("Yaw", static_cast<float>(usual.yaw),
                                 "From where the camera looks, against the heading of the track: 0 from ahead, "
                                 "-1.57 from the right [rad].",
                                 this);
  pitch_ = new rviz::FloatProperty("Pitch", static_cast<float>(usual.pitch),
                                   "From where the camera looks: 0 from the ground, 1.57 from above [rad].", this);
  pitch_->setMin(-kPitchMax);
  pitch_->setMax(kPitchMax);
  zoom_ = new rviz::FloatProperty("Zoom", 1.0F, "1: as large as fits; 2: from half that distance.", this);
  zoom_->setMin(kZoomMin);
  zoom_->setMax(kZoomMax);
  offset_ = new rviz::VectorProperty("Offset", Ogre::Vector3::ZERO,
                                     "From what is shown to where the camera looks: along the track, to its left, up "
                                     "[m].",
                                     this);
  node_ = new rviz::StringProperty("Node", "train_derail", "Name of the simulation's node.", this);
  connect(show_, &rviz::Property::changed, this, &WreckView::change_show);
  connect(car_, &rviz::Property::changed, this, [this] {
    if (shown() == Show::car) box_.reset();
  });
  connect(node_, &rviz::Property::changed, this, [this] {
    pile_up_.reset();
    cars_.reset();
    if (isActive()) subscribe();
  });
}

WreckView::~WreckView() = default;

void WreckView::onInitialize() {
  near_clip_property_->hide();
  invert_z_->hide();
  camera_->setProjectionType(Ogre::PT_PERSPECTIVE);
  camera_->setFOVy(Ogre::Radian(static_cast<float>(kFieldOfView)));
}

void WreckView::onActivate() { subscribe(); }

Show WreckView::shown() const { return static_cast<Show>(show_->getOptionInt()); }

void WreckView::show_what(Show show) {
  const QString choice = kShowFacts[static_cast<std::size_t>(show)].choice;
  if (show_->getString() != choice) show_->setString(choice);
  else change_show();
}

void WreckView::change_show() {
  const Direction usual = kShowFacts[static_cast<std::size_t>(shown())].direction;
  yaw_->setFloat(static_cast<float>(usual.yaw));
  pitch_->setFloat(static_cast<float>(usual.pitch));
  zoom_->setFloat(1.0F);
  offset_->setVector(Ogre::Vector3::ZERO);
  box_.reset();
  if (isActive()) subscribe();
  Q_EMIT shown_changed();
}

void WreckView::reset() { change_show(); }

void WreckView::set_car(int number) { car_->setInt(number); }

void WreckView::set_node(const QString& node) {
  if (node_->getString() != node) node_->setString(node);
}

void WreckView::subscribe() {
  const std::string name = node_->getStdString();
  std::string error;
  pile_up_subscriber_.shutdown();
  cars_subscriber_.shutdown();
  if (name.empty() || !::ros::names::validate(name, error)) return;
  const std::string node = ::ros::names::resolve(name, false);
  ::ros::NodeHandle handle;
  // A camera needs the newest only.
  pile_up_subscriber_ =
      handle.subscribe(ros_face::topic_name(ros_face::PileUpTopic::facts, node), 1, &WreckView::on_pile_up, this);
  if (shown() == Show::train || shown() == Show::car) {
    cars_subscriber_ =
        handle.subscribe(ros_face::topic_name(ros_face::CarsTopic::facts, node), 1, &WreckView::on_cars, this);
  }
}

void WreckView::on_pile_up(const PileUp::ConstPtr& message) {
  if (message->run_id != run_id_) box_.reset();
  run_id_ = message->run_id;
  pile_up_ = message;
}

void WreckView::on_cars(const CarStates::ConstPtr& message) { cars_ = message; }

template <class Header>
bool WreckView::place(const Header& header, Box& box) const {
  if (header.frame_id == context_->getFixedFrame().toStdString()) return true;
  geometry_msgs::Pose origin;
  origin.orientation.w = 1.0;
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  if (!context_->getFrameManager()->transform(header.frame_id, ::ros::Time(), origin, position, orientation)) {
    return false;
  }
  const Eigen::Quaterniond rotation(orientation.w, orientation.x, orientation.y, orientation.z);
  const Eigen::Vector3d ahead = rotation * Eigen::Vector3d(std::cos(box.heading), std::sin(box.heading), 0.0);
  box.middle = rotation * box.middle + to_eigen(position);
  box.heading = std::atan2(ahead.y(), ahead.x());
  return true;
}

std::optional<Box> WreckView::wanted() const {
  const Show show = shown();
  Box box;
  if (show == Show::train || show == Show::car) {
    if (!cars_ || cars_->cars.empty()) return {};
    if (show == Show::train) {
      box = train_box(cars_->cars);
    } else {
      const std::size_t i = std::min(static_cast<std::size_t>(car_->getInt()), cars_->cars.size()) - 1;
      // The heading is not the car's: the picture is not to spin with it.
      box = {on_ground(cars_->cars[i].pose.position), pile_up_ ? heading_of(pile_up_->pose.orientation) : 0.0,
             kCarSurroundings, kCarSurroundings, kCarHeight};
    }
    return place(cars_->header, box) ? std::optional(box) : std::nullopt;
  }
  if (!pile_up_) return {};
  box = heap_box(on_ground(pile_up_->pose.position), heading_of(pile_up_->pose.orientation), pile_up_->length,
                 pile_up_->width);
  return place(pile_up_->header, box) ? std::optional(box) : std::nullopt;
}

void WreckView::update(float wall_dt, float /*ros_dt*/) {
  if (const std::optional<Box> target = wanted()) {
    box_ = box_ ? between(*box_, *target, 1.0 - std::exp(-wall_dt / kTimeConstant)) : *target;
  }
  set_camera();
}

void WreckView::set_camera() {
  const Ogre::Viewport* viewport = camera_->getViewport();
  if (viewport == nullptr || viewport->getActualHeight() <= 0 || viewport->getActualWidth() <= 0) return;
  const Picture picture{kFieldOfView, static_cast<double>(viewport->getActualWidth()) / viewport->getActualHeight()};
  const Box box = box_ ? *box_ : heap_box(Eigen::Vector3d::Zero(), 0.0, 0.0, 0.0);
  Camera camera = frame(box, {yaw_->getFloat(), pitch_->getFloat()}, picture);
  camera.focus += turned(box.heading) * to_eigen(offset_->getVector());
  camera.distance /= zoom_->getFloat();

  Ogre::Matrix3 axes;
  for (int i = 0; i < 3; ++i) axes.SetColumn(static_cast<std::size_t>(i), to_ogre(camera.axes.col(i)));
    // Ogre would rather move a node that the camera sits on; but RViz's other views, when they take over, ask the
    // camera.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
  camera_->setPosition(to_ogre(camera.position()));
  camera_->setOrientation(Ogre::Quaternion(axes));
#pragma GCC diagnostic pop
  camera_->setNearClipDistance(static_cast<float>(std::max(kNearLeast, kNearPart * camera.distance)));
  camera_now_ = camera;
  context_->queueRender();
}

void WreckView::handleMouseEvent(rviz::ViewportMouseEvent& event) {
  setStatus(
      "Left button: turn. Middle button, or shift and left: shift. Wheel or right button: nearer and farther. Z: as "
      "it was.");
  const bool shifting = event.middle() || (event.left() && event.shift());
  setCursor(shifting ? MoveXY : event.right() ? Zoom : Rotate3D);
  double nearer = kZoomPerWheel * event.wheel_delta;
  if (event.type == QEvent::MouseMove) {
    const int dx = event.x - event.last_x, dy = event.y - event.last_y;
    if (shifting && camera_now_ && event.viewport != nullptr && event.viewport->getActualHeight() > 0) {
      const double metres =
          2.0 * camera_now_->distance * std::tan(0.5 * kFieldOfView) / event.viewport->getActualHeight();
      lookAt(to_ogre(camera_now_->focus + metres * (camera_now_->axes * Eigen::Vector3d(-dx, dy, 0.0))));
    } else if (event.right()) {
      nearer -= kZoomPerPixel * dy;
    } else if (event.left()) {
      yaw_->setFloat(static_cast<float>(std::remainder(yaw_->getFloat() - kTurnPerPixel * dx, 2.0 * M_PI)));
      pitch_->add(static_cast<float>(kTurnPerPixel * dy));
    }
  }
  if (nearer != 0.0) zoom_->multiply(static_cast<float>(std::exp(nearer)));
}

void WreckView::lookAt(const Ogre::Vector3& point) {
  if (!camera_now_) return;
  const double heading = box_ ? box_->heading : 0.0;
  offset_->add(to_ogre(turned(-heading) * (to_eigen(point) - camera_now_->focus)));
  // Until the next update
  camera_now_->focus = to_eigen(point);
}

}  // namespace train_derail::rviz_panel

PLUGINLIB_EXPORT_CLASS(train_derail::rviz_panel::WreckView, rviz::ViewController)
