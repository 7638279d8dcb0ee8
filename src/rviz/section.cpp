#include "rviz/section.hpp"

namespace train_derail::rviz_panel {

Section::Section(const char* name, const QString& caption, QWidget* parent)
    : QWidget(parent), caption_(new QToolButton(this)), line_(new QHBoxLayout), column_(new QVBoxLayout(this)) {
  column_->setContentsMargins(0, 0, 0, 0);
  column_->setSpacing(2);
  caption_->setObjectName(QString("section:") + name);
  caption_->setText(caption);
  caption_->setCheckable(true);
  caption_->setChecked(true);
  caption_->setAutoRaise(true);
  caption_->setArrowType(Qt::DownArrow);
  caption_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  caption_->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  caption_->setStyleSheet("QToolButton { border: none; font-weight: bold; text-align: left; padding: 1px; }");
  caption_->setIconSize(QSize(10, 10));
  line_->addWidget(caption_);
  column_->addLayout(line_);
  connect(caption_, &QToolButton::clicked, this, [this](bool open) {
    set_open(open);
    Q_EMIT clicked();
  });
}

void Section::set_content(QWidget* content) {
  content_ = content;
  column_->addWidget(content, 1);
  set_open(is_open());
}

void Section::set_corner(QWidget* corner) {
  corner_ = corner;
  line_->addWidget(corner);
  set_open(is_open());
}

bool Section::is_open() const { return caption_->isChecked(); }

void Section::set_open(bool open) {
  caption_->setChecked(open);
  caption_->setArrowType(open ? Qt::DownArrow : Qt::RightArrow);
  for (QWidget* widget : {content_, corner_}) {
    if (widget != nullptr) widget->setVisible(open);
  }
}

}  // namespace train_derail::rviz_panel
