// The panel inside RViz on a virtual display, clicked and typed at, with a real node that comes, goes and freezes.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/visualization_manager.h>
#include <yaml-cpp/yaml.h>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QLabel>
#include <QSpinBox>
#include <QTest>
#include <QToolButton>

#include "child_process.hpp"
#include "node_client.hpp"
#include "panel_fixture.hpp"
#include "train_derail/GetInputs.h"
#include "train_derail/Inputs.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/ros/message_fields.hpp"

namespace train_derail::test {
namespace {

TEST_F(Panel, WithoutANodeItIsGreyAndSaysSo) {
  ASSERT_TRUE(wait_in_rviz([&] { return presence() == "No simulation at /train_derail. Waiting for it."; }))
      << presence();
  for (const char* name : {"run", "pause", "step", "restart", "revert"})
    EXPECT_FALSE(button(name)->isEnabled()) << name;
  EXPECT_FALSE(edit("input:initial.speed")->isEnabled());
  EXPECT_TRUE(edit("node")->isEnabled());
}

TEST_F(Panel, ShowsTheInputsOfTheRunWithUnitsRangesAndMeanings) {
  start_node_and_wait();
  EXPECT_FALSE(label("presence")->isVisible());
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_EQ(edit("input:initial.yaw_rate")->text(), "0.2 rad/s");
  EXPECT_EQ(edit("input:consist[0].count")->text(), "12");
  EXPECT_EQ(edit("input:consist[0].weight")->text(), "150 kip");
  EXPECT_EQ(find<QComboBox>("input:ground.on_track_law")->currentText(), "isotropic");
  EXPECT_EQ(find<QComboBox>("input:ground.on_track_law")->count(), 4);
  const QString tip = edit("input:initial.speed")->toolTip();
  for (const char* part : {"initial.speed", "forward along the track", "mph", "Allowed: [0, "}) {
    EXPECT_TRUE(tip.contains(part)) << tip.toStdString() << " lacks " << part;
  }
  EXPECT_TRUE(wait_for_state("Run 1 paused")) << state();
}

TEST_F(Panel, RestartsWithAnotherSpeed) {
  start_node_and_wait();
  type("input:initial.speed", "50 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return differs("input:initial.speed"); }));
  find<QCheckBox>("start_paused")->setChecked(true);
  click("restart");
  ASSERT_TRUE(wait_in_rviz(
      [&] { return !inputs.empty() && inputs.last().run_id == 2 && !cars.empty() && cars.last().run_id == 2; }));
  EXPECT_DOUBLE_EQ(inputs.last().speed, 50 * kMph);
  ASSERT_EQ(cars.last().time, 0.0);
  for (const CarState& car : cars.last().cars) EXPECT_DOUBLE_EQ(car.twist.linear.x, 50 * kMph);
  EXPECT_TRUE(wait_in_rviz([&] {
    return !differs("input:initial.speed") && message() == "restart: run 2 waits, paused";
  })) << message();
  EXPECT_FALSE(message_is_red());
  EXPECT_EQ(edit("input:initial.speed")->text(), "50 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:speed")->text() == "50.0 mph"; }));
}

TEST_F(Panel, RestartsWithAllOfItsInputs) {
  start_node_and_wait();
  type("input:initial.speed", "20");
  type("input:initial.yaw_rate", "-0.1");
  type("input:consist[0].count", "9");
  type("input:consist[0].weight", "100000 lbf");
  type("input:ground.on_track_friction", "0.1");
  type("input:ground.off_track_friction", "0.6");
  type("input:coupler.slack", "2 inch");
  auto* law = find<QComboBox>("input:ground.on_track_law");
  law->setFocus();
  QTest::keyClicks(law, "guided");
  type("input:", "solver.method=bdf; initial.perturbation.seed = 7");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  const Inputs& now = inputs.last();
  EXPECT_DOUBLE_EQ(now.speed, 20 * kMph) << "a bare number is in the unit that is shown";
  EXPECT_EQ(now.yaw_rate, -0.1);
  EXPECT_EQ(now.cars, 9U);
  EXPECT_EQ(now.on_track_friction, 0.1);
  EXPECT_EQ(now.off_track_friction, 0.6);
  EXPECT_NEAR(now.coupler_slack, 0.0508, 1e-12);
  EXPECT_EQ(now.on_track_law, "guided");
  EXPECT_EQ(now.method, "bdf");
  EXPECT_EQ(now.model, "paper");
  EXPECT_EQ(now.seed, 7);
  EXPECT_NE(now.yaml.find("weight: 4448"), std::string::npos) << now.yaml;
  EXPECT_TRUE(wait_for_state("Run 2 running")) << state();
}

