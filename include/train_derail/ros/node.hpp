/// \file
/// The node as a function.
#pragma once

namespace train_derail::ros_face {

/// Runs train_derail_node until it is told to stop, or is done. Returns its exit code: 0 if all went well; 1 if an
/// output could not be written, or something else failed; 2 if an input is not valid (nothing was started then); 3 if
/// the integration failed and the node was to exit when done.
int run_node(int argc, char** argv);

}  // namespace train_derail::ros_face
