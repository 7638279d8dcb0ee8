// Validation: trains made from rows, what is made of their runs, the command as a user meets it.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "command_line.hpp"
#include "folder.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/validation/validation.hpp"

namespace train_derail {
namespace {

namespace fs = std::filesystem;
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

/// Short, quick trains; no run of them lasts longer than 1.5 s of simulated time.
class Validate : public test::Folder {
 protected:
  void SetUp() override {
    write("scenario.yaml",
          "consist:\n"
          "  - {name: locomotive, count: 1, length: 73 ft, weight: 420 kip}\n"
          "  - {name: hopper, count: 1, length: 55 ft, weight: 286 kip}\n"
          "  - {name: hopper, count: 1, length: 55 ft, weight: 286 kip, brake_source: remote}\n"
          "ground: {on_track_law: rails, off_track_law: by_slip}\n"
          "contact: {law: elastic}\n"
          "initial: {speed: 1, yaw_rate: 0.1}\n"
          "stop: {time_max: 1.5}\n"
          "solver: {method: semi_implicit, fixed_step: 0.002}\n");
    write("study.yaml", kStudy);
    write("table.csv", kTable);
  }
  fs::path write(const std::string& name, const std::string& text) {
    Folder::write(name, text);
    return folder_ / name;
  }
  study::Study study(const std::string& text = kStudy) {
    return study::read_study_file(write("study.yaml", text).string());
  }
  validation::AccidentTable table(const std::string& text = kTable) {
    return validation::read_accidents(write("table.csv", text).string());
  }
  std::string refusal(const std::string& text) {
    try {
      table(text);
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "";
  }

  test::Result derail(const std::string& arguments) const { return test::derail_in(folder_, arguments); }

  static const std::string kStudy, kTable;
  int runs_ = 0;
};

const std::string Validate::kStudy =
    "title: two inputs\n"
    "scenario: scenario.yaml\n"
    "plan: latin_hypercube\n"
    "samples: 3\n"
    "factors:\n"
    "  - {key: rails.derail_ratio, low: 0.8, high: 1.1}\n"
    "  - {key: ground.in_line_friction, low: 0.15, high: 0.4}\n"
    "perturbation: {kick: 1 ft/s, alignment: 0.02 ft}\n"
    "seed: 7\n";

const std::string Validate::kTable =
    "station,speed_mph,n_cars,tons_per_car,head_end_locos,mid_locos,rear_locos,first_car_position,cars_from_pod_to_"
    "rear,cars_derailed\n"
    "ONE,31,6,140.5,2,0,0,2,5,3\n"
    "\"TWO, NORTH\",12.5,5,130,1,0,1,1,5,2\n"
    "THREE,45,8,135,2,1,0,3,6,5\n";

TEST_F(Validate, ReadsATable) {
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

TEST_F(Validate, TheExampleShipped) {
  const validation::AccidentTable t = validation::read_accidents(kSource + "/config/accidents/example.csv");
  EXPECT_EQ(t.rows.size(), 10u);
  const study::Study s = study::read_study_file(kSource + "/config/studies/accident_validation.yaml");
  EXPECT_EQ(validation::members_a_row(s), 19);
  for (const Accident& a : t.rows) EXPECT_NO_THROW(inputs::validate(validation::scenario_of(s.base, a))) << a.line;
}

TEST_F(Validate, BadTablesAreRefusedByFileLineColumnValue) {
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

TEST_F(Validate, AllBadRowsAreToldAtOnceOrLeftOut) {
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

TEST_F(Validate, AFurtherCommaAtTheEndOfRowsIsNoColumn) {
  std::string text = kTable;
  for (std::size_t at = text.find('\n') + 1; (at = text.find('\n', at)) != std::string::npos; at += 2)
    text.insert(at, ",");
  EXPECT_EQ(table(text).rows.size(), 3u);
  EXPECT_EQ(table(text).rows[2].cars_derailed, 5);
}

TEST_F(Validate, ReadsReportsAsPublished) {
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
  EXPECT_EQ(t.left_out[2].text, "TYPE = '07': not a derailment; allowed: 01");
  EXPECT_NE(t.left_out[3].text.find("TRNSPD = '000'"), std::string::npos);
  EXPECT_NE(t.left_out[3].text.find("TONS = '0'"), std::string::npos);
  EXPECT_NE(t.left_out[3].text.find("no car derailed"), std::string::npos);
  EXPECT_NE(t.left_out[4].text.find("POSITON1 = '150': out of range"), std::string::npos);
  try {
    validation::read_accidents(path);
    FAIL();
  } catch (const inputs::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("3 of 7 rows cannot be used"), std::string::npos) << e.what();
  }
}

TEST_F(Validate, RowsOutsideOfTheFittedClassAreTold) {
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

TEST_F(Validate, TheShippedClassIsThatOfTheExample) {
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

TEST_F(Validate, StudiesThatCannotServeAreRefused) {
  const auto refused = [&](const std::string& was, const std::string& is) -> std::string {
    std::string text = kStudy;
    try {
      validation::members_a_row(study(text.replace(text.find(was), was.size(), is)));
    } catch (const inputs::InputError& e) {
      return e.key() + ": " + e.problem();
    }
    return "";
  };
  EXPECT_EQ(refused("rails.derail_ratio", "initial.speed"), "factors.key: the rows of the table decide it");
  EXPECT_EQ(refused("rails.derail_ratio, low: 0.8, high: 1.1", "\"consist[1].weight\", low: 200 kip, high: 286 kip"),
            "factors.key: the rows of the table decide it");
  EXPECT_EQ(refused("latin_hypercube", "saltelli"), "plan: every row needs a random sample of its own");
  EXPECT_EQ(refused("latin_hypercube", "sobol"), "plan: every row needs a random sample of its own");
}

TEST_F(Validate, ARowThatTheScenarioCannotTakeIsNamed) {
  study::Study s = study();
  s.base.ground.on_track_law = inputs::OnTrackLaw::along_track;
  s.base.initial.perturbation = {};
  const std::atomic<bool> stop{false};
  try {
    validation::run(
        s, table(), 1, [](const study::Progress&) {}, stop);
    FAIL();
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.where(), (folder_ / "table.csv").string() + ":2: scenario");
    EXPECT_EQ(e.key(), "initial.cars_ahead");
  }
}

TEST_F(Validate, DependsNeitherOnThreadsNorOnTheOtherRows) {
  const study::Study s = study();
  const validation::AccidentTable all = table();
  const std::atomic<bool> stop{false};
  std::int64_t calls = 0;
  const validation::Ensembles one = validation::run(
      s, all, 1, [&](const study::Progress& p) { EXPECT_EQ(p.done, ++calls); }, stop);
  EXPECT_EQ(calls, 9);
  ASSERT_EQ(one.members.size(), 9u);
  EXPECT_EQ(one.failed, 0);
  const validation::Ensembles four = validation::run(
      s, all, 4, [](const study::Progress&) {}, stop);
  EXPECT_EQ(validation::members_csv(s, one), validation::members_csv(s, four));
  EXPECT_EQ(validation::rows_csv(validation::evaluate(s, all, one)),
            validation::rows_csv(validation::evaluate(s, all, four)));

  validation::AccidentTable last = all;
  last.rows = {all.rows[2]};
  const validation::Ensembles alone = validation::run(
      s, last, 1, [](const study::Progress&) {}, stop);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(alone.members[i].seed, one.members[6 + i].seed);
    EXPECT_EQ(alone.members[i].outcome.energy.total(), one.members[6 + i].outcome.energy.total());
  }
  EXPECT_NE(one.members[0].seed, one.members[1].seed);
  EXPECT_NE(one.members[0].outcome.energy.total(), one.members[1].outcome.energy.total());
}

TEST_F(Validate, MembersHaveTheInputsOfTheirPoint) {
  const study::Study s = study();
  const validation::AccidentTable t = table();
  const std::atomic<bool> stop{false};
  const validation::Ensembles e = validation::run(
      s, t, 0, [](const study::Progress&) {}, stop);
  const study::Points points = validation::points_of(s, t.rows[1]);
  EXPECT_NE(points[1].values, validation::points_of(s, t.rows[0])[1].values) << "a sample of each row's own";
  const validation::Member& m = e.members[4];  // row 1, member 1
  EXPECT_EQ(m.row, 1u);
  EXPECT_EQ(m.member, 1);
  inputs::Scenario by_hand = study::scenario_of(s, points[1], {0, 0, 0, m.seed});
  EXPECT_EQ(by_hand.initial.perturbation.kick, inputs::kFoot);
  EXPECT_DOUBLE_EQ(by_hand.rails.derail_ratio, std::stod(points[1].values[0]));
  by_hand = validation::scenario_of(by_hand, t.rows[1]);
  simulation::Simulation simulation(by_hand);
  simulation.run();
  EXPECT_EQ(simulation.outcome().energy.total(), m.outcome.energy.total());
  const validation::Derailed derailed = validation::count_derailed(by_hand, simulation.snapshot());
  EXPECT_EQ(derailed.cars, m.derailed.cars);
  EXPECT_EQ(derailed.cars + derailed.locomotives, m.outcome.cars_derailed);
  EXPECT_GT(m.derailed.cars, 0);
}

TEST_F(Validate, SeedsOnlyKeepsTheInputs) {
  const study::Study s = validation::seeds_only(study());
  EXPECT_EQ(validation::members_a_row(s), 3);
  const std::vector<study::Point> points = study::points(s);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_TRUE(points[0].values.empty());
}

TEST_F(Validate, EvaluatesWhatTheMembersSay) {
  const study::Study s = study();
  const validation::AccidentTable t = table();
  validation::Ensembles e;
  const int counts[3][3]{{2, 4, 9}, {2, 2, 2}, {1, 9, 5}};
  for (std::size_t row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      validation::Member& m = e.members.emplace_back();
      m.row = row;
      m.member = k;
      m.derailed.cars = counts[row][k];
      m.outcome.ended = outcome::Ended::at_rest;
    }
  }
  e.members.back().outcome.ended = outcome::Ended::integration_failed;  // the 5 does not count
  e.failed = 1;
  const validation::Validation v = validation::evaluate(s, t, e);
  EXPECT_DOUBLE_EQ(v.predicted[0].mean, 5.0);
  EXPECT_DOUBLE_EQ(v.predicted[0].median, 4.0);
  EXPECT_DOUBLE_EQ(v.intervals[0].low, 2.0);  // three members: their range
  EXPECT_DOUBLE_EQ(v.intervals[0].high, 9.0);
  EXPECT_DOUBLE_EQ(v.intervals[2].high, 9.0);
  EXPECT_DOUBLE_EQ(v.predicted[2].mean, 5.0);
  EXPECT_EQ(v.predicted[2].count, 2u);
  ASSERT_EQ(v.groups.size(), 2u);  // all are faster than 10 mph, none has a long tail
  EXPECT_EQ(v.groups[1].name, "10 mph or more");
  const validation::Rated& simulation = v.groups[0].rated[0];
  EXPECT_DOUBLE_EQ(simulation.score.mean_absolute_error, 1.0 / 3.0);  // 4 for 3, 2 for 2, 5 for 5
  EXPECT_DOUBLE_EQ(simulation.score.bias, 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(v.groups[0].rated[1].score.mean_absolute_error, 2.0 / 3.0);  // of the mean: 5 for 3
  ASSERT_TRUE(simulation.coverage);
  EXPECT_DOUBLE_EQ(simulation.coverage->share, 1.0);
  ASSERT_TRUE(simulation.crps);  // 3 of 2, 4, 9; 2 of 2, 2, 2; 5 of 1, 9
  EXPECT_DOUBLE_EQ(*simulation.crps, (8.0 / 3.0 - 14.0 / 6.0 + 0.0 + 4.0 - 4.0) / 3.0);
  const auto j = nlohmann::json::parse(validation::to_json(v));
  EXPECT_EQ(j.at("rows"), 3);
  EXPECT_EQ(j.at("failed"), 1);
  EXPECT_EQ(j.at("interval").at("high_rank"), 3);
  EXPECT_EQ(j.at("interval").at("held_by_ranks"), 0.5);
  EXPECT_EQ(j.at("groups").at(0).at("scores").at(0).at("mean_absolute_error"), 1.0 / 3.0);
  EXPECT_TRUE(j.at("groups").at(0).at("fits").at(1).at("coefficients").empty());  // three rows, four coefficients
  EXPECT_NE(validation::to_table(v).find("1 runs failed"), std::string::npos);
  EXPECT_NE(validation::to_table(v).find("from member 1 to member 3 of 3, sorted; holds 50 %"), std::string::npos);
}

TEST_F(Validate, TheCommandLeavesTablesAndScores) {
  const test::Result r =
      derail("validate table.csv --study study.yaml --members 2 --min-speed '20 mph' --out results --jobs 2");
  ASSERT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("2 accidents, 2 members each"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("straight line in speed, left out"), std::string::npos) << r.out;
  const auto lines = [&](const char* name) {
    const std::string text = test::text_of(folder_ / "results" / name);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("rows.csv"), 3);
  EXPECT_EQ(lines("members.csv"), 5);
  const std::string rows = test::text_of(folder_ / "results/rows.csv");
  EXPECT_NE(rows.find("\n2,ONE,31,6,"), std::string::npos) << rows;
  EXPECT_NE(rows.find("\n4,THREE,"), std::string::npos) << rows;
  EXPECT_EQ(nlohmann::json::parse(test::text_of(folder_ / "results/validation.json")).at("members"), 2);
  const auto about = nlohmann::json::parse(test::text_of(folder_ / "results/about.json"));
  EXPECT_EQ(about.at("runs"), 4);
  EXPECT_EQ(about.at("study").at("samples"), 2);
  EXPECT_DOUBLE_EQ(about.at("study").at("perturbation").at("kick"), inputs::kFoot);
}

TEST_F(Validate, TheCommandRefusesWhatIsWrong) {
  const auto refused = [&](const std::string& arguments, const std::string& why) {
    const test::Result r = derail("validate " + arguments);
    EXPECT_EQ(r.code, 2) << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
  };
  refused("nowhere.csv --study study.yaml", "nowhere.csv: cannot be read");
  refused("table.csv --study nowhere.yaml", "nowhere.yaml");
  refused("table.csv", "--study is required");
  refused("table.csv --study study.yaml --min-speed 10kg", "--min-speed = '10kg'");
  refused("table.csv --study study.yaml --min-tail 500", "no row fulfils");
  refused("table.csv --study study.yaml --set rails.stiffness=-1", "rails.stiffness");
  EXPECT_FALSE(fs::exists(folder_ / "table.validated"));
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out results --quiet").code, 0);
  const auto in_use = [&](const std::string& arguments, const std::string& why) {
    const test::Result r = derail("validate table.csv --study study.yaml --out results " + arguments);
    EXPECT_EQ(r.code, 1) << r.out;
    EXPECT_NE(r.out.find(why), std::string::npos) << r.out;
  };
  in_use("", "results: holds 9 finished runs of this validation; --resume computes what is missing");
  in_use("--resume --members 4", "results: holds results of another study; samples: was 3, is now 4");
  in_use("--resume --spread 1.1", "holds results of another study");
  in_use("--resume --min-speed '20 mph'", "holds results of another study; accidents/rows/3");
}

TEST_F(Validate, GoesOnAfterAKillWithTheSameResults) {
  write("study.yaml", std::string(kStudy).replace(kStudy.find("samples: 3"), 10, "samples: 30"));
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out whole --jobs 1 --quiet").code, 0);
  const fs::path journal = folder_ / "killed/journal.csv";
  const auto on_disk = [&] {
    const std::string text = test::text_of(journal);
    return std::count(text.begin(), text.end(), '\n');
  };
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    if (chdir(folder_.c_str()) != 0) _exit(1);
    execl(TRAIN_DERAIL_CLI, "derail", "validate", "table.csv", "--study", "study.yaml", "--out", "killed", "--jobs",
          "1", "--quiet", nullptr);
    _exit(1);
  }
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (on_disk() < 20 && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_GE(on_disk(), 20);
  ASSERT_LT(on_disk(), 91);
  EXPECT_FALSE(fs::exists(folder_ / "killed/rows.csv"));
  std::ofstream(journal, std::ios::app) << "60,2";  // torn
  const test::Result resumed = derail("validate table.csv --study study.yaml --out killed --resume --jobs 2");
  ASSERT_EQ(resumed.code, 0) << resumed.out;
  for (const char* name : {"rows.csv", "members.csv", "validation.json"}) {
    EXPECT_EQ(test::text_of(folder_ / "killed" / name), test::text_of(folder_ / "whole" / name)) << name;
  }
  EXPECT_EQ(derail("validate table.csv --study study.yaml --out killed --resume --quiet").code, 0)
      << "nothing is missing";
}

TEST_F(Validate, WhatWasChangedInTheJournalIsComputedAnew) {
  ASSERT_EQ(derail("validate table.csv --study study.yaml --out whole --quiet").code, 0);
  fs::copy(folder_ / "whole", folder_ / "bad", fs::copy_options::recursive);
  std::string text = test::text_of(folder_ / "bad/journal.csv");
  const std::size_t line = text.find('\n', text.find('\n') + 1) + 1;  // the third
  text[text.find(',', line) - 1] ^= 1;
  std::ofstream(folder_ / "bad/journal.csv", std::ios::binary) << text;
  const test::Result r = derail("validate table.csv --study study.yaml --out bad --resume --quiet");
  EXPECT_EQ(r.code, 0) << r.out;
  EXPECT_NE(r.out.find("journal.csv:3: the checksum does not fit the line; computed again"), std::string::npos)
      << r.out;
  for (const char* name : {"rows.csv", "members.csv", "validation.json"})
    EXPECT_EQ(test::text_of(folder_ / "bad" / name), test::text_of(folder_ / "whole" / name)) << name;
  EXPECT_EQ(test::text_of(folder_ / "whole/members.csv")
                .find("line,member,seed,rails.derail_ratio,ground.in_line_friction,derailed_without_locomotives,"),
            0U);
}

TEST_F(Validate, MembersThatCannotDifferAreRefused) {
  study::Study s = validation::seeds_only(study());
  s.perturbation = {};
  const std::atomic<bool> stop{false};
  const auto error = [&] {
    try {
      validation::run(
          s, table(), 1, [](const study::Progress&) {}, stop);
    } catch (const inputs::InputError& e) {
      return e.key() + ": " + e.problem();
    }
    return std::string("no error");
  };
  EXPECT_EQ(error(),
            "replicates: members that differ by their seed alone cannot differ: there is no perturbation, neither of "
            "the study nor of its scenario");
  s.replicates = 1'000'000;
  EXPECT_EQ(error(), "samples: 3 rows with so many members each are too many runs");
}

TEST_F(Validate, Stopped) {
  const std::atomic<bool> stop{true};
  const validation::Ensembles e = validation::run(
      study(), table(), 2, [](const study::Progress&) { FAIL(); }, stop);
  EXPECT_TRUE(e.stopped);
}

}  // namespace
}  // namespace train_derail
