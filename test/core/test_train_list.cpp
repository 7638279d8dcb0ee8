// Train lists become blocks: what they say is taken, what they do not say is told, and what is wrong has its line.
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <vector>

#include "command_line.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/train_list.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail {
namespace {

using inputs::kFoot;
using inputs::kKip;
using test::derail;
using test::Result;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;
constexpr double kCoupler = 4.0 * kFoot;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class TrainLists : public test::Cli {
 protected:
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(at(name), std::ios::binary) << text;
    return at(name);
  }
  inputs::TrainList read(const std::string& text, const inputs::CarTypes& types = inputs::car_types()) const {
    return inputs::read_train_list(put("train.csv", text), types, kCoupler);
  }
  std::string error(const std::string& text) const {
    try {
      read(text);
    } catch (const inputs::InputError& e) {
      return std::string(e.what()).substr(at("train.csv").size());
    }
    return "no error";
  }
};

TEST_F(TrainLists, EqualNeighboursAreABlock) {
  const inputs::TrainList t = read(
      "Car Position,AAR Car Type,L/E,Gross Weight (tons),length_ft,Hazmat\n"
      "4,T108,L,143,59.5,UN1267\n"
      "1,D,,,,\n"
      "3,C113,e,,,no\n"
      "2,Covered Hopper,Empty,,,\n"
      "5,tank_car,L,286000 lb,59.5,\n");
  ASSERT_EQ(t.blocks.size(), 3U);
  EXPECT_EQ(t.blocks[0].cars.name, "locomotive");
  EXPECT_NEAR(t.blocks[0].cars.weight, 420 * kKip, 1e-3);
  EXPECT_EQ(t.blocks[1].cars.name, "hopper");
  EXPECT_EQ(t.blocks[1].type, "covered_hopper");
  EXPECT_EQ(t.blocks[1].cars.count, 2);
  EXPECT_EQ(t.blocks[1].first, 2);
  EXPECT_NEAR(t.blocks[1].cars.weight, 62 * kKip, 1e-3);
  EXPECT_NEAR(t.blocks[1].cars.length, 54.8 * kFoot, 1e-9);
  EXPECT_NEAR(*t.blocks[1].cars.roof_height, 15.5 * kFoot, 1e-9);
  const inputs::CarBlock& tank = t.blocks[2].cars;
  EXPECT_EQ(tank.count, 2);
  EXPECT_NEAR(tank.weight, 286 * kKip, 1e-3);
  EXPECT_NEAR(tank.length, 55.5 * kFoot, 1e-9);
  EXPECT_NEAR(*tank.truck_spacing, 46 * kFoot, 1e-9);
  EXPECT_FALSE(tank.roof_height);
  EXPECT_EQ(t.blocks[2].hazmat, std::vector<int>{4});
  EXPECT_EQ(
      t.assumptions,
      (std::vector<std::string>{
          "tons: short tons of 2000 lb", "gross weight of 1 car (locomotive 1): of the type, loaded",
          "gross weight of 2 cars (covered_hopper 2): of the type, empty",
          "length of 3 cars (covered_hopper 2, locomotive 1): of the type",
          "L, between the pins: length over the pulling faces less 4 ft, the coupler.length of the scenario",
          "width, truck spacing and heights of all cars: of the type; truck spacing in proportion to the length"}));
}

