#include "outcome/loops_impl.hpp"

namespace train_derail::outcome {

const MonitorLoops kLoopsPlain = make_loops<double>("plain");

}  // namespace train_derail::outcome
