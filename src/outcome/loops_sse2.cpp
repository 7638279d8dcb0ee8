#include "outcome/loops_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::outcome {

const MonitorLoops kLoopsSse2 = make_loops<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::outcome
