#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kAvx2 = kernel_set<std::experimental::native_simd<double>>("avx2");

}  // namespace train_derail::model
