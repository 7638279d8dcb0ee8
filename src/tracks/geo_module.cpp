/// \file
/// The module with GDAL and PROJ.
#include "tracks/geo_module.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>
#include <gdal_priv.h>
#include <ogrsf_frmts.h>

namespace train_derail::tracks {

namespace {

/// GDAL tells errors here instead of printing them.
class Quiet {
 public:
  Quiet() { CPLPushErrorHandler(CPLQuietErrorHandler); }
  ~Quiet() { CPLPopErrorHandler(); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;
};

std::string last_error() {
  const std::string said = CPLGetLastErrorMsg();
  return said.empty() ? "no reason given" : said;
}

/// A file in GDAL's memory: it reads nothing else beside it, from disk or network.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& content) : name_(fmt::format("/vsimem/{}", static_cast<const void*>(this))) {
    VSILFILE* file = VSIFileFromMemBuffer(name_.c_str(), reinterpret_cast<GByte*>(const_cast<char*>(content.data())),
                                          content.size(), FALSE);
    if (file == nullptr) throw std::runtime_error(last_error());
    VSIFCloseL(file);
  }
  ~MemoryFile() { VSIUnlink(name_.c_str()); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  const char* name() const { return name_.c_str(); }

 private:
  std::string name_;
};

OGRSpatialReference degrees() {
  OGRSpatialReference system;
  if (system.importFromProj4("+proj=longlat +ellps=WGS84 +datum=WGS84 +no_defs") != OGRERR_NONE)
    throw std::runtime_error(last_error());
  system.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return system;
}

using Transformation = std::unique_ptr<OGRCoordinateTransformation>;
Transformation transformation(const OGRSpatialReference& from, const OGRSpatialReference& to) {
  Transformation t(OGRCreateCoordinateTransformation(&from, &to));
  if (!t) throw std::runtime_error(last_error());
  return t;
}

void take(const OGRGeometry& geometry, std::vector<std::vector<LinePoint>>& lines) {
  const OGRwkbGeometryType type = wkbFlatten(geometry.getGeometryType());
  if (type == wkbMultiLineString || type == wkbGeometryCollection) {
    for (const OGRGeometry* part : *geometry.toGeometryCollection()) take(*part, lines);
    return;
  }
  if (type != wkbLineString) return;
  const OGRLineString& line = *geometry.toLineString();
  std::vector<LinePoint> points;
  for (int i = 0; i < line.getNumPoints(); ++i) {
    LinePoint p;
    p.longitude = line.getX(i);
    p.latitude = line.getY(i);
    if (line.Is3D() != 0) p.elevation = line.getZ(i);
    points.push_back(p);
  }
  if (!points.empty()) lines.push_back(std::move(points));
}

std::vector<std::vector<LinePoint>> read_lines(const std::string& content, const char* driver) {
  const Quiet quiet;
  GDALAllRegister();
  CPLSetThreadLocalConfigOption("GPX_ELE_AS_25D", "YES");  // else tracks have no elevations
  const MemoryFile file(content);
  const char* const drivers[] = {driver, nullptr};
  const GDALDatasetUniquePtr set(
      GDALDataset::Open(file.name(), GDAL_OF_VECTOR | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, drivers));
  if (!set) throw std::runtime_error(fmt::format("GDAL cannot read it as {}: {}", driver, last_error()));
  const OGRSpatialReference wanted = degrees();
  std::vector<std::vector<LinePoint>> lines;
  for (OGRLayer* layer : set->GetLayers()) {
    const OGRSpatialReference* system = layer->GetSpatialRef();
    Transformation change;
    if (system != nullptr && !system->IsGeographic()) {
      OGRSpatialReference own(*system);
      own.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
      change = transformation(own, wanted);
    }
    CPLErrorReset();
    for (const auto& feature : *layer) {
      OGRGeometry* geometry = feature->GetGeometryRef();
      if (geometry == nullptr) continue;
      if (change && geometry->transform(change.get()) != OGRERR_NONE) throw std::runtime_error(last_error());
      take(*geometry, lines);
    }
    if (CPLGetLastErrorType() == CE_Failure) throw std::runtime_error(last_error());  // half a file
  }
  return lines;
}

void project(double longitude, double latitude, bool back, std::vector<double>& x, std::vector<double>& y) {
  const Quiet quiet;
  OGRSpatialReference plane;
  const std::string text = fmt::format(
      "+proj=tmerc +lat_0={:.12f} +lon_0={:.12f} +k=1 +x_0=0 +y_0=0 +ellps=WGS84 +datum=WGS84 +units=m +no_defs",
      latitude, longitude);
  if (plane.importFromProj4(text.c_str()) != OGRERR_NONE) throw std::runtime_error(last_error());
  const Transformation t = back ? transformation(plane, degrees()) : transformation(degrees(), plane);
  std::vector<int> done(x.size(), 0);
  t->Transform(static_cast<int>(x.size()), x.data(), y.data(), nullptr, done.data());
  for (std::size_t i = 0; i < done.size(); ++i) {
    if (done[i] == 0)
      throw std::runtime_error(fmt::format("point {} cannot be laid into a plane: {}", i + 1, last_error()));
  }
}

/// A map of heights with its first band in memory.
class HeightMap {
 public:
  HeightMap(const std::string& path, const std::string& system) {
    const char* const drivers[] = {"AAIGrid", "GTiff", nullptr};
    const GDALDatasetUniquePtr set(
        GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR, drivers));
    if (!set) throw std::runtime_error(fmt::format("GDAL cannot read it as ESRI ASCII or GeoTIFF: {}", last_error()));
    std::array<double, 6> to_map{};
    if (set->GetGeoTransform(to_map.data()) != CE_None || GDALInvGeoTransform(to_map.data(), to_cells_.data()) == 0)
      throw std::runtime_error("the map does not say where it lies");
    if (!system.empty()) {
      if (system_.SetFromUserInput(system.c_str()) != OGRERR_NONE) throw std::runtime_error(last_error());
    } else if (const OGRSpatialReference* own = set->GetSpatialRef()) {
      system_ = *own;
    } else {
      throw std::runtime_error("the map does not name its system of coordinates (a file .prj beside it, or --system)");
    }
    system_.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    GDALRasterBand* band = set->GetRasterBand(1);
    if (band == nullptr) throw std::runtime_error("no band of heights");
    columns_ = band->GetXSize();
    rows_ = band->GetYSize();
    if (columns_ < 2 || rows_ < 2) throw std::runtime_error("fewer than 2 x 2 cells");
    constexpr std::int64_t kCellsMax = 100'000'000;
    if (std::int64_t{columns_} * rows_ > kCellsMax)
      throw std::runtime_error(
          fmt::format("{} x {} cells; at most {}: cut it (gdal_translate -projwin)", columns_, rows_, kCellsMax));
    heights_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    if (band->RasterIO(GF_Read, 0, 0, columns_, rows_, heights_.data(), columns_, rows_, GDT_Float64, 0, 0) != CE_None)
      throw std::runtime_error(last_error());
    int has_void = 0;
    const double void_height = band->GetNoDataValue(&has_void);
    for (double& height : heights_) {
      if (has_void != 0 && height == void_height) height = std::nan("");
    }
  }
  const OGRSpatialReference& system() const { return system_; }
  /// At a place in the map's system.
  double at(double x, double y) const {
    // From the corner of the first cell; heights are those of the middles.
    const double column = to_cells_[0] + to_cells_[1] * x + to_cells_[2] * y - 0.5,
                 row = to_cells_[3] + to_cells_[4] * x + to_cells_[5] * y - 0.5;
    if (!(column >= 0.0 && row >= 0.0 && column <= columns_ - 1 && row <= rows_ - 1)) return std::nan("");
    const int i = std::min(static_cast<int>(column), columns_ - 2), j = std::min(static_cast<int>(row), rows_ - 2);
    const double a = column - i, b = row - j;
    return (1.0 - b) * ((1.0 - a) * cell(i, j) + a * cell(i + 1, j)) +
           b * ((1.0 - a) * cell(i, j + 1) + a * cell(i + 1, j + 1));
  }

