// The parameters of the node and what a restart may read, without a master.
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "folder.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/simulation_loop.hpp"

namespace train_derail::ros_face {
namespace {

using XmlRpc::XmlRpcValue;

XmlRpcValue from_xml(const std::string& members) {
  int offset = 0;
  return XmlRpcValue("<value><struct>" + members + "</struct></value>", &offset);
}
std::string member(const std::string& name, const std::string& value) {
  return "<member><name>" + name + "</name><value>" + value + "</value></member>";
}

TEST(Parameters, NumbersKeepEveryDigitOnTheWayToYaml) {
  const double awkward[] = {0.1, 1.0 / 3.0, 1e-300, 123456789.123456789, -2.5e17};
  for (const double x : awkward) {
    const YAML::Node node = to_yaml_tree(XmlRpcValue(x), "x");
    EXPECT_EQ(std::strtod(node.Scalar().c_str(), nullptr), x);
  }
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(std::numeric_limits<double>::infinity()), "x").Scalar(), ".inf");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(3), "x").Scalar(), "3");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(true), "x").Scalar(), "true");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue("50e6 lbf/ft"), "x").Scalar(), "50e6 lbf/ft");
}

TEST(Parameters, TreesKeepTheirShape) {
  XmlRpcValue tree;
  tree["consist"][0]["count"] = 3;
  tree["consist"][1]["count"] = 4;
  tree["ground"]["on_track_law"] = "guided";
  const YAML::Node yaml = to_yaml_tree(tree, "/n/scenario");
  EXPECT_EQ(yaml["consist"].size(), 2U);
  EXPECT_EQ(yaml["consist"][1]["count"].Scalar(), "4");
  EXPECT_EQ(yaml["ground"]["on_track_law"].Scalar(), "guided");
}

TEST(Parameters, DefaultsAndValues) {
  const NodeParameters d = read_node_parameters(XmlRpcValue(), "/n");
  EXPECT_EQ(d.rate, 1.0);
  EXPECT_FALSE(d.start_paused);
  XmlRpcValue tree;
  tree["rate"] = "5e-1";
  tree["publish"]["clock"] = false;
  tree["publish"]["markers_every"] = 2;
  tree["events"]["coupler_force"] = "500 kip";
  tree["scenario"]["anything"] = 1;
  const NodeParameters p = read_node_parameters(tree, "/n");
  EXPECT_EQ(p.rate, 0.5);
  EXPECT_FALSE(p.publish_clock);
  EXPECT_EQ(p.stream.markers_every, 2);
  EXPECT_NEAR(p.event_coupler_force, 500.0 * inputs::kKip, 1e-3);
}

void expect_refused(const std::string& xml, const std::string& key, const std::string& value,
                    const std::string& allowed) {
  try {
    read_node_parameters(from_xml(xml), "/n");
    ADD_FAILURE() << "accepted: " << xml;
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.where(), "/n");
    EXPECT_EQ(e.key(), key);
    EXPECT_EQ(e.value(), value);
    EXPECT_NE(e.allowed().find(allowed), std::string::npos) << e.what();
  }
}

TEST(Parameters, MistakesNameParameterValueAndRange) {
  expect_refused(member("rate", "<double>-1</double>"), "rate", "-1", "0.001 to 1000");
  expect_refused(member("rate", "<double>nan</double>"), "rate", "nan", "0.001 to 1000");
  expect_refused(member("rate", "<string>fast</string>"), "rate", "fast", "");
  expect_refused(member("rate", "<string>2 m</string>"), "rate", "2 m", "");
  expect_refused(member("start_paused", "<int>1</int>"), "start_paused", "1", "true, false");
  expect_refused(member("frame_prefix", "<string>/a</string>"), "frame_prefix", "/a", "not beginning with /");
  expect_refused(member("raet", "<double>1</double>"), "raet", "1", "rate");
  expect_refused(member("publish", "<struct>" + member("clok", "<boolean>1</boolean>") + "</struct>"), "publish/clok",
                 "true", "publish/clock");
  expect_refused(member("publish", "<struct>" + member("markers_every", "<double>1.5</double>") + "</struct>"),
                 "publish/markers_every", "1.5", "0 to 1000");
  expect_refused(member("publish", "<boolean>1</boolean>"), "publish", "true", "publish/clock");
  expect_refused(member("events", "<struct>" + member("coupler_force", "<string>5 m</string>") + "</struct>"),
                 "events/coupler_force", "5 m", "N");
}

