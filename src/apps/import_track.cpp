#include "import_track.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

#include <fmt/format.h>

#include "files.hpp"
#include "import_command.hpp"
#include "import_options.hpp"
#include "page.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/tracks/line.hpp"
#include "train_derail/tracks/scenario.hpp"

namespace train_derail::apps {

namespace {

using inputs::InputError;
using tracks::LinePoint;

constexpr const char* kPlotScript = "plot_track.py";
constexpr double kFarFromLine = 50.0;  // m, of a place that is to be on it
constexpr double kGap = 5000.0;        // m, between neighbouring points

struct TrackArguments {
  std::string file, derail_at, out = "-", within = "5 km", bound = "10 m";
  std::optional<std::string> base, noise, elevation_noise, plot;
  bool backward = false, force = false;
};

std::optional<double> noise_of(const char* option, const std::optional<std::string>& text) {
  return text ? std::optional(length_of(option, *text, 0.0)) : std::nullopt;
}

/// The points in a plane, in their order, with their distances along the line.
struct FlatLine {
  std::vector<tracks::PlanePoint> points;
  std::vector<double> along;
};
FlatLine flattened(const std::vector<LinePoint>& points, double longitude, double latitude) {
  FlatLine flat{tracks::Plane(longitude, latitude).flat(points), {0.0}};
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double step = std::hypot(flat.points[i].x - flat.points[i - 1].x, flat.points[i].y - flat.points[i - 1].y);
    if (!(step <= kGap))
      throw InputError(points[i].where, "", "", fmt::format("{:.1f} km from the point before", step / 1e3),
                       fmt::format("at most {:g} km; longitude comes before latitude", kGap / 1e3));
    flat.along.push_back(flat.along.back() + step);
  }
  return flat;
}

/// Where the point of derailment is: longitude and latitude.
std::pair<double, double> point_of_derailment(const TrackArguments& a, const std::vector<LinePoint>& points) {
  if (const auto place = place_of(a.derail_at)) return *place;
  const double distance = length_of("--derail-at", a.derail_at, 0.0);
  // In a plane that touches the globe in the middle, then in one that touches it there.
  std::pair<double, double> found(points[points.size() / 2].longitude, points[points.size() / 2].latitude);
  for (int round = 0; round < 2; ++round) {
    const tracks::Plane plane(found.first, found.second);
    const FlatLine flat = flattened(points, found.first, found.second);
    if (distance > flat.along.back())
      throw InputError(
          "command line", "--derail-at", a.derail_at, "beyond the end of the line",
          fmt::format("[0, {:.0f}] m from the first point of the file, or longitude,latitude", flat.along.back()));
    const auto after = std::max<std::ptrdiff_t>(
        1, std::lower_bound(flat.along.begin(), flat.along.end(), distance) - flat.along.begin());
    const auto i = static_cast<std::size_t>(after);
    const double share = (distance - flat.along[i - 1]) / (flat.along[i] - flat.along[i - 1]);
    const tracks::PlanePoint &p = flat.points[i - 1], &q = flat.points[i];
    found = plane.on_globe(p.x + share * (q.x - p.x), p.y + share * (q.y - p.y));
  }
  return found;
}

/// Distance of the origin of the plane from the line, and how far along it is.
std::pair<double, double> nearest(const FlatLine& flat) {
  std::pair<double, double> best(1e30, 0.0);
  for (std::size_t i = 1; i < flat.points.size(); ++i) {
    const tracks::PlanePoint &p = flat.points[i - 1], &q = flat.points[i];
    const double length = flat.along[i] - flat.along[i - 1];
    const double share = std::clamp(-(p.x * (q.x - p.x) + p.y * (q.y - p.y)) / (length * length), 0.0, 1.0);
    const double distance = std::hypot(p.x + share * (q.x - p.x), p.y + share * (q.y - p.y));
    if (distance < best.first) best = {distance, flat.along[i - 1] + share * length};
  }
  return best;
}

/// Refuses what no scenario has, by the row of the nearest point.
void check_pieces(const std::vector<tracks::Piece>& pieces, const tracks::TrackFit& fit,
                  const std::vector<LinePoint>& points, const char* what, double most, const std::string& allowed) {
  for (const tracks::Piece& p : pieces) {
    if (std::abs(p.value) <= most) continue;
    const auto after = std::lower_bound(fit.place.begin(), fit.place.end(), 0.5 * (p.from + p.to));
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(after - fit.place.begin()), points.size() - 1);
    throw InputError(points[i].where, what, fmt::format("{:.4g}", p.value),
                     "no railroad: is the line noisy, or its points not in order? --noise", allowed);
  }
}

void say_fit(const TrackArguments& a, const tracks::TrackFit& fit, std::vector<std::string>& said) {
  said.push_back(fmt::format(
      "points are off the track by {:.2g} m (standard deviation, {}): of all tracks that fit so well, one of few arcs",
      fit.noise, a.noise ? "--noise" : "estimated"));
  said.push_back(fmt::format("distance of the points from the track: largest {:.2f} m, rms {:.2f} m (--bound {})",
                             fit.largest(), fit.rms(), a.bound));
  if (fit.outliers > 0)
    said.push_back(fmt::format("points that are off by more than three times that, and count less: {}", fit.outliers));
  said.emplace_back("spirals: steps of constant curvature");
  if (fit.grade.empty()) {
    said.emplace_back("no elevations: the track is level");
  } else {
    said.push_back(fmt::format(
        "elevations are off by {:.2g} m ({}); distance from the grades: largest {:.2f} m, rms {:.2f} m",
        fit.height_noise, a.elevation_noise ? "--elevation-noise" : "estimated", fit.height_largest, fit.height_rms));
    said.emplace_back("grades act with model: spatial");
  }
  said.emplace_back("superelevation: none, since a line does not say it");
  said.emplace_back("straight and level beyond the ends of the line");
  said.emplace_back("curves act with ground.on_track_law: rails");
}

