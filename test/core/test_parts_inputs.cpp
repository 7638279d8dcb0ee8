// What is refused of the parts beyond the paper: each message names key, value, what is wrong and what is allowed.
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail {
namespace {

using inputs::Scenario;

std::string refusal(const Scenario& s) {
  try {
    inputs::validate(s);
  } catch (const inputs::InputError& e) {
    return e.what();
  }
  return "no error";
}

std::string refusal(const std::function<void(Scenario&)>& change, Scenario s = test::accident(10)) {
  change(s);
  return refusal(s);
}

TEST(Parts, TheExampleIsValid) { EXPECT_EQ(refusal(test::accident(10)), "no error"); }

struct Part {
  std::string name;
  std::function<void(Scenario&)> on;
};

const std::vector<Part> kParts{
    {"ground.on_track_law: rails", [](Scenario& s) { s.ground.on_track_law = inputs::OnTrackLaw::rails; }},
    {"ground.off_track_law: by_slip", [](Scenario& s) { s.ground.off_track_law = inputs::OffTrackLaw::by_slip; }},
    {"ground.patches: 1 patches",
     [](Scenario& s) {
       s.ground.patches = {{0.0, 1.0, 0.0, 1.0, 2.0}};
     }},
    {"ground.load_exponent: 0.6", [](Scenario& s) { s.ground.load_exponent = 0.6; }},
    {"contact.law: elastic", [](Scenario& s) { s.contact.law = inputs::ContactLaw::elastic; }},
    {"coupler.draft_gear_travel: 0.1", [](Scenario& s) { s.coupler.draft_gear_travel = 0.1; }},
    {"coupler.damping_ratio: 0.1", [](Scenario& s) { s.coupler.damping_ratio = 0.1; }},
    {"coupler.break_draft: 1000000", [](Scenario& s) { s.coupler.break_draft = 1e6; }},
    {"coupler.break_swing: 0.8", [](Scenario& s) { s.coupler.break_swing = 0.8; }},
    {"coupler.break_moment: 1000000", [](Scenario& s) { s.coupler.break_moment = 1e6; }}};

TEST(Parts, NeedTheSteppedMethod) {
  for (const Part& part : kParts) {
    for (const auto& [name, method] :
         {std::pair{"dormand_prince", inputs::Method::dormand_prince},
          std::pair{"cash_karp", inputs::Method::cash_karp}, std::pair{"bdf", inputs::Method::bdf}}) {
      Scenario s = test::baseline();
      s.solver.method = method;
      part.on(s);
      EXPECT_EQ(refusal(s), std::string("scenario: solver.method = '") + name + "': " + part.name +
                                " cannot be computed by this method; allowed: semi_implicit");
    }
    Scenario s = test::baseline();
    s.solver.method = inputs::Method::semi_implicit;
    s.solver.fixed_step = 1e-3;
    part.on(s);
    EXPECT_EQ(refusal(s), "no error") << part.name;
    EXPECT_EQ(inputs::model_of(s), inputs::Model::extended) << part.name;
    s.model = inputs::Model::paper;
    EXPECT_EQ(refusal(s),
              "scenario: model = 'paper': this model has no " + part.name + "; allowed: extended, or leave it out");
  }
}

TEST(Parts, NoMethodChoosesTheModel) {
  Scenario s = test::baseline();
  EXPECT_EQ(inputs::model_of(s), inputs::Model::paper);
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 1e-3;
  EXPECT_EQ(refusal(s), "no error");
  EXPECT_EQ(inputs::model_of(s), inputs::Model::paper);
  s.model = inputs::Model::extended;
  EXPECT_EQ(refusal(s), "no error");
  EXPECT_EQ(inputs::model_of(s), inputs::Model::extended);
  s.solver.method = inputs::Method::bdf;
  s.solver.fixed_step.reset();
  EXPECT_EQ(refusal(s),
            "scenario: solver.method = 'bdf': model: extended cannot be computed by this method; "
            "allowed: semi_implicit");
}

TEST(Parts, SteppedMethodNeedsItsStep) {
  EXPECT_EQ(refusal([](Scenario& s) { s.solver.fixed_step.reset(); }),
            "scenario: solver.fixed_step: missing: semi_implicit needs a fixed step; allowed: (0, 1] s");
  EXPECT_EQ(refusal([](Scenario& s) { s.solver.fixed_step = 0.0; }),
            "scenario: solver.fixed_step = '0': out of range; allowed: [1e-08, 1] s");
}

TEST(Parts, OnlyThePaperHasGuidedCars) {
  Scenario s = test::baseline();
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 1e-3;
  s.ground.on_track_law = inputs::OnTrackLaw::guided;
  EXPECT_EQ(refusal(s), "no error");
  s.model = inputs::Model::extended;
  EXPECT_EQ(refusal(s),
            "scenario: ground.on_track_law = 'guided': cannot be computed by the extended model; "
            "allowed: rails, isotropic, along_track");
}

TEST(Parts, SomeNeedRails) {
  Scenario s = test::baseline();
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 1e-3;
  const std::string why = ": works only with ground.on_track_law: rails; allowed: that law, or leave this key out";
  EXPECT_EQ(refusal([](Scenario& c) { c.brakes.law = inputs::BrakeLaw::air; }, s),
            "scenario: brakes.law = 'air'" + why);
  EXPECT_EQ(refusal([](Scenario& c) { c.track.grade = 0.01; }, s), "scenario: track.grade = '0.01'" + why);
  EXPECT_EQ(refusal(
                [](Scenario& c) {
                  c.track.curves = {{0.0, 1.0, 0.001}};
                },
                s),
            "scenario: track.curves = '1 curves'" + why);
  EXPECT_EQ(refusal([](Scenario& c) { c.initial.cars_ahead = 3; }, s), "scenario: initial.cars_ahead = '3'" + why);
  EXPECT_EQ(refusal([](Scenario& c) { c.initial.perturbation.kick = 0.5; }, s),
            "scenario: initial.perturbation.kick = '0.5'" + why);
  EXPECT_EQ(refusal([](Scenario& c) { c.initial.perturbation.alignment = 0.5; }, s),
            "scenario: initial.perturbation.alignment = '0.5'" + why);
}

TEST(Parts, ACarHasToBeLeftToDerail) {
  EXPECT_EQ(refusal([](Scenario& s) { s.initial.cars_ahead = 9; }), "no error");
  EXPECT_EQ(refusal([](Scenario& s) { s.initial.cars_ahead = 10; }),
            "scenario: initial.cars_ahead = '10': leaves no car to derail; allowed: 0 to 9");
  EXPECT_EQ(refusal([](Scenario& s) { s.initial.cars_ahead = -1; }),
            "scenario: initial.cars_ahead = '-1': out of range; allowed: [0, 999]");
}

TEST(Parts, BodiesStandUprightWithTheirCentreBelowTheTop) {
  const auto of_block = [](const std::optional<double>& floor, const std::optional<double>& roof,
                           const std::optional<double>& centre) {
    return refusal([&](Scenario& s) {
      s.consist[0].name = "hopper";  // floor 1.1 m, roof 4.2 m, loaded to 263 kip: centre 2.34 m
      s.consist[0].weight = 263.0 * inputs::kKip;
      s.consist[0].floor_height = floor;
      s.consist[0].roof_height = roof;
      s.consist[0].centre_height = centre;
    });
  };
  EXPECT_EQ(of_block(1.0, 3.0, 1.5), "no error");
  EXPECT_EQ(of_block({}, 3.0, {}), "no error");
  EXPECT_EQ(of_block(2.5, 2.5, 1.5),
            "scenario: consist[0].roof_height = '2.5': not above floor_height = 2.5 m; allowed: > 2.5 m");
  EXPECT_EQ(of_block({}, 1.0, 0.8),
            "scenario: consist[0].roof_height = '1': not above floor_height = 1.1 m, which goes with the name of the "
            "block; allowed: > 1.1 m");
  EXPECT_EQ(of_block(4.0, 3.0, {}),
            "scenario: consist[0].roof_height = '3': not above floor_height = 4 m; allowed: > 4 m");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.consist[0].name = "flat";
              s.consist[0].floor_height = 3.7;
            }),
            "scenario: consist[0].floor_height = '3.7': not below roof_height = 3.6 m, which goes with the name of the "
            "block; allowed: < 3.6 m");
  const auto underframe = [](const std::optional<double>& height, const std::optional<double>& width) {
    return refusal([&](Scenario& s) {
      s.consist[0].underframe_height = height;
      s.consist[0].underframe_width = width;
    });
  };
  EXPECT_EQ(underframe(1.1, 3.048), "no error");
  EXPECT_EQ(
      underframe(1.2, {}),
      "scenario: consist[0].underframe_height = '1.2': above floor_height = 1.1 m, which goes with the name of the "
      "block; allowed: <= 1.1 m");
  EXPECT_EQ(underframe({}, 4.0),
            "scenario: consist[0].underframe_width = '4': wider than width = 3.048 m; allowed: <= 3.048 m");
  const auto truck = [](const std::optional<double>& truck_weight, double car) {
    return refusal([&](Scenario& s) {
      s.model = inputs::Model::spatial;
      s.consist[0].weight = car;
      s.consist[0].truck_weight = truck_weight;
    });
  };
  EXPECT_EQ(truck(0.0, 1e4), "no error");
  EXPECT_EQ(truck(4e5, 1e6), "no error");
  EXPECT_EQ(truck(4.01e5, 1e6),
            "scenario: consist[0].truck_weight = '401000': two of them are more than 0.8 of weight = 1e+06 N; allowed: "
            "<= 400000 N");
  EXPECT_EQ(
      truck({}, 1e5),
      "scenario: consist[0].truck_weight = '42258.1': two of them are more than 0.8 of weight = 100000 N; it goes "
      "with the name of the block; allowed: <= 40000 N");
  EXPECT_EQ(of_block(1.0, 3.0, 3.0),
            "scenario: consist[0].centre_height = '3': not below roof_height = 3 m; allowed: < 3 m");
  EXPECT_EQ(of_block({}, 2.0, {}),
            "scenario: consist[0].roof_height = '2': not above centre_height = 2.34 m, which goes with the name and "
            "weight of the block; allowed: > 2.34 m, or give centre_height too");
}

