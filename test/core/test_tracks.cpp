// Lines of points become tracks: known curves are found, noise is smoothed, what is wrong has its row.
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <vector>

#ifdef TRAIN_DERAIL_GDAL
#include <gdal_priv.h>
#include <ogr_spatialref.h>
#endif

#include "command_line.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/height_grid.hpp"
#include "train_derail/tracks/fit.hpp"

namespace train_derail {
namespace {

using test::derail;
using test::Result;
using tracks::Piece;
using tracks::PlanePoint;
using tracks::TrackFit;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;

/// Curvature that goes from k0 to k1 over a length.
struct Stretch {
  double length, k0, k1;
};
constexpr double kRadius = 400.0;
const std::vector<Stretch> kSCurve{
    {1000, 0, 0}, {60, 0, 1 / kRadius},  {300, 1 / kRadius, 1 / kRadius},   {60, 1 / kRadius, 0},
    {500, 0, 0},  {60, 0, -1 / kRadius}, {400, -1 / kRadius, -1 / kRadius}, {60, -1 / kRadius, 0},
    {1500, 0, 0}};

/// Points of the stretches, `step` (and up to `more`) apart, off by `noise` in x and y.
struct Surveyed {
  std::vector<PlanePoint> points, truth;
};
Surveyed surveyed(const std::vector<Stretch>& stretches, double step, double more, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> off(0.0, 1.0);
  std::uniform_real_distribution<double> further(0.0, 1.0);
  Surveyed all;
  constexpr double kFine = 0.05;
  double x = 0.0, y = 0.0, heading = 0.4, s = 0.0, next = 0.0;
  for (const Stretch& stretch : stretches) {
    const int n = static_cast<int>(std::lround(stretch.length / kFine));
    for (int i = 0; i < n; ++i) {
      if (s >= next) {
        all.truth.push_back({x, y, {}});
        all.points.push_back({x + noise * off(random), y + noise * off(random), {}});
        next += step + more * further(random);
      }
      const double k = stretch.k0 + (stretch.k1 - stretch.k0) * (i + 0.5) / n;
      x += kFine * std::cos(heading + 0.5 * k * kFine);
      y += kFine * std::sin(heading + 0.5 * k * kFine);
      heading += k * kFine;
      s += kFine;
    }
  }
  return all;
}

/// Distance of a point from the track, by looking.
double distance(const TrackFit& fit, const PlanePoint& p) {
  double least = 1e9;
  for (double s = 0.0; s <= fit.length(); s += 0.5) {
    const TrackFit::Pose at = fit.at(s);
    least = std::min(least, std::hypot(at.x - p.x, at.y - p.y));
  }
  return least;
}

/// Sum of the turns of the pieces that turn to one side [rad].
double turn(const TrackFit& fit, double side) {
  double sum = 0.0;
  for (const Piece& p : fit.curvature) sum += p.value * side > 0.0 ? p.value * (p.to - p.from) : 0.0;
  return sum;
}

double sharpest(const TrackFit& fit, double side) {
  double most = 0.0;
  for (const Piece& p : fit.curvature) {
    if (p.to - p.from > 100.0) most = std::max(most, side * p.value);
  }
  return most;
}

TEST(TrackFits, AnArcIsOneArc) {
  for (const double side : {1.0, -1.0}) {
    const TrackFit fit = tracks::fit_track(surveyed({{1200, side / 500, side / 500}}, 10, 0, 0, 1).points, {});
    ASSERT_EQ(fit.curvature.size(), 1U);
    EXPECT_NEAR(fit.curvature[0].value, side / 500, 1e-5 / 500);
    EXPECT_LT(fit.largest(), 1e-3);
    EXPECT_NEAR(fit.heading, 0.4, 1e-4);
  }
  const TrackFit straight = tracks::fit_track(surveyed({{1200, 0, 0}}, 10, 0, 0, 1).points, {});
  ASSERT_EQ(straight.curvature.size(), 1U);
  EXPECT_EQ(straight.curvature[0].value, 0.0);
  EXPECT_TRUE(tracks::curves(straight, 0.0).empty());
}

TEST(TrackFits, SpiralsAreStepsBetweenTheStraightAndTheArc) {
  const Surveyed s = surveyed(kSCurve, 10, 0, 0, 1);
  const TrackFit fit = tracks::fit_track(s.points, {});
  EXPECT_LT(fit.largest(), 0.3);
  EXPECT_NEAR(1 / sharpest(fit, 1.0), kRadius, 0.01 * kRadius);
  EXPECT_NEAR(1 / sharpest(fit, -1.0), kRadius, 0.01 * kRadius);
  EXPECT_NEAR(turn(fit, 1.0), 360 / kRadius, 2e-3);
  EXPECT_NEAR(turn(fit, -1.0), -460 / kRadius, 2e-3);
  EXPECT_GE(fit.curvature.size(), 9U);  // more than straight, arc, straight, arc, straight
  EXPECT_LE(fit.curvature.size(), 25U);
}

// Two metres of noise every 10 to 30 m: no point of the true line is far from the fit, and the arcs are those of the
// line.
TEST(TrackFits, NoiseIsSmoothed) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Surveyed s = surveyed(kSCurve, 10, 20, 2.0, seed);
    const TrackFit fit = tracks::fit_track(s.points, {});
    EXPECT_NEAR(fit.noise, 2.0, 0.6);
    EXPECT_NEAR(fit.rms(), 2.0, 0.4);
    double most = 0.0;
    // The ends of the line are beside its first and last point, as far off as these are.
    for (std::size_t i = 1; i + 1 < s.truth.size(); ++i) most = std::max(most, distance(fit, s.truth[i]));
    EXPECT_LT(most, 3.0) << "seed " << seed;
    EXPECT_NEAR(turn(fit, 1.0), 360 / kRadius, 0.03);
    EXPECT_NEAR(turn(fit, -1.0), -460 / kRadius, 0.03);
    EXPECT_NEAR(1 / sharpest(fit, 1.0), kRadius, 0.15 * kRadius) << "seed " << seed;
    EXPECT_LE(fit.curvature.size(), 12U);
  }
}

