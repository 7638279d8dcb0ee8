// The equations of motion against a free-body diagram: forces and moments are put together here from vectors and cross
// products, not from equations (10) to (12), and compared with the model at random states. Each erratum has a case too.
#include <string>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using Vec = Eigen::Vector2d;
using inputs::OnTrackLaw;

double cross(const Vec& a, const Vec& b) { return a.x() * b.y() - a.y() * b.x(); }

/// One body of the diagram. Scales are sums of magnitudes: what rounding errors are measured against.
struct Body {
  Vec centre, velocity, heading;
  double theta, omega, mass, inertia, weight, length, spacing;
  bool derailed;
  Vec force = Vec::Zero();
  double moment = 0.0, force_scale = 0.0, moment_scale = 0.0, dissipation = 0.0;

  Vec at(double offset) const { return centre + offset * heading; }
  Vec velocity_at(double offset) const { return velocity + omega * offset * Vec(-heading.y(), heading.x()); }
  void push(double offset, const Vec& f, double scale) {
    force += f;
    moment += cross(at(offset) - centre, f);
    force_scale += scale;
    moment_scale += std::abs(offset) * scale;
  }
  void twist(double m) {
    moment += m;
    moment_scale += std::abs(m);
  }
};

std::vector<Body> bodies_of(const inputs::Scenario& s, const model::DerailmentModel& m,
                            const model::StateVector& state) {
  std::vector<Body> bodies;
  const auto motion = model::motion(state.data(), m.car_count());
  for (const inputs::CarBlock& b : s.consist) {
    for (int i = 0; i < b.count; ++i) {
      const auto k = static_cast<Eigen::Index>(bodies.size());
      Body body;
      body.centre = Vec(motion(k, model::X), motion(k, model::Y));
      body.velocity = Vec(motion(k, model::VX), motion(k, model::VY));
      body.theta = motion(k, model::THETA);
      body.omega = motion(k, model::OMEGA);
      body.heading = Vec(std::cos(body.theta), std::sin(body.theta));
      body.weight = b.weight;
      body.mass = b.weight / inputs::kStandardGravity;
      body.length = b.length;
      body.spacing = b.truck_spacing ? *b.truck_spacing : b.truck_spacing_factor.value_or(0.71) * b.length;
      body.inertia =
          b.yaw_inertia ? *b.yaw_inertia : b.yaw_inertia_factor.value_or(0.093) * body.mass * b.length * b.length;
      body.derailed = m.derailed(k);
      bodies.push_back(body);
    }
  }
  return bodies;
}

void apply_ground(const inputs::Scenario& s, std::vector<Body>& bodies) {
  for (Body& b : bodies) {
    const double load = 0.5 * b.weight * (b.derailed ? s.ground.off_track_friction : s.ground.on_track_friction);
    for (const double offset : {0.5 * b.spacing, -0.5 * b.spacing}) {
      Vec v = b.velocity_at(offset);
      if (!b.derailed && s.ground.on_track_law == OnTrackLaw::along_track) v.y() = 0.0;  // sideways the car is free
      const Vec f = -load * v / std::hypot(v.norm(), s.ground.regularization_speed);
      b.push(offset, f, load);
      b.dissipation -= f.dot(v);
    }
  }
}

/// The bar between the pins: it pushes with F along itself, its ends twist the cars, and it has no mass. `p`, the force
/// on its front end, follows from these two equations; the car feels the opposite.
void apply_coupler(const inputs::Coupler& c, Body& lead, Body& trail) {
  const Vec front = lead.at(-0.5 * lead.length), rear = trail.at(0.5 * trail.length), bar = front - rear;
  const double gap = bar.norm(), beta = std::atan2(bar.y(), bar.x());
  double axial = 0.0;  // positive in buff
  if (gap < c.length - c.slack / 2.0) axial = c.stiffness * (c.length - c.slack / 2.0 - gap);
  if (gap > c.length + c.slack / 2.0) axial = -c.stiffness * (gap - c.length - c.slack / 2.0);
  const auto end_moment = [&](double theta) {
    const double gamma = std::remainder(beta - theta, 2.0 * test::kPi);
    const double excess = std::max(std::abs(gamma) - c.swing_limit, 0.0);
    return std::copysign(std::min(c.swing_stiffness * excess, c.swing_moment_max), gamma);
  };
  const double m_lead = end_moment(lead.theta), m_trail = end_moment(trail.theta);
  Eigen::Matrix2d equations;
  equations.row(0) = bar.transpose() / gap;  // p . u = -F
  equations.row(1) << -bar.y(), bar.x();     // bar x p - m_lead - m_trail = 0, about the rear end
  const Vec p = equations.inverse() * Vec(-axial, m_lead + m_trail);
  const double scale = c.stiffness * gap + p.norm();
  lead.push(-0.5 * lead.length, -p, scale);
  trail.push(0.5 * trail.length, p, scale);
  lead.twist(m_lead);
  trail.twist(m_trail);
}

