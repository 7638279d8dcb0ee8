// The train of an accident: what stands in a row of the table, on a base for all else.
#include <algorithm>
#include <optional>
#include <vector>

#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/validation/accidents.hpp"
#include "train_derail/validation/drawn_train.hpp"

namespace train_derail::validation {

using inputs::CarBlock;
using inputs::InputError;

namespace {

constexpr double kShortTon = 2000.0 * inputs::kPoundForce;  // N

/// The blocks of a base's consist from which trains are made; null: there is none.
struct Templates {
  const CarBlock *locomotive = nullptr, *car = nullptr, *last = nullptr;
};

Templates templates_of(const inputs::Scenario& base) {
  Templates t;
  for (const CarBlock& block : base.consist) {
    if (is_locomotive(block)) {
      if (t.locomotive == nullptr) t.locomotive = &block;
    } else {
      if (t.car == nullptr) t.car = &block;
      t.last = &block;
    }
  }
  if (t.car == nullptr) {
    throw InputError("scenario", "consist", "", "no block of cars from which trains can be made",
                     "a block whose name is not locomotive");
  }
  return t;
}

/// A car like the template, of the weight and kind that were drawn.
CarBlock drawn_car(const CarBlock& like, const DrawnTrain& drawn, bool empty, double coupler_length) {
  CarBlock block = like;
  block.weight = (empty ? drawn.empty_tons : drawn.loaded_tons) * kShortTon;
  const inputs::CarType* type = empty ? drawn.empty_type : drawn.loaded_type;
  if (type == nullptr) return block;
  inputs::take_body(block, *type);
  block.loaded_weight = std::max(type->loaded, block.weight);
  block.length = type->length - coupler_length;
  block.truck_spacing = type->truck_spacing;
  block.truck_spacing_factor.reset();
  return block;
}

/// The cars of a train, foremost first.
class Cars {
 public:
  Cars(const inputs::Scenario& base, const Accident& a, std::uint64_t seed)
      : drawn_(draw_train(a, seed)), tons_(a.tons_per_car), coupler_length_(base.coupler.length) {}

  /// Adds cars number `from` to `to` - 1, from 0, to the consist; cars that are alike share a block.
  void add(std::vector<CarBlock>& consist, const CarBlock& like, int from, int to) const {
    for (int i = from; i < to; ++i) {
      const bool empty = drawn_ && drawn_->empty[static_cast<std::size_t>(i)];
      if (i > from && (!drawn_ || empty == drawn_->empty[static_cast<std::size_t>(i - 1)])) {
        ++consist.back().count;
        continue;
      }
      consist.push_back(drawn_ ? drawn_car(like, *drawn_, empty, coupler_length_) : like);
      if (!drawn_) consist.back().weight = tons_ * kShortTon;
      consist.back().count = 1;
    }
  }

 private:
  std::optional<DrawnTrain> drawn_;
  double tons_, coupler_length_;
};

}  // namespace

inputs::Scenario scenario_of(const inputs::Scenario& base, const Accident& a, std::uint64_t seed) {
  const Templates t = templates_of(base);
  const int ahead = a.first_car_position - 1, count = ahead + a.cars_from_pod_to_rear;
  const int before_middle = t.locomotive != nullptr && a.mid_locos > 0 ? count / 2 : 0;
  const Cars cars(base, a, seed);
  std::vector<CarBlock> consist;
  const auto locomotives = [&](int number, inputs::BrakeSource source) {
    if (t.locomotive == nullptr || number == 0) return;
    consist.push_back(*t.locomotive);
    consist.back().count = number;
    if (source == inputs::BrakeSource::remote) consist.back().brake_source = source;
  };
  locomotives(a.head_end_locos, inputs::BrakeSource::none);
  cars.add(consist, *t.car, 0, before_middle);
  locomotives(a.mid_locos, inputs::BrakeSource::remote);
  // One block from here to the end if the last car is like the others.
  const bool alike = t.last == t.car;
  cars.add(consist, *t.car, before_middle, alike ? count : count - 1);
  if (!alike) cars.add(consist, *t.last, count - 1, count);
  locomotives(a.rear_locos, inputs::BrakeSource::remote);

  inputs::Scenario scenario = base;
  scenario.consist = consist;
  scenario.initial.speed = a.speed_mph * inputs::kMph;
  const bool middle_ahead = a.mid_locos > 0 && ahead >= before_middle;
  const int locomotives_ahead = t.locomotive == nullptr ? 0 : a.head_end_locos + (middle_ahead ? a.mid_locos : 0);
  scenario.initial.cars_ahead = ahead + locomotives_ahead;
  return scenario;
}

bool row_decides(const std::string& key) {
  const auto ends_with = [&](const std::string& end) {
    return key.size() >= end.size() && key.compare(key.size() - end.size(), end.size(), end) == 0;
  };
  return key == "initial.speed" || key == "initial.cars_ahead" ||
         (key.compare(0, 8, "consist[") == 0 && (ends_with("].count") || ends_with("].weight") || ends_with("].name")));
}

Derailed count_derailed(const inputs::Scenario& scenario, const simulation::Snapshot& snapshot) {
  Derailed derailed;
  std::size_t vehicle = 0;
  for (const CarBlock& block : scenario.consist) {
    for (int i = 0; i < block.count; ++i, ++vehicle) {
      if (snapshot.cars.at(vehicle).derailed) ++(is_locomotive(block) ? derailed.locomotives : derailed.cars);
    }
  }
  return derailed;
}

}  // namespace train_derail::validation