TEST(TrackFits, OnePointFarOffDoesNotBendTheTrack) {
  Surveyed s = surveyed(kSCurve, 10, 20, 0.5, 4);
  s.points[50].x += 40.0;
  s.points[50].y -= 40.0;
  const TrackFit fit = tracks::fit_track(s.points, {});
  EXPECT_GE(fit.outliers, 1U);
  double most = 0.0;
  for (const PlanePoint& p : s.truth) most = std::max(most, distance(fit, p));
  EXPECT_LT(most, 2.0);
  EXPECT_GT(fit.largest(), 20.0);
}

TEST(TrackFits, HeightsBecomeGrades) {
  std::mt19937 random(5);
  std::normal_distribution<double> off(0.0, 0.5);
  for (const bool noisy : {false, true}) {
    Surveyed s = surveyed({{4000, 0, 0}}, 20, 0, 0, 1);
    for (std::size_t i = 0; i < s.points.size(); ++i) {
      const double at = 20.0 * static_cast<double>(i);
      s.points[i].z =
          100.0 + 0.01 * std::min(at, 2000.0) - 0.004 * std::max(0.0, at - 2000.0) + (noisy ? off(random) : 0.0);
    }
    const TrackFit fit = tracks::fit_track(s.points, {});
    // The change lies on one of the places between pieces, or there is a short piece about it.
    ASSERT_GE(fit.grade.size(), 2U);
    ASSERT_LE(fit.grade.size(), 3U);
    EXPECT_NEAR(fit.grade.front().value, 0.01, noisy ? 5e-4 : 1e-4);
    EXPECT_NEAR(fit.grade.back().value, -0.004, noisy ? 5e-4 : 1e-4);
    EXPECT_NEAR(fit.grade.front().to, 2000.0, noisy ? 150.0 : 70.0);
    EXPECT_NEAR(fit.grade.back().from, 2000.0, noisy ? 150.0 : 70.0);
    EXPECT_LT(fit.height_rms, noisy ? 0.7 : 0.1);
    EXPECT_NEAR(fit.height_at(2000.0), 120.0, 1.0);
  }
}

