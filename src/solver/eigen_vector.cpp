#include "eigen_vector.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Core>

namespace train_derail::solver {

namespace {

using Array = Eigen::Map<Eigen::ArrayXd>;

Array array(N_Vector v) { return {NV_DATA_S(v), static_cast<Eigen::Index>(NV_LENGTH_S(v))}; }

template <std::size_t... I>
void combine(const realtype* c, N_Vector* x, N_Vector z, std::index_sequence<I...>) {
  array(z) = ((c[I] * array(x[I])) + ...);
}

/// z = sum of c[i] x[i]; z may be one of the x. A step of the Runge-Kutta pairs has at most eight terms.
int linear_combination(int count, realtype* c, N_Vector* x, N_Vector z) {
  switch (count) {
    case 0: return -1;
    case 1: combine(c, x, z, std::make_index_sequence<1>()); return 0;
    case 2: combine(c, x, z, std::make_index_sequence<2>()); return 0;
    case 3: combine(c, x, z, std::make_index_sequence<3>()); return 0;
    case 4: combine(c, x, z, std::make_index_sequence<4>()); return 0;
    case 5: combine(c, x, z, std::make_index_sequence<5>()); return 0;
    case 6: combine(c, x, z, std::make_index_sequence<6>()); return 0;
    case 7: combine(c, x, z, std::make_index_sequence<7>()); return 0;
    case 8: combine(c, x, z, std::make_index_sequence<8>()); return 0;
    default: return N_VLinearCombination_Serial(count, c, x, z);
  }
}

void linear_sum(realtype a, N_Vector x, realtype b, N_Vector y, N_Vector z) { array(z) = a * array(x) + b * array(y); }

void scale(realtype c, N_Vector x, N_Vector z) {
  if (c == 1.0) {
    if (x != z) array(z) = array(x);
  } else {
    array(z) = c * array(x);
  }
}

realtype weighted_rms_norm(N_Vector x, N_Vector w) {
  return std::sqrt((array(x) * array(w)).square().sum() / static_cast<double>(NV_LENGTH_S(x)));
}

}  // namespace

Vector wrap(double* data, sunindextype size, const Context& context) {
  Vector v(check_made(N_VMake_Serial(size, data, context.get()), "N_VMake_Serial"));
  v->ops->nvlinearcombination = linear_combination;
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvscale = scale;
  v->ops->nvwrmsnorm = weighted_rms_norm;
  return v;
}

}  // namespace train_derail::solver
