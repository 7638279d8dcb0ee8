/// \file
/// Heights of the rails in the spatial model: grades along the track, and superelevation of its curves. Level unless
/// the scenario has track.grades or a curve with superelevation.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// One track's heights over the arc length s, as Track has it. Where a grade or a superelevation begins or ends, it
/// changes linearly over kRunIn, half before that place and half beyond it: the height changes along a parabola. The
/// superelevation of an arc changes over three quarters of its length where that is less, so that its middle has all.
class TrackProfile {
 public:
  /// Of a spiral for about 3 in of superelevation, at 62 ft an inch: said to be AREMA's rule, not verified [m].
  static constexpr double kRunIn = 200.0 * inputs::kFoot;

  explicit TrackProfile(const inputs::Scenario& scenario);

  /// All rails are level, at height 0.
  bool flat() const { return nodes_.empty(); }

  /// A place of the track.
  struct Place {
    double bed = 0.0;     ///< height of the track bed and the lower rail; 0 at the point of derailment [m]
    double grade = 0.0;   ///< its slope along the track, uphill positive [-]
    double height = 0.0;  ///< of the middle between the rails at their top: bed and half the superelevation [m]
    double slope = 0.0;   ///< its slope along the track [-]
    double tilt = 0.0;    ///< rise from right to left over run; negative in a curve to the left [-]
    double twist = 0.0;   ///< change of the slope from right to left: of the tilt along the track, and in a grade that
                          ///< turns, as the inner rail climbs as much in less length [1/m]
  };
  /// At arc length s [m]; level beyond all grades and curves.
  Place at(double s) const {
    if (flat()) return {};
    const double b = (s - from_) / kBin, last = static_cast<double>(nodes_.size() - 1);
    if (!(b > 0.0) || b >= last) {
      const double end = b > 0.0 ? nodes_.back().bed : nodes_.front().bed;
      return {end, 0.0, end, 0.0, 0.0, 0.0};
    }
    const auto i = static_cast<std::size_t>(b);
    const double share = b - static_cast<double>(i);
    const Node &n = nodes_[i], &next = nodes_[i + 1];
    // The slopes are the derivatives of the heights.
    const double bend = next.grade - n.grade, raise = next.lift - n.lift, turn = next.tilt - n.tilt;
    Place p;
    p.grade = n.grade + share * bend;
    p.bed = n.bed + kBin * share * (n.grade + 0.5 * share * bend);
    p.height = p.bed + n.lift + share * raise;
    p.slope = p.grade + raise / kBin;
    p.tilt = n.tilt + share * turn;
    p.twist = turn / kBin + p.slope * n.curvature;
    return p;
  }
  /// Largest size of a grade [-].
  double steepest() const { return steepest_; }

 private:
  static constexpr double kBin = 5.0 * inputs::kFoot;

  struct Node {
    double bed = 0.0, grade = 0.0, lift = 0.0, tilt = 0.0;  // lift: half the superelevation
    double curvature = 0.0;                                 // up to the next node
  };
  double from_ = 0.0, steepest_ = 0.0;
  std::vector<Node> nodes_;  // every kBin
};

}  // namespace train_derail::model
