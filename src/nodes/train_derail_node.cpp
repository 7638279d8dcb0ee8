// Simulates a train derailment live; README.md describes its topics, services and parameters.
#include <string>

#include "train_derail/ros/node.hpp"
#include "train_derail/ros/study_process.hpp"

int main(int argc, char** argv) {
  using namespace train_derail::ros_face;
  return argc > 1 && argv[1] == std::string(kStudyWorker) ? study_worker(argc, argv) : run_node(argc, argv);
}
