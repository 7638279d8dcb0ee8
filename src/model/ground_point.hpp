/// \file
/// What the ground does to a point of a car, of several points side by side: B is a double or a batch of them
/// (simd/batch.hpp).
#pragma once

#include "model/rotation.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// A point of a car that is in the ground.
template <class B>
struct GroundPoint {
  Three<B> up;             // along which the ground pushes; of any length but 0
  B per_length;            // 1 over that length
  Three<B> velocity;       // m/s
  Three<B> strain;         // by which friction has strained the ground [m]
  B spring;                // part of the push along `up` that comes from the depth, over the length of `up` [N]
  B damping, rub_damping;  // along `up`, across it [N s/m]
};

/// The force on it is up * push + rub.
template <class B>
struct GroundPush {
  B push, carried;  // over the length of `up`; normal force [N]
  Three<B> rub;     // friction [N]
  Three<B> strain;  // at the end of the step [m]
};

/// The ground pushes only. Friction is at most mu(rub) times the normal force: the ground, of `stiffness` [N/m], is
/// strained until it gives way, for a step of length `step` [s]. A force that grew with the speed instead would let
/// cars creep down a bank.
template <class B, class Friction>
GroundPush<B> push_of_ground(const GroundPoint<B>& p, double stiffness, double step, const Friction& mu) {
  const B per_square = p.per_length * p.per_length, up_rate = p.velocity.dot(p.up);
  const B pushed = p.spring - p.damping * up_rate;
  GroundPush<B> result;
  result.push = select(pushed > B(0.0), pushed, B(0.0));
  result.carried = result.push * (p.up.dot(p.up) * p.per_length);
  const Three<B> slip = p.velocity - p.up * (up_rate * per_square);
  const Three<B> strain = p.strain - p.up * (p.strain.dot(p.up) * per_square) + slip * B(step);
  const Three<B> rub = strain * B(-stiffness) - slip * p.rub_damping;
  const B square = rub.dot(rub), limit = mu(rub) * result.carried;
  const auto slides = square > limit * limit;
  result.rub = rub * select(slides, B(limit * Roots<B>::inverse(square)), B(1.0));
  const Three<B> given_way = result.rub * B(-1.0 / stiffness);
  result.strain = {select(slides, given_way.x, strain.x), select(slides, given_way.y, strain.y),
                   select(slides, given_way.z, strain.z)};
  return result;
}

}  // namespace train_derail::model
