// Simulates a train derailment live; README.md describes its topics, services and parameters.
#include "train_derail/ros/node.hpp"

int main(int argc, char** argv) { return train_derail::ros_face::run_node(argc, argv); }