TEST(Parts, GradesFollowEachOther) {
  EXPECT_EQ(refusal([](Scenario& s) { s.track.grades = {{-100.0, 50.0, 0.01}, {-50.0, 50.0, -0.01}}; }), "no error");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.track.grades = {{-100.0, 50.0, 0.01}, {-51.0, 50.0, -0.01}};
            }),
            "scenario: track.grades[1].start = '-51': the grade begins before the end of the previous grade; allowed: "
            ">= -50 m");
  EXPECT_EQ(refusal([](Scenario& s) {
              for (int i = 0; i < 1001; ++i) s.track.grades.push_back({10.0 * i, 5.0, 0.01});
            }),
            "scenario: track.grades = '1001 items': too many; allowed: at most 1000");
}

TEST(Parts, CurvesFollowEachOther) {
  EXPECT_EQ(refusal([](Scenario& s) { s.track.curves = {{-100.0, 50.0, 0.001}, {-50.0, 50.0, -0.001}}; }), "no error");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.track.curves = {{-100.0, 50.0, 0.001}, {-51.0, 50.0, -0.001}};
            }),
            "scenario: track.curves[1].start = '-51': the curve begins before the end of the previous curve; allowed: "
            ">= -50 m");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.track.curves = {{-100.0, 0.0, 0.001}};
            }),
            "scenario: track.curves[0].length = '0': out of range; allowed: [0.01, 100000] m");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.track.curves = {{-100.0, 50.0, 0.03}};
            }),
            "scenario: track.curves[0].curvature = '0.03': out of range; allowed: [-0.02, 0.02] 1/m");
}

