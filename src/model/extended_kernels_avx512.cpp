#include "model/extended_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedAvx512 = extended_kernels<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::model
