#include "tracks/smoothing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Eigen/Sparse>
#include <Eigen/SparseCholesky>

namespace train_derail::tracks {

namespace {

using Eigen::VectorXd;
using Matrix = Eigen::SparseMatrix<double>;
constexpr int kOrder =
    3;  // of the differences that are held small: those of a curve of constant curvature nearly vanish

/// Weights of four values in their third divided difference, times the mean step to the third power: 1, -3, 3, -1 for
/// equal steps.
std::array<double, kOrder + 1> difference(const VectorXd& at, Eigen::Index i) {
  std::array<double, kOrder + 1> w{};
  const double step = (at[i + kOrder] - at[i]) / kOrder;
  for (int k = 0; k <= kOrder; ++k) {
    double product = 1.0;
    for (int j = 0; j <= kOrder; ++j) {
      if (j != k) product *= at[i + k] - at[i + j];
    }
    w[static_cast<std::size_t>(k)] = 6.0 * step * step * step / product;
  }
  return w;
}

Matrix roughness(const VectorXd& at) {
  const Eigen::Index rows = at.size() - kOrder;
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto w = difference(at, i);
    const double step = (at[i + kOrder] - at[i]) / kOrder;
    // The integral of the square of the third derivative.
    const double scale = std::pow(step, 0.5 - kOrder);
    for (int k = 0; k <= kOrder; ++k) entries.emplace_back(i, i + k, scale * w[static_cast<std::size_t>(k)]);
  }
  Matrix d(rows, at.size());
  d.setFromTriplets(entries.begin(), entries.end());
  return d.transpose() * d;
}

VectorXd places(const VectorXd& x, const VectorXd& y) {
  VectorXd s(x.size());
  s[0] = 0.0;
  for (Eigen::Index i = 1; i < x.size(); ++i) s[i] = s[i - 1] + std::hypot(x[i] - x[i - 1], y[i] - y[i - 1]);
  return s;
}

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

/// Parameters that rise strictly, for points of a line that may turn back in the noise.
VectorXd rising(VectorXd at) {
  const double least = 1e-3 * (at[at.size() - 1] - at[0]) / static_cast<double>(at.size());
  for (Eigen::Index i = 1; i < at.size(); ++i) at[i] = std::max(at[i], at[i - 1] + least);
  return at;
}

}  // namespace

double noise_of(const VectorXd& at, const VectorXd& value) {
  std::vector<double> sizes;
  for (Eigen::Index i = 0; i + kOrder < at.size(); ++i) {
    const auto w = difference(at, i);
    double sum = 0.0, squares = 0.0;
    for (int k = 0; k <= kOrder; ++k) {
      sum += w[static_cast<std::size_t>(k)] * value[i + k];
      squares += w[static_cast<std::size_t>(k)] * w[static_cast<std::size_t>(k)];
    }
    sizes.push_back(std::abs(sum) / std::sqrt(squares));
  }
  constexpr double kNormal = 1.4826;  // standard deviation over median of the sizes
  return sizes.empty() ? 0.0 : kNormal * median(sizes);
}

SmoothLine smoothed(const std::vector<PlanePoint>& points, double noise) {
  const auto n = static_cast<Eigen::Index>(points.size());
  VectorXd px(n), py(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    px[i] = points[static_cast<std::size_t>(i)].x;
    py[i] = points[static_cast<std::size_t>(i)].y;
  }
  SmoothLine line{px, py, rising(places(px, py))};
  if (n <= kOrder) return line;
  VectorXd weight = VectorXd::Ones(n);
  // Each round takes the places along the curve of the round before, and gives less weight to outliers.
  for (int round = 0; round < 5; ++round) {
    const Matrix rough = roughness(line.place);
    const double step = (line.place[n - 1] - line.place[0]) / static_cast<double>(n - 1);
    const auto solve = [&](double stiffness) {
      Matrix a = rough * stiffness;
      for (Eigen::Index i = 0; i < n; ++i) a.coeffRef(i, i) += weight[i] * step;
      const Eigen::SimplicialLDLT<Matrix> solver(a);
      if (solver.info() != Eigen::Success) throw std::invalid_argument("the points cannot be smoothed");
      line.x = solver.solve((weight.array() * px.array() * step).matrix());
      line.y = solver.solve((weight.array() * py.array() * step).matrix());
      const auto squares = (line.x - px).array().square() + (line.y - py).array().square();
      return std::sqrt((weight.array() * squares).sum() / (2.0 * weight.sum()));
    };
    // From stiff to soft, until the points are off by no more than the noise.
    // Powers of ten of the stiffness [m^6]. Stiffer ones would lose all digits of the solution.
    double low = 0.0, high = std::min(14.0, 8.0 + 6.0 * std::log10(step));
    for (int i = 0; i < 20; ++i) {
      const double middle = 0.5 * (low + high);
      (solve(std::pow(10.0, middle)) > 0.9 * noise ? high : low) = middle;
    }
    solve(std::pow(10.0, low));
    for (Eigen::Index i = 0; i < n; ++i) {
      const double off = std::hypot(line.x[i] - px[i], line.y[i] - py[i]);
      weight[i] = off > 3.0 * noise ? 3.0 * noise / off : 1.0;
    }
    line.place = rising(places(line.x, line.y));
  }
  return line;
}

}  // namespace train_derail::tracks
