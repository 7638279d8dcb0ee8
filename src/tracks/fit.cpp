#include "train_derail/tracks/fit.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Dense>

#include "tracks/pieces.hpp"
#include "tracks/smoothing.hpp"

namespace train_derail::tracks {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kLeastNoise = 0.05;       // m; a track is not known better
constexpr double kLeastPiece = 10.0;       // m; shorter arcs say nothing of a track
constexpr double kOutlier = 3.0;           // times the noise
constexpr int kOfABreak = 3;               // unknowns: value, place, and that it may be anywhere
constexpr std::size_t kPiecesFirst = 200;  // to begin with

Vector2d across(const Vector2d& v) { return {-v.y(), v.x()}; }

/// A chain of arcs.
class Chain {
 public:
  struct Node {
    Vector2d c;
    double heading;
  };
  Chain(const Vector2d& start, double heading, const Pieces& pieces) : pieces_(pieces), nodes_{{start, heading}} {
    for (std::size_t j = 0; j < pieces.values.size(); ++j)
      nodes_.push_back(advanced(nodes_.back(), pieces.values[j], pieces.breaks[j + 1] - pieces.breaks[j]));
  }

  const Pieces& pieces() const { return pieces_; }
  const Node& node(std::size_t j) const { return nodes_[j]; }
  /// Piece at a place; those at the ends go on.
  std::size_t piece(double s) const {
    const auto after = std::upper_bound(pieces_.breaks.begin() + 1, pieces_.breaks.end() - 1, s);
    return static_cast<std::size_t>(after - pieces_.breaks.begin()) - 1;
  }
  Node at(double s) const {
    const double end = pieces_.breaks.back();
    if (s > end) return advanced(nodes_.back(), 0.0, s - end);
    if (s < pieces_.breaks.front()) return advanced(nodes_.front(), 0.0, s - pieces_.breaks.front());
    const std::size_t j = piece(s);
    return advanced(nodes_[j], pieces_.values[j], s - pieces_.breaks[j]);
  }
  /// Integral of the position over the first `length` of a piece.
  Vector2d integral(std::size_t j, double length) const {
    const Node& n = nodes_[j];
    const double k = pieces_.values[j];
    constexpr double kSmall = 1e-2;
    if (std::abs(k * length) < kSmall)  // Simpson's rule
      return length / 6.0 * (n.c + 4.0 * advanced(n, k, 0.5 * length).c + advanced(n, k, length).c);
    const double h = n.heading, e = h + k * length;
    const Vector2d middle = n.c - Vector2d(std::sin(h), -std::cos(h)) / k;
    return middle * length + Vector2d(std::cos(h) - std::cos(e), std::sin(h) - std::sin(e)) / (k * k);
  }

 private:
  static Node advanced(const Node& n, double curvature, double length) {
    const double half = 0.5 * curvature * length, direction = n.heading + half;
    const double chord = length * (std::abs(half) < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half);
    return {n.c + chord * Vector2d(std::cos(direction), std::sin(direction)), n.heading + 2.0 * half};
  }
  Pieces pieces_;
  std::vector<Node> nodes_;
};

/// Solves a least-squares problem by the method of Levenberg and Marquardt. `evaluate(q, residuals, jacobian)` returns
/// false where q makes no sense. Returns the sum of squares.
template <class Evaluate>
double least_squares(VectorXd& q, const Evaluate& evaluate) {
  VectorXd r, trial_r;
  MatrixXd jacobian, trial_jacobian;
  if (!evaluate(q, r, jacobian)) throw std::invalid_argument("the fit has no beginning");
  double damping = 1e-3;
  for (int round = 0; round < 60 && damping < 1e12; ++round) {
    MatrixXd normal = jacobian.transpose() * jacobian;
    const VectorXd gradient = jacobian.transpose() * r;
    const VectorXd scale = normal.diagonal().cwiseMax(1e-12 * normal.diagonal().maxCoeff());
    normal.diagonal() += damping * scale;
    const VectorXd step = normal.ldlt().solve(-gradient);
    const VectorXd trial = q + step;
    if (!step.allFinite() || !evaluate(trial, trial_r, trial_jacobian) || !(trial_r.squaredNorm() < r.squaredNorm())) {
      damping *= 10.0;
      continue;
    }
    const double gain = r.squaredNorm() - trial_r.squaredNorm();
    q = trial;
    r.swap(trial_r);
    jacobian.swap(trial_jacobian);
    damping = std::max(1e-9, damping * 0.1);
    if (gain < 1e-6 * (1.0 + r.squaredNorm())) break;
  }
  return r.squaredNorm();
}

/// Arcs that are polished on the points themselves.
class ArcFit {
 public:
  ArcFit(const std::vector<PlanePoint>& points, VectorXd place, double noise)
      : noise_(noise), place_(std::move(place)), weight_(VectorXd::Ones(place_.size())) {
    for (const PlanePoint& p : points) points_.emplace_back(p.x, p.y);
  }

