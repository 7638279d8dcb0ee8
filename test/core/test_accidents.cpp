// Tables of accidents: how they are read, trains made from their rows, the class that a base was fitted on.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/validation/drawn_train.hpp"
#include "train_derail/validation/validation.hpp"
#include "validation_fixtures.hpp"

namespace train_derail {
namespace {

using validation::Accident;

const std::string kSource = TRAIN_DERAIL_SOURCE_DIR;
constexpr double kShortTon = 2000.0 * inputs::kPoundForce;

/// Locomotives, hoppers, and a tank car that stands for the last car.
inputs::Scenario base() {
  inputs::Scenario s;
  inputs::CarBlock locomotive, car, last;
  locomotive.name = "locomotive";
  locomotive.count = car.count = last.count = 1;
  locomotive.length = 22.0;
  locomotive.weight = 1.9e6;
  car.name = "hopper";
  car.length = 16.0;
  car.weight = 1.0e6;
  last = car;
  last.name = "tank_car";
  last.brake_source = inputs::BrakeSource::remote;
  s.consist = {car, locomotive, last};
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 0.002;
  s.initial.speed = 1.0;
  s.initial.yaw_rate = 0.1;
  return s;
}

Accident accident(int position, int tail) {
  Accident a;
  a.line = 2;
  a.speed_mph = 30.0;
  a.n_cars = position - 1 + tail;
  a.tons_per_car = 140.0;
  a.first_car_position = position;
  a.cars_from_pod_to_rear = tail;
  a.cars_derailed = 5;
  return a;
}

/// "2 locomotive, 4 hopper, ..." with a star where the brake pipe is vented.
std::string train(const inputs::Scenario& s) {
  std::string text;
  for (const inputs::CarBlock& b : s.consist) {
    text += (text.empty() ? "" : ", ") + std::to_string(b.count) + " " + b.name +
            (b.brake_source == inputs::BrakeSource::remote ? "*" : "");
  }
  return text;
}

TEST(Rows, MakeTheTrain) {
  Accident a = accident(5, 6);
  a.head_end_locos = 2;
  a.rear_locos = 1;
  const inputs::Scenario s = validation::scenario_of(base(), a);
  EXPECT_EQ(train(s), "2 locomotive, 9 hopper, 1 tank_car*, 1 locomotive*");
  EXPECT_EQ(s.initial.cars_ahead, 6);
  EXPECT_DOUBLE_EQ(s.initial.speed, 30.0 * inputs::kMph);
  EXPECT_DOUBLE_EQ(s.consist[1].weight, 140.0 * kShortTon);
  EXPECT_DOUBLE_EQ(s.consist[2].weight, 140.0 * kShortTon);
  EXPECT_DOUBLE_EQ(s.consist[0].weight, 1.9e6);
  EXPECT_DOUBLE_EQ(s.consist[3].length, 22.0);
  EXPECT_NO_THROW(inputs::validate(s));
}

TEST(Rows, LocomotivesInTheMiddleAreAheadOrBehind) {
  Accident a = accident(5, 6);
  a.head_end_locos = 1;
  a.mid_locos = 2;
  const inputs::Scenario behind = validation::scenario_of(base(), a);
  EXPECT_EQ(train(behind), "1 locomotive, 5 hopper, 2 locomotive*, 4 hopper, 1 tank_car*");
  EXPECT_EQ(behind.initial.cars_ahead, 5);  // the fifth car still stands before them
  a = accident(6, 5);
  a.head_end_locos = 1;
  a.mid_locos = 2;
  EXPECT_EQ(validation::scenario_of(base(), a).initial.cars_ahead, 8);
}

TEST(Rows, ASingleCarIsTheLastOne) {
  EXPECT_EQ(train(validation::scenario_of(base(), accident(1, 1))), "1 tank_car*");
  EXPECT_EQ(train(validation::scenario_of(base(), accident(3, 1))), "2 hopper, 1 tank_car*");
}

TEST(Rows, ABaseWithoutLocomotivesGetsNone) {
  inputs::Scenario cars = base();
  cars.consist = {cars.consist[0]};
  Accident a = accident(5, 6);
  a.head_end_locos = 2;
  a.mid_locos = 1;
  a.rear_locos = 1;
  const inputs::Scenario s = validation::scenario_of(cars, a);
  EXPECT_EQ(train(s), "10 hopper");
  EXPECT_EQ(s.initial.cars_ahead, 4);
}

TEST(Rows, ABaseWithoutCarsIsRefused) {
  inputs::Scenario none = base();
  none.consist = {none.consist[1]};
  EXPECT_THROW(validation::scenario_of(none, accident(5, 6)), inputs::InputError);
}

/// A train of so many loads and empties, of the mean weight of a car in tons.
Accident mixed(int loads, int empties, double tons) {
  Accident a = accident(5, loads + empties - 4);
  a.loaded_cars = loads;
  a.empty_cars = empties;
  a.tons_per_car = tons;
  return a;
}

TEST(MixedTrains, KeepCountsAndTotalWeight) {
  for (const auto& [loads, empties, tons] : {std::tuple{60, 40, 90.0}, {1, 99, 33.0}, {50, 1, 128.0}, {3, 7, 40.0}}) {
    const Accident a = mixed(loads, empties, tons);
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const auto drawn = validation::draw_train(a, seed);
      ASSERT_TRUE(drawn);
      EXPECT_EQ(std::count(drawn->empty.begin(), drawn->empty.end(), true), empties);
      EXPECT_EQ(std::count(drawn->empty.begin(), drawn->empty.end(), false), loads);
      EXPECT_NEAR(loads * drawn->loaded_tons + empties * drawn->empty_tons, tons * (loads + empties), 1e-9);
      EXPECT_GE(drawn->empty_tons, validation::kEmptyTonsMin);
      EXPECT_LE(drawn->empty_tons, validation::kEmptyTonsMax);
      EXPECT_GE(drawn->loaded_tons, drawn->empty_tons);
      EXPECT_LE(drawn->loaded_tons, validation::kLoadTonsMax + 1e-9);
      const inputs::Scenario s = validation::scenario_of(base(), a, seed);
      int cars = 0;
      double weight = 0.0;
      for (const inputs::CarBlock& b : s.consist) {
        cars += b.count;
        weight += b.count * b.weight;
      }
      EXPECT_EQ(cars, loads + empties);
      EXPECT_NEAR(weight / kShortTon, tons * (loads + empties), 1e-6);
      EXPECT_EQ(s.consist.back().brake_source, inputs::BrakeSource::remote);
      EXPECT_EQ(s.initial.cars_ahead, 4);
      EXPECT_NO_THROW(inputs::validate(s));
    }
  }
}

TEST(MixedTrains, DifferFromSeedToSeedButNotFromCallToCall) {
  const Accident a = mixed(60, 40, 90.0);
  const auto one = validation::draw_train(a, 1), again = validation::draw_train(a, 1);
  EXPECT_EQ(one->empty, again->empty);
  EXPECT_EQ(one->empty_tons, again->empty_tons);
  std::set<std::vector<bool>> orders;
  std::set<std::size_t> blocks;
  int first_empty = 0;
  constexpr int kSeeds = 600;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto drawn = validation::draw_train(a, seed);
    orders.insert(drawn->empty);
    std::size_t changes = 1;
    for (std::size_t i = 1; i < drawn->empty.size(); ++i) changes += drawn->empty[i] != drawn->empty[i - 1] ? 1 : 0;
    blocks.insert(std::min<std::size_t>(changes, 11));
    first_empty += drawn->empty.front() ? 1 : 0;
  }
  EXPECT_EQ(blocks, (std::set<std::size_t>{2, 3, 4, 6, 10, 11}));  // 11: mixed
  EXPECT_GT(orders.size(), 400u);
  EXPECT_NEAR(first_empty, kSeeds * (5 * 0.5 + 0.4) / 6, 4 * std::sqrt(kSeeds * 0.25));
}

