// A picture in front of the 3D view.
#pragma once

#include <string>

#include <OgreMaterial.h>
#include <OgreTexture.h>
#include <QImage>

namespace Ogre {
class Overlay;
class PanelOverlayElement;
}  // namespace Ogre

namespace train_derail::rviz_panel {

/// Shows an image at a place of every view of RViz that has overlays. To be used in the thread that draws.
class OverlayPlate {
 public:
  /// `name` must be another than that of all plates in this process.
  explicit OverlayPlate(const std::string& name);
  ~OverlayPlate();
  OverlayPlate(const OverlayPlate&) = delete;
  OverlayPlate& operator=(const OverlayPlate&) = delete;

  /// Takes another image, premultiplied; a null one hides the plate.
  void set_image(const QImage& image);
  /// Moves its upper left corner [pixels].
  void move(double left, double top);
  void hide();
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  void drop_texture();

  const std::string name_;
  Ogre::Overlay* overlay_;
  Ogre::PanelOverlayElement* panel_;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
  int width_ = 0, height_ = 0;
};

}  // namespace train_derail::rviz_panel
