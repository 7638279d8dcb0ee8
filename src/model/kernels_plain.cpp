#include "model/kernels_impl.hpp"

namespace train_derail::model {

const KernelSet kPlain = kernel_set<double>("plain");

}  // namespace train_derail::model
