#include "train_derail/tracks/line.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include <fmt/ranges.h>

#include "tracks/geo_module.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::tracks {

namespace {

using inputs::InputError;

constexpr std::size_t kBytesMax = 20'000'000;

template <class Function>
Function load(const char* name) {
  // The module is never unloaded: its objects live until the process ends.
  void* module = dlopen(kGeoModule, RTLD_NOW | RTLD_LOCAL);
  void* pointer = module == nullptr ? nullptr : dlsym(module, name);
  if (pointer == nullptr) {
    throw std::runtime_error(std::string("tracks cannot be read: ") + dlerror() +
                             "; a build can if GDAL is installed (Debian: libgdal-dev) and TRAIN_DERAIL_GDAL is ON");
  }
  return *static_cast<Function*>(pointer);
}

struct ColumnNames {
  const char* name;
  std::vector<const char*> also;
};
enum Column { kLongitude, kLatitude, kElevation, kColumns };
const std::array<ColumnNames, kColumns> kNames{{{"longitude", {"lon", "long", "lng"}},
                                                {"latitude", {"lat"}},
                                                {"elevation", {"elev", "ele", "altitude", "alt", "height"}}}};

bool names(const std::string& bare, const ColumnNames& column) {
  return bare == column.name ||
         std::any_of(column.also.begin(), column.also.end(), [&](const char* a) { return bare == a; });
}

/// A table with a row for each point.
class TableReader {
 public:
  explicit TableReader(const std::string& path) : path_(path), table_(path) {}

  Line read() {
    find_columns();
    Line line;
    std::size_t without = 0;
    for (std::vector<std::string> row; table_.next(row);) {
      LinePoint p;
      p.where = fmt::format("{}:{}", path_, table_.line());
      p.longitude = table_.number(row, *column_[kLongitude]);
      p.latitude = table_.number(row, *column_[kLatitude]);
      if (column_[kElevation]) {
        if (files::trimmed(row[*column_[kElevation]]).empty()) ++without;
        else p.elevation = table_.number(row, *column_[kElevation]) * metres_;
      }
      line.points.push_back(std::move(p));
      if (line.points.size() > kPointsMax)
        throw InputError(path_, "", "", "too many points", fmt::format("at most {}", kPointsMax));
    }
    if (without > 0)
      line.assumptions.push_back(fmt::format("{} points have no elevation: fitted without them", without));
    if (!unused_.empty())
      line.assumptions.push_back(fmt::format("columns that are not used: {}", fmt::join(unused_, ", ")));
    return line;
  }

 private:
  void find_columns() {
    for (std::size_t i = 0; i < table_.names().size(); ++i) {
      const std::string& header = table_.names()[i];
      std::string bare = inputs::bare_name(header);
      std::optional<Column> found;
      double metres = 0.0;
      for (int c = 0; c < kColumns && !found; ++c) {
        const auto ends = [&](std::string_view unit) {
          return bare.size() > unit.size() && bare.compare(bare.size() - unit.size(), unit.size(), unit) == 0 &&
                 names(bare.substr(0, bare.size() - unit.size()), kNames[static_cast<std::size_t>(c)]);
        };
        if (names(bare, kNames[static_cast<std::size_t>(c)])) found = static_cast<Column>(c);
        if (c != kElevation && (ends("deg") || ends("degrees"))) found = static_cast<Column>(c);
        if (c == kElevation && (ends("m") || ends("metres") || ends("meters"))) {
          found = kElevation;
          metres = 1.0;
        }
        if (c == kElevation && (ends("ft") || ends("feet"))) {
          found = kElevation;
          metres = inputs::kFoot;
        }
      }
      if (!found) {
        if (!header.empty()) unused_.push_back(files::printable(header, files::kShownMax));
        continue;
      }
      if (column_[*found])
        throw InputError(path_ + ":1", header, "", "means the same as " + table_.names()[*column_[*found]],
                         "one column of each kind");
      column_[*found] = i;
      if (*found != kElevation) continue;
      if (metres == 0.0) throw InputError(path_ + ":1", header, "", "no unit", "elevation (m), elevation_ft");
      metres_ = metres;
    }
    for (const Column c : {kLongitude, kLatitude}) {
      if (!column_[c])
        throw InputError(path_ + ":1", kNames[c].name, "", "no such column",
                         fmt::format("{}, {}", kNames[c].name, fmt::join(kNames[c].also, ", ")));
    }
  }

