#include "model/planar_rolling.hpp"

#include <cmath>

#include "train_derail/model/state.hpp"

namespace train_derail::model {

PlanarRolling::PlanarRolling(const inputs::Scenario& scenario, const std::vector<Car>& train,
                             const PlanarArrays& arrays, const Couplers& couplers, Trucks& trucks, PlanarRest& rest)
    : share_(scenario.rails.rolling_share),
      possible_(share_ > 0.0 && trucks.rails_on() && scenario.rails.derail_ratio < inputs::kInfinity),
      bend_at_one_(share_ * scenario.rails.derail_ratio * inputs::kStandardGravity),
      train_(train),
      arrays_(arrays),
      couplers_(couplers),
      trucks_(trucks),
      rest_(rest),
      rolls_(busy_blocks(train.size()), false),
      quiet_for_(rolls_.size(), 0.0),
      bend_front_(train.size(), 0.0),
      bend_rear_(train.size(), 0.0),
      lateral_share_(train.size(), 0.0),
      way_(train.size(), 0.0),
      bend_(train.size(), 0.0),
      sound_(train.size(), false),
      near_(train.size(), false) {}

double PlanarRolling::kinetic(const double* y, Index car) const {
  const ConstMotionMap q = motion(y, static_cast<Index>(train_.size()));
  const Car& c = train_[at(car)];
  return 0.5 * c.mass * (q(car, VX) * q(car, VX) + q(car, VY) * q(car, VY)) +
         0.5 * c.yaw_inertia * q(car, OMEGA) * q(car, OMEGA);
}

double PlanarRolling::seat(double* y, Index car, bool goes) {
  MotionMap q = motion(y, static_cast<Index>(train_.size()));
  const double before = kinetic(y, car);
  double &c = arrays_.cosine[car], &s = arrays_.sine[car];
  const Vector2 velocity(q(car, VX), q(car, VY));
  const double speed = std::copysign(velocity.norm(), velocity.dot(Vector2(c, s)));
  const TruckPath path = trucks_.seat(car, {q(car, X), q(car, Y)});
  bend_front_[at(car)] = path.front.bend;
  bend_rear_[at(car)] = path.rear.bend;
  const Vector2 axis = (path.front.place - path.rear.place).normalized(), across(-axis.y(), axis.x());
  q(car, X) = 0.5 * (path.front.place.x() + path.rear.place.x());
  q(car, Y) = 0.5 * (path.front.place.y() + path.rear.place.y());
  const double sine = c * axis.y() - s * axis.x();  // small: the car is on the rails
  q(car, THETA) += sine * (1.0 + sine * sine / 6.0);
  c = axis.x();
  s = axis.y();
  // Rails do no work: the speed stays.
  const double front = goes ? path.front.slope.dot(across) : 0.0, rear = goes ? path.rear.slope.dot(across) : 0.0;
  const Vector2 now = speed * (axis + 0.5 * (front + rear) * across).normalized();
  q(car, VX) = now.x();
  q(car, VY) = now.y();
  q(car, OMEGA) = speed * (front - rear) / train_[at(car)].truck_spacing;
  return before - kinetic(y, car);
}

PlanarRolling::Bar PlanarRolling::bar(const double* y, Index i) const {
  if (i < 0 || i + 1 >= static_cast<Index>(train_.size())) return {Vector2::Zero(), 1.0, 0.0};
  const ConstMotionMap q = motion(y, static_cast<Index>(train_.size()));
  const auto pin = [&](Index k, double half) {
    return Vector2(q(k, X) + half * arrays_.cosine[k], q(k, Y) + half * arrays_.sine[k]);
  };
  const Vector2 along = pin(i, -0.5 * train_[at(i)].length) - pin(i + 1, 0.5 * train_[at(i + 1)].length);
  return {along, along.norm(), couplers_.axial()[i]};
}

void PlanarRolling::find_lateral(const double* y) {
  for (const CarRange* r = cars().ranges; r != cars().ranges + cars().count; ++r) {
    Bar ahead = bar(y, r->from - 1);
    for (Index k = r->from; k < r->to; ++k) {
      const Bar behind = bar(y, k);
      find_lateral(y, k, ahead, behind);
      ahead = behind;
    }
  }
}

void PlanarRolling::find_lateral(const double* y, Index car, const Bar& ahead, const Bar& behind) {
  const ConstMotionMap q = motion(y, static_cast<Index>(train_.size()));
  const Car& c = train_[at(car)];
  const Vector2 axis(arrays_.cosine[car], arrays_.sine[car]), across(-axis.y(), axis.x());
  // Across the car, at its front and rear pins.
  const auto pull = [&](const Bar& b) { return b.axial * b.along.dot(across) / b.length; };
  const double front = -pull(ahead), rear = pull(behind), lever = c.length / c.truck_spacing;
  const double speed = q(car, VX) * axis.x() + q(car, VY) * axis.y();
  const auto truck = [&](double bend, double near, double far) {
    return 0.5 * c.mass * speed * speed * bend - 0.5 * ((1.0 + lever) * near + (1.0 - lever) * far);
  };
  trucks_.set_lateral(car, truck(bend_front_[at(car)], front, rear), truck(bend_rear_[at(car)], rear, front));
}

void PlanarRolling::begin_look(const double* y, Contacts* contacts) {
  const auto n = static_cast<Index>(train_.size());
  const ConstMotionMap q = motion(y, n);
  for (Index k = 0; k < n; ++k) {
    sound_[at(k)] = trucks_.sound(k);
    near_[at(k)] = false;
    if (!sound_[at(k)]) continue;
    lateral_share_[at(k)] = trucks_.lateral_share(k);
    const double speed = std::abs(q(k, VX)) + std::abs(q(k, VY));
    way_[at(k)] = kWay + kTime * speed;
    bend_[at(k)] = kBend * bend_at_one_ / (speed * speed + 1e-9);
  }
  if (contacts == nullptr) return;
  const auto column = [&](Coordinate c) { return y + c * n; };
  contacts->mark_near({column(X), column(Y), arrays_.cosine, arrays_.sine, column(VX), column(VY), column(OMEGA)},
                      sound_, near_);
}

bool PlanarRolling::may_roll(std::size_t b, double share) const {
  for (Index k = first(b); k < end(b); ++k)
    if (!is_calm(k, share) || near_[at(k)] || !trucks_.clear(k, way_[at(k)], bend_[at(k)])) return false;
  const auto last = static_cast<Index>(train_.size()) - 1;
  for (Index k = first(b) - 1; k >= 0 && k >= first(b) - kReach && !couplers_.broken(k); --k)
    if (!is_calm(k, share)) return false;
  for (Index k = end(b); k <= last && k < end(b) + kReach && !couplers_.broken(k - 1); ++k)
    if (!is_calm(k, share)) return false;
  return true;
}

template <class Use>
void PlanarRolling::for_all(const Use& use) {
  for (const CarRange* r = cars().ranges; r != cars().ranges + cars().count; ++r)
    for (Index k = r->from; k < r->to; ++k) use(k);
}

double PlanarRolling::look(double h, double* y, Contacts* contacts) {
  unlooked_ += h;
  const bool any = cars().count > 0;
  if (!possible_ && !any) return 0.0;
  const bool hit = any && contacts != nullptr && contacts->touches(cars());
  if (!hit && unlooked_ < kInterval - 0.5 * h) return 0.0;
  // Where the rails are does not matter to what rolls straight on: now and then is enough.
  const bool curved = !trucks_.track().straight();
  double taken = 0.0;
  if (curved || ++unseated_ >= kSeatEvery) {
    for_all([&](Index k) { taken += seat(y, k, curved); });
    unseated_ = 0;
  }
  find_lateral(y);
  begin_look(y, contacts);
  bool changed = false;
  for (std::size_t b = 0; b < rolls_.size(); ++b) {
    const bool may = possible_ && may_roll(b, rolls_[b] ? share_ : kEnter * share_);
    quiet_for_[b] = may ? quiet_for_[b] + unlooked_ : 0.0;
    if (rolls_[b] ? may : quiet_for_[b] < kQuiet) continue;
    rolls_[b] = may;
    changed = true;
    for (Index k = first(b); k < end(b); ++k) taken += seat(y, k, curved || !may);
  }
  unlooked_ = 0.0;
  if (changed) show();
  return taken;
}

void PlanarRolling::show() {
  ranges_.set(rolls_, static_cast<std::ptrdiff_t>(train_.size()));
  rest_.leave_out(rolls_);
  // What their couplers do to the car behind; on curved track it is found in every step.
  for_all([this](Index k) { arrays_.pin_y[k + 1] = arrays_.moment_trail[k + 1] = 0.0; });
}

void PlanarRolling::walk(files::Archive& archive) {
  archive.value("unlooked", unlooked_);
  archive.value("unseated", unseated_);
  archive.flags("rolls", rolls_);
  archive.column("quiet_for", quiet_for_);
  archive.column("bend_front", bend_front_);
  archive.column("bend_rear", bend_rear_);
  if (archive.restoring()) show();
}

}  // namespace train_derail::model
