#include "rviz/view_buttons.hpp"

#include <limits>

#include <QHBoxLayout>
#include <QKeySequence>

#include <rviz/render_panel.h>
#include <rviz/view_manager.h>

namespace train_derail::rviz_panel {

namespace {

const char* const kViewClass = "train_derail/WreckView";

QKeySequence key_of(std::size_t i) { return {Qt::Key_F5 + static_cast<int>(i)}; }

}  // namespace

ViewButtons::ViewButtons(QWidget* parent)
    : QWidget(parent), node_("train_derail"), car_(new QSpinBox(this)), posture_(new QToolButton(this)) {
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(2);
  for (std::size_t i = 0; i < kShows; ++i) {
    auto* button = buttons_[i] = new QToolButton(this);
    const ShowFacts& facts = kShowFacts[i];
    button->setObjectName(QString("view:") + facts.choice);
    button->setText(tr(facts.button));
    button->setToolTip(tr("Show %1 (%2)").arg(tr(facts.meaning), key_of(i).toString()));
    button->setCheckable(true);
    connect(button, &QToolButton::clicked, this, [this, i] { show_what(static_cast<Show>(i)); });
    row->addWidget(button);
  }
  car_->setObjectName("view:car number");
  car_->setToolTip(tr("Number of the car, from 1"));
  car_->setKeyboardTracking(false);
  set_cars(0);
  connect(car_, QOverload<int>::of(&QSpinBox::valueChanged), this, [this](int number) {
    if (watched_) watched_->set_car(number);
  });
  row->addWidget(car_);
  posture_->setObjectName("colours:posture");
  posture_->setText(tr("Posture"));
  posture_->setToolTip(
      tr("Colour the cars by how they lie, not by why they left the track (%1)").arg(key_of(kShows).toString()));
  posture_->setCheckable(true);
  connect(posture_, &QToolButton::clicked, this,
          [this](bool wanted) { Q_EMIT colours_wanted(wanted ? scene::Colours::posture : scene::Colours::cause); });
  row->addWidget(posture_);
  row->addStretch();
  show_colours({});
}

ViewButtons::~ViewButtons() {
  for (const QPointer<QShortcut>& key : keys_) delete key.data();
  delete posture_key_.data();
}

void ViewButtons::set_view_manager(rviz::ViewManager* views) {
  views_ = views;
  // Of RViz's window, not of this widget: that may be behind another tab.
  QWidget* window = views->getRenderPanel()->window();
  for (std::size_t i = 0; i < kShows; ++i) {
    keys_[i] = new QShortcut(key_of(i), window, nullptr, nullptr, Qt::ApplicationShortcut);
    connect(keys_[i], &QShortcut::activated, this, [this, i] { show_what(static_cast<Show>(i)); });
  }
  posture_key_ = new QShortcut(key_of(kShows), window, nullptr, nullptr, Qt::ApplicationShortcut);
  connect(posture_key_, &QShortcut::activated, posture_, &QToolButton::click);
  connect(views, &rviz::ViewManager::currentChanged, this, &ViewButtons::watch_view);
  watch_view();
}

void ViewButtons::set_node(const QString& node) {
  node_ = node;
  if (watched_) watched_->set_node(node);
}

void ViewButtons::set_cars(int cars) { car_->setRange(1, cars > 0 ? cars : std::numeric_limits<short>::max()); }

void ViewButtons::show_colours(std::optional<scene::Colours> colours) {
  posture_->setEnabled(colours.has_value());
  posture_->setChecked(colours == scene::Colours::posture);
}

void ViewButtons::show_what(Show show) {
  if (!views_) return;
  if (!watched_) views_->setCurrentViewControllerType(kViewClass);  // then it is watched
  if (!watched_) return;
  watched_->set_node(node_);
  watched_->set_car(car_->value());
  watched_->show_what(show);
  mark();
}

void ViewButtons::watch_view() {
  if (watched_) disconnect(watched_, nullptr, this, nullptr);
  watched_ = qobject_cast<WreckView*>(views_ ? views_->getCurrent() : nullptr);
  if (watched_) connect(watched_, &WreckView::shown_changed, this, &ViewButtons::mark);
  mark();
}

void ViewButtons::mark() {
  for (std::size_t i = 0; i < kShows; ++i) {
    buttons_[i]->setChecked(watched_ && watched_->shown() == static_cast<Show>(i));
  }
}

}  // namespace train_derail::rviz_panel
