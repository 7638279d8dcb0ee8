// One Scenario is everything a run depends on. Plain data in SI units; angles in radians.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace train_derail::inputs {

/// Exact conversions for what people read and for the defaults that the paper states in US units.
inline constexpr double kFoot = 0.3048;                    // m
inline constexpr double kMph = 0.44704;                    // m/s
inline constexpr double kPoundForce = 4.4482216152605;     // N
inline constexpr double kKip = 1000.0 * kPoundForce;       // N
inline constexpr double kDegree = 0.017453292519943295769; // rad
inline constexpr double kStandardGravity = 9.80665;        // m/s^2

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// `count` equal cars, one behind the other. Blocks follow each other from the first car to derail back.
struct CarBlock {
  std::string name = "car";                    // chooses the body shown in pictures (ros/car_shape.hpp)
  int count = 0;
  double length = 0.0;                         // L, between the coupler pins [m]
  double weight = 0.0;                         // W, on the rails [N]
  double width = 10.0 * kFoot;                 // of the footprint [m]
  std::optional<double> truck_spacing;         // D, between truck centres [m]
  std::optional<double> truck_spacing_factor;  // D / L [-]
  std::optional<double> yaw_inertia;           // I, about the centre of mass [kg m^2]
  std::optional<double> yaw_inertia_factor;    // I / (M L^2) [-]

  static constexpr double kDefaultTruckSpacingFactor = 0.71;
  static constexpr double kDefaultYawInertiaFactor = 0.093;
};

/// Massless pin-ended bar between two cars (paper, figures 2 to 4).
struct Coupler {
  double length = 4.0 * kFoot;                          // G0, pin to pin at mid-slack [m]
  double slack = 0.25 * kFoot;                          // s, whole dead band of the gap [m]
  double stiffness = 50.0e6 * kPoundForce / kFoot;      // K, buff and draft [N/m]
  double swing_limit = 17.5 * kDegree;                  // S, free swing to either side [rad]
  double swing_stiffness = 3.6e4 * kPoundForce * kFoot; // K_m, beyond the limit [N m/rad]
  double swing_moment_max = kInfinity;                  // m_max, plateau of the end moment [N m]
};

/// What a car on the rails feels sideways: the thing that the paper leaves open (docs/model.md).
enum class OnTrackLaw {
  isotropic,    // Coulomb force against the whole velocity of the truck
  along_track,  // force along x alone; sideways the car is free
  guided,       // rails hold y = 0, theta = 0 until the car passes the point of derailment
};

struct Ground {
  double on_track_friction = 0.15;           // mu before the point of derailment [-]
  double off_track_friction = 0.50;          // mu from it on [-]
  OnTrackLaw on_track_law = OnTrackLaw::isotropic;
  double regularization_speed = 0.1 * kFoot; // v_eps of v / sqrt(v^2 + v_eps^2) [m/s]
};

/// Small random differences between otherwise equal runs (ensembles). Zero sizes: none.
struct Perturbation {
  double spacing = 0.0;   // car k > 1 is set back by spacing * |N(0,1)| [m]
  double yaw_rate = 0.0;  // yaw_rate is multiplied by 1 + this * N(0,1) [-]
  std::int64_t seed = 0;
};

struct InitialMotion {
  double speed = 0.0;     // V of all cars, along +x [m/s]
  double yaw_rate = 0.0;  // Omega of the first car, counter-clockwise [rad/s]
  Perturbation perturbation;
};

struct StopRule {
  double speed = 0.05;      // the run ends at rest: every truck centre slower than this [m/s]
  double time_max = 120.0;  // or at this time [s]
};

/// How the outcome is counted; no influence on the motion.
struct OutcomeRules {
  double off_track_threshold = 0.5 * kFoot;  // |y| of a truck centre that makes its car count as off the track [m]
  double sample_interval = 0.01;             // spacing of the samples in which counts, contacts, the stop rule are looked at [s]
};

/// Grid of simulated time on which states are published and written.
struct Output {
  double interval = 0.02;  // [s]
};

enum class Method { cash_karp, dormand_prince, bdf };

struct Solver {
  Method method = Method::dormand_prince;
  double rtol = 1.0e-5;                // relative tolerance of the local error [-]
  double atol = 1.0e-6;                // absolute tolerance, in m, rad, m/s, rad/s
  std::optional<double> fixed_step;    // explicit methods only: no error control [s]
  std::int64_t steps_max = 10'000'000; // more are taken for a failure
};

struct Scenario {
  std::string title;
  std::vector<CarBlock> consist;
  Coupler coupler;
  Ground ground;
  InitialMotion initial;
  StopRule stop;
  OutcomeRules outcome;
  Output output;
  Solver solver;
};

}  // namespace train_derail::inputs
