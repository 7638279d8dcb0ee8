#include "model/extended_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedAvx2 = extended_kernels<xsimd::batch<double, xsimd::fma3<xsimd::avx2>>>("avx2");

}  // namespace train_derail::model
