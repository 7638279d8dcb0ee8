#include "train_derail/model/ball_on_ground.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace train_derail::model {

namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// Distances from the centre line, in order, where the slope of the ground may change on one side.
struct Places {
  std::size_t count = 0;
  std::array<double, 8> at;

  void add(double place) { at[count++] = place; }
  void sort() { std::sort(at.begin(), at.begin() + static_cast<std::ptrdiff_t>(count)); }
};

double ballast_height(const CrossSection& t, double place) {
  return -t.rail_height - t.ballast_slope * std::max(place - t.ballast_half_width, 0.0);
}

/// Corners of ballast and roadbed, and where one comes out of the other.
Places places(const CrossSection& t, double side) {
  const double bank = side < 0.0 ? t.bank_right : t.bank_left;
  Places p;
  if (bank != 0.0) {
    p.add(t.crown);
    p.add(t.crown + std::abs(bank) / t.bank_slope);
  }
  if (t.ballast_height == 0.0) return p;
  p.add(t.ballast_half_width);
  p.sort();
  CrossSection bed = t;
  bed.rail_height += t.ballast_height;
  bed.ballast_height = 0.0;
  const auto above = [&](double place) { return ballast_height(t, place) - ground_height(bed, side * place).z; };
  const Places corners = p;
  double from = 0.0, before = above(from);
  for (std::size_t i = 0; i <= corners.count; ++i) {
    const double to =
        i < corners.count ? corners.at[i] : from + (t.ballast_height + std::abs(bank)) / t.ballast_slope + 1.0;
    const double here = above(to);
    if (before * here < 0.0) p.add(from + before / (before - here) * (to - from));
    from = to;
    before = here;
  }
  return p;
}

/// Places between which a slope may be pressed. Beyond a hollow it goes on below the ground, and a ball that is deep
/// there presses on it as well.
double least_foot(const GroundOutline& ground, std::size_t slope) {
  std::size_t i = slope;
  while (i > 0 && ground.slope(i - 1) < ground.slope(i)) --i;
  return i > 0 ? ground.corner(i - 1).offset : -kFar;
}
double most_foot(const GroundOutline& ground, std::size_t slope) {
  std::size_t i = slope;
  while (i < ground.corners() && ground.slope(i) < ground.slope(i + 1)) ++i;
  return i < ground.corners() ? ground.corner(i).offset : kFar;
}

}  // namespace

GroundOutline::GroundOutline(const CrossSection& section) {
  for (const double side : {-1.0, 1.0}) {
    const Places p = places(section, side);
    for (std::size_t i = 0; i < p.count; ++i)
      corner_[count_++] = {side * p.at[i], ground_height(section, side * p.at[i]).z};
  }
  if (count_ == 0) corner_[count_++] = {0.0, ground_height(section, 0.0).z};  // level
  std::sort(corner_.begin(), corner_.begin() + static_cast<std::ptrdiff_t>(count_),
            [](const Corner& a, const Corner& b) { return a.offset < b.offset; });
  // Two at one place would have no slope between them.
  const auto last = std::unique(corner_.begin(), corner_.begin() + static_cast<std::ptrdiff_t>(count_),
                                [](const Corner& a, const Corner& b) { return b.offset - a.offset < 1e-9; });
  count_ = static_cast<std::size_t>(last - corner_.begin());
}

BallTouches ball_on_ground(const GroundOutline& ground, double offset, double height, double radius) {
  BallTouches found;
  const auto add = [&found](const BallTouch& touch) {
    if (touch.depth > 0.0 && found.count < found.at.size()) found.at[found.count++] = touch;
  };
  double slope_before = 0.0;
  for (std::size_t i = 0; i <= ground.corners(); ++i) {
    const double slope = ground.slope(i), up = 1.0 / std::sqrt(1.0 + slope * slope), aside = -slope * up;
    const double foot = offset - radius * aside;
    // An edge between this slope and the one before, that stands out.
    if (i > 0 && slope < slope_before) {
      const double from = ground.corner(i - 1).offset;
      const double before = offset + radius * slope_before / std::sqrt(1.0 + slope_before * slope_before);
      if (before > from && foot <= from) {
        const double sine = (offset - from) / radius, cosine = std::sqrt(std::max(1.0 - sine * sine, 0.0));
        add({sine, cosine, ground.corner(i - 1).z - height + radius * cosine, 2 * i - 1});
      }
    }
    if (foot > least_foot(ground, i) && foot <= most_foot(ground, i)) {
      const GroundOutline::Corner& near = i > 0 ? ground.corner(i - 1) : ground.corner(0);
      const double z = near.z + slope * (foot - near.offset);
      add({aside, up, z - height + radius * up, 2 * i});
    }
    slope_before = slope;
  }
  return found;
}

}  // namespace train_derail::model
