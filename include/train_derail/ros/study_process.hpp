/// \file
/// A study in a process of its own. Whatever the study takes or does, the live simulation goes on.
#pragma once

#include <atomic>
#include <functional>

#include "train_derail/RunStudyFeedback.h"
#include "train_derail/RunStudyGoal.h"
#include "train_derail/RunStudyResult.h"
#include "train_derail/ros/file_bounds.hpp"

namespace train_derail::ros_face {

/// First argument of the node's program when it is to compute a study instead.
constexpr const char kStudyWorker[] = "--study-worker";

/// Computes `goal` in a process of lower priority and bounded memory, which is the same program again, and returns its
/// result. When `stop` is set, the process is asked to end, and is killed soon after; runs that are done stay on disk.
/// The process does not outlive the calling thread, which also calls `feedback`. Files must lie within `bounds`. Never
/// throws: the result says what went wrong.
RunStudyResult run_study_process(const RunStudyGoal& goal, const FileBounds& bounds,
                                 const std::function<void(const RunStudyFeedback&)>& feedback,
                                 const std::atomic<bool>& stop);

/// Does the work of such a process and returns its exit code. Needs no master.
int study_worker(int argc, char** argv);

/// Returns the largest number of threads that a goal may ask for on this machine.
std::uint32_t study_jobs_max();

}  // namespace train_derail::ros_face
