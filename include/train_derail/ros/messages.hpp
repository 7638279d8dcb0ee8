/// \file
/// Conversion of values of the core to messages. Nothing is computed here. `time` is the simulated time since the start
/// of the run [s], `run_id` counts the runs of the node from 1.
#pragma once

#include <cstdint>

#include <std_msgs/Header.h>
#include <tf2_msgs/TFMessage.h>

#include "train_derail/CarStates.h"
#include "train_derail/CouplerForces.h"
#include "train_derail/Event.h"
#include "train_derail/Impacts.h"
#include "train_derail/Inputs.h"
#include "train_derail/Outcome.h"
#include "train_derail/PileUp.h"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/scene/event_detector.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// Message of ~cars.
CarStates to_message(const std::vector<simulation::CarSnapshot>& cars, double time, const std_msgs::Header& header,
                     std::uint32_t run_id);
/// Message of ~couplers.
CouplerForces to_message(const std::vector<simulation::CouplerSnapshot>& couplers, double time,
                         const std_msgs::Header& header, std::uint32_t run_id);
/// Message of ~impacts, with the histogram of normal closing speeds.
Impacts to_message(const std::vector<model::Impact>& impacts, double time, const std_msgs::Header& header,
                   std::uint32_t run_id);
/// Message of ~outcome.
Outcome to_message(const outcome::Outcome& outcome, const std_msgs::Header& header, std::uint32_t run_id);
/// Why a run has ended or failed, for people: RunInfo::message.
std::string why_ended(const outcome::Outcome& outcome);
/// Message of ~inputs. `cars` are those of `scenario`.
Inputs to_message(const inputs::Scenario& scenario, const std::vector<model::Car>& cars, const std_msgs::Header& header,
                  std::uint32_t run_id);
/// Message of ~pile_up.
PileUp to_message(const scene::Heap& heap, double time, const std_msgs::Header& header, std::uint32_t run_id);
/// Message of ~events.
Event to_message(const scene::Occurrence& occurrence, const std_msgs::Header& header, std::uint32_t run_id);

/// Cars of a message of ~cars.
std::vector<simulation::CarSnapshot> from_message(const CarStates& message);
/// Couplers of a message of ~couplers.
std::vector<simulation::CouplerSnapshot> from_message(const CouplerForces& message);
/// Impacts of a message of ~impacts.
std::vector<model::Impact> from_message(const Impacts& message);
/// Outcome of a message of ~outcome.
outcome::Outcome from_message(const Outcome& message);
/// Content of a message of ~events.
scene::Occurrence from_message(const Event& message);

/// Transform from the frame of `header` to `child`: a point (x, y) of the ground plane [m], turned by `yaw` [rad] about
/// z.
geometry_msgs::TransformStamped make_transform(const std_msgs::Header& header, const std::string& child, double x,
                                               double y, double yaw);
/// Transforms from the frame of `header` to the frames of all cars (Frames::car).
tf2_msgs::TFMessage to_transforms(const std::vector<model::Car>& train,
                                  const std::vector<simulation::CarSnapshot>& cars, const std_msgs::Header& header,
                                  const Frames& frames);

}  // namespace train_derail::ros_face
