// A camera that frames by itself what matters of a run.
#pragma once

#include <array>
#include <optional>
#include <string>

#include <QPoint>
#include <QString>

#include <ros/subscriber.h>
#include <rviz/view_controller.h>

#include "rviz/framing.hpp"
#include "train_derail/CarStates.h"
#include "train_derail/PileUp.h"

namespace rviz {
class EnumProperty;
class FloatProperty;
class IntProperty;
class StringProperty;
class VectorProperty;
}  // namespace rviz

namespace train_derail::rviz_panel {

/// What a WreckView shows.
enum class Show { wreck, train, above, along, car };
inline constexpr std::size_t kShows = 5;

struct ShowFacts {
  const char* choice;   // of the property
  const char* button;   // on a button
  const char* meaning;  // in its tooltip
  Direction direction;  // before somebody turns it
};

/// In the order of Show.
inline constexpr std::array<ShowFacts, kShows> kShowFacts{
    {{"wreck", "Wreck", "the heap of cars, aslant", {-1.75, 0.75}},
     {"whole train", "Train", "the whole train from above", {-M_PI_2, M_PI_2}},
     {"pile-up from above", "Above", "the heap of cars from above", {-M_PI_2, M_PI_2}},
     {"along the track", "Along", "the heap of cars, from ahead along the track", {0.30, 0.45}},
     {"car", "Car", "one car, which the view follows", {-1.75, 0.65}}}};

/// Keeps what it shows inside the part of the picture that the overlay leaves free, and as large as that allows, while
/// the heap grows and the train moves; smoothly, but for another run or another thing to show. The mouse turns it
/// (left), shifts it (middle, or shift and left) and brings it nearer (wheel, right).
class WreckView : public rviz::ViewController {
  Q_OBJECT

 public:
  WreckView();
  ~WreckView() override;

  /// Shows it from its usual direction and distance, also if it is shown already.
  void show_what(Show show);
  Show shown() const;
  void set_car(int number);
  void set_node(const QString& node);

  void update(float wall_dt, float ros_dt) override;
  void handleMouseEvent(rviz::ViewportMouseEvent& event) override;
  void lookAt(const Ogre::Vector3& point) override;
  void reset() override;

 Q_SIGNALS:
  /// Another thing is shown.
  void shown_changed();

 protected:
  void onInitialize() override;
  void onActivate() override;

 private:
  void change_show();
  void subscribe();
  void on_pile_up(const PileUp::ConstPtr& message);
  void on_cars(const CarStates::ConstPtr& message);
  /// A rotation and a shift into RViz's fixed frame; nothing while tf does not know.
  template <class Header>
  bool place(const Header& header, Box& box) const;
  std::optional<Box> wanted() const;
  void set_camera();

  rviz::EnumProperty* show_;
  rviz::IntProperty* car_;
  rviz::FloatProperty *yaw_, *pitch_, *zoom_;
  rviz::VectorProperty* offset_;  // along and across the box, and up [m]
  rviz::StringProperty* node_;

  ::ros::Subscriber pile_up_subscriber_, cars_subscriber_;
  PileUp::ConstPtr pile_up_;
  CarStates::ConstPtr cars_;
  std::uint32_t run_id_ = 0;
  std::optional<Box> box_;  // as shown; nothing: the next one is taken at once
  std::optional<Camera> camera_now_;
};

}  // namespace train_derail::rviz_panel