TEST(MixedTrains, AreNotDrawnWhereTheTableTellsAllOrNothing) {
  EXPECT_FALSE(validation::draw_train(accident(5, 6), 1));
  EXPECT_FALSE(validation::draw_train(mixed(100, 0, 130.0), 1));
  const inputs::Scenario heavy = validation::scenario_of(base(), mixed(100, 0, 130.0), 7);
  EXPECT_EQ(train(heavy), "99 hopper, 1 tank_car*");
  EXPECT_DOUBLE_EQ(heavy.consist[0].length, 16.0);
}

TEST(MixedTrains, OfWhichTheTonsDoNotFitHaveCarsOfOneWeight) {
  const auto drawn = validation::draw_train(mixed(50, 50, 22.0), 3);  // lighter than any empty
  EXPECT_EQ(drawn->loaded_tons, 22.0);
  EXPECT_EQ(drawn->empty_tons, 22.0);
}

TEST(MixedTrains, HaveKindsThatMayHaveTheirWeight) {
  std::set<std::string> loads, empties;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto drawn = validation::draw_train(mixed(50, 50, 55.0), seed);
    ASSERT_NE(drawn->loaded_type, nullptr);
    ASSERT_NE(drawn->empty_type, nullptr);
    EXPECT_LE(drawn->loaded_tons * kShortTon, 1.05 * drawn->loaded_type->loaded + 1.0);
    EXPECT_NEAR(drawn->empty_tons * kShortTon, drawn->empty_type->empty, 0.2 * drawn->empty_type->empty + 1.0);
    loads.insert(drawn->loaded_type->name);
    empties.insert(drawn->empty_type->name);
  }
  EXPECT_GT(loads.size(), 3u);
  EXPECT_GT(empties.size(), 3u);
  for (const auto* names : {&loads, &empties})
    EXPECT_EQ(names->count("locomotive") + names->count("passenger_car"), 0u);
  const auto heavy = validation::draw_train(mixed(98, 2, 140.0), 1);
  EXPECT_EQ(heavy->loaded_type, nullptr) << "heavy loads are the base's own cars";
}

