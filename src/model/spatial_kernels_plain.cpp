#include "model/spatial_kernels_impl.hpp"

namespace train_derail::model {

const SpatialKernels kSpatialPlain = spatial_kernels<double>("plain");

}  // namespace train_derail::model
