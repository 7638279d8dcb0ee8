#include "model/extended_kernels_impl.hpp"

namespace train_derail::model {

const ExtendedKernels kExtendedPlain = extended_kernels<double>("plain");

}  // namespace train_derail::model