TEST(MixedTrains, HaveTheHeightsOfTheirKinds) {
  std::set<std::string> kinds;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const Accident a = mixed(50, 50, 55.0);
    const auto drawn = validation::draw_train(a, seed);
    const inputs::CarType& type = *(drawn->empty.front() ? drawn->empty_type : drawn->loaded_type);
    const inputs::CarBlock block = validation::scenario_of(base(), a, seed).consist[0];
    EXPECT_EQ(block.name, type.body);
    EXPECT_EQ(block.width, type.width);
    EXPECT_EQ(block.floor_height, type.floor);
    EXPECT_EQ(block.roof_height, type.roof);
    EXPECT_EQ(block.underframe_height, type.underframe);
    EXPECT_EQ(block.underframe_width, type.underframe_width);
    EXPECT_EQ(block.centre_height.has_value(), type.centre_empty || type.centre_loaded);
    kinds.insert(type.name);
  }
  EXPECT_EQ(kinds.count("gondola") + kinds.count("well_car") + kinds.count("autorack"), 3U);
}

TEST(Rows, LocomotivesAreCountedApart) {
  Accident a = accident(2, 3);
  a.head_end_locos = 2;
  a.rear_locos = 1;
  const inputs::Scenario s = validation::scenario_of(base(), a);
  simulation::Snapshot snapshot = simulation::Simulation(s).snapshot();
  ASSERT_EQ(snapshot.cars.size(), 7u);
  for (const std::size_t derailed : {1, 3, 4, 6}) snapshot.cars[derailed].derailed = true;
  for (const std::size_t whole : {0, 2, 5}) snapshot.cars[whole].derailed = false;
  const validation::Derailed d = validation::count_derailed(s, snapshot);
  EXPECT_EQ(d.cars, 2);
  EXPECT_EQ(d.locomotives, 2);
}

