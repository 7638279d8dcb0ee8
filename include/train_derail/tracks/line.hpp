/// \file
/// Lines on the globe, as track files have them. GDAL reads them and PROJ lays them into a plane; both are in a module
/// that is loaded when it is needed.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "train_derail/tracks/fit.hpp"

namespace train_derail::tracks {

/// A point of a line, on the ellipsoid WGS 84.
struct LinePoint {
  double longitude = 0.0;           ///< east [degrees]
  double latitude = 0.0;            ///< north [degrees]
  std::optional<double> elevation;  ///< m
  std::string where;                ///< "line.csv:31", "line.kml, point 30"
};

/// A line that was read from a file.
struct Line {
  std::vector<LinePoint> points;         ///< in the order of the file
  std::vector<std::string> assumptions;  ///< what was left out or assumed, each a line of text
};

/// Reads the one line of a file: GeoJSON, KML, GPX by GDAL, or a table (CSV) with columns of longitude and latitude in
/// degrees and, if it has them, elevations with their unit in the header. Points at the place of the one before are
/// left out. Throws InputError with row, column, value and what is allowed, std::runtime_error if this build has no
/// GDAL.
Line read_line(const std::string& path);

/// A plane that touches the globe at a point: transverse Mercator about it, x east and y north of it. Lengths 20 km
/// away are right to 5e-6.
class Plane {
 public:
  /// \param longitude, latitude  of the point [degrees].
  Plane(double longitude, double latitude) : longitude_(longitude), latitude_(latitude) {}
  /// Throws std::runtime_error if this build has no GDAL or a point cannot be in this plane.
  std::vector<PlanePoint> flat(const std::vector<LinePoint>& points) const;
  /// Longitude and latitude [degrees] of a point of the plane.
  std::pair<double, double> on_globe(double x, double y) const;
  /// Of many, which is far faster than one by one.
  std::vector<std::pair<double, double>> on_globe(const std::vector<PlanePoint>& points) const;

 private:
  double longitude_, latitude_;
};

/// Heights of a map (ESRI ASCII or GeoTIFF, read by GDAL) at places of the globe, NaN where it has none [m].
/// \param system  the map's system of coordinates ("EPSG:32614") in place of the one it names; "": the one it names.
/// Throws inputs::InputError if the file cannot be read, std::runtime_error if this build has no GDAL.
std::vector<double> read_heights(const std::string& path, const std::string& system,
                                 const std::vector<std::pair<double, double>>& longitudes_and_latitudes);

}  // namespace train_derail::tracks
