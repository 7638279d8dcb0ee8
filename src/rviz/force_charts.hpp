#pragma once

#include <optional>

#include <QLabel>
#include <QWidget>

#include "rviz/force_record.hpp"
#include "rviz/qt_charts.hpp"

namespace train_derail::rviz_panel {

/// A plot of forces with kip to the left and kN to the right, buff up and draft down.
class ForceChart : public QtCharts::QChartView {
  Q_OBJECT

 public:
  explicit ForceChart(QWidget* parent);

  QtCharts::QLineSeries* add_line(const QColor& color, qreal width);
  /// Both axes from what is drawn: forces in kip. The force axis only grows until reset() is called.
  void set_ranges(double x_min, double x_max, double force_min, double force_max);
  void reset();
  /// A vertical line across; none: no line.
  void mark(std::optional<double> x);

 protected:
  void changeEvent(QEvent* event) override;

 private:
  QtCharts::QValueAxis *x_, *kip_, *kilonewton_;
  QtCharts::QLineSeries* mark_;
  double lowest_ = 0.0, highest_ = 0.0;
};

/// Coupler force along the train, and its largest value over time.
class ForceCharts : public QWidget {
  Q_OBJECT

 public:
  explicit ForceCharts(QWidget* parent = nullptr);

  void show_forces(const ForceRecord& forces);

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void write_captions();

  QLabel *along_caption_, *over_time_caption_;
  ForceChart *along_, *over_time_;
  QtCharts::QLineSeries *now_, *buff_peak_, *draft_peak_, *buff_, *draft_;
  std::uint32_t run_id_ = 0;
};

}  // namespace train_derail::rviz_panel
