// A study in a process of its own: whatever it takes or does, the live simulation goes on.
#pragma once

#include <atomic>
#include <functional>

#include "train_derail/RunStudyFeedback.h"
#include "train_derail/RunStudyGoal.h"
#include "train_derail/RunStudyResult.h"
#include "train_derail/ros/file_bounds.hpp"

namespace train_derail::ros_face {

/// First argument of the node's own program when it is to be such a process.
constexpr const char kStudyWorker[] = "--study-worker";

/// Runs the goal in a process of lower priority and bounded memory, which is the same program again, and returns its
/// result. It is ended when `stop` is set: asked first, killed soon after; what is done stays on disk. It does not
/// outlive the calling thread. `feedback` is called from the calling thread. Never throws.
RunStudyResult run_study_process(const RunStudyGoal& goal, const FileBounds& bounds,
                                 const std::function<void(const RunStudyFeedback&)>& feedback,
                                 const std::atomic<bool>& stop);

/// The whole of such a process; returns its exit code. Knows no master.
int study_worker(int argc, char** argv);

/// Most threads that a goal may ask for, on this machine.
std::uint32_t study_jobs_max();

}  // namespace train_derail::ros_face
