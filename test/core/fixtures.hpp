// Scenario builders, random states and small helpers that the core tests share.
#pragma once

#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/derailment_model.hpp"
#include "train_derail/simulation/simulation.hpp"
#include "train_derail/solver/integrator.hpp"

// What GoogleTest writes for these values, in messages and in names of tests.
namespace train_derail::inputs {
inline void PrintTo(Method m, std::ostream* out) {
  *out << (m == Method::cash_karp        ? "cash_karp"
           : m == Method::dormand_prince ? "dormand_prince"
           : m == Method::bdf            ? "bdf"
                                         : "semi_implicit");
}
inline void PrintTo(OnTrackLaw law, std::ostream* out) {
  *out << (law == OnTrackLaw::isotropic     ? "isotropic"
           : law == OnTrackLaw::along_track ? "along_track"
           : law == OnTrackLaw::guided      ? "guided"
                                            : "rails");
}
}  // namespace train_derail::inputs

namespace train_derail::outcome {
inline void PrintTo(Ended ended, std::ostream* out) { *out << to_string(ended); }
}  // namespace train_derail::outcome

namespace train_derail::test {

inline constexpr double kPi = 3.14159265358979323846;

/// Table 1 of the paper with the suggested defaults for what it leaves out.
inline inputs::Scenario baseline(int cars = 60) {
  inputs::Scenario s;
  s.title = "baseline";
  inputs::CarBlock block;
  block.count = cars;
  block.length = 59.2 * inputs::kFoot;
  block.weight = 150.0 * inputs::kKip;
  s.consist = {block};
  s.initial.speed = 37.0 * inputs::kMph;
  s.initial.yaw_rate = 0.2;
  return s;
}

/// Three kinds of cars, so that a neighbour's length, mass or inertia in the wrong place shows.
inline inputs::Scenario mixed_train() {
  inputs::Scenario s = baseline();
  inputs::CarBlock tank, hopper, caboose;
  tank.count = 2;
  tank.length = 18.0;
  tank.weight = 1.1e6;
  tank.truck_spacing = 12.5;
  tank.yaw_inertia_factor = 0.085;
  hopper.count = 3;
  hopper.length = 14.0;
  hopper.weight = 6.0e5;
  hopper.truck_spacing_factor = 0.7;
  hopper.yaw_inertia = 1.3e6;
  caboose.count = 2;
  caboose.length = 10.0;
  caboose.weight = 2.5e5;
  caboose.truck_spacing = 5.0;
  caboose.yaw_inertia = 2.0e5;
  s.consist = {tank, hopper, caboose};
  return s;
}

inline void set_friction(inputs::Scenario& s, double on_track, double off_track) {
  s.ground.on_track_friction = on_track;
  s.ground.off_track_friction = off_track;
}

inline void set_tolerance(inputs::Scenario& s, double tolerance) {
  s.solver.rtol = tolerance;
  s.solver.atol = tolerance;
}

/// Couplers that carry nothing: neighbouring cars move as lone ones.
inline void uncouple(inputs::Scenario& s) {
  s.coupler.stiffness = 0.0;
  s.coupler.swing_stiffness = 0.0;
}

/// Motion of one car: pose and velocity.
struct CarMotion {
  double x, y, theta, vx, vy, omega;
};

inline model::StateVector state_of(const std::vector<CarMotion>& cars) {
  const auto n = static_cast<Eigen::Index>(cars.size());
  model::StateVector state = model::StateVector::Zero(model::state_size(n));
  auto m = model::motion(state.data(), n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const CarMotion& c = cars[static_cast<std::size_t>(k)];
    m.row(k) << c.x, c.y, c.theta, c.vx, c.vy, c.omega;
  }
  return state;
}

/// With friction a v / sqrt(v^2 + e^2) a body slows by dv/dt = -a v / sqrt(v^2 + e^2). Between speeds `from` and `to`
/// it travels (slide_distance(from) - slide_distance(to)) / a in (slide_time(from) - slide_time(to)) / a.
inline double slide_distance(double v, double e) {
  return 0.5 * v * std::sqrt(v * v + e * e) + 0.5 * e * e * std::asinh(v / e);
}
inline double slide_time(double v, double e) { return std::sqrt(v * v + e * e) - e * std::asinh(e / v); }

/// Uniform numbers that are the same with every standard library. A compiler may evaluate the arguments of a call in
/// any order: draw for them within braces, or in statements of their own.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11U) * 0x1.0p-53;
  }
  double sign() { return uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0; }
  int index(int count) { return static_cast<int>(uniform(0.0, count)); }

 private:
  std::mt19937_64 engine_;
};

