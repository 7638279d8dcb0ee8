#include "model/spatial_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const SpatialKernels kSpatialAvx512 = spatial_kernels<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::model
