#include "wide_vector.hpp"

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "wide.hpp"

namespace train_derail::solver {

namespace {

constexpr int kTermsMax = 8;  // of a step of the Runge-Kutta pairs

/// A summand of a linear combination.
struct Term {
  double factor;
  const double* data;
};

template <std::size_t... I>
[[gnu::always_inline]] inline void add_up(const Term* terms, double* z, std::ptrdiff_t n, std::index_sequence<I...>) {
  const double factor[] = {terms[I].factor...};
  const double* const x[] = {terms[I].data...};
#pragma GCC ivdep
  for (std::ptrdiff_t i = 0; i < n; ++i) z[i] = ((factor[I] * x[I][i]) + ...);
}

TRAIN_DERAIL_WIDE void add_up(int count, const Term* terms, double* z, std::ptrdiff_t n) {
  switch (count) {
    case 1: return add_up(terms, z, n, std::make_index_sequence<1>());
    case 2: return add_up(terms, z, n, std::make_index_sequence<2>());
    case 3: return add_up(terms, z, n, std::make_index_sequence<3>());
    case 4: return add_up(terms, z, n, std::make_index_sequence<4>());
    case 5: return add_up(terms, z, n, std::make_index_sequence<5>());
    case 6: return add_up(terms, z, n, std::make_index_sequence<6>());
    case 7: return add_up(terms, z, n, std::make_index_sequence<7>());
    case 8: return add_up(terms, z, n, std::make_index_sequence<8>());
  }
}

TRAIN_DERAIL_WIDE double weighted_square_sum(const double* x, const double* w, std::ptrdiff_t n) {
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (std::ptrdiff_t i = 0; i < n; ++i) sum += (x[i] * w[i]) * (x[i] * w[i]);
  return sum;
}

/// By quarters, so that additions need not wait for each other.
TRAIN_DERAIL_WIDE double sum_of(const double* x, std::ptrdiff_t n) {
  const std::ptrdiff_t q = n / 4;
  double sum = 0.0;
#pragma omp simd reduction(+ : sum)
  for (std::ptrdiff_t i = 0; i < q; ++i) sum += (x[i] + x[q + i]) + (x[2 * q + i] + x[3 * q + i]);
  for (std::ptrdiff_t i = 4 * q; i < n; ++i) sum += x[i];
  return sum;
}

/// Rounded to single precision: a norm needs no more, and the division is cheaper.
TRAIN_DERAIL_WIDE void weights(double rtol, double atol, const double* y, double* w, std::ptrdiff_t n) {
#pragma GCC ivdep
  for (std::ptrdiff_t i = 0; i < n; ++i) w[i] = 1.0F / static_cast<float>(rtol * std::abs(y[i]) + atol);
}

/// Starts at a cache line, where malloc would let wide loads straddle two.
N_Vector clone(N_Vector w) {
  constexpr std::size_t kLine = 64;
  const std::size_t size = static_cast<std::size_t>(NV_LENGTH_S(w)) * sizeof(realtype);
  N_Vector v = N_VCloneEmpty_Serial(w);
  if (v == nullptr) return nullptr;
  NV_DATA_S(v) = static_cast<realtype*>(std::aligned_alloc(kLine, (size + kLine - 1) / kLine * kLine));
  NV_OWN_DATA_S(v) = SUNTRUE;  // N_VDestroy calls free()
  if (NV_DATA_S(v) != nullptr) return v;
  N_VDestroy(v);
  return nullptr;
}

/// z = sum of c[i] x[i]; z may be one of the x. The tables of the Runge-Kutta pairs have zeros.
int linear_combination(int count, realtype* c, N_Vector* x, N_Vector z) {
  Term terms[kTermsMax];
  int used = 0;
  for (int i = 0; i < count; ++i) {
    if (c[i] == 0.0) continue;
    if (used == kTermsMax) return N_VLinearCombination_Serial(count, c, x, z);
    terms[used++] = {c[i], NV_DATA_S(x[i])};
  }
  if (used == 0) return N_VLinearCombination_Serial(count, c, x, z);
  add_up(used, terms, NV_DATA_S(z), NV_LENGTH_S(z));
  return 0;
}

void linear_sum(realtype a, N_Vector x, realtype b, N_Vector y, N_Vector z) {
  const Term terms[] = {{a, NV_DATA_S(x)}, {b, NV_DATA_S(y)}};
  add_up(2, terms, NV_DATA_S(z), NV_LENGTH_S(z));
}

void scale(realtype c, N_Vector x, N_Vector z) {
  if (c == 1.0 && x == z) return;
  const Term term{c, NV_DATA_S(x)};
  add_up(1, &term, NV_DATA_S(z), NV_LENGTH_S(z));
}

realtype weighted_rms_norm(N_Vector x, N_Vector w) {
  const sunindextype n = NV_LENGTH_S(x);
  return std::sqrt(weighted_square_sum(NV_DATA_S(x), NV_DATA_S(w), n) / static_cast<double>(n));
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
  weights(rtol, atol, y, w, n);
}

bool all_finite(const double* x, std::ptrdiff_t n) { return std::isfinite(sum_of(x, n)); }

}  // namespace train_derail::solver
