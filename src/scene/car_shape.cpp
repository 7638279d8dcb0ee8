#include "train_derail/scene/car_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace train_derail::scene {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDeckHeight = 1.3;  // underside of the body
constexpr double kLineWidth = 0.16;
constexpr double kTruckLength = 2.8, kTruckWidth = 2.4;

/// Upright box without its underside from x0 to x1, within y = -w to w.
void add_box(Points& points, double x0, double x1, double w, double low, double high) {
  const std::array<double, 4> x{x1, x1, x0, x0}, y{-w, w, w, -w};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t j = (i + 1) % 4;
    add_quad(points, make_point(x[i], y[i], low), make_point(x[j], y[j], low), make_point(x[j], y[j], high),
             make_point(x[i], y[i], high));
  }
  add_quad(points, make_point(x1, -w, high), make_point(x1, w, high), make_point(x0, w, high),
           make_point(x0, -w, high));
}

/// Level rectangle that is seen from above.
void add_plate(Points& points, double x0, double x1, double w, double z) {
  add_quad(points, make_point(x1, -w, z), make_point(x1, w, z), make_point(x0, w, z), make_point(x0, -w, z));
}

/// Level rectangle that is seen from below.
void add_plate_below(Points& points, double x0, double x1, double w, double z) {
  add_quad(points, make_point(x0, -w, z), make_point(x0, w, z), make_point(x1, w, z), make_point(x1, -w, z));
}

/// A thin strip from a to b on a face that looks to (0, ny, nz).
void add_line(Points& points, const Point& a, const Point& b, double ny, double nz) {
  const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z;
  // Across: normal times direction.
  const double cx = ny * dz - nz * dy, cy = nz * dx, cz = -ny * dx;
  const double share = 0.5 * kLineWidth / std::hypot(cx, cy, cz);
  const auto moved = [&](const Point& p, double side) {
    return make_point(p.x + side * share * cx, p.y + side * share * cy, p.z + side * share * cz);
  };
  add_quad(points, moved(a, -1.0), moved(b, -1.0), moved(b, 1.0), moved(a, 1.0));
}
void add_line(Points& points, const Point& a, const Point& b) { add_line(points, a, b, 0.0, 1.0); }

/// Inside of the footprint.
void add_rim(Points& points, double f, double w, double z) {
  const double x = f - 0.5 * kLineWidth, y = w - 0.5 * kLineWidth;
  const std::array<Point, 4> corner{make_point(x, -y, z), make_point(x, y, z), make_point(-x, y, z),
                                    make_point(-x, -y, z)};
  for (std::size_t i = 0; i < 4; ++i) add_line(points, corner[i], corner[(i + 1) % 4]);
}

/// Its sides and what is seen of it if the car lies on its side; what else there is of it, the body hides.
void add_truck(Points& points, double centre, double width) {
  const double f = 0.5 * kTruckLength, w = 0.5 * std::min(kTruckWidth, width);
  for (const double x : {centre - 0.6 * f, centre + 0.6 * f}) add_plate_below(points, x - 0.25, x + 0.25, w, 0.1);
  for (const double side : {-1.0, 1.0}) {
    const double second = centre - side * f, first = centre + side * f;
    add_quad(points, make_point(first, side * w, 0.1), make_point(second, side * w, 0.1),
             make_point(second, side * w, kDeckHeight), make_point(first, side * w, kDeckHeight));
  }
}

void add_plain_box(CarShape& shape, double f, double w) {
  add_box(shape.body, -f, f, w, kDeckHeight, kRoofHeight);
  add_rim(shape.dark, f, w, kRoofHeight + 0.01);
}