TEST(Parts, PatchesAreNotEmpty) {
  EXPECT_EQ(refusal([](Scenario& s) {
              s.ground.patches = {{5.0, 5.0, 0.0, 1.0, 2.0}};
            }),
            "scenario: ground.patches[0].x_to = '5': not greater than x_from; allowed: > 5 m");
  EXPECT_EQ(refusal([](Scenario& s) {
              s.ground.patches = {{0.0, 5.0, 0.0, 1.0, 2.0}, {0.0, 5.0, 2.0, 1.0, 2.0}};
            }),
            "scenario: ground.patches[1].y_to = '1': not greater than y_from; allowed: > 2 m");
}

struct Number {
  std::string key;
  std::function<void(Scenario&, double)> set;
  double too_small;  // or too large; NaN if any finite number is allowed
  bool infinite = false;
};

#define NUMBER(key, ...)                                         \
  Number {                                                       \
#key, [](Scenario & s, double v) { s.key = v; }, __VA_ARGS__ \
  }

TEST(Parts, EveryNumberIsFiniteAndInItsRange) {
  const double any = std::nan("");
  const std::vector<Number> numbers{NUMBER(consist[0].brake_share, -0.1),
                                    NUMBER(coupler.draft_gear_stiffness, 0.0),
                                    NUMBER(coupler.draft_gear_travel, -0.1),
                                    NUMBER(coupler.damping_ratio, 2.1),
                                    NUMBER(coupler.break_draft, 0.0, true),
                                    NUMBER(coupler.break_swing, 0.0, true),
                                    NUMBER(coupler.break_moment, 0.0, true),
                                    NUMBER(ground.in_line_friction, -0.1),
                                    NUMBER(ground.broadside_friction, -0.1),
                                    NUMBER(ground.slip_ratio, 0.0),
                                    NUMBER(ground.far_distance, 0.0),
                                    NUMBER(ground.patches[0].x_from, any),
                                    NUMBER(ground.patches[0].x_to, any),
                                    NUMBER(ground.patches[0].y_from, any),
                                    NUMBER(ground.patches[0].y_to, any),
                                    NUMBER(ground.patches[0].factor, -0.1),
                                    NUMBER(rails.stiffness, 0.0),
                                    NUMBER(rails.damping_ratio, -0.1),
                                    NUMBER(rails.derail_ratio, -0.1, true),
                                    NUMBER(rails.derail_time, -0.1),
                                    NUMBER(rails.torn_length, -0.1),
                                    NUMBER(rails.rolling_share, -0.1),
                                    NUMBER(rails.load_exponent, -0.1),
                                    NUMBER(rails.reference_weight, 0.0),
                                    NUMBER(traction.adhesion, -0.1),
                                    NUMBER(obstacles.speed_exponent, any),
                                    NUMBER(obstacles.reference_speed, 0.0),
                                    NUMBER(initial.persistence, -0.1),
                                    NUMBER(track.heading, -0.1),
                                    NUMBER(track.grade, 0.2),
                                    NUMBER(track.curves[0].start, any),
                                    NUMBER(track.curves[0].length, 0.0),
                                    NUMBER(track.curves[0].curvature, -0.03),
                                    NUMBER(track.curves[0].superelevation, -0.1),
                                    NUMBER(track.grades[0].start, any),
                                    NUMBER(track.grades[0].length, 0.0),
                                    NUMBER(track.grades[0].grade, 0.2),
                                    NUMBER(ground.rest_speed, 2.0),
                                    NUMBER(terrain.rest_speed, 2.0),
                                    NUMBER(brakes.rolling_resistance, -0.1),
                                    NUMBER(brakes.force, -0.1),
                                    NUMBER(brakes.build_up_time, -0.1),
                                    NUMBER(brakes.dead_time, -0.1),
                                    NUMBER(brakes.propagation_speed, 0.0, true),
                                    NUMBER(brakes.radio_delay, -0.1),
                                    NUMBER(brakes.emergency_time, any),
                                    NUMBER(brakes.emergency_speed_exponent, any),
                                    NUMBER(brakes.reference_speed, 0.0),
                                    NUMBER(contact.stiffness, 0.0),
                                    NUMBER(contact.restitution, 1.1),
                                    NUMBER(contact.friction, -0.1),
                                    NUMBER(contact.crush_force, 0.0, true),
                                    NUMBER(contact.side_crush_force, 0.0, true),
                                    NUMBER(initial.perturbation.kick, -0.1),
                                    NUMBER(initial.perturbation.alignment, -0.1)};
  Scenario valid = test::accident(10);
  valid.ground.patches = {{0.0, 5.0, 0.0, 1.0, 2.0}};
  valid.track.curves = {{-100.0, 50.0, 0.001}};
  valid.track.grades = {{-100.0, 50.0, 0.01}};
  ASSERT_EQ(refusal(valid), "no error");
  const auto begins = [](const std::string& text, const std::string& with) {
    return text.compare(0, with.size(), with) == 0;
  };
  for (const Number& n : numbers) {
    const auto with = [&](double v) { return refusal([&](Scenario& s) { n.set(s, v); }, valid); };
    const std::string key = "scenario: " + n.key;
    EXPECT_TRUE(begins(with(std::nan("")), key + " = 'nan': not a finite number; allowed: ")) << with(std::nan(""));
    EXPECT_TRUE(begins(with(-inputs::kInfinity), key + " = '-inf': not a finite number; allowed: "))
        << with(-inputs::kInfinity);
    const std::string infinite = with(inputs::kInfinity);
    EXPECT_TRUE(n.infinite ? infinite == "no error"
                           : begins(infinite, key + " = 'inf': not a finite number; allowed: "))
        << infinite;
    if (std::isnan(n.too_small)) continue;
    EXPECT_TRUE(begins(with(n.too_small), key + " = '")) << n.key << ": " << with(n.too_small);
  }
}

