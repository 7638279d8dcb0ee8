/// \file
/// Templates of the loops: B is a double or a batch of them (simd/batch.hpp).
#pragma once

#include <cmath>
#include <utility>

#include "simd/blocks.hpp"
#include "solver/dormand_prince_impl.hpp"
#include "solver/loops.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::solver {

template <class B, std::size_t... I>
void add_terms(const Term* terms, double* z, std::ptrdiff_t n, std::index_sequence<I...>) {
  const double factor[] = {terms[I].factor...};
  const double* const x[] = {terms[I].data...};
  for_each_once<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using K = Lanes<decltype(zero)>;
    constexpr std::size_t last = sizeof...(I) - 1;
    auto sum = factor[last] * K::load(x[last] + i);
    for (std::size_t k = last; k > 0; --k) sum = K::multiply_add(factor[k - 1], K::load(x[k - 1] + i), sum);
    K::store(sum, z + i);
  });
}

template <class B>
[[gnu::flatten]] void add_up(int count, const Term* terms, double* z, std::ptrdiff_t n) {
  switch (count) {
    case 1: return add_terms<B>(terms, z, n, std::make_index_sequence<1>());
    case 2: return add_terms<B>(terms, z, n, std::make_index_sequence<2>());
    case 3: return add_terms<B>(terms, z, n, std::make_index_sequence<3>());
    case 4: return add_terms<B>(terms, z, n, std::make_index_sequence<4>());
    case 5: return add_terms<B>(terms, z, n, std::make_index_sequence<5>());
    case 6: return add_terms<B>(terms, z, n, std::make_index_sequence<6>());
    case 7: return add_terms<B>(terms, z, n, std::make_index_sequence<7>());
    case 8: return add_terms<B>(terms, z, n, std::make_index_sequence<8>());
  }
}

template <class B>
[[gnu::flatten]] double weighted_square_sum(const double* x, const double* w, std::ptrdiff_t n) {
  using L = Lanes<B>;
  B sums(0.0);
  std::ptrdiff_t i = 0;
  for (; i + L::count <= n; i += L::count) {
    const B weighted = L::load(x + i) * L::load(w + i);
    sums = sums + weighted * weighted;
  }
  double each[L::count], sum = 0.0;
  L::store(sums, each);
  for (; i < n; ++i) each[0] += (x[i] * w[i]) * (x[i] * w[i]);
  for (const double part : each) sum += part;
  return sum;
}

/// By quarters, so that additions need not wait for each other.
template <class B>
[[gnu::flatten]] double sum(const double* x, std::ptrdiff_t n) {
  using L = Lanes<B>;
  const std::ptrdiff_t block = 4 * L::count;
  B quarters[] = {B(0.0), B(0.0), B(0.0), B(0.0)};
  std::ptrdiff_t i = 0;
  for (; i + block <= n; i += block) {
    for (std::ptrdiff_t q = 0; q < 4; ++q) quarters[q] = quarters[q] + L::load(x + i + q * L::count);
  }
  double sum = L::sum((quarters[0] + quarters[1]) + (quarters[2] + quarters[3]));
  for (; i < n; ++i) sum += x[i];
  return sum;
}

/// A norm needs no more than single precision, and the division is cheaper.
template <class B>
void weights(double rtol, double atol, const double* y, double* w, std::ptrdiff_t n) {
  for_each_once<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using K = Lanes<decltype(zero)>;
    const auto value = K::load(y + i);
    const auto size = select(value < decltype(zero)(0.0), decltype(zero)(-value), value);
    K::store(K::single_inverse(rtol * size + atol), w + i);
  });
}

template <class B>
[[gnu::flatten]] void move(std::ptrdiff_t n, double h, const double* a, const double* v_before, const double* q_before,
                           double* v, double* q) {
  for_each_once<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using K = Lanes<decltype(zero)>;
    const auto moved = K::load(v_before + i) + h * K::load(a + i);
    K::store(moved, v + i);
    K::store(K::load(q_before + i) + h * moved, q + i);
  });
}

template <class B>
constexpr VectorLoops make_loops(const char* instruction_set) {
  return {
      instruction_set,      Lanes<B>::count,          add_up<B>, weighted_square_sum<B>, sum<B>, weights<B>, move<B>,
      pair::stage_state<B>, pair::error_square_sum<B>};
}

}  // namespace train_derail::solver