/// Cylinder with domed ends between end sills, manway dome with a platform round it.
void add_tank(CarShape& shape, double f, double w) {
  constexpr double kTop = kRoofHeight - 0.35;  // of the shell; the dome stands on it
  constexpr int kSides = 10;                   // the two lowest are left out
  const double middle = 0.5 * (kTop + kDeckHeight), radius = 0.5 * (kTop - kDeckHeight);
  const double end = 0.92 * f, shoulder = end - std::min(0.7, 0.2 * f);
  // Marks lie on the top of the shell.
  shape.top = kTop + 0.03;
  shape.top_half_width = 0.5 * w;
  shape.top_end = shoulder;
  const auto ring = [&](double x, double share, int i) {
    const double angle = 2.0 * kPi * (i - 0.25 * kSides + 1.0) / kSides;  // from just right of the keel, upwards
    return make_point(x, share * 0.96 * w * std::cos(angle), middle + share * radius * std::sin(angle));
  };
  for (int i = 0; i < kSides - 2; ++i) {
    add_quad(shape.body, ring(shoulder, 1.0, i), ring(-shoulder, 1.0, i), ring(-shoulder, 1.0, i + 1),
             ring(shoulder, 1.0, i + 1));
    shape.body.insert(shape.body.end(),
                      {make_point(end, 0.0, middle), ring(shoulder, 1.0, i), ring(shoulder, 1.0, i + 1),
                       make_point(-end, 0.0, middle), ring(-shoulder, 1.0, i + 1), ring(-shoulder, 1.0, i)});
  }
  const double dome = std::min(0.75, 0.25 * f);
  add_plate(shape.dark, -2.0 * dome, 2.0 * dome, 0.62 * w, kTop + 0.02);
  add_box(shape.body, -dome, dome, std::min(0.6, 0.4 * w), kTop, kRoofHeight);
  add_plate(shape.dark, -f, f, 0.9 * w, kDeckHeight);
  add_rim(shape.dark, f, w, kDeckHeight + 0.01);
  for (const double x : {-0.5 * shoulder, 0.5 * shoulder}) {  // bands round the shell
    for (int i = 2; i < kSides - 4; ++i) {
      const Point a = ring(x, 1.01, i), b = ring(x, 1.01, i + 1);
      add_line(shape.dark, a, b, 0.5 * (a.y + b.y), 0.5 * (a.z + b.z) - middle);
    }
  }
}

/// Open top: walls with a rim, sheets that slope down to a slot, braces across, ribs outside.
void add_hopper(CarShape& shape, double f, double w) {
  constexpr double kSlot = 3.4;
  const double rim = std::min(0.3, 0.2 * w);
  const std::array<double, 4> sx{1.0, 1.0, -1.0, -1.0}, sy{-1.0, 1.0, 1.0, -1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t j = (i + 1) % 4;
    const auto corner = [&](std::size_t k, double x, double y, double z) {
      return make_point(sx[k] * x, sy[k] * y, z);
    };
    add_quad(shape.body, corner(i, 0.86 * f, w, kDeckHeight), corner(j, 0.86 * f, w, kDeckHeight),
             corner(j, f, w, kRoofHeight), corner(i, f, w, kRoofHeight));
    add_quad(shape.body, corner(i, f, w, kRoofHeight), corner(j, f, w, kRoofHeight),
             corner(j, f - rim, w - rim, kRoofHeight), corner(i, f - rim, w - rim, kRoofHeight));
    add_quad(shape.body, corner(i, f - rim, w - rim, kRoofHeight), corner(j, f - rim, w - rim, kRoofHeight),
             corner(j, 0.78 * f, 0.22 * w, kSlot), corner(i, 0.78 * f, 0.22 * w, kSlot));
  }
  add_plate(shape.dark, -0.78 * f, 0.78 * f, 0.22 * w, kSlot);
  add_rim(shape.dark, f, w, kRoofHeight + 0.01);
  for (const double x : {-0.6 * f, -0.2 * f, 0.2 * f, 0.6 * f}) {
    add_line(shape.dark, make_point(x, -w, kRoofHeight), make_point(x, w, kRoofHeight));
    for (const double y : {-w, w}) {
      add_line(shape.dark, make_point(x, 1.01 * y, kDeckHeight), make_point(x, 1.01 * y, kRoofHeight), y, 0.0);
    }
  }
}

