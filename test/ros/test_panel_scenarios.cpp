// The panel: scenarios of the package and of files, and sweeps over one input.
#include <cmath>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <yaml-cpp/yaml.h>
#include <QAbstractItemView>
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QComboBox>
#include <QDir>
#include <QFileDialog>
#include <QSpinBox>
#include <QTemporaryDir>
#include <QTest>
#include <QToolButton>

#include "node_client.hpp"
#include "panel_fixture.hpp"
#include "rviz/qt_charts.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {
namespace {

TEST_F(Panel, ScenariosAreChosenFromAListOrAFile) {
  start_node_and_wait();
  find<QCheckBox>("start_paused")->setChecked(true);
  auto* chooser = find<QComboBox>("scenario");
  const auto choose = [&](const QString& part) {
    for (int i = 1; i < chooser->count(); ++i) {
      if (!chooser->itemText(i).contains(part)) continue;
      chooser->showPopup();
      chooser->view()->setCurrentIndex(chooser->model()->index(i, 0));
      QTest::keyClick(chooser->view(), Qt::Key_Return);
      return true;
    }
    return false;
  };
  // One whose base is another file, which the node need not have.
  ASSERT_TRUE(choose("lac_megantic_2013.yaml"));
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_EQ(inputs.last().title, "Lac-Megantic, Quebec, 2013");
  EXPECT_TRUE(wait_in_rviz([&] { return chooser->currentText() == "Lac-Megantic, Quebec, 2013"; }));
  EXPECT_EQ(inputs.last().model, "extended") << "the base's";

  const auto open = [&](const std::string& path) {
    ASSERT_TRUE(choose("Open file"));
    QFileDialog* dialog = nullptr;
    ASSERT_TRUE(wait_in_rviz([&] { return (dialog = frame->findChild<QFileDialog*>("open_scenario")) != nullptr; }));
    Q_EMIT dialog->fileSelected(QString::fromStdString(path));
    dialog->reject();
  };
  std::ofstream(file("broken.yaml")) << "consist:\n  - {count: 5, length: 60 ft, weight: 150 kip}\n"
                                        "initial: {speed: 900 mph, yaw_rate: 0.1}\n";
  open(file("broken.yaml"));
  EXPECT_TRUE(wait_in_rviz([&] { return message_is_red() && label("message")->isVisible(); }));
  for (const char* said : {"broken.yaml:3", "initial.speed", "900 mph", "allowed: [0, 200] m/s"})
    EXPECT_NE(message().find(said), std::string::npos) << message() << " lacks " << said;
  std::ofstream(file("mine.yaml")) << "title: Mine\nconsist:\n  - {count: 5, length: 60 ft, weight: 150 kip}\n"
                                      "initial: {speed: 21 mph, yaw_rate: 0.1}\nstop: {time_max: 2 s}\n";
  open(file("mine.yaml"));
  ASSERT_TRUE(wait_in_rviz([&] { return inputs.last().title == "Mine"; })) << message();
  EXPECT_GE(chooser->findText("mine.yaml"), 1) << "among those chosen lately";

  // The command repeats the run: from the file, with what was changed.
  type("input:initial.speed", "23.456 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return std::abs(inputs.last().speed - 23.456 * kMph) < 1e-9; })) << message();
  ASSERT_TRUE(NodeClient(kNode).step(0, 5.0).time > 1.9);
  Record<Outcome> outcome("/train_derail/outcome");
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  click("copy_command");
  std::string command = QApplication::clipboard()->text().toStdString();
  EXPECT_EQ(command.find("rosrun train_derail derail run '" + file("mine.yaml") + "' --set 'initial.speed=23.456 mph'"),
            0U)
      << command;
  const std::string program = "rosrun train_derail derail", json = file("again.json");
  command.replace(command.find(program), program.size(), TRAIN_DERAIL_CLI);
  command.insert(command.find_last_not_of('\n') + 1, " --quiet --json '" + json + "'");
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const YAML::Node again = YAML::LoadFile(json);
  EXPECT_EQ(again["coupler_buff_peak"].as<double>(), outcome.last().coupler_buff_peak);
  EXPECT_EQ(again["energy_residual"].as<double>(), outcome.last().energy_residual);

  // They are saved with the configuration.
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  const YAML::Node saved = YAML::LoadFile(file("saved.rviz"))["Panels"][0]["Recent Scenarios"];
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_EQ(saved[0].as<std::string>(), file("mine.yaml"));
}

TEST_F(Panel, SweepsOverOneInputAndDrawsWhatCameOut) {
  const QTemporaryDir results;
  ros::param::set("/train_derail/results_folder", results.path().toStdString());
  start_node_and_wait();
  ros::param::del("/train_derail/results_folder");
  find<QToolButton>("section:sweep")->click();
  auto* key = find<QComboBox>("sweep:key");
  EXPECT_EQ(key->currentText(), "initial.speed");
  EXPECT_LT(key->findText("initial.perturbation.seed"), 0);
  EXPECT_LT(key->findText("contact.friction"), 0) << "has no effect here";
  type("sweep:from", "50 kip");
  click("sweep:start");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("50 kip") != std::string::npos && message_is_red(); }))
      << message();
  type("sweep:from", "10");
  type("sweep:to", "20 mph");
  find<QSpinBox>("sweep:points")->setValue(3);
  find<QSpinBox>("sweep:runs")->setValue(4);
  click("sweep:start");
  ASSERT_TRUE(wait_in_rviz([&] { return find<QtCharts::QChartView>("sweep_chart")->isVisible(); }))
      << label("sweep:message")->text().toStdString() << message();
  EXPECT_FALSE(label("message")->isVisible()) << message();
  const QStringList folders = QDir(results.path()).entryList({"panel_sweep_*"}, QDir::Dirs);
  ASSERT_EQ(folders.size(), 1);
  // The line is the median of summary.csv, point by point.
  auto* outcomes = find<QComboBox>("sweep:outcome");
  outcomes->setCurrentIndex(outcomes->findData("coupler_buff_peak"));
  QVector<QPointF> median;
  for (QtCharts::QAbstractSeries* series : find<QtCharts::QChartView>("sweep_chart")->chart()->series()) {
    if (auto* line = qobject_cast<QtCharts::QLineSeries*>(series)) median = line->points().toVector();
  }
  ASSERT_EQ(median.size(), 3);
  EXPECT_NEAR(median[0].x(), 10.0, 1e-9);
  EXPECT_NEAR(median[1].x(), 15.0, 1e-9);
  std::ifstream summary((results.path() + "/" + folders[0] + "/summary.csv").toStdString());
  int seen = 0;
  for (std::string row; std::getline(summary, row);) {
    const QStringList fields = QString::fromStdString(row).split(',');
    if (fields.size() < 13 || fields[2] != "coupler_buff_peak") continue;
    EXPECT_NEAR(median[seen++].y(), fields[10].toDouble() / inputs::kKip, 1e-6);
    EXPECT_EQ(fields[4], "4");
  }
  EXPECT_EQ(seen, 3);
}

}  // namespace
}  // namespace train_derail::test
