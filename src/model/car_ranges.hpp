// Which blocks of cars a loop goes over.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "model/extended_kernels.hpp"

namespace train_derail::model {

/// Keeps ranges for BusyCars, of cars and of their trucks.
class CarRanges {
 public:
  /// Of `cars` cars, those in blocks (of kBusyBlock) with true.
  void set(const std::vector<bool>& blocks, std::ptrdiff_t cars) {
    ranges_.clear();
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (!blocks[b]) continue;
      const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(b) * kBusyBlock, to = std::min(from + kBusyBlock, cars);
      if (!ranges_.empty() && ranges_.back().to == from) ranges_.back().to = to;
      else ranges_.push_back({from, to});
    }
    truck_ranges_ = ranges_;
    for (const CarRange& r : ranges_) truck_ranges_.push_back({cars + r.from, cars + r.to});
    cars_ = {ranges_.data(), static_cast<std::ptrdiff_t>(ranges_.size())};
    trucks_ = {truck_ranges_.data(), static_cast<std::ptrdiff_t>(truck_ranges_.size())};
  }
  /// They stay at their places. Trucks: the front ones of all cars, then the rear ones.
  const BusyCars& cars() const { return cars_; }
  const BusyCars& trucks() const { return trucks_; }

 private:
  std::vector<CarRange> ranges_, truck_ranges_;
  BusyCars cars_, trucks_;
};

}  // namespace train_derail::model
