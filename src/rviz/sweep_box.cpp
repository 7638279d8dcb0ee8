#include "rviz/sweep_box.hpp"

#include <algorithm>
#include <cmath>

#include <QFontDatabase>
#include <QGraphicsLayout>
#include <QGridLayout>
#include <QHBoxLayout>

#include "rviz/input_table.hpp"
#include "rviz/look.hpp"
#include "train_derail/outcome/quantities.hpp"

namespace train_derail::rviz_panel {

namespace {

using namespace QtCharts;
using State = StudyView::State;

constexpr char kFirstKey[] = "initial.speed";
constexpr char kFirstOutcome[] = "cars_derailed";
/// Of the proposed range, over the present value.
constexpr double kLow = 0.5, kHigh = 1.5;
constexpr int kChartLines = 11;  // height over that of a line of text

QString to_qt(std::string_view text) { return QString::fromUtf8(text.data(), static_cast<int>(text.size())); }

QString seconds_left(double eta) {
  if (eta < 90.0) return QObject::tr("%1 s left").arg(std::ceil(eta), 0, 'f', 0);
  return QObject::tr("%1 min left").arg(std::ceil(eta / 60.0), 0, 'f', 0);
}

QString axis_title(std::string_view title, std::string_view unit) {
  return unit.empty() ? to_qt(title) : QString("%1 [%2]").arg(to_qt(title), to_qt(unit));
}

}  // namespace

SweepChart::SweepChart(QWidget* parent) : QChartView(parent) {
  setObjectName("sweep_chart");
  chart()->legend()->hide();
  chart()->setMargins(QMargins(0, 0, 0, 0));
  chart()->layout()->setContentsMargins(0, 0, 0, 0);
  chart()->setBackgroundRoundness(0.0);
  chart()->setBackgroundBrush(palette().base());
  setRenderHint(QPainter::Antialiasing);
  setFrameShape(QFrame::StyledPanel);
  setMinimumHeight(kChartLines * fontMetrics().height());
}

void SweepChart::show_outcome(const SweepResult& result, std::size_t outcome) {
  chart()->removeAllSeries();
  for (QAbstractAxis* axis : chart()->axes()) chart()->removeAxis(axis), axis->deleteLater();
  const outcome::Quantity* const quantity = outcome::find_quantity(result.outcomes[outcome]);
  auto* median = new QLineSeries;
  auto* low = new QLineSeries;
  auto* high = new QLineSeries;
  double lowest = 0.0, highest = 0.0;
  for (std::size_t i = 0; i < result.values.size(); ++i) {
    const study::Spread& s = result.spreads[i * result.outcomes.size() + outcome].spread;
    if (s.count == 0) continue;  // all runs failed
    median->append(result.values[i], s.median / quantity->per_shown);
    low->append(result.values[i], s.q05 / quantity->per_shown);
    high->append(result.values[i], s.q95 / quantity->per_shown);
    lowest = std::min(lowest, s.q05 / quantity->per_shown);
    highest = std::max(highest, s.q95 / quantity->per_shown);
  }
  auto* band = new QAreaSeries(high, low);
  low->setParent(band);
  high->setParent(band);
  QColor color = draft_color();
  median->setPen(QPen(color, 1.8));
  median->setPointsVisible(true);
  color.setAlpha(60);
  band->setBrush(color);
  band->setPen(Qt::NoPen);
  QFont small = font();
  small.setPointSizeF(0.8 * small.pointSizeF());
  auto* x = new QValueAxis;
  auto* y = new QValueAxis;
  for (QValueAxis* axis : {x, y}) {
    axis->setLabelFormat("%g");
    axis->setLabelsFont(small);
    axis->setTitleFont(small);
  }
  x->setTitleText(axis_title(result.label, result.unit));
  y->setTitleText(axis_title(quantity->title, quantity->shown_unit));
  chart()->addAxis(x, Qt::AlignBottom);
  chart()->addAxis(y, Qt::AlignLeft);
  for (QAbstractSeries* series : {static_cast<QAbstractSeries*>(band), static_cast<QAbstractSeries*>(median)}) {
    chart()->addSeries(series);
    series->attachAxis(x);
    series->attachAxis(y);
  }
  x->setRange(result.values.front(), result.values.back());
  y->setRange(lowest, highest > lowest ? highest : lowest + 1.0);
  y->applyNiceNumbers();
}

SweepBox::SweepBox(QWidget* parent) : QWidget(parent) {
  auto* grid = new QGridLayout(this);
  grid->setContentsMargins(0, 0, 0, 0);
  grid->setHorizontalSpacing(6);
  grid->setVerticalSpacing(2);
  key_ = new QComboBox(this);
  key_->setObjectName("sweep:key");
  key_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  key_->setMinimumContentsLength(16);
  key_->setMaxVisibleItems(25);
  key_->setToolTip(tr("The input that changes; all others are those of the form above."));
  const auto edit = [this](const char* name) {
    auto* e = new QLineEdit(this);
    e->setObjectName(name);
    e->setToolTip(tr("A number, in the unit that is shown or with another one."));
    connect(e, &QLineEdit::returnPressed, this, &SweepBox::start);
    return e;
  };
  from_ = edit("sweep:from");
  to_ = edit("sweep:to");
  const auto spin = [this](const char* name, int least, int most, int value, const QString& suffix) {
    auto* s = new QSpinBox(this);
    s->setObjectName(name);
    s->setRange(least, most);
    s->setValue(value);
    s->setSuffix(suffix);
    return s;
  };
  points_ = spin("sweep:points", 2, 200, 8, tr(" values"));
  runs_ = spin("sweep:runs", 1, 1000, 10, tr(" runs each"));
  runs_->setToolTip(tr(
      "Runs of one value differ as the scenario's perturbation says; if it says nothing, by 0.01 ft between the cars "
      "and 0.1 % of the yaw rate."));
  start_ = new QPushButton(tr("Start s&weep"), this);
  start_->setObjectName("sweep:start");
  start_->setToolTip(tr("Runs beside the live simulation, in a process of its own on the node's machine."));
  cancel_ = new QPushButton(tr("Cancel"), this);
  cancel_->setObjectName("sweep:cancel");
  auto* range = new QHBoxLayout;
  range->addWidget(from_, 1);
  range->addWidget(new QLabel(tr("to"), this));
  range->addWidget(to_, 1);
  grid->addWidget(new QLabel(tr("Input"), this), 0, 0);
  grid->addWidget(key_, 0, 1);
  grid->addLayout(range, 0, 2);
  auto* line = new QHBoxLayout;
  line->addWidget(points_);
  line->addWidget(runs_);
  line->addStretch(1);
  line->addWidget(cancel_);
  line->addWidget(start_);
  grid->addLayout(line, 1, 0, 1, 3);
  grid->setColumnStretch(1, 1);
  grid->setColumnStretch(2, 1);
  progress_ = new QProgressBar(this);
  progress_->setObjectName("sweep:progress");
  progress_->hide();
  grid->addWidget(progress_, 2, 0, 1, 3);
  message_ = make_message("sweep:message", this);
  grid->addWidget(message_, 3, 0, 1, 3);
  outcome_ = new QComboBox(this);
  outcome_->setObjectName("sweep:outcome");
  outcome_->hide();
  grid->addWidget(outcome_, 4, 0, 1, 3);
  chart_ = new SweepChart(this);
  chart_->setToolTip(tr("Line: the median of the runs of each value. Band: from 5 to 95 % of them."));
  chart_->hide();
  grid->addWidget(chart_, 5, 0, 1, 3);
  table_ = new QPlainTextEdit(this);
  table_->setObjectName("sweep:table");
  table_->setReadOnly(true);
  table_->setLineWrapMode(QPlainTextEdit::NoWrap);
  table_->setFont(QFontDatabase::systemFont(QFontDatabase::FixedFont));
  table_->hide();
  grid->addWidget(table_, 6, 0, 1, 3);

  connect(start_, &QPushButton::clicked, this, &SweepBox::start);
  connect(cancel_, &QPushButton::clicked, this, &SweepBox::cancel);
  connect(key_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, &SweepBox::propose_range);
  connect(outcome_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, &SweepBox::show_outcome);
  show_study({});
}

void SweepBox::show_scenario(const std::shared_ptr<const inputs::Scenario>& scenario) {
  scenario_ = scenario;
  const QString before = key_->currentText();
  QStringList keys;
  if (scenario_) {
    for (const std::string& key : sweep_keys(*scenario_)) keys << QString::fromStdString(key);
  }
  QStringList present;
  for (int i = 0; i < key_->count(); ++i) present << key_->itemText(i);
  if (keys == present) return;  // a range that somebody has typed stays
  const QSignalBlocker quiet(key_);
  key_->clear();
  key_->addItems(keys);
  const int again = key_->findText(before.isEmpty() ? QString(kFirstKey) : before);
  key_->setCurrentIndex(std::max(again, 0));
  if (key_->currentText() != before) propose_range();
}

void SweepBox::propose_range() {
  if (!scenario_ || key_->currentIndex() < 0) return;
  const InputTable table = make_input_table(*scenario_);
  const auto found = table.find(key_->currentText().toStdString());
  if (found == table.end()) return;
  const QString unit = QString::fromStdString(found->second.unit);
  bool is_number = false;
  const double now = QString::fromStdString(found->second.value).section(' ', 0, 0).toDouble(&is_number);
  const bool is_whole = found->second.allowed.rfind("a whole number", 0) == 0;
  const auto text = [&](double value) {
    const QString number = is_whole ? QString::number(std::lround(value)) : QString::number(value, 'g', 4);
    return unit.isEmpty() ? number : number + " " + unit;
  };
  from_->setText(is_number && std::isfinite(now) ? text(std::min(kLow * now, kHigh * now)) : QString());
  to_->setText(is_number && std::isfinite(now) ? text(std::max(kLow * now, kHigh * now)) : QString());
  const QString tip =
      tr("%1\nAllowed: %2\nThis run: %3")
          .arg(QString::fromStdString(found->second.meaning), QString::fromStdString(found->second.allowed),
               QString::fromStdString(found->second.value));
  for (QLineEdit* e : {from_, to_}) e->setToolTip(tip);
}

std::string SweepBox::study(const inputs::Scenario& scenario) const {
  return sweep_study(scenario, {key_->currentText().toStdString(), from_->text().toStdString(),
                                to_->text().toStdString(), points_->value(), runs_->value()});
}

void SweepBox::show_study(const StudyView& view) {
  const bool under_way = view.under_way();
  start_->setEnabled(!under_way && key_->count() > 0);
  cancel_->setEnabled(under_way);
  progress_->setVisible(under_way);
  if (under_way) {
    progress_->setRange(0, static_cast<int>(view.total));  // 0: busy
    progress_->setValue(static_cast<int>(view.done));
    QString text = view.total > 0 ? tr("%1 of %2 runs").arg(view.done).arg(view.total) : tr("waiting for the node");
    if (view.total > 0 && view.eta > 0.0) text += ", " + seconds_left(view.eta);
    progress_->setFormat(text);
  }
  if (view.state == state_ && view.result == result_) return;
  state_ = view.state;
  QString text = QString::fromStdString(view.message);
  if (view.state == State::done && !view.result) {
    text += "\n" + tr("No picture: the results are not on this machine, or cannot be read (%1).")
                       .arg(QString::fromStdString(view.unreadable));
  }
  message_->setText(text);
  message_->setVisible(!under_way && !text.isEmpty());
  set_text_color(message_, view.state == State::failed ? error_color() : quiet_color());
  table_->setPlainText(QString::fromStdString(view.table));
  table_->setVisible(view.state == State::done && !view.result);
  result_ = view.result;
  {
    const QSignalBlocker quiet(outcome_);
    const QString before = outcome_->currentData().toString();
    outcome_->clear();
    if (result_) {
      for (const std::string& name : result_->outcomes) {
        QString title = to_qt(outcome::find_quantity(name)->title);
        title[0] = title[0].toUpper();
        outcome_->addItem(title, QString::fromStdString(name));
      }
      outcome_->setCurrentIndex(std::max(0, outcome_->findData(before.isEmpty() ? QString(kFirstOutcome) : before)));
    }
  }
  outcome_->setVisible(result_ != nullptr);
  chart_->setVisible(result_ != nullptr);
  show_outcome();
}

void SweepBox::show_outcome() {
  if (result_ && outcome_->currentIndex() >= 0)
    chart_->show_outcome(*result_, static_cast<std::size_t>(outcome_->currentIndex()));
}

}  // namespace train_derail::rviz_panel