using Accidents = test::Validate;

TEST_F(Accidents, ReadsATable) {
  const validation::AccidentTable t = table();
  ASSERT_EQ(t.rows.size(), 3u);
  const Accident& a = t.rows[1];
  EXPECT_EQ(a.line, 3u);
  EXPECT_EQ(a.fields[0], "TWO, NORTH");
  EXPECT_EQ(a.speed_mph, 12.5);
  EXPECT_EQ(a.n_cars, 5);
  EXPECT_EQ(a.tons_per_car, 130.0);
  EXPECT_EQ(a.head_end_locos, 1);
  EXPECT_EQ(a.mid_locos, 0);
  EXPECT_EQ(a.rear_locos, 1);
  EXPECT_EQ(a.first_car_position, 1);
  EXPECT_EQ(a.cars_from_pod_to_rear, 5);
  EXPECT_EQ(a.cars_derailed, 2);
  std::string windows;
  for (const char c : kTable) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(table(windows).rows[2].cars_derailed, 5);
}

TEST_F(Accidents, TheExampleShipped) {
  const validation::AccidentTable t = validation::read_accidents(kSource + "/config/accidents/example.csv");
  EXPECT_EQ(t.rows.size(), 10u);
  const study::Study s = study::read_study_file(kSource + "/config/studies/accident_validation.yaml");
  EXPECT_EQ(validation::members_a_row(s), 19);
  for (const Accident& a : t.rows) EXPECT_NO_THROW(inputs::validate(validation::scenario_of(s.base, a))) << a.line;
}

TEST_F(Accidents, BadTablesAreRefusedByFileLineColumnValue) {
  const auto with = [](const std::string& was, const std::string& is) {
    std::string text = kTable;
    return text.replace(text.find(was), was.size(), is);
  };
  const std::string file = (folder_ / "table.csv").string();
  EXPECT_EQ(refusal(with("tons_per_car", "tons")),
            file + ":1: tons_per_car: missing column; allowed: a column of this name (docs/validation.md)");
  EXPECT_EQ(refusal(with("ONE,31", "ONE,fast")),
            file + ":2: speed_mph = 'fast': not a number; allowed: a number, 0 < speed_mph <= 300");
  EXPECT_EQ(refusal(with("12.5,5", "12.5,0")),
            file + ":3: n_cars = '0': out of range; allowed: a whole number from 1 to 1000");
  EXPECT_EQ(refusal(with("12.5,5", "12.5,5.5")),
            file + ":3: n_cars = '5.5': not a whole number; allowed: a whole number from 1 to 1000");
  EXPECT_EQ(
      refusal(with("3,6,5", "4,6,5")),
      file +
          ":4: cars_from_pod_to_rear = '6': does not fit first_car_position = 4 and n_cars = 8; allowed: n_cars - "
          "first_car_position + 1 = 5");
  EXPECT_EQ(refusal(with("3,6,5", "3,6,9")),
            file + ":4: cars_derailed = '9': out of range; allowed: a whole number from 1 to 8");
  EXPECT_NE(refusal(with("ONE,31", "ONE,")).find(":2: speed_mph: not a number"), std::string::npos);
  EXPECT_NE(refusal(with("ONE,31", "ONE,nan")).find("speed_mph = 'nan': out of range"), std::string::npos);
  EXPECT_NE(refusal(with("140.5,2,", "140.5,-2,")).find("head_end_locos = '-2': out of range"), std::string::npos);
  EXPECT_NE(refusal(kTable.substr(0, kTable.find('\n') + 1)).find("no accidents"), std::string::npos);
  EXPECT_THROW(table(with("ONE,31", "ONE;31")), std::runtime_error);
}