TEST_F(TrainLists, UnitsStandInTheHeaderOrBehindTheNumber) {
  for (const auto& [header, value] :
       {std::pair{"weight (kip)", "286"}, std::pair{"Weight_lb", "286000"}, std::pair{"GRL [short tons]", "143"},
        std::pair{"gross weight", "286 kip"}, std::pair{"gross (t)", "129.72741782"}, std::pair{"wt", "129727.41782kg"},
        std::pair{"Gross Weight kN", "1272.1913626"}}) {
    const inputs::TrainList t = read(std::string("kind,") + header + "\ntank," + value + "\n");
    EXPECT_NEAR(t.blocks[0].cars.weight, 286 * kKip, 0.1) << header;
  }
  for (const auto& [header, value] : {std::pair{"length (m)", "18.1356"}, std::pair{"Length_IN", "714"},
                                      std::pair{"len", "59.5 ft"}, std::pair{"car length mm", "18135.6"}}) {
    const inputs::TrainList t = read(std::string("kind,load,") + header + "\ntank,L," + value + "\n");
    EXPECT_NEAR(t.blocks[0].cars.length, 55.5 * kFoot, 1e-9) << header;
  }
}

TEST_F(TrainLists, WhatIsWrongHasLineColumnValueAndWhatIsAllowed) {
  for (const auto& [text, said] : std::vector<std::pair<std::string, std::string>>{
           {"", ": is empty"},
           {"kind,load\n", ": the train has no cars"},
           {"weight (kip)\n286\n", ":1: kind: no such column; allowed: kind, type, car type"},
           {"kind,load\ntank,L\ntnak,L\n", ":3: kind = 'tnak': unknown kind of car; allowed: near it: tank"},
           {"Kind,load\nzeppelin,L\n", ":2: Kind = 'zeppelin': unknown kind of car; allowed: locomotive, tank_car"},
           {"kind,load\n,L\n", "no kind of car"},
           {"kind,load\nX108,L\n", "kind = 'X108': unknown kind"},
           {"kind\ntank\n", ":2: gross weight: neither a gross weight nor loaded or empty"},
           {"kind,L/E\ntank,maybe\n", ":2: L/E = 'maybe': neither loaded nor empty; allowed: loaded, load, L"},
           {"kind,weight\ntank,286\n", ":2: weight = '286': no unit, neither here nor in the name of the column"},
           {"kind,weight (stone)\ntank,286\n", ":1: weight (stone) = '(stone)': unknown unit; allowed: tons"},
           {"kind,weight (lb)\ntank,\"286,000\"\n", "weight (lb) = '286,000': not a number"},
           {"kind,weight (lb)\ntank,28\n", "weight (lb) = '28': weight 124."},
           {"kind,weight (lb)\ntank,-1\n", "out of range"},
           {"kind,weight (lb)\ntank,nan\n", "not a finite number"},
           {"kind,load,length (ft)\ntank,L,3\n", "not longer than a coupler"},
           {"kind,load,length (ft)\ntank,L,5\n", "length (ft) = '5'"},
           {"kind,load,length (ft)\ntank,L,5950\n", "length (ft) = '5950': length 1812"},
           {"kind,load,Lenght (ft)\ntank,L,59\n",
            ":1: Lenght (ft): unknown column; allowed: 'length', or another name"},
           {"kind,type\ntank,tank\n", ":1: type: means the same as 'kind'"},
           {"pos,kind,load\n1,tank,L\n1,tank,L\n", ":3: pos = '1': the same as in line 2"},
           {"pos,kind,load\n1,tank,L\n3,tank,L\n", ":3: pos = '3': nothing stands at 2"},
           {"pos,kind,load\nfirst,tank,L\n", ":2: pos = 'first': not a place in a train"},
           {"kind,load,hazmat\ntank,L,perhaps\n", ":2: hazmat = 'perhaps': not understood"},
           {"kind,load,coupler\ntank,L,hook\n",
            ":2: coupler = 'hook': unknown coupler; allowed: E, E_shelf, F, rotary"},
           {"kind,load\ntank\n", ":2: 1 fields, but 2 columns"},
           {"kind,load\n\"tank,L\n", "a double quote is not closed"}}) {
    const std::string e = error(text);
    EXPECT_NE(e.find(said), std::string::npos) << text << e;
  }
  std::string many = "kind,load\n";
  for (int i = 0; i < 1001; ++i) many += "tank,L\n";
  EXPECT_NE(error(many).find(":1002: too many cars; allowed: at most 1000"), std::string::npos);
}

