#include "model/extended_kernels_impl.hpp"
#include "model/wide_functions.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedAvx2 = extended_kernels<Wide>("avx2");

}  // namespace train_derail::model