  void begin(const Vector2d& start, double heading, const Pieces& pieces) {
    start_ = start;
    heading_ = heading;
    pieces_ = pieces;
    straight_.assign(pieces.values.size(), false);
    polish();
  }

  /// Joins pieces and makes them straight, as far as that costs less than the criterion.
  void simplify() {
    while (remove_short() || join_some() || straighten_some()) {
    }
  }

  const Pieces& pieces() const { return pieces_; }
  Vector2d start() const { return start_; }
  double heading() const { return heading_; }
  const VectorXd& place() const { return place_; }
  VectorXd offsets() const { return residuals(Chain(start_, heading_, pieces_)); }

 private:
  struct Saved {
    Vector2d start;
    double heading, cost;
    Pieces pieces;
    std::vector<bool> straight;
    VectorXd place;
  };
  Saved saved() const { return {start_, heading_, cost_, pieces_, straight_, place_}; }
  void restore(const Saved& s) {
    start_ = s.start;
    heading_ = s.heading;
    cost_ = s.cost;
    pieces_ = s.pieces;
    straight_ = s.straight;
    place_ = s.place;
  }
  double criterion(int parameters) const { return parameters * std::log(static_cast<double>(points_.size())); }

  VectorXd residuals(const Chain& chain) const {
    VectorXd r(place_.size());
    for (Index i = 0; i < r.size(); ++i) {
      const Chain::Node n = chain.at(place_[i]);
      const Vector2d tangent(std::cos(n.heading), std::sin(n.heading));
      r[i] = (points_[static_cast<std::size_t>(i)] - n.c).dot(across(tangent));
    }
    return r;
  }

  /// Moves the places to the feet of the points.
  static void find_feet(const Chain& chain, const std::vector<Vector2d>& points, VectorXd& place) {
    for (Index i = 0; i < place.size(); ++i) {
      const double begin = place[i];
      for (int round = 0; round < 4; ++round) {
        const Chain::Node n = chain.at(place[i]);
        const Vector2d tangent(std::cos(n.heading), std::sin(n.heading)),
            off = points[static_cast<std::size_t>(i)] - n.c;
        const double turn = 1.0 - chain.pieces().values[chain.piece(place[i])] * off.dot(across(tangent));
        constexpr double kFarthest = 100.0;  // m
        place[i] = std::clamp(place[i] + off.dot(tangent) / std::max(0.2, turn), begin - kFarthest, begin + kFarthest);
      }
    }
  }

  // Unknowns: shift of the start across the line, heading, curvatures that are not held at 0, inner breaks.
  Index unknowns() const {
    const auto free = std::count(straight_.begin(), straight_.end(), false);
    return 2 + static_cast<Index>(free) + static_cast<Index>(pieces_.breaks.size()) - 2;
  }
  void take(const VectorXd& q) {
    const Vector2d tangent(std::cos(heading_), std::sin(heading_));
    start_ += q[0] * across(tangent);
    heading_ += q[1];
    Index k = 2;
    for (std::size_t j = 0; j < pieces_.values.size(); ++j) {
      if (!straight_[j]) pieces_.values[j] = q[k++];
    }
    for (std::size_t j = 1; j + 1 < pieces_.breaks.size(); ++j) pieces_.breaks[j] = q[k++];
  }

