#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>
#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QTimer>
#include <QWidget>

#include "rviz/input_table.hpp"

namespace train_derail::rviz_panel {

/// The main inputs: those of the run, until somebody types something else for the next one.
class InputsForm : public QWidget {
  Q_OBJECT

 public:
  explicit InputsForm(QWidget* parent = nullptr);

  /// `yaml`: the scenario of the run that is under way. What was typed and differs from it stays. Returns why it cannot
  /// be shown; empty if it is.
  QString show_run(const std::string& yaml);
  /// "key=value" for each input that differs from the run's, and the free ones.
  std::vector<std::string> overrides() const;
  /// The scenario of the next run. Throws inputs::InputError.
  inputs::Scenario scenario() const;
  /// That of the run that is under way; null: not known.
  std::shared_ptr<const inputs::Scenario> of_run() const { return of_run_; }
  /// Why the inputs cannot stand so; empty if they can.
  QString error() const;
  /// Whether the next run would be another one.
  bool differs() const;
  /// Back to the inputs of the run.
  void revert();

  /// By key: what was typed, whether a run has it already or not; the free ones by the key "".
  std::map<std::string, std::string> typed() const;
  void type(const std::map<std::string, std::string>& texts);

 Q_SIGNALS:
  void changed();    // the inputs, or what is wrong with them
  void edited();     // by the user
  void submitted();  // by the user, with Enter

 private:
  struct Row {
    std::string key;
    QString title;
    QLabel* label = nullptr;
    QLineEdit* edit = nullptr;  // one of the two
    QComboBox* choice = nullptr;
    QLabel* si = nullptr;
    std::string typed;     // by the user; empty: nothing
    bool differs = false;  // typed, and not what the run has
    bool applied = false;  // a run has had what was typed
    QString error;

    QWidget* editor() const { return edit != nullptr ? static_cast<QWidget*>(edit) : choice; }
    void show(const std::string& text) const;
  };

  void add_row(const char* key, const char* label, bool is_choice);
  void on_typed(Row& row, const QString& text);
  void check(Row& row, bool complete);
  void decorate(Row& row) const;
  QString tooltip(const Row& row) const;

  std::vector<std::unique_ptr<Row>> rows_;
  QLineEdit* free_;
  QTimer check_later_;
  YAML::Node tree_;   // of the run's scenario; null: no run known yet
  InputTable table_;  // of the same
  std::shared_ptr<const inputs::Scenario> of_run_;
  QString unreadable_;  // why the inputs of the run that is under way cannot be shown; empty if they are
};

}  // namespace train_derail::rviz_panel
