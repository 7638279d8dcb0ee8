/// \file
/// How many runs and threads may be asked for. The command line and Python share the bounds and the words.
#pragma once

#include <string>

namespace train_derail::study {

/// Least and most of a number that is asked for.
struct Bounds {
  int least,  ///< smallest number that is allowed
      most;   ///< largest one
};

inline constexpr Bounds kSeeds{2, 100000};        ///< runs of an ensemble of one scenario
inline constexpr Bounds kReplicates{1, 1000000};  ///< runs for each point of a study
inline constexpr Bounds kJobs{1, 4096};           ///< threads

/// Returns the number that `text` is. Throws inputs::InputError, which names `where` and `key`, unless it is a whole
/// number within the bounds.
int count(const Bounds& bounds, const std::string& where, const std::string& key, const std::string& text);

}  // namespace train_derail::study
