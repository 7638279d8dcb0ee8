/// \file
/// What the library asks of the module with GDAL. Errors are std::runtime_error.
#pragma once

#include <string>
#include <vector>

#include "train_derail/tracks/line.hpp"

namespace train_derail::tracks {

inline constexpr char kGeoModule[] = "libtrain_derail_geo.so";

/// Lines of a file; each a list of points without `where`.
/// \param driver  GDAL's name of the form: "GeoJSON", "KML", "GPX".
using ReadLines = std::vector<std::vector<LinePoint>> (*)(const std::string& content, const char* driver);
inline constexpr char kReadLines[] = "train_derail_read_lines";

/// Takes degrees into a plane, or, if `back`, points of the plane into degrees; in place.
using Project = void (*)(double longitude, double latitude, bool back, std::vector<double>& x, std::vector<double>& y);
inline constexpr char kProject[] = "train_derail_project";

/// Heights of a map, ESRI ASCII or GeoTIFF, at places of the globe [degrees]: bilinear between the middles of cells,
/// NaN where the map has none. \param system  the map's system of coordinates ("EPSG:32614") in place of the one it
/// names; "": the one it names.
using ReadHeights = std::vector<double> (*)(const std::string& path, const std::string& system,
                                            std::vector<double> longitude, std::vector<double> latitude);
inline constexpr char kReadHeights[] = "train_derail_read_heights";

}  // namespace train_derail::tracks
