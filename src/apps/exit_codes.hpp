/// \file
/// Exit codes of derail (docs/command_line.md).
#pragma once

namespace train_derail::apps {

inline constexpr int kOk = 0, kOutputFailed = 1, kInputWrong = 2,
                     kRunsFailed = 3,  ///< the run; any of an ensemble; all of a study or a validation
    kDiffers = 4,                      ///< derail verify: the two engines
    kIncomplete = 5,                   ///< derail merge: shards or runs are missing
    kInterrupted = 130;

}  // namespace train_derail::apps
