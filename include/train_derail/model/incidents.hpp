// What happens to a train at one moment, as the extended model notes it down. Cars and couplers are counted from 0
// here.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "train_derail/eigen_types.hpp"

namespace train_derail::model {

/// Why a truck left the rails.
enum class Cause {
  none,        // it has not
  pod,         // passed the point of derailment
  lateral,     // lateral force over load beyond rails.derail_ratio
  torn_track,  // came to where another truck had torn up the track
};

inline constexpr std::array<std::string_view, 4> kCauseNames{"none", "pod", "lateral", "torn_track"};
/// The same in a sentence: "derailed ...".
inline constexpr std::array<std::string_view, 4> kCauseTexts{"", "at the point of derailment", "by lateral force",
                                                             "on torn track"};
inline std::string_view to_string(Cause cause) { return kCauseNames[static_cast<std::size_t>(cause)]; }

struct Derailment {
  double time;  // s
  Eigen::Index car;
  bool front;  // truck
  Cause cause;
  double x, y;  // of the truck [m]
};

struct BrokenCoupler {
  double time;  // s
  Eigen::Index coupler;
  enum class By { draft, swing, moment } by;
  double axial_force;  // at which it broke, buff positive [N]
};

inline constexpr std::array<std::string_view, 3> kBrokenByNames{"draft", "swing", "moment"};
inline std::string_view to_string(BrokenCoupler::By by) { return kBrokenByNames[static_cast<std::size_t>(by)]; }

/// Side of a car that is hit: the one that faces the push.
enum class Face { front, rear, left, right };

inline constexpr std::array<std::string_view, 4> kFaceNames{"front", "rear", "left", "right"};
inline std::string_view to_string(Face face) { return kFaceNames[static_cast<std::size_t>(face)]; }

/// Two bodies that come to touch. Touches of the same two cars less than 0.25 s apart are one impact.
struct Impact {
  double time;                // of the first touch [s]
  double end;                 // of the last one so far [s]
  Eigen::Index car_a, car_b;  // a < b
  Face face_a, face_b;        // at the first touch
  double along_a, along_b;    // place on the car, from its centre forward [m]
  double x, y;                // where [m]
  double closing_speed;       // relative velocity of the two bodies there: its magnitude [m/s]
  double closing_normal;      // ... and what of it closes the gap [m/s]
  double impulse;             // of the normal force [N s]
  double peak_force;          // normal [N]
};

struct Peak {
  double force = 0.0;  // N
  Eigen::Index coupler = -1;
  double time = 0.0;  // s
};

struct Incidents {
  std::vector<Derailment> derailments;  // in the order of time, like the others
  std::vector<BrokenCoupler> broken;
  std::vector<Impact> impacts;
  Peak buff, draft;               // of the couplers
  double blockage_impulse = 0.0;  // of the buff force on the foremost car that still stands on the rails behind [N s]
  double blockage_peak = 0.0;     // N
  double blockage_time = 0.0;     // for which it was felt [s]
  double overlap_max = 0.0;       // deepest overlap of two footprints beyond what was crushed [m]
};

}  // namespace train_derail::model
