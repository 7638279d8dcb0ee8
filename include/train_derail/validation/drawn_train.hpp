/// \file
/// Trains of which a table tells the tons, the loads and the empties, but not their order, nor weight and kind of each.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "train_derail/inputs/car_types.hpp"
#include "train_derail/validation/accidents.hpp"

namespace train_derail::validation {

/// Lightest and heaviest empty car that is drawn [short tons].
inline constexpr double kEmptyTonsMin = 26.0, kEmptyTonsMax = 35.0;
/// Heaviest load that is drawn [short tons].
inline constexpr double kLoadTonsMax = 160.0;
/// From this weight on the base's own cars stand for loads [short tons].
inline constexpr double kHeavyTons = 110.0;

/// What is drawn of a train.
struct DrawnTrain {
  std::vector<bool> empty;   ///< of each car, foremost first; as many as there are empties and cabooses
  double loaded_tons = 0.0,  ///< weight of each load [short tons]
      empty_tons = 0.0;      ///< weight of each empty; all cars together have the weight of the table [short tons]
  const inputs::CarType *loaded_type = nullptr,  ///< kind of the loads; null: the base's own cars
      *empty_type = nullptr;                     ///< kind of the empties; null: the base's own cars
};

/// Draws what the table does not tell, differently for each `seed`. Nothing if the table does not tell loads and
/// empties, or if all cars are heavy loads: then all are like the base's cars. Order: two to ten blocks, alternately
/// loads and empties, or all mixed. Weight of an empty: any from kEmptyTonsMin to kEmptyTonsMax of which the loads are
/// not lighter than the empties and not heavier than kLoadTonsMax; if there is none, all cars have the same weight.
/// Kinds: any of the package's types of cars (config/types/car_types.yaml) that may have this weight.
std::optional<DrawnTrain> draw_train(const Accident& accident, std::uint64_t seed);

}  // namespace train_derail::validation