  void derivatives(const Chain& chain, const VectorXd& place, MatrixXd& jacobian) const {
    const Pieces& p = chain.pieces();
    const Vector2d first_tangent(std::cos(heading_), std::sin(heading_)), shift = across(first_tangent);
    jacobian.setZero(place.size(), unknowns());
    std::vector<Vector2d> whole;
    for (std::size_t j = 0; j < p.values.size(); ++j) whole.push_back(chain.integral(j, p.breaks[j + 1] - p.breaks[j]));
    for (Index i = 0; i < place.size(); ++i) {
      const double s = place[i], w = std::sqrt(weight_[i]) / noise_;
      const Chain::Node n = chain.at(s);
      const Vector2d normal = across({std::cos(n.heading), std::sin(n.heading)});
      const auto put = [&](Index k, const Vector2d& motion) { jacobian(i, k) = -w * normal.dot(motion); };
      put(0, shift);
      put(1, across(n.c - chain.node(0).c));
      Index k = 2;
      for (std::size_t j = 0; j < p.values.size(); ++j) {
        if (straight_[j]) continue;
        const double length = p.breaks[j + 1] - p.breaks[j], inside = std::clamp(s - p.breaks[j], 0.0, length);
        if (inside > 0.0) put(k, across(inside * n.c - (inside < length ? chain.integral(j, inside) : whole[j])));
        ++k;
      }
      for (std::size_t j = 1; j + 1 < p.breaks.size(); ++j, ++k) {
        if (s > p.breaks[j]) put(k, (p.values[j - 1] - p.values[j]) * across(n.c - chain.node(j).c));
      }
    }
  }

  void polish() {
    for (int round = 0; round < 2; ++round) {
      const Saved begin = saved();
      VectorXd q = VectorXd::Zero(unknowns());
      Index k = 2;
      for (std::size_t j = 0; j < pieces_.values.size(); ++j) {
        if (!straight_[j]) q[k++] = pieces_.values[j];
      }
      for (std::size_t j = 1; j + 1 < pieces_.breaks.size(); ++j) q[k++] = pieces_.breaks[j];
      const auto evaluate = [&](const VectorXd& trial, VectorXd& r, MatrixXd& jacobian) {
        restore(begin);
        take(trial);
        for (std::size_t j = 1; j < pieces_.breaks.size(); ++j) {
          if (pieces_.breaks[j] - pieces_.breaks[j - 1] < 0.1 * kLeastPiece) return false;
        }
        const Chain chain(start_, heading_, pieces_);
        find_feet(chain, points_, place_);
        r = (residuals(chain).array() * weight_.array().sqrt() / noise_).matrix();
        // The unknowns are those of `begin`.
        const Vector2d moved = start_;
        const double turned = heading_;
        heading_ = begin.heading;
        derivatives(chain, place_, jacobian);
        start_ = moved;
        heading_ = turned;
        return true;
      };
      least_squares(q, evaluate);
      restore(begin);
      take(q);
      const Chain chain(start_, heading_, pieces_);
      find_feet(chain, points_, place_);
      const VectorXd r = residuals(chain);
      cost_ = 0.0;
      for (Index i = 0; i < r.size(); ++i) {  // Huber
        const double off = std::abs(r[i]) / noise_;
        weight_[i] = off > kOutlier ? kOutlier / off : 1.0;
        cost_ += off > kOutlier ? kOutlier * (2.0 * off - kOutlier) : off * off;
      }
    }
  }

