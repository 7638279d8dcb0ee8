#include "rviz/force_charts.hpp"

#include <algorithm>
#include <cmath>

#include <QEvent>
#include <QGraphicsLayout>
#include <QVBoxLayout>

#include "rviz/look.hpp"
#include "rviz/ticks.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::rviz_panel {

namespace {

using namespace QtCharts;

constexpr double kKilonewtonPerKip = inputs::kKip / 1000.0;
/// Of the force axis, so that noise in a quiet train does not fill the plot [kip].
constexpr double kForceSpanMin = 20.0;
constexpr qreal kDisabledOpacity = 0.35;
constexpr qreal kFontScale = 0.8;
constexpr double kLineSpacing = 1.9;  // least distance of labels over the height of their font

QValueAxis* make_axis(QChart* chart, Qt::Alignment side, const QString& title, const QFont& font) {
  auto* axis = new QValueAxis(chart);
  axis->setTickType(QValueAxis::TicksDynamic);
  axis->setTickAnchor(0.0);
  axis->setLabelFormat("%g");
  axis->setLabelsFont(font);
  axis->setTitleFont(font);
  axis->setTitleText(title);
  axis->setTitleVisible(!title.isEmpty());
  chart->addAxis(axis, side);
  return axis;
}

QString key(const QString& text, const QColor& color) {
  return QString("&nbsp; <span style='color:%1'>\u2501 %2</span>").arg(color.name(), text);
}

}  // namespace

ForceChart::ForceChart(QWidget* parent) : QChartView(parent) {
  QFont small = font();
  small.setPointSizeF(kFontScale * small.pointSizeF());
  QChart* const plot = chart();
  plot->legend()->hide();
  plot->setMargins(QMargins(0, 0, 0, 0));
  plot->layout()->setContentsMargins(0, 0, 0, 0);
  plot->setBackgroundRoundness(0.0);
  plot->setBackgroundBrush(palette().base());
  x_ = make_axis(plot, Qt::AlignBottom, {}, small);
  kip_ = make_axis(plot, Qt::AlignLeft, tr("kip"), small);
  kilonewton_ = make_axis(plot, Qt::AlignRight, tr("kN"), small);
  kilonewton_->setGridLineVisible(false);
  setRenderHint(QPainter::Antialiasing);
  setFrameShape(QFrame::StyledPanel);
  setMinimumHeight(5 * fontMetrics().height());
  setMinimumWidth(200);
  mark_ = add_line(palette().color(QPalette::Text), 1.2);
  mark_->setName("mark");
  QPen dashed = mark_->pen();
  dashed.setStyle(Qt::DashLine);
  mark_->setPen(dashed);
  reset();
}

QLineSeries* ForceChart::add_line(const QColor& color, qreal width) {
  auto* line = new QLineSeries(chart());
  line->setPen(QPen(color, width));
  chart()->addSeries(line);
  line->attachAxis(x_);
  line->attachAxis(kip_);
  return line;
}

void ForceChart::reset() {
  lowest_ = highest_ = 0.0;
  set_ranges(0.0, 1.0, 0.0, 0.0);
}

void ForceChart::set_ranges(double x_min, double x_max, double force_min, double force_max) {
  lowest_ = std::min(lowest_, force_min);
  highest_ = std::max(highest_, force_max);
  const double spare = 0.5 * std::max(0.0, kForceSpanMin - (highest_ - lowest_));
  // Labels that come too close become dots.
  const double line = QFontMetricsF(kip_->labelsFont()).height();
  const double part = std::clamp(kLineSpacing * line / std::max(1.0, height() - 2.0 * line), 0.2, 0.5);
  const double interval = nice_interval(part * (highest_ - lowest_ + 2.0 * spare));
  const double low = std::min(std::floor((lowest_ - spare) / (0.5 * interval)) * 0.5 * interval, 0.0);
  const double high = std::max(std::ceil((highest_ + spare) / (0.5 * interval)) * 0.5 * interval, 0.0);
  kip_->setTickInterval(interval);
  kip_->setRange(low, high);
  kilonewton_->setTickInterval(tick_interval(low * kKilonewtonPerKip, high * kKilonewtonPerKip, part));
  kilonewton_->setRange(low * kKilonewtonPerKip, high * kKilonewtonPerKip);
  x_->setTickInterval(nice_interval((x_max - x_min) / 7.0));
  x_->setRange(x_min, x_max);
}