TEST_F(Accidents, AllBadRowsAreToldAtOnceOrLeftOut) {
  std::string text = kTable;
  text.replace(text.find("ONE,31"), 6, "ONE,fast");
  text += "FOUR,30,8,2,0,0,0,1,8,9\nFIVE,30,8\n";
  const std::string said = refusal(text), file = (folder_ / "table.csv").string();
  EXPECT_EQ(said.substr(0, said.find('\n')), file + ": 3 of 5 rows cannot be used; --skip-invalid leaves them out:");
  for (const char* line :
       {":2: speed_mph = 'fast'", ":5: tons_per_car = '2': out of range; allowed: a number, 10 <= tons_per_car",
        ":5: cars_derailed = '9': out of range", ":6: 3 fields; allowed: 10, one for each column"}) {
    EXPECT_NE(said.find("\n  " + file + line), std::string::npos) << line << " in " << said;
  }
  const validation::AccidentTable t = validation::read_accidents(write("table.csv", text).string(), true);
  EXPECT_EQ(t.rows.size(), 2u);
  ASSERT_EQ(t.left_out.size(), 3u);
  EXPECT_EQ(t.left_out[0].line, 2u);
  EXPECT_NE(t.left_out[1].text.find("; cars_derailed = '9'"), std::string::npos) << t.left_out[1].text;
  EXPECT_THROW(validation::read_accidents(write("table.csv", text.substr(0, text.find("\"TWO"))).string(), true),
               inputs::InputError);
}

TEST_F(Accidents, LoadsAndEmptiesMustFitTheCars) {
  const std::string head = kTable.substr(0, kTable.find('\n')) + ",loaded,empty\n", row = "ONE,31,6,140.5,2,0,0,2,5,3,";
  EXPECT_EQ(table(head + row + "2,4\n").rows[0].loaded_cars, 2);
  EXPECT_EQ(table(head + row + "2,3\n").rows[0].empty_cars, 3);  // and a caboose
  const std::string said = refusal(head + row + "2,5\n");
  EXPECT_NE(
      said.find(
          ":2: loaded = '2': does not fit empty = 5 and n_cars = 6; allowed: loaded + empty from n_cars - 2 to n_cars"),
      std::string::npos)
      << said;
  EXPECT_NE(refusal(head + row + "1,1\n"), "");
}

TEST_F(Accidents, AFurtherCommaAtTheEndOfRowsIsNoColumn) {
  std::string text = kTable;
  for (std::size_t at = text.find('\n') + 1; (at = text.find('\n', at)) != std::string::npos; at += 2)
    text.insert(at, ",");
  EXPECT_EQ(table(text).rows.size(), 3u);
  EXPECT_EQ(table(text).rows[2].cars_derailed, 5);
}