  void join(std::size_t j) {  // pieces j and j + 1
    const double a = pieces_.breaks[j + 1] - pieces_.breaks[j], b = pieces_.breaks[j + 2] - pieces_.breaks[j + 1];
    pieces_.values[j] = (pieces_.values[j] * a + pieces_.values[j + 1] * b) / (a + b);
    straight_[j] = straight_[j] && straight_[j + 1];
    if (straight_[j]) pieces_.values[j] = 0.0;
    const auto at = static_cast<std::ptrdiff_t>(j) + 1;
    pieces_.values.erase(pieces_.values.begin() + at);
    straight_.erase(straight_.begin() + at);
    pieces_.breaks.erase(pieces_.breaks.begin() + at);
  }

  /// Pieces that have become too short go, whatever it costs.
  bool remove_short() {
    for (std::size_t j = 0; j < pieces_.values.size() && pieces_.values.size() > 1; ++j) {
      if (pieces_.breaks[j + 1] - pieces_.breaks[j] >= kLeastPiece) continue;
      const auto distance = [&](std::size_t other) { return std::abs(pieces_.values[j] - pieces_.values[other]); };
      const bool back = j + 1 == pieces_.values.size() || (j > 0 && distance(j - 1) < distance(j + 1));
      join(back ? j - 1 : j);
      polish();
      return true;
    }
    return false;
  }

  bool join_some() {
    // Those first that differ least, as far as a track of this length would show it.
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t j = 0; j + 1 < pieces_.values.size(); ++j) {
      const double shorter =
          std::min(pieces_.breaks[j + 1] - pieces_.breaks[j], pieces_.breaks[j + 2] - pieces_.breaks[j + 1]);
      order.emplace_back(std::abs(pieces_.values[j] - pieces_.values[j + 1]) * shorter * shorter, j);
    }
    std::sort(order.begin(), order.end());
    constexpr std::size_t kTried = 4;
    for (std::size_t i = 0; i < order.size() && i < kTried; ++i) {
      const Saved before = saved();
      join(order[i].second);
      polish();
      if (cost_ - before.cost < criterion(kOfABreak)) return true;
      restore(before);
    }
    return false;
  }

  bool straighten_some() {
    for (std::size_t j = 0; j < pieces_.values.size(); ++j) {
      constexpr double kFlat = 1.0 / 3000.0;  // sharper ones are curves
      if (straight_[j] || std::abs(pieces_.values[j]) > kFlat) continue;
      const Saved before = saved();
      straight_[j] = true;
      pieces_.values[j] = 0.0;
      polish();
      if (cost_ - before.cost < criterion(1)) return true;
      restore(before);
    }
    return false;
  }

  const double noise_;
  std::vector<Vector2d> points_;
  VectorXd place_, weight_;
  Vector2d start_ = Vector2d::Zero();
  double heading_ = 0.0, cost_ = 0.0;
  Pieces pieces_;
  std::vector<bool> straight_;  // curvature is held at 0
};

VectorXd headings(const SmoothLine& line) {
  const Index n = line.x.size();
  VectorXd h(n);
  for (Index i = 0; i < n; ++i) {
    const Index a = std::max<Index>(0, i - 1), b = std::min<Index>(n - 1, i + 1);
    h[i] = std::atan2(line.y[b] - line.y[a], line.x[b] - line.x[a]);
    if (i == 0) continue;
    h[i] = h[i - 1] + std::remainder(h[i] - h[i - 1], 2.0 * M_PI);
    if (std::abs(h[i] - h[i - 1]) > 0.5 * M_PI)
      throw std::invalid_argument("the line turns by more than a right angle from one point to the next");
  }
  return h;
}

/// Offsets of the points from a straight line that goes on like the beginning, in the sense of small differences: the
/// second derivative of it is the curvature.
VectorXd unrolled(const std::vector<PlanePoint>& points, const SmoothLine& line, const VectorXd& heading) {
  VectorXd y(line.x.size());
  double sum = 0.0;
  for (Index i = 0; i < y.size(); ++i) {
    if (i > 0) sum += (0.5 * (heading[i] + heading[i - 1]) - heading[0]) * (line.place[i] - line.place[i - 1]);
    const PlanePoint& p = points[static_cast<std::size_t>(i)];
    y[i] = sum + (p.y - line.y[i]) * std::cos(heading[i]) - (p.x - line.x[i]) * std::sin(heading[i]);
  }
  return y;
}

