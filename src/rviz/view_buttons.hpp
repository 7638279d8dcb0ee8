// Buttons and keys for what the 3D view shows.
#pragma once

#include <array>
#include <optional>

#include <QPointer>
#include <QShortcut>
#include <QSpinBox>
#include <QString>
#include <QToolButton>
#include <QWidget>

#include "rviz/wreck_view.hpp"
#include "train_derail/scene/palette.hpp"

namespace rviz {
class ViewManager;
}

namespace train_derail::rviz_panel {

/// A row of buttons, one for each thing that a WreckView shows, the number of the car for the last, and one for what
/// the colours of the cars say. F5 to F10 press them, wherever the focus is. Whatever view is the current one is
/// replaced by a WreckView.
class ViewButtons : public QWidget {
  Q_OBJECT

 public:
  explicit ViewButtons(QWidget* parent = nullptr);
  ~ViewButtons() override;

  /// To be called once, when RViz has a window. Until then the buttons do nothing.
  void set_view_manager(rviz::ViewManager* views);
  /// Name of the simulation's node, for the views that the buttons make.
  void set_node(const QString& node);
  /// Number of cars in the train; 0 if not known.
  void set_cars(int cars);
  /// What the colours of the cars say; none: not known, so that they cannot be changed.
  void show_colours(std::optional<scene::Colours> colours);

 Q_SIGNALS:
  /// The user wants these.
  void colours_wanted(train_derail::scene::Colours colours);

 private:
  void show_what(Show show);
  void watch_view();
  void mark();

  QPointer<rviz::ViewManager> views_;
  QPointer<WreckView> watched_;
  QString node_;
  std::array<QToolButton*, kShows> buttons_{};
  std::array<QPointer<QShortcut>, kShows> keys_;
  QSpinBox* car_;
  QToolButton* posture_;
  QPointer<QShortcut> posture_key_;
};

}  // namespace train_derail::rviz_panel