TEST_F(Accidents, ReadsReportsAsPublished) {
  const std::string head =
      "\"RAILROAD\",\"INCDTNO\",\"RR2\",\"INCDTNO2\",\"YEAR4\",\"MONTH\",\"DAY\",\"TYPE\",\"TRNSPD\",\"TONS\","
      "\"POSITON1\",\"HEADEND1\",\"MIDREM1\","
      "\"RREM1\",\"LOADF1\",\"LOADP1\",\"EMPTYF1\",\"EMPTYP1\",\"LOADF2\",\"LOADP2\",\"EMPTYF2\",\"EMPTYP2\",CAUSE\n";
  const std::string rows =
      "UP,1,,,2010,09,05,01,025,14000,008,2,1,,100,0,0,0,20,0,0,0,T207,\n"
      "XX,9,UP,1,2010,09,05,01,000,0,000,0,0,0,0,0,0,0,0,0,0,0,T207,\n"       // the same accident by another railroad
      "UP,2,,,2010,09,06,01,030,14000,101,3,0,0,90,0,10,0,5,0,1,0,H307,\n"    // the position counts locomotives
      "UP,2,,,2010,09,06,01,030,14000,101,3,0,0,90,0,10,0,5,0,1,0,H307,\n"    // twice
      "UP,3,,,2010,09,07,07,030,14000,001,3,0,0,90,0,10,0,5,0,1,0,M302,\n"    // no derailment
      "UP,4,,,2010,09,08,01,000,0,001,3,0,0,100,0,0,0,0,0,0,0,T207,\n"        // no speed, no weight, no car
      "UP,1,,,2011,09,05,01,025,14000,150,2,0,0,100,0,0,0,20,0,0,0,T207,\n";  // a number used again next year; no such
                                                                              // position
  const std::string path = write("form.csv", head + rows).string();
  const validation::AccidentTable t = validation::read_accidents(path, true);
  ASSERT_EQ(t.rows.size(), 2u);
  const Accident& a = t.rows[0];
  EXPECT_EQ(a.speed_mph, 25.0);
  EXPECT_EQ(a.n_cars, 100);
  EXPECT_EQ(a.tons_per_car, 140.0);
  EXPECT_EQ(a.head_end_locos, 2);
  EXPECT_EQ(a.mid_locos, 1);
  EXPECT_EQ(a.rear_locos, 0);
  EXPECT_EQ(a.first_car_position, 8);
  EXPECT_EQ(a.cars_from_pod_to_rear, 93);
  EXPECT_EQ(a.cars_derailed, 20);
  EXPECT_EQ(a.cause, "T207");
  EXPECT_EQ(a.empty_cars, 0);
  EXPECT_EQ(t.rows[1].first_car_position, 98);
  EXPECT_EQ(t.rows[1].cars_derailed, 6);
  EXPECT_EQ(t.rows[1].fields.size(), t.columns.size());
  ASSERT_EQ(t.notes.size(), 1u);
  EXPECT_EQ(t.notes[0].line, 4u);
  ASSERT_EQ(t.left_out.size(), 5u);
  EXPECT_EQ(t.left_out[0].line, 3u);
  EXPECT_EQ(t.left_out[0].text, "a second report of the accident in line 2");
  EXPECT_EQ(t.left_out[1].text, "a second report of the accident in line 4");
  EXPECT_EQ(t.left_out[2].text, "TYPE = '07': no derailment; allowed: 01");
  EXPECT_EQ(t.left_out[3].text, "TRNSPD = '000': speed not above 0");
  EXPECT_EQ(t.left_out[4].text, "POSITON1 = '150' of 100 cars: position not in the train");
  EXPECT_EQ(validation::left_out_counts(t),
            (std::vector<std::string>{"2: a second report of an accident", "1: no derailment",
                                      "1: position not in the train", "1: speed not above 0"}));
  EXPECT_EQ(validation::read_accidents(path).rows.size(), 2u) << "what is of another kind is no mistake";
}

/// A report of a derailment that is used, changed in some columns.
std::string report(const std::map<std::string, std::string>& changes) {
  static const std::vector<std::pair<std::string, std::string>> kReport{
      {"RAILROAD", "UP"}, {"INCDTNO", "1"}, {"YEAR4", "2010"}, {"MONTH", "9"},     {"DAY", "5"},      {"TYPE", "01"},
      {"TYPEQ", "1"},     {"TYPTRK", "1"},  {"TRNSPD", "025"}, {"TONS", "8000"},   {"POSITON1", "8"}, {"POSITON2", "9"},
      {"HEADEND1", "2"},  {"LOADF1", "40"}, {"LOADP1", "0"},   {"EMPTYF1", "59"},  {"EMPTYP1", "0"},  {"CABOOSE1", "1"},
      {"LOADF2", "3"},    {"LOADP2", "0"},  {"EMPTYF2", "2"},  {"EMPTYP2", "0"},   {"HEADEND2", "1"}, {"TRKCLAS", "4"},
      {"CARS", "6"},      {"CARSDMG", "2"}, {"CARSHZD", "1"},  {"ACCAUSE", "E53C"}};
  std::string head, row;
  for (const auto& [name, value] : kReport) {
    const auto change = changes.find(name);
    head += (head.empty() ? "" : ",") + name;
    row += (row.empty() ? "" : ",") + (change == changes.end() ? value : change->second);
  }
  return head + "\n" + row + "\n";
}

