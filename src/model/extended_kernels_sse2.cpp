#include "model/batch.hpp"
#include "model/extended_kernels_impl.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedSse2 = extended_kernels<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::model
