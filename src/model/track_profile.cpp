#include "train_derail/model/track_profile.hpp"

#include <algorithm>
#include <utility>

namespace train_derail::model {

namespace {

/// How much of a stretch of the track counts at s: 1 within it, 0 outside, linear over a run-in about its ends.
double share_at(double start, double length, double s) {
  constexpr double kHalf = 0.5 * TrackProfile::kRunIn;
  const double begin = std::max(start, s - kHalf), end = std::min(start + length, s + kHalf);
  return std::max(end - begin, 0.0) / TrackProfile::kRunIn;
}

}  // namespace

TrackProfile::TrackProfile(const inputs::Scenario& scenario) {
  const inputs::Track& track = scenario.track;
  double from = inputs::kInfinity, to = -inputs::kInfinity;
  const auto reach = [&](double start, double length) {
    from = std::min(from, start - 0.5 * kRunIn - kBin);
    to = std::max(to, start + length + 0.5 * kRunIn + kBin);
  };
  for (const inputs::GradeSection& g : track.grades) reach(g.start, g.length);
  for (const inputs::Curve& c : track.curves)
    if (c.superelevation > 0.0) reach(c.start, c.length);
  if (from > to) return;

  from_ = from;
  const double gauge = 2.0 * scenario.suspension.half_base;
  std::vector<Node> nodes(static_cast<std::size_t>(std::ceil((to - from) / kBin)) + 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Node& n = nodes[i];
    const double s = from + static_cast<double>(i) * kBin;
    for (const inputs::GradeSection& g : track.grades) n.grade += g.grade * share_at(g.start, g.length, s);
    for (const inputs::Curve& c : track.curves) {
      if (s + 0.5 * kBin > c.start && s + 0.5 * kBin < c.start + c.length) n.curvature = c.curvature;
      const double raised = c.superelevation * share_at(c.start, c.length, s);
      n.lift += 0.5 * raised;
      n.tilt += (c.curvature > 0.0 ? -raised : raised) / gauge;
    }
    if (i > 0) n.bed = nodes[i - 1].bed + 0.5 * kBin * (nodes[i - 1].grade + n.grade);
    steepest_ = std::max(steepest_, std::abs(n.grade));
  }
  nodes_ = std::move(nodes);
  const double zero = at(0.0).bed;
  for (Node& n : nodes_) n.bed -= zero;
}

}  // namespace train_derail::model
