// The coupler: force laws, equilibrium of the massless bar, and what two cars that meet do to it.
#include <algorithm>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/model/coupler_law.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using Vec = Eigen::Vector2d;

double cross(const Vec& a, const Vec& b) { return a.x() * b.y() - a.y() * b.x(); }

TEST(AxialForce, IsZeroInTheSlackAndStiffOutside) {
  const inputs::Coupler c;
  const double closed = c.length - 0.5 * c.slack, stretched = c.length + 0.5 * c.slack;
  for (const double gap : {closed, c.length - 0.01, c.length, c.length + 0.01, stretched}) {
    EXPECT_EQ(model::axial_force(c, gap), 0.0) << gap;
    EXPECT_EQ(model::axial_energy(c, c.length), 0.0);
  }
  EXPECT_GT(model::axial_force(c, std::nextafter(closed, 0.0)), 0.0);
  EXPECT_LT(model::axial_force(c, std::nextafter(stretched, 9.0)), 0.0);
  // 50e6 lbf/ft over a tenth of a foot; 1e-12 is the rounding of gap - edge against a foot.
  EXPECT_NEAR(model::axial_force(c, closed - 0.1 * inputs::kFoot) / (5e6 * inputs::kPoundForce), 1.0, 1e-12);
  EXPECT_NEAR(model::axial_force(c, stretched + 0.1 * inputs::kFoot) / (-5e6 * inputs::kPoundForce), 1.0, 1e-12);
}

TEST(AxialForce, DefaultsAreThePapers) {
  const inputs::Coupler c;
  EXPECT_NEAR(c.length, 1.2192, 1e-15);
  EXPECT_NEAR(c.slack, 0.0762, 1e-15);
  EXPECT_NEAR(c.stiffness / 7.29695e8, 1.0, 1e-6);
  EXPECT_NEAR(c.swing_limit, 0.30543261909900765, 1e-15);
}

TEST(AxialForce, EnergyIsItsIntegral) {
  const inputs::Coupler c;
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double gap = test::random_gap(c, random), h = 1e-3 * c.slack;
    // A central difference of a parabola is exact; what is left is rounding of energies of up to K m^2.
    const double slope = (model::axial_energy(c, gap + h) - model::axial_energy(c, gap - h)) / (2.0 * h);
    EXPECT_NEAR(slope, -model::axial_force(c, gap), 1e-10 * c.stiffness) << gap;
  }
  EXPECT_EQ(model::axial_energy(c, c.length), 0.0);
}

inputs::Coupler plateau_coupler() {
  inputs::Coupler c;
  c.swing_moment_max = 0.5 * c.swing_stiffness;  // reached 0.5 rad beyond the limit
  return c;
}

TEST(SwingMoment, FollowsTheSwingWithDeadSpaceAndPlateau) {
  const inputs::Coupler c = plateau_coupler();
  for (const double within : {0.0, 0.1, c.swing_limit}) {
    EXPECT_EQ(model::swing_moment(c, within), 0.0);
    EXPECT_EQ(model::swing_moment(c, -within), 0.0);
  }
  // Positive on both cars when beta exceeds theta (paper, text below eq. 12).
  EXPECT_GT(model::swing_moment(c, std::nextafter(c.swing_limit, 1.0)), 0.0);
  EXPECT_LT(model::swing_moment(c, std::nextafter(-c.swing_limit, -1.0)), 0.0);
  EXPECT_NEAR(model::swing_moment(c, c.swing_limit + 0.3) / (0.3 * c.swing_stiffness), 1.0, 1e-14);
  EXPECT_EQ(model::swing_moment(c, c.swing_limit + 0.6), c.swing_moment_max);
  EXPECT_EQ(model::swing_moment(c, -c.swing_limit - 0.6), -c.swing_moment_max);
  EXPECT_NEAR(model::swing_moment(inputs::Coupler{}, 3.0) / (c.swing_stiffness * (3.0 - c.swing_limit)), 1.0, 1e-14);
}

TEST(SwingMoment, EnergyIsItsIntegral) {
  test::Random random(2);
  for (const inputs::Coupler& c : {plateau_coupler(), inputs::Coupler{}}) {
    for (int i = 0; i < 200; ++i) {
      const double gamma = test::random_swing(c, random), h = 1e-3;
      const double slope = (model::swing_energy(c, gamma + h) - model::swing_energy(c, gamma - h)) / (2.0 * h);
      EXPECT_NEAR(slope, model::swing_moment(c, gamma), 1e-11 * c.swing_stiffness) << gamma;
    }
    // From zero over every corner, by the trapezoidal rule: exact but for the corners' cells.
    double integral = 0.0;
    const int cells = 30000;
    const double d = 3.0 / cells;
    for (int i = 0; i < cells; ++i)
      integral += 0.5 * d * (model::swing_moment(c, i * d) + model::swing_moment(c, (i + 1) * d));
    EXPECT_NEAR(model::swing_energy(c, 3.0) / integral, 1.0, 1e-7);
    EXPECT_EQ(model::swing_energy(c, 3.0), model::swing_energy(c, -3.0));
  }
}

