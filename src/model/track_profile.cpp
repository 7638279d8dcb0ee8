#include "train_derail/model/track_profile.hpp"

#include <algorithm>
#include <utility>

namespace train_derail::model {

namespace {

/// From 0 to 1 about `place`, linear over `run_in`.
double ramp(double s, double place, double run_in) { return std::clamp((s - place) / run_in + 0.5, 0.0, 1.0); }

/// How much of a stretch of the track counts at s.
double share_at(const inputs::GradeSection& g, double s) {
  return ramp(s, g.start, TrackProfile::kRunIn) - ramp(s, g.start + g.length, TrackProfile::kRunIn);
}

/// An arc with the lengths over which its superelevation runs in and out: short enough for the middle of the arc to
/// have all of it, and the same for two arcs where they meet.
struct RaisedArc {
  inputs::Curve arc;
  double in, out;
  double share_at(double s) const { return ramp(s, arc.start, in) - ramp(s, arc.start + arc.length, out); }
};
std::vector<RaisedArc> raised(const std::vector<inputs::Curve>& curves) {
  std::vector<RaisedArc> all;
  for (const inputs::Curve& c : curves) {
    const double own = std::min(TrackProfile::kRunIn, 0.75 * c.length);
    RaisedArc arc{c, own, own};
    if (!all.empty() && c.start - (all.back().arc.start + all.back().arc.length) < 0.01)
      arc.in = all.back().out = std::min(all.back().out, own);
    all.push_back(arc);
  }
  return all;
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
  const std::vector<RaisedArc> arcs = raised(track.curves);
  std::vector<Node> nodes(static_cast<std::size_t>(std::ceil((to - from) / kBin)) + 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Node& n = nodes[i];
    const double s = from + static_cast<double>(i) * kBin;
    for (const inputs::GradeSection& g : track.grades) n.grade += g.grade * share_at(g, s);
    for (const RaisedArc& a : arcs) {
      const inputs::Curve& c = a.arc;
      if (s + 0.5 * kBin > c.start && s + 0.5 * kBin < c.start + c.length) n.curvature = c.curvature;
      const double raised = c.superelevation * a.share_at(s);
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
