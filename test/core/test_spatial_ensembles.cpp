// What only many runs show of the spatial model. Not built with sanitizers, which make each of them a minute long.
#include <array>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

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

constexpr std::size_t kOutcomes = 7;
using Ensemble = std::array<std::vector<double>, kOutcomes>;

/// Outcomes of runs with the seeds from `first` on.
Ensemble ensemble(inputs::Scenario s, int first, int runs) {
  Ensemble e;
  for (int seed = first; seed < first + runs; ++seed) {
    s.initial.perturbation.seed = seed;
    simulation::Simulation sim(s);
    sim.run();
    const outcome::Outcome o = sim.outcome();
    const std::array<double, kOutcomes> found{static_cast<double>(o.cars_derailed),
                                              static_cast<double>(o.couplers_broken),
                                              o.closing_speed_max.speed,
                                              o.relative_speed_max.speed,
                                              o.coupler_force_peak(),
                                              o.pile_up.length,
                                              o.pile_up.main_length};
    for (std::size_t q = 0; q < kOutcomes; ++q) e[q].push_back(found[q]);
  }
  return e;
}

TEST(SpatialRun, OnAWideBaseAndLevelGroundEndsAsInThePlane) {
  // Single runs part later on: two-sample tests of what comes out. 60 runs find a shift of 0.8 standard deviations.
  inputs::Scenario plane = test::accident(60);
  plane.model = inputs::Model::extended;
  inputs::Scenario space = plane;
  space.model = inputs::Model::spatial;
  space.suspension.half_base = 3.0;
  space.terrain.rail_height = 0.0;
  space.coupler.height = 2.0;  // as in config/variants/planar_limit.yaml
  for (inputs::CarBlock& block : space.consist) {
    block.centre_height = 2.0;
    block.floor_height = 0.1;
    block.roof_height = 3.9;
  }
  const Ensemble planar = ensemble(plane, 1, 60);
  EXPECT_GT(test::least_p(planar, ensemble(space, 1001, 60)), 0.01);
  // What it finds: contact that is missing, with half as many already, or rubs twice as much.
  inputs::Scenario wrong = space;
  wrong.contact.law = inputs::ContactLaw::none;
  EXPECT_LT(test::least_p(planar, ensemble(wrong, 2001, 30)), 0.01);
  wrong = space;
  wrong.contact.friction *= 2.0;
  EXPECT_LT(test::least_p(planar, ensemble(wrong, 3001, 60)), 0.01);
}

}  // namespace
}  // namespace train_derail
