#include "model/batch.hpp"
#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kAvx2 = kernel_set<xsimd::batch<double, xsimd::fma3<xsimd::avx2>>>("avx2");

}  // namespace train_derail::model
