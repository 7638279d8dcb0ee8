/// \file
/// Where the energy of a train is, and what became of it.
#pragma once

#include <string_view>

namespace train_derail::model {

/// Mechanical energy and work of the whole train [J]. Work is what a mechanism has taken from the train: positive when
/// dissipated. Without error of integration, total() stays constant. Each member has its entry in kEnergyTerms.
struct EnergyLedger {
  double kinetic_translation = 0.0;   ///< of the centres of mass [J]
  double kinetic_rotation = 0.0;      ///< of rotation [J]
  double coupler_axial = 0.0;         ///< strain energy in draft and buff [J]
  double coupler_swing = 0.0;         ///< strain energy of the swing stops [J]
  double height = 0.0;                ///< of the centres of mass above their height at rest on the rails [J]
  double suspension = 0.0;            ///< strain energy of springs of trucks and of the ground under bodies [J]
  double work_on_track = 0.0;         ///< taken along the track from cars on it [J]
  double work_off_track = 0.0;        ///< taken by the ground off the track [J]
  double work_rails = 0.0;            ///< taken sideways by rails that yield [J]
  double work_ties = 0.0;             ///< taken by ties from trucks that run on them [J]
  double work_coupler_damping = 0.0;  ///< taken by damping of draft gears [J]
  double work_coupler_break = 0.0;    ///< strain energy lost when couplers broke [J]
  double work_impact_normal = 0.0;    ///< taken by crushing in impacts [J]
  double work_impact_friction = 0.0;  ///< taken by friction in impacts [J]
  double work_grade = 0.0;            ///< lifting, uphill positive [J]
  double work_truck_damping = 0.0;    ///< taken by dampers of trucks [J]
  double work_body_ground = 0.0;      ///< taken by the ground from bodies that strike it [J]
  double work_trucks = 0.0;           ///< taken along by trucks that parted from their bodies [J]
  double work_kicks = 0.0;            ///< given by kicks and obstacles, hence negative [J]

  /// Kinetic energy [J].
  double kinetic() const { return kinetic_translation + kinetic_rotation; }
  /// Sum of all terms [J]; stays what it was at the start but for errors of integration.
  double total() const;
};

/// One term, as it is called everywhere.
struct EnergyTerm {
  std::string_view name;       ///< in JSON, messages, studies
  double EnergyLedger::*term;  ///< its member
  std::string_view title;      ///< in tables
  std::string_view meaning;    ///< a sentence that explains it
};

/// All terms, in the order of tables.
inline constexpr EnergyTerm kEnergyTerms[] = {
    {"energy_kinetic_translation", &EnergyLedger::kinetic_translation, "left in motion",
     "Kinetic energy of the centres of mass, at stop_time."},
    {"energy_kinetic_rotation", &EnergyLedger::kinetic_rotation, "left in rotation",
     "Kinetic energy of rotation, at stop_time."},
    {"energy_coupler_axial", &EnergyLedger::coupler_axial, "left in couplers",
     "Strain energy of couplers in draft and buff, at stop_time."},
    {"energy_coupler_swing", &EnergyLedger::coupler_swing, "left in swing stops",
     "Strain energy of the swing stops of couplers, at stop_time."},
    {"energy_height", &EnergyLedger::height, "left in height",
     "Work to lift the centres of mass from where they were at the start, at stop_time; spatial model only."},
    {"energy_suspension", &EnergyLedger::suspension, "left in springs",
     "Strain energy of springs of trucks and of the ground under bodies, at stop_time; spatial model only."},
    {"work_on_track", &EnergyLedger::work_on_track, "spent on the track",
     "Work that friction, or brakes and rolling resistance, took from cars on the track, along it."},
    {"work_off_track", &EnergyLedger::work_off_track, "spent off the track",
     "Work that the ground took from trucks that have left the track."},
    {"work_rails", &EnergyLedger::work_rails, "spent sideways in the rails",
     "Work that rails took from trucks sideways, by damping and yielding, less what their alignment gave."},
    {"work_ties", &EnergyLedger::work_ties, "spent on the ties",
     "Work that ties took from trucks that ran on them, by drag along the track and sideways."},
    {"work_coupler_damping", &EnergyLedger::work_coupler_damping, "spent by damping of couplers",
     "Work that the damping of draft gears took."},
    {"work_coupler_break", &EnergyLedger::work_coupler_break, "let go by couplers that broke",
     "Strain energy that was lost when couplers broke."},
    {"work_impact_normal", &EnergyLedger::work_impact_normal, "spent by crushing in impacts",
     "Work of crushing bodies in impacts, and what restitution did not give back."},
    {"work_impact_friction", &EnergyLedger::work_impact_friction, "spent by friction in impacts",
     "Work of friction between bodies in impacts."},
    {"work_grade", &EnergyLedger::work_grade, "spent uphill",
     "Work of lifting the train along the grade, uphill positive."},
    {"work_truck_damping", &EnergyLedger::work_truck_damping, "spent by dampers of trucks",
     "Work that the dampers of trucks took; spatial model only."},
    {"work_body_ground", &EnergyLedger::work_body_ground, "spent by bodies striking the ground",
     "Work that the ground took from bodies that strike it, along its normal; spatial model only."},
    {"work_trucks", &EnergyLedger::work_trucks, "taken along by trucks that parted",
     "Energy of motion, height and springs that trucks took along as they parted from their bodies; spatial model "
     "only."},
    {"work_kicks", &EnergyLedger::work_kicks, "given by kicks",
     "Energy given by the kicks of the perturbation at the point of derailment, and by obstacles; given, hence "
     "negative."},
};

inline double EnergyLedger::total() const {
  double sum = 0.0;
  for (const EnergyTerm& t : kEnergyTerms) sum += this->*t.term;
  return sum;
}

}  // namespace train_derail::model
