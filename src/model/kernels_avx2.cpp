#include "model/kernels_impl.hpp"
#include "model/wide_functions.hpp"

namespace train_derail::model {

const KernelSet kAvx2 = kernel_set<Wide>("avx2");

}  // namespace train_derail::model
