#include "train_derail/model/train.hpp"

#include <algorithm>

#include "train_derail/inputs/car_types.hpp"

namespace train_derail::model {

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
    const inputs::CarBody& body = inputs::body_of(block.name);
    car.centre_height = block.centre_height.value_or(inputs::centre_height(body, block.weight));
    car.floor_height = block.floor_height.value_or(body.floor);
    car.roof_height = block.roof_height.value_or(body.roof);
    car.underframe_height = std::min(block.underframe_height.value_or(body.underframe), car.floor_height);
    car.underframe_width = block.underframe_width.value_or(std::min(body.underframe_width, block.width));
    car.coupler_type = block.coupler_type;
    car.cylinder = block.shape == inputs::BodyShape::cylinder;
    car.roll_inertia = block.roll_inertia.value_or(body.roll_inertia * car.mass);
    cars.insert(cars.end(), static_cast<std::size_t>(block.count), car);
  }
  return cars;
}

}  // namespace train_derail::model