TEST_F(TrainLists, ContradictionsAndColumnsThatAreNotUsedAreTold) {
  const inputs::TrainList t =
      read("kind,load,weight (kip),Car Number,coupler\nboxcar,E,250,AB 1,E\nboxcar,L,,AB 2,F\n");
  const auto told = [&](const std::string& text) {
    return std::count(t.assumptions.begin(), t.assumptions.end(), text);
  };
  EXPECT_EQ(told("line 2: empty, but a gross weight of 250 kip: the weight is taken"), 1);
  EXPECT_EQ(told("columns that are not used: Car Number"), 1);
  EXPECT_EQ(
      told("couplers differ (cars: E 1, F 1): all get that of the group coupler; coupler_type of a block sets its own"),
      1);
  EXPECT_EQ(t.coupler, nullptr);
}

// Each car of a train of 150 differs from its neighbours.
TEST_F(TrainLists, AsManyDifferentCarsAsATrainHasBecomeAScenario) {
  const std::vector<inputs::CarType>& types = inputs::car_types().types;
  std::string text = "Seq,Kind,Gross Weight (tons),Hazmat,Coupler Type\n";
  for (int i = 1; i <= 150; ++i) {
    const inputs::CarType& type = types[static_cast<std::size_t>(i) % types.size()];
    const double tons = (type.empty + (type.loaded - type.empty) * (i % 7) / 7.0) / kKip / 2.0;
    text +=
        std::to_string(i) + "," + type.name + "," + std::to_string(tons) + "," + (i % 10 == 0 ? "Y" : "N") + ",SE\n";
  }
  put("train.csv", text);
  const Result made = derail("import consist " + at("train.csv") + " -o " + at("s.yaml"));
  ASSERT_EQ(made.code, 0) << made.out;
  const inputs::Scenario s = inputs::read_scenario_file(at("s.yaml"));
  EXPECT_EQ(s.consist.size(), 150U);
  EXPECT_EQ(s.coupler.slip_height, inputs::kInfinity);
  const std::string yaml = content(at("s.yaml"));
  EXPECT_NE(yaml.find("# car 20: "), std::string::npos);
  EXPECT_NE(yaml.find("# hazardous material: 20\n"), std::string::npos);
  // What is said at the end stands in the file.
  std::istringstream lines(made.out.substr(made.out.find('\n') + 1));
  int said = 0;
  for (std::string line; std::getline(lines, line); ++said)
    EXPECT_NE(yaml.find("# - " + line.substr(2) + "\n"), std::string::npos) << line;
  EXPECT_GE(said, 5);

  // The same train by its list, beside the scenario.
  put("by_file.yaml", "initial: {speed: 40 mph, yaw_rate: 0.2}\nconsist: {file: train.csv}\n");
  const inputs::Scenario by_file = inputs::read_scenario_file(at("by_file.yaml"));
  const auto cars = model::expand(s.consist), same = model::expand(by_file.consist);
  ASSERT_EQ(cars.size(), 150U);
  ASSERT_EQ(same.size(), cars.size());
  for (std::size_t i = 0; i < cars.size(); ++i) {
    EXPECT_NEAR(cars[i].weight, same[i].weight, 1e-8 * same[i].weight);
    EXPECT_NEAR(cars[i].length, same[i].length, 1e-7);
    EXPECT_NEAR(cars[i].truck_spacing, same[i].truck_spacing, 1e-7);
    EXPECT_NEAR(cars[i].centre_height, same[i].centre_height, 1e-7);
    EXPECT_NEAR(cars[i].roof_height, same[i].roof_height, 1e-7);
  }
  EXPECT_EQ(derail("run --quiet " + at("s.yaml") + " --set stop.time_max=0.1").code, 0);
}

