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
    car.truck_mass = block.truck_weight.value_or(body.truck) / inputs::kStandardGravity;
    cars.insert(cars.end(), static_cast<std::size_t>(block.count), car);
  }
  return cars;
}

Car without_trucks(const Car& car) {
  Car left = car;
  const double share = 1.0 - 2.0 * car.truck_mass / car.mass;
  for (double* x : {&left.mass, &left.weight, &left.yaw_inertia, &left.roll_inertia}) *x *= share;
  left.centre_height = kTruckHeight + (car.centre_height - kTruckHeight) / share;
  left.truck_mass = 0.0;
  return left;
}

}  // namespace train_derail::model
