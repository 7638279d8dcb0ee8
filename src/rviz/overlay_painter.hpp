// Paints what the overlay of the 3D view says: white on dark plates, readable on any background. Knows no RViz.
#pragma once

#include <QImage>

#include "rviz/overlay_content.hpp"

namespace train_derail::rviz_panel {

/// What a plate may take of a picture.
struct Space {
  int width, height;  // pixels
  double text;        // height of text [pixels]
};

/// Returns the height of the overlay's text in a picture of that height [pixels]. `pixel_ratio`: pixels of the screen
/// for each that a program without regard for fine screens would count.
double text_height(int picture_height, double pixel_ratio);

/// These return a plate, premultiplied, no larger than the space, or a null image if there is nothing to say.
/// The strip is as wide as the space; what does not fit of it is left out, the last statement first.
QImage paint_strip(const Strip& strip, const Space& space);
/// The legend is as small as it can be; where it is too high its text becomes smaller.
QImage paint_legend(const Entries& entries, const Space& space);
/// The map is as wide as the space. An arrow points north if that is known.
QImage paint_map(const TrainMap& map, const Space& space);

}  // namespace train_derail::rviz_panel
