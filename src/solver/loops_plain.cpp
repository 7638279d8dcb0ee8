#include "solver/loops_impl.hpp"

namespace train_derail::solver {

const Loops kLoopsPlain = make_loops<double>("plain");

}  // namespace train_derail::solver