  const std::string path_;
  files::CsvTable table_;
  std::array<std::optional<std::size_t>, kColumns> column_;
  double metres_ = 1.0;
  std::vector<std::string> unused_;
};

Line read_table(const std::string& path) {
  try {
    return TableReader(path).read();
  } catch (const files::CsvError& e) {
    throw InputError(e.line() > 0 ? fmt::format("{}:{}", path, e.line()) : path, "", "", e.problem(), "");
  }
}

/// One line of parts that go on where the part before has ended.
Line read_by_gdal(const std::string& path, const char* driver) {
  const std::string content = inputs::read_file(path, kBytesMax);
  std::vector<std::vector<LinePoint>> parts;
  static const auto read = load<ReadLines>(kReadLines);
  try {
    parts = read(content, driver);
  } catch (const std::runtime_error& e) {
    throw InputError(path, "", "", e.what(), "");
  }
  if (parts.empty()) throw InputError(path, "", "", "no line in it", "a line of points (LineString, track, route)");
  Line line;
  for (const std::vector<LinePoint>& part : parts) {
    if (!line.points.empty() && (part.front().longitude != line.points.back().longitude ||
                                 part.front().latitude != line.points.back().latitude)) {
      throw InputError(path, "", "", fmt::format("{} lines that do not follow one another", parts.size()),
                       "one line, or parts of which each begins at the end of the one before");
    }
    for (const LinePoint& p : part) {
      line.points.push_back(p);
      line.points.back().where = fmt::format("{}, point {}", path, line.points.size());
    }
    if (line.points.size() > kPointsMax)
      throw InputError(path, "", "", "too many points", fmt::format("at most {}", kPointsMax));
  }
  if (parts.size() > 1) line.assumptions.push_back(fmt::format("{} parts are one line", parts.size()));
  return line;
}

void check(Line& line, const std::string& path) {
  for (const LinePoint& p : line.points) {
    const auto in = [&](const char* what, double value, double most) {
      if (!(std::abs(value) <= most))
        throw InputError(p.where, what, fmt::format("{}", value), "out of range",
                         fmt::format("[{}, {}] degrees", -most, most));
    };
    in("longitude", p.longitude, 180.0);
    in("latitude", p.latitude, 85.0);
    if (p.elevation && !(std::abs(*p.elevation) <= 10000.0))
      throw InputError(p.where, "elevation", fmt::format("{}", *p.elevation), "out of range", "[-10000, 10000] m");
  }
  const std::size_t all = line.points.size();
  line.points.erase(std::unique(line.points.begin(), line.points.end(),
                                [](const LinePoint& a, const LinePoint& b) {
                                  return a.longitude == b.longitude && a.latitude == b.latitude;
                                }),
                    line.points.end());
  if (line.points.size() < all)
    line.assumptions.push_back(
        fmt::format("{} points at the place of the one before: left out", all - line.points.size()));
  constexpr std::size_t kLeast = 4;
  if (line.points.size() < kLeast)
    throw InputError(path, "", "", fmt::format("{} points", line.points.size()), "at least 4 in different places");
  if (std::all_of(line.points.begin(), line.points.end(), [](const LinePoint& p) { return p.elevation == 0.0; })) {
    for (LinePoint& p : line.points) p.elevation.reset();
    line.assumptions.emplace_back("all elevations are 0: taken as missing");
  }
}

}  // namespace

Line read_line(const std::string& path) {
  const std::string end = files::lower_case(std::filesystem::path(path).extension().string());
  Line line;
  if (end == ".csv") line = read_table(path);
  else if (end == ".geojson" || end == ".json") line = read_by_gdal(path, "GeoJSON");
  else if (end == ".kml") line = read_by_gdal(path, "KML");
  else if (end == ".gpx") line = read_by_gdal(path, "GPX");
  else
    throw InputError(path, "", "", "the form of the file is not known by its name",
                     ".geojson, .json, .kml, .gpx, .csv");
  check(line, path);
  return line;
}

std::vector<double> read_heights(const std::string& path, const std::string& system,
                                 const std::vector<std::pair<double, double>>& longitudes_and_latitudes) {
  std::vector<double> longitude, latitude;
  for (const auto& [east, north] : longitudes_and_latitudes) {
    longitude.push_back(east);
    latitude.push_back(north);
  }
  inputs::require_file(path);
  static const auto read = load<ReadHeights>(kReadHeights);
  try {
    return read(path, system, longitude, latitude);
  } catch (const std::runtime_error& e) {
    throw InputError(path, "", "", e.what(), "a map of heights in ESRI ASCII (.asc) or GeoTIFF (.tif)");
  }
}

std::vector<PlanePoint> Plane::flat(const std::vector<LinePoint>& points) const {
  std::vector<double> x, y;
  for (const LinePoint& p : points) {
    x.push_back(p.longitude);
    y.push_back(p.latitude);
  }
  static const auto project = load<Project>(kProject);
  project(longitude_, latitude_, false, x, y);
  std::vector<PlanePoint> flat;
  for (std::size_t i = 0; i < points.size(); ++i) flat.push_back({x[i], y[i], points[i].elevation});
  return flat;
}

std::pair<double, double> Plane::on_globe(double x, double y) const { return on_globe({PlanePoint{x, y, {}}}).front(); }

std::vector<std::pair<double, double>> Plane::on_globe(const std::vector<PlanePoint>& points) const {
  std::vector<double> longitude, latitude;
  for (const PlanePoint& p : points) {
    longitude.push_back(p.x);
    latitude.push_back(p.y);
  }
  static const auto project = load<Project>(kProject);
  project(longitude_, latitude_, true, longitude, latitude);
  std::vector<std::pair<double, double>> places;
  for (std::size_t i = 0; i < points.size(); ++i) places.emplace_back(longitude[i], latitude[i]);
  return places;
}

}  // namespace train_derail::tracks