#ifdef TRAIN_DERAIL_GDAL

class TrackFiles : public test::Cli {
 protected:
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
    return at(name);
  }
  std::string base() const {
    return put("base.yaml",
               "initial: {speed: 40 mph, yaw_rate: 0.2}\nground: {on_track_law: rails}\nmodel: spatial\n"
               "solver: {method: semi_implicit, fixed_step: 1e-3}\n"
               "consist: [{count: 5, length: 55 ft, weight: 200 kip}]\n");
  }
};

/// Points on a circle on the ellipsoid WGS 84, from its radii of curvature; bearing from the middle, clockwise from
/// north.
std::string circle(double radius, double from, double to, int n, const char* elevation = "") {
  constexpr double kA = 6378137.0, kE2 = 0.00669437999014, kDegree = M_PI / 180.0;
  constexpr double kLatitude = 48.0, kLongitude = -103.0;
  const double sine = std::sin(kLatitude * kDegree), w = 1.0 - kE2 * sine * sine;
  const double east = kA / std::sqrt(w) * std::cos(kLatitude * kDegree), north = kA * (1.0 - kE2) / std::pow(w, 1.5);
  std::ostringstream out;
  out.precision(12);
  out << "Lat,Lon" << (*elevation != '\0' ? ",Elevation (m)" : "") << "\n";
  for (int i = 0; i <= n; ++i) {
    const double bearing = (from + (to - from) * i / n) * kDegree;
    out << kLatitude + radius * std::cos(bearing) / north / kDegree << ","
        << kLongitude + radius * std::sin(bearing) / east / kDegree << elevation << "\n";
  }
  return out.str();
}

TEST_F(TrackFiles, ACircleOnTheEllipsoidHasItsRadius) {
  put("circle.csv", circle(600.0, 0.0, 90.0, 100));
  // Clockwise from north to east: a curve to the right. In its middle, bearing 45 degrees, it heads for 135 degrees.
  const double middle = 600.0 * M_PI / 4.0;
  const Result made = derail("import track " + at("circle.csv") + " --derail-at " + std::to_string(middle) +
                             " --base " + base() + " -o " + at("s.yaml"));
  ASSERT_EQ(made.code, 0) << made.out;
  const inputs::Scenario s = inputs::read_scenario_file(at("s.yaml"));
  ASSERT_EQ(s.track.curves.size(), 1U);
  EXPECT_NEAR(s.track.curves[0].curvature * -600.0, 1.0, 1e-3);
  EXPECT_NEAR(s.track.curves[0].start, -middle, 0.5);
  EXPECT_NEAR(s.track.curves[0].length, 2 * middle, 0.5);
  EXPECT_NEAR(s.track.heading.value() / inputs::kDegree, 135.0, 0.1);
  EXPECT_NE(made.out.find("no elevations: the track is level"), std::string::npos) << made.out;
  // The other way, from a place: the middle of the arc.
  const Result back = derail("import track --backward " + at("circle.csv") +
                             " --derail-at=-102.9943124,48.0038152 --base " + base() + " -o " + at("back.yaml"));
  ASSERT_EQ(back.code, 0) << back.out;
  const inputs::Scenario b = inputs::read_scenario_file(at("back.yaml"));
  EXPECT_NEAR(b.track.curves[0].curvature * 600.0, 1.0, 1e-3);
  EXPECT_NEAR(b.track.heading.value() / inputs::kDegree, 315.0, 0.2);
}

