#include "outcome/loops_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::outcome {

const MonitorLoops kLoopsAvx512 = make_loops<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::outcome