// Everything new is written and read back.
TEST(Parts, SurviveWritingAndReading) {
  Scenario s = test::accident(10);
  s.consist[0].brake_share = 0.7;
  s.consist[0].brake_source = inputs::BrakeSource::remote;
  s.ground.patches = {{1.0, 2.0, 3.0, 4.0, 0.5}, {5.0, 6.0, 7.0, 8.0, 1.5}};
  s.track.heading = 200.0 * inputs::kDegree;
  s.track.grade = -0.012;
  s.track.curves = {{-300.0, 100.0, 0.002}, {10.0, 20.0, -0.003, 0.05}};
  s.track.grades = {{-300.0, 100.0, 0.01}, {10.0, 20.0, -0.02}};
  s.brakes.signal = inputs::BrakeSignal::electronic;
  s.brakes.emergency_time = -1.0 / 3.0;
  s.initial.cars_ahead = 4;
  s.contact.crush_force = 5e6;
  const std::string once = inputs::to_yaml(s);
  const Scenario again = inputs::read_scenario(YAML::Load(once), "again");
  EXPECT_EQ(inputs::to_yaml(again), once);
  EXPECT_EQ(again.consist[0].brake_source, inputs::BrakeSource::remote);
  EXPECT_EQ(again.ground.patches.at(1).factor, 1.5);
  EXPECT_EQ(again.track.heading, s.track.heading);
  EXPECT_EQ(again.track.curves.at(1).curvature, -0.003);
  EXPECT_EQ(again.track.curves.at(1).superelevation, 0.05);
  EXPECT_EQ(again.track.grades.at(1).grade, -0.02);
  EXPECT_EQ(again.brakes.emergency_time, s.brakes.emergency_time);
  EXPECT_EQ(again.brakes.signal, inputs::BrakeSignal::electronic);
  EXPECT_EQ(again.initial.cars_ahead, 4);
  EXPECT_EQ(again.initial.perturbation.kick, s.initial.perturbation.kick);
  EXPECT_EQ(again.coupler.break_moment, inputs::kInfinity);
  EXPECT_EQ(again.solver.method, inputs::Method::semi_implicit);
}

}  // namespace
}  // namespace train_derail
