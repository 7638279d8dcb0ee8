// The paper's model with the parts that it lacks, each switched by its own input: rails that yield, air brakes, ground friction
// by slip, draft gear, couplers that break, contact of car bodies, cars ahead of the point of derailment, torn track, curves and
// grade (docs/accident_model.md). With all of them off: the paper's model. Latches and impacts make it not smooth, so it is
// made for steps of fixed length. Knows no time stepping: a solver asks for accelerations and says when a step is done.
#pragma once

#include <memory>
#include <vector>

#include "train_derail/model/track.hpp"
#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

class Contacts;
struct Loads;

class ExtendedModel final : public TrainModel {
 public:
  /// The scenario must be valid (inputs::validate).
  explicit ExtendedModel(const inputs::Scenario& scenario);
  ~ExtendedModel() override;

  StateVector initial_state() const override;
  /// What has happened before the first step: trucks that start past the point of derailment are off the rails.
  void start(const double* y);

  /// Accelerations (cars x 3, column by column: x, y, theta) at time t of a step of length h.
  void accelerations(double t, double h, const double* y, double* result);
  /// The step from (t, before) to (t + h, y) is done: latches, breaks, work. May change velocities in y (kicks).
  void settle(double t, double h, const double* before, double* y);

  bool derailed(Eigen::Index car) const override;
  bool past_pod(Eigen::Index car) const override { return past_pod_[static_cast<std::size_t>(car)]; }
  CouplerState<double> coupler(const double* y, Eigen::Index i) const override;
  bool broken(Eigen::Index i) const override { return links_[static_cast<std::size_t>(i)].broken; }
  void gaps(const double* y, Eigen::ArrayXd& gap, Eigen::ArrayXd& rate) const override;
  EnergyLedger energy(const double* y) const override;
  double off_centre(const Eigen::Vector2d& point) const override;
  const Incidents* incidents() const override { return &incidents_; }

 private:
  struct Truck {
    double arm;             // from the car's centre forward [m]
    double load;            // W / 2 [N]
    double rail_damping;    // N s/m
    double kick;            // m/s
    double s = 0.0;         // arc length of its foot on the track [m]
    double overloaded = 0.0;  // s
    Cause cause = Cause::none;
    double rail_lateral = 0.0;  // force of the rails in this step [N]
    double fx = 0.0, fy = 0.0;  // ground or rails, in this step [N]
    double along_x = 0.0, along_y = 0.0;  // what of it brakes along the rails [N]
  };
  struct Link {
    bool broken = false;
    double damping = 0.0;        // N s/m
    double damper = 0.0;         // force of the damper in this step, sign of F [N]
    double ux = 1.0, uy = 0.0;
    double axial = 0.0;          // N, of this step
    double cos_swing = 1.0;      // cosine of the larger swing angle
    double moment = 0.0;         // |sum of the end moments| [N m]
  };

  bool on_rails(const Truck& truck) const { return rails_on_ && truck.cause == Cause::none; }
  void headings(const double* y);
  void couple(Loads& loads, const double* y);
  void stand(double t, Loads& loads, const double* y);
  void leave(double t, Eigen::Index car, int end, Cause cause, double* y);
  void break_coupler(double t, Eigen::Index i, BrokenCoupler::By by, const double* y);
  void vent(double t, double place);
  double strain_energy(double gap) const;

  const inputs::Rails rails_;
  const inputs::Brakes brakes_;
  const double grade_;
  const bool rails_on_;
  double cos_limit_, cos_break_;  // of swing
  Track track_;
  std::vector<Truck> trucks_;            // front and rear of car 0, of car 1, ...
  std::vector<bool> past_pod_, brake_source_;
  std::vector<double> brake_force_, pipe_;  // N; place of the car along the brake pipe from the foremost [m]
  std::vector<double> signal_;           // time at which the emergency signal reaches the car [s]
  bool emergency_ = false;
  std::vector<Link> links_;
  std::unique_ptr<Contacts> contacts_;
  std::unique_ptr<Loads> loads_;
  Eigen::ArrayXd cos_, sin_;
  Incidents incidents_;
  EnergyLedger spent_;                   // its work_... terms
};

}  // namespace train_derail::model
