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

/// From the ground up. python, ros and rviz, apps and nodes are five ways into the house: none of the later floors
/// includes a private header of another.
const std::vector<std::string> kFloors{"files",      "simd",    "inputs",     "tracks", "fields",    "model",
                                       "solver",     "outcome", "simulation", "scene",  "multibody", "study",
                                       "validation", "python",  "ros",        "rviz",   "apps",      "nodes"};

std::size_t floor_of(const std::string& name) {
  return static_cast<std::size_t>(std::find(kFloors.begin(), kFloors.end(), name) - kFloors.begin());
}

struct Include {
  fs::path file;
  std::string floor;   // of the file
  std::string header;  // as written
};

/// Every #include of the library and the programs.
std::vector<Include> all_includes() {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex include("^\\s*#include [<\"]([^>\"]+)[>\"]");
  std::vector<Include> all;
  for (const char* tree : {"include/train_derail", "src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      if (!entry.is_regular_file()) continue;
      const std::string floor = fs::relative(entry.path(), root / tree).begin()->string();
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        std::smatch match;
        if (std::regex_search(line, match, include)) all.push_back({entry.path(), floor, match[1]});
      }
    }
  }
  return all;
}

TEST(House, FloorsIncludeOnlyWhatStandsBelow) {
  const std::regex own("^(?:train_derail/)?([a-z]+)/.*");
  const std::set<std::string> shared{"inputs/schema.hpp",         "inputs/checker.hpp", "inputs/tree_reader.hpp",
                                     "simulation/many_runs.hpp",  "simd/batch.hpp",     "simd/blocks.hpp",
                                     "simd/instruction_sets.hpp", "study/warnings.hpp"};
  int seen = 0;
  for (const Include& i : all_includes()) {
    std::smatch part;
    const std::size_t floor = floor_of(i.floor);
    if (floor == kFloors.size() || !std::regex_match(i.header, part, own)) continue;  // what lies on no floor
    const std::size_t included = floor_of(part[1]);
    if (included == kFloors.size()) continue;  // of another library
    // roscpp has a folder of that name as well.
    if (part[1] == "ros" && i.header.rfind("train_derail/", 0) != 0 && floor > floor_of("validation")) continue;
    if (part[1] == "rviz" && floor == floor_of("rviz")) continue;
    ++seen;
    EXPECT_LE(included, floor) << i.file << " includes " << i.header;
    // What is private to a floor is not for others, but for what several floors share and no user needs.
    const bool is_private = i.header.rfind("train_derail/", 0) != 0 && shared.count(i.header) == 0;
    EXPECT_TRUE(!is_private || included == floor) << i.file << " includes " << i.header;
  }
  EXPECT_GT(seen, 200);
}

TEST(House, TheCoreKnowsNoRosAndHeadersNoSolver) {
  const std::regex ros_header(
      "^(ros|rosbag|rosgraph_msgs|std_msgs|std_srvs|geometry_msgs|visualization_msgs|tf2.*|rviz|"
      "diagnostic_.*|actionlib.*|XmlRpc.*)/.*|XmlRpc.*");
  const std::regex own("^(?:train_derail/)?([a-z]+)/.*");
  int core = 0;
  for (const Include& i : all_includes()) {
    if (floor_of(i.floor) < floor_of("ros")) {
      ++core;
      EXPECT_FALSE(std::regex_match(i.header, ros_header)) << i.file << " includes " << i.header;
    }
    if (i.file.string().find("/include/train_derail/") == std::string::npos) continue;
    // Whoever installs the package has the public headers alone.
    std::smatch part;
    if (std::regex_match(i.header, part, own) && floor_of(part[1]) != kFloors.size() && part[1] != "ros" &&
        part[1] != "rviz") {
      EXPECT_EQ(i.header.rfind("train_derail/", 0), 0U) << i.file << " includes " << i.header;
    }
    for (const char* hidden : {"sundials", "nvector", "Simbody"}) {
      EXPECT_EQ(i.header.find(hidden), std::string::npos) << i.file << " includes " << i.header;
    }
  }
  EXPECT_GT(core, 300);
}

// Whoever includes a header is not to get all names of another namespace with it.
TEST(House, HeadersDoNotOpenNamespaces) {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex opens("^\\s*using namespace\\b");
  int files = 0;
  for (const char* tree : {"include/train_derail", "src"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      if (entry.path().extension() != ".hpp") continue;
      ++files;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);)
        EXPECT_FALSE(std::regex_search(line, opens)) << entry.path() << ": " << line;
    }
  }
  EXPECT_GT(files, 100);
}

// What is in a state is the model's own: others look at observations.
TEST(House, NobodyOutsideTheModelKnowsTheLayoutOfAState) {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex layout(
      "state_layout\\.hpp|model/state\\.hpp|model::(X|Y|THETA|VX|VY|OMEGA|WORK_ON_TRACK|WORK_OFF_TRACK|kCoordinates|"
      "kWorkTerms|motion|state_size)\\b");
  int files = 0, inside = 0;
  for (const char* tree : {"include/train_derail", "src", "examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".cpp" && extension != ".hpp") continue;
      ++files;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        if (!std::regex_search(line, layout)) continue;
        if (fs::relative(entry.path(), root / tree).begin()->string() == "model") ++inside;
        else ADD_FAILURE() << entry.path() << ": " << line;
      }
    }
  }
  EXPECT_GT(files, 150);
  EXPECT_GT(inside, 0);
}

// The second opinion would be none if it shared the model's physics.
TEST(House, TheMultibodyEngineIncludesNoneOfTheModelsPhysics) {
  const fs::path root = TRAIN_DERAIL_SOURCE_DIR;
  const std::regex include("^\\s*#include \"((?:train_derail|multibody)/[^\"]+)\"");
  std::vector<fs::path> open;
  for (const char* name :
       {"planar_engine", "observer", "simbody_run", "spatial_bar", "spatial_engine", "spatial_support", "start"})
    open.push_back(root / "src/multibody" / (std::string(name) + ".cpp"));
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
  const std::set<std::string> data{"attitude.hpp", "energy_ledger.hpp", "footprint.hpp", "train.hpp"};
  for (const fs::path& path : seen) {
    const std::string floor = path.parent_path().filename().string();
    EXPECT_TRUE(floor != "model" || data.count(path.filename().string()) > 0) << path;
    EXPECT_NE(floor, "simulation") << path;
  }
}

}  // namespace
