#include "rviz/inputs_form.hpp"

#include <exception>

#include <QGridLayout>

#include "rviz/look.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::rviz_panel {

namespace {

struct Field {
  const char* key;
  const char* label;  // RViz itself has Alt+F, Alt+P, Alt+H
  bool is_choice;
};
constexpr Field kFields[] = {
    // Left those that have another unit beside SI; side by side with what goes with them.
    {"initial.speed", "&Speed", false},
    {"initial.yaw_rate", "&Yaw rate", false},
    {"consist[0].weight", "Car &weight", false},
    {"consist[0].count", "&Cars", false},
    {"coupler.slack", "Slac&k", false},
    {"ground.on_track_friction", "\u03bc &on track", false},
    {"ground.on_track_law", "On-track &law", true},
    {"ground.off_track_friction", "\u03bc off track", false},
};
constexpr int kPairs = 2;  // side by side, each of kColumns: label, editor, SI value
constexpr int kColumns = 3;

/// While somebody types, the value is half there: it is checked when he rests.
constexpr int kRestMs = 300;

/// ", locomotive 1-2": of the first block, which cars; short, since it sets the width of the panel. Empty if all cars
/// are in one block.
QString first_block(const InputTable& table) {
  if (table.count("consist[1].count") == 0) return {};
  const auto text = [&](const char* key) {
    const auto item = table.find(key);
    return item == table.end() ? QString() : QString::fromStdString(item->second.value);
  };
  const QString count = text("consist[0].count"), name = text("consist[0].name");
  const QString cars = count == "1" ? QString("1") : QString("1\u2013%1").arg(count);
  return QString(",\n%1 %2").arg(name.isEmpty() ? QObject::tr("block") : name, cars);
}

}  // namespace

void InputsForm::Row::show(const std::string& text) const {
  if (edit != nullptr) edit->setText(QString::fromStdString(text));
  else choice->setCurrentText(QString::fromStdString(text));
}

InputsForm::InputsForm(QWidget* parent) : QWidget(parent) {
  auto* grid = new QGridLayout(this);
  grid->setContentsMargins(0, 0, 0, 0);
  grid->setHorizontalSpacing(6);
  grid->setVerticalSpacing(2);
  for (int pair = 0; pair < kPairs; ++pair) grid->setColumnStretch(kColumns * pair + 1, 1);
  for (const Field& field : kFields) add_row(field.key, field.label, field.is_choice);

  const int row = grid->rowCount();
  auto* label = new QLabel(tr("Other &inputs"), this);
  free_ = new QLineEdit(this);
  free_->setObjectName("input:");
  free_->setPlaceholderText(tr("key=value; key=value"));
  QPalette palette = free_->palette();  // greys out with the rest
  palette.setColor(QPalette::Disabled, QPalette::PlaceholderText, palette.color(QPalette::Disabled, QPalette::Text));
  free_->setPalette(palette);
  free_->setToolTip(
      tr("Any other inputs of the scenario, as <tt>derail run --set</tt> takes them:<br>"
         "<tt>coupler.stiffness=40e6 lbf/ft; solver.method=bdf</tt><br>"
         "<tt>derail keys</tt> lists them all; the node checks them."));
  label->setBuddy(free_);
  grid->addWidget(label, row, 0);
  grid->addWidget(free_, row, 1, 1, kPairs * kColumns - 1);
  connect(free_, &QLineEdit::textEdited, this, [this] {
    Q_EMIT changed();
    Q_EMIT edited();
  });

  connect(free_, &QLineEdit::returnPressed, this, &InputsForm::submitted);

  check_later_.setSingleShot(true);
  check_later_.setInterval(kRestMs);
  connect(&check_later_, &QTimer::timeout, this, [this] {
    for (const auto& r : rows_) {
      if (!r->typed.empty()) check(*r, false);
    }
    Q_EMIT changed();
  });
}