tracks::FittedLine fitted(const TrackArguments& a) {
  const double within = length_of("--within", a.within, 100.0), bound = length_of("--bound", a.bound, 0.0);
  tracks::FitOptions options;
  options.noise = noise_of("--noise", a.noise);
  options.height_noise = noise_of("--elevation-noise", a.elevation_noise);
  tracks::Line line = tracks::read_line(a.file);
  const auto [longitude, latitude] = point_of_derailment(a, line.points);
  if (a.backward) std::reverse(line.points.begin(), line.points.end());
  const FlatLine flat = flattened(line.points, longitude, latitude);
  const auto [distance, along] = nearest(flat);
  if (distance > kFarFromLine)
    throw InputError("command line", "--derail-at", a.derail_at, fmt::format("{:.0f} m from the line", distance),
                     fmt::format("at most {:.0f} m", kFarFromLine));

  tracks::FittedLine result;
  result.source = a.file;
  result.assumptions = line.assumptions;
  std::vector<LinePoint> used;
  for (std::size_t i = 0; i < line.points.size(); ++i) {
    if (std::abs(flat.along[i] - along) > within) continue;
    result.points.push_back(flat.points[i]);
    used.push_back(line.points[i]);
  }
  constexpr std::size_t kLeast = 4;
  if (used.size() < kLeast)
    throw InputError("command line", "--within", a.within,
                     fmt::format("{} points so near to the point of derailment", used.size()), "at least 4 of them");
  result.assumptions.push_back(
      fmt::format("{} of {} points: those up to {} before and behind the point of derailment (--within)", used.size(),
                  line.points.size(), a.within));
  result.assumptions.push_back(
      fmt::format("point of derailment: longitude {:.6f}, latitude {:.6f}", longitude, latitude));
  result.assumptions.push_back(a.backward ? "the train goes from the last point to the first (--backward)"
                                          : "the train goes from the first point to the last");
  result.assumptions.emplace_back("plane: transverse Mercator about the point of derailment, WGS 84");
  try {
    result.fit = tracks::fit_track(result.points, options);
  } catch (const std::invalid_argument& e) {
    throw InputError(a.file, "", "", e.what(), "points in their order along a track");
  }
  const tracks::TrackFit& fit = result.fit;
  const auto worst = std::max_element(fit.offset.begin(), fit.offset.end(),
                                      [](double p, double q) { return std::abs(p) < std::abs(q); });
  if (fit.largest() > bound)
    throw InputError(used[static_cast<std::size_t>(worst - fit.offset.begin())].where, "", "",
                     fmt::format("{:.1f} m from the fitted track", fit.largest()),
                     fmt::format("at most {} (--bound)", a.bound));
  check_pieces(fit.curvature, fit, used, "curvature", 0.02, "[-0.02, 0.02] 1/m");
  check_pieces(fit.grade, fit, used, "grade", 0.1, "[-0.1, 0.1]");
  result.origin = tracks::nearest_place(fit, 0.0, 0.0);
  say_fit(a, fit, result.assumptions);
  return result;
}

int import_track(const TrackArguments& a) {
  std::vector<NamedPath> read{{"LINE", a.file}}, write{{"--out", a.out}};
  if (a.base) read.push_back({"--base", *a.base});
  if (a.plot) write.push_back({"--plot", *a.plot});
  require_apart(read, write);
  files::OutputFile out(a.out, existing(a.force));
  std::optional<files::OutputFile> plot;
  if (a.plot) {
    plot.emplace(*a.plot, existing(a.force), nullptr, files::Compression::never);
    run_script(kPlotScript, {"--check"}, "");
  }
  const tracks::FittedLine line = fitted(a);
  out.stream() << tracks::to_scenario(line, a.base ? seen_from(a.out, *a.base) : "");
  out.commit();
  if (plot) {
    plot->stream() << run_script(kPlotScript, {}, tracks::to_json(line));
    plot->commit();
  }
  say_assumptions("assumed, as the comments in the file say:", line.assumptions);
  return 0;
}

}  // namespace

void add_import_track(CLI::App* import, std::function<int()>& chosen) {
  auto a = std::make_shared<TrackArguments>();
  CLI::App* command =
      import->add_subcommand("track", "A line of points (docs/import.md) becomes curves and grades of a track");
  add_path(command, "LINE", a->file, "GeoJSON, KML, GPX, or CSV with longitude, latitude and elevation")->required();
  command
      ->add_option("--derail-at", a->derail_at,
                   "Point of derailment: \"longitude,latitude\" in degrees, or a distance from the first point of the "
                   "file, as in \"3.2 km\"")
      ->required();
  command->add_flag("--backward", a->backward, "The train goes from the last point of the file to the first");
  add_path(command, "-o,--out", a->out, "Scenario to be written; default: standard output");
  add_path(command, "--base", a->base, "Scenario for all but the track, as config/accident3d.yaml");
  command->add_option("--within", a->within,
                      "Only points up to this far before and behind the point of derailment; default: 5 km");
  command->add_option(
      "--noise", a->noise,
      "How far points are off the track (standard deviation), as in \"2 m\"; default: estimated from them");
  command->add_option("--elevation-noise", a->elevation_noise, "The same of elevations");
  command->add_option("--bound", a->bound, "A point farther from the fitted track is an error; default: 10 m");
  add_path(command, "--plot", a->plot, "Picture (PNG) of the points against the track, curvature, grade");
  add_force(command, a->force);
  command->callback([a, &chosen] { chosen = [a] { return import_track(*a); }; });
}

}  // namespace train_derail::apps
