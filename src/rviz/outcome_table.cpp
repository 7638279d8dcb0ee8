#include "rviz/outcome_table.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "rviz/look.hpp"
#include "train_derail/fields/units.hpp"
#include "train_derail/ros/message_fields.hpp"

namespace train_derail::rviz_panel {

namespace {

using outcome::outcome_fields;

/// A value that is not known yet.
const char* const kNothing = "\u2013";

/// Part of the energy at the start that is worth naming [%].
constexpr double kShareLeast = 0.05;

QString to_qt(std::string_view text) { return QString::fromUtf8(text.data(), static_cast<int>(text.size())); }

/// As a sentence begins.
QString capital(std::string_view text) {
  QString title = to_qt(text);
  if (!title.isEmpty()) title[0] = title[0].toUpper();
  return title;
}

void show_text(QLabel* label, const QString& text) {
  label->setText(text);
  label->setVisible(!text.isEmpty());
}

/// Makes `peak` the largest force that the stream has shown if it is larger: outcomes come seldom.
void overlay(outcome::PeakForce& peak, const std::vector<double>& by_coupler,
             const std::vector<ForceRecord::Sample>& history, double ForceRecord::Sample::*force) {
  const auto largest = std::max_element(by_coupler.begin(), by_coupler.end());
  if (largest == by_coupler.end() || *largest <= peak.force) return;
  peak.force = *largest;
  peak.coupler = static_cast<int>(largest - by_coupler.begin()) + 1;
  const auto sample = std::max_element(history.begin(), history.end(),
                                       [force](const auto& a, const auto& b) { return a.*force < b.*force; });
  peak.time = sample == history.end() ? 0.0 : sample->time;
}

/// What the node has said last, and what its streams have shown since.
std::optional<outcome::Outcome> latest(const NodeView& view) {
  if (!view.outcome) return {};
  auto o = ros_face::read<outcome::Outcome>(*view.outcome, outcome_fields());
  if (view.train.run_id == view.outcome->run_id) {
    o.cars_past_pod = static_cast<int>(view.train.past_pod);
    o.cars_off_track = static_cast<int>(view.train.off_track);
  }
  if (view.forces.run_id == view.outcome->run_id) {
    overlay(o.coupler_buff_peak, view.forces.buff_peak, view.forces.history, &ForceRecord::Sample::buff);
    overlay(o.coupler_draft_peak, view.forces.draft_peak, view.forces.history, &ForceRecord::Sample::draft);
  }
  return o;
}

/// Where the energy at the start has gone, in per cent of it.
QString shares(const outcome::Outcome& o) {
  QStringList all;
  for (const model::EnergyTerm& term : model::kEnergyTerms) {
    const double share = 100.0 * o.energy.*term.term / o.energy_initial;
    if (o.energy_initial > 0.0 && std::abs(share) >= kShareLeast)
      all << QString("%1 %2 %").arg(to_qt(term.title), QString::number(share, 'f', 1));
  }
  return all.join(", ");
}

}  // namespace

OutcomeTable::OutcomeTable(QWidget* parent)
    : QWidget(parent), grid_(new QGridLayout(this)), warnings_(new QLabel(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setHorizontalSpacing(6);
  grid_->setVerticalSpacing(1);
  grid_->setColumnStretch(0, 1);
  warnings_->setObjectName("outcome:warnings");
  warnings_->setWordWrap(true);
  warnings_->setTextFormat(Qt::PlainText);
  warnings_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  warnings_->setToolTip(to_qt(outcome_fields().find("warnings")->meaning));
  set_text_color(warnings_, error_color());
  grid_->addWidget(warnings_, 0, 0, 1, 3);
  speed_ = add_row("speed", "speed of the last car", "Now.");
  for (const auto& field : outcome_fields()) {
    if (field.headline) rows_.emplace_back(&field, add_row(field.name, field.title, field.meaning));
  }
  show_outcome({});
}

OutcomeTable::Row OutcomeTable::add_row(std::string_view name, std::string_view title, std::string_view meaning) {
  const int line = grid_->rowCount();
  const Row row{new QLabel(capital(title), this), new QLabel(this), new QLabel(this), new QLabel(this)};
  row.value->setObjectName("outcome:" + to_qt(name));
  row.note->setObjectName("outcome_note:" + to_qt(name));
  for (QLabel* label : {row.title, row.value}) label->setToolTip(to_qt(meaning));
  for (QLabel* label : {row.value, row.si, row.note}) label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  for (QLabel* label : {row.title, row.note}) label->setWordWrap(true);
  row.note->setIndent(12);
  for (QLabel* label : {row.si, row.note}) make_secondary(label);
  grid_->addWidget(row.title, line, 0);
  grid_->addWidget(row.value, line, 1);
  grid_->addWidget(row.si, line, 2);
  grid_->addWidget(row.note, line + 1, 0, 1, 3);
  row.note->hide();
  return row;
}

void OutcomeTable::show_speed(const TrainNow& train) {
  const bool known = train.run_id != 0;
  speed_.value->setText(known ? QString::fromStdString(fields::in_shown(train.speed_last, fields::kSpeed)) : kNothing);
  speed_.si->setText(known ? QString::fromStdString(fields::in_si(train.speed_last, fields::kSpeed)) : QString());
}

void OutcomeTable::show_outcome(const NodeView& view) {
  show_speed(view.train);
  const std::optional<outcome::Outcome> o = latest(view);
  QStringList warnings;
  if (o) {
    for (const std::string& warning : o->warnings) warnings << QString::fromStdString(warning);
  }
  show_text(warnings_, warnings.join('\n'));
  for (const auto& [field, row] : rows_) {
    const bool shown = !field->when || (o && field->when(*o));
    for (QLabel* label : {row.title, row.value, row.si}) label->setVisible(shown);
    const outcome::FieldRow texts = o ? outcome::row_of(*field, *o) : outcome::FieldRow{kNothing, "", ""};
    row.value->setText(QString::fromStdString(texts.shown.empty() ? texts.si : texts.shown));
    row.si->setText(texts.shown.empty() ? QString() : QString::fromStdString(texts.si));
    const QString note = QString::fromStdString(texts.note);
    show_text(row.note, !shown || !o ? QString() : field->name == "energy_initial" ? shares(*o) : note);
  }
}

}  // namespace train_derail::rviz_panel
