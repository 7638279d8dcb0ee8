/// \file
/// Cars off the rails that lie still in the spatial model. They are held where they are, and what presses on them is
/// not computed, until a neighbour or the rails do something else to them than when they came to rest.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "train_derail/files/archive.hpp"

namespace train_derail::model {

/// Which cars lie still.
class Rest {
 public:
  static constexpr double kTime = 0.5;   ///< for which a car must be still [s]
  static constexpr double kPush = 0.02;  ///< change of a neighbour's force that wakes a car, over its weight

  explicit Rest(std::size_t cars) : lying_(cars, 0), still_for_(cars, 0.0) {}

  bool any() const { return count_ > 0; }
  bool all() const { return count_ == lying_.size(); }
  bool lies(std::size_t car) const { return lying_[car] != 0; }

  /// It has been still for this long [s].
  double still_for(std::size_t car) const { return still_for_[car]; }
  /// How a car that does not lie is in a step of length h [s]; true once it has been still for kTime.
  bool note(std::size_t car, bool still, double h) {
    still_for_[car] = still ? still_for_[car] + h : 0.0;
    return still_for_[car] >= kTime;
  }
  void lay(std::size_t car) {
    lying_[car] = 1;
    ++count_;
  }
  /// Nothing if the car does not lie.
  void wake(std::size_t car) {
    if (lies(car)) --count_;
    lying_[car] = 0;
    still_for_[car] = 0.0;
  }

  void wake_all() {
    for (std::size_t car = 0; car < lying_.size(); ++car) wake(car);
  }

  void walk(files::Archive& archive) {
    archive.column("still_for", still_for_);
    std::vector<bool> lying(lying_.begin(), lying_.end());
    archive.flags("lying", lying);
    lying_.assign(lying.begin(), lying.end());
    count_ = static_cast<std::size_t>(std::count(lying_.begin(), lying_.end(), 1));
  }

 private:
  std::vector<unsigned char> lying_;  // 1 or 0: bits would cost more, and every loop asks
  std::vector<double> still_for_;     // s
  std::size_t count_ = 0;
};

/// Who can wake a car that lies still.
class Waker {
 public:
  virtual ~Waker() = default;
  /// What a neighbour does to a car that lies has changed by so much [N]: enough of it wakes the car, in the same step.
  virtual void wake_if_pushed(std::size_t car, double change) = 0;
};

/// What a neighbour did to a car when it came to rest.
struct Held {
  bool known = true;                                // false: what it does next is what it did all the time
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  // N

  /// By how much `now` differs from it [N]; if it is not known, `now` is what later ones are compared with.
  double change(const Eigen::Vector3d& now) {
    if (!known) force = now;
    known = true;
    return (now - force).norm();
  }
  void walk(files::Archive& archive) {
    archive.value("known", known);
    archive.column("force", force);
  }
};

}  // namespace train_derail::model