/// Gabled roof with ridge and seams, a door in either side.
void add_boxcar(CarShape& shape, double f, double w) {
  constexpr double kEaves = kRoofHeight - 0.45;
  const auto gable = [&](double x) {
    return std::array<Point, 5>{make_point(x, -w, kDeckHeight), make_point(x, w, kDeckHeight), make_point(x, w, kEaves),
                                make_point(x, 0.0, kRoofHeight), make_point(x, -w, kEaves)};
  };
  const std::array<Point, 5> a = gable(f), b = gable(-f);
  add_quad(shape.body, a[0], a[1], a[2], a[4]);
  add_quad(shape.body, b[1], b[0], b[4], b[2]);
  shape.body.insert(shape.body.end(), {a[4], a[2], a[3], b[2], b[4], b[3]});
  add_quad(shape.body, a[1], b[1], b[2], a[2]);
  add_quad(shape.body, b[0], a[0], a[4], b[4]);
  add_quad(shape.body, a[2], b[2], b[3], a[3]);
  add_quad(shape.body, b[4], a[4], a[3], b[3]);
  const double door = std::min(1.8, 0.3 * f), low = kDeckHeight + 0.15, high = kEaves - 0.1;
  for (const double side : {-1.0, 1.0}) {
    add_quad(shape.dark, make_point(side * door, 1.01 * side * w, low), make_point(-side * door, 1.01 * side * w, low),
             make_point(-side * door, 1.01 * side * w, high), make_point(side * door, 1.01 * side * w, high));
  }
  add_rim(shape.dark, f, w, kEaves + 0.01);
  add_line(shape.dark, make_point(-f, 0.0, kRoofHeight + 0.02), make_point(f, 0.0, kRoofHeight + 0.02));
  for (const double x : {-0.5 * f, 0.0, 0.5 * f}) {
    for (const double side : {-1.0, 1.0}) {
      add_line(shape.dark, make_point(x, side * w, kEaves + 0.02), make_point(x, 0.0, kRoofHeight + 0.02));
    }
  }
}

/// Short nose, cab as wide as the car, long hood with fans on it; the nose leads.
void add_locomotive(CarShape& shape, double f, double w) {
  const double hood = 0.62 * w;
  shape.top = kRoofHeight - 0.26;
  shape.top_half_width = hood;
  shape.top_end = 0.94 * f;
  add_plate(shape.dark, -f, f, w, kDeckHeight + 0.2);
  add_box(shape.body, -0.94 * f, 0.56 * f, hood, kDeckHeight, kRoofHeight - 0.3);
  add_box(shape.body, 0.56 * f, 0.80 * f, 0.98 * w, kDeckHeight, kRoofHeight);
  add_box(shape.body, 0.80 * f, 0.96 * f, hood, kDeckHeight, kDeckHeight + 1.6);
  for (const double x : {-0.75 * f, -0.45 * f, -0.15 * f}) {
    add_plate(shape.dark, x - 0.09 * f, x + 0.09 * f, 0.75 * hood, kRoofHeight - 0.28);
  }
  add_rim(shape.dark, f, w, kDeckHeight + 0.22);
}

}  // namespace

CarShape car_shape(const model::Car& car) {
  const double f = 0.5 * car.length, w = 0.5 * car.width;
  CarShape shape;
  shape.top = kRoofHeight + 0.03;
  shape.top_half_width = w;
  shape.top_end = f;
  if (car.body == "tank_car") {
    add_tank(shape, f, w);
  } else if (car.body == "hopper") {
    add_hopper(shape, f, w);
  } else if (car.body == "boxcar") {
    add_boxcar(shape, f, w);
  } else if (car.body == "locomotive") {
    add_locomotive(shape, f, w);
  } else {
    add_plain_box(shape, f, w);
  }
  add_plate_below(shape.dark, -f, f, 0.95 * w, kDeckHeight - 0.01);
  for (const double centre : {0.5 * car.truck_spacing, -0.5 * car.truck_spacing}) {
    add_truck(shape.dark, centre, car.width);
  }
  return shape;
}

}  // namespace train_derail::scene
