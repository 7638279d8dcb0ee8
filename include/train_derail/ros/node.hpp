#pragma once

namespace train_derail::ros_face {

/// The whole of train_derail_node. Exit code: 0; 2 if an input is not valid (nothing was started then); 3 if the
/// integration failed and the node was to exit when done.
int run_node(int argc, char** argv);

}  // namespace train_derail::ros_face
