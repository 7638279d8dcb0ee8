#include "train_derail/tracks/scenario.hpp"

#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "train_derail/files/text.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail::tracks {

namespace {

constexpr double kStep = 1.0;  // m, between places that are looked at

/// Start and length of a piece in whole millimetres. In the file a piece must not reach into the next one, not even by
/// the rounding of start + length.
struct Written {
  std::string start, length;
};
Written written(double start, double length) {
  constexpr double kMillimetre = 1e-3;
  const double end = std::round((start + length) / kMillimetre) * kMillimetre;
  const std::string from = fmt::format("{:.3f}", start), to = fmt::format("{:.3f}", end);
  std::string size = fmt::format("{:.3f}", std::stod(to) - std::stod(from));
  if (std::stod(from) + std::stod(size) > std::stod(to)) size = fmt::format("{:.3f}", std::stod(size) - kMillimetre);
  return {from, size};
}

std::string curve_text(const inputs::Curve& c) {
  const Written w = written(c.start, c.length);
  constexpr double kChord = 100.0 * inputs::kFoot;  // degrees of curve: turn over a chord of 100 ft
  return fmt::format("    - {{start: {}, length: {}, curvature: {:.6g}}}  # {}, radius {:.0f} m, {:.2f} deg\n", w.start,
                     w.length, c.curvature, c.curvature > 0.0 ? "left" : "right", 1.0 / std::abs(c.curvature),
                     2.0 * std::asin(0.5 * kChord * std::abs(c.curvature)) / inputs::kDegree);
}

std::string grade_text(const inputs::GradeSection& g) {
  const Written w = written(g.start, g.length);
  return fmt::format("    - {{start: {}, length: {}, grade: {:.5g}}}  # {:.2f} %\n", w.start, w.length, g.grade,
                     100.0 * g.grade);
}

}  // namespace

double nearest_place(const TrackFit& fit, double x, double y) {
  const auto distance = [&](double s) {
    const TrackFit::Pose p = fit.at(s);
    return std::hypot(p.x - x, p.y - y);
  };
  double best = fit.curvature.front().from;
  for (double s = best; s < fit.length(); s += kStep) {
    if (distance(s) < distance(best)) best = s;
  }
  for (int round = 0; round < 5; ++round) {
    const TrackFit::Pose p = fit.at(best);
    best += (x - p.x) * std::cos(p.heading) + (y - p.y) * std::sin(p.heading);
  }
  return best;
}

double compass(const TrackFit& fit, double place) {
  constexpr double kTurn = 2.0 * M_PI;
  const double heading = std::fmod(0.5 * M_PI - fit.at(place).heading, kTurn);
  return heading < 0.0 ? heading + kTurn : heading;
}

std::string to_scenario(const FittedLine& line, const std::string& base) {
  const std::string name = std::filesystem::path(line.source).filename().string();
  std::string out =
      fmt::format("# From {} by `derail import track`.\n#\n# Assumed, and how well it fits:\n", files::printable(name));
  for (const std::string& a : line.assumptions) out += "# - " + files::printable(a) + "\n";
  if (!base.empty()) out += "\nbase: " + inputs::yaml_text(base) + "\n";
  out += fmt::format("\ntrack:\n  heading: {:.2f} deg\n", compass(line.fit, line.origin) / inputs::kDegree);
  const auto curves = tracks::curves(line.fit, line.origin);
  const auto grades = tracks::grades(line.fit, line.origin);
  out += curves.empty() ? "  curves: []\n" : "  curves:\n";
  for (const inputs::Curve& c : curves) out += curve_text(c);
  if (!grades.empty()) out += "  grades:\n";
  for (const inputs::GradeSection& g : grades) out += grade_text(g);
  return out;
}

std::string to_json(const FittedLine& line) {
  const TrackFit& fit = line.fit;
  nlohmann::json j;
  j["source"] = std::filesystem::path(line.source).filename().string();
  j["largest"] = fit.largest();
  j["rms"] = fit.rms();
  j["noise"] = fit.noise;
  auto& points = j["points"] = {{"place", nlohmann::json::array()},
                                {"x", nlohmann::json::array()},
                                {"y", nlohmann::json::array()},
                                {"z", nlohmann::json::array()},
                                {"offset", nlohmann::json::array()}};
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    points["place"].push_back(fit.place[i] - line.origin);
    points["x"].push_back(line.points[i].x);
    points["y"].push_back(line.points[i].y);
    points["z"].push_back(line.points[i].z ? nlohmann::json(*line.points[i].z) : nlohmann::json());
    points["offset"].push_back(fit.offset[i]);
  }
  auto& track = j["track"] = {{"place", nlohmann::json::array()},
                              {"x", nlohmann::json::array()},
                              {"y", nlohmann::json::array()},
                              {"z", nlohmann::json::array()}};
  for (double s = 0.0; s <= fit.length(); s += 5.0 * kStep) {
    const TrackFit::Pose p = fit.at(s);
    track["place"].push_back(s - line.origin);
    track["x"].push_back(p.x);
    track["y"].push_back(p.y);
    track["z"].push_back(fit.height_at(s));
  }
  const auto pieces = [&](const std::vector<Piece>& all) {
    nlohmann::json list = nlohmann::json::array();
    for (const Piece& p : all) list.push_back({p.from - line.origin, p.to - line.origin, p.value});
    return list;
  };
  j["curvature"] = pieces(fit.curvature);
  j["grade"] = pieces(fit.grade);
  return j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace train_derail::tracks
