// Eigen's arrays as they cross the border between the library and a program that is compiled for other instruction
// sets.
#pragma once

#include <cstddef>
#include <type_traits>

#include <Eigen/Core>

namespace train_derail {

// Eigen aligns its own types as whoever compiles them says (to 16 bytes; with -mavx2 or -march=native to 32 or 64) and
// then allocates by a function of its own instead of malloc(): what the one has allocated the other must not free.
// Without alignment these have one layout and one way of being allocated everywhere. Eigen's own types convert to them
// and back.
using ArrayX = Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor | Eigen::DontAlign>;
using VectorX = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor | Eigen::DontAlign>;
using Vector2 = Eigen::Matrix<double, 2, 1, Eigen::ColMajor | Eigen::DontAlign>;

static_assert(
    std::is_same_v<Eigen::Index, std::ptrdiff_t>,
    "train_derail was compiled with Eigen's own type of index: leave EIGEN_DEFAULT_DENSE_INDEX_TYPE undefined");

}  // namespace train_derail