TEST_F(TrackFiles, AllFormsOfAFileAreOneLine) {
  const std::string points = "[-103,48,500],[-103,48.001,501],[-103,48.002,502],[-103,48.003,503],[-103,48.004,504]";
  put("a.geojson", R"({"type":"LineString","coordinates":[)" + points + "]}");
  put("a.kml",
      "<kml xmlns=\"http://www.opengis.net/kml/2.2\"><Placemark><LineString><coordinates>-103,48,500 -103,48.001,501 "
      "-103,48.002,502 -103,48.003,503 -103,48.004,504</coordinates></LineString></Placemark></kml>");
  std::string gpx = "<gpx version=\"1.1\" creator=\"t\" xmlns=\"http://www.topografix.com/GPX/1/1\"><trk><trkseg>";
  std::string csv = "longitude,latitude,elevation_ft,name\n";
  for (int i = 0; i < 5; ++i) {
    const std::string latitude = std::to_string(48.0 + 0.001 * i), z = std::to_string(500 + i);
    gpx += "<trkpt lat=\"" + latitude + "\" lon=\"-103\"><ele>" + z + "</ele></trkpt>";
    csv += "-103," + latitude + "," + std::to_string((500 + i) / 0.3048) + ",x\n";
  }
  put("a.gpx", gpx + "</trkseg></trk></gpx>");
  put("a.csv", csv);
  std::vector<std::string> tracks;
  for (const char* name : {"a.geojson", "a.kml", "a.gpx", "a.csv"}) {
    const Result r = derail("import track " + at(name) + " --derail-at \"200 m\"", false);
    ASSERT_EQ(r.code, 0) << name << derail("import track " + at(name) + " --derail-at \"200 m\"").out;
    tracks.push_back(r.out.substr(r.out.find("\ntrack:")));
    EXPECT_EQ(tracks.back(), tracks.front()) << name;
  }
  EXPECT_NE(tracks[0].find("heading: 0.00 deg\n  curves: []\n"), std::string::npos) << tracks[0];
  EXPECT_NE(tracks[0].find("# 0.90 %"), std::string::npos) << tracks[0];  // 1 m over 111.2 m
}

