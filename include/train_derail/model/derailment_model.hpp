/// \file
/// Equations of motion of a train that derails: Jeong, Lyons, Orringer and Perlman (2007), RTDF2007-46009, eqs. 1-17,
/// with the errata of docs/model.md. Knows no time stepping.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "train_derail/files/archive.hpp"
#include "train_derail/model/planar_model.hpp"

namespace train_derail::model {

struct DerailmentArrays;
struct DerailmentKernels;

/// Right-hand side with its one discrete state: which cars have passed the point of derailment at x = 0.
/// One object a run and a thread (it owns scratch arrays).
class DerailmentModel final : public PlanarModel {
 public:
  /// The scenario must be valid (inputs::validate). Throws std::invalid_argument unless `instruction_set` is one of
  /// instruction_sets(); by default the first of them that suits the length of the train.
  explicit DerailmentModel(const inputs::Scenario& scenario, const std::string& instruction_set = "");
  ~DerailmentModel() override;

  /// Versions of derivative() and gaps() that this processor can run, fastest first: of "avx512", "avx2", "plain". They
  /// agree to rounding. Short trains have only the last.
  static std::vector<std::string> instruction_sets(Eigen::Index cars);

  /// Past the point of derailment: latched by derail(), never undone; the first car from the start.
  bool derailed(Eigen::Index car) const override { return derailed_[static_cast<std::size_t>(car)]; }
  bool past_pod(Eigen::Index car) const override { return derailed(car); }
  void derail(Eigen::Index car);
  /// Cars that stand at or past the point of derailment in the state of the start have derailed. Throws
  /// std::invalid_argument if the reading `guided` holds a car that is turned, aside, or on its way there.
  void start(const double* y);
  /// The foremost car on the track has been seen to reach the point of derailment: it derails, and any that is level
  /// with it.
  void reach_pod(const double* y);

  /// Saves or restores all that the future depends on, beside the state. Restoring replaces start().
  void walk(files::Archive& archive);

  /// x of the foremost car that has not derailed [m]; minus infinity if all have.
  double foremost_on_track(const double* y) const;

  /// Work terms at the end of a state.
  static Eigen::Index quadrature_count() { return kWorkTerms; }

  /// dydt = f(y); both of length size(). False if dydt is not finite.
  bool derivative(const double* y, double* dydt) const;
  /// The same, but for the rates of the positions, which stand in y.
  bool accelerations(const double* y, double* dydt) const;

  /// Jacobian of derivative() in the band ordering: index of (car, coordinate) is 6 car + coordinate, work terms last.
  /// Rows of the work terms are left zero (they feed back on nothing). `set(row, column, value)` is called for each
  /// entry inside the band once; entries not set are zero.
  using SetEntry = std::function<void(Eigen::Index row, Eigen::Index column, double value)>;
  void jacobian(const double* y, const SetEntry& set) const;
  static Eigen::Index band_index(Eigen::Index car, Coordinate c) { return kCoordinates * car + c; }
  /// Place in the band ordering of every component of a state.
  std::vector<Eigen::Index> band_positions() const;
  static constexpr Eigen::Index kBandLower = 11, kBandUpper = 5;

  std::vector<CouplerState<double>> couplers(const double* y) const override;
  EnergyLedger energy(const double* y) const override;

 private:
  const PlanarKernels& loops() const override;
  /// Ground and rails of the car as its place has it: before the point of derailment or past it.
  void lay(Eigen::Index car);
  /// Foremost of the cars that have not derailed; -1 if all have.
  Eigen::Index foremost(const double* y) const;

  std::vector<bool> derailed_;
  ArrayX load_, lateral_, past_pod_, inverse_mass_y_;  // see DerailmentArrays
  const DerailmentKernels* kernels_;
  const std::unique_ptr<DerailmentArrays> arrays_;
};

}  // namespace train_derail::model
