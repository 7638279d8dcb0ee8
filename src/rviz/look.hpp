// Colours and small marks that the parts of the panel share.
#pragma once

#include <QColor>
#include <QLabel>
#include <QPalette>
#include <QString>
#include <QVBoxLayout>
#include <QWidget>

#include "train_derail/scene/marks.hpp"

namespace train_derail::rviz_panel {

inline QColor error_color() { return {0xc0, 0x1c, 0x28}; }
inline QColor good_color() { return {0x1a, 0x7f, 0x37}; }
inline QColor waiting_color() { return {0x9a, 0x67, 0x00}; }
inline QColor to_color(const scene::Rgb& c) { return {c.r, c.g, c.b}; }
inline QColor buff_color() { return to_color(scene::kBuffLine.colour); }
inline QColor draft_color() { return to_color(scene::kDraftLine.colour); }
inline QColor now_color() { return {0x30, 0x30, 0x30}; }
inline QColor quiet_color() { return {0x6a, 0x6a, 0x6a}; }

inline void set_text_color(QWidget* widget, const QColor& color) {
  QPalette palette = widget->palette();
  palette.setColor(QPalette::Active, QPalette::WindowText, color);
  palette.setColor(QPalette::Inactive, QPalette::WindowText, color);
  widget->setPalette(palette);
}

/// What stands beside the main thing: the SI value, an explanation.
inline void make_secondary(QLabel* label) { set_text_color(label, quiet_color()); }

/// Lets a label that wraps its text be narrow: one whose text can be selected asks for its longest line at times.
inline void let_wrap(QLabel* label) {
  label->setWordWrap(true);
  label->setMinimumWidth(1);
}

/// A line for what is said now and then, hidden until then.
inline QLabel* make_message(const QString& name, QWidget* parent) {
  auto* label = new QLabel(parent);
  label->setObjectName(name);
  label->setTextFormat(Qt::PlainText);
  label->setTextInteractionFlags(Qt::TextSelectableByMouse);
  let_wrap(label);
  label->hide();
  return label;
}

/// Parts of the panel below each other.
inline QVBoxLayout* make_column(QWidget* box) {
  auto* column = new QVBoxLayout(box);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(3);
  return column;
}

/// Without repeating what is so already: that draws anew.
inline void enable(QWidget* widget, bool enabled) {
  if (widget->isEnabledTo(widget->parentWidget()) != enabled) widget->setEnabled(enabled);
}

inline void mark_wrong(QWidget* editor, bool wrong) {
  QPalette palette;  // the application's
  if (wrong) {
    palette.setColor(QPalette::Base, {0xff, 0xe3, 0xe3});
    palette.setColor(QPalette::Text, error_color());
  }
  editor->setPalette(palette);
}

}  // namespace train_derail::rviz_panel
