#include "model/kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const DerailmentKernels kSse2 = derailment_kernels<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::model