TEST_F(Accidents, AReportGivesAllColumnsOfTheTable) {
  const validation::AccidentTable t = validation::read_accidents(write("form.csv", report({})).string());
  ASSERT_EQ(t.rows.size(), 1u);
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < t.columns.size(); ++i) row[t.columns[i]] = t.rows[0].fields.at(i);
  const std::map<std::string, std::string> wanted{{"n_cars", "100"},
                                                  {"loaded", "40"},
                                                  {"empty", "59"},
                                                  {"trailing_tons", "8000"},
                                                  {"tons_per_car", "80"},
                                                  {"speed_mph", "25"},
                                                  {"cars_derailed", "5"},
                                                  {"loaded_derailed", "3"},
                                                  {"empty_derailed", "2"},
                                                  {"locos_derailed", "1"},
                                                  {"first_car_position", "8"},
                                                  {"causing_car_position", "9"},
                                                  {"cause", "E53C"},
                                                  {"track_class", "4"},
                                                  {"hazmat_cars", "6"},
                                                  {"hazmat_damaged", "2"},
                                                  {"hazmat_released", "1"}};
  for (const auto& [name, value] : wanted) EXPECT_EQ(row[name], value) << name;
  EXPECT_EQ(t.rows[0].loaded_cars, 40);
  EXPECT_EQ(t.rows[0].empty_cars, 59);
}

TEST_F(Accidents, EachRuleOfTheFilterLeavesOutWhatItNames) {
  struct Case {
    const char *column, *value, *why;
  };
  for (const Case& c : {Case{"TYPE", "04", "no derailment"},
                        {"TYPEQ", "2", "no freight train"},
                        {"TYPTRK", "2", "not on a main track"},
                        {"TRNSPD", "0", "speed not above 0"},
                        {"TRNSPD", "", "speed not above 0"},
                        {"POSITON1", "0", "position not in the train"},
                        {"POSITON1", "103", "position not in the train"},
                        {"TONS", "1999", "weight of a car not from 20 to 160 tons"},
                        {"TONS", "16001", "weight of a car not from 20 to 160 tons"},
                        {"EMPTYF2", "98", "more cars derailed than the train has"}}) {
    const std::string text = report({{c.column, c.value}});
    const std::string good = report({{"INCDTNO", "2"}});
    const validation::AccidentTable t =
        validation::read_accidents(write("form.csv", text + good.substr(good.find('\n') + 1)).string());
    EXPECT_EQ(t.rows.size(), 1u) << c.column << c.value;
    EXPECT_EQ(validation::left_out_counts(t), std::vector<std::string>{std::string("1: ") + c.why});
  }
  for (const auto& [column, value] :
       {std::pair{"TONS", "16000"}, {"TONS", "2000"}, {"POSITON1", "102"}, {"EMPTYF2", "97"}, {"TYPE", "1"}})
    EXPECT_EQ(validation::read_accidents(write("form.csv", report({{column, value}})).string()).rows.size(), 1u)
        << value;
}

TEST_F(Accidents, WhatCannotBeReadInAReportIsToldByRowColumnValueAndWhatIsAllowed) {
  const std::string file = write("form.csv", report({{"TRNSPD", "fast"}})).string();
  try {
    validation::read_accidents(file);
    FAIL();
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(std::string(e.what()), file + ":2: TRNSPD = 'fast': not a number; allowed: a number, 0 <= TRNSPD <= 300");
  }
  EXPECT_THROW(validation::read_accidents(write("form.csv", report({{"LOADF1", "4.5"}})).string()), inputs::InputError);
  EXPECT_THROW(validation::read_accidents(write("form.csv", report({{"LOADF1", "-1"}})).string()), inputs::InputError);
  std::string none = report({});
  none.replace(none.find("ACCAUSE"), 7, "REASONS");
  EXPECT_THROW(validation::read_accidents(write("form.csv", none).string()), inputs::InputError);
}

