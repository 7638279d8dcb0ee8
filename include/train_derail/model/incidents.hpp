/// \file
/// What happens to a train at one moment, as the extended model notes it down. Cars and couplers are counted from 0
/// here.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "train_derail/eigen_types.hpp"

namespace train_derail::model {

/// Why a truck left the rails.
enum class Cause {
  none,        ///< it has not
  pod,         ///< passed the point of derailment
  lateral,     ///< lateral force over load beyond rails.derail_ratio
  torn_track,  ///< came to where another truck had torn up the track
  bad_track,   ///< on bad track, or at a switch
  defect,      ///< of its own car
};

inline constexpr std::array<std::string_view, 6> kCauseNames{"none",       "pod",       "lateral",
                                                             "torn_track", "bad_track", "defect"};
/// The same in a sentence: "derailed ...".
inline constexpr std::array<std::string_view, 6> kCauseTexts{
    "",           "at the point of derailment", "by lateral force", "on torn track", "on bad track or at a switch",
    "by a defect"};
inline std::string_view to_string(Cause cause) { return kCauseNames[static_cast<std::size_t>(cause)]; }

/// A truck that leaves the rails.
struct Derailment {
  double time;       ///< s
  Eigen::Index car;  ///< whose truck it is
  bool front;        ///< the front truck; false: the rear one
  Cause cause;       ///< why it left
  double x, y;       ///< place of the truck [m]
};

/// A truck that runs on the ties, off the rails but still guided.
struct TieRun {
  enum class End { none, drift, obstacle };
  Eigen::Index car;  ///< whose truck it is
  bool front;        ///< the front truck; false: the rear one
  double time;       ///< when it left the rails [s]
  double distance;   ///< that it has run so far, along the track [m]
  int obstacles;     ///< places of obstacles that it has met
  double end_time;   ///< when it left the track bed [s]; if it has
  End end;           ///< what threw it off the track bed; none: nothing so far
};

/// A coupler that breaks.
struct BrokenCoupler {
  double time;                                                       ///< s
  Eigen::Index coupler;                                              ///< between cars `coupler` and `coupler + 1`
  enum class By { draft, swing, moment, slip, vertical, twist } by;  ///< the limit that was reached first
  double axial_force;  ///< axial force at which it broke, buff positive [N]
};

inline constexpr std::array<std::string_view, 6> kBrokenByNames{"draft", "swing",    "moment",
                                                                "slip",  "vertical", "twist"};
inline std::string_view to_string(BrokenCoupler::By by) { return kBrokenByNames[static_cast<std::size_t>(by)]; }

/// Side of a car that is hit: the one that faces the push. Top and bottom: in models of space only.
enum class Face { front, rear, left, right, top, bottom };

inline constexpr std::array<std::string_view, 6> kFaceNames{"front", "rear", "left", "right", "top", "bottom"};
inline std::string_view to_string(Face face) { return kFaceNames[static_cast<std::size_t>(face)]; }

/// Two bodies that come to touch. Touches of the same two cars less than 0.25 s apart are one impact; bodies that have
/// crushed each other touch until they are clear of each other.
struct Impact {
  double time;                  ///< when they first touched [s]
  double end;                   ///< when they last touched so far [s]
  Eigen::Index car_a, car_b;    ///< the two cars, car_a < car_b
  Face face_a, face_b;          ///< which side of either car was hit, at the first touch
  double along_a, along_b;      ///< where on either car: from its centre forward [m]
  double x, y;                  ///< point of the first touch, world frame [m]
  double z;                     ///< its height above the rails at the point of derailment; 0 in models of the plane [m]
  double closing_speed;         ///< magnitude of the relative velocity of the two bodies there [m/s]
  double closing_speed_normal;  ///< the part of it that closes the gap [m/s]
  double impulse;               ///< of the normal force, so far [N s]
  double peak_force;            ///< largest normal force so far [N]
};

/// Largest force of any coupler.
struct Peak {
  double force = 0.0;         ///< magnitude [N]
  Eigen::Index coupler = -1;  ///< between cars `coupler` and `coupler + 1`; -1: none yet
  double time = 0.0;          ///< s
};

/// All that has happened so far, each list in the order of time.
struct Incidents {
  std::vector<Derailment> derailments;  ///< trucks that left the rails
  std::vector<TieRun> tie_runs;         ///< trucks that ran on the ties
  std::vector<BrokenCoupler> broken;    ///< couplers that broke
  std::vector<Impact> impacts;          ///< bodies that touched
  Peak buff, draft;                     ///< largest compression and tension of any coupler
  double blockage_impulse = 0.0;  ///< of the buff force on the foremost car that still stands on the rails behind [N s]
  double blockage_peak = 0.0;     ///< largest such force [N]
  double blockage_time = 0.0;     ///< how long it was felt [s]
  double overlap_max = 0.0;       ///< deepest overlap of two footprints beyond what was crushed [m]
};

}  // namespace train_derail::model
