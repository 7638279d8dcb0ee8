#include "model/extended_kernels_impl.hpp"
#include "model/wide_functions.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedAvx512 = extended_kernels<Wide>("avx512");

}  // namespace train_derail::model
