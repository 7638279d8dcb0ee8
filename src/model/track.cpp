#include "train_derail/model/track.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

namespace train_derail::model {

namespace {

/// Direction of the centre line: its heading is the integral of the curvature from the point of derailment.
class Direction {
 public:
  explicit Direction(const std::vector<inputs::Curve>& curves) : curves_(curves) {
    for (const inputs::Curve& c : curves) at_pod_.push_back(turned(c, 0.0));
  }

  /// At arc length s [m]. Most of a track is straight: sine and cosine are those of the place before, if the heading
  /// is.
  const Vector2& at(double s) {
    double angle = 0.0;
    for (std::size_t i = 0; i < curves_.size(); ++i) angle += turned(curves_[i], s) - at_pod_[i];
    if (angle != angle_) {
      angle_ = angle;
      direction_ = {std::cos(angle), std::sin(angle)};
    }
    return direction_;
  }

 private:
  static double turned(const inputs::Curve& c, double s) {
    return c.curvature * std::clamp(s - c.start, 0.0, c.length);
  }

  const std::vector<inputs::Curve>& curves_;
  std::vector<double> at_pod_;
  double angle_ = 0.0;
  Vector2 direction_{1.0, 0.0};
};

}  // namespace

Track::Track(const inputs::Scenario& scenario, double s_min, double s_max) {
  for (const inputs::Curve& c : scenario.track.curves) {
    s_min = std::min(s_min, c.start - 2.0 * kBin);
    s_max = std::max(s_max, c.start + c.length + 2.0 * kBin);
  }
  s_min_ = s_min;
  const auto bins = static_cast<std::size_t>(std::ceil((s_max - s_min) / kBin)) + 2;
  if (scenario.rails.torn_length > 0.0) {
    torn_per_length_ = 1.0 / scenario.rails.torn_length;
    // A bin begins at the point of derailment: what leaves the rails there does not tear up the track before it.
    torn_behind_ = std::ceil(-s_min * torn_per_length_);
    torn_.assign(static_cast<std::size_t>(torn_bins().bin(s_max)) + 1, 0.0);
  }

  const inputs::Perturbation& p = scenario.initial.perturbation;
  if (p.alignment > 0.0) {
    // Independent deviations every 20 ft (kBinsPerKnot), with a cosine between them: wheels feel no steps.
    boost::random::mt19937_64 generator(static_cast<std::uint64_t>(p.seed) ^ 0xa11941e47ULL);
    boost::random::normal_distribution<double> normal(0.0, p.alignment);
    alignment_.resize(bins);
    last_bin_ = static_cast<double>(bins - 2);
    std::array<double, kBinsPerKnot> share{};
    for (std::size_t i = 0; i < kBinsPerKnot; ++i)
      share[i] = 0.5 - 0.5 * std::cos(M_PI * static_cast<double>(i) / kBinsPerKnot);
    double from = normal(generator), to = normal(generator);
    for (std::size_t i = 0; i < bins; ++i) {
      if (i > 0 && i % kBinsPerKnot == 0) {
        from = to;
        to = normal(generator);
      }
      alignment_[i] = from + share[i % kBinsPerKnot] * (to - from);
    }
  }

  std::map<double, double> kinks;
  for (const inputs::Curve& c : scenario.track.curves) {
    kinks[c.start] += c.curvature;
    kinks[c.start + c.length] -= c.curvature;
  }
  kinks_.assign(kinks.begin(), kinks.end());

  if (!scenario.track.curves.empty()) {
    nodes_.resize(bins);
    const auto s_of = [&](std::size_t i) { return s_min + static_cast<double>(i) * kBin; };
    Direction direction(scenario.track.curves);
    // Steps of a bin along the heading in its middle: second order, 3 mm in 100 m at the sharpest curve allowed.
    Vector2 point(0.0, 0.0);
    for (std::size_t i = 0; i < bins; ++i) {
      nodes_[i] = {point, direction.at(s_of(i))};
      point += kBin * direction.at(s_of(i) + 0.5 * kBin);
    }
    // The origin is at s = 0.
    const Node zero = at(0.0);
    for (Node& n : nodes_) n.point -= zero.point;
  }
}

Track::Node Track::at(double s) const {
  if (straight()) return {{s, 0.0}, {1.0, 0.0}};
  const double b = std::clamp((s - s_min_) / kBin, 0.0, static_cast<double>(nodes_.size() - 2));
  const auto i = static_cast<std::size_t>(b);
  const double share = b - static_cast<double>(i), beyond = s - (s_min_ + b * kBin);
  const Node &a = nodes_[i], &c = nodes_[i + 1];
  const Vector2 tangent = (a.tangent + share * (c.tangent - a.tangent)).normalized();
  // Between two nodes an arc bulges from its chord, against the way it turns.
  const Vector2 bulge = -0.5 * share * (1.0 - share) * kBin * (c.tangent - a.tangent);
  return {a.point + share * (c.point - a.point) + bulge + beyond * tangent, tangent};
}

double Track::nearest(const Vector2& p) const {
  if (straight()) return p.x();
  const auto squared = [&](std::size_t i) { return (nodes_[i].point - p).squaredNorm(); };
  constexpr std::size_t kCoarse = 32;  // nodes between those that are looked at first
  std::size_t found = 0;
  for (std::size_t i = kCoarse; i < nodes_.size(); i += kCoarse) {
    if (squared(i) < squared(found)) found = i;
  }
  // The first of those that are nearest. From one node to the next the distance changes by kBin at most, so that those
  // which cannot be nearer need no look.
  for (std::size_t i = 0; i < nodes_.size();) {
    const double now = squared(i), least = squared(found);
    if (now < least || (now == least && i < found)) found = i;
    const double excess = std::sqrt(now) - std::sqrt(least);
    i += static_cast<std::size_t>(std::max(1.0, excess * (1.0 - 1e-9) / kBin));
  }
  return foot(p, s_min_ + kBin * static_cast<double>(found));
}

double Track::foot(const Vector2& p, double s) const {
  if (straight()) return p.x();
  // Each pass takes the error to that times offset / radius.
  for (int i = 0; i < 20; ++i) {
    const Node n = at(s);
    const double ahead = (p - n.point).dot(n.tangent);
    s += ahead;
    if (std::abs(ahead) < 1e-6) break;
  }
  return s;
}

Track::Deviation Track::deviation(double s) const {
  if (aligned()) return {0.0, 0.0, 0.0};
  // Half a wave of the deviations is kBinsPerKnot bins: differences over half of that are so much too small.
  constexpr double kReach = 0.5 * kBinsPerKnot * kBin, kSmoothed = 0.125 * M_PI * M_PI;
  const double here = alignment(s), ahead = alignment(s + kReach), behind = alignment(s - kReach);
  return {here, 0.25 * M_PI * (ahead - behind) / kReach, kSmoothed * (ahead - 2.0 * here + behind) / (kReach * kReach)};
}

bool Track::kinks_between(double from, double to, double bend) const {
  const auto begin = std::lower_bound(kinks_.begin(), kinks_.end(), std::pair(from, -inputs::kInfinity));
  return std::any_of(begin, kinks_.end(),
                     [&](const auto& kink) { return kink.first < to && std::abs(kink.second) > bend; });
}

void Track::tear(double s) {
  const double b = torn_bins().bin(s);
  if (!(b >= 0.0 && b < static_cast<double>(torn_.size()))) return;
  torn_[static_cast<std::size_t>(b)] = 1.0;
  torn_from_ = std::min(torn_from_, s - 1.0 / torn_per_length_);
  torn_to_ = std::max(torn_to_, s + 1.0 / torn_per_length_);
}

void Track::walk(files::Archive& archive) {
  // Counted from the point of derailment: how far a track is known depends on the inputs.
  std::vector<std::int64_t> bins;
  const auto behind = static_cast<std::int64_t>(torn_behind_);
  for (std::size_t i = 0; i < torn_.size(); ++i) {
    if (torn_[i] > 0.0) bins.push_back(static_cast<std::int64_t>(i) - behind);
  }
  archive.list("torn", bins, [&](std::int64_t& bin) { archive.value("bin", bin); });
  std::fill(torn_.begin(), torn_.end(), 0.0);
  for (const std::int64_t bin : bins) {
    const std::int64_t i = bin + behind;
    if (i >= 0 && i < static_cast<std::int64_t>(torn_.size())) torn_[static_cast<std::size_t>(i)] = 1.0;
  }
  archive.value("torn_from", torn_from_);
  archive.value("torn_to", torn_to_);
}

}  // namespace train_derail::model