TEST_F(TrackFiles, WhatIsWrongHasItsRow) {
  const std::string good = circle(600.0, 0.0, 90.0, 20);
  const auto line = [](const std::string& points) { return R"({"type":"LineString","coordinates":[)" + points + "]}"; };
  const std::vector<std::array<std::string, 4>> cases{
      {"a.csv", "lat,lon\n48,-103\n48.x,-103\n", "", "a.csv:3: lat = '48.x': not a number"},
      {"a.csv", "lat,lon\n48,-103\n98,-103\n48,-103\n48,-103\n", "",
       "a.csv:3: latitude = '98': out of range; allowed: [-85, 85] degrees"},
      {"a.csv", "lat,lon\n48,nan\n", "", "a.csv:2: longitude = 'nan': out of range"},
      {"a.csv", "lat,lon,elevation\n48,-103,5\n", "",
       "a.csv:1: elevation: no unit; allowed: elevation (m), elevation_ft"},
      {"a.csv", "lat,long,lon\n48,-103,1\n", "", "means the same as long"},
      {"a.csv", "lat,x\n48,-103\n", "", "a.csv:1: longitude: no such column; allowed: longitude, lon, long, lng"},
      {"a.csv", "", "", "is empty"},
      {"a.csv", "lat,lon\n", "", "0 points; allowed: at least 4 in different places"},
      {"a.csv", "lat,lon\n48,-103\n48,-103\n48,-103\n48,-103\n48.001,-103\n", "", "2 points"},
      {"a.csv", "lat,lon\n48,-103\n48.001,-103\n48.5,-103\n48.501,-103\n", "",
       "a.csv:4: 55.5 km from the point before"},
      {"a.csv", good, "--derail-at \"40 km\"",
       "--derail-at = '40 km': beyond the end of the line; allowed: [0, 942] m"},
      {"a.csv", good, "--derail-at=-103,48.1", "m from the line; allowed: at most 50 m"},
      {"a.csv", good, "--derail-at 480,-103", "--derail-at = '480,-103': not a place"},
      {"a.csv", good, "--derail-at soon", "--derail-at = 'soon'"},
      {"a.csv", good, "--derail-at \"400 m\" --within \"1 km\" --bound \"0 m\" --noise \"2 m\"",
       "m from the fitted track; allowed: at most 0 m (--bound)"},
      {"a.csv", circle(30.0, 0.0, 180.0, 40), "--derail-at \"40 m\"", "curvature = "},
      {"a.shp", good, "",
       "a.shp: the form of the file is not known by its name; allowed: .geojson, .json, .kml, .gpx, .csv"},
      {"a.geojson", "{", "", "GDAL cannot read it as GeoJSON"},
      {"a.geojson", good, "", "GDAL cannot read it as GeoJSON"},
      {"a.geojson", R"({"type":"Point","coordinates":[1,2]})", "", "no line in it"},
      {"a.geojson", line("[-103,48],[-103,148],[-103,48.2],[-103,48.3]"), "",
       "a.geojson, point 2: latitude = '148': out of range"},
      {"a.geojson", R"({"type":"MultiLineString","coordinates":[[[1,2],[1,2.001]],[[1,2.1],[1,2.101]]]})", "",
       "2 lines that do not follow one another"},
      {"a.kml", "<kml><Placemark><LineString><coordinates>1,2 1,2.", "", "a.kml"},
      {"a.kml",
       "<!DOCTYPE a [<!ENTITY b \"bbbbbbbbbb\"><!ENTITY c \"&b;&b;&b;&b;&b;&b;&b;&b;\"><!ENTITY d "
       "\"&c;&c;&c;&c;&c;&c;&c;&c;\">]><kml>&d;</kml>",
       "", "a.kml"},
      {"a.gpx", "<gpx></gpx>", "", "a.gpx"},
      {"a.gpx", std::string("\0\1\2", 3), "", "a.gpx"}};
  for (const auto& [name, text, options, said] : cases) {
    put(name, text);
    const Result r = derail("import track " + at(name) + " " +
                            (options.find("--derail-at") == std::string::npos ? "--derail-at 0 " : "") + options);
    EXPECT_EQ(r.code, 2) << name << " " << text.substr(0, 100) << "\n" << r.out;
    EXPECT_NE(r.out.find(said), std::string::npos) << said << "\n" << r.out;
  }
  EXPECT_EQ(derail("import track " + at("none.kml") + " --derail-at 0").code, 2);
  put("a.csv", good);
  EXPECT_EQ(derail("import track " + at("a.csv") + " --derail-at 0 --force -o " + at("a.csv")).code, 2);
}

/// A plane on UTM zone 14: rises by 0.02 to the east and falls by 0.05 to the north, 100 m at the middle.
std::string tilted_map() {
  std::ostringstream out;
  constexpr int kCells = 100;
  constexpr double kEast = 534000.0, kNorth = 5114000.0, kCell = 10.0;
  out << "ncols " << kCells << "\nnrows " << kCells << "\nxllcorner " << kEast - 0.5 * kCells * kCell << "\nyllcorner "
      << kNorth - 0.5 * kCells * kCell << "\ncellsize " << kCell << "\nNODATA_value -9999\n";
  for (int row = 0; row < kCells; ++row) {
    for (int column = 0; column < kCells; ++column)
      out << 100.0 + 0.02 * kCell * (column - 49.5) - 0.05 * kCell * (49.5 - row) << ' ';
    out << '\n';
  }
  return out.str();
}

