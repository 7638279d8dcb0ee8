#include "simd/batch.hpp"
#include "solver/loops_impl.hpp"

namespace train_derail::solver {

const VectorLoops kLoopsAvx2 = make_loops<xsimd::batch<double, xsimd::fma3<xsimd::avx2>>>("avx2");

}  // namespace train_derail::solver
