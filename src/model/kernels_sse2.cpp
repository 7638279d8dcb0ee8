#include "model/batch.hpp"
#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kSse2 = kernel_set<xsimd::batch<double, xsimd::sse2>>("sse2");

}  // namespace train_derail::model
