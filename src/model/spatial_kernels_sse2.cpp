#include "model/spatial_kernels_impl.hpp"
#include "simd/batch.hpp"

namespace train_derail::model {

const SpatialKernels kSpatialSse2 = spatial_kernels<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::model