class FreeBody : public testing::TestWithParam<OnTrackLaw> {};

TEST_P(FreeBody, AgreesWithTheModelAtRandomStates) {
  inputs::Scenario s = test::mixed_train();
  s.ground.on_track_law = GetParam();
  test::Random random(11);
  for (int round = 0; round < 300; ++round) {
    // Stiffness from that of the ground forces to the paper's, so that no force hides behind another one's rounding.
    s.coupler.stiffness = std::pow(10.0, random.uniform(5.0, 8.9));
    s.coupler.swing_stiffness = std::pow(10.0, random.uniform(4.0, 7.0));
    s.coupler.swing_moment_max = round % 2 == 0 ? inputs::kInfinity : 0.5 * s.coupler.swing_stiffness;
    s.ground.regularization_speed = random.uniform(0.01, 1.0);
    model::DerailmentModel m(s);
    test::derail_at_random(m, random);
    model::StateVector y = test::random_state(m, random);
    const bool guided = GetParam() == OnTrackLaw::guided;
    if (guided) test::put_on_rails(m, y);

    std::vector<Body> bodies = bodies_of(s, m, y);
    apply_ground(s, bodies);
    for (std::size_t k = 0; k + 1 < bodies.size(); ++k) apply_coupler(s.coupler, bodies[k], bodies[k + 1]);

    model::StateVector rate(m.size());
    m.derivative(y.data(), rate.data());
    const auto d = model::motion(rate.data(), m.car_count());
    double on_track = 0.0, off_track = 0.0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Body& b = bodies[i];
      const auto k = static_cast<Eigen::Index>(i);
      SCOPED_TRACE("round " + std::to_string(round) + ", car " + std::to_string(i + 1));
      const bool held = guided && !b.derailed;
      EXPECT_EQ(d(k, model::X), b.velocity.x());
      EXPECT_EQ(d(k, model::Y), b.velocity.y());
      EXPECT_EQ(d(k, model::THETA), b.omega);
      // Rounding: dozens of operations of 1e-16 each, the first of them on coordinates of 100 m for gaps of 1 m.
      EXPECT_NEAR(d(k, model::VX) * b.mass, b.force.x(), 1e-12 * b.force_scale);
      EXPECT_NEAR(d(k, model::VY) * b.mass, held ? 0.0 : b.force.y(), held ? 0.0 : 1e-12 * b.force_scale);
      EXPECT_NEAR(d(k, model::OMEGA) * b.inertia, held ? 0.0 : b.moment, held ? 0.0 : 1e-12 * b.moment_scale);
      (b.derailed ? off_track : on_track) += b.dissipation;
    }
    const auto power = model::work(rate.data(), m.car_count());
    EXPECT_NEAR(power(model::WORK_ON_TRACK), on_track, 1e-12 * (on_track + off_track));
    EXPECT_NEAR(power(model::WORK_OFF_TRACK), off_track, 1e-12 * (on_track + off_track));
    if (testing::Test::HasFailure()) break;  // one state tells enough
  }
}

INSTANTIATE_TEST_SUITE_P(OnTrack, FreeBody,
                         testing::Values(OnTrackLaw::isotropic, OnTrackLaw::along_track, OnTrackLaw::guided),
                         testing::PrintToStringParamName());

TEST(TrainBalance, CouplersAddNoForceAndNoMoment) {
  inputs::Scenario s = test::mixed_train();
  test::set_friction(s, 0.0, 0.0);
  s.coupler.stiffness = 1e6;
  s.coupler.swing_stiffness = 1e6;
  const model::DerailmentModel reference(s);
  model::DerailmentModel m(s);
  test::Random random(12);
  for (int round = 0; round < 300; ++round) {
    const model::StateVector y = test::random_state(m, random);
    model::StateVector rate(m.size());
    m.derivative(y.data(), rate.data());
    const auto q = model::motion(y.data(), m.car_count());
    const auto d = model::motion(rate.data(), m.car_count());
    Vec force = Vec::Zero();
    double moment = 0.0, scale = 0.0, moment_scale = 0.0;
    for (Eigen::Index k = 0; k < m.car_count(); ++k) {
      const model::Car& c = m.cars()[static_cast<std::size_t>(k)];
      const Vec f = c.mass * Vec(d(k, model::VX), d(k, model::VY)), at(q(k, model::X), q(k, model::Y));
      force += f;
      moment += cross(at, f) + c.yaw_inertia * d(k, model::OMEGA);
      scale += f.norm();
      moment_scale += at.norm() * f.norm() + c.yaw_inertia * std::abs(d(k, model::OMEGA));
    }
    EXPECT_LT(force.norm(), 1e-13 * scale);
    EXPECT_LT(std::abs(moment), 1e-13 * moment_scale);
    // The accelerations are the rate of the momentum that the model reports.
    const double h = 1e-6;
    const model::StateVector ahead = y + h * rate, behind = y - h * rate;
    const model::Momentum p = reference.momentum(ahead.data()), r = reference.momentum(behind.data());
    EXPECT_NEAR((p.angular - r.angular) / (2.0 * h) / moment_scale, 0.0, 1e-6);
  }
}

