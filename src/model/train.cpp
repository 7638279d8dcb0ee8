#include "train_derail/model/train.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace train_derail::model {

namespace {

/// Heights of a kind of car above the rail [m], and its roll inertia over mass [m^2]. Centres of mass: the middle of
/// what is usual in North America (docs/spatial_model.md); AAR's limit is 98 in.
struct Kind {
  std::string_view name;
  double centre_empty, centre_loaded, floor, roof, roll;
};
constexpr std::array<Kind, 6> kKinds{{{"tank_car", 1.70, 2.22, 1.10, 4.20, 1.10},
                                      {"hopper", 1.40, 2.34, 1.10, 4.20, 1.74},
                                      {"boxcar", 1.40, 2.20, 1.10, 4.20, 1.74},
                                      {"flat", 0.95, 2.10, 1.00, 3.60, 1.60},
                                      {"locomotive", 1.75, 1.75, 1.00, 4.60, 1.80},
                                      {"", 1.40, 2.25, 1.10, 4.20, 1.74}}};
/// Weights of empty and of loaded cars, between which the centre of mass rises [N].
constexpr double kEmpty = 65.0 * inputs::kKip, kLoaded = 263.0 * inputs::kKip;

const Kind& kind_of(std::string_view name) {
  return *std::find_if(kKinds.begin(), kKinds.end() - 1, [&](const Kind& k) { return k.name == name; });
}

}  // namespace

std::vector<Car> expand(const std::vector<inputs::CarBlock>& consist) {
  std::vector<Car> cars;
  for (const auto& block : consist) {
    Car car;
    car.body = block.name;
    car.weight = block.weight;
    car.mass = block.weight / inputs::kStandardGravity;
    car.length = block.length;
    car.width = block.width;
    car.truck_spacing = block.truck_spacing.value_or(
        block.truck_spacing_factor.value_or(inputs::CarBlock::kDefaultTruckSpacingFactor) * block.length);
    car.yaw_inertia =
        block.yaw_inertia.value_or(block.yaw_inertia_factor.value_or(inputs::CarBlock::kDefaultYawInertiaFactor) *
                                   car.mass * block.length * block.length);
    const Kind& kind = kind_of(block.name);
    const double load = std::clamp((block.weight - kEmpty) / (kLoaded - kEmpty), 0.0, 1.0);
    car.centre_height =
        block.centre_height.value_or(kind.centre_empty + load * (kind.centre_loaded - kind.centre_empty));
    car.floor_height = block.floor_height.value_or(kind.floor);
    car.roof_height = block.roof_height.value_or(kind.roof);
    car.roll_inertia = block.roll_inertia.value_or(kind.roll * car.mass);
    cars.insert(cars.end(), static_cast<std::size_t>(block.count), car);
  }
  return cars;
}

}  // namespace train_derail::model
