#pragma once

#include <memory>

#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QSpinBox>
#include <QWidget>

#include "rviz/qt_charts.hpp"
#include "rviz/study_link.hpp"

namespace train_derail::rviz_panel {

/// Median and 5 to 95 % of one outcome over the input of a sweep.
class SweepChart : public QtCharts::QChartView {
  Q_OBJECT

 public:
  explicit SweepChart(QWidget* parent);
  void show_outcome(const SweepResult& result, std::size_t outcome);
};

/// A study over one input: what is asked for, how far it is, what has come out.
class SweepBox : public QWidget {
  Q_OBJECT

 public:
  explicit SweepBox(QWidget* parent = nullptr);

  /// The scenario of the run: which inputs can be swept, and from what.
  void show_scenario(const std::shared_ptr<const inputs::Scenario>& scenario);
  void show_study(const StudyView& view);
  /// What is asked for; an error of the reader if it cannot be. `scenario`: with what is typed for the next run.
  std::string study(const inputs::Scenario& scenario) const;

 Q_SIGNALS:
  void start();
  void cancel();

 private:
  void propose_range();
  void show_outcome();

  std::shared_ptr<const inputs::Scenario> scenario_;
  std::shared_ptr<const SweepResult> result_;
  StudyView::State state_ = StudyView::State::none;
  QComboBox *key_, *outcome_;
  QLineEdit *from_, *to_;
  QSpinBox *points_, *runs_;
  QPushButton *start_, *cancel_;
  QProgressBar* progress_;
  QLabel* message_;
  SweepChart* chart_;
  QPlainTextEdit* table_;
};

}  // namespace train_derail::rviz_panel