void InputsForm::add_row(const char* key, const char* label, bool is_choice) {
  rows_.push_back(std::make_unique<Row>());
  Row& row = *rows_.back();
  row.key = key;
  row.title = tr(label);
  row.label = new QLabel(row.title, this);
  row.si = new QLabel(this);
  make_secondary(row.si);
  if (is_choice) {
    row.choice = new QComboBox(this);
    row.choice->setFocusPolicy(Qt::StrongFocus);
    row.choice->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
    row.choice->setMinimumContentsLength(8);
    connect(row.choice, QOverload<int>::of(&QComboBox::activated), this, [this, &row](int) {
      on_typed(row, row.choice->currentText());
      check(row, true);
      Q_EMIT changed();
    });
  } else {
    row.edit = new QLineEdit(this);
    row.edit->setMinimumWidth(row.edit->fontMetrics().horizontalAdvance("0.2 rad/s 00"));
    connect(row.edit, &QLineEdit::textEdited, this, [this, &row](const QString& text) { on_typed(row, text); });
    connect(row.edit, &QLineEdit::editingFinished, this, [this, &row] {
      if (!row.typed.empty()) check(row, true);
      Q_EMIT changed();
    });
    connect(row.edit, &QLineEdit::returnPressed, this, &InputsForm::submitted);
  }
  row.editor()->setObjectName("input:" + QString(key));
  row.label->setBuddy(row.editor());
  auto* grid = static_cast<QGridLayout*>(layout());
  if (rows_.size() % kPairs == 1) row.si->setMinimumWidth(row.si->fontMetrics().horizontalAdvance("00.00 m/s"));
  const int index = static_cast<int>(rows_.size()) - 1;
  const int line = index / kPairs, column = kColumns * (index % kPairs);
  grid->addWidget(row.label, line, column);
  grid->addWidget(row.editor(), line, column + 1);
  grid->addWidget(row.si, line, column + 2);
}

void InputsForm::on_typed(Row& row, const QString& text) {
  row.typed = text.toStdString();
  if (row.typed.empty()) row.typed = " ";  // emptied on purpose: a mistake that is to be seen
  row.differs = true;
  row.applied = false;
  check_later_.start();
  Q_EMIT edited();
}

/// `complete`: he has left the field, so that its text may be completed by the unit.
void InputsForm::check(Row& row, bool complete) {
  row.error.clear();
  if (tree_.IsNull() || !unreadable_.isEmpty()) return;  // what is known of an earlier run says nothing of this one
  const CheckedInput checked = check_input(tree_, table_, row.key, row.typed);
  row.error = QString::fromStdString(checked.error);
  row.differs = !checked.as_before;
  row.si->setText(QString::fromStdString(checked.value_si));
  if (complete && row.error.isEmpty()) {
    row.typed = checked.text;
    row.show(row.typed);
  }
  decorate(row);
}

QString InputsForm::show_run(const std::string& yaml) {
  try {
    const YAML::Node tree = YAML::Load(yaml);
    of_run_ = std::make_shared<const inputs::Scenario>(inputs::read_scenario(tree, "inputs"));
    table_ = make_input_table(*of_run_);
    tree_.reset(tree);
  } catch (const std::exception& e) {
    unreadable_ = tr("The inputs of this run cannot be shown: %1").arg(e.what());  // of a node of another version, say
    return unreadable_;
  }
  unreadable_.clear();
  const QString block = first_block(table_);
  for (const auto& r : rows_) {
    Row& row = *r;
    const InputItem& item = table_.at(row.key);
    if (row.choice != nullptr && row.choice->count() == 0) {
      for (const std::string& name : item.choices) row.choice->addItem(QString::fromStdString(name));
    }
    if (!row.typed.empty()) check(row, !row.editor()->hasFocus());
    if (row.differs && row.applied) {  // somebody else has set another value since
      row.typed.clear();
      row.differs = row.applied = false;
      row.error.clear();
    }
    if (!row.typed.empty() && !row.differs) row.applied = true;
    if (row.typed.empty()) {
      row.show(item.value);
      row.si->setText(QString::fromStdString(item.value_si));
    }
    if (row.key.rfind("consist[0]", 0) == 0) row.label->setText(row.title + block);
    // What has no effect is not offered; what somebody has typed is not hidden from him.
    const bool shown = item.acts_with.empty() || !row.typed.empty();
    for (QWidget* widget : {static_cast<QWidget*>(row.label), row.editor(), static_cast<QWidget*>(row.si)})
      widget->setVisible(shown);
    decorate(row);
  }
  Q_EMIT changed();
  return {};
}

