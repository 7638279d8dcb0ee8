// What the overlay of the 3D view says: texts, entries of the legend, the map of the train. Knows neither Qt nor RViz.
#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <vector>

#include "rviz/framing.hpp"
#include "rviz/node_link.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::rviz_panel {

/// One statement of the strip at the top.
struct Statement {
  std::string text;
  bool strong = false;

  bool operator==(const Statement& o) const { return text == o.text && strong == o.strong; }
};

/// The strip at the top. Empty without a run.
struct Strip {
  std::string title;                  // of the scenario; the part that may be cut
  std::string run;                    // "run 3 · 4.86 s"
  std::string state;                  // "paused", "ended: all cars at rest"; empty while it runs
  std::vector<Statement> statements;  // the first are the most important

  bool operator==(const Strip& o) const {
    return title == o.title && run == o.run && state == o.state && statements == o.statements;
  }
};

/// Returns the strip for what is known of a run. What there has not been yet, as a pile-up, a peak or an impact, is not
/// named; nor what comes later than the moment that is shown.
Strip make_strip(const NodeView& view);

/// Entries of the legend.
class Entries {
 public:
  void add(scene::Look look) { bits_.set(static_cast<std::size_t>(look)); }
  void add(scene::Lie lie) { bits_.set(scene::kLooks + static_cast<std::size_t>(lie)); }
  void add_force(int force_class) { bits_.set(kCars + slot(force_class)); }
  void add_broken() { bits_.set(kBroken); }
  void add_impact() { bits_.set(kImpact); }
  void add(const Entries& others) { bits_ |= others.bits_; }

  bool has(scene::Look look) const { return bits_.test(static_cast<std::size_t>(look)); }
  bool has(scene::Lie lie) const { return bits_.test(scene::kLooks + static_cast<std::size_t>(lie)); }
  bool has_force(int force_class) const { return bits_.test(kCars + slot(force_class)); }
  bool has_broken() const { return bits_.test(kBroken); }
  bool has_impact() const { return bits_.test(kImpact); }
  bool empty() const { return bits_.none(); }
  bool operator==(const Entries& o) const { return bits_ == o.bits_; }

 private:
  static constexpr std::size_t kCars = scene::kLooks + scene::kLies, kForces = 2 * scene::kForceClasses + 1;
  static constexpr std::size_t kBroken = kCars + kForces, kImpact = kBroken + 1;
  static std::size_t slot(int force_class) { return static_cast<std::size_t>(force_class + scene::kForceClasses); }

  std::bitset<kImpact + 1> bits_;
};

/// Returns what is shown now. Forces too small for an arrow have no entry.
Entries entries_now(const NodeView& view);

/// Keeps an entry for some seconds after its last use: what comes and goes with every push and pull would flicker.
class Legend {
 public:
  /// Takes what is used at the wall time `now` [s]; forgets all when `run_id` is another.
  void use(const Entries& entries, std::uint32_t run_id, double now);
  const Entries& entries() const { return entries_; }

 private:
  struct Use {
    Entries entries;
    double time;
  };
  std::vector<Use> uses_;
  std::uint32_t run_id_ = 0;
  Entries entries_;
};

/// Returns the limits of a class of forces without its unit, e.g. {"200", "890"}: in kip and in kN. `k`: of
/// scene::kForceSteps.
std::pair<std::string, std::string> force_limit(int k);

/// A car on the map.
struct MapCar {
  double x, y, heading;  // [m], [m], [rad]
  const scene::LookFacts* facts;
};

/// The train from above, along the line from the last car to the first.
struct TrainMap {
  std::vector<MapCar> cars;                                 // in the frame of the map: x ahead
  double left = 0.0, right = 0.0, bottom = 0.0, top = 0.0;  // of all [m]
  double point_x = 0.0, point_y = 0.0;                      // the point of derailment
  std::optional<double> north;                              // where it is, against x [rad]; if that is known
  double heap_x = 0.0, heap_y = 0.0, heap_turn = 0.0, heap_length = 0.0, heap_width = 0.0;

  bool operator==(const TrainMap& o) const;
};

/// Returns the map; without cars if none are known.
TrainMap make_map(const NodeView& view);

/// Half the length of a car on a map, about [m].
inline constexpr double kMapHalfCar = 8.0;

/// A bar of a map that is as long as it says.
struct ScaleBar {
  double length;  // [m]
  std::string text;
};
/// Returns the longest of some round lengths that is no longer than `most` [m].
ScaleBar scale_bar(double most);

/// What a car of this message is.
scene::Look look_of(const CarState& car, bool rails_yield);
/// What the colours of the cars say.
scene::Colours colours_of(const NodeView& view);

}  // namespace train_derail::rviz_panel