double first_length(double whole, double least) { return std::max(least, whole / static_cast<double>(kPiecesFirst)); }

double noise_across(const std::vector<PlanePoint>& points) {
  const auto n = static_cast<Index>(points.size());
  VectorXd x(n), y(n), s = VectorXd::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const PlanePoint& p = points[static_cast<std::size_t>(i)];
    x[i] = p.x;
    y[i] = p.y;
    if (i > 0) s[i] = s[i - 1] + std::hypot(x[i] - x[i - 1], y[i] - y[i - 1]);
  }
  // The distances between the points are their own measure along the line: what remains is across.
  return std::hypot(noise_of(s, x), noise_of(s, y));
}

/// Standard deviation of the points about a fit: half of them may be outliers.
double spread_of(const VectorXd& offset, std::size_t unknowns) {
  std::vector<double> sizes(offset.begin(), offset.end());
  for (double& size : sizes) size = std::abs(size);
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  constexpr double kNormal = 1.4826;
  const auto n = static_cast<double>(sizes.size());
  return kNormal * *middle * std::sqrt(n / std::max(1.0, n - static_cast<double>(unknowns)));
}

void fit_heights(const std::vector<PlanePoint>& points, const FitOptions& options, TrackFit& fit) {
  std::vector<double> at, z;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].z || (!at.empty() && fit.place[i] <= at.back())) continue;
    at.push_back(fit.place[i]);
    z.push_back(*points[i].z);
  }
  if (at.size() < 2) return;
  const auto n = static_cast<Index>(at.size());
  const Eigen::Map<VectorXd> s(at.data(), n), height(z.data(), n);
  fit.height_noise = std::max(kLeastNoise, options.height_noise ? *options.height_noise : noise_of(s, height));
  const double penalty = kOfABreak * std::log(static_cast<double>(n));
  constexpr double kFine = 50.0;  // m
  VectorXd weight = VectorXd::Constant(n, 1.0 / (fit.height_noise * fit.height_noise)), off;
  for (int round = 0; round < 3; ++round) {  // Huber
    const Pieces p = joined_pieces(s, height, weight, 1, fine_breaks(s, 2, first_length(fit.length(), kFine)), penalty);
    fit.grade.clear();
    for (std::size_t j = 0; j < p.values.size(); ++j) fit.grade.push_back({p.breaks[j], p.breaks[j + 1], p.values[j]});
    fit.height = 0.0;
    off = height;
    for (Index i = 0; i < n; ++i) off[i] -= fit.height_at(s[i]);
    fit.height = (weight.array() * off.array()).sum() / weight.sum();
    off.array() -= fit.height;
    for (Index i = 0; i < n; ++i) {
      const double size = std::abs(off[i]) / fit.height_noise;
      weight[i] = (size > kOutlier ? kOutlier / size : 1.0) / (fit.height_noise * fit.height_noise);
    }
  }
  fit.height_largest = off.cwiseAbs().maxCoeff();
  fit.height_rms = std::sqrt(off.squaredNorm() / static_cast<double>(n));
}

}  // namespace

double TrackFit::largest() const {
  double most = 0.0;
  for (const double r : offset) most = std::max(most, std::abs(r));
  return most;
}

double TrackFit::rms() const {
  double sum = 0.0;
  for (const double r : offset) sum += r * r;
  return std::sqrt(sum / static_cast<double>(offset.size()));
}

TrackFit::Pose TrackFit::at(double s) const {
  Pieces pieces;
  pieces.breaks.push_back(curvature.front().from);
  for (const Piece& p : curvature) {
    pieces.breaks.push_back(p.to);
    pieces.values.push_back(p.value);
  }
  const auto n = Chain({x, y}, heading, pieces).at(s);
  return {n.c.x(), n.c.y(), n.heading};
}

