#include "import_terrain.hpp"

#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "files.hpp"
#include "import_command.hpp"
#include "import_options.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/tracks/line.hpp"

namespace train_derail::apps {

namespace {

using inputs::InputError;

struct TerrainArguments {
  std::string file, derail_at, system, out = "-", base, along = "300 m", across = "100 m", spacing = "5 m";
  std::optional<std::string> heading;
  bool force = false;
};

/// Rows of heights above the top of the rails at the point of derailment, from right to left.
struct Heights {
  double x_from, y_from, spacing;
  std::vector<std::vector<double>> rows;
};

/// The direction of travel, clockwise from north [rad].
double heading_of(const TerrainArguments& a, const inputs::Scenario& base) {
  if (!a.heading) {
    if (base.track.heading) return *base.track.heading;
    throw InputError(a.base, "track.heading", "", "missing: the map cannot be laid beside the track",
                     "a compass direction, as in \"75 deg\", in the file or as --heading");
  }
  try {
    return inputs::to_si(*a.heading, "rad");
  } catch (const std::invalid_argument& e) {
    throw InputError("command line", "--heading", *a.heading, e.what(), "a compass direction, as in \"75 deg\"");
  }
}

Heights heights_of(const TerrainArguments& a, const inputs::Scenario& base) {
  const auto place = place_of(a.derail_at);
  if (!place)
    throw InputError("command line", "--derail-at", a.derail_at, "not a place",
                     "longitude,latitude in degrees, as in \"-80.52,40.83\"");
  const double spacing = length_of("--spacing", a.spacing, 0.1);
  const auto steps = [spacing](const char* option, const std::string& text) {
    const double count = std::ceil(length_of(option, text, spacing) / spacing);
    constexpr double kStepsMax = 100.0;
    if (count > kStepsMax)
      throw InputError("command line", option, text, fmt::format("{:.0f} times --spacing", count),
                       fmt::format("at most {:.0f} times", kStepsMax));
    return static_cast<int>(count);
  };
  const int along = steps("--along", a.along), across = steps("--across", a.across);
  const double heading = heading_of(a, base), east = std::sin(heading), north = std::cos(heading);
  std::vector<tracks::PlanePoint> points{{0.0, 0.0, {}}};
  for (int i = -along; i <= along; ++i) {
    for (int j = -across; j <= across; ++j) {
      const double x = i * spacing, y = j * spacing;
      points.push_back({x * east - y * north, x * north + y * east, {}});
    }
  }
  const std::vector<std::pair<double, double>> places = tracks::Plane(place->first, place->second).on_globe(points);
  const std::vector<double> heights = tracks::read_heights(a.file, a.system, places);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (!std::isfinite(heights[i]))
      throw InputError(a.file, "", "",
                       fmt::format("no height at longitude {:.6f}, latitude {:.6f}", places[i].first, places[i].second),
                       "a map of all within --along and --across of the point of derailment");
  }
  Heights result{-along * spacing, -across * spacing, spacing, {}};
  std::size_t next = 1;
  for (int i = -along; i <= along; ++i) {
    std::vector<double>& row = result.rows.emplace_back();
    for (int j = -across; j <= across; ++j) row.push_back(heights[next++] - heights.front() - base.terrain.rail_height);
  }
  return result;
}

/// What the base says of the ground, and the grid says instead; "" if it says nothing.
std::string left_out(const inputs::Terrain& base) {
  std::vector<std::string> all;
  for (const auto& [key, height] :
       {std::pair("terrain.bank_left", base.bank_left), {"terrain.bank_right", base.bank_right}})
    if (height != 0.0) all.push_back(fmt::format("{} ({:.3g} m)", key, height));
  if (!base.sections.empty()) all.push_back(fmt::format("terrain.sections ({})", base.sections.size()));
  if (!base.grid.rows.empty()) all.push_back(fmt::format("terrain.grid ({} rows)", base.grid.rows.size()));
  return fmt::format("{}", fmt::join(all, ", "));
}

int import_terrain(const TerrainArguments& a) {
  require_apart({{"MAP", a.file}, {"--base", a.base}}, {{"--out", a.out}});
  const inputs::Scenario base = inputs::read_scenario_file(a.base);
  if (inputs::model_of(base) != inputs::Model::spatial)
    throw InputError(a.base, "model", "", "the planar models have no terrain", "model: spatial");
  files::OutputFile out(a.out, existing(a.force));
  const Heights heights = heights_of(a, base);
  std::vector<std::string> assumed{
      fmt::format("point of derailment: longitude,latitude {}", a.derail_at),
      "the map's height there is that of the top of the ballast",
      "within the crown the roadbed is as terrain and track say; beyond it, over terrain.grid.seam, it becomes the map",
      "beyond the grid the ground is as at its edge",
      "plane: transverse Mercator about the point of derailment, WGS 84; heights between cells are bilinear"};
  if (const std::string without = left_out(base.terrain); !without.empty())
    assumed.push_back(fmt::format("the map takes the place of what the base says there: {}", without));
  std::ostream& s = out.stream();
  s << fmt::format("# From {} by `derail import terrain`.\n#\n# Assumed:\n", files::printable(a.file));
  for (const std::string& line : assumed) s << "# - " << line << "\n";
  s << fmt::format("\nbase: \"{}\"\n\ntrack:\n  heading: {:.6g} deg\n", seen_from(a.out, a.base),
                   heading_of(a, base) / inputs::kDegree);
  s << fmt::format("\nterrain:\n  bank_left: 0 m\n  bank_right: 0 m\n  sections: []\n  grid:\n    spacing: {:g} m\n",
                   heights.spacing)
    << fmt::format("    x_from: {:g} m\n    y_from: {:g} m\n    rows:\n", heights.x_from, heights.y_from);
  for (const std::vector<double>& row : heights.rows) {
    s << "      - heights: \"";
    for (std::size_t j = 0; j < row.size(); ++j) s << fmt::format("{}{:.2f}", j == 0 ? "" : " ", row[j]);
    s << "\"\n";
  }
  out.commit();
  say_assumptions("assumed, as the comments in the file say:", assumed);
  return 0;
}

}  // namespace

void add_import_terrain(CLI::App* import, std::function<int()>& chosen) {
  auto a = std::make_shared<TerrainArguments>();
  CLI::App* command = import->add_subcommand(
      "terrain", "A map of heights (docs/import.md) becomes the ground beside the track; model: spatial");
  add_path(command, "MAP", a->file, "ESRI ASCII (.asc) or GeoTIFF (.tif)")->required();
  add_path(command, "--base", a->base, "Scenario for all but the ground, as config/accident3d.yaml")->required();
  command->add_option("--derail-at", a->derail_at, "Point of derailment: \"longitude,latitude\" in degrees")
      ->required();
  command->add_option("--heading", a->heading,
                      "Direction of travel there, clockwise from north; default: track.heading of the scenario");
  command->add_option("--system", a->system,
                      "The map's system of coordinates, as in EPSG:32614; default: the one it names");
  command->add_option("--along", a->along, "How far behind and ahead of the point; default: 300 m");
  command->add_option("--across", a->across, "How far to the right and left of it; default: 100 m");
  command->add_option("--spacing", a->spacing, "Between heights; default: 5 m");
  add_path(command, "-o,--out", a->out, "Scenario to be written; default: standard output");
  add_force(command, a->force);
  command->callback([a, &chosen] { chosen = [a] { return import_terrain(*a); }; });
}

}  // namespace train_derail::apps
