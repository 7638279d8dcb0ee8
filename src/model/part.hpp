/// \file
/// What the parts of the extended model have in common, and how they see a train.
#pragma once

#include "train_derail/eigen_types.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/incidents.hpp"

namespace train_derail::model {

/// Places, headings and velocities of all cars: columns, one entry a car.
struct CarColumns {
  const double *x, *y;            ///< centre of mass [m]
  const double *cosine, *sine;    ///< of the heading
  const double *vx, *vy, *omega;  ///< m/s, m/s, rad/s
};

/// Sums of what acts on the cars: columns, one entry a car.
struct Wrenches {
  double *fx, *fy;  ///< N
  double* moment;   ///< about the centre of mass [N m]
};

/// A step from (time, before) to (time + length, after). Its end may be changed by impulses.
struct Step {
  double time, length;   ///< s
  const double* before;  ///< state
  double* after;         ///< state
  double end() const { return time + length; }
};

/// What happened, and what was taken from the train by it. The parts of a model share one.
struct Record {
  Incidents incidents;
  EnergyLedger spent;  ///< its work_... terms

  void walk(files::Archive& archive);
};

/// A force law of the extended model with its memory (what has broken, what has left the rails, who touches whom).
/// Whatever acts on every truck or coupler in every step does so in the wide loops (model/truck_parts.hpp,
/// model/extended_kernels_impl.hpp), for which the part keeps the arrays; the rest is done here.
class Part {
 public:
  virtual ~Part() = default;
  /// Sets what the loops need of the part at time t [s].
  virtual void prepare(double /*t*/) {}
  /// Adds wrenches at time t of a step of length h [s], beside those of the loops.
  virtual void add(double /*t*/, double /*h*/, const CarColumns& /*cars*/, const Wrenches& /*sum*/) {}
  /// Adds the work of what add() has added last, in a step of length h [s] between two states, to Record::spent.
  virtual void account(double /*h*/, const CarColumns& /*before*/, const CarColumns& /*after*/) {}
  /// The forces at the end of the step are known: what gives way under them does so now, before a force beyond its
  /// limit can act. Whether anything has: the forces are then found anew.
  virtual bool give_way(const Step& /*step*/) { return false; }
  /// All that the future depends on.
  virtual void walk(files::Archive& archive) = 0;
};

}  // namespace train_derail::model