TEST_F(TrainLists, AScenarioNamesATrainListBesideItself) {
  std::filesystem::create_directory(at("trains"));
  put("trains/train.csv", "kind,load\ntank,L\ntank,L\nboxcar,E\n");
  put("trains/base.yaml",
      "initial: {speed: 40 mph, yaw_rate: 0.2}\ncoupler: {length: 3 ft}\nconsist: {file: train.csv}\n");
  put("own.yaml", "base: trains/base.yaml\ntitle: mine\n");
  const inputs::Scenario s = inputs::read_scenario_file(at("own.yaml"), {{"consist[1].weight", "100 kip"}});
  ASSERT_EQ(s.consist.size(), 2U);
  EXPECT_EQ(s.consist[0].count, 2);
  EXPECT_NEAR(s.consist[0].length, 56.5 * kFoot, 1e-9);
  EXPECT_NEAR(s.consist[1].weight, 100 * kKip, 1e-6);
  const auto shorter = inputs::read_scenario_file(at("own.yaml"), {{"coupler.length", "2 ft"}});
  EXPECT_NEAR(shorter.consist[0].length, 57.5 * kFoot, 1e-9);
  // Nothing is assumed in silence.
  const Result checked = derail("check " + at("own.yaml"));
  EXPECT_EQ(checked.code, 0);
  EXPECT_NE(checked.out.find("derail: warning: consist: a train list; assumed: order: as the rows stand"),
            std::string::npos);
  EXPECT_NE(checked.out.find("; gross weight of 2 cars (tank_car 2): of the type, loaded; "), std::string::npos);
  EXPECT_EQ(s.assumptions.size(), 6U);
  // A list of its own replaces the train list, and the other way round.
  put("list.yaml", "base: trains/base.yaml\nconsist: [{count: 1, length: 50 ft, weight: 100 kip}]\n");
  EXPECT_EQ(inputs::read_scenario_file(at("list.yaml")).consist[0].count, 1);
  put("over.yaml", "base: list.yaml\nconsist: {file: trains/train.csv}\n");
  EXPECT_EQ(inputs::read_scenario_file(at("over.yaml")).consist.size(), 2U);
  for (const auto& [consist, said] :
       {std::pair{"{fiel: trains/train.csv}", "consist.fiel = "},
        std::pair{"{types: a.yaml}", "no file of a train list"},
        std::pair{"{file: none.csv}", "none.csv: cannot be read: no such file"},
        std::pair{"{file: [a, b]}", "wrong.yaml:2: consist.file = '[a, b]'"},
        std::pair{"{file: trains/train.csv, file: b.csv}", "wrong.yaml:2: consist.file = 'b.csv': key given twice"},
        std::pair{"{types: none.yaml}", "wrong.yaml:2: consist.file: no file of a train list"},
        std::pair{"{file: trains/train.csv}\ncoupler: {length: 400 ft}",
                  "wrong.yaml:3: coupler.length = '400 ft': out of range"},
        std::pair{"{}", "no file of a train list"}}) {
    put("wrong.yaml", std::string("initial: {speed: 40 mph, yaw_rate: 0.2}\nconsist: ") + consist + "\n");
    const Result wrong = derail("check " + at("wrong.yaml"));
    EXPECT_EQ(wrong.code, 2);
    EXPECT_NE(wrong.out.find(said), std::string::npos) << wrong.out;
  }
}

