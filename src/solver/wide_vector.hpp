// SUNDIALS vector over memory that someone else owns, its arithmetic one pass an operation, vectorised by the compiler.
#pragma once

#include <cstddef>

#include "sundials_raii.hpp"

namespace train_derail::solver {

/// Clones of it own their memory and inherit the arithmetic.
Vector wrap(double* data, sunindextype size, const Context& context);

/// w = 1 / (rtol |y| + atol)
void error_weights(double rtol, double atol, const double* y, double* w, std::ptrdiff_t n);

/// False as well where the sum of entries that are finite is not.
bool all_finite(const double* x, std::ptrdiff_t n);

}  // namespace train_derail::solver