TEST_F(Accidents, RowsOutsideOfTheFittedClassAreTold) {
  write("class.yaml",
        "title: heavy and fast\nranges:\n  tons_per_car: [132, 150]\n  empty_cars: [0, 2]\ncauses: [T207]\n");
  const auto of = [&](const std::string& rows) {
    const std::string study = kStudy + "fitted_on: class.yaml\n";
    const std::string head = kTable.substr(0, kTable.find('\n')) + ",cause,empty\n";
    write("study.yaml", study);
    write("table.csv", head + rows);
    const test::Result r = derail("validate table.csv --study study.yaml --out out" + std::to_string(++runs_));
    EXPECT_EQ(r.code, 0) << r.out;
    return r.out;
  };
  const std::string inside = "ONE,31,6,140.5,2,0,0,2,5,3,T207,0\n", light = "TWO,31,6,130,2,0,0,2,5,3,T207,0\n",
                    other = "THREE,31,6,140,2,0,0,2,5,3,H307,3\n", silent = "FOUR,31,6,140,2,0,0,2,5,3,,\n";
  EXPECT_EQ(of(inside).find("fitted class"), std::string::npos);

  const std::string said = of(inside + light + other);
  EXPECT_NE(said.find("warning: 2 of 3 rows lie outside of what the base was fitted on (heavy and fast)"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("line 3 is outside of the fitted class: tons_per_car 130 (fitted: 132 to 150)"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("empty_cars 3 (fitted: 0 to 2); cause H307"), std::string::npos) << said;
  EXPECT_NE(said.find("inside of the fitted class (1 rows)"), std::string::npos) << said;
  EXPECT_NE(said.find("outside of the fitted class (2 rows)"), std::string::npos) << said;
  const auto j = nlohmann::json::parse(test::text_of(folder_ / "out2" / "validation.json"));
  EXPECT_EQ(j.at("outside"), 2);
  int of_class = 0;
  for (const auto& warning : j.at("warnings"))
    of_class += warning.get<std::string>().find("fitted") != std::string::npos ? 1 : 0;
  EXPECT_EQ(of_class, 3);
  EXPECT_EQ(j.at("groups").at(1).at("name"), "inside of the fitted class");
  EXPECT_EQ(j.at("groups").at(2).at("rows"), 2);
  const std::string rows = test::text_of(folder_ / "out2" / "rows.csv");
  EXPECT_NE(rows.find(",outside,"), std::string::npos);
  EXPECT_NE(rows.find(",tons_per_car 130 (fitted: 132 to 150),"), std::string::npos) << rows;

  EXPECT_NE(of(silent).find("warning: the table does not tell cause of every row"), std::string::npos);
  write("study.yaml", kStudy);
  EXPECT_NE(
      derail("validate table.csv --study study.yaml --out out9").out.find("does not say what its base was fitted on"),
      std::string::npos);
}

TEST_F(Accidents, TheShippedClassIsThatOfTheExample) {
  const study::Study s = study::read_study_file(kSource + "/config/studies/accident_validation.yaml");
  const validation::FittedClass of = validation::read_fitted_class(s.fitted_on);
  for (const Accident& a : validation::read_accidents(kSource + "/config/accidents/example.csv").rows) {
    EXPECT_EQ(validation::outside(of, a), "") << a.line;
    Accident empty = a;
    empty.tons_per_car = 30.0;
    empty.cause = "H307";
    EXPECT_EQ(validation::outside(of, empty), "tons_per_car 30 (fitted: 111 to 188.9); cause H307");
  }
  for (const char* text : {"ranges: {speed: [1, 2]}", "ranges: {speed_mph: [2, 1]}", "ranges: {speed_mph: fast}",
                           "causes: T207", "fast: 1", "[1]"}) {
    EXPECT_THROW(validation::read_fitted_class(write("class.yaml", text).string()), inputs::InputError) << text;
  }
}

}  // namespace
}  // namespace train_derail
