// The panel in windows of any size, and in any locale.
#include <clocale>
#include <cstdlib>

#include <gtest/gtest.h>
#include <QComboBox>
#include <QLineEdit>
#include <QScreen>
#include <QScrollArea>
#include <QScrollBar>
#include <QTest>
#include <QToolButton>
#include <QWindow>

#include "node_client.hpp"
#include "panel_fixture.hpp"
#include "rviz/qt_charts.hpp"

namespace train_derail::test {
namespace {

TEST_F(Panel, FitsALowWindowAndUsesATallOne) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).step(100, 0.0).success);
  frame->resize(1366, 768);
  auto* scroll = frame->findChild<QLineEdit*>("node")->parentWidget();
  while (qobject_cast<QScrollArea*>(scroll) == nullptr) scroll = scroll->parentWidget();
  auto* bar = static_cast<QScrollArea*>(scroll)->verticalScrollBar();
  EXPECT_TRUE(wait_in_rviz([&] { return frame->height() == 768 && bar->maximum() == 0; })) << bar->maximum();
  EXPECT_FALSE(find<QToolButton>("section:charts")->isChecked());
  frame->resize(1366, 1400);
  EXPECT_TRUE(wait_in_rviz([&] { return find<QToolButton>("section:charts")->isChecked(); }));
  EXPECT_TRUE(wait_in_rviz(
      [&] { return label("outcome:groups")->isVisible() || label("outcome:cars_past_pod")->isVisible(); }));
  EXPECT_EQ(bar->maximum(), 0);
  find<QToolButton>("section:charts")->click();
  EXPECT_TRUE(wait_in_rviz([&] { return !find<QtCharts::QChartView>("chart:time")->isVisible(); }))
      << "the user's word";
  frame->resize(1500, 880);
}

TEST_F(Panel, FitsTheWindowToTheScreenIfTheConfigurationSaysSo) {
  close_panel();
  frame->resize(1000, 700);
  open_rviz("    Fit Window To Screen: true\n");
  const QRect room = frame->windowHandle()->screen()->availableGeometry();
  EXPECT_TRUE(wait_in_rviz([&] { return frame->geometry().size() == room.size(); }))
      << frame->width() << " x " << frame->height();
  frame->resize(1500, 880);
}

/// In the user's locale, whatever that is: decimal points are points.
TEST_F(Panel, ReadsAndShowsNumbersTheSameInAnyLocale) {
  const char* wanted = std::getenv("DECIMAL_POINT");
  if (wanted != nullptr) {
    ASSERT_STREQ(std::localeconv()->decimal_point, wanted) << "the locale is not in use";
  }
  start_node_and_wait();
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_EQ(edit("input:initial.yaw_rate")->text(), "0.2 rad/s");
  type("input:initial.yaw_rate", "0.25");
  type("input:initial.speed", "12.5");
  type("input:coupler.slack", "1.5 inch");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_DOUBLE_EQ(inputs.last().speed, 12.5 * kMph);
  EXPECT_TRUE(wait_in_rviz([&] { return edit("input:initial.speed")->text() == "12.5 mph"; }));
  EXPECT_DOUBLE_EQ(inputs.last().yaw_rate, 0.25);
  EXPECT_NEAR(inputs.last().coupler_slack, 0.0381, 1e-12);
  auto* rate = find<QComboBox>("rate");
  rate->setFocus();
  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "0.25\r");
  EXPECT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().rate == 0.25; }));
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text().contains('.'); })) << label("time")->text().toStdString();
  // A comma is no point anywhere: refused aloud.
  type("input:initial.speed", "12,5 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return is_wrong("input:initial.speed"); }));
}

}  // namespace
}  // namespace train_derail::test
