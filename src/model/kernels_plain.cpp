#include "model/kernels_impl.hpp"

namespace train_derail::model {

const DerailmentKernels kPlain = derailment_kernels<double>("plain");

}  // namespace train_derail::model