TEST_F(Panel, InputsOutOfRangeAreMarkedAndNotSent) {
  start_node_and_wait();
  type("input:initial.speed", "-5 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return is_wrong("input:initial.speed"); }));
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("initial.speed") != std::string::npos; })) << message();
  EXPECT_TRUE(message_is_red());
  EXPECT_NE(message().find("allowed: [0, 200] m/s"), std::string::npos) << message();
  EXPECT_TRUE(edit("input:initial.speed")->toolTip().contains("out of range"));
  click("revert");
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_FALSE(is_wrong("input:initial.speed"));
  EXPECT_FALSE(differs("input:initial.speed"));
  EXPECT_EQ(run_info.last().run_id, 1U);
}

TEST_F(Panel, ARefusedRestartShowsTheServicesWordsInRed) {
  start_node_and_wait();
  const Restart::Response refusal = NodeClient(kNode).restart({"coupler.slack=9 ft", "no.such_key=1"});
  ASSERT_FALSE(refusal.success);
  type("input:", "coupler.slack=9 ft; no.such_key=1");
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message() == refusal.message; }))
      << message() << " instead of " << refusal.message;
  EXPECT_TRUE(message_is_red());
  EXPECT_TRUE(label("message")->isVisible());
  EXPECT_EQ(run_info.last().run_id, 1U);
}

TEST_F(Panel, RunsPausesStepsAndSetsTheRate) {
  start_node_and_wait();
  ASSERT_TRUE(wait_for_state("paused"));
  EXPECT_FALSE(button("pause")->isEnabled());
  find<QSpinBox>("ticks")->setValue(3);
  click("step");
  ASSERT_TRUE(wait_in_rviz([&] { return !cars.empty() && std::abs(cars.last().time - 0.06) < 1e-9; }));
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text() == "0.06 s"; })) << label("time")->text().toStdString();

  auto* rate = find<QComboBox>("rate");
  rate->setFocus();
  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "0.01\r");
  ASSERT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().rate == 0.01; }));
  click("run");
  ASSERT_TRUE(wait_for_state("running"));
  EXPECT_FALSE(button("run")->isEnabled());
  EXPECT_FALSE(button("step")->isEnabled());
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text().contains("rate 0.01"); }))
      << label("time")->text().toStdString();
  click("pause");
  ASSERT_TRUE(wait_for_state("paused"));

  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "-1\r");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("0.001 to 1000") != std::string::npos; })) << message();
  EXPECT_TRUE(message_is_red());
  edit("node")->setFocus();
  EXPECT_TRUE(wait_in_rviz([&] { return rate->currentText() == "0.01"; })) << "what was refused does not stay";
}

TEST_F(Panel, ColoursByPostureOnDemand) {
  auto* posture = find<QToolButton>("colours:posture");
  EXPECT_FALSE(posture->isEnabled());
  start_node_and_wait();
  EXPECT_TRUE(wait_in_rviz([&] { return posture->isEnabled() && !posture->isChecked(); }));
  Record<RunInfo> run_info("/train_derail/run_info");
  for (const char* wanted : {"posture", "cause"}) {
    posture->click();
    EXPECT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().colours == wanted; })) << wanted;
    EXPECT_TRUE(wait_in_rviz([&] { return posture->isChecked() == (run_info.last().colours == "posture"); }));
  }
}

