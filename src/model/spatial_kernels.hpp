/// \file
/// Loops of the spatial model over cars, couplers and trucks, several side by side; see kernels.hpp. They do what every
/// car that stands upright on its trucks needs in every step.
#pragma once

#include <cstddef>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/terrain.hpp"

namespace train_derail::model {

/// Columns of a state of the spatial model, one entry a car (SpatialModel).
enum SpatialColumn {
  SX,
  SY,
  SZ,  // of the centre of mass
  TURN_X,
  TURN_Y,
  TURN_Z,  // angles turned in this step, about the car's axes
  SVX,
  SVY,
  SVZ,  // velocity
  ROLL_RATE,
  PITCH_RATE,
  YAW_RATE,  // body rates
  QX,
  QY,
  QZ,
  QW  // orientation
};

/// Vectors are three columns, one after the other. One entry a car unless said otherwise; trucks: the front trucks of
/// all cars, then the rear ones; couplers: at [i + 1] of cars + 1 entries, the ends are zero.
struct SpatialArrays {
  std::ptrdiff_t cars = 0;
  const inputs::Coupler* coupler = nullptr;
  const inputs::Rails* rails = nullptr;
  const inputs::Ties* ties = nullptr;    ///< null: no truck runs on the ties
  double spring = 0.0, half_base = 0.0;  ///< of a side of a truck [N/m]; from the middle of the track [m]
  double brake_stiffness = 0.0;          ///< of brakes that hold [N/m]
  double step = 0.0;                     ///< s
  double grade = 0.0;                    ///< sine of the slope
  bool straight = true;
  bool flat = true;                                         ///< all rails are level, at height 0
  double tan_swing = 0.0, sin_pitch = 0.0, cos_roll = 0.0;  ///< of angles below which no stop is engaged
  const double *half_length = nullptr, *half_spacing = nullptr, *centre_height = nullptr;  ///< m
  const double *weight = nullptr, *inverse_mass = nullptr;
  const double* inertia = nullptr;  ///< about roll, pitch and yaw axes
  const double *sag = nullptr, *spring_damping = nullptr, *rail_damping = nullptr, *brake_damping = nullptr;
  const double* brake_share = nullptr;

  double *axes = nullptr, *axes_before = nullptr;  ///< forward, left, up: nine columns
  double* rotation = nullptr;                      ///< angular velocity, world frame
  double* spin = nullptr;                      ///< angular momentum along the car's axes, with what the step has added
  double *force = nullptr, *torque = nullptr;  ///< sums, world frame; about the centre of mass

  // Trucks.
  const double* on_rails = nullptr;  ///< 1 or 0; 1 on the ties, too
  // On the ties, see TieRuns: 1 or 0, drift [m], damping [N s/m].
  const double *guided = nullptr, *drift = nullptr, *tie_damping = nullptr;
  const double* offset = nullptr;                           ///< from the alignment [m]
  const double *tangent_x = nullptr, *tangent_y = nullptr;  ///< of the track; not used where it is straight
  // Of rails that are not flat: middle between them under a truck [m], slope along the track, and tilt across it with
  // its change along the track [1/m]; see TrackProfile.
  const double *rail_height = nullptr, *rail_slope = nullptr, *rail_tilt = nullptr, *rail_twist = nullptr;
  const double* braked = nullptr;                                      ///< strain of the brakes [m]
  double *braked_next = nullptr, *load = nullptr, *leaning = nullptr;  ///< both sides [N]; left less right
  double *brake = nullptr, *lateral = nullptr, *damper = nullptr, *rocker = nullptr;  ///< parts of these forces [N]

