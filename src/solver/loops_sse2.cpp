#include "simd/batch.hpp"
#include "solver/loops_impl.hpp"

namespace train_derail::solver {

const VectorLoops kLoopsSse2 = make_loops<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::solver
