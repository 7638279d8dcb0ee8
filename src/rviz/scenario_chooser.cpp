#include "rviz/scenario_chooser.hpp"

#include <ros/package.h>
#include <QAbstractItemView>
#include <QFileDialog>
#include <QFileInfo>
#include <QStandardItemModel>

#include "rviz/scenario_files.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr char kPackage[] = "train_derail";
constexpr char kOther[] = ":open";  // data of the entry that is no file

/// The folder of the presets; empty if the package is not found.
std::string config_folder() {
  const std::string package = ::ros::package::getPath(kPackage);
  return package.empty() ? package : package + "/config";
}

}  // namespace

ScenarioChooser::ScenarioChooser(QWidget* parent) : QComboBox(parent) {
  setObjectName("scenario");
  setFocusPolicy(Qt::StrongFocus);
  setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  setMinimumContentsLength(20);
  setMaxVisibleItems(30);
  fill();
  connect(this, QOverload<int>::of(&QComboBox::activated), this, [this](int index) {
    const QString path = itemData(index).toString();
    setCurrentIndex(0);
    if (path == kOther) open_file();
    else if (!path.isEmpty()) Q_EMIT chosen(path);
  });
}

void ScenarioChooser::show_title(const QString& title) {
  if (title == title_) return;
  title_ = title;
  setItemText(0, title_);
  setToolTip(tr("The scenario of this run: %1.\nChoose another one to run it.").arg(title_));
}

void ScenarioChooser::set_recent(const QStringList& paths) {
  recent_ = paths.mid(0, kRecentMax);
  fill();
}

void ScenarioChooser::remember(const QString& path) {
  recent_.removeAll(path);
  recent_.prepend(path);
  set_recent(recent_);
}

void ScenarioChooser::fill() {
  const QSignalBlocker quiet(this);
  clear();
  addItem(title_);
  add_file(tr("Open file\u2026"), kOther);
  if (!recent_.isEmpty()) add_caption(tr("Chosen lately"));
  for (const QString& path : recent_) add_file(QFileInfo(path).fileName(), path);
  const std::string config = config_folder();
  for (const auto& [caption, folder] :
       {std::pair(tr("Presets"), config), std::pair(tr("Accidents"), config + "/accidents")}) {
    if (config.empty()) break;
    add_caption(caption);
    for (const ScenarioFile& file : scenario_files(folder)) {
      const QString path = QString::fromStdString(file.path);
      add_file(QString("%1  \u2013  %2").arg(QString::fromStdString(file.title), QFileInfo(path).fileName()), path);
    }
  }
  setCurrentIndex(0);
  // The list may be wider than the panel.
  view()->setMinimumWidth(view()->sizeHintForColumn(0) + 40);
}

void ScenarioChooser::add_caption(const QString& text) {
  insertSeparator(count());
  addItem(text);
  QStandardItem* const item = static_cast<QStandardItemModel*>(model())->item(count() - 1);
  item->setFlags(Qt::NoItemFlags);
  QFont bold = font();
  bold.setBold(true);
  item->setFont(bold);
}

void ScenarioChooser::add_file(const QString& title, const QString& path) {
  addItem(title, path);
  if (path != kOther) setItemData(count() - 1, path, Qt::ToolTipRole);
}

void ScenarioChooser::open_file() {
  const QString folder =
      recent_.isEmpty() ? QString::fromStdString(config_folder()) : QFileInfo(recent_.front()).path();
  auto* dialog = new QFileDialog(this, tr("Open a scenario"), folder, tr("Scenarios (*.yaml *.yml);;All files (*)"));
  dialog->setObjectName("open_scenario");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setFileMode(QFileDialog::ExistingFile);
  connect(dialog, &QFileDialog::fileSelected, this, &ScenarioChooser::chosen);
  dialog->open();
}

}  // namespace train_derail::rviz_panel