TEST(SwingAngle, IsBetaMinusThetaWrapped) {
  for (double beta = -3.0; beta <= 3.0; beta += 0.37) {
    for (double theta = -9.0; theta <= 9.0; theta += 0.41) {
      const double gamma = model::swing_angle<Trigonometry<double>>(true, std::cos(beta), std::sin(beta),
                                                                    std::cos(theta), std::sin(theta));
      EXPECT_NEAR(std::remainder(gamma - (beta - theta), 2.0 * test::kPi), 0.0, 1e-14);
      EXPECT_LE(std::abs(gamma), test::kPi);
    }
  }
}

// The bar has no mass: forces and moments on it cancel (eq. 14). It feels the opposite of what the cars feel.
TEST(CouplerBar, IsInEquilibrium) {
  inputs::Coupler c = plateau_coupler();
  c.stiffness = 1e6;  // forces of the size of the moments, so that neither hides an error of the other
  test::Random random(3);
  int bent = 0;
  for (int i = 0; i < 500; ++i) {
    const double gap = test::random_gap(c, random), beta = random.uniform(-test::kPi, test::kPi);
    const double lead = beta - test::random_swing(c, random), trail = beta - test::random_swing(c, random);
    const Vec pin_lead{random.uniform(-9.0, 9.0), random.uniform(-9.0, 9.0)};
    const Vec pin_trail = pin_lead - gap * Vec(std::cos(beta), std::sin(beta));
    const Vec d = pin_lead - pin_trail;
    const auto s =
        model::coupler_state<double>(c, d.x(), d.y(), std::cos(lead), std::sin(lead), std::cos(trail), std::sin(trail));
    EXPECT_NEAR(s.gap, gap, 1e-13);
    EXPECT_NEAR(s.swing_lead, std::remainder(beta - lead, 2.0 * test::kPi), 1e-12);
    EXPECT_NEAR(s.swing_trail, std::remainder(beta - trail, 2.0 * test::kPi), 1e-12);
    EXPECT_NEAR(s.moment_lead, model::swing_moment(c, s.swing_lead), 1e-13 * c.swing_stiffness);
    EXPECT_NEAR(s.moment_trail, model::swing_moment(c, s.swing_trail), 1e-13 * c.swing_stiffness);
    const Vec on_lead(s.force_x, s.force_y), on_trail(-s.force_x, -s.force_y);
    const double about_origin =
        cross(pin_lead, -on_lead) + cross(pin_trail, -on_trail) - s.moment_lead - s.moment_trail;
    const double scale =
        10.0 * (std::abs(s.axial) + std::abs(s.lateral)) + std::abs(s.moment_lead) + std::abs(s.moment_trail);
    EXPECT_NEAR(about_origin, 0.0, 1e-13 * (scale + 1.0));
    // Buff pushes the lead car away from the trail car, along the bar.
    EXPECT_NEAR(on_lead.dot(d) / gap, model::axial_force(c, s.gap), 1e-13 * scale + 1e-6);
    EXPECT_NEAR(s.lateral * s.gap, s.moment_lead + s.moment_trail, 1e-13 * scale);
    if (s.lateral != 0.0) ++bent;
  }
  EXPECT_GT(bent, 200);
}

struct Meeting {
  inputs::Scenario scenario;
  double rate, contact, part, peak;  // of the spring between two cars [rad/s]; times of first touch and parting; force
};

/// Two free cars on a line, at mid-slack, whose gap changes at `closing` (positive: buff).
Meeting meeting(double closing) {
  Meeting m;
  m.scenario = test::baseline(2);
  test::set_friction(m.scenario, 0.0, 0.0);
  const double mass = m.scenario.consist[0].weight / inputs::kStandardGravity;
  m.rate = std::sqrt(2.0 * m.scenario.coupler.stiffness / mass);
  m.contact = 0.5 * m.scenario.coupler.slack / std::abs(closing);
  m.part = m.contact + test::kPi / m.rate;
  m.peak = std::abs(closing) * std::sqrt(0.5 * m.scenario.coupler.stiffness * mass);
  m.scenario.stop.time_max = m.part + 0.5 * m.contact;  // still on the way back through the slack
  return m;
}

simulation::Simulation meet(const Meeting& m, double closing) {
  const double pitch = m.scenario.consist[0].length + m.scenario.coupler.length;
  return {m.scenario, test::state_of({CarMotion{0.0, 0.0, 0.0, 10.0 - 0.5 * closing, 0.0, 0.0},
                                      CarMotion{-pitch, 0.0, 0.0, 10.0 + 0.5 * closing, 0.0, 0.0}})};
}