TEST_F(Panel, FollowsARunToItsEnd) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).set_rate(0.0).success);
  click("run");
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  Record<Outcome> outcome("/train_derail/outcome");
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  const Outcome& o = outcome.last();
  const auto text = [&](const char* name) { return label(name)->text().toStdString(); };
  EXPECT_TRUE(wait_in_rviz([&] {
    return text("outcome:coupler_buff_peak") ==
           QString("%1 kip").arg(o.coupler_buff_peak / inputs::kKip, 0, 'f', 0).toStdString();
  })) << text("outcome:coupler_buff_peak");
  const std::string coupler = std::to_string(o.coupler_buff_peak_coupler);
  EXPECT_EQ(text("outcome_note:coupler_buff_peak").rfind("coupler " + coupler + "-", 0), 0U)
      << text("outcome_note:coupler_buff_peak");
  EXPECT_EQ(text("outcome:cars"), "12");
  auto* all = find<QToolButton>("all_outcomes");
  if (all->text() == "show all") all->click();
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:cars")->isVisible(); }));
  const auto known = ros_face::read<outcome::Outcome>(o, outcome::outcome_fields());
  for (const auto& field : outcome::outcome_fields()) {
    if (!field.headline) continue;
    const std::string name = "outcome:" + std::string(field.name);
    const bool shown = !field.when || field.when(known);
    EXPECT_EQ(label(name.c_str())->isVisible(), shown) << name;
    if (!shown) continue;
    const outcome::FieldRow row = outcome::row_of(field, known);
    EXPECT_EQ(text(name.c_str()), row.shown.empty() ? row.si : row.shown) << name;
  }
  EXPECT_EQ(text("outcome:cars_past_pod"), std::to_string(o.cars_past_pod));
  EXPECT_EQ(text("outcome:cars_off_track"), std::to_string(o.cars_off_track));
  EXPECT_EQ(text("outcome:energy_residual"), QString::number(o.energy_residual, 'e', 1).toStdString());
  EXPECT_TRUE(button("restart")->isEnabled());
}

TEST_F(Panel, GreysOutWhenTheNodeIsKilledAndRecoversByItself) {
  start_node_and_wait();
  type("input:initial.speed", "44 mph");
  click("restart");
  ASSERT_TRUE(wait_for_state("Run 2"));
  node_process->kill_now();
  ASSERT_TRUE(wait_in_rviz([&] { return !usable(); }));
  EXPECT_NE(presence().find("No simulation"), std::string::npos) << presence();
  start_node();
  ASSERT_TRUE(wait_in_rviz([&] { return usable() && state() == "Run 1 paused"; })) << presence() << ", " << state();
  type("input:initial.speed", "55 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && std::abs(inputs.last().speed - 55 * kMph) < 1e-9; }));
}

TEST_F(Panel, ANodeThatAnswersNothingDoesNotStopRviz) {
  start_node_and_wait();
  node_process->send(SIGSTOP);
  click("restart");
  const auto begin = std::chrono::steady_clock::now();
  const auto frames = frame->getManager()->getFrameCount();
  EXPECT_LT(longest_stall([&] { return std::chrono::steady_clock::now() - begin > std::chrono::seconds(3); }), 1.0);
  EXPECT_GT(frame->getManager()->getFrameCount(), frames + 10) << "RViz goes on drawing";
  EXPECT_FALSE(button("restart")->isEnabled()) << "still under way";
  node_process->send(SIGCONT);
  EXPECT_TRUE(wait_for_state("Run 2")) << state();

  // Nor does it keep the window from closing.
  node_process->send(SIGSTOP);
  click("restart");
  const auto close_begin = std::chrono::steady_clock::now();
  close_panel();
  EXPECT_LT(std::chrono::steady_clock::now() - close_begin, std::chrono::seconds(15));
}

TEST_F(Panel, LooksToAnotherNodeAndRefusesWhatIsNoName) {
  start_node_and_wait();
  type("node", "/no where");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return presence().find("Not a node's name") == 0; })) << presence();
  EXPECT_FALSE(usable());
  type("node", "/elsewhere");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return presence() == "No simulation at /elsewhere. Waiting for it."; })) << presence();
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return usable(); })) << presence();
}

