#include "model/couplers.hpp"

#include <algorithm>
#include <cmath>

#include "train_derail/model/draft_gear_law.hpp"

namespace train_derail::model {

Couplers::Couplers(const PlanarModel& train, const inputs::Coupler& law, AirBrakes& brakes, Record& record)
    : train_(train),
      law_(law),
      brakes_(brakes),
      record_(record),
      cos_break_(law.break_swing < M_PI ? std::cos(law.break_swing) : -2.0) {
  const Eigen::Index count = train.coupler_count();
  for (auto* a : {&damping_, &axial_, &damper_, &ux_, &uy_, &cos_swing_, &end_moment_}) *a = ArrayX::Zero(count);
  alive_ = ArrayX::Ones(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto car = static_cast<std::size_t>(i);
    damping_[i] = coupler_damping(law_, train.cars()[car].mass, train.cars()[car + 1].mass);
  }
}

CouplerArrays Couplers::arrays() {
  CouplerArrays a;
  a.alive = alive_.data();
  a.damping = damping_.data();
  a.axial = axial_.data();
  a.damper = damper_.data();
  a.ux = ux_.data();
  a.uy = uy_.data();
  a.cos_swing = cos_swing_.data();
  a.end_moment = end_moment_.data();
  return a;
}

CouplerState<double> Couplers::state(const CouplerState<double>& bare, const Vector2& rate, Eigen::Index i) const {
  CouplerState<double> b = bare;
  if (broken(i)) {
    b.axial = b.lateral = b.moment_lead = b.moment_trail = b.force_x = b.force_y = 0.0;
    return b;
  }
  const double spring = coupler_spring_force(law_, b.gap);
  const double axial = spring + coupler_damper_force(damping_[i], spring, rate.x() * b.ux + rate.y() * b.uy);
  b.force_x += (axial - b.axial) * b.ux;
  b.force_y += (axial - b.axial) * b.uy;
  b.axial = axial;
  return b;
}

double Couplers::spring_energy(double gap) const {
  if (law_.draft_gear_travel == 0.0) return axial_energy(law_, gap);
  return draft_gear_energy(law_, std::max(std::abs(gap - law_.length) - 0.5 * law_.slack, 0.0));
}

void Couplers::add_energy(const double* y, EnergyLedger& energy) const {
  const std::vector<CouplerState<double>> all = train_.couplers(y);
  for (Eigen::Index i = 0; i < alive_.size(); ++i) {
    if (broken(i)) continue;
    const CouplerState<double>& b = all[static_cast<std::size_t>(i)];
    energy.coupler_axial += spring_energy(b.gap);
    energy.coupler_swing += swing_energy(law_, b.swing_lead) + swing_energy(law_, b.swing_trail);
  }
}

void Couplers::note_peaks(double t) {
  if (alive_.size() == 0) return;
  Eigen::Index i = 0;
  if (peaks_.buff > record_.incidents.buff.force) {
    axial_.maxCoeff(&i);
    record_.incidents.buff = {peaks_.buff, i, t};
  }
  if (peaks_.draft > record_.incidents.draft.force) {
    axial_.minCoeff(&i);
    record_.incidents.draft = {peaks_.draft, i, t};
  }
}

BrokenCoupler Couplers::first_limit(const Step& step, Eigen::Index i) {
  using By = BrokenCoupler::By;
  const CouplerState<double> was = train_.coupler(step.before, i), is = train_.coupler(step.after, i);
  // Everything taken to run linearly through the step: the share of it after which the first limit is reached.
  double share = 1.0;
  By by = By::draft;
  const auto consider = [&](bool beyond, double from, double to, double limit, By what) {
    const double at = to > from ? std::clamp((limit - from) / (to - from), 0.0, 1.0) : 0.0;
    if (!beyond || at >= share) return;
    share = at;
    by = what;
  };
  const auto largest_swing = [](const CouplerState<double>& b) {
    return std::max(std::abs(b.swing_lead), std::abs(b.swing_trail));
  };
  const auto end_moment = [](const CouplerState<double>& b) { return std::abs(b.moment_lead + b.moment_trail); };
  consider(-axial_[i] > law_.break_draft, -was.axial, -is.axial, law_.break_draft, By::draft);
  consider(cos_swing_[i] < cos_break_, largest_swing(was), largest_swing(is), law_.break_swing, By::swing);
  consider(std::abs(end_moment_[i]) > law_.break_moment, end_moment(was), end_moment(is), law_.break_moment,
           By::moment);
  const auto between = [share](double from, double to) { return from + share * (to - from); };
  record_.spent.work_coupler_break += spring_energy(between(was.gap, is.gap)) +
                                      swing_energy(law_, between(was.swing_lead, is.swing_lead)) +
                                      swing_energy(law_, between(was.swing_trail, is.swing_trail));
  return {step.end() - (1.0 - share) * step.length, i, by, std::max(between(was.axial, is.axial), -law_.break_draft)};
}

bool Couplers::give_way(const Step& step) {
  if (peaks_.draft <= law_.break_draft && peaks_.cos_swing >= cos_break_ && peaks_.end_moment <= law_.break_moment)
    return false;
  Incidents& incidents = record_.incidents;
  std::vector<BrokenCoupler> found;
  for (Eigen::Index i = 0; i < alive_.size(); ++i) {
    const bool beyond =
        -axial_[i] > law_.break_draft || cos_swing_[i] < cos_break_ || std::abs(end_moment_[i]) > law_.break_moment;
    if (broken(i) || !beyond) continue;
    found.push_back(first_limit(step, i));
    const BrokenCoupler& b = found.back();
    if (-b.axial_force > incidents.draft.force) incidents.draft = {-b.axial_force, i, b.time};
    if (b.axial_force > incidents.buff.force) incidents.buff = {b.axial_force, i, b.time};
  }
  std::sort(found.begin(), found.end(), [](const BrokenCoupler& a, const BrokenCoupler& b) { return a.time < b.time; });
  for (const BrokenCoupler& b : found) {
    alive_[b.coupler] = 0.0;
    incidents.broken.push_back(b);
    brakes_.vent(b.time, b.coupler);
  }
  return !found.empty();
}

void Couplers::walk(files::Archive& archive) { archive.column("alive", alive_); }

}  // namespace train_derail::model
