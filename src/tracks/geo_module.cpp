/// \file
/// The module with GDAL and PROJ.
#include "tracks/geo_module.hpp"

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
  const GDALDatasetUniquePtr set(GDALDataset::Open(file.name(), GDAL_OF_VECTOR | GDAL_OF_READONLY, drivers));
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

}  // namespace

}  // namespace train_derail::tracks

extern "C" {
// The library calls them by these names; see geo_module.hpp.
extern const train_derail::tracks::ReadLines train_derail_read_lines;
extern const train_derail::tracks::Project train_derail_project;
const train_derail::tracks::ReadLines train_derail_read_lines = &train_derail::tracks::read_lines;
const train_derail::tracks::Project train_derail_project = &train_derail::tracks::project;
}
