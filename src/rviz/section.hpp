#pragma once

#include <QHBoxLayout>
#include <QToolButton>
#include <QVBoxLayout>
#include <QWidget>

namespace train_derail::rviz_panel {

/// A part of the panel under a caption; a click on the caption folds it up.
class Section : public QWidget {
  Q_OBJECT

 public:
  /// `name`: of the caption's button, "section:NAME".
  Section(const char* name, const QString& caption, QWidget* parent);

  /// Takes the widget that is folded.
  void set_content(QWidget* content);
  /// Takes a widget that stands to the right of the caption while the part is open.
  void set_corner(QWidget* corner);
  bool is_open() const;
  void set_open(bool open);

 Q_SIGNALS:
  void clicked();  // by the user; is_open() is what he wants

 private:
  QToolButton* caption_;
  QWidget *content_ = nullptr, *corner_ = nullptr;
  QHBoxLayout* line_;
  QVBoxLayout* column_;
};

}  // namespace train_derail::rviz_panel
