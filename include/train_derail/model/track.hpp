/// \file
/// Centre line of the track, its lateral alignment, and where it has been torn up. Straight along +x through the origin
/// unless the scenario has curves; x = 0 is the point of derailment and arc length s grows in the direction of travel.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// A quantity along the track, in bins of equal length.
struct TrackTable {
  const double* values = nullptr;
  double from = 0.0;        ///< arc length at which bin `behind` begins [m]
  double per_length = 0.0;  ///< bins a length [1/m]
  double behind = 0.0;      ///< bins before `from`
  double last = 0.0;        ///< index of the last bin

  /// The bin, counted from 0, that arc length s [m] lies in, with what is beyond its begin as a fraction.
  template <class T>
  T bin(const T& s) const {
    return (s - from) * per_length + behind;
  }
};

/// The centre line of a curved track: places and tangents at equal distances.
struct TrackLine {
  const double* nodes = nullptr;  ///< x, y, tangent x, tangent y of one after the other
  double from = 0.0;              ///< arc length of the first [m]
  double bin = 0.0;               ///< between two of them [m]
  double last = 0.0;              ///< index of the last but one
};

/// One track; see above.
class Track {
 public:
  /// Knows arc lengths from `s_min` to `s_max` [m] and all curves; beyond them the track is straight and whole.
  Track(const inputs::Scenario& scenario, double s_min, double s_max);

  bool straight() const { return nodes_.empty(); }

  /// A place of the centre line.
  struct Node {
    Vector2 point;    ///< m
    Vector2 tangent;  ///< unit vector
  };
  /// Centre line at s.
  Node at(double s) const;
  /// All of it, for loops over many places; only if not straight().
  TrackLine line() const {
    static_assert(sizeof(Node) == 4 * sizeof(double));
    return {nodes_.data()->point.data(), s_min_, kBin, static_cast<double>(nodes_.size()) - 2.0};
  }
  /// Arc length of the place nearest to `p`, looked for along the whole track.
  double nearest(const Vector2& p) const;
  /// Arc length of the foot of the perpendicular from `p`, looked for near `s`.
  double foot(const Vector2& p, double s) const;

  /// Lateral deviation of the rails from the centre line, left positive [m].
  double alignment(double s) const {
    if (alignment_.empty()) return 0.0;
    const double b = std::min(std::max((s - s_min_) * (1.0 / kBin), 0.0), last_bin_);
    const auto i = static_cast<std::ptrdiff_t>(b);
    const double* table = alignment_.data() + i;
    return table[0] + (b - static_cast<double>(i)) * (table[1] - table[0]);
  }

  /// The same with its first and second derivative, smoothed.
  struct Deviation {
    double offset, slope, bend;  ///< m, -, 1/m
  };
  Deviation deviation(double s) const;
  /// Whether the curvature changes by more than `bend` [1/m] at a place between arc lengths `from` and `to` [m].
  bool kinks_between(double from, double to, double bend) const;

  /// The same as a table, between whose values it is interpolated; the same beyond the ends as at them. Only if not
  /// aligned().
  TrackTable alignments() const { return {alignment_.data(), s_min_, 1.0 / kBin, 0.0, last_bin_}; }

  /// The track is torn up at arc length s [m].
  bool torn(double s) const {
    const double b = torn_bins().bin(s);
    return b >= 0.0 && b < static_cast<double>(torn_.size()) && torn_[static_cast<std::size_t>(b)] > 0.0;
  }
  /// The same as a table: 1 where it is torn, else 0. Empty if track is never torn.
  TrackTable torn_bins() const {
    return {torn_.data(), 0.0, torn_per_length_, torn_behind_, static_cast<double>(torn_.size()) - 1.0};
  }
  /// Least and largest arc length that may be torn; the first is larger if none is [m].
  double torn_from() const { return torn_from_; }
  double torn_to() const { return torn_to_; }
  /// Tears up the stretch of rails.torn_length that arc length s [m] lies in.
  void tear(double s);
  /// The rails are where they should be.
  bool aligned() const { return alignment_.empty(); }
  /// What has been torn up, for a checkpoint.
  void walk(files::Archive& archive);

 private:
  static constexpr double kBin = 5.0 * inputs::kFoot;
  static constexpr std::size_t kBinsPerKnot = 4;  // between independent deviations of the rails

  double s_min_;                   // m
  std::vector<double> alignment_;  // every kBin; the same beyond the ends as at them
  double last_bin_ = 0.0;
  std::vector<Node> nodes_;                           // every kBin, if there are curves
  std::vector<std::pair<double, double>> kinks_;      // arc length [m], change of the curvature there [1/m]; in order
  double torn_per_length_ = 0.0, torn_behind_ = 0.0;  // see TrackTable
  std::vector<double> torn_;                          // a bin each: 1 if torn, else 0
  double torn_from_ = inputs::kInfinity, torn_to_ = -inputs::kInfinity;
};

}  // namespace train_derail::model
