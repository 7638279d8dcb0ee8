#include "model/extended_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedSse2 = extended_kernels<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::model
