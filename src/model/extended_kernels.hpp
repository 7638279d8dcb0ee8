/// \file
/// Loops of the extended model over cars, couplers and trucks, several side by side; see kernels.hpp.
#pragma once

#include <cstddef>

#include "model/kernels.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail::model {

/// One entry a coupler (cars - 1 of them).
struct CouplerArrays {
  const double* alive = nullptr;                       ///< 1, or 0 if broken
  const double* damping = nullptr;                     ///< N s/m
  double *axial = nullptr, *damper = nullptr;          ///< forces along the bar, buff positive [N]
  double *ux = nullptr, *uy = nullptr;                 ///< direction of the bar
  double *cos_swing = nullptr, *end_moment = nullptr;  ///< of the larger swing; sum of both end moments [N m]
};

/// One entry a truck: the front trucks of all cars, then the rear ones.
struct TruckArrays {
  // What the last step has left.
  const double* on_track = nullptr;  ///< 1 on the rails (or before the point of derailment), else 0
  const double* offset = nullptr;    ///< from the alignment if on rails, else from the centre line [m]
  const double *tangent_x = nullptr, *tangent_y = nullptr;  ///< of the track
  const double* load = nullptr;                             ///< W / 2 [N]
  const double* rail_damping = nullptr;                     ///< N s/m
  const double* patch = nullptr;                            ///< factor of off-track friction
  const double* ground_load = nullptr;                      ///< that off-track friction is a share of [N]
  const double* guided = nullptr;                           ///< 1 if it runs on the ties, else 0
  const double* drift = nullptr;                            ///< on the ties, from the centre line [m]
  const double* tie_damping = nullptr;                      ///< N s/m
  double* kept = nullptr;  ///< what the parts of model/truck_parts.hpp keep in a step: column after column
};

/// Loops that need not look at all cars go by blocks of so many, a multiple of the widest batch.
inline constexpr std::ptrdiff_t kBusyBlock = 8;
/// The block that a car is in, and how many there are.
constexpr std::size_t busy_block(std::ptrdiff_t car) { return static_cast<std::size_t>(car / kBusyBlock); }
constexpr std::size_t busy_blocks(std::size_t cars) {
  return cars == 0 ? 0 : busy_block(static_cast<std::ptrdiff_t>(cars) - 1) + 1;
}
/// Cars from one to before another; `from` is a multiple of kBusyBlock, and `to` too, or the number of cars.
struct CarRange {
  std::ptrdiff_t from, to;
};
/// The cars that have to be looked at, in order; or trucks, of those cars.
struct BusyCars {
  const CarRange* ranges = nullptr;
  std::ptrdiff_t count = 0;
};

/// Of the extended model.
struct ExtendedArrays : PlanarArrays {
  const inputs::Ground* ground = nullptr;
  const inputs::Rails* rails = nullptr;
  const inputs::Ties* ties = nullptr;  ///< null: no truck runs on the ties
  double grade = 0.0;                  ///< sine of the slope
  bool rails_on = false, by_slip = false, straight = true;
  const double* brake_share = nullptr;  ///< car: brake force over load on the track
  CouplerArrays couplers;
  TruckArrays trucks;
  double *fx = nullptr, *fy = nullptr, *moment = nullptr;  ///< car: sums of forces and moments
  const BusyCars* busy = nullptr;     ///< forces, work, accelerations, headings and places are found for these alone
  const BusyCars* rolling = nullptr;  ///< others that only roll: forces along the track, work and accelerations
};

/// Places of trucks by the track, one entry a truck.
struct TruckPlaces {
  double *arc, *offset;           ///< m
  double *tangent_x, *tangent_y;  ///< of the centre line
};

/// Of all couplers at one moment.
struct CouplerPeaks {
  double buff = 0.0, draft = 0.0;  ///< largest, magnitudes [N]
  double cos_swing = 1.0;          ///< least
  double end_moment = 0.0;         ///< largest size of the sum of both [N m]
};

/// Of the trucks that the rails hold.
struct OnBadTrack {
  bool passes;       ///< one has come past the point of derailment
  bool may_be_torn;  ///< one stands where track may be torn
};

/// One version of the loops of the extended model.
struct ExtendedKernels : PlanarKernels {
  /// Forces and moments on all cars, and what the couplers carry.
  CouplerPeaks (*forces)(const ExtendedArrays&, const double* y);
  /// Adds to `spent` the work of the forces in the arrays, in a step of length h from state `before` to `after`.
  void (*work)(const ExtendedArrays&, const double* before, const double* after, double h, EnergyLedger& spent);
  /// Accelerations from the sums of forces: x, y, yaw of all cars, column by column.
  void (*accelerate)(const ExtendedArrays&, double* result);
  /// Brake force over load of every car at time t [s], where ratio[k] is built up from the time signal[k] on.
  void (*brake)(std::ptrdiff_t cars, const inputs::Brakes&, double t, const double* ratio, const double* signal,
                double* share);
  /// No point of any car moves faster, against what moves with the velocity (vx_known, vy_known) [m/s]; `radius`: of a
  /// circle around each car [m].
  double (*fastest_point)(std::ptrdiff_t cars, const double* vx, const double* vy, const double* omega,
                          const double* vx_known, const double* vy_known, const double* radius);
  /// Turns cosine and sine by what headings have turned between two states, which is little.
  void (*turn)(const ExtendedArrays&, const double* before, const double* after);
  /// Places of the trucks: px, py, one a truck [m].
  void (*places)(const ExtendedArrays&, const double* y, double* px, double* py);
  /// Counts up `overloaded` [s] as overloaded_time() does, from the lateral forces `before` to those `now` [N] (one a
  /// truck). Whether any truck has been overloaded for longer than rails.derail_time.
  bool (*overload)(const BusyCars& trucks, const inputs::Rails&, double h, const double* before, const double* now,
                   const double* load, double* overloaded);
  /// Of the trucks with held[i] = 1 (others: 0), which have come from arc length before[i] to now[i]; track may be torn
  /// between `from` and `to`.
  OnBadTrack (*on_bad_track)(const BusyCars& trucks, const double* held, const double* before, const double* now,
                             double from, double to);
  /// Where trucks that were near arc length before[i] have come to by a curved track: arc length, offset to the left
  /// and tangent there.
  void (*locate)(std::ptrdiff_t cars, const BusyCars& busy, const TrackLine& line, const double* px, const double* py,
                 const double* before, const TruckPlaces& found);
  /// offset[i] -= held[i] * the deviation of the rails at arc length s[i].
  void (*subtract_alignment)(const BusyCars& trucks, const TrackTable& table, const double* s, const double* held,
                             double* offset);
  /// Whether the track is torn at any arc length s[i] with held[i] = 1 (others: 0).
  bool (*any_torn)(const BusyCars& trucks, const TrackTable& torn, const double* s, const double* held);
};

extern const ExtendedKernels kExtendedPlain, kExtendedSse2, kExtendedAvx2, kExtendedAvx512;

}  // namespace train_derail::model