TEST_F(Panel, IsSavedAndLoadedWithTheConfiguration) {
  start_node_and_wait();
  // RViz counts no changes in the first second after loading.
  ASSERT_TRUE(wait_in_rviz([&] {
    find<QCheckBox>("start_paused")->click();
    return frame->isWindowModified();
  }));
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  ASSERT_FALSE(frame->isWindowModified());
  EXPECT_TRUE(NodeClient(kNode).restart({"initial.speed=30 mph"}).success);
  EXPECT_TRUE(wait_in_rviz([&] { return edit("input:initial.speed")->text() == "30 mph"; }));
  EXPECT_FALSE(frame->isWindowModified()) << "what the node does is nothing to save";
  type("input:initial.speed", "61 mph");
  type("input:", "solver.rtol=1.0e-6");
  find<QSpinBox>("ticks")->setValue(25);
  find<QCheckBox>("start_paused")->setChecked(true);
  EXPECT_TRUE(frame->isWindowModified());
  type("node", "/elsewhere");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  close_panel();

  const YAML::Node panel = YAML::LoadFile(file("saved.rviz"))["Panels"][0];
  EXPECT_EQ(panel["Class"].as<std::string>(), "train_derail/SimulationPanel");
  EXPECT_EQ(panel["Node"].as<std::string>(), "/elsewhere");
  EXPECT_EQ(panel["Inputs"]["initial.speed"].as<std::string>(), "61 mph");

  open_rviz("    Node: /elsewhere\n");
  frame->loadDisplayConfigHelper(file("saved.rviz"), true);
  ASSERT_TRUE(
      wait_in_rviz([&] { return edit("node")->text() == "/elsewhere" && find<QSpinBox>("ticks")->value() == 25; }));
  EXPECT_TRUE(find<QCheckBox>("start_paused")->isChecked());
  EXPECT_EQ(edit("input:")->text(), "solver.rtol=1.0e-6");
  EXPECT_EQ(edit("input:initial.speed")->text(), "61 mph");
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return usable() && differs("input:initial.speed"); }));
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 3; }));
  EXPECT_DOUBLE_EQ(inputs.last().speed, 61 * kMph);
  EXPECT_EQ(inputs.last().rtol, 1.0e-6);
}

TEST_F(Panel, ShowsAReplayAndSaysThatItIsOne) {
  const std::string bag = file("run.bag"), scenario = file("scenario.yaml");
  std::ofstream(scenario) << "title: from a bag\nconsist:\n  - {count: 12, length: 61.1 ft, weight: 150 kip}\n"
                             "initial: {speed: 37 mph, yaw_rate: 0.2}\nstop: {time_max: 3 s}\n";
  ASSERT_EQ(std::system((TRAIN_DERAIL_CLI " run --quiet --bag '" + bag + "' '" + scenario + "'").c_str()), 0);
  Record<Outcome> outcome("/train_derail/outcome");
  auto player = std::make_unique<ChildProcess>(std::vector<std::string>{
      "/usr/lib/rosbag/play", "--clock", "--hz=200", "--rate=4", "--keep-alive", bag, "__name:=player"});
  ASSERT_TRUE(wait_in_rviz([&] { return presence().find("A replay: /player plays the topics of /train_derail") == 0; }))
      << presence();
  EXPECT_EQ(presence().find("time jumps"), std::string::npos) << presence();
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  const auto text = [&](const char* name) { return label(name)->text().toStdString(); };
  EXPECT_TRUE(wait_in_rviz([&] {
    return text("outcome_note:coupler_buff_peak")
               .rfind("coupler " + std::to_string(outcome.last().coupler_buff_peak_coupler) + "-", 0) == 0;
  })) << text("outcome_note:coupler_buff_peak");
  EXPECT_TRUE(label("outcome:coupler_buff_peak")->isEnabled());
  EXPECT_EQ(text("time"), "3.00 s");
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  for (const char* name : {"run", "pause", "step", "restart", "revert"})
    EXPECT_FALSE(button(name)->isEnabled()) << name;
  EXPECT_FALSE(find<QComboBox>("rate")->isEnabled());
  EXPECT_FALSE(edit("input:initial.speed")->isEnabled());

  // A simulator beside it: time jumps.
  start_node();
  EXPECT_TRUE(wait_in_rviz([&] {
    return presence().find("Time jumps: /clock is published by /player and /train_derail") != std::string::npos;
  })) << presence();
  player.reset();
  EXPECT_TRUE(wait_in_rviz([&] { return !label("presence")->isVisible() && usable() && state() == "Run 1 paused"; }))
      << presence();
  EXPECT_TRUE(edit("input:initial.speed")->isEnabled());
}

