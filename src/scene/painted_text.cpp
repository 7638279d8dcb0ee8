#include "train_derail/scene/painted_text.hpp"

#include <cmath>
#include <vector>

namespace train_derail::scene {

namespace {

// In heights of a sign.
constexpr double kWide = 0.5, kAdvance = 0.75, kStroke = 0.15;

struct Stroke {
  double x0, y0, x1, y1;  // of its ends, in widths and heights of a sign
};

/// The seven strokes of a digit: top, upper right, lower right, bottom, lower left, upper left, middle.
std::vector<Stroke> digit(unsigned lit) {
  static constexpr Stroke kSeven[] = {{0, 1, 1, 1},   {1, 1, 1, 0.5}, {1, 0.5, 1, 0},  {0, 0, 1, 0},
                                      {0, 0, 0, 0.5}, {0, 0.5, 0, 1}, {0, 0.5, 1, 0.5}};
  std::vector<Stroke> strokes;
  for (unsigned i = 0; i < 7; ++i) {
    if ((lit >> i & 1U) != 0) strokes.push_back(kSeven[i]);
  }
  return strokes;
}

std::vector<Stroke> strokes_of(char sign) {
  static constexpr unsigned kLit[] = {0x3f, 0x06, 0x5b, 0x4f, 0x66, 0x6d, 0x7d, 0x07, 0x7f, 0x6f};
  if (sign >= '0' && sign <= '9') return digit(kLit[sign - '0']);
  switch (sign) {
    case '-': return {{0, 0.5, 1, 0.5}};
    case 'N': return {{0, 0, 0, 1}, {0, 1, 1, 0}, {1, 0, 1, 1}};
    case 'f': return {{0.4, 0, 0.4, 1}, {0.4, 1, 1, 1}, {0.05, 0.5, 0.8, 0.5}};
    case 'm': return {{0, 0, 0, 0.6}, {0, 0.6, 1, 0.6}, {0.5, 0.6, 0.5, 0}, {1, 0.6, 1, 0}};
    case 't': return {{0.45, 0, 0.45, 1}, {0.05, 0.65, 0.85, 0.65}, {0.45, 0, 0.85, 0}};
    default: return {};
  }
}

}  // namespace

void paint_text(Points& points, std::string_view text, double height, double z) {
  const double half = 0.5 * kStroke * height;
  double left = -0.5 * height * (kAdvance * static_cast<double>(text.size()) - (kAdvance - kWide));
  for (const char sign : text) {
    for (const Stroke& s : strokes_of(sign)) {
      const double x0 = left + kWide * height * s.x0, x1 = left + kWide * height * s.x1;
      const double y0 = height * (s.y0 - 0.5), y1 = height * (s.y1 - 0.5);
      const double length = std::hypot(x1 - x0, y1 - y0);
      // Along the stroke, which reaches beyond its ends by half its width, and across it.
      const double ax = half * (x1 - x0) / length, ay = half * (y1 - y0) / length;
      add_quad(points, make_point(x0 - ax + ay, y0 - ay - ax, z), make_point(x1 + ax + ay, y1 + ay - ax, z),
               make_point(x1 + ax - ay, y1 + ay + ax, z), make_point(x0 - ax - ay, y0 - ay + ax, z));
    }
    left += kAdvance * height;
  }
}

}  // namespace train_derail::scene
