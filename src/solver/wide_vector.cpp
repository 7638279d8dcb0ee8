#include "wide_vector.hpp"

#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "solver/loops.hpp"

namespace train_derail::solver {

namespace {

/// Starts at a cache line, where malloc would let wide loads straddle two.
N_Vector clone(N_Vector w) {
  constexpr std::size_t kLine = 64;
  const std::size_t size = static_cast<std::size_t>(NV_LENGTH_S(w)) * sizeof(sunrealtype);
  N_Vector v = N_VCloneEmpty_Serial(w);
  if (v == nullptr) return nullptr;
  NV_DATA_S(v) = static_cast<sunrealtype*>(std::aligned_alloc(kLine, (size + kLine - 1) / kLine * kLine));
  NV_OWN_DATA_S(v) = SUNTRUE;  // N_VDestroy calls free()
  if (NV_DATA_S(v) != nullptr) return v;
  N_VDestroy(v);
  return nullptr;
}

/// z = sum of c[i] x[i]; z may be one of the x. The tables of the Runge-Kutta pairs have zeros.
int linear_combination(int count, sunrealtype* c, N_Vector* x, N_Vector z) {
  Term terms[kTermsMax];
  int used = 0;
  for (int i = 0; i < count; ++i) {
    if (c[i] == 0.0) continue;
    if (used == kTermsMax) return N_VLinearCombination_Serial(count, c, x, z);
    terms[used++] = {c[i], NV_DATA_S(x[i])};
  }
  if (used == 0) return N_VLinearCombination_Serial(count, c, x, z);
  loops().add_up(used, terms, NV_DATA_S(z), NV_LENGTH_S(z));
  return 0;
}

void linear_sum(sunrealtype a, N_Vector x, sunrealtype b, N_Vector y, N_Vector z) {
  const Term terms[] = {{a, NV_DATA_S(x)}, {b, NV_DATA_S(y)}};
  loops().add_up(2, terms, NV_DATA_S(z), NV_LENGTH_S(z));
}

void scale(sunrealtype c, N_Vector x, N_Vector z) {
  if (c == 1.0 && x == z) return;
  const Term term{c, NV_DATA_S(x)};
  loops().add_up(1, &term, NV_DATA_S(z), NV_LENGTH_S(z));
}

sunrealtype weighted_rms_norm(N_Vector x, N_Vector w) {
  const sunindextype n = NV_LENGTH_S(x);
  return std::sqrt(loops().weighted_square_sum(NV_DATA_S(x), NV_DATA_S(w), n) / static_cast<double>(n));
}

}  // namespace

Vector wrap(double* data, sunindextype size, const Context& context) {
  Vector v(check_made(N_VMake_Serial(size, data, context.get()), "N_VMake_Serial"));
  v->ops->nvclone = clone;
  v->ops->nvlinearcombination = linear_combination;
  v->ops->nvlinearsum = linear_sum;
  v->ops->nvscale = scale;
  v->ops->nvwrmsnorm = weighted_rms_norm;
  return v;
}

void error_weights(double rtol, double atol, const double* y, double* w, std::ptrdiff_t n) {
  loops().weights(rtol, atol, y, w, n);
}

bool all_finite(const double* x, std::ptrdiff_t n) { return std::isfinite(loops().sum(x, n)); }

}  // namespace train_derail::solver
