#include "model/extended_kernels_impl.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedAvx2 = extended_kernels<std::experimental::native_simd<double>>();

}  // namespace train_derail::model
