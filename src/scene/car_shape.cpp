#include "train_derail/scene/car_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace train_derail::scene {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLineWidth = 0.16;
constexpr double kTruckLength = 2.8, kTruckWidth = 2.4, kTruckHeight = 1.1;

/// What all parts of a body are drawn in.
struct Hull {
  double f, w;         // half its length and width
  double floor, roof;  // heights above the rail head
};

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
void add_truck(Points& points, double centre, double width, double height) {
  const double f = 0.5 * kTruckLength, w = 0.5 * std::min(kTruckWidth, width);
  for (const double x : {centre - 0.6 * f, centre + 0.6 * f}) add_plate_below(points, x - 0.25, x + 0.25, w, 0.1);
  for (const double side : {-1.0, 1.0}) {
    const double second = centre - side * f, first = centre + side * f;
    add_quad(points, make_point(first, side * w, 0.1), make_point(second, side * w, 0.1),
             make_point(second, side * w, height), make_point(first, side * w, height));
  }
}

void add_plain_box(CarShape& shape, const Hull& hull) {
  const double f = hull.f, w = hull.w, floor = hull.floor, roof = hull.roof;
  add_box(shape.body, -f, f, w, floor, roof);
  add_rim(shape.dark, f, w, roof + 0.01);
}

/// A shell along the car: circles seen from the front, narrower ones in the heads.
struct Shell {
  double middle, across, up;  // height of its axis, half axes of its section
  double half;                // half its length between the heads
  double head;                // how far a head bulges
  int circles;                // that a head has, the one on the shell included
};

constexpr int kSides = 14;  // of a shell; the two lowest are left out

/// Corner i of a circle of the shell at the front, or at the rear.
Point shell_point(const Shell& s, double end, int circle, int i) {
  const double bulge = 0.5 * kPi * circle / s.circles, share = std::cos(bulge);
  const double angle = 2.0 * kPi * (i - 0.25 * kSides + 1.0) / kSides;  // from just right of the keel, upwards
  return make_point(end * (s.half + s.head * std::sin(bulge)), share * s.across * std::cos(angle),
                    s.middle + share * s.up * std::sin(angle));
}

void add_shell(Points& points, const Shell& s) {
  const double tip = s.half + s.head;
  for (int i = 0; i < kSides - 2; ++i) {
    add_quad(points, shell_point(s, 1.0, 0, i), shell_point(s, -1.0, 0, i), shell_point(s, -1.0, 0, i + 1),
             shell_point(s, 1.0, 0, i + 1));
    for (int c = 0; c + 1 < s.circles; ++c) {
      add_quad(points, shell_point(s, 1.0, c + 1, i), shell_point(s, 1.0, c, i), shell_point(s, 1.0, c, i + 1),
               shell_point(s, 1.0, c + 1, i + 1));
      add_quad(points, shell_point(s, -1.0, c + 1, i + 1), shell_point(s, -1.0, c, i + 1), shell_point(s, -1.0, c, i),
               shell_point(s, -1.0, c + 1, i));
    }
    const int last = s.circles - 1;
    points.insert(points.end(),
                  {make_point(tip, 0.0, s.middle), shell_point(s, 1.0, last, i), shell_point(s, 1.0, last, i + 1),
                   make_point(-tip, 0.0, s.middle), shell_point(s, -1.0, last, i + 1), shell_point(s, -1.0, last, i)});
  }
}

/// Half of a round body's width, and of its height.
double round_radius(const Hull& hull) { return std::min({hull.f, hull.w, 0.5 * (hull.roof - hull.floor)}); }

/// Shell between end sills, manway dome with a platform round it. `round`: it is as the body that presses on others,
/// and what stands out of that is left out.
void add_tank(CarShape& shape, const Hull& hull, bool round) {
  const double f = hull.f, w = hull.w, floor = hull.floor, roof = hull.roof;
  const double radius = round_radius(hull), top = round ? 0.5 * (floor + roof) + radius : roof - 0.35;
  const double end = 0.92 * f, shoulder = end - std::min(0.7, 0.2 * f);
  const Shell shell = round ? Shell{0.5 * (floor + roof), radius, radius, f - radius, radius, 3}
                            : Shell{0.5 * (top + floor), 0.96 * w, 0.5 * (top - floor), shoulder, end - shoulder, 1};
  // Marks lie on the top of the shell.
  shape.top = top + 0.03;
  shape.top_half_width = 0.5 * w;
  shape.top_end = shell.half;
  add_shell(shape.body, shell);
  const double dome = std::min(0.75, 0.25 * f);
  add_plate(shape.dark, -2.0 * dome, 2.0 * dome, round ? 0.3 * w : 0.62 * w, top + 0.02);
  if (!round) {
    add_box(shape.body, -dome, dome, std::min(0.6, 0.4 * w), top, roof);
    add_plate(shape.dark, -f, f, 0.9 * w, floor);
    add_rim(shape.dark, f, w, floor + 0.01);
  }
  for (const double place : {-0.5, 0.5}) {  // bands round the shell
    for (int i = 2; i < kSides - 4; ++i) {
      Shell band = shell;
      band.half *= place;
      band.across *= 1.01;
      band.up *= 1.01;
      const Point a = shell_point(band, 1.0, 0, i), b = shell_point(band, 1.0, 0, i + 1);
      add_line(shape.dark, a, b, 0.5 * (a.y + b.y), 0.5 * (a.z + b.z) - shell.middle);
    }
  }
}

