#include "model/rolled_away.hpp"

#include <algorithm>
#include <cmath>

namespace train_derail::model {

namespace {

constexpr double kShare = 0.5;  // of what rails and couplers bear

/// Force that drives the car once its brakes are full, forward positive [N].
double drive(const Rolling& train, Eigen::Index car) {
  const double grade = train.track.grade;
  const double slope = -grade / std::sqrt(1.0 + grade * grade);
  return train.cars[static_cast<std::size_t>(car)].weight * (slope - train.brakes.full_share(car));
}

bool rolls_freely(const Rolling& train, const PlanColumns& q, Eigen::Index car) {
  const Vector2 tangent = train.trucks.tangent(car);
  return q.vx[car] * tangent.x() + q.vy[car] * tangent.y() > 0.0 && train.trucks.sits_easily(car, kShare);
}

}  // namespace

Eigen::Index rolled_away(const Rolling& train, const PlanColumns& q) {
  const auto n = static_cast<Eigen::Index>(train.cars.size());
  if (!(train.track.grade < 0.0)) return 0;
  double force = 0.0;
  Eigen::Index head = 0;
  for (bool joined = true; joined; ++head) {
    if (head + 1 >= n || !rolls_freely(train, q, head)) return 0;
    force += drive(train, head);
    joined = !train.couplers.broken(head);
    if (joined && !train.couplers.carries_little(head, kShare)) return 0;
  }
  if (!(force > 0.0)) return 0;
  const double behind = train.trucks.rear_arc(head - 1) - 2.0 * train.cars[static_cast<std::size_t>(head - 1)].length;
  const auto ends = [behind](const inputs::Curve& c) { return c.start + c.length < behind; };
  if (!std::all_of(train.track.curves.begin(), train.track.curves.end(), ends)) return 0;
  if (train.trucks.track().torn_to() > behind) return 0;
  for (Eigen::Index k = head; k < n; ++k) {
    if (train.trucks.front_arc(k) > behind || train.trucks.rear_arc(k) > behind) return 0;
  }
  return head;
}

}  // namespace train_derail::model
