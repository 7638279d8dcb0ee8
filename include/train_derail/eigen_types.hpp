/// \file
/// Eigen types for the public interface of the library. A program may be compiled for other instruction sets than the
/// library; these types have the same layout in both.
#pragma once

#include <cstddef>
#include <type_traits>

#include <Eigen/Core>

namespace train_derail {

// The alignment of Eigen's own types depends on the compiler's options: 16 bytes, or 32 or 64 with -mavx2 or
// -march=native. The way in which their memory is allocated depends on it too, so memory that the library has allocated
// could not be freed by the program. The types below are not aligned: layout and allocation are the same everywhere.
// Eigen's own types convert to them and back.

/// Column of numbers, with element-wise arithmetic; any length.
using ArrayX = Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor | Eigen::DontAlign>;
/// Vector of any length.
using VectorX = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor | Eigen::DontAlign>;
/// Vector in the plane.
using Vector2 = Eigen::Matrix<double, 2, 1, Eigen::ColMajor | Eigen::DontAlign>;

static_assert(
    std::is_same_v<Eigen::Index, std::ptrdiff_t>,
    "train_derail was compiled with Eigen's own type of index: leave EIGEN_DEFAULT_DENSE_INDEX_TYPE undefined");

}  // namespace train_derail