/// Open top: walls with a rim, sheets that slope down to a slot, braces across, ribs outside.
void add_hopper(CarShape& shape, const Hull& hull) {
  const double f = hull.f, w = hull.w, floor = hull.floor, roof = hull.roof;
  const double slot = 0.5 * (floor + roof) + 0.4;
  const double rim = std::min(0.3, 0.2 * w);
  const std::array<double, 4> sx{1.0, 1.0, -1.0, -1.0}, sy{-1.0, 1.0, 1.0, -1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t j = (i + 1) % 4;
    const auto corner = [&](std::size_t k, double x, double y, double z) {
      return make_point(sx[k] * x, sy[k] * y, z);
    };
    add_quad(shape.body, corner(i, 0.86 * f, w, floor), corner(j, 0.86 * f, w, floor), corner(j, f, w, roof),
             corner(i, f, w, roof));
    add_quad(shape.body, corner(i, f, w, roof), corner(j, f, w, roof), corner(j, f - rim, w - rim, roof),
             corner(i, f - rim, w - rim, roof));
    add_quad(shape.body, corner(i, f - rim, w - rim, roof), corner(j, f - rim, w - rim, roof),
             corner(j, 0.78 * f, 0.22 * w, slot), corner(i, 0.78 * f, 0.22 * w, slot));
  }
  add_plate(shape.dark, -0.78 * f, 0.78 * f, 0.22 * w, slot);
  add_rim(shape.dark, f, w, roof + 0.01);
  for (const double x : {-0.6 * f, -0.2 * f, 0.2 * f, 0.6 * f}) {
    add_line(shape.dark, make_point(x, -w, roof), make_point(x, w, roof));
    for (const double y : {-w, w}) {
      add_line(shape.dark, make_point(x, 1.01 * y, floor), make_point(x, 1.01 * y, roof), y, 0.0);
    }
  }
}

/// Gabled roof with ridge and seams, a door in either side.
void add_boxcar(CarShape& shape, const Hull& hull) {
  const double f = hull.f, w = hull.w, floor = hull.floor, roof = hull.roof;
  const double eaves = roof - 0.45;
  const auto gable = [&](double x) {
    return std::array<Point, 5>{make_point(x, -w, floor), make_point(x, w, floor), make_point(x, w, eaves),
                                make_point(x, 0.0, roof), make_point(x, -w, eaves)};
  };
  const std::array<Point, 5> a = gable(f), b = gable(-f);
  add_quad(shape.body, a[0], a[1], a[2], a[4]);
  add_quad(shape.body, b[1], b[0], b[4], b[2]);
  shape.body.insert(shape.body.end(), {a[4], a[2], a[3], b[2], b[4], b[3]});
  add_quad(shape.body, a[1], b[1], b[2], a[2]);
  add_quad(shape.body, b[0], a[0], a[4], b[4]);
  add_quad(shape.body, a[2], b[2], b[3], a[3]);
  add_quad(shape.body, b[4], a[4], a[3], b[3]);
  const double door = std::min(1.8, 0.3 * f), low = floor + 0.15, high = eaves - 0.1;
  for (const double side : {-1.0, 1.0}) {
    add_quad(shape.dark, make_point(side * door, 1.01 * side * w, low), make_point(-side * door, 1.01 * side * w, low),
             make_point(-side * door, 1.01 * side * w, high), make_point(side * door, 1.01 * side * w, high));
  }
  add_rim(shape.dark, f, w, eaves + 0.01);
  add_line(shape.dark, make_point(-f, 0.0, roof + 0.02), make_point(f, 0.0, roof + 0.02));
  for (const double x : {-0.5 * f, 0.0, 0.5 * f}) {
    for (const double side : {-1.0, 1.0}) {
      add_line(shape.dark, make_point(x, side * w, eaves + 0.02), make_point(x, 0.0, roof + 0.02));
    }
  }
}

/// Short nose, cab as wide as the car, long hood with fans on it; the nose leads.
void add_locomotive(CarShape& shape, const Hull& hull) {
  const double f = hull.f, w = hull.w, floor = hull.floor, roof = hull.roof;
  const double hood = 0.62 * w;
  shape.top = roof - 0.26;
  shape.top_half_width = hood;
  shape.top_end = 0.94 * f;
  add_plate(shape.dark, -f, f, w, floor + 0.2);
  add_box(shape.body, -0.94 * f, 0.56 * f, hood, floor, roof - 0.3);
  add_box(shape.body, 0.56 * f, 0.80 * f, 0.98 * w, floor, roof);
  add_box(shape.body, 0.80 * f, 0.96 * f, hood, floor, std::min(floor + 1.6, roof - 0.3));
  for (const double x : {-0.75 * f, -0.45 * f, -0.15 * f}) {
    add_plate(shape.dark, x - 0.09 * f, x + 0.09 * f, 0.75 * hood, roof - 0.28);
  }
  add_rim(shape.dark, f, w, floor + 0.22);
}

}  // namespace

CarShape car_shape(const model::Car& car) {
  const Hull hull{0.5 * car.length, 0.5 * car.width, car.floor_height, car.roof_height};
  const double f = hull.f, w = hull.w;
  CarShape shape;
  shape.top = hull.roof + 0.03;
  shape.top_half_width = w;
  shape.top_end = f;
  if (car.cylinder || car.body == "tank_car") {
    add_tank(shape, hull, car.cylinder);
  } else if (car.body == "hopper") {
    add_hopper(shape, hull);
  } else if (car.body == "boxcar") {
    add_boxcar(shape, hull);
  } else if (car.body == "locomotive") {
    add_locomotive(shape, hull);
  } else {
    add_plain_box(shape, hull);
  }
  if (!car.cylinder) add_plate_below(shape.dark, -f, f, 0.95 * w, hull.floor - 0.01);
  for (const double centre : {0.5 * car.truck_spacing, -0.5 * car.truck_spacing}) {
    add_truck(shape.dark, centre, car.width, std::min(kTruckHeight, hull.floor));
  }
  return shape;
}

}  // namespace train_derail::scene
