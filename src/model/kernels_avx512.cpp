#include "model/kernels_impl.hpp"
#include "model/wide_functions.hpp"

namespace train_derail::model {

const KernelSet kAvx512 = kernel_set<Wide>("avx512");

}  // namespace train_derail::model
