#include "model/kernels_impl.hpp"
#include "model/wide_trigonometry.hpp"

namespace train_derail::model {

const KernelSet kAvx2 = kernel_set<Wide>("avx2");

}  // namespace train_derail::model