TEST_F(TrainLists, TypesOfOnesOwnComeFirst) {
  put("types.yaml",
      "types:\n"
      "  - {name: sand_hopper, body: hopper, codes: [C], also: [sand], length: 42 ft, width: 10 ft, truck_spacing: 28 "
      "ft,\n"
      "     empty: 55 kip, loaded: 286 kip, centre_empty: 1.3 m, centre_loaded: 2 m}\n");
  const inputs::CarTypes types = inputs::car_types(at("types.yaml"));
  const inputs::TrainList t = read("kind,load\nC114,L\nsand,E\ntank,L\n", types);
  ASSERT_EQ(t.blocks.size(), 3U);
  EXPECT_EQ(t.blocks[0].type, "sand_hopper");
  EXPECT_NEAR(*t.blocks[0].cars.centre_height, 2.0, 1e-9);
  EXPECT_NEAR(*t.blocks[1].cars.centre_height, 1.3, 1e-9);
  EXPECT_EQ(t.blocks[2].type, "tank_car");
  for (const auto& [change, said] :
       {std::pair{"types: [{name: a, body: hopper, length: 42 ft}]", "types[0].width: missing"},
        std::pair{"types: [{name: a, wheels: 8}]", "types[0].length: missing"},
        std::pair{"couplers: []\ntypes: 3", "not a list"}, std::pair{"bodies: []", "unknown key"},
        std::pair{
            "types: [{name: a, body: b, codes: [tank], length: 42 ft, width: 10 ft, truck_spacing: 28 ft, empty: 5 "
            "kip, loaded: 6 kip}]",
            "wrong.yaml:1: types[0].codes = '[tank]': not the first letter of a code; allowed: [A, B, ...]"},
        std::pair{
            "types: [{name: a, body: b, length: 42 ft, width: 10 ft, truck_spacing: 58 ft, empty: 5 kip, loaded: 6 "
            "kip}]",
            "wrong.yaml:1: types[0].truck_spacing = '58 ft': larger than the length"},
        std::pair{"\ntypes:\n- {name: a, body: b, length: 420 ft, width: 10 ft, truck_spacing: 28 ft, empty: 5 kip,"
                  " loaded: 6 kip}",
                  "wrong.yaml:3: types[0].length = '420 ft': out of range; allowed: [1, 100] m"}}) {
    put("wrong.yaml", change);
    try {
      inputs::car_types(at("wrong.yaml"));
      ADD_FAILURE() << change;
    } catch (const inputs::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
    }
  }
}

TEST_F(TrainLists, NamesAreQuotedAndPathsAreThoseOfTheReader) {
  // A type and a base with signs that mean something in YAML.
  put("types.yaml",
      "types: [{name: odd, body: \"a: #b\", length: 42 ft, width: 10 ft, truck_spacing: 28 ft, empty: 55 kip, loaded: "
      "286 kip}]\n");
  std::filesystem::create_directory(at("deep"));
  std::filesystem::create_directory_symlink(at("deep"), at("link"));
  put("a\"b: #.yaml", "initial: {speed: 40 mph, yaw_rate: 0.2}\n");
  put("train.csv", "kind,load\nodd,L\n");
  const Result made = derail("import consist " + at("train.csv") + " --types " + at("types.yaml") + " --base '" +
                             at("a\"b: #.yaml") + "' -o " + at("link/s.yaml"));
  ASSERT_EQ(made.code, 0) << made.out;
  const inputs::Scenario s = inputs::read_scenario_file(at("link/s.yaml"));
  EXPECT_EQ(s.consist[0].name, "a: #b");
  EXPECT_NEAR(s.initial.speed, 40 * inputs::kMph, 1e-9);
  EXPECT_NE(content(at("link/s.yaml")).find("base: \"../a\\\"b: #.yaml\"\n"), std::string::npos);
}

TEST_F(TrainLists, ABaseWithAWrongCouplerIsToldByItsFile) {
  put("train.csv", "kind,load\ntank,L\n");
  put("base.yaml", "initial: {speed: 40 mph, yaw_rate: 0.2}\ncoupler: {length: -4 ft}\n");
  const Result r = derail("import consist " + at("train.csv") + " --base " + at("base.yaml"));
  EXPECT_EQ(r.code, 2);
  EXPECT_NE(r.out.find("base.yaml:2: coupler.length = '-4 ft': out of range; allowed: [0.1, 10] m"), std::string::npos)
      << r.out;
}

