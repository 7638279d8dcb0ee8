// The panel inside RViz on a virtual display, with a real node when a test starts one.
#pragma once

#include <algorithm>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rviz/visualization_frame.h>
#include <QApplication>
#include <QElapsedTimer>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>

#include "child_process.hpp"
#include "node_client.hpp"
#include "train_derail/Inputs.h"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {

inline constexpr double kMph = inputs::kMph;
inline constexpr const char* kNode = "/train_derail";

/// Lets RViz go on until `condition` holds; false after `limit` seconds of wall time.
inline bool wait_in_rviz(const std::function<bool()>& condition, double limit = 150.0) {
  QElapsedTimer elapsed;
  elapsed.start();
  QTimer wake;  // so that the loop turns even if nothing happens
  wake.start(20);
  while (!condition()) {
    if (static_cast<double>(elapsed.elapsed()) > 1000.0 * limit) return false;
    QApplication::processEvents(QEventLoop::WaitForMoreEvents);
  }
  return true;
}

inline void write_config(const std::string& path, const std::string& panel) {
  std::ofstream(path) << "Panels:\n"
                         "  - Class: train_derail/SimulationPanel\n"
                         "    Name: Simulation\n"
                      << panel
                      << "Preferences:\n"
                         "  PromptSaveOnExit: true\n"
                         "Visualization Manager:\n"
                         "  Displays:\n"
                         "    - Class: rviz/Grid\n"
                         "      Name: Grid\n"
                         "  Global Options:\n"
                         "    Fixed Frame: map\n"
                         "Window Geometry:\n"
                         "  Height: 880\n"
                         "  Width: 1500\n";
}

class Panel : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(folder.isValid());
    open_rviz("");
  }
  void TearDown() override { close_panel(); }

  std::string file(const std::string& name) const { return (folder.path() + "/").toStdString() + name; }

  /// RViz can be made but once in a process: a new configuration makes new panels.
  void open_rviz(const std::string& panel) {
    write_config(file("panel.rviz"), panel);
    if (frame == nullptr) {
      frame = new rviz::VisualizationFrame;
      frame->setApp(qApp);
      frame->setSplashPath("");
      frame->initialize(QString::fromStdString(file("panel.rviz")));
      frame->show();
    } else {
      frame->loadDisplayConfigHelper(file("panel.rviz"), true);
    }
    ASSERT_TRUE(wait_in_rviz([&] { return frame->isVisible() && frame->findChild<QLineEdit*>("node") != nullptr; }))
        << "RViz has not loaded the panel";
    ASSERT_TRUE(wait_in_rviz([&] { return !label("presence")->text().isEmpty(); }));
  }
  void close_panel() {
    std::ofstream(file("empty.rviz")) << "Panels: []\nVisualization Manager:\n  Displays: []\n";
    frame->loadDisplayConfigHelper(file("empty.rviz"), true);
    ASSERT_EQ(frame->findChild<QLineEdit*>("node"), nullptr);
  }

  void start_node(const std::string& name = "train_derail") {
    node_process.reset();
    node_process = std::make_unique<ChildProcess>(std::vector<std::string>{TRAIN_DERAIL_NODE, "__name:=" + name});
  }
  /// A node whose inputs are shown.
  void start_node_and_wait() {
    start_node();
    ASSERT_TRUE(wait_in_rviz([&] { return usable() && !edit("input:initial.speed")->text().isEmpty(); })) << presence();
  }

  template <class Widget>
  Widget* find(const char* name) const {
    auto* widget = frame->findChild<Widget*>(name);
    if (widget == nullptr) throw std::runtime_error(std::string("no widget ") + name);
    return widget;
  }
  QLineEdit* edit(const char* name) const { return find<QLineEdit>(name); }
  QPushButton* button(const char* name) const { return find<QPushButton>(name); }
  QLabel* label(const char* name) const { return find<QLabel>(name); }

  bool usable() const { return button("restart")->isEnabled(); }
  std::string presence() const { return label("presence")->text().toStdString(); }
  std::string state() const { return label("state")->text().toStdString(); }
  std::string message() const { return label("message")->text().toStdString(); }
  bool message_is_red() const {
    const QColor color = label("message")->palette().color(QPalette::WindowText);
    return color.red() > 150 && color.green() < 80 && color.blue() < 80;
  }
  bool is_wrong(const char* name) const {
    return edit(name)->palette().color(QPalette::Base) != QApplication::palette().color(QPalette::Base);
  }
  bool differs(const char* name) const {
    for (const QLabel* l : frame->findChildren<QLabel*>()) {
      if (l->buddy() == edit(name)) return l->font().bold();
    }
    return false;
  }

  void type(const char* name, const char* text) const {
    QLineEdit* e = edit(name);
    QTest::mouseClick(e, Qt::LeftButton);
    QTest::keyClick(e, Qt::Key_A, Qt::ControlModifier);
    if (*text == '\0') QTest::keyClick(e, Qt::Key_Delete);
    QTest::keyClicks(e, text);
  }
  void click(const char* name) const {
    ASSERT_TRUE(wait_in_rviz([&] { return button(name)->isEnabled(); })) << name << " stays greyed out";
    QTest::mouseClick(button(name), Qt::LeftButton);
  }
  bool wait_for_state(const std::string& text) const {
    return wait_in_rviz([&] { return state().find(text) != std::string::npos; });
  }
  /// The longest time for which RViz has not served its event loop until `condition` held [s].
  double longest_stall(const std::function<bool()>& condition) const {
    QElapsedTimer since;
    qint64 longest = 0;
    QTimer beat;
    QObject::connect(&beat, &QTimer::timeout, [&] { longest = std::max(longest, since.restart()); });
    since.start();
    beat.start(10);
    EXPECT_TRUE(wait_in_rviz(condition));
    return 0.001 * static_cast<double>(longest);
  }

  QTemporaryDir folder;
  std::unique_ptr<ChildProcess> node_process;
  static inline rviz::VisualizationFrame* frame = nullptr;
  // Served by RViz, which spins the global queue.
  Record<Inputs> inputs{"/train_derail/inputs"};
  Record<CarStates> cars{"/train_derail/cars"};
  Record<RunInfo> run_info{"/train_derail/run_info"};
};

}  // namespace train_derail::test
