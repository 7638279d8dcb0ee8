// A node of somebody else's: starts a simulator that waits, listens to its outcome, ends with the run.
#include <cstdio>

#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include "train_derail/Outcome.h"

void heard(const train_derail::Outcome& outcome) {
  if (outcome.ended == train_derail::Outcome::RUNNING) return;
  std::printf("%u off track\n", outcome.cars_off_track);
  ros::shutdown();
}

int main(int count, char** arguments) {
  ros::init(count, arguments, "listener");
  ros::NodeHandle node;
  const ros::Subscriber outcomes = node.subscribe("/train_derail/outcome", 1000, heard);
  if (!ros::service::waitForService("/train_derail/resume", ros::Duration(300.0))) return 1;
  std_srvs::Trigger resume;
  // Persistent: of a call that ends its connection, roscpp may drop the answer on a busy machine.
  ros::ServiceClient client = node.serviceClient<std_srvs::Trigger>("/train_derail/resume", true);
  if (!client.call(resume) || !resume.response.success) return 1;
  ros::spin();
}
