/// \file
/// The pair of order 5(4) of J. R. Dormand and P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput.
/// Appl. Math. 6 (1980), 19-26, table 2 (RK5(4)7M). Where q' = v, the stages of q are written by the rates of v alone:
/// Q_i = q + c_i h v + h^2 sum_j (A A)_ij V'_j. So the velocities of the stages are not read again.
#pragma once

#include <cstddef>
#include <type_traits>
#include <utility>

#include "simd/blocks.hpp"
#include "solver/loops.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::solver {

namespace pair {

constexpr int kStages = kPairStages;

struct Table {
  double row[kStages + 1][kStages];
};

/// Row i - 1 is that of stage i, that of stage 7 the solution of order 5; the last one is this less that of order 4.
constexpr Table kRates = {
    {{},
     {1.0 / 5.0},
     {3.0 / 40.0, 9.0 / 40.0},
     {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
     {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
     {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
     {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0},
     {71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0}}};

constexpr double row_sum(const Table& a, int row) {
  double sum = 0.0;
  for (int j = 0; j < kStages; ++j) sum += a.row[row][j];
  return sum;
}

/// What the rates of v do to q: kRates times itself. What is zero but for rounding is zero.
constexpr Table squared(const Table& a) {
  Table product{};
  for (int i = 0; i <= kStages; ++i) {
    for (int l = 0; l < kStages; ++l) {
      double sum = 0.0;
      for (int j = 0; j < kStages; ++j) sum += a.row[i][j] * a.row[j][l];
      product.row[i][l] = sum < 1e-14 && sum > -1e-14 ? 0.0 : sum;
    }
  }
  return product;
}
constexpr Table kSquared = squared(kRates);

/// start + sum of factor[j] * rates[j][i], without the terms that the row does not have.
template <class B, int row, bool square, class V, std::size_t... J>
[[gnu::always_inline]] inline V add_row(V sum, const double* factor, const double* const* rates, std::ptrdiff_t i,
                                        std::index_sequence<J...>) {
  constexpr const Table& table = square ? kSquared : kRates;
  const auto add = [&](auto j) {
    if constexpr (table.row[row][j()] != 0.0)
      sum = Lanes<V>::multiply_add(factor[j()], Lanes<V>::load(rates[j()] + i), sum);
  };
  (add(std::integral_constant<int, static_cast<int>(J)>()), ...);
  return sum;
}
using Columns = std::make_index_sequence<kStages>;

/// The factors of a row for steps of length h. Each version of the loops has its own.
template <class B>
struct Factors {
  Factors(int row, double h) {
    for (int j = 0; j < kStages; ++j) {
      rates[j] = h * kRates.row[row][j];
      squared[j] = h * h * kSquared.row[row][j];
    }
  }
  double rates[kStages], squared[kStages];
};

template <class B, int row>
void add_up_row(const PairStep& s, double* y) {
  const Factors<B> f(row, s.h);
  constexpr double share = row_sum(kRates, row);
  const double node = share * s.h;
  const std::ptrdiff_t p = s.positions;
  const double* rates[kStages];
  for (int j = 0; j < kStages; ++j) rates[j] = s.rates[j];
  for_any<B>(p, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    using K = Lanes<V>;
    const V v = K::load(s.y + p + i);
    const V q = K::multiply_add(node, v, K::load(s.y + i));
    // Both before either is stored, so that each rate is loaded once.
    const V new_q = add_row<B, row, true>(q, f.squared, rates, p + i, Columns());
    const V new_v = add_row<B, row, false>(v, f.rates, rates, p + i, Columns());
    K::store(new_q, y + i);
    K::store(new_v, y + p + i);
  });
  for_any<B>(s.others, [&](std::ptrdiff_t k, auto zero) {
    using V = decltype(zero);
    const std::ptrdiff_t i = 2 * p + k;
    Lanes<V>::store(add_row<B, row, false>(Lanes<V>::load(s.y + i), f.rates, rates, i, Columns()), y + i);
  });
}

template <class B>
[[gnu::flatten]] void stage_state(int stage, const PairStep& s, double* y) {
  switch (stage) {
    case 2: return add_up_row<B, 1>(s, y);
    case 3: return add_up_row<B, 2>(s, y);
    case 4: return add_up_row<B, 3>(s, y);
    case 5: return add_up_row<B, 4>(s, y);
    case 6: return add_up_row<B, 5>(s, y);
    case 7: return add_up_row<B, 6>(s, y);
  }
}

template <class B>
[[gnu::flatten]] double error_square_sum(const PairStep& s, std::ptrdiff_t controlled, double rtol, double atol) {
  const Factors<B> f(kStages, s.h);
  const std::ptrdiff_t p = s.positions;
  double sum = 0.0;
  B sums(0.0);
  const auto weighted = [&](const auto& error, std::ptrdiff_t i) {
    using V = std::decay_t<decltype(error)>;
    const V y = Lanes<V>::load(s.y + i);
    const V size = select(y < V(0.0), V(-y), y);
    const V share = error * Lanes<V>::single_inverse(rtol * size + atol);
    if constexpr (std::is_same_v<V, B>) sums = sums + share * share;
    else sum += share * share;
  };
  for_each_once<B>(p, [&](std::ptrdiff_t i, auto zero) {
    weighted(add_row<B, kStages, true>(zero, f.squared, s.rates, p + i, Columns()), i);
    weighted(add_row<B, kStages, false>(zero, f.rates, s.rates, p + i, Columns()), p + i);
  });
  for_each_once<B>(controlled, [&](std::ptrdiff_t k, auto zero) {
    const std::ptrdiff_t i = 2 * p + k;
    weighted(add_row<B, kStages, false>(zero, f.rates, s.rates, i, Columns()), i);
  });
  return sum + Lanes<B>::sum(sums);
}

}  // namespace pair

}  // namespace train_derail::solver
