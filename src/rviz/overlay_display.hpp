// The texts in front of the 3D view, as a display of RViz.
#pragma once

#include <memory>

#include <rviz/display.h>

#include "rviz/node_link.hpp"
#include "rviz/overlay_content.hpp"

namespace rviz {
class BoolProperty;
class StringProperty;
}  // namespace rviz

namespace train_derail::rviz_panel {

/// Shows in front of the 3D view, in the margins that WreckView leaves free: what the run is and has come to, at the
/// top; the legend of what is shown, below on the left; a map of the train, below on the right. Looks at the node ten
/// times a second and paints what has changed.
class OverlayDisplay : public rviz::Display {
  Q_OBJECT

 public:
  OverlayDisplay();
  ~OverlayDisplay() override;

  void update(float wall_dt, float ros_dt) override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  struct Plates;

  /// The picture's, in pixels.
  struct Size {
    int width = 0, height = 0;
    double pixel_ratio = 1.0;
  };
  Size size_of_picture() const;
  void refresh();

  rviz::StringProperty* node_;
  rviz::BoolProperty *legend_shown_, *map_shown_;
  std::unique_ptr<NodeLink> link_;  // while the display is enabled
  std::unique_ptr<Plates> plates_;
  double since_refresh_ = 0.0, wall_ = 0.0;  // [s]
  Legend legend_;

  // As painted
  Size size_;
  Strip strip_;
  Entries entries_;
  TrainMap map_;
};

}  // namespace train_derail::rviz_panel