/// The rate of change of a train of `cars` in reading `law`; all of them off the track if `derailed`.
model::StateVector rate_of(const inputs::Scenario& s, const std::vector<CarMotion>& cars, bool derailed = true) {
  model::DerailmentModel m(s);
  if (derailed)
    for (Eigen::Index k = 0; k < m.car_count(); ++k) m.derail(k);
  const model::StateVector y = test::state_of(cars);
  model::StateVector rate(m.size());
  m.derivative(y.data(), rate.data());
  return rate;
}

constexpr double kG = inputs::kStandardGravity;

TEST(Erratum10And11, BothTrucksBrake) {
  inputs::Scenario s = test::baseline(1);
  s.ground.regularization_speed = 1e-9;
  const model::StateVector rate = rate_of(s, {CarMotion{0, 0, 0.3, 6.0, 8.0, 0}});
  const auto d = model::motion(rate.data(), 1);
  EXPECT_NEAR(d(0, model::VX), -0.5 * kG * 0.6, 1e-12);
  EXPECT_NEAR(d(0, model::VY), -0.5 * kG * 0.8, 1e-12);
  EXPECT_NEAR(d(0, model::OMEGA), 0.0, 1e-12);
}

TEST(Erratum10, LateralForceOfTheFrontCouplerHasASine) {
  // Bar along y at mid-slack, so that F = 0: E acts along x alone; a cosine would make it vanish.
  inputs::Scenario s = test::baseline(2);
  test::set_friction(s, 0.0, 0.0);
  const double half = 0.5 * s.consist[0].length, gap = s.coupler.length;
  const model::StateVector rate = rate_of(s, {CarMotion{half, gap, 0, 0, 0, 0}, CarMotion{-half, 0, 0, 0, 0, 0}});
  const auto d = model::motion(rate.data(), 2);
  // gamma is 90 degrees at both ends.
  const double moment = s.coupler.swing_stiffness * (0.5 * test::kPi - s.coupler.swing_limit);
  const double mass = s.consist[0].weight / kG, e = 2.0 * moment / gap;
  EXPECT_NEAR(d(0, model::VX) * mass / e, 1.0, 1e-12);
  EXPECT_NEAR(d(1, model::VX) * mass / e, -1.0, 1e-12);
  EXPECT_NEAR(d(0, model::VY) * mass / e, 0.0, 1e-12);
  EXPECT_NEAR(d(1, model::VY) * mass / e, 0.0, 1e-12);
  // The end moments turn both cars towards the bar.
  EXPECT_GT(d(0, model::OMEGA), 0.0);
  EXPECT_GT(d(1, model::OMEGA), 0.0);
}

TEST(Erratum12, BothTrucksBrakeTheYaw) {
  inputs::Scenario s = test::baseline(1);
  s.ground.regularization_speed = 1e-9;
  const model::StateVector rate = rate_of(s, {CarMotion{0, 0, 1.1, 0, 0, 0.7}});
  const auto d = model::motion(rate.data(), 1);
  const model::Car c = model::expand(s.consist).at(0);
  EXPECT_EQ(d(0, model::THETA), 0.7);  // theta-dot is the yaw rate, the moment goes to theta-double-dot
  EXPECT_NEAR(d(0, model::OMEGA) * c.yaw_inertia / (-0.5 * c.weight * 0.5 * c.truck_spacing), 1.0, 1e-12);
}

