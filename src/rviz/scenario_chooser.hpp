#pragma once

#include <QComboBox>
#include <QString>
#include <QStringList>

namespace train_derail::rviz_panel {

/// The scenarios that can be run: that of the run on top, files that were chosen lately, the package's presets, any
/// other file. Says which file is chosen; what becomes of it is not its business.
class ScenarioChooser : public QComboBox {
  Q_OBJECT

 public:
  static constexpr int kRecentMax = 10;

  explicit ScenarioChooser(QWidget* parent = nullptr);

  /// Title of the scenario of the run.
  void show_title(const QString& title);
  /// Files that were chosen lately, the last one first.
  QStringList recent() const { return recent_; }
  void set_recent(const QStringList& paths);
  /// Puts a file on top of these.
  void remember(const QString& path);

 Q_SIGNALS:
  void chosen(const QString& path);

 private:
  void fill();
  void add_caption(const QString& text);
  void add_file(const QString& title, const QString& path);
  void open_file();

  QString title_;
  QStringList recent_;
};

}  // namespace train_derail::rviz_panel
