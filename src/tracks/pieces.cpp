#include "tracks/pieces.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>

namespace train_derail::tracks {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Response to a derivative of 1 in a piece and 0 elsewhere.
double response(double at, double from, double to, int order) {
  const double inside = std::clamp(at, from, to) - from;
  return order == 1 ? inside : 0.5 * inside * inside + std::max(0.0, at - to) * inside;
}

}  // namespace

std::vector<double> fine_breaks(const VectorXd& at, int points, double length) {
  const double end = at[at.size() - 1];
  std::vector<double> breaks{at[0]};
  int inside = 0;
  for (Index i = 0; i < at.size(); ++i) {
    if (++inside > points && at[i] - breaks.back() >= length) {
      breaks.push_back(at[i]);
      inside = 0;
    }
  }
  if (breaks.size() > 1) breaks.back() = end;  // the rest belongs to the last piece
  else breaks.push_back(end);
  return breaks;
}

Pieces joined_pieces(const VectorXd& at, const VectorXd& y, const VectorXd& weight, int order,
                     std::vector<double> breaks, double penalty) {
  // Lengths as shares of the whole: all columns are of one size.
  const double origin = breaks.front(), scale = breaks.back() - breaks.front();
  const auto pieces = static_cast<Index>(breaks.size()) - 1;
  MatrixXd a(at.size(), order + pieces);
  for (Index i = 0; i < at.size(); ++i) {
    const double s = (at[i] - origin) / scale, w = std::sqrt(weight[i]);
    for (int k = 0; k < order; ++k) a(i, k) = w * std::pow(s, k);
    for (Index j = 0; j < pieces; ++j) {
      const auto b = static_cast<std::size_t>(j);
      a(i, order + j) = w * response(s, (breaks[b] - origin) / scale, (breaks[b + 1] - origin) / scale, order);
    }
  }
  VectorXd rest = (weight.array().sqrt() * y.array()).matrix();
  // All that matters of the many rows is their triangle.
  const auto triangulate = [](MatrixXd& m, VectorXd& v) {
    const Index n = std::min(m.cols(), m.rows());
    const Eigen::HouseholderQR<MatrixXd> qr(m);
    v = (qr.householderQ().transpose() * v).head(n).eval();
    m = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  };
  triangulate(a, rest);
  VectorXd solution;
  for (;;) {
    const auto r = a.triangularView<Eigen::Upper>();
    solution = r.solve(rest);
    const Index joints = a.cols() - order - 1;
    if (joints <= 0) break;
    // What holding two neighbours equal costs: the square of their difference over its variance.
    MatrixXd difference = MatrixXd::Zero(a.cols(), joints);
    for (Index j = 0; j < joints; ++j) {
      difference(order + j, j) = 1.0;
      difference(order + j + 1, j) = -1.0;
    }
    const MatrixXd spread = a.transpose().triangularView<Eigen::Lower>().solve(difference);
    Index cheapest = 0;
    double least = 0.0;
    for (Index j = 0; j < joints; ++j) {
      const double d = solution[order + j] - solution[order + j + 1], cost = d * d / spread.col(j).squaredNorm();
      if (j == 0 || cost < least) {
        least = cost;
        cheapest = j;
      }
    }
    if (!(least < penalty)) break;
    const Index column = order + cheapest;
    a.col(column) += a.col(column + 1);
    MatrixXd fewer(a.rows(), a.cols() - 1);
    fewer << a.leftCols(column + 1), a.rightCols(a.cols() - column - 2);
    a = fewer;
    breaks.erase(breaks.begin() + cheapest + 1);
    triangulate(a, rest);
  }
  Pieces result;
  result.breaks = std::move(breaks);
  for (Index j = order; j < solution.size(); ++j) result.values.push_back(solution[j] / std::pow(scale, order));
  return result;
}

}  // namespace train_derail::tracks
