// The one-way rule: a floor includes only what stands left of it, and the core knows no ROS.
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kFloors{"files",      "inputs",    "model", "solver",     "outcome",
                                       "simulation", "multibody", "study", "validation", "ros"};

std::size_t floor_of(const std::string& name) {
  return static_cast<std::size_t>(std::find(kFloors.begin(), kFloors.end(), name) - kFloors.begin());
}

TEST(House, FloorsIncludeOnlyWhatStandsLeft) {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex include("^\\s*#include [<\"]([^>\"]+)[>\"]");
  const std::regex ros_header(
      "^(ros|rosbag|rosgraph_msgs|std_msgs|std_srvs|geometry_msgs|visualization_msgs|tf2.*|rviz|"
      "diagnostic_.*|actionlib.*|XmlRpc.*)/.*|XmlRpc.*");
  const std::regex own("^train_derail/([a-z]+)/.*");
  int seen = 0;
  for (const char* tree : {"include/train_derail", "src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      if (!entry.is_regular_file()) continue;
      const std::size_t floor = floor_of(fs::relative(entry.path(), root / tree).begin()->string());
      if (floor == kFloors.size()) continue;  // nodes, apps, rviz
      const bool core = floor < floor_of("ros");
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        std::smatch match;
        if (!std::regex_search(line, match, include)) continue;
        ++seen;
        const std::string header = match[1];
        std::smatch part;
        if (std::regex_match(header, part, own)) {
          EXPECT_LE(floor_of(part[1]), floor) << entry.path() << " includes " << header;
        } else if (core) {
          EXPECT_FALSE(std::regex_match(header, ros_header)) << entry.path() << " includes " << header;
        }
        if (tree == std::string("include/train_derail")) {
          EXPECT_EQ(header.find("sundials"), std::string::npos) << entry.path();
          EXPECT_EQ(header.find("nvector"), std::string::npos) << entry.path();
          EXPECT_EQ(header.find("Simbody"), std::string::npos) << entry.path();
        }
      }
    }
  }
  EXPECT_GT(seen, 50);
}

// The second opinion would be none if it shared the model's physics.
TEST(House, TheMultibodyEngineIncludesNoneOfTheModelsPhysics) {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex include("^\\s*#include \"((?:train_derail|multibody)/[^\"]+)\"");
  std::vector<fs::path> open{root / "src/multibody/engine.cpp", root / "src/multibody/observer.cpp"};
  std::set<fs::path> seen;
  while (!open.empty()) {
    const fs::path path = open.back();
    open.pop_back();
    if (!seen.insert(path).second) continue;
    std::ifstream file(path);
    ASSERT_TRUE(file) << path;
    for (std::string line; std::getline(file, line);) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      const std::string header = match[1];
      open.push_back(root / (header.compare(0, 10, "multibody/") == 0 ? "src" : "include") / header);
    }
  }
  EXPECT_GT(seen.size(), 8U);
  const std::set<std::string> data{"energy_ledger.hpp", "footprint.hpp", "train.hpp"};
  for (const fs::path& path : seen) {
    const std::string floor = path.parent_path().filename().string();
    EXPECT_TRUE(floor != "model" || data.count(path.filename().string()) > 0) << path;
    EXPECT_NE(floor, "simulation") << path;
  }
}

}  // namespace