 private:
  double cell(int column, int row) const {
    return heights_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)];
  }

  std::array<double, 6> to_cells_{};
  OGRSpatialReference system_;
  int columns_ = 0, rows_ = 0;
  std::vector<double> heights_;
};

std::vector<double> sample_heights(const std::string& path, const std::string& system, std::vector<double> longitude,
                                   std::vector<double> latitude) {
  const Quiet quiet;
  GDALAllRegister();
  const HeightMap map(path, system);
  const Transformation t = transformation(degrees(), map.system());
  std::vector<int> done(longitude.size(), 0);
  t->Transform(static_cast<int>(longitude.size()), longitude.data(), latitude.data(), nullptr, done.data());
  std::vector<double> heights;
  for (std::size_t i = 0; i < longitude.size(); ++i)
    heights.push_back(done[i] != 0 ? map.at(longitude[i], latitude[i]) : std::nan(""));
  return heights;
}

}  // namespace

}  // namespace train_derail::tracks

extern "C" {
// The library calls them by these names; see geo_module.hpp.
extern const train_derail::tracks::ReadLines train_derail_read_lines;
extern const train_derail::tracks::Project train_derail_project;
extern const train_derail::tracks::ReadHeights train_derail_read_heights;
const train_derail::tracks::ReadLines train_derail_read_lines = &train_derail::tracks::read_lines;
const train_derail::tracks::Project train_derail_project = &train_derail::tracks::project;
const train_derail::tracks::ReadHeights train_derail_read_heights = &train_derail::tracks::sample_heights;
}
