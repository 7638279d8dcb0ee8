#include "model/spatial_kernels_impl.hpp"

namespace train_derail::model {

void press_trucks_of(const SpatialArrays& a, const double* y, std::ptrdiff_t car) { add_ground<double>(a, y, car); }

const SpatialKernels kSpatialPlain = spatial_kernels<double>("plain");

}  // namespace train_derail::model
