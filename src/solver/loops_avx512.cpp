#include "simd/batch.hpp"
#include "solver/loops_impl.hpp"

namespace train_derail::solver {

const VectorLoops kLoopsAvx512 = make_loops<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::solver
