#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kAvx512 = kernel_set<std::experimental::native_simd<double>>("avx512");

}  // namespace train_derail::model