TEST(Parameters, SpeedAndSetBecomeOverrides) {
  XmlRpcValue tree;
  tree["scenario"]["title"] = "x";
  tree["speed"] = "50 mph";
  tree["set"] = " initial.yaw_rate=0.3;coupler.slack = 1 in ; initial.speed=10; ";
  const ScenarioSource source = read_scenario_source(tree, "/n");
  ASSERT_EQ(source.overrides.size(), 3U);
  EXPECT_EQ(source.overrides.back().key, "initial.speed");
  EXPECT_EQ(source.overrides.back().value, "10");
  EXPECT_THROW(read_scenario_source(XmlRpcValue(), "/n"), inputs::InputError);
}

/// A folder of results, and one beside it of which nothing may be read.
class Restarts : public test::Folder {
 protected:
  void SetUp() override {
    for (const char* name : {"results", "outside"}) {
      std::filesystem::create_directory(folder_ / name);
      const std::string in = std::string(name) + "/";
      write(in + "base.yaml", kScenario);
      write(in + "train.csv", "Car Kind,L/E\nhopper,L\nhopper,L\n");
      write(in + "broken.yaml", "secret-4711: {\n");
    }
    std::filesystem::create_directory_symlink(folder_ / "outside", folder_ / "results" / "link");
    bounds_ = std::make_shared<const FileBounds>(at("results"), std::vector<std::string>());
  }
  std::string outside(const std::string& name) const { return at("outside/" + name); }
  /// What is said against a restart; empty if it could begin.
  std::string refusal(const std::string& scenario) const { return refusal_of({scenario, {}, {}, true}); }
  std::string refusal_of(const RestartRequest& request) const {
    try {
      prepare(request, ScenarioSource(), bounds_);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }

  static constexpr char kScenario[] =
      "consist: [{count: 3, length: 18 m, weight: 265 kip}]\ninitial: {speed: 10, yaw_rate: 0.1}\nstop: {time_max: "
      "1}\n";
  std::shared_ptr<const FileBounds> bounds_;
};

TEST_F(Restarts, ReadWhatTheNodeMayReadAndNothingElse) {
  const auto with_base = [](const std::string& file) { return "base: " + file + "\ninitial: {speed: 12}\n"; };
  const std::string own = "initial: {speed: 10, yaw_rate: 0.1}\nconsist: ";
  EXPECT_EQ(refusal(kScenario), "");
  EXPECT_EQ(refusal(with_base("base.yaml")), "");
  EXPECT_EQ(refusal(with_base((folder_ / "results" / "base.yaml").string())), "");
  EXPECT_EQ(refusal(own + "{file: train.csv}\n"), "");

  const auto expect_outside = [&](const std::string& scenario) {
    const std::string said = refusal(scenario);
    EXPECT_NE(said.find("~restart: base or consist"), std::string::npos) << said;
    EXPECT_NE(said.find("outside of what may be read"), std::string::npos) << said;
    EXPECT_EQ(said.find("secret-4711"), std::string::npos) << said;
  };
  for (const std::string& file :
       {outside("base.yaml"), outside("broken.yaml"), outside("none.yaml"), std::string("../outside/base.yaml"),
        std::string("link/base.yaml"), std::string("/etc/passwd"), std::string("/etc/nonexistent")}) {
    expect_outside(with_base(file));
    expect_outside(own + "{file: " + file + "}\n");
    expect_outside(own + "{file: train.csv, types: " + file + "}\n");
  }
  // Nor by way of a base that may be read.
  std::ofstream(folder_ / "results" / "middle.yaml") << with_base("../outside/base.yaml");
  expect_outside(with_base("middle.yaml"));
  std::ofstream(folder_ / "results" / "middle.yaml") << own << "{file: ../outside/train.csv}\n";
  expect_outside(with_base("middle.yaml"));
}

TEST_F(Restarts, ByParametersReadTheFilesThatTheNodeStartedWith) {
  XmlRpcValue tree;
  tree["scenario"]["base"] = outside("base.yaml");
  EXPECT_NE(refusal_of({"", tree, {}, true}).find("outside of what may be read"), std::string::npos);
  FileBounds known = *bounds_;
  const ScenarioSource source = read_scenario_source(tree, "/n");
  EXPECT_EQ(source.files(), std::vector<std::string>{outside("base.yaml")});
  for (const std::string& file : source.files()) known.allow(file);
  bounds_ = std::make_shared<const FileBounds>(known);
  EXPECT_EQ(refusal_of({"", tree, {}, true}), "");
  tree["scenario"]["base"] = outside("broken.yaml");
  EXPECT_NE(refusal_of({"", tree, {}, true}).find("outside of what may be read"), std::string::npos);
}

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