double TrackFit::height_at(double s) const {
  double z = height;
  for (const Piece& p : grade) z += p.value * (std::clamp(s, p.from, p.to) - p.from);
  return z;
}

namespace {

/// The arcs of the line, with the noise of `fit`.
void fit_arcs(const std::vector<PlanePoint>& points, TrackFit& fit) {
  const SmoothLine line = smoothed(points, fit.noise);
  const VectorXd heading = headings(line);
  const VectorXd weight = VectorXd::Constant(line.place.size(), 1.0 / (fit.noise * fit.noise));
  constexpr double kFine = 25.0;  // m
  const double whole = line.place[line.place.size() - 1];
  const Pieces pieces = joined_pieces(line.place, unrolled(points, line, heading), weight, 2,
                                      fine_breaks(line.place, 3, first_length(whole, kFine)),
                                      std::log(static_cast<double>(points.size())));
  ArcFit arcs(points, line.place, fit.noise);
  arcs.begin({line.x[0], line.y[0]}, heading[0], pieces);
  arcs.simplify();
  // The track begins and ends beside the first and the last point.
  Pieces p = arcs.pieces();
  const double first = std::min(arcs.place().minCoeff(), p.breaks[1]);
  const Chain::Node begin = Chain(arcs.start(), arcs.heading(), p).at(first);
  fit.x = begin.c.x();
  fit.y = begin.c.y();
  fit.heading = begin.heading;
  p.breaks.front() = first;
  p.breaks.back() = std::max(arcs.place().maxCoeff(), p.breaks[p.breaks.size() - 2]);
  fit.curvature.clear();
  for (std::size_t j = 0; j < p.values.size(); ++j) {
    if (p.breaks[j] < p.breaks[j + 1])
      fit.curvature.push_back({p.breaks[j] - first, p.breaks[j + 1] - first, p.values[j]});
  }
  const VectorXd offset = arcs.offsets();
  fit.place.assign(arcs.place().begin(), arcs.place().end());
  for (double& place : fit.place) place -= first;
  fit.offset.assign(offset.begin(), offset.end());
  fit.outliers = static_cast<std::size_t>((offset.array().abs() > kOutlier * fit.noise).count());
}

}  // namespace

TrackFit fit_track(const std::vector<PlanePoint>& points, const FitOptions& options) {
  TrackFit fit;
  fit.noise = std::max(kLeastNoise, options.noise ? *options.noise : noise_across(points));
  // The first estimate is too low where points lie so near to one another that noise exchanges them.
  constexpr int kRounds = 4;
  constexpr double kMore = 1.08;
  for (int round = 0; round < kRounds; ++round) {
    fit_arcs(points, fit);
    const Eigen::Map<const VectorXd> offset(fit.offset.data(), static_cast<Index>(fit.offset.size()));
    const double spread = spread_of(offset, 2 * fit.curvature.size() + 1);
    if (options.noise || spread < kMore * fit.noise) break;
    fit.noise = spread;
  }
  fit_heights(points, options, fit);
  return fit;
}

namespace {

/// Pieces of the fit as stretches of a scenario, counted from `origin`; what has no value is left out.
template <class Stretch>
std::vector<Stretch> stretches(const std::vector<Piece>& pieces, double Stretch::*value, double origin) {
  std::vector<Stretch> all;
  for (const Piece& p : pieces) {
    if (p.value == 0.0) continue;
    Stretch s;
    s.start = p.from - origin;
    s.length = p.to - p.from;
    s.*value = p.value;
    all.push_back(s);
  }
  return all;
}

}  // namespace

std::vector<inputs::Curve> curves(const TrackFit& fit, double origin) {
  return stretches(fit.curvature, &inputs::Curve::curvature, origin);
}

std::vector<inputs::GradeSection> grades(const TrackFit& fit, double origin) {
  return stretches(fit.grade, &inputs::GradeSection::grade, origin);
}

}  // namespace train_derail::tracks
