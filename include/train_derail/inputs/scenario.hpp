// One Scenario is everything a run depends on. Plain data in SI units; angles in radians.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/abi.hpp"

namespace train_derail::inputs {

/// Exact conversions for what people read and for the defaults that the paper states in US units.
inline constexpr double kFoot = 0.3048;                     // m
inline constexpr double kMph = 0.44704;                     // m/s
inline constexpr double kPoundForce = 4.4482216152605;      // N
inline constexpr double kKip = 1000.0 * kPoundForce;        // N
inline constexpr double kDegree = 0.017453292519943295769;  // rad
inline constexpr double kStandardGravity = 9.80665;         // m/s^2

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What a block does to the brake pipe besides passing the signal on.
enum class BrakeSource {
  none,
  remote,  // a distributed locomotive or an end-of-train device: vents its end by radio
};

/// `count` equal cars, one behind the other. Blocks follow each other from the first car to derail back.
struct CarBlock {
  std::string name = "car";  // chooses the body shown in pictures (ros/car_shape.hpp)
  int count = 0;
  double length = 0.0;                         // L, between the coupler pins [m]
  double weight = 0.0;                         // W, on the rails [N]
  double width = 10.0 * kFoot;                 // of the footprint [m]
  std::optional<double> truck_spacing;         // D, between truck centres [m]
  std::optional<double> truck_spacing_factor;  // D / L [-]
  std::optional<double> yaw_inertia;           // I, about the centre of mass [kg m^2]
  std::optional<double> yaw_inertia_factor;    // I / (M L^2) [-]
  double brake_share = 1.0;                    // of brakes.force that these cars develop; 0: cut out [-]
  BrakeSource brake_source = BrakeSource::none;

