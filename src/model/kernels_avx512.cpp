#include "model/kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const DerailmentKernels kAvx512 = derailment_kernels<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::model
