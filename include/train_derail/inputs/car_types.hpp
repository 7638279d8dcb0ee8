/// \file
/// Kinds of cars: bodies by the name of a block (config/types/car_bodies.yaml), and types for what a train list does
/// not say (config/types/car_types.yaml). The library carries both files in itself; values here are in SI units.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// Heights of a body above the rail and its roll inertia, for what a block does not give.
struct CarBody {
  std::string name;               ///< of the blocks that have it; "": of all others
  double empty = 0.0;             ///< weight of a car of which the centre of mass is at centre_empty [N]
  double loaded = 0.0;            ///< weight of one of which it is at centre_loaded [N]
  double centre_empty = 0.0;      ///< height of the centre of mass [m]
  double centre_loaded = 0.0;     ///< height of the centre of mass [m]
  double floor = 0.0;             ///< height of the underside [m]
  double roof = 0.0;              ///< height of the top [m]
  double underframe = 0.0;        ///< height of what it lies on without trucks, floor or lower [m]
  double underframe_width = 0.0;  ///< width of that [m]
  double truck = 0.0;             ///< weight of a truck with its wheels [N]
  double roll_inertia = 0.0;      ///< about the axis along the car, over the mass [m^2]
};

/// A type of car of a train list.
struct CarType {
  std::string name;                        ///< "covered_hopper"
  std::string body;                        ///< name of its blocks
  std::vector<std::string> codes;          ///< first letters of AAR car type codes
  std::vector<std::string> also;           ///< other words for it
  double length = 0.0;                     ///< over the pulling faces [m]
  double width = 0.0;                      ///< m
  double truck_spacing = 0.0;              ///< between the truck centres [m]
  double empty = 0.0;                      ///< gross weight, empty [N]
  double loaded = 0.0;                     ///< gross weight, loaded [N]
  std::optional<double> floor;             ///< height of the underside, if not the body's [m]
  std::optional<double> underframe;        ///< height of what it lies on without trucks, if not the body's [m]
  std::optional<double> underframe_width;  ///< width of that, if not the body's [m]
  std::optional<double> roof;              ///< height of the top, if not the body's [m]
  std::optional<double> centre_empty;      ///< height of the centre of mass, empty, if not the body's [m]
  std::optional<double> centre_loaded;     ///< the same, loaded [m]
};

/// A type of coupler of a train list. What is left out is as the scenario has it.
struct CouplerType {
  std::string name;                     ///< "E_shelf"
  std::vector<std::string> also;        ///< other words for it
  std::optional<double> pitch_limit;    ///< rad
  std::optional<double> slip_height;    ///< m; infinite with shelves
  std::optional<double> vertical_hold;  ///< N
  std::optional<double> roll_limit;     ///< rad; infinite: rotary
};

/// All that a file of types holds.
struct CarTypes {
  std::vector<CarType> types;
  std::vector<CouplerType> couplers;

  /// Returns the type that `text` means: its name, another word for it, or an AAR car type code ("C113", "C"). Upper
  /// and lower case, blanks and the signs - _ / . do not matter. Null if there is none.
  const CarType* type(std::string_view text) const;
  /// Returns the coupler that `text` means, in the same way.
  const CouplerType* coupler(std::string_view text) const;
  /// Names, other words and codes of all types: what type() knows.
  std::vector<std::string> words() const;
};

/// Those of the package.
const CarTypes& car_types();
/// Those of the package and, before them, those of the file at `path`. Throws InputError if it cannot be read, has
/// unknown keys, or values that are out of range.
CarTypes car_types(const std::string& path);

/// Those of the package, the one without a name last.
const std::vector<CarBody>& car_bodies();
/// The body of blocks of this name; the one without a name if there is no other.
const CarBody& body_of(std::string_view name);
/// Height of the centre of mass of a car of this weight [N], between empty and loaded [m].
double centre_height(const CarBody& body, double weight);

/// The cars of a block, of this weight, have the body of that type: its name, width and heights. Its length, trucks and
/// inertia stay as they are.
void take_body(CarBlock& block, const CarType& type);

/// What holds the pins of two cars together, up and down and in roll; see Coupler.
struct CouplerHold {
  double pitch_limit;    ///< rad
  double slip_height;    ///< m
  double vertical_hold;  ///< N
  double roll_limit;     ///< rad
};
/// Between two blocks' couplers of some type (CarBlock::coupler_type). Each value that the coupler has itself counts;
/// else that of the types: the first stop that is met, but shelves, an interlock or a rotary at one end do for both.
/// What a type leaves out is as with E_shelf. The types must be known.
CouplerHold coupler_hold(const Coupler& coupler, const std::string& lead, const std::string& trail);

/// Text without what does not matter in names: letters in lower case, digits and #.
std::string bare_name(std::string_view text);

}  // namespace train_derail::inputs