std::vector<std::string> InputsForm::overrides() const {
  std::vector<std::string> all;
  for (const auto& row : rows_) {
    if (!row->differs) continue;
    // With the unit that is shown, were it still missing.
    const CheckedInput checked = check_input(tree_, table_, row->key, row->typed);
    all.push_back(row->key + "=" + checked.text);
  }
  for (std::string& text : split_overrides(free_->text().toStdString())) all.push_back(std::move(text));
  return all;
}

inputs::Scenario InputsForm::scenario() const {
  std::vector<inputs::Override> all;
  for (const std::string& text : overrides()) all.push_back(inputs::parse_override(text));
  return inputs::read_scenario(tree_, "inputs", all);
}

QString InputsForm::error() const {
  for (const auto& row : rows_) {
    // A bare number would go without the unit that is not shown.
    if (row->differs && !unreadable_.isEmpty()) return unreadable_;
    if (row->differs && !row->error.isEmpty()) return row->error;
  }
  return {};
}

bool InputsForm::differs() const {
  for (const auto& row : rows_) {
    if (row->differs) return true;
  }
  return !free_->text().trimmed().isEmpty();
}

void InputsForm::revert() {
  for (const auto& row : rows_) {
    row->typed.clear();
    row->differs = row->applied = false;
    row->error.clear();
    const auto item = table_.find(row->key);
    row->show(item == table_.end() ? "" : item->second.value);
    row->si->setText(item == table_.end() ? "" : QString::fromStdString(item->second.value_si));
    decorate(*row);
  }
  free_->clear();
  Q_EMIT changed();
  Q_EMIT edited();
}

std::map<std::string, std::string> InputsForm::typed() const {
  std::map<std::string, std::string> texts;
  for (const auto& row : rows_) {
    if (!row->typed.empty()) texts[row->key] = row->typed;
  }
  if (!free_->text().isEmpty()) texts[""] = free_->text().toStdString();
  return texts;
}

void InputsForm::type(const std::map<std::string, std::string>& texts) {
  for (const auto& row : rows_) {
    const auto text = texts.find(row->key);
    if (text == texts.end()) continue;
    if (row->choice != nullptr && row->choice->findText(QString::fromStdString(text->second)) < 0) {
      row->choice->addItem(QString::fromStdString(text->second));
    }
    row->typed = text->second;
    row->differs = true;
    row->applied = false;
    row->show(row->typed);
    check(*row, true);
  }
  if (const auto text = texts.find(""); text != texts.end()) free_->setText(QString::fromStdString(text->second));
  Q_EMIT changed();
}

void InputsForm::decorate(Row& row) const {
  const bool wrong = row.differs && !row.error.isEmpty();
  QFont font = row.label->font();
  font.setBold(row.differs);
  row.label->setFont(font);
  mark_wrong(row.editor(), wrong);
  row.editor()->setToolTip(tooltip(row));
  row.label->setToolTip(row.editor()->toolTip());
}

QString InputsForm::tooltip(const Row& row) const {
  const auto found = table_.find(row.key);
  if (found == table_.end()) return {};
  const InputItem& item = found->second;
  QString text =
      "<p><b>" + QString::fromStdString(row.key) + "</b><br>" + QString::fromStdString(item.meaning).toHtmlEscaped();
  if (!item.unit.empty()) {
    text += "<br>" + tr("Unit: %1, or any other written behind the number.").arg(QString::fromStdString(item.unit));
  }
  text += "<br>" + tr("Allowed: %1").arg(QString::fromStdString(item.allowed).toHtmlEscaped());
  text += "<br>" + tr("This run: %1").arg(QString::fromStdString(item.value).toHtmlEscaped());
  if (!row.error.isEmpty()) {
    text += "<br><span style='color:" + error_color().name() + "'>" + row.error.toHtmlEscaped() + "</span>";
  }
  return text + "</p>";
}

}  // namespace train_derail::rviz_panel
