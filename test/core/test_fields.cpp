// What comes out is described once: every entry has what it needs, and JSON, CSV and tables hold what is described.
#include <map>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "fixtures.hpp"
#include "train_derail/fields/reference.hpp"
#include "train_derail/fields/units.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/fields.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"

namespace train_derail {
namespace {

simulation::Simulation finished() {
  inputs::Scenario s = inputs::read_scenario_file(TRAIN_DERAIL_SOURCE_DIR "/config/accident.yaml",
                                                  {{"consist[1].count", "20"}, {"stop.time_max", "20 s"}});
  simulation::Simulation simulation(s);
  simulation.run();
  return simulation;
}

template <class Record>
void expect_complete(const fields::Fields<Record>& all, std::set<std::string>& names) {
  for (const auto& field : all) {
    EXPECT_TRUE(names.insert(std::string(field.name)).second) << field.name << " stands twice";
    EXPECT_FALSE(field.meaning.empty()) << field.name;
    EXPECT_EQ(field.meaning.empty() ? '.' : field.meaning.back(), '.') << field.name;
    const fields::Unit& unit = field.unit;
    if (!unit.si.empty() && unit.si != "1") {
      // The conversion to what people read is that of the library of units.
      const std::string shown(unit.shown), si(unit.si == "m2" ? "m^2" : unit.si);
      if (shown == "10^6 ft-lbf" || shown.empty()) continue;
      const std::map<std::string, std::string> spelled{{"kip s", "kip s"}, {"ft2", "ft^2"}};
      const auto found = spelled.find(shown);
      EXPECT_NEAR(inputs::to_si("1 " + (found == spelled.end() ? shown : found->second), si) / unit.per_shown, 1.0,
                  1e-12)
          << field.name;
      if (unit.table_si.empty()) continue;
      EXPECT_NEAR(
          inputs::to_si("1 " + std::string(unit.table_si == "m2" ? "m^2" : unit.table_si), si) / unit.per_table_si, 1.0,
          1e-12)
          << field.name;
    }
  }
}

TEST(Fields, EveryEntryIsComplete) {
  std::set<std::string> outcomes, states;
  expect_complete(outcome::outcome_fields(), outcomes);
  expect_complete(simulation::car_fields(), states);
  expect_complete(simulation::coupler_fields(), states);  // they share a row of the CSV
  EXPECT_NEAR(fields::kEnergy.per_shown, 1e6 * 1.3558179483314, 1e-3);
  for (const auto& q : outcome::quantities()) {
    EXPECT_FALSE(q.title.empty()) << q.name;
    EXPECT_EQ(outcome::find_quantity(q.name), &q);
  }
  EXPECT_EQ(outcome::find_quantity("no_such"), nullptr);
}

TEST(Fields, JsonHasTheValuesOfTheRun) {
  const simulation::Simulation run = finished();
  const outcome::Outcome o = run.outcome();
  const auto j = nlohmann::ordered_json::parse(outcome::to_json(o));
  std::vector<std::string> keys, described;
  for (const auto& item : j.items()) keys.push_back(item.key());
  for (const auto& field : outcome::outcome_fields()) described.emplace_back(field.name);
  EXPECT_EQ(keys, described);
  EXPECT_EQ(j["cars"], o.cars);
  EXPECT_EQ(j["pile_up_length"], o.pile_up.length);
  EXPECT_EQ(j["coupler_buff_peak_coupler"], o.coupler_buff_peak.coupler);
  EXPECT_EQ(j["closing_car_b"], o.closing_speed_max.car_b);
  EXPECT_EQ(j["derailed_by_torn_track"], o.derailed_by.torn_track);
  EXPECT_EQ(j["ended"], std::string(outcome::to_string(o.ended)));
  double energies = 0.0;
  for (const auto& term : model::kEnergyTerms) energies += j[std::string(term.name)].get<double>();
  EXPECT_EQ(energies, o.energy.total());
  EXPECT_NEAR(energies / o.energy_initial, 1.0, 1e-4);
}

TEST(Fields, TablesSayInWordsWhyARunHasEnded) {
  static_assert(outcome::kEndedTexts.size() == outcome::kEndedNames.size());
  outcome::Outcome o;
  o.ended = outcome::Ended::at_rest;
  EXPECT_EQ(outcome::row_of(*outcome::outcome_fields().find("ended"), o).si, "all cars at rest");
  o.ended = outcome::Ended::time_max;
  EXPECT_EQ(outcome::row_of(*outcome::outcome_fields().find("ended"), o).si, "time limit reached");
}

TEST(Fields, SmallValuesDoNotVanishInTables) {
  const auto row = [](const char* name, const outcome::Outcome& o) {
    return outcome::row_of(*outcome::outcome_fields().find(name), o);
  };
  outcome::Outcome o;
  o.step = 0.002;
  o.step_max = 0.012345;
  o.wall_time = 0.004;
  o.released.expected = 15.96;
  o.energy_residual = 3.21e-5;
  o.posture.drop_max = 0.04;
  EXPECT_EQ(row("step", o).si, "2.000 ms");
  EXPECT_EQ(row("step", o).shown, "");
  EXPECT_EQ(row("step_max", o).si, "12.345 ms");
  EXPECT_EQ(row("wall_time", o).si, "0.004 s");
  EXPECT_EQ(row("cars_released_expected", o).si, "16.0");
  EXPECT_EQ(row("cars_released_expected", o).shown, "");
  EXPECT_EQ(row("energy_residual", o).si, "3.2e-05");
  EXPECT_EQ(row("drop_max", o).si, "0.04 m");
  EXPECT_EQ(row("drop_max", o).shown, "0.1 ft");
  EXPECT_EQ(nlohmann::json::parse(outcome::to_json(o)).at("step"), 0.002);  // JSON stays in SI units
}

TEST(Fields, OneCarInLineIsNoPileUp) {
  const auto& length = *outcome::outcome_fields().find("pile_up_length");
  outcome::Outcome o;
  o.cars_past_pod = o.cars_derailed = 1;  // as a run begins
  o.pile_up.length = 18.0;
  EXPECT_FALSE(length.when(o));
  o.cars_off_track = 1;
  EXPECT_TRUE(length.when(o));
  o.cars_off_track = 0;
  o.cars_derailed = 2;
  EXPECT_TRUE(length.when(o));
}

TEST(Fields, TheLedgerHasAnEntryForEachOfItsTerms) {
  EXPECT_EQ(sizeof(model::EnergyLedger), std::size(model::kEnergyTerms) * sizeof(double));
  model::EnergyLedger ledger;
  double sum = 0.0, value = 1.0;
  for (const auto& term : model::kEnergyTerms) {
    ledger.*term.term = value;
    sum += value;
    value *= 2.0;  // no term stands twice: the sum would not be
  }
  EXPECT_EQ(ledger.total(), sum);
  EXPECT_EQ(sum, value - 1.0);
}

TEST(Fields, CsvHasTheStatesOfTheRunAndTheirUnits) {
  const simulation::Simulation run = finished();
  std::ostringstream out;
  simulation::write_csv_header(out);
  simulation::write_csv_rows(out, run.snapshot());
  std::istringstream in(out.str());
  const auto cells = [&in] {
    std::string line, cell;
    std::getline(in, line);
    std::vector<std::string> row;
    for (std::istringstream cut(line); std::getline(cut, cell, ',');) row.push_back(cell);
    if (!line.empty() && line.back() == ',') row.emplace_back();
    return row;
  };
  const std::vector<std::string> names = cells(), first = cells();
  ASSERT_EQ(names.size(), 2 + simulation::car_fields().size() + simulation::coupler_fields().size());
  ASSERT_EQ(first.size(), names.size());
  std::map<std::string, std::string> row;
  for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = first[i];
  const simulation::Snapshot now = run.snapshot();
  EXPECT_EQ(row.at("car"), "1");
  EXPECT_EQ(std::stod(row.at("x_m")), now.cars[0].x);
  EXPECT_EQ(std::stod(row.at("omega_rad_s")), now.cars[0].omega);
  EXPECT_EQ(std::stod(row.at("rear_truck_offset_m")), now.cars[0].rear_truck.offset);
  EXPECT_EQ(row.at("cause"), std::string(model::to_string(now.cars[0].cause)));
  EXPECT_EQ(std::stod(row.at("gap_m")), now.couplers[0].gap);
  EXPECT_EQ(std::stod(row.at("moment_lead_N_m")), now.couplers[0].moment_lead);
  EXPECT_EQ(row.at("broken"), now.couplers[0].broken ? "1" : "0");
  std::vector<std::string> last;
  for (std::vector<std::string> next = cells(); !next.empty(); next = cells()) last = next;
  EXPECT_EQ(last.at(1), std::to_string(now.cars.size()));
  EXPECT_EQ(last.size(), names.size());
  EXPECT_EQ(last.back(), "");
}

TEST(Fields, TablesShowSiBesideWhatPeopleRead) {
  outcome::Outcome o;
  o.coupler_buff_peak = {2.0 * inputs::kKip * 1000.0, 3, 1.5};
  const std::string table = outcome::to_table(o);
  EXPECT_NE(table.find("8896 kN"), std::string::npos) << table;
  EXPECT_NE(table.find("2000 kip   coupler 3-4 at 1.50 s"), std::string::npos) << table;
  EXPECT_EQ(table.find("impacts"), std::string::npos) << table;  // there are none
  EXPECT_EQ(table.find(" \n"), std::string::npos) << table;
  EXPECT_EQ(fields::column("moment_lead", fields::kMoment), "moment_lead_N_m");
  EXPECT_EQ(fields::column("cars", fields::kCars), "cars");
}

}  // namespace
}  // namespace train_derail