/// Writes the map again as a GeoTIFF that names its system.
void write_geotiff(const std::string& from, const std::string& to) {
  GDALAllRegister();
  const GDALDatasetUniquePtr map(GDALDataset::Open(from.c_str(), GDAL_OF_RASTER));
  ASSERT_TRUE(map);
  OGRSpatialReference utm;
  ASSERT_EQ(utm.importFromEPSG(32614), OGRERR_NONE);
  GDALDriver* tiff = GetGDALDriverManager()->GetDriverByName("GTiff");
  const GDALDatasetUniquePtr copy(tiff->CreateCopy(to.c_str(), map.get(), FALSE, nullptr, nullptr, nullptr));
  ASSERT_TRUE(copy);
  ASSERT_EQ(copy->SetSpatialRef(&utm), CE_None);
}

TEST_F(TrackFiles, AGeoTiffSaysItsSystemAndIsTheSameGround) {
  put("map.asc", tilted_map());
  write_geotiff(at("map.asc"), at("map.tif"));
  const std::string place = " --derail-at=-98.559886,46.1801 --heading \"75 deg\" --base " + base() + " -o ";
  const auto ground = [&](const std::string& map, const std::string& system) {
    const Result made = derail("import terrain " + at(map) + place + at(map + ".yaml") + system);
    EXPECT_EQ(made.code, 0) << made.out;
    return inputs::read_scenario_file(at(map + ".yaml")).terrain.grid;
  };
  const inputs::TerrainGrid tiff = ground("map.tif", ""), ascii = ground("map.asc", " --system EPSG:32614");
  ASSERT_EQ(tiff.rows.size(), ascii.rows.size());
  ASSERT_GT(tiff.rows.size(), 10U);
  for (std::size_t i = 0; i < tiff.rows.size(); ++i) EXPECT_EQ(tiff.rows[i].heights, ascii.rows[i].heights) << i;
  std::filesystem::resize_file(at("map.tif"), 100);
  const Result cut = derail("import terrain " + at("map.tif") + place + at("cut.yaml"));
  EXPECT_EQ(cut.code, 2);
  EXPECT_NE(cut.out.find("map.tif"), std::string::npos) << cut.out;
}

TEST_F(TrackFiles, AMapOfHeightsBecomesTheGroundBesideTheTrack) {
  put("map.asc", tilted_map());
  const std::string place = " --derail-at=-98.559886,46.1801 --system EPSG:32614 --base " + base(),
                    out = " -o " + at("t.yaml");
  for (const double degrees : {0.0, 75.0, 200.0}) {
    const Result made = derail("import terrain " + at("map.asc") + place + " --force --along \"100 m\" --heading \"" +
                               std::to_string(degrees) + " deg\"" + out);
    ASSERT_EQ(made.code, 0) << made.out;
    const inputs::Scenario s = inputs::read_scenario_file(at("t.yaml"));
    EXPECT_NEAR(*s.track.heading, degrees * inputs::kDegree, 1e-6);
    const model::HeightGrid grid(s.terrain.grid);
    // Ahead is (sin, cos) in east and north, left (-cos, sin). UTM's north is not quite that of the globe there.
    const double sine = std::sin(*s.track.heading), cosine = std::cos(*s.track.heading);
    for (const auto& [x, y] : {std::pair(0.0, 0.0), {80.0, -60.0}, {-95.0, 95.0}}) {
      const double east = x * sine - y * cosine, north = x * cosine + y * sine;
      EXPECT_NEAR(grid.at(x, y).z, -s.terrain.rail_height + 0.02 * east - 0.05 * north, 0.05) << degrees << ' ' << x;
    }
  }
  EXPECT_EQ(derail("run --quiet " + at("t.yaml") + " --set stop.time_max=0.1").code, 0);

  const std::vector<std::array<std::string, 2>> wrong{
      {place + " --heading \"75 deg\" --along \"2 km\" --spacing \"20 m\"", "no height at longitude"},
      {place + " --heading \"75 deg\" --along \"2 km\"", "--along"},
      {place + " --heading north", "--heading"},
      {" --derail-at 5 --heading \"75 deg\" --base " + base(), "--derail-at"},
      {" --derail-at=-98.56,46.18 --heading \"75 deg\" --base " + base(), "--system"},
      {" --derail-at=-98.56,46.18 --heading \"75 deg\" --system EPSG:0 --base " + base(), "map.asc"},
      {" --derail-at=-98.56,46.18 --heading \"75 deg\" --base " + kSource + "/config/accident.yaml", "model"}};
  for (const auto& [options, said] : wrong) {
    const Result r = derail("import terrain " + at("map.asc") + options);
    EXPECT_EQ(r.code, 2) << options << "\n" << r.out;
    EXPECT_NE(r.out.find(said), std::string::npos) << said << "\n" << r.out;
  }
  put("map.asc", "ncols 2\nnrows");
  EXPECT_EQ(derail("import terrain " + at("map.asc") + place + " --heading \"75 deg\"").code, 2);
  put("map.tif", "no map");
  for (const auto& [map, why] :
       {std::pair("map.tif", "not recognized"), {"none.tif", "No such file"}, {".", "a folder"}}) {
    const Result r = derail("import terrain " + at(map) + place + " --heading \"75 deg\"");
    EXPECT_EQ(r.code, 2) << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
    EXPECT_EQ(r.out.find("no reason given"), std::string::npos) << r.out;
  }
}

