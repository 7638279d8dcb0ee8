#include "solver/loops_impl.hpp"

namespace train_derail::solver {

const VectorLoops kLoopsPlain = make_loops<double>("plain");

}  // namespace train_derail::solver
