#include "train_derail/validation/drawn_train.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <random>
#include <utility>

namespace train_derail::validation {

namespace {

constexpr double kShortTon = 2000.0 * inputs::kPoundForce;  // N

/// Random numbers that are the same on every machine; those of the standard library's distributions are not.
class Chance {
 public:
  explicit Chance(std::uint64_t seed) : engine_(seed) {}

  /// From 0 to 1, 1 excluded.
  double uniform() {
    constexpr int kUnused = 11;
    constexpr double kSteps = 9007199254740992.0;  // 2^53
    return static_cast<double>(engine_() >> kUnused) / kSteps;
  }
  /// A whole number from 0 to `below` - 1.
  std::size_t below(std::size_t below) {
    return std::min(static_cast<std::size_t>(uniform() * static_cast<double>(below)), below - 1);
  }
  template <class T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) {
      const std::size_t k = below(i);
      const T last = items[i - 1];
      items[i - 1] = items[k];
      items[k] = last;
    }
  }

 private:
  std::mt19937_64 engine_;
};

/// Cuts `count` cars into `parts` blocks of one car or more; at most as many as there are cars.
std::vector<int> cut(int count, int parts, Chance& chance) {
  std::vector<int> places;
  for (int i = 1; i < count; ++i) places.push_back(i);
  chance.shuffle(places);
  places.resize(static_cast<std::size_t>(std::max(std::min(parts, count) - 1, 0)));
  places.push_back(count);
  std::sort(places.begin(), places.end());
  for (std::size_t i = places.size() - 1; i > 0; --i) places[i] -= places[i - 1];
  return places;
}

/// Blocks that follow each other; 0: every car anywhere.
constexpr std::array<int, 6> kBlocks{0, 2, 3, 4, 6, 10};

std::vector<bool> draw_order(int loads, int empties, Chance& chance) {
  std::vector<bool> order(static_cast<std::size_t>(loads), false);
  order.insert(order.end(), static_cast<std::size_t>(empties), true);
  const int blocks = kBlocks[chance.below(kBlocks.size())];
  const bool empties_first = chance.uniform() < 0.5;
  if (loads == 0 || empties == 0) return order;
  if (blocks == 0) {
    chance.shuffle(order);
    return order;
  }
  const int of_first = (blocks + 1) / 2, of_second = blocks / 2;
  const std::vector<int> first = cut(empties_first ? empties : loads, of_first, chance),
                         second = cut(empties_first ? loads : empties, of_second, chance);
  order.clear();
  for (std::size_t i = 0; i < std::max(first.size(), second.size()); ++i) {
    if (i < first.size()) order.insert(order.end(), static_cast<std::size_t>(first[i]), empties_first);
    if (i < second.size()) order.insert(order.end(), static_cast<std::size_t>(second[i]), !empties_first);
  }
  return order;
}

/// Weights of loads and empties that together have the tons of the train.
void draw_weights(DrawnTrain& train, double tons, int loads, int empties, Chance& chance) {
  const double at = chance.uniform(), mean = tons / (loads + empties);
  train.loaded_tons = train.empty_tons = mean;
  if (loads == 0 || empties == 0) return;
  const double least = std::max(kEmptyTonsMin, (tons - kLoadTonsMax * loads) / empties);
  const double most = std::min(kEmptyTonsMax, mean);
  if (least > most) return;
  train.empty_tons = least + at * (most - least);
  train.loaded_tons = (tons - train.empty_tons * empties) / loads;
}

bool carries_freight(const inputs::CarType& type) { return type.name != "locomotive" && type.name != "passenger_car"; }

const inputs::CarType* draw_type(double tons, bool empty, Chance& chance) {
  constexpr double kAway = 0.2;  // share by which cars of a type differ from its weight
  const double weight = tons * kShortTon;
  std::vector<const inputs::CarType*> fit;
  for (const inputs::CarType& type : inputs::car_types().types) {
    const double least = empty ? (1.0 - kAway) * type.empty : (1.0 + kAway) * type.empty;
    const double most = empty ? (1.0 + kAway) * type.empty : 1.05 * type.loaded;
    if (carries_freight(type) && weight >= least && weight <= most) fit.push_back(&type);
  }
  const double at = chance.uniform();
  if (fit.empty()) return nullptr;
  return fit[std::min(static_cast<std::size_t>(at * static_cast<double>(fit.size())), fit.size() - 1)];
}

}  // namespace

std::optional<DrawnTrain> draw_train(const Accident& a, std::uint64_t seed) {
  if (!a.loaded_cars) return {};
  const int loads = *a.loaded_cars, empties = a.n_cars - loads;
  if (empties == 0 && a.tons_per_car >= kHeavyTons) return {};
  constexpr std::uint64_t kStream = 0x9e3779b97f4a7c15;  // so that trains and perturbations of a seed differ
  Chance chance(seed ^ kStream);
  DrawnTrain train;
  train.empty = draw_order(loads, empties, chance);
  draw_weights(train, a.tons_per_car * a.n_cars, loads, empties, chance);
  const inputs::CarType* heavy = nullptr;
  const inputs::CarType* of_loads = draw_type(train.loaded_tons, false, chance);
  train.loaded_type = train.loaded_tons >= kHeavyTons ? heavy : of_loads;
  train.empty_type = draw_type(train.empty_tons, true, chance);
  return train;
}

}  // namespace train_derail::validation