  static constexpr double kDefaultTruckSpacingFactor = 0.71;
  static constexpr double kDefaultYawInertiaFactor = 0.093;
};

/// Massless pin-ended bar between two cars (paper, figures 2 to 4).
struct Coupler {
  double length = 4.0 * kFoot;                                // G0, pin to pin at mid-slack [m]
  double slack = 0.25 * kFoot;                                // s, whole dead band of the gap [m]
  double stiffness = 50.0e6 * kPoundForce / kFoot;            // K, buff and draft [N/m]
  double swing_limit = 17.5 * kDegree;                        // S, free swing to either side [rad]
  double swing_stiffness = 3.6e4 * kPoundForce * kFoot;       // K_m, beyond the limit [N m/rad]
  double swing_moment_max = kInfinity;                        // m_max, plateau of the end moment [N m]
  double draft_gear_stiffness = 1.5e6 * kPoundForce / kFoot;  // of the first draft_gear_travel beyond the slack [N/m]
  double draft_gear_travel = 0.0;                             // then `stiffness`; 0: no draft gear [m]
  double damping_ratio = 0.0;       // of two cars on the first spring; never turns the force round [-]
  double break_draft = kInfinity;   // draft force at which it breaks [N]
  double break_swing = kInfinity;   // swing angle at either end at which it breaks [rad]
  double break_moment = kInfinity;  // |sum of the end moments| at which it breaks [N m]
};

/// What a car on the rails feels sideways: the thing that the paper leaves open (docs/model.md).
enum class OnTrackLaw {
  isotropic,    // Coulomb force against the whole velocity of the truck
  along_track,  // force along x alone; sideways the car is free
  guided,       // rails hold y = 0, theta = 0 until the car passes the point of derailment
  rails,        // elastic rails that yield: group `rails`
};

/// Ground force on a truck off the rails.
enum class OffTrackLaw {
  coulomb,  // off_track_friction
  by_slip,  // from in_line_friction to broadside_friction with the slip angle and the distance from the track
};

/// Rectangle of ground whose friction differs.
struct GroundPatch {
  double x_from = 0.0, x_to = 0.0, y_from = 0.0, y_to = 0.0;  // m
  double factor = 1.0;                                        // of the friction elsewhere [-]
};

struct Ground {
  double on_track_friction = 0.15;   // mu before the point of derailment [-]
  double off_track_friction = 0.50;  // mu from it on [-]
  OnTrackLaw on_track_law = OnTrackLaw::isotropic;
  double regularization_speed = 0.1 * kFoot;  // v_eps of v / sqrt(v^2 + v_eps^2) [m/s]
  OffTrackLaw off_track_law = OffTrackLaw::coulomb;
  double in_line_friction = 0.25;     // mu_0 of a truck that slides along its car's axis, on the track's bed [-]
  double broadside_friction = 0.75;   // mu_1 of one that slides across it, or lies far from the track [-]
  double slip_ratio = 0.35;           // |v across the car| / |v| at which mu_1 is reached [-]
  double far_distance = 7.0 * kFoot;  // beyond the rail, at which mu_1 is reached [m]
  std::vector<GroundPatch> patches;   // factors multiply where they overlap
};

/// Rails that hold a truck sideways until they yield (on_track_law: rails).
struct Rails {
  double stiffness = 2.0e6 * kPoundForce / kFoot;  // k_r, lateral, a truck [N/m]
  double damping_ratio = 0.15;                     // of half a car on k_r [-]
  double derail_ratio = 0.9;         // L/V, lateral force over load of a truck, beyond which it leaves [-]
  double derail_time = 0.02;         // ... if exceeded for that long [s]
  double torn_length = 5.0 * kFoot;  // of track that a truck tears up where it leaves; 0: none [m]
};

/// Arc of constant curvature; between arcs and outside of them the track is straight.
struct Curve {
  double start = 0.0;      // along the track from the point of derailment, forward [m]
  double length = 0.0;     // m
  double curvature = 0.0;  // 1 / radius, to the left positive [1/m]
};

/// Horizontal alignment and grade; both need on_track_law: rails.
struct Track {
  double grade = 0.0;         // rise over run in the direction of travel [-]
  std::vector<Curve> curves;  // in the order of start, not overlapping
};

enum class BrakeLaw {
  friction,  // the paper's: on_track_friction on every car, at once
  air,       // emergency application that runs along the brake pipe and builds up
};

enum class BrakeSignal { pneumatic, electronic };

/// Brakes of the cars on the track (law: air).
struct Brakes {
  BrakeLaw law = BrakeLaw::friction;
  double rolling_resistance = 0.0015;           // over weight [-]
  double force = 0.05;                          // B, brake force over weight in emergency, built up; 0: a runaway [-]
  double build_up_time = 12.0;                  // t_b, linear from nothing to B [s]
  double dead_time = 1.0;                       // of each car's valve, after the signal [s]
  double propagation_speed = 920.0 * kFoot;     // of the signal along the pipe [m/s]
  double radio_delay = 2.0;                     // of sources that vent by radio [s]
  BrakeSignal signal = BrakeSignal::pneumatic;  // electronic: all cars at once
  std::optional<double> emergency_time;         // of the application [s]; none: when the first coupler breaks
};

enum class ContactLaw {
  none,     // bodies pass through each other, as in the paper
  elastic,  // footprints push each other apart
};

/// Contact of the footprints of any two cars.
struct Contact {
  ContactLaw law = ContactLaw::none;
  double stiffness = 3.0e6 * kPoundForce / kFoot;  // k_c, force over depth [N/m]
  double restitution = 0.2;                        // speed after over speed before, of a central hit [-]
  double friction = 0.3;                           // [-]
  double crush_force = kInfinity;                  // plateau: the bodies yield [N]
};

/// Small random differences between otherwise equal runs (ensembles). Zero sizes: none.
struct Perturbation {
  double spacing = 0.0;   // car k > 1 is set back by spacing * |N(0,1)| [m]
  double yaw_rate = 0.0;  // yaw_rate is multiplied by 1 + this * N(0,1) [-]
  std::int64_t seed = 0;
  double kick = 0.0;       // a truck that runs off at the point of derailment gets this * N(0,1) sideways [m/s]
  double alignment = 0.0;  // standard deviation of the rails' lateral alignment [m]
};

struct InitialMotion {
  double speed = 0.0;     // V of all cars, along +x [m/s]
  double yaw_rate = 0.0;  // Omega of the first car to derail, counter-clockwise [rad/s]
  int cars_ahead = 0;     // of the consist that have passed the point of derailment unharmed
  Perturbation perturbation;
};

struct StopRule {
  double speed = 0.05;      // the run ends at rest: every truck centre slower than this [m/s]
  double time_max = 120.0;  // or at this time [s]
};

/// How the outcome is counted; no influence on the motion.
struct OutcomeRules {
  double off_track_threshold = 0.5 * kFoot;  // |y| of a truck centre that makes its car count as off the track [m]
  double sample_interval = 0.01;  // spacing of the samples in which counts, contacts, the stop rule are looked at [s]
};

/// Grid of simulated time on which states are published and written.
struct Output {
  double interval = 0.02;  // [s]
};

enum class Method {
  cash_karp,
  dormand_prince,
  bdf,
  semi_implicit,  // Euler's, fixed_step; the one that takes the parts which are not smooth
};

struct Solver {
  Method method = Method::dormand_prince;
  double rtol = 1.0e-5;                 // relative tolerance of the local error [-]
  double atol = 1.0e-6;                 // absolute tolerance, in m, rad, m/s, rad/s
  std::optional<double> fixed_step;     // explicit and semi-implicit methods: no error control [s]
  std::int64_t steps_max = 10'000'000;  // more are taken for a failure
  double wall_time_max = 300.0;         // so is more computing than this [s]
};

struct Scenario {
  std::string title;
  std::vector<CarBlock> consist;
  Coupler coupler;
  Ground ground;
  Rails rails;
  Track track;
  Brakes brakes;
  Contact contact;
  InitialMotion initial;
  StopRule stop;
  OutcomeRules outcome;
  Output output;
  Solver solver;
};

/// Keys of the parts beyond the paper that are switched on, "" if none: they need the method semi_implicit.
std::string first_part_beyond_the_paper(const Scenario& scenario);

}  // namespace train_derail::inputs
