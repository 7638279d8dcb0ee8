// Cost of the contact of two boxes: far apart, apart by a face only, and overlapping.
#include <vector>

#include <benchmark/benchmark.h>
#include <Eigen/Geometry>

#include "model/box_contact.hpp"

namespace {

using train_derail::model::Box;
using train_derail::model::press;

const Eigen::Vector3d kCar(9.0, 1.5, 1.7);

/// `count` pairs that differ a little, so that no branch is learnt by heart.
std::vector<std::pair<Box, Box>> pairs(const Eigen::Vector3d& offset, double turn, int count = 256) {
  std::vector<std::pair<Box, Box>> all;
  for (int i = 0; i < count; ++i) {
    const double phase = 0.7 * i;
    const Eigen::Matrix3d axes =
        Eigen::AngleAxisd(turn * (1.0 + 0.3 * std::sin(phase)),
                          Eigen::Vector3d(0.2 * std::sin(3.0 * phase), 0.2 * std::cos(2.0 * phase), 1.0).normalized())
            .toRotationMatrix();
    all.push_back(
        {{offset + 0.05 * Eigen::Vector3d(std::sin(phase), std::cos(phase), std::sin(2.0 * phase)), axes, kCar},
         {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), kCar}});
  }
  return all;
}

void contact(benchmark::State& state, const Eigen::Vector3d& offset, double turn) {
  const auto all = pairs(offset, turn);
  std::size_t i = 0;
  std::int64_t points = 0;
  for (auto _ : state) {
    const auto m = press(all[i].first, all[i].second);
    benchmark::DoNotOptimize(m);
    points += m.count;
    i = (i + 1) % all.size();
  }
  state.counters["points"] = benchmark::Counter(static_cast<double>(points), benchmark::Counter::kAvgIterations);
}

}  // namespace

BENCHMARK_CAPTURE(contact, far_apart, Eigen::Vector3d(25.0, 0.0, 0.0), 0.1);
BENCHMARK_CAPTURE(contact, neighbours_in_line, Eigen::Vector3d(18.4, 0.0, 0.0), 0.02);
BENCHMARK_CAPTURE(contact, end_on_end, Eigen::Vector3d(17.8, 0.3, 0.1), 0.02);
BENCHMARK_CAPTURE(contact, corner_in_side, Eigen::Vector3d(5.0, 6.5, 0.2), 0.7);
BENCHMARK_CAPTURE(contact, one_on_the_other, Eigen::Vector3d(4.0, 1.0, 3.2), 0.05);
BENCHMARK_CAPTURE(contact, across_and_tilted, Eigen::Vector3d(3.0, 4.0, 3.2), 1.2);

BENCHMARK_MAIN();
