/// \file
/// Functions of which the first or second derivative is constant by pieces, fitted to values.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace train_derail::tracks {

/// Values of the pieces between breaks; breaks.size() is values.size() + 1.
struct Pieces {
  std::vector<double> breaks, values;
};

/// Fits y(at) such that its derivative of `order` (1 or 2) is constant by pieces. Begins with many pieces, then joins
/// the two neighbours that cost least, as long as the sum of the weighted squares rises by less than `penalty`.
/// \param at      places, rising.
/// \param weight  of each value: one over its variance.
/// \param breaks  of the pieces to begin with, from the first place to the last.
/// Returns the pieces that remain.
Pieces joined_pieces(const Eigen::VectorXd& at, const Eigen::VectorXd& y, const Eigen::VectorXd& weight, int order,
                     std::vector<double> breaks, double penalty);

/// Breaks for joined_pieces(): each piece has at least `points` places and is at least `length` long.
std::vector<double> fine_breaks(const Eigen::VectorXd& at, int points, double length);

}  // namespace train_derail::tracks
