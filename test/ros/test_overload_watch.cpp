// The logic of the example coupler_overload_monitor, by hand.
#include <gtest/gtest.h>

#include "overload_watch.hpp"

namespace train_derail::examples {
namespace {

constexpr double kThreshold = 100.0;

/// Of couplers that have carried these forces, buff positive.
std::vector<Peaks> peaks(const std::vector<double>& forces) {
  std::vector<Peaks> all;
  for (const double f : forces) all.push_back({std::max(f, 0.0), std::max(-f, 0.0)});
  return all;
}

TEST(OverloadWatch, BuffAndDraftApart) {
  OverloadWatch watch(kThreshold);
  watch.run_info(1, 0.5, std::nullopt);
  EXPECT_FALSE(watch.observe(1, 0.0, peaks({0.0, 0.0})));
  EXPECT_TRUE(watch.observe(1, 0.5, peaks({150.0, -50.0}))) << "first time in buff";
  EXPECT_FALSE(watch.observe(1, 1.0, peaks({250.0, -100.0}))) << "no more than the threshold";
  EXPECT_TRUE(watch.observe(1, 1.5, peaks({-101.0, 99.0}))) << "first time in draft";
  EXPECT_FALSE(watch.observe(1, 2.0, peaks({120.0, 0.0})));
  const RunReport report = watch.report();
  EXPECT_EQ(report.overloaded(), 1U);
  EXPECT_EQ(report.missed(), 0U);
  EXPECT_FALSE(report.complete);
  const Load& buff = report.loads[0].buff;
  EXPECT_EQ(buff.first_time, 0.5);
  EXPECT_EQ(buff.peak, 250.0);
  EXPECT_EQ(buff.peak_time, 1.0);
  EXPECT_EQ(report.time_above(buff), 1.5);
  const Load& draft = report.loads[0].draft;
  EXPECT_EQ(draft.first_time, 1.5);
  EXPECT_EQ(draft.peak, 101.0);
  EXPECT_EQ(report.time_above(draft), 0.5);
  EXPECT_EQ(report.loads[1].draft.points_above, 0U);
  EXPECT_EQ(report.loads[1].draft.peak, 100.0);
  EXPECT_EQ(report.time_above(report.loads[1].draft), 0.0);
}

TEST(OverloadWatch, BothDirectionsCanBeAboveBetweenTwoPoints) {
  OverloadWatch watch(kThreshold);
  watch.run_info(1, 0.5, std::nullopt);
  EXPECT_FALSE(watch.observe(1, 0.0, {{0.0, 0.0}}));
  EXPECT_TRUE(watch.observe(1, 0.5, {{150.0, 130.0}}));
  EXPECT_EQ(watch.report().loads[0].buff.peak, 150.0);
  EXPECT_EQ(watch.report().loads[0].draft.peak, 130.0);
  EXPECT_EQ(watch.report().overloaded(), 1U);
}

TEST(OverloadWatch, IsOverWithTheLastPointWhicheverComesFirst) {
  OverloadWatch watch(kThreshold);
  EXPECT_TRUE(watch.take_finished().empty());
  watch.observe(1, 0.0, peaks({0.0}));
  watch.run_info(1, 0.5, 1.0);
  watch.observe(1, 0.5, peaks({0.0}));
  EXPECT_TRUE(watch.take_finished().empty()) << "the last point is still to come";
  watch.observe(1, 1.0, peaks({200.0}));
  const auto finished = watch.take_finished();
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_TRUE(finished[0].complete);
  EXPECT_EQ(finished[0].overloaded(), 1U);
  EXPECT_FALSE(watch.unfinished());
  watch.observe(1, 1.0, peaks({200.0}));
  EXPECT_EQ(watch.report().points, 3U) << "a point that comes twice counts once";
  EXPECT_TRUE(watch.take_finished().empty()) << "each run once";

  watch.run_info(2, 0.25, std::nullopt);
  watch.observe(2, 0.0, peaks({0.0}));
  watch.observe(2, 0.25, peaks({0.0}));
  EXPECT_TRUE(watch.take_finished().empty());
  watch.run_info(2, 0.25, 0.25);
  EXPECT_EQ(watch.take_finished().size(), 1U);
}

TEST(OverloadWatch, RestartCutsTheRunShortAndBeginsAnew) {
  OverloadWatch watch(kThreshold);
  watch.run_info(1, 0.5, std::nullopt);
  watch.observe(1, 0.0, peaks({300.0, 0.0}));
  watch.run_info(2, 0.25, std::nullopt);
  watch.observe(1, 0.5, peaks({300.0, 0.0}));
  EXPECT_TRUE(watch.observe(2, 0.0, peaks({0.0, 0.0, 200.0}))) << "another train";
  const auto finished = watch.take_finished();
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_EQ(finished[0].run_id, 1U);
  EXPECT_FALSE(finished[0].complete);
  EXPECT_EQ(finished[0].interval, 0.5) << "its own, not that of the run after it";
  EXPECT_EQ(finished[0].loads[0].buff.points_above, 2U);
  EXPECT_EQ(watch.report().run_id, 2U);
  EXPECT_EQ(watch.report().interval, 0.25);
  ASSERT_EQ(watch.report().loads.size(), 3U);
  EXPECT_EQ(watch.report().loads[0].buff.points_above, 0U);

  // The simulator itself anew: its runs count from 1 again.
  watch.observe(1, 0.0, peaks({0.0}));
  EXPECT_EQ(watch.take_finished().size(), 1U);
  watch.observe(1, 0.5, peaks({0.0}));
  watch.observe(1, 0.0, peaks({0.0}));
  EXPECT_EQ(watch.take_finished().size(), 1U);
}

TEST(OverloadWatch, SaysWhatItHasNotSeen) {
  OverloadWatch watch(kThreshold);
  watch.observe(1, 0.3, peaks({200.0}));
  EXPECT_FALSE(watch.report().time_above(watch.report().loads[0].buff)) << "the grid is not known yet";
  EXPECT_NE(to_table(watch.report()).find("  ?  "), std::string::npos);
  watch.run_info(1, 0.1, std::nullopt);
  EXPECT_EQ(watch.report().missed(), 3U) << "0, 0.1 and 0.2";
  watch.observe(1, 0.6, peaks({0.0}));
  EXPECT_EQ(watch.report().missed(), 5U);
  EXPECT_NE(to_table(watch.report()).find("5 of 7 points of the grid never came"), std::string::npos);
}

TEST(OverloadWatch, LoneCarHasNoCouplers) {
  OverloadWatch watch(kThreshold);
  watch.run_info(1, 0.5, 0.0);
  EXPECT_FALSE(watch.observe(1, 0.0, peaks({})));
  const auto finished = watch.take_finished();
  ASSERT_EQ(finished.size(), 1U);
  EXPECT_NE(to_table(finished[0]).find("none of 0 couplers"), std::string::npos);
}

TEST(OverloadWatch, TableInBothUnits) {
  OverloadWatch watch(4448221.6152605);
  watch.run_info(7, 0.02, 0.02);
  watch.observe(7, 0.0, peaks({0.0, 0.0}));
  watch.observe(7, 0.02, peaks({0.0, -8896443.230521}));
  EXPECT_EQ(to_table(watch.take_finished().at(0)),
            "run 7, 0.020 s: 1 of 2 couplers above 4448 kN (1000 kip)\n"
            "coupler  direction  first [s]  above [s]  peak [kN]  peak [kip]  at [s]\n"
            "      2  draft          0.020      0.020       8896        2000   0.020\n");
}

}  // namespace
}  // namespace train_derail::examples
