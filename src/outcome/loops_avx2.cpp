#include "outcome/loops_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::outcome {

const MonitorLoops kLoopsAvx2 = make_loops<xsimd::batch<double, xsimd::fma3<xsimd::avx2>>>("avx2");

}  // namespace train_derail::outcome
