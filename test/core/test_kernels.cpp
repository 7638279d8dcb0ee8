// The versions of the right-hand side for different instruction sets agree with the plain one; gaps with the points.
#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/extended_model.hpp"

namespace train_derail {
namespace {

inputs::Scenario train(int cars, test::Random& random) {
  inputs::Scenario s = test::mixed_train();
  const std::vector<inputs::CarBlock> kinds = s.consist;
  s.consist.clear();
  for (int left = cars; left > 0;) {
    inputs::CarBlock block = kinds[static_cast<std::size_t>(random.index(3))];
    block.count = std::min(left, 1 + random.index(4));
    left -= block.count;
    s.consist.push_back(block);
  }
  return s;
}

/// check(name, model, state): a random train in a random state, in every version of the kernels.
template <typename Check>
void with_each_kernel(int cars, Check&& check) {
  test::Random random(33);
  const inputs::Scenario s = train(cars, random);
  for (const std::string& name : model::DerailmentModel::instruction_sets(cars)) {
    model::DerailmentModel m(s, name);
    check(name, m, test::random_state(m, random));
  }
}

TEST(Kernels, PlainIsAlwaysThereAndOthersAreNamed) {
  EXPECT_EQ(model::DerailmentModel::instruction_sets(1), std::vector<std::string>{"plain"});
  EXPECT_EQ(model::DerailmentModel::instruction_sets(1000).back(), "plain");
  const inputs::Scenario s = test::baseline(3);
  EXPECT_THROW(model::DerailmentModel(s, "abacus"), std::invalid_argument);
}

TEST(Kernels, AgreeWithThePlainVersion) {
  test::Random random(31);
  int compared = 0;
  for (const auto law : {inputs::OnTrackLaw::isotropic, inputs::OnTrackLaw::along_track, inputs::OnTrackLaw::guided}) {
    for (int cars = 1; cars <= 40; ++cars) {
      inputs::Scenario s = train(cars, random);
      s.ground.on_track_law = law;
      s.coupler.swing_moment_max = random.index(2) == 0 ? inputs::kInfinity : 1e4;
      const std::vector<std::string> sets = model::DerailmentModel::instruction_sets(cars);
      for (const std::string& name : sets) {
        if (name == "plain") continue;
        model::DerailmentModel plain(s, "plain"), fast(s, name);
        for (Eigen::Index k = 1; k < cars; ++k) {
          if (random.index(2) == 0) continue;
          plain.derail(k);
          fast.derail(k);
        }
        const model::StateVector y = test::random_state(plain, random);
        model::StateVector expected(y.size()), found(y.size());
        plain.derivative(y.data(), expected.data());
        fast.derivative(y.data(), found.data());
        const auto e = model::motion(expected.data(), cars), f = model::motion(found.data(), cars);
        for (Eigen::Index c = 0; c < model::kCoordinates; ++c) {
          const double scale = e.col(c).abs().maxCoeff();
          EXPECT_LE((e.col(c) - f.col(c)).abs().maxCoeff(), 1e-12 * scale) << name << ' ' << cars << " column " << c;
        }
        const auto work_e = model::work(expected.data(), cars), work_f = model::work(found.data(), cars);
        for (Eigen::Index w = 0; w < model::kWorkTerms; ++w) {
          EXPECT_NEAR(work_f[w], work_e[w], 1e-12 * work_e.abs().maxCoeff()) << name << ' ' << cars << " work " << w;
        }
        Eigen::ArrayXd gap_e, gap_f, rate_e, rate_f;
        plain.gaps(y.data(), gap_e, rate_e);
        fast.gaps(y.data(), gap_f, rate_f);
        EXPECT_LE((gap_e - gap_f).abs().maxCoeff(), 1e-12 * gap_e.maxCoeff());
        EXPECT_LE((rate_e - rate_f).abs().maxCoeff(), 1e-12 * rate_e.abs().maxCoeff());
        ++compared;
      }
    }
  }
#ifdef __x86_64__
  EXPECT_GE(compared, 100);  // there is one that every such processor runs
#endif
}

TEST(Kernels, AccelerationsAreThoseOfTheDerivative) {
  with_each_kernel(21, [](const std::string& name, model::DerailmentModel& m, const model::StateVector& y) {
    model::StateVector expected(y.size()), found = model::StateVector::Constant(y.size(), -7.0);
    EXPECT_TRUE(m.derivative(y.data(), expected.data()));
    EXPECT_TRUE(m.accelerations(y.data(), found.data()));
    const Eigen::Index positions = 3 * m.car_count();
    EXPECT_EQ(expected.tail(y.size() - positions), found.tail(y.size() - positions)) << name;
    EXPECT_TRUE((found.head(positions).array() == -7.0).all()) << name;
    EXPECT_EQ(expected.head(positions), y.segment(positions, positions)) << name;
  });
}

TEST(Kernels, SayWhetherTheDerivativeIsFinite) {
  with_each_kernel(21, [](const std::string& name, model::DerailmentModel& m, const model::StateVector& y) {
    model::StateVector rate(y.size());
    EXPECT_TRUE(m.derivative(y.data(), rate.data())) << name;
    for (Eigen::Index i = 0; i < model::kCoordinates * m.car_count(); ++i) {
      for (const double bad : {inputs::kInfinity, -inputs::kInfinity, std::nan("")}) {
        model::StateVector broken = y;
        broken[i] = bad;
        const bool found = m.derivative(broken.data(), rate.data());
        EXPECT_FALSE(found) << name << " component " << i << " is " << bad;
        EXPECT_EQ(found, rate.allFinite()) << name << " component " << i << " is " << bad;
      }
    }
  });
}

TEST(Kernels, HeadingsAreThoseOfTheStandardLibrary) {
  test::Random random(34);
  const auto expect_headings = [&random](const model::TrainModel& m, const std::string& name) {
    model::StateVector y = model::StateVector::Zero(m.size());
    Eigen::ArrayXd cosine, sine;
    for (const double range : {1e-9, 0.1, 1.6, 7.0, 1e3, 1e6}) {
      auto theta = model::motion(y.data(), m.car_count()).col(model::THETA);
      for (Eigen::Index k = 0; k < m.car_count(); ++k) theta[k] = random.uniform(-range, range);
      m.headings(y.data(), cosine, sine);
      for (Eigen::Index k = 0; k < m.car_count(); ++k) {
        EXPECT_NEAR(cosine[k], std::cos(theta[k]), 4e-16) << name << ' ' << theta[k];
        EXPECT_NEAR(sine[k], std::sin(theta[k]), 4e-16) << name << ' ' << theta[k];
      }
    }
  };
  const inputs::Scenario s = train(33, random), extended = test::accident(33);
  for (const std::string& name : model::DerailmentModel::instruction_sets(33))
    expect_headings(model::DerailmentModel(s, name), name);
  for (const std::string& name : model::ExtendedModel::instruction_sets(33)) {
    expect_headings(model::ExtendedModel(extended, name), "extended, " + name);
  }
}

TEST(Kernels, GapsAreThoseOfThePins) {
  with_each_kernel(23, [](const std::string& name, model::DerailmentModel& m, const model::StateVector& y) {
    Eigen::ArrayXd gap, rate;
    m.gaps(y.data(), gap, rate);
    ASSERT_EQ(gap.size(), 22);
    ASSERT_EQ(rate.size(), 22);
    for (Eigen::Index i = 0; i < 22; ++i) {
      const model::PointMotion lead = m.rear_pin(y.data(), i), trail = m.front_pin(y.data(), i + 1);
      const Eigen::Vector2d d = lead.position - trail.position;
      EXPECT_NEAR(gap[i], d.norm(), 1e-12) << name;
      EXPECT_NEAR(rate[i], d.normalized().dot(lead.velocity - trail.velocity), 1e-11);
    }
  });
}

TEST(Kernels, WholeTrainFunctionsAreThoseOfEachCarAndCoupler) {
  with_each_kernel(23, [](const std::string& name, model::DerailmentModel& m, const model::StateVector& y) {
    Eigen::ArrayXd cosine, sine;
    m.headings(y.data(), cosine, sine);
    double foremost = -inputs::kInfinity;
    for (Eigen::Index k = 0; k < 23; ++k) {
      const model::CarMotion car = m.car_motion(y.data(), k);
      EXPECT_NEAR(cosine[k], car.axis.x(), 1e-15) << name << ' ' << k;
      EXPECT_NEAR(sine[k], car.axis.y(), 1e-15) << name << ' ' << k;
      if (k > 0) foremost = std::max(foremost, car.centre.x());
    }
    EXPECT_EQ(m.foremost_on_track(y.data()), foremost) << name;
    const std::vector<model::CouplerState<double>> couplers = m.couplers(y.data());
    ASSERT_EQ(couplers.size(), 22u);
    for (Eigen::Index i = 0; i < 22; ++i) {
      const model::CouplerState<double> found = couplers[static_cast<std::size_t>(i)],
                                        expected = m.coupler(y.data(), i);
      EXPECT_NEAR(found.gap, expected.gap, 1e-12);
      EXPECT_NEAR(found.axial, expected.axial, 1e-12 * m.coupler_law().stiffness);
      EXPECT_NEAR(found.swing_lead, expected.swing_lead, 1e-12);
      EXPECT_NEAR(found.swing_trail, expected.swing_trail, 1e-12);
      EXPECT_NEAR(found.lateral, expected.lateral, 1e-9 * (1.0 + std::abs(expected.lateral)));
    }
    for (Eigen::Index k = 1; k < 23; ++k) m.derail(k);
    EXPECT_EQ(m.foremost_on_track(y.data()), -inputs::kInfinity) << name;
  });
}

/// State after `steps` steps of 2 ms with everything switched on.
model::StateVector after(const inputs::Scenario& scenario, const std::string& instruction_set, int steps) {
  model::ExtendedModel m(scenario, instruction_set);
  const Eigen::Index n = 3 * m.car_count();
  const double h = 0.002;
  model::StateVector y = m.initial_state(), before(y.size());
  Eigen::VectorXd acceleration(n);
  m.start(y.data());
  for (int i = 0; i < steps; ++i) {
    m.accelerations(i * h, h, y.data(), acceleration.data());
    before = y;
    y.segment(n, n) += h * acceleration;
    y.head(n) += h * y.segment(n, n);
    m.settle(i * h, h, before.data(), y.data());
  }
  return y;
}

TEST(ExtendedKernels, AgreeWithThePlainVersion) {
  inputs::Scenario s = inputs::read_scenario_file(TRAIN_DERAIL_SOURCE_DIR "/config/accident.yaml");
  const inputs::CarBlock car = s.consist.at(1);
  for (int cars = 1; cars <= 40; ++cars) {
    s.consist = {car};
    s.consist[0].count = cars;
    s.initial.cars_ahead = std::min(cars - 1, 3);
    // Straight and curved track have loops of their own.
    s.track.curves.clear();
    if (cars % 2 == 0) s.track.curves.push_back({-200.0, 400.0, 1.0 / 500.0});
    s.track.grade = 0.005 * (cars % 3 - 1);
    const model::StateVector plain = after(s, "plain", 250);
    const auto p = model::motion(plain.data(), cars);
    for (const std::string& name : model::ExtendedModel::instruction_sets(cars)) {
      if (name == "plain") continue;
      const model::StateVector fast = after(s, name, 250);
      const auto f = model::motion(fast.data(), cars);
      for (Eigen::Index c = 0; c < model::kCoordinates; ++c) {
        const double scale = p.col(c).abs().maxCoeff();
        EXPECT_LE((p.col(c) - f.col(c)).abs().maxCoeff(), 1e-9 * scale) << name << ' ' << cars << " column " << c;
      }
    }
  }
  EXPECT_THROW(model::ExtendedModel(s, "abacus"), std::invalid_argument);
}

}  // namespace
}  // namespace train_derail