class TwoCars : public testing::TestWithParam<double> {};

TEST_P(TwoCars, LoadTheCouplerToTheClosedForm) {
  const double closing = GetParam();
  Meeting m = meeting(closing);
  test::set_tolerance(m.scenario, 1e-8);  // of speeds of 10 m/s and places of 20 m, when the spring gives way by 7 mm
  simulation::Simulation sim = meet(m, closing);
  sim.run();
  const outcome::Outcome o = sim.outcome();
  const outcome::PeakForce& loaded = closing > 0.0 ? o.coupler_buff_peak : o.coupler_draft_peak;
  const outcome::PeakForce& idle = closing > 0.0 ? o.coupler_draft_peak : o.coupler_buff_peak;
  EXPECT_NEAR(loaded.force / m.peak, 1.0, 1e-3);
  EXPECT_EQ(loaded.coupler, 1);
  // Within 0.045 rad of the top the force is flat to 1e-3.
  EXPECT_NEAR(loaded.time, m.contact + 0.5 * test::kPi / m.rate, 0.05 / m.rate);
  EXPECT_EQ(idle.force, 0.0);
  EXPECT_EQ(idle.coupler, 0);
  EXPECT_NEAR(o.relative_speed_max.speed / std::abs(closing), 1.0, 1e-3);
}

TEST_P(TwoCars, PartAsTheyMetAndKeepTheEnergy) {
  const double closing = GetParam();
  Meeting m = meeting(closing);
  test::set_tolerance(m.scenario, 1e-11);
  simulation::Simulation sim = meet(m, closing);
  const double mass = sim.cars()[0].mass;
  const double energy = 0.5 * mass * (std::pow(10.0 - 0.5 * closing, 2) + std::pow(10.0 + 0.5 * closing, 2));
  const model::DerailmentModel reference(m.scenario);
  double peak = 0.0;
  for (int i = 1; i <= 2000; ++i) {
    sim.advance(m.part * i / 2000.0);
    const model::EnergyLedger ledger = reference.energy(sim.state().data());
    EXPECT_NEAR(ledger.total() / energy, 1.0, 1e-8);  // rtol 1e-11, some hundred steps, dense output
    peak = std::max(peak, std::abs(sim.snapshot().couplers[0].axial_force));
    if (sim.time() < m.contact - 1e-9) {
      EXPECT_EQ(sim.snapshot().couplers[0].axial_force, 0.0);
    }
  }
  EXPECT_NEAR(peak / m.peak, 1.0, 1e-5);  // samples 1e-4 s apart miss the top by 1e-7 at most
  sim.run();
  const simulation::Snapshot end = sim.snapshot();
  EXPECT_NEAR(end.cars[0].vx, 10.0 + 0.5 * closing, 1e-7);
  EXPECT_NEAR(end.cars[1].vx, 10.0 - 0.5 * closing, 1e-7);
  EXPECT_EQ(end.couplers[0].axial_force, 0.0);
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::time_max);
}

TEST_P(TwoCars, PeakIsFoundBetweenTheSteps) {
  // At the default tolerance the steps are long against the contact: the peak is not at the end of a step.
  const Meeting m = meeting(GetParam());
  simulation::Simulation sim = meet(m, GetParam());
  double peak = 0.0;
  for (int i = 1; i <= 2000; ++i) {
    sim.advance(m.part * i / 2000.0);
    peak = std::max(peak, std::abs(sim.snapshot().couplers[0].axial_force));
  }
  sim.run();
  EXPECT_NEAR(sim.outcome().coupler_force_peak() / peak, 1.0, 1e-3);
  EXPECT_NEAR(sim.outcome().coupler_force_peak() / m.peak, 1.0, 1e-2);
}

TEST_P(TwoCars, PeakIsOfTheRunNotOfTheStepBeyondIt) {
  // The run ends halfway up the load: what the last step has seen past the end does not count.
  Meeting m = meeting(GetParam());
  m.scenario.stop.time_max = m.contact + 0.25 * test::kPi / m.rate;
  simulation::Simulation sim = meet(m, GetParam());
  sim.run();
  const outcome::Outcome o = sim.outcome();
  const outcome::PeakForce& loaded = GetParam() > 0.0 ? o.coupler_buff_peak : o.coupler_draft_peak;
  EXPECT_LE(loaded.time, o.stop_time);
  EXPECT_NEAR(loaded.force, std::abs(sim.snapshot().couplers[0].axial_force), 1e-3 * m.peak);
  EXPECT_NEAR(loaded.force / m.peak, std::sqrt(0.5), 1e-2);
}

INSTANTIATE_TEST_SUITE_P(BuffAndDraft, TwoCars, testing::Values(1.0, -1.0, 4.0, -4.0));

}  // namespace
}  // namespace train_derail
