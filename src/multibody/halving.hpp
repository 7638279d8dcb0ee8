/// \file
/// How two programs are compared at equal times if neither is exact.
#pragma once

#include <vector>

#include "train_derail/multibody/engine.hpp"

namespace train_derail::multibody {

/// A train at one time. Forces may be left out.
struct Frame {
  std::vector<BodyMotion> cars;
  std::vector<CouplerForce> forces;
};
/// A run at equal intervals.
using Film = std::vector<Frame>;

/// The farthest that any car is from its twin.
struct Apart {
  double position = 0.0, angle = 0.0;  // m, rad

  void extend(const Apart& other);
  bool within(const Apart& limit) const { return position <= limit.position && angle <= limit.angle; }
};
Apart apart(const Frame& a, const Frame& b);
/// At any time that both have.
Apart farthest(const Film& a, const Film& b);

/// Four runs of one start: each program with steps a whole and a half (Steps).
template <class T>
struct Halves {
  T model_whole, model_half, engine_whole, engine_half;
};

/// How the two compare from the start to one time. What halving changes is what an answer lacks still, if it comes
/// closer in proportion to the step. So the two agree if they differ by at most twice the sum of what it changes in
/// either; a limit that is not small says nothing.
struct HalvedComparison {
  Apart whole, half;  // the model with its longer and its shorter step, from the engine's closer answer
  Apart limit;

  /// Adds a time.
  void extend(const Halves<Frame>& now);
  bool agrees() const { return half.within(limit); }
  bool worth(double most) const { return limit.position < most && limit.angle < most; }

 private:
  Apart model_, engine_;  // changed by halving
};
/// At all times that all four have.
HalvedComparison compare(const Halves<Film>& films);

}  // namespace train_derail::multibody
