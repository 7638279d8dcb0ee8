#include "rviz/outcome_table.hpp"

#include <cmath>
#include <optional>

#include "rviz/look.hpp"
#include "rviz/scenario_files.hpp"
#include "train_derail/fields/units.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/ros/message_fields.hpp"

namespace train_derail::rviz_panel {

namespace {

using outcome::outcome_fields;

/// A value that is not known yet.
const QString kNothing = QString::fromUtf8("\u2013");

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

/// What is known before the first step; all else would be of a train that has not moved.
bool is_known_at_start(std::string_view name) { return name == "cars" || name == "energy_initial"; }

bool is_shown(const fields::Field<outcome::Outcome>& field, const std::optional<outcome::Outcome>& o) {
  return !field.when || (o && field.when(*o));
}

/// In the unit that people read; a dash if there is no value.
QString text_of(const fields::Field<outcome::Outcome>& field, const std::optional<outcome::Outcome>& o) {
  if (!o || !is_shown(field, o)) return kNothing;
  const outcome::FieldRow texts = outcome::row_of(field, *o);
  return QString::fromStdString(texts.shown.empty() ? texts.si : texts.shown);
}

std::optional<outcome::Outcome> read_outcome(const Outcome::ConstPtr& message) {
  if (!message) return {};
  return ros_face::read<outcome::Outcome>(*message, outcome_fields());
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
    : QWidget(parent),
      grid_(new QGridLayout(this)),
      warnings_(new QLabel(this)),
      this_run_(new QLabel(this)),
      run_before_(new QLabel(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setHorizontalSpacing(8);
  grid_->setVerticalSpacing(0);
  grid_->setColumnStretch(0, 1);
  warnings_->setObjectName("outcome:warnings");
  let_wrap(warnings_);
  warnings_->setTextFormat(Qt::PlainText);
  warnings_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  warnings_->setToolTip(to_qt(outcome_fields().find("warnings")->meaning));
  set_text_color(warnings_, error_color());
  grid_->addWidget(warnings_, 0, 0, 1, 4);
  this_run_->setObjectName("outcome:this_run");
  run_before_->setObjectName("outcome:run_before");
  QFont bold = font();
  bold.setBold(true);
  this_run_->setFont(bold);
  make_secondary(run_before_);
  grid_->addWidget(this_run_, 1, 1, 1, 2);
  grid_->addWidget(run_before_, 1, 3);
  speed_ = add_row("speed", "speed of the last car", "Now.");
  for (const auto& field : outcome_fields()) {
    if (field.headline) rows_.emplace_back(&field, add_row(field.name, field.title, field.meaning));
  }
  show_outcome({});
}

OutcomeTable::Row OutcomeTable::add_row(std::string_view name, std::string_view title, std::string_view meaning) {
  const int line = grid_->rowCount();
  const Row row{new QLabel(capital(title), this),
                new QLabel(this),
                new QLabel(this),
                new QLabel(this),
                new QLabel(this),
                to_qt(meaning)};
  row.value->setObjectName("outcome:" + to_qt(name));
  row.before->setObjectName("outcome_before:" + to_qt(name));
  row.note->setObjectName("outcome_note:" + to_qt(name));
  for (QLabel* label : {row.title, row.value}) label->setToolTip(row.meaning);
  for (QLabel* label : {row.value, row.si, row.before, row.note})
    label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  row.title->setWordWrap(true);
  let_wrap(row.note);
  row.note->setIndent(12);
  for (QLabel* label : {row.si, row.before, row.note}) make_secondary(label);
  grid_->addWidget(row.title, line, 0);
  grid_->addWidget(row.value, line, 1);
  grid_->addWidget(row.si, line, 2);
  grid_->addWidget(row.before, line, 3);
  grid_->addWidget(row.note, line + 1, 0, 1, 4);
  row.note->hide();
  return row;
}

void OutcomeTable::show_speed(const TrainNow& train) {
  const bool known = train.run_id != 0;
  speed_.value->setText(known ? QString::fromStdString(fields::in_shown(train.speed_last, fields::kSpeed)) : kNothing);
  speed_.si->setText(known ? QString::fromStdString(fields::in_si(train.speed_last, fields::kSpeed)) : QString());
}

/// Which run is which, and in what the one before differs.
void OutcomeTable::show_caption(const NodeView& view) {
  const PreviousRun& previous = view.previous;
  const bool compares = view.outcome && previous.outcome;
  this_run_->setVisible(compares);
  run_before_->setVisible(compares);
  if (!compares) return;
  if (view.inputs != inputs_now_ || previous.inputs != inputs_before_) {
    inputs_now_ = view.inputs;
    inputs_before_ = previous.inputs;
    change_.clear();
    changes_.clear();
    try {
      if (inputs_now_ && inputs_before_ && inputs_now_->run_id == view.outcome->run_id) {
        const auto changes = input_changes(inputs::read_scenario(YAML::Load(inputs_before_->yaml), "before"),
                                           inputs::read_scenario(YAML::Load(inputs_now_->yaml), "now"));
        const auto value = [](const std::string& text) {
          return text.empty() ? kNothing : QString::fromStdString(text);
        };
        for (const InputChange& c : changes) {
          if (change_.isEmpty() || c.key == "initial.speed") change_ = value(c.before);
          changes_ += tr("\n%1: %2, before %3").arg(QString::fromStdString(c.key), value(c.now), value(c.before));
        }
        if (changes.empty()) change_ = tr("same inputs");
        else if (changes.size() > 1) change_ += "\u2026";
      }
    } catch (const std::exception&) {  // of a node of another version: the number of the run has to do
    }
  }
  this_run_->setText(tr("Run %1").arg(view.outcome->run_id));
  const bool was_cut = previous.outcome->ended == Outcome::RUNNING;
  QString before = tr("Run %1").arg(previous.outcome->run_id);
  if (was_cut) before += tr(", cut at %1 s").arg(previous.outcome->stop_time, 0, 'f', 1);
  run_before_->setText(change_.isEmpty() ? before : before + ", " + change_);
  run_before_->setToolTip((was_cut ? tr("What the run before had yielded when it was cut off.")
                                   : tr("What the run before has yielded, at its end.")) +
                          changes_);
}

void OutcomeTable::set_full(bool full) { full_ = full; }

int OutcomeTable::height_of_rest() const { return rest_ * speed_.title->sizeHint().height(); }

void OutcomeTable::show_outcome(const NodeView& view) {
  show_speed(view.train);
  show_caption(view);
  const std::optional<outcome::Outcome> o = read_outcome(view.outcome), before = read_outcome(view.previous.outcome);
  QStringList warnings;
  if (o) {
    for (const std::string& warning : o->warnings) warnings << QString::fromStdString(warning);
  }
  show_text(warnings_, warnings.join('\n'));
  const bool moves = o && o->stop_time > 0.0;
  rest_ = 0;
  for (const auto& [field, row] : rows_) {
    const bool can_be_shown = is_shown(*field, o) || (before && field->when && field->when(*before));
    const bool known = o && is_shown(*field, o) && (moves || is_known_at_start(field->name));
    const bool shown = can_be_shown && (full_ || field->leading);
    if (can_be_shown && !field->leading) ++rest_;
    for (QLabel* label : {row.title, row.value, row.si}) label->setVisible(shown);
    row.before->setVisible(shown && before);
    row.before->setText(text_of(*field, before));
    row.value->setText(known ? text_of(*field, o) : kNothing);
    const outcome::FieldRow texts = known ? outcome::row_of(*field, *o) : outcome::FieldRow{};
    row.si->setText(texts.shown.empty() ? QString() : QString::fromStdString(texts.si));
    const QString note = known && field->name == "energy_initial" ? shares(*o) : QString::fromStdString(texts.note);
    show_text(row.note, note);
    row.note->setVisible(shown && full_ && !note.isEmpty());
    if (can_be_shown && !note.isEmpty()) ++rest_;
    row.value->setToolTip(note.isEmpty() ? row.meaning : row.meaning + "\n" + note);
  }
}

}  // namespace train_derail::rviz_panel
