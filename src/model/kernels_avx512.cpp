#include "model/batch.hpp"
#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kAvx512 = kernel_set<xsimd::batch<double, xsimd::avx512f>>("avx512");

}  // namespace train_derail::model
