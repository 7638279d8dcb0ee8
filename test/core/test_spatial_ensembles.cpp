// What only many runs show of the spatial model. Not built with sanitizers, which make each of them a minute long.
#include <algorithm>
#include <array>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "same_ensembles.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

using test::everything;

TEST(SpatialRest, ChangesNoOutcomeBeyondNoise) {
  const double p = test::least_p_without(
      30, [] { return everything(20, 2e-3); }, [](inputs::Scenario& s) { s.terrain.rest_speed = 0.0; },
      [](const outcome::Outcome& o) {
        return std::array<double, 4>{static_cast<double>(o.cars_derailed), static_cast<double>(o.posture.over()),
                                     o.pile_up.lateral_reach.farthest, o.pile_up.length};
      });
  EXPECT_GT(p, 0.01);
}

TEST(SpatialRun, FlatLowAndWideEndsAsInThePlane) {
  // Means over seeds: later on single runs part.
  struct Ensemble {
    std::vector<double> derailed, broken, closing, length;
  };
  const auto ensemble = [](const inputs::Scenario& of) {
    Ensemble e;
    for (int seed = 1; seed <= 24; ++seed) {
      inputs::Scenario s = of;
      s.initial.perturbation.seed = seed;
      simulation::Simulation sim(s);
      sim.run();
      const outcome::Outcome o = sim.outcome();
      e.derailed.push_back(o.cars_derailed);
      e.broken.push_back(o.couplers_broken);
      e.closing.push_back(o.closing_speed_max.speed);
      e.length.push_back(o.pile_up.main_length);
    }
    return e;
  };
  inputs::Scenario plane = test::accident(40);
  plane.model = inputs::Model::extended;
  inputs::Scenario space = plane;
  space.model = inputs::Model::spatial;
  space.suspension.half_base = 3.0;
  space.coupler.height = 1.0;
  space.terrain.rail_height = 0.0;
  for (inputs::CarBlock& block : space.consist) {
    block.centre_height = 1.0;
    block.floor_height = 0.1;
    block.roof_height = 1.9;
  }
  const Ensemble a = ensemble(plane), b = ensemble(space);
  for (const auto of : {&Ensemble::derailed, &Ensemble::broken, &Ensemble::closing, &Ensemble::length}) {
    const auto mean = [](const std::vector<double>& v) {
      return Eigen::Map<const Eigen::ArrayXd>(v.data(), 24).mean();
    };
    const double x = mean(a.*of), y = mean(b.*of);
    EXPECT_NEAR(y / x, 1.0, 0.15) << x << ' ' << y;
  }
}

}  // namespace
}  // namespace train_derail
