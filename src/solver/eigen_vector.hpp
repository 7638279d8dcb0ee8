// SUNDIALS vector over memory that someone else owns, its arithmetic done by Eigen: one vectorised pass an operation.
#pragma once

#include "sundials_raii.hpp"

namespace train_derail::solver {

/// Clones of it own their memory and inherit the arithmetic.
Vector wrap(double* data, sunindextype size, const Context& context);

}  // namespace train_derail::solver
