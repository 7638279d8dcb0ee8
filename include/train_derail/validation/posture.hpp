/// \file
/// How many of the derailed cars lie on their side or over, against what reports say. Speeds come in bands; accidents
/// with few derailed cars are left out, since their share is a matter of chance.
#pragma once

#include <string>
#include <vector>

namespace train_derail::validation {

/// Least number of derailed cars of an accident, or of a member, that is counted.
inline constexpr int kPostureCarsMin = 5;

/// One accident, or one member of its ensemble.
struct PostureCount {
  double speed_mph = 0.0;  ///< speed of the train [mph]
  int cars = 0,            ///< derailed cars whose posture is known
      over = 0;            ///< of them, on their side or over
};

/// Shares of one range of speeds. NaN if nothing is counted.
struct PostureShares {
  std::size_t count = 0;  ///< accidents, or members
  double over = 0.0,      ///< cars over, of all cars [-]
      sd = 0.0,           ///< standard deviation over the accidents of the share of each [-]
      none_over = 0.0,    ///< accidents in which no car is over, of all accidents [-]
      all_over = 0.0;     ///< accidents in which every car is over, of all accidents [-]
};
/// Shares of those with kPostureCarsMin cars or more.
PostureShares shares(const std::vector<PostureCount>& counts);

/// One range of speeds, real and predicted.
struct PostureBand {
  double from = 0.0,   ///< speeds above this [mph]
      to = 0.0;        ///< up to this [mph]
  PostureShares real,  ///< of the accidents
      predicted;       ///< of the members of their ensembles
};
/// Bands up to 10, 20, 30, 40 mph and above, those with real accidents; the last one is all speeds.
std::vector<PostureBand> by_band(const std::vector<PostureCount>& real, const std::vector<PostureCount>& predicted);

/// The bands as a table for people.
std::string to_table(const std::vector<PostureBand>& bands);

}  // namespace train_derail::validation