TEST_F(TrainLists, TheTypesOfThePackageAreAllReached) {
  const inputs::CarTypes& all = inputs::car_types();
  ASSERT_GE(all.types.size(), 14U);
  std::set<std::string> seen;
  for (const inputs::CarType& t : all.types) {
    EXPECT_EQ(all.type(t.name), &t);
    for (const std::string& word : t.also) EXPECT_EQ(all.type(word), &t) << word;
    for (const std::string& code : t.codes) {
      EXPECT_EQ(all.type(code + "123"), &t) << code;
      EXPECT_TRUE(seen.insert(code).second) << code;
    }
  }
  EXPECT_EQ(all.type("C12"), nullptr);
  EXPECT_EQ(all.type(""), nullptr);
}

TEST_F(TrainLists, TheListWritesNoFileTwiceAndNamesItsBase) {
  put("train.csv", "kind,load\ntank,L\n");
  const Result first = derail("import consist " + at("train.csv") + " -o " + at("s.yaml") + " --base " + kSource +
                              "/config/accident.yaml");
  ASSERT_EQ(first.code, 0) << first.out;
  EXPECT_EQ(derail("check " + at("s.yaml") + " --set initial.cars_ahead=0").code, 0);
  EXPECT_EQ(derail("import consist " + at("train.csv") + " -o " + at("s.yaml")).code, 1);
  EXPECT_EQ(derail("import consist --force " + at("train.csv") + " -o " + at("train.csv")).code, 2);
  EXPECT_EQ(derail("import consist " + at("none.csv")).code, 2);
  EXPECT_EQ(derail("import consist " + kSource).code, 2);
  const Result out = derail("import consist " + at("train.csv"), false);
  EXPECT_EQ(out.out.substr(0, 17), "# From train.csv ");
}

// The library parses its own text without looking for what roslaunch would read otherwise.
TEST_F(TrainLists, TheFilesOfThePackageAreReadAsAnyOther) {
  for (const char* name : {"car_bodies.yaml", "car_types.yaml"})
    EXPECT_NO_THROW(inputs::load_file(kSource + "/config/types/" + name)) << name;
  const std::size_t twice = inputs::car_types(kSource + "/config/types/car_types.yaml").types.size();
  EXPECT_EQ(twice, 2 * inputs::car_types().types.size());
}

// One place for each fact: the pages have what the file and the program have.
TEST_F(TrainLists, ThePagesHaveTheTables) {
  EXPECT_NE(content(kSource + "/docs/import.md").find(inputs::describe_train_lists(inputs::car_types())),
            std::string::npos)
      << "docs/import.md has to hold what `derail import types` prints";
  const std::string page = content(kSource + "/docs/spatial_model.md");
  for (const inputs::CarBody& b : inputs::car_bodies()) {
    std::array<char, 200> row{};
    const std::string name = b.name.empty() ? "any other" : "`" + b.name + "`";
    const bool rises = b.centre_empty != b.centre_loaded;
    if (rises)
      std::snprintf(row.data(), row.size(),
                    "| %s | %.2f to %.2f m | %.2f m | %.2f m | %.2f m, %.2f m | %.1f kip | %.2f m2 |", name.c_str(),
                    b.centre_empty, b.centre_loaded, b.floor, b.roof, b.underframe, b.underframe_width, b.truck / kKip,
                    b.roll_inertia);
    else
      std::snprintf(row.data(), row.size(), "| %s | %.2f m | %.2f m | %.2f m | %.2f m, %.2f m | %.1f kip | %.2f m2 |",
                    name.c_str(), b.centre_empty, b.floor, b.roof, b.underframe, b.underframe_width, b.truck / kKip,
                    b.roll_inertia);
    EXPECT_NE(page.find(row.data()), std::string::npos) << row.data();
    EXPECT_EQ(b.empty, 65 * kKip);
    EXPECT_EQ(b.loaded, 263 * kKip);
  }
}

}  // namespace
}  // namespace train_derail
