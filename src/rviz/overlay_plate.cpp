#include "rviz/overlay_plate.hpp"

#include <OgreHardwarePixelBuffer.h>
#include <OgreMaterialManager.h>
#include <OgreTechnique.h>
#include <OgreTextureManager.h>
#include <Overlay/OgreOverlay.h>
#include <Overlay/OgreOverlayManager.h>
#include <Overlay/OgrePanelOverlayElement.h>

namespace train_derail::rviz_panel {

namespace {

const std::string& group() { return Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME; }

}  // namespace

OverlayPlate::OverlayPlate(const std::string& name) : name_(name) {
  auto& overlays = Ogre::OverlayManager::getSingleton();
  material_ = Ogre::MaterialManager::getSingleton().create(name_ + ":material", group());
  Ogre::Pass* pass = material_->getTechnique(0)->getPass(0);
  pass->setLightingEnabled(false);
  pass->setDepthCheckEnabled(false);
  pass->setDepthWriteEnabled(false);
  pass->setSceneBlending(Ogre::SBF_ONE, Ogre::SBF_ONE_MINUS_SOURCE_ALPHA);
  panel_ = static_cast<Ogre::PanelOverlayElement*>(overlays.createOverlayElement("Panel", name_ + ":panel"));
  panel_->setMetricsMode(Ogre::GMM_PIXELS);
  panel_->setMaterialName(material_->getName(), group());
  overlay_ = overlays.create(name_);
  overlay_->add2D(panel_);
}

OverlayPlate::~OverlayPlate() {
  auto& overlays = Ogre::OverlayManager::getSingleton();
  overlay_->remove2D(panel_);
  overlays.destroy(overlay_);
  overlays.destroyOverlayElement(panel_);
  drop_texture();
  Ogre::MaterialManager::getSingleton().remove(material_);
}

void OverlayPlate::drop_texture() {
  if (!texture_) return;
  material_->getTechnique(0)->getPass(0)->removeAllTextureUnitStates();
  Ogre::TextureManager::getSingleton().remove(texture_);
  texture_.reset();
}

void OverlayPlate::set_image(const QImage& image) {
  if (image.isNull()) {
    width_ = height_ = 0;
    hide();
    return;
  }
  if (!texture_ || image.width() != width_ || image.height() != height_) {
    drop_texture();
    width_ = image.width();
    height_ = image.height();
    texture_ = Ogre::TextureManager::getSingleton().createManual(
        name_ + ":texture", group(), Ogre::TEX_TYPE_2D, static_cast<Ogre::uint>(width_),
        static_cast<Ogre::uint>(height_), 0, Ogre::PF_A8R8G8B8, Ogre::TU_DYNAMIC_WRITE_ONLY);
    Ogre::TextureUnitState* unit = material_->getTechnique(0)->getPass(0)->createTextureUnitState();
    unit->setTexture(texture_);
    // Pixel by pixel
    unit->setTextureFiltering(Ogre::TFO_NONE);
    unit->setTextureAddressingMode(Ogre::TextureUnitState::TAM_CLAMP);
  }
  const QImage pixels = image.convertToFormat(QImage::Format_ARGB32_Premultiplied);
  const Ogre::PixelBox box(static_cast<Ogre::uint32>(width_), static_cast<Ogre::uint32>(height_), 1, Ogre::PF_A8R8G8B8,
                           const_cast<uchar*>(pixels.constBits()));
  texture_->getBuffer()->blitFromMemory(box);
  panel_->setDimensions(static_cast<Ogre::Real>(width_), static_cast<Ogre::Real>(height_));
  overlay_->show();
}

void OverlayPlate::move(double left, double top) {
  panel_->setPosition(static_cast<Ogre::Real>(left), static_cast<Ogre::Real>(top));
}

void OverlayPlate::hide() { overlay_->hide(); }

}  // namespace train_derail::rviz_panel