TEST_F(TrackFiles, WhatTheMapTakesTheScenariosPlaceOfIsAmongWhatIsAssumed) {
  put("map.asc", tilted_map());
  const std::string common = "import terrain " + at("map.asc") +
                             " --derail-at=-98.559886,46.1801 --system EPSG:32614 " + "--heading \"75 deg\" -o " +
                             at("t.yaml") + " --force --base ";
  const auto assumed = [&](const std::string& terrain) {
    put("own.yaml", "base: " + base() + "\nterrain: " + terrain + "\n");
    const Result made = derail(common + at("own.yaml"));
    EXPECT_EQ(made.code, 0) << made.out;
    return made.out + test::text_of(at("t.yaml"));
  };
  const std::string banks =
      assumed("{bank_left: 3 m, bank_right: -2 m, sections: [{start: 10 m, length: 50 m, bank_left: 4 m}]}");
  const std::string said =
      "the map takes the place of what the base says there: terrain.bank_left (3 m), terrain.bank_right (-2 m), "
      "terrain.sections (1)";
  EXPECT_NE(banks.find("# - " + said), std::string::npos) << banks.substr(0, 2000);
  EXPECT_NE(banks.find(said), banks.rfind(said)) << "on the screen too\n" << banks.substr(0, 2000);
  const std::string flat = assumed("{bank_left: 0 m, bank_right: 0 m}");
  EXPECT_EQ(flat.find("what the base says there"), std::string::npos) << flat.substr(0, 2000);
}

TEST_F(TrackFiles, TheExampleRunsAndHasAPicture) {
  const Result made = derail("import track " + kSource + "/examples/line.geojson --derail-at \"5.1 km\" --base " +
                             base() + " -o " + at("s.yaml") + " --plot " + at("p.png"));
  ASSERT_EQ(made.code, 0) << made.out;
  std::ifstream picture(at("p.png"), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(picture), std::istreambuf_iterator<char>()};
  EXPECT_EQ(bytes.substr(1, 3), "PNG");
  EXPECT_GT(bytes.size(), 50000U);
  // What is said at the end stands in the file.
  std::ifstream file(at("s.yaml"));
  const std::string yaml{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::istringstream lines(made.out.substr(made.out.find('\n') + 1));
  int said = 0;
  for (std::string line; std::getline(lines, line); ++said)
    EXPECT_NE(yaml.find("# - " + line.substr(2) + "\n"), std::string::npos) << line;
  EXPECT_GE(said, 8);
  EXPECT_EQ(derail("run --quiet " + at("s.yaml") + " --set stop.time_max=0.1").code, 0);
}

#endif

}  // namespace
}  // namespace train_derail
