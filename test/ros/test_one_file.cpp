// One file, one train: what `derail` takes, roslaunch hands to the node as the same scenario.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/ros/parameters.hpp"

namespace train_derail::ros_face {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> texts() {
  const std::string train = "consist: [{name: hopper, count: 3, length: 53 ft, weight: 286 kip}]\n",
                    initial = "initial: {speed: 30 mph, yaw_rate: 0.1}\n";
  std::vector<std::string> all{
      train + initial,
      "consist:\n  - &hopper\n    name: hopper\n    count: 3\n    length: 53 ft\n    weight: 286 kip\n  - <<: "
      "*hopper\n    count: 2\n" +
          initial,
      "consist:\n  - &a {name: hopper, count: 3, length: 53 ft, weight: 286 kip}\n  - {count: 2, <<: [{count: 7, "
      "length: 50 ft}, *a]}\n" +
          initial,
      "x-cars: &a {name: hopper, count: 3, length: 53 ft, weight: 286 kip}\nconsist: [*a, {<<: *a, weight: 63 kip}, "
      "*a]\n" +
          initial,
      "consist: [&a {name: hopper, count: 3, length: 53 ft, weight: 286 kip}, &a {name: boxcar, count: 1, length: 50 "
      "ft, weight: 90 kip}, *a]\n" +
          initial,
      "x-p: &p {<<: &q {coupler: {slack: 0.1}}, stop: {time_max: 9}}\n<<: *p\n" + train + initial,
      train + initial + "---\ntitle: x\n",
      "---\n" + train + initial,
      "\xef\xbb\xbf" + train + initial,
      "consist: [{name: hopper, count: 3, length: 53 ft, weight: 286 kip}]\r\ninitial: {speed: 30 mph,\r\n yaw_rate: "
      "0.1}\r\n",
      train + initial + "title: |\n  two\n  lines\n",
      train + initial + "title: >-\n  two\n  lines\n\n  more\n",
      train + initial + "title: two\n  lines\n",
      train + initial + "title: \"two\\\n  lines \\x41 \\u00e4\"\n",
      train + initial + "title: 'it''s'\n",
      train + initial + "coupler:\n\tslack: 1\n",
      train + initial + "coupler: {slack:\t0.1}\n",
      train + initial + "coupler: {slack: 0.1, slack: 0.2}\n",
      train + initial + "solver: {method: !!str bdf}\n",
      train + initial + "title: a\u2028b\n",
      train + initial + "title: a # b\n",
      train + initial + "title: a#b\n"};
  for (const char* word : {"1e-6",
                           "1.0e-6",
                           "1.5e0",
                           "1E5",
                           ".5",
                           "5.",
                           "+1",
                           "-1",
                           "+1.5",
                           "0.1",
                           "1",
                           "2",
                           "08",
                           "010",
                           "0o10",
                           "0x10",
                           "0b1",
                           "1_0",
                           "1:30",
                           "1:30.5",
                           "0.30000000000000004",
                           "yes",
                           "no",
                           "on",
                           "off",
                           "y",
                           "n",
                           "true",
                           "True",
                           "false",
                           "~",
                           "null",
                           "",
                           "2001-12-14",
                           "2001-1-1",
                           ".inf",
                           "+.inf",
                           "-.inf",
                           ".Inf",
                           ".nan",
                           "inf",
                           "nan",
                           "=",
                           "<<",
                           "deg(5)",
                           "1 m",
                           "'1 m'",
                           "\"010\"",
                           "'yes'",
                           "60.0",
                           "3.0",
                           "3",
                           "+3",
                           "1.50",
                           "100000000000",
                           "2147483647",
                           "2147483648",
                           "none",
                           "1.0e+400",
                           "007",
                           "-0",
                           "_1"}) {
    for (const char* key : {"title: ", "coupler: {length: ", "coupler: {swing_moment_max: ", "solver: {steps_max: ",
                            "solver: {method: ", "initial: {speed: 1, yaw_rate: "}) {
      const bool own_initial = std::string(key).substr(0, 7) == "initial";
      all.push_back(train + (own_initial ? "" : initial) + key + word + (key[0] == 't' ? "" : "}") + "\n");
    }
    all.push_back(initial + "consist: [{name: " + std::string(word) + ", count: 3, length: 53 ft, weight: 286 kip}]\n");
    all.push_back(initial + "consist: [{name: x, count: " + std::string(word) + ", length: 53 ft, weight: 286 kip}]\n");
  }
  return all;
}

TEST(OneFile, IsOneTrainForBothReaders) {
  const fs::path folder = fs::temp_directory_path() / ("train_derail_one_file_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  const std::vector<std::string> all = texts();
  std::string command = "/usr/bin/python3 '" TRAIN_DERAIL_SOURCE_DIR "/test/ros/roslaunch_reading.py'";
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string path = (folder / (std::to_string(i) + ".yaml")).string();
    std::ofstream(path, std::ios::binary) << all[i];
    command += " '" + path + "'";
  }
  ASSERT_EQ(std::system((command + " > /dev/null").c_str()), 0);

  int taken = 0, refused = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string path = (folder / (std::to_string(i) + ".yaml")).string();
    std::string derail, node, problem;
    try {
      derail = inputs::to_yaml(inputs::read_scenario_file(path));
      ++taken;
    } catch (const inputs::InputError& e) {
      problem = e.what();
      ++refused;
    }
    if (std::ifstream xml(path + ".xml"); xml) {
      const std::string text((std::istreambuf_iterator<char>(xml)), {});
      int offset = 0;
      const XmlRpc::XmlRpcValue value(text, &offset);
      ASSERT_TRUE(value.valid()) << text;
      try {
        node = inputs::to_yaml(inputs::read_scenario(to_yaml_tree(value, "/n/scenario"), "/n/scenario"));
      } catch (const inputs::InputError&) {
      }
    }
    // What derail refuses, roslaunch may have turned into something that can be read; never the other way round.
    if (!derail.empty()) {
      EXPECT_EQ(derail, node) << all[i];
    }
    EXPECT_EQ(problem.find('\n'), std::string::npos);
  }
  EXPECT_GT(taken, 100);
  EXPECT_GT(refused, 100);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace train_derail::ros_face