TEST_F(Panel, NamesTheBlockThatItsInputsBelongTo) {
  start_node_and_wait();
  const auto label_of = [&](const char* name) {
    for (const QLabel* l : frame->findChildren<QLabel*>()) {
      if (l->buddy() == edit(name)) return l->text().toStdString();
    }
    return std::string();
  };
  EXPECT_EQ(label_of("input:consist[0].weight"), "Car &weight") << "there is one block only";
  ASSERT_TRUE(NodeClient(kNode)
                  .restart({}, true,
                           "consist:\n  - {name: locomotive, count: 2, length: 70 ft, weight: 420 kip}\n"
                           "  - {name: tank_car, count: 9, length: 55 ft, weight: 286 kip}\n"
                           "initial: {speed: 30 mph, yaw_rate: 0}\n")
                  .success);
  EXPECT_TRUE(wait_in_rviz([&] { return label_of("input:consist[0].weight") == "Car &weight,\nlocomotive 1\u20132"; }))
      << label_of("input:consist[0].weight");
}

TEST_F(Panel, OffersOnlyInputsThatAct) {
  start_node_and_wait();
  EXPECT_TRUE(edit("input:ground.on_track_friction")->isVisible());
  // With air brakes the friction on the track acts on nothing.
  std::ifstream file(TRAIN_DERAIL_SOURCE_DIR "/config/accident.yaml");
  const std::string accident((std::istreambuf_iterator<char>(file)), {});
  ASSERT_TRUE(NodeClient(kNode).restart({}, true, accident).success);
  EXPECT_TRUE(wait_in_rviz([&] { return !edit("input:ground.on_track_friction")->isVisible(); }));
  EXPECT_TRUE(edit("input:initial.speed")->isVisible());
}

TEST_F(Panel, SaysWhyInputsCannotBeShownAndSendsNoneWithoutAUnit) {
  ros::NodeHandle handle;
  int restarts = 0;
  const boost::function<bool(GetInputs::Request&, GetInputs::Response&)> answer =
      [](GetInputs::Request&, GetInputs::Response&) { return true; };
  const boost::function<bool(Restart::Request&, Restart::Response&)> count =
      [&](Restart::Request&, Restart::Response&) { return ++restarts > 0; };
  const ros::ServiceServer get_inputs = handle.advertiseService("/fake/get_inputs", answer);
  const ros::ServiceServer restart = handle.advertiseService("/fake/restart", count);
  const auto inputs_topic = handle.advertise<Inputs>("/fake/inputs", 1, true);
  const auto info_topic = handle.advertise<RunInfo>("/fake/run_info", 1, true);
  Inputs wrong;
  wrong.yaml = "of: another version";
  inputs_topic.publish(wrong);
  info_topic.publish(RunInfo());
  type("node", "/fake");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return message().find("The inputs of this run cannot be shown: ") == 0; }))
      << message();
  EXPECT_NE(message().find("consist: missing"), std::string::npos) << message();
  EXPECT_TRUE(message_is_red());
  EXPECT_TRUE(label("message")->isVisible());
  type("input:initial.speed", "12");
  label("message")->clear();
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("The inputs of this run cannot be shown: ") == 0; }))
      << message();
  EXPECT_EQ(restarts, 0);
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
}

