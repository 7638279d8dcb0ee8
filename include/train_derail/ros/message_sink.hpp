// Where the messages of a run go: topics, a bag, or several of them.
#pragma once

#include <rosgraph_msgs/Clock.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include "train_derail/CarStates.h"
#include "train_derail/CouplerForces.h"
#include "train_derail/Event.h"
#include "train_derail/Impacts.h"
#include "train_derail/Inputs.h"
#include "train_derail/Outcome.h"
#include "train_derail/RunInfo.h"

namespace train_derail::ros_face {

/// One function a topic, called in the order in which the messages belong. Stamps never go back.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  virtual void clock(const rosgraph_msgs::Clock& m) = 0;
  virtual void tf(const tf2_msgs::TFMessage& m) = 0;
  virtual void tf_static(const tf2_msgs::TFMessage& m) = 0;
  virtual void cars(const CarStates& m) = 0;
  virtual void couplers(const CouplerForces& m) = 0;
  virtual void markers(const visualization_msgs::MarkerArray& m) = 0;
  virtual void event(const Event& m) = 0;
  virtual void inputs(const Inputs& m) = 0;
  virtual void impacts(const Impacts& m) = 0;
  virtual void outcome(const Outcome& m) = 0;
  virtual void run_info(const RunInfo& m) = 0;

  /// Time after the end of a run, and where everything stands: for those who listen, not for a record of the run.
  virtual void idle(const rosgraph_msgs::Clock&, const tf2_msgs::TFMessage&) {}

  /// Markers are costly: they are made only if some sink wants them.
  virtual bool wants_markers() const = 0;
};

}  // namespace train_derail::ros_face
