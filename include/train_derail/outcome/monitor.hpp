/// \file
/// Watches a run and keeps what the outcome needs. Peaks are looked for in every step, the rest on a fixed grid of
/// samples.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "train_derail/model/footprint.hpp"
#include "train_derail/model/train_model.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

struct Extremes;
struct GapStep;
struct MonitorLoops;
struct MonitoredCars;

/// One object a run. It sees states only through the model's observations.
class Monitor {
 public:
  /// `model` must outlive the monitor; the run starts at time t [s] in state y.
  Monitor(const model::TrainModel& model, const inputs::OutcomeRules& rules, double t, const model::StateVector& y);

  /// Must be called for each accepted step, which has led to state y at time t [s], once the run has reached t.
  void step(double t, const double* y);
  /// From now on buff_peak() and draft_peak() look for new peaks.
  void forget_peaks();
  /// Largest compression and tension of coupler `i` since forget_peaks(), up to time t [s], when its axial force is
  /// `now`, buff positive [N]. Both are magnitudes.
  PeakForce buff_peak(Eigen::Index i, double t, double now) const;
  PeakForce draft_peak(Eigen::Index i, double t, double now) const;

  /// Must be called for each point of the grid outcome.sample_interval, in the order of time.
  void sample(double t, const double* y);

  /// A truck centre of the car has been sideways by more than outcome.off_track_threshold in any sample.
  bool off_track(Eigen::Index car) const { return astray_[car] > rules_.off_track_threshold; }
  /// First touches so far, in the order of time.
  const std::vector<FirstTouch>& touches() const { return touches_; }
  /// Largest speed of any truck centre in the last sample [m/s].
  double truck_speed_max() const { return truck_speed_max_; }
  /// The same in the state `y` of that sample without the `head` foremost cars.
  double truck_speed_max_behind(Eigen::Index head, const double* y) const;

  /// Distance from the centre line of the farthest corner of a car's footprint [m].
  double lateral_reach(const double* y, Eigen::Index car) const;

  /// Saves or restores all that it has seen.
  void walk(files::Archive& archive);

  /// The share of the energy at the start that `now` does not account for, as in Outcome::energy_residual.
  double energy_residual(const model::EnergyLedger& now) const;
  /// Counts, peaks, pile-up and energy at (t, y), which may lie beyond the last step; leaves why it ended and the
  /// solver's figures alone.
  void report(double t, const double* y, Outcome& outcome) const;

 private:
  struct GapExtreme {
    double gap;
    Eigen::Index coupler = -1;
    double time = 0.0;
  };

  /// Smallest and largest gap of any coupler.
  struct GapExtremes {
    GapExtreme closest, widest;
    void consider(Eigen::Index coupler, double gap, double time);
  };

  /// From the end of the last step to time t, where gaps and rates are as given.
  GapStep gap_step(double t, const ArrayX& gap, const ArrayX& rate) const;
  /// Peaks since forget_peaks().
  Extremes recent();
  /// Adds what happens from the end of the last step to time t, where gaps and rates are as given.
  void extend(GapExtremes& extremes, double t, const ArrayX& gap, const ArrayX& rate) const;
  /// What the last step, up to time t, adds to the peaks since forget_peaks().
  void extend_recent(double t, const ArrayX& values);
  void consider_recent(Eigen::Index coupler, double value, double t);
  double recent_force(double value) const;
  model::Footprint footprint(Eigen::Index car, const model::CarMotion& motion) const;
  /// Of the sample that is being taken.
  model::CarMotion motion(const model::PlanColumns& q, Eigen::Index car) const;
  /// All cars of the sample that is being taken.
  MonitoredCars columns(const model::PlanColumns& q) const;
  void sample_speeds(double t, const model::PlanColumns& q, const std::optional<model::SpaceColumns>& space);
  void sample_touches(double t, const model::PlanColumns& q);
  void note(const FirstTouch& touch);
  void report_pile_up(const double* y, Outcome& outcome) const;
  void report_peaks(double t, const double* y, Outcome& outcome) const;
  void report_incidents(const model::Incidents& incidents, Outcome& outcome) const;

  const model::TrainModel& model_;
  const MonitorLoops& loops_;
  const inputs::OutcomeRules rules_;
  double energy_initial_, height_initial_;  // at the start: kinetic and strain energy; of height [J]
  double step_time_;
  ArrayX gap_, rate_, new_gap_, new_rate_;  // of every coupler [m, m/s]
  GapExtremes extremes_;
  /// Of every coupler since forget_peaks(): axial forces, buff positive, where the model notes its incidents itself,
  /// else gaps with the sign turned round, which rise with them.
  ArrayX highest_, highest_time_, lowest_, lowest_time_;
  std::size_t broken_seen_ = 0;  // of the model's own record
  ArrayX half_length_, half_width_, half_spacing_;
  Eigen::Array4Xd poses_;  // of all cars in the last sample, for curved track
  ArrayX astray_;          // farthest that either truck of a car has been from the centre line in any sample [m]
  ArrayX cosine_, sine_, rearmost_, foremost_, half_breadth_;  // headings and extents of the cars in the last sample
  ArrayX pins_squared_, centres_squared_;  // relative speeds of neighbours, squared, in the last sample [m^2/s^2]
  std::vector<Eigen::Index> by_x_;         // cars in the order of their rearmost reach
  std::vector<std::pair<Eigen::Index, Eigen::Index>> touching_;  // sorted, as of the last sample
  FirstTouch closing_;
  std::vector<FirstTouch> touches_;
  std::size_t impacts_seen_ = 0;  // of the model's own record
  RelativeSpeed relative_, centres_;
  double truck_speed_max_ = 0.0;
};

}  // namespace train_derail::outcome