TEST_F(Panel, ARunThatHasEndedCanBeRunAgainWithTheInputsOfTheForm) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).set_rate(0.0).success);
  EXPECT_EQ(button("run")->text(), "&Run");
  click("run");
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  ASSERT_TRUE(wait_in_rviz([&] { return button("run")->text() == "&Run again"; }));
  for (const char* name : {"pause", "step"}) {
    EXPECT_FALSE(button(name)->isEnabled());
    EXPECT_TRUE(button(name)->toolTip().contains("The run has ended")) << button(name)->toolTip().toStdString();
  }
  ASSERT_TRUE(wait_in_rviz([&] { return label("outcome:coupler_buff_peak")->text().contains("kip"); }));
  const std::string first = label("outcome:coupler_buff_peak")->text().toStdString();
  type("input:initial.speed", "25 mph");
  click("run");
  ASSERT_TRUE(wait_for_state("Run 2 ended")) << state() << message();
  EXPECT_TRUE(wait_in_rviz([&] { return std::abs(inputs.last().speed - 25 * kMph) < 1e-12; })) << inputs.last().speed;
  // Beside what it has yielded stands what the first had.
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:this_run")->text() == "Run 2"; }));
  EXPECT_EQ(label("outcome:run_before")->text(), "Run 1, 37 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome_before:coupler_buff_peak")->text().toStdString() == first; }))
      << label("outcome_before:coupler_buff_peak")->text().toStdString() << " instead of " << first;
  EXPECT_TRUE(label("outcome_before:coupler_buff_peak")->isVisible());
  EXPECT_NE(label("outcome:coupler_buff_peak")->text().toStdString(), first);
  EXPECT_TRUE(label("outcome:run_before")->toolTip().contains("initial.speed: 25 mph, before 37 mph"));
}

TEST_F(Panel, SaysThatTheRunBeforeWasCutOff) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).step(60, 0.0).success);
  ASSERT_TRUE(wait_in_rviz([&] { return label("outcome:coupler_buff_peak")->text().contains("kip"); }));
  type("input:initial.speed", "25 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return label("outcome:this_run")->text() == "Run 2"; }));
  EXPECT_EQ(label("outcome:run_before")->text(), "Run 1, cut at 1.2 s, 37 mph");
  EXPECT_TRUE(label("outcome:run_before")->toolTip().contains("cut off"));
}

TEST_F(Panel, EnterInAFieldStartsTheRun) {
  start_node_and_wait();
  find<QCheckBox>("start_paused")->setChecked(true);
  type("input:initial.speed", "48");
  QTest::keyClick(edit("input:initial.speed"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_DOUBLE_EQ(inputs.last().speed, 48 * kMph);
}

TEST_F(Panel, RedMessagesGoWithTheirCause) {
  start_node_and_wait();
  type("input:initial.speed", "-5 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return message_is_red() && label("message")->isVisible(); }));
  type("input:initial.speed", "38 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return !label("message")->isVisible(); })) << message();
  type("input:", "coupler.slack=9 ft");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return message().find("coupler.slack") != std::string::npos; }));
  click("revert");
  EXPECT_TRUE(wait_in_rviz([&] { return !label("message")->isVisible(); })) << message();
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const train_derail::test::VirtualDisplay display;
  if (display.name().empty()) {
    std::fputs("no virtual display: Xvfb is missing\n", stderr);
    return 2;
  }
  ros::init(argc, argv, "test_panel", ros::init_options::NoSigintHandler);
  const ros::NodeHandle keep_alive;
  QApplication app(argc, argv);
  return RUN_ALL_TESTS();
}
