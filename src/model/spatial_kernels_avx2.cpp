#include "model/spatial_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const SpatialKernels kSpatialAvx2 = spatial_kernels<xsimd::batch<double, xsimd::fma3<xsimd::avx2>>>("avx2");

}  // namespace train_derail::model