TEST(Erratum12, EachCarFeelsItsOwnEndsMoments) {
  // Three cars, bars straight at mid-slack; only the last car is turned, so only coupler 2's rear end bends. The first
  // car feels nothing; the second only the lateral force, at its rear pin; the last car its own front moment.
  inputs::Scenario s = test::baseline(3);
  test::set_friction(s, 0.0, 0.0);
  const double length = s.consist[0].length, gap = s.coupler.length, turn = 0.5;
  const double pin = -1.5 * length - 2.0 * gap;  // front pin of the last car
  const model::StateVector rate =
      rate_of(s, {CarMotion{0, 0, 0, 0, 0, 0}, CarMotion{-length - gap, 0, 0, 0, 0, 0},
                  CarMotion{pin - 0.5 * length * std::cos(turn), -0.5 * length * std::sin(turn), turn, 0, 0, 0}});
  const auto d = model::motion(rate.data(), 3);
  const model::Car c = model::expand(s.consist).at(0);
  const double m = -s.coupler.swing_stiffness * (turn - s.coupler.swing_limit), e = m / gap;  // gamma = -turn
  EXPECT_NEAR(d(0, model::OMEGA) * c.yaw_inertia / m, 0.0, 1e-6);  // K times the rounding of a gap is some 1e-7 N
  EXPECT_NEAR(d(1, model::OMEGA) * c.yaw_inertia / (0.5 * length * e), 1.0, 1e-6);
  EXPECT_NEAR(d(1, model::VY) * c.mass / -e, 1.0, 1e-6);
  EXPECT_NEAR(d(2, model::VY) * c.mass / e, 1.0, 1e-6);
  EXPECT_NEAR(d(2, model::OMEGA) * c.yaw_inertia / (m + 0.5 * length * std::cos(turn) * e), 1.0, 1e-6);
}

TEST(Erratum3, FrictionOpposesAMotionBackwards) {
  inputs::Scenario s = test::baseline(1);
  const model::StateVector rate = rate_of(s, {CarMotion{0, 0, 0, -6.0, -8.0, 0}});
  EXPECT_GT(model::motion(rate.data(), 1)(0, model::VX), 0.0);
  EXPECT_GT(model::motion(rate.data(), 1)(0, model::VY), 0.0);
  const model::StateVector still = rate_of(s, {CarMotion{0, 0, 0, 0, 0, 0}});
  EXPECT_EQ(still.norm(), 0.0);  // no division by zero at rest
}

TEST(Erratum6And7, BuffPushesApartInEveryQuadrant) {
  inputs::Scenario s = test::baseline(2);
  test::set_friction(s, 0.0, 0.0);
  s.coupler.swing_stiffness = 0.0;
  const double half = 0.5 * s.consist[0].length, squeeze = 0.1;
  const double gap = s.coupler.length - 0.5 * s.coupler.slack - squeeze;
  for (int i = 0; i < 8; ++i) {
    const double beta = i * 0.25 * test::kPi;  // 90 degrees too: no quotient of infinity
    const model::StateVector rate = rate_of(
        s, {CarMotion{half + gap * std::cos(beta), gap * std::sin(beta), 0, 0, 0, 0}, CarMotion{-half, 0, 0, 0, 0, 0}});
    const auto d = model::motion(rate.data(), 2);
    const double a = s.coupler.stiffness * squeeze * kG / s.consist[0].weight;
    EXPECT_NEAR(d(0, model::VX) / a, std::cos(beta), 1e-12) << i;
    EXPECT_NEAR(d(0, model::VY) / a, std::sin(beta), 1e-12) << i;
    EXPECT_NEAR(d(1, model::VX) / a, -std::cos(beta), 1e-12) << i;
    EXPECT_NEAR(d(1, model::VY) / a, -std::sin(beta), 1e-12) << i;
  }
}

TEST(Erratum15, TrainStartsAtMidSlack) {
  const inputs::Scenario s = test::mixed_train();
  const model::DerailmentModel m(s);
  const model::StateVector y = m.initial_state();
  const auto q = model::motion(y.data(), m.car_count());
  double x = 0.0;
  for (Eigen::Index k = 0; k < m.car_count(); ++k) {
    if (k > 0) {
      const auto i = static_cast<std::size_t>(k);
      x -= 0.5 * (m.cars()[i - 1].length + m.cars()[i].length) + s.coupler.length;
      EXPECT_NEAR(m.coupler(y.data(), k - 1).gap, s.coupler.length, 1e-12);
      EXPECT_NEAR(m.front_pin(y.data(), k).position.x() + s.coupler.length, m.rear_pin(y.data(), k - 1).position.x(),
                  1e-12);
    }
    EXPECT_NEAR(q(k, model::X), x, 1e-12);
    EXPECT_EQ(q(k, model::VX), s.initial.speed);
    EXPECT_EQ(q(k, model::OMEGA), k == 0 ? s.initial.yaw_rate : 0.0);
    EXPECT_EQ(q(k, model::Y), 0.0);
    EXPECT_EQ(q(k, model::THETA), 0.0);
    EXPECT_EQ(q(k, model::VY), 0.0);
    EXPECT_EQ(m.derailed(k), k == 0);
  }
}

}  // namespace
}  // namespace train_derail
