#include "rviz/overlay_display.hpp"

#include <sstream>

#include <OgreViewport.h>

#include <rviz/display_context.h>
#include <rviz/ogre_helpers/render_system.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/render_panel.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include "rviz/overlay_painter.hpp"
#include "rviz/overlay_plate.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr double kRefreshPeriod = 0.1;  // wall [s]
/// Parts of the free width for legend and map, and of a margin's height that a plate may take.
constexpr double kLegendPart = 0.60, kMapPart = 0.38, kMarginPart = 0.90;

/// Names of Ogre's things are for the whole process.
std::string name_of(const void* display, const char* plate) {
  std::ostringstream name;
  name << "train_derail:" << display << ':' << plate;
  return name.str();
}

}  // namespace

struct OverlayDisplay::Plates {
  explicit Plates(const void* display)
      : strip(name_of(display, "strip")), legend(name_of(display, "legend")), map(name_of(display, "map")) {}
  OverlayPlate strip, legend, map;
};

OverlayDisplay::OverlayDisplay() {
  node_ = new rviz::StringProperty("Node", "train_derail", "Name of the simulation's node.", this);
  legend_shown_ = new rviz::BoolProperty("Legend", true, "What the colours mean that are in use.", this);
  map_shown_ = new rviz::BoolProperty("Map", true, "The whole train from above.", this);
  connect(node_, &rviz::Property::changed, this, [this] {
    if (link_) link_->set_node(node_->getStdString());
  });
  for (rviz::Property* property :
       {static_cast<rviz::Property*>(legend_shown_), static_cast<rviz::Property*>(map_shown_)}) {
    connect(property, &rviz::Property::changed, this, [this] { size_ = {}; });
  }
}

OverlayDisplay::~OverlayDisplay() = default;

void OverlayDisplay::onInitialize() { rviz::RenderSystem::get()->prepareOverlays(context_->getSceneManager()); }

void OverlayDisplay::onEnable() {
  link_ = std::make_unique<NodeLink>(node_->getStdString());
  plates_ = std::make_unique<Plates>(this);
  size_ = {};
}

void OverlayDisplay::onDisable() {
  link_.reset();
  plates_.reset();
}

OverlayDisplay::Size OverlayDisplay::size_of_picture() const {
  rviz::RenderPanel* panel = context_->getViewManager()->getRenderPanel();
  const Ogre::Viewport* viewport = panel != nullptr ? panel->getViewport() : nullptr;
  if (viewport == nullptr) return {};
  return {viewport->getActualWidth(), viewport->getActualHeight(), panel->devicePixelRatioF()};
}

void OverlayDisplay::update(float wall_dt, float /*ros_dt*/) {
  wall_ += wall_dt;
  since_refresh_ += wall_dt;
  if (!link_ || since_refresh_ < kRefreshPeriod) return;
  since_refresh_ = 0.0;
  refresh();
}

void OverlayDisplay::refresh() {
  const Size size = size_of_picture();
  if (size.width <= 0 || size.height <= 0) return;
  const NodeView view = link_->view();
  if (view.cars) legend_.use(entries_now(view), view.cars->run_id, wall_);
  const Strip strip = make_strip(view);
  const Entries entries = legend_shown_->getBool() && view.cars ? legend_.entries() : Entries();
  const TrainMap map = map_shown_->getBool() ? make_map(view) : TrainMap();

  const bool anew = size.width != size_.width || size.height != size_.height || size.pixel_ratio != size_.pixel_ratio;
  const double text = text_height(size.height, size.pixel_ratio);
  const double left = kMargins.left * size.width, free = (1.0 - kMargins.left - kMargins.right) * size.width;
  const auto space = [&](double width_part, double margin) {
    return Space{static_cast<int>(width_part * free), static_cast<int>(kMarginPart * margin * size.height), text};
  };
  const double edge = 0.5 * (1.0 - kMarginPart) * kMargins.top * size.height;
  bool changed = anew;
  if (anew || !(strip == strip_)) {
    plates_->strip.set_image(paint_strip(strip, space(1.0, kMargins.top)));
    plates_->strip.move(left, edge);
    changed = true;
  }
  if (anew || !(entries == entries_)) {
    plates_->legend.set_image(paint_legend(entries, space(kLegendPart, kMargins.bottom)));
    plates_->legend.move(left, size.height - edge - plates_->legend.height());
    changed = true;
  }
  if (anew || !(map == map_)) {
    plates_->map.set_image(paint_map(map, space(kMapPart, kMargins.bottom)));
    plates_->map.move(left + free - plates_->map.width(), size.height - edge - plates_->map.height());
    changed = true;
  }
  size_ = size;
  strip_ = strip;
  entries_ = entries;
  map_ = map;
  if (changed) context_->queueRender();
}

}  // namespace train_derail::rviz_panel

PLUGINLIB_EXPORT_CLASS(train_derail::rviz_panel::OverlayDisplay, rviz::Display)