  // Trucks off the rails. Wheels: the right ones of all trucks, then the left ones.
  const inputs::Ground* ground = nullptr;
  const CrossSection* section = nullptr;  ///< of the ground if it is the same along x; else it is in `under`
  bool level_ground = false;              ///< and that is one plane
  const double* grounded = nullptr;       ///< 1 where a truck is off the rails and its car does not lie still, else 0
  const double *load_held = nullptr, *leaning_held = nullptr;  ///< load and leaning of those of cars that lie, else 0
  const double* grip = nullptr;                                ///< factor of the patch of ground under a truck
  const double* under = nullptr;    ///< wheel: height of the ground, then x and y of the vector along which it pushes
  const double* sheared = nullptr;  ///< strain of the ground [m]: three columns of the right wheels, three of the left
  double* sheared_next = nullptr;
  double *pushed_damped = nullptr, *rubbed = nullptr;  ///< car: what damping and friction of this ground do to it: six
                                                       ///< columns, force and torque; 0 where no truck is grounded

  // Couplers.
  const double *alive = nullptr, *damping = nullptr;
  double *axial = nullptr, *pin_axial = nullptr, *pin_damper = nullptr;  ///< buff positive [N]; at [i]; at [i + 1]
  double *bar = nullptr, *about_lead = nullptr, *about_trail = nullptr;  ///< direction, its moments about the two cars
  double* far = nullptr;                                                 ///< 1 where a stop may be engaged, else 0
  double* rise = nullptr;           ///< of the lead car's pin over the trail car's [m]
  double* mean_rotation = nullptr;  ///< car: sum of the rotations before and after the step
};

/// The most that any coupler bears, 0 or more.
struct CouplerExtremes {
  double buff = 0.0, draft = 0.0;  ///< N
  double rise = 0.0;               ///< of a pin over its neighbour, either way [m]
};

/// Where trucks are on the track, and where it makes them leave it: arc lengths [m].
struct LeavingPlaces {
  const double *before, *now, *bad;  ///< of each truck; bad: it leaves when it comes there
  double torn_from, torn_to;         ///< between these the track may be torn up
};

/// One version of the loops.
struct SpatialKernels {
  const char* instruction_set;
  std::ptrdiff_t lanes;  ///< needs at least lanes + 1 cars
  /// Axes and rotations of state y.
  void (*look)(const SpatialArrays&, const double* y);
  /// Ends a step: turns the cars, finds axes, rotations and body rates; the angles turned become zero.
  void (*turn)(const SpatialArrays&, double* y);
  /// Forces of couplers without their stops.
  CouplerExtremes (*couple)(const SpatialArrays&, const double* y);
  /// Sums of weight, couplers and trucks.
  void (*forces)(const SpatialArrays&, const double* y);
  /// Adds the work of these forces and of the ground under trucks in a step from `before` to `after`.
  void (*work)(const SpatialArrays&, const double* before, const double* after, double h, EnergyLedger& spent);
  /// Accelerations from the sums: six columns.
  void (*accelerate)(const SpatialArrays&, const double* y, double h, double* result);
  /// Places of the trucks seen from above [m], at the top of the rails.
  void (*places)(const SpatialArrays&, const double* y, double* px, double* py);
  /// What holds each truck on the rails: its load, but no more than twice that of the side whose flange is pressed.
  /// Rails push the truck to the left by the flange of its right wheels. True if a truck of the rails stands on one
  /// side only or not at all.
  bool (*holding)(const SpatialArrays&, double* load);
  /// Whether a truck of the rails has come to such a place in this step.
  bool (*may_leave)(const SpatialArrays&, const LeavingPlaces&);
  /// swirl[k]: speed of the farthest point of a body about its centre; returns the largest speed of a centre [m/s].
  double (*swirls)(const SpatialArrays&, const double* y, const double* radius, double* swirl, double& largest);
};

/// Adds what the ground does to the trucks of one car that are grounded to its sums.
void press_trucks_of(const SpatialArrays&, const double* y, std::ptrdiff_t car);

extern const SpatialKernels kSpatialPlain, kSpatialSse2, kSpatialAvx2, kSpatialAvx512;

}  // namespace train_derail::model