/// A swing angle within the limit, just beyond it, or folded far back; never within 0.04 rad of a corner of a law whose
/// plateau, if any, begins 0.5 rad beyond the limit.
inline double random_swing(const inputs::Coupler& c, Random& random) {
  switch (random.index(3)) {
    case 0: return random.sign() * random.uniform(0.0, c.swing_limit - 0.04);
    case 1: return random.sign() * (c.swing_limit + random.uniform(0.04, 0.46));
    default: return random.sign() * random.uniform(c.swing_limit + 0.54, 3.0);
  }
}

/// A gap in buff, in the slack or in draft, never within 4 % of the slack of its ends.
inline double random_gap(const inputs::Coupler& c, Random& random) {
  switch (random.index(3)) {
    case 0: return random.uniform(0.3 * c.length, c.length - 0.54 * c.slack);
    case 1: return c.length + random.uniform(-0.46, 0.46) * c.slack;
    default: return random.uniform(c.length + 0.54 * c.slack, 2.0 * c.length);
  }
}

/// A crumpled train: every coupler has a random gap and random swings, every car a random velocity.
inline model::StateVector random_state(const model::DerailmentModel& m, Random& random) {
  const inputs::Coupler& law = m.coupler_law();
  std::vector<CarMotion> cars;
  Eigen::Vector2d pin{random.uniform(-50.0, 50.0), random.uniform(-20.0, 20.0)};
  double theta = random.uniform(-kPi, kPi);
  for (const model::Car& car : m.cars()) {
    const Eigen::Vector2d heading(std::cos(theta), std::sin(theta));
    const Eigen::Vector2d centre = pin - 0.5 * car.length * heading;
    cars.push_back({centre.x(), centre.y(), theta, random.uniform(-20.0, 20.0), random.uniform(-20.0, 20.0),
                    random.uniform(-2.0, 2.0)});
    const double beta = theta + random_swing(law, random);
    pin =
        centre - 0.5 * car.length * heading - random_gap(law, random) * Eigen::Vector2d(std::cos(beta), std::sin(beta));
    theta = beta - random_swing(law, random);
  }
  return state_of(cars);
}

/// Puts the cars that the rails hold (guided reading) where the rails hold them.
inline void put_on_rails(const model::DerailmentModel& m, model::StateVector& state) {
  auto motion = model::motion(state.data(), m.car_count());
  for (Eigen::Index k = 0; k < m.car_count(); ++k) {
    if (m.derailed(k)) continue;
    for (const model::Coordinate c : {model::Y, model::THETA, model::VY, model::OMEGA}) motion(k, c) = 0.0;
  }
}

inline void derail_at_random(model::DerailmentModel& m, Random& random) {
  for (Eigen::Index k = 1; k < m.car_count(); ++k)
    if (random.uniform(0.0, 1.0) < 0.5) m.derail(k);
}

/// The model alone as a system of equations: no events, no monitoring.
class ModelSystem : public solver::OdeSystem {
 public:
  explicit ModelSystem(model::DerailmentModel& m) : model_(m) {}
  Eigen::Index size() const override { return model_.size(); }
  Eigen::Index position_count() const override { return (size() - quadrature_count()) / 2; }
  bool derivative(double /*t*/, const double* y, double* dydt) override { return model_.derivative(y, dydt); }
  Eigen::Index quadrature_count() const override { return model::kWorkTerms; }
  std::vector<Eigen::Index> band_positions() const override {
    const Eigen::Index n = model_.car_count();
    std::vector<Eigen::Index> position(static_cast<std::size_t>(size()));
    for (Eigen::Index k = 0; k < n; ++k)
      for (Eigen::Index c = 0; c < model::kCoordinates; ++c)
        position[static_cast<std::size_t>(c * n + k)] =
            model::DerailmentModel::band_index(k, static_cast<model::Coordinate>(c));
    for (Eigen::Index w = 0; w < model::kWorkTerms; ++w)
      position[static_cast<std::size_t>(model::kCoordinates * n + w)] = model::kCoordinates * n + w;
    return position;
  }
  Eigen::Index band_lower() const override { return model::DerailmentModel::kBandLower; }
  Eigen::Index band_upper() const override { return model::DerailmentModel::kBandUpper; }
  void jacobian(double /*t*/, const double* y, const SetEntry& set) override { model_.jacobian(y, set); }

 private:
  model::DerailmentModel& model_;
};

}  // namespace train_derail::test
