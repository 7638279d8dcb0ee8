/// \file
/// Directions along the rails and to their left, for several trucks side by side: B is a double or a batch of them
/// (simd/batch.hpp).
#pragma once

#include <cstddef>

#include "simd/blocks.hpp"

namespace train_derail::model {

/// A vector in the horizontal plane of the world.
template <class B>
struct Plan {
  B x, y;
};

/// Directions at some trucks. On straight track these are x and y.
template <class B, bool straight>
struct RailFrame {
  B tx, ty;
  /// `a` has the columns tangent_x and tangent_y.
  template <class Arrays>
  RailFrame(const Arrays& a, std::ptrdiff_t truck) {
    if constexpr (!straight) {
      tx = Lanes<B>::load(a.tangent_x + truck);
      ty = Lanes<B>::load(a.tangent_y + truck);
    }
  }
  B along(const B& x, const B& y) const {
    if constexpr (straight) return x;
    else return x * tx + y * ty;
  }
  B across(const B& x, const B& y) const {
    if constexpr (straight) return y;
    else return y * tx - x * ty;
  }
  Plan<B> world(const B& along, const B& across) const {
    if constexpr (straight) return {along, across};
    else return {along * tx - across * ty, along * ty + across * tx};
  }
};

}  // namespace train_derail::model