void ForceChart::mark(std::optional<double> x) {
  if (x) mark_->replace(QVector<QPointF>{{*x, kip_->min()}, {*x, kip_->max()}});
  else mark_->clear();
}

void ForceChart::changeEvent(QEvent* event) {
  if (event->type() == QEvent::EnabledChange) chart()->setOpacity(isEnabled() ? 1.0 : kDisabledOpacity);
  QChartView::changeEvent(event);
}

ForceCharts::ForceCharts(QWidget* parent) : QWidget(parent) {
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(2);
  const QColor now = palette().color(QPalette::Text);
  along_ = new ForceChart(this);
  over_time_ = new ForceChart(this);
  along_->setObjectName("chart:along");
  over_time_->setObjectName("chart:time");
  along_->setToolTip(
      tr("Axial force over the coupler's number, from the first car to derail: buff (compression) up, draft down."));
  over_time_->setToolTip(tr(
      "Largest buff (up) and draft (down) of all couplers at each time of this run. A dashed line: the moment that is "
      "shown, if it is not the last."));
  along_caption_ = new QLabel(this);
  over_time_caption_ = new QLabel(this);
  column->addWidget(along_caption_);
  column->addWidget(along_, 1);
  column->addWidget(over_time_caption_);
  column->addWidget(over_time_, 1);
  write_captions();
  buff_peak_ = along_->add_line(buff_color(), 1.2);
  draft_peak_ = along_->add_line(draft_color(), 1.2);
  now_ = along_->add_line(now, 1.6);
  now_->setName("now");
  buff_ = over_time_->add_line(buff_color(), 1.2);
  draft_ = over_time_->add_line(draft_color(), 1.2);
}

/// The colours in a text do not grey out by themselves.
void ForceCharts::write_captions() {
  const QColor grey = palette().color(QPalette::Disabled, QPalette::WindowText);
  const auto entry = [&](const QString& text, const QColor& color) { return key(text, isEnabled() ? color : grey); };
  const auto bold = [](const QString& text) { return "<b>" + text + "</b>"; };
  along_caption_->setText(bold(tr("Force by coupler")) +
                          entry(tr("shown"), palette().color(QPalette::Active, QPalette::Text)) +
                          entry(tr("peak buff"), buff_color()) + entry(tr("peak draft"), draft_color()));
  over_time_caption_->setText(bold(tr("Largest force over time [s]")) + entry(tr("buff"), buff_color()) +
                              entry(tr("draft"), draft_color()));
}

void ForceCharts::changeEvent(QEvent* event) {
  if (event->type() == QEvent::EnabledChange) write_captions();
  QWidget::changeEvent(event);
}

void ForceCharts::show_forces(const ForceRecord& forces) {
  if (forces.run_id != run_id_) {
    run_id_ = forces.run_id;
    along_->reset();
    over_time_->reset();
  }
  QVector<QPointF> now, buff_peak, draft_peak, buff, draft;
  for (std::size_t i = 0; i < forces.now.size(); ++i) {
    const auto number = static_cast<double>(i + 1);
    now.append({number, forces.now[i] / inputs::kKip});
    buff_peak.append({number, forces.buff_peak[i] / inputs::kKip});
    draft_peak.append({number, -forces.draft_peak[i] / inputs::kKip});
  }
  for (const ForceRecord::Sample& sample : forces.history) {
    buff.append({sample.time, sample.buff / inputs::kKip});
    draft.append({sample.time, -sample.draft / inputs::kKip});
  }
  now_->replace(now);
  buff_peak_->replace(buff_peak);
  draft_peak_->replace(draft_peak);
  buff_->replace(buff);
  draft_->replace(draft);
  const double highest = forces.buff_max() / inputs::kKip, lowest = -forces.draft_max() / inputs::kKip;
  along_->set_ranges(1.0, std::max<double>(2.0, static_cast<double>(forces.now.size())), lowest, highest);
  const double begin = forces.history.empty() ? 0.0 : forces.history.front().time;
  over_time_->set_ranges(std::min(begin, forces.time), std::max(begin + 1.0, forces.time_max), lowest, highest);
  // Where a run that stands still is looked back at.
  over_time_->mark(forces.time < forces.time_max ? std::optional(forces.time) : std::nullopt);
}

}  // namespace train_derail::rviz_panel
