#include "rviz/outcome_table.hpp"

#include <algorithm>

#include "rviz/look.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::rviz_panel {

namespace {

const char* const kNothing = "\u2013";

QString fixed(double value, int digits) { return QString::number(value, 'f', digits); }

}  // namespace

OutcomeTable::OutcomeTable(QWidget* parent) : QWidget(parent), grid_(new QGridLayout(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setHorizontalSpacing(6);
  grid_->setVerticalSpacing(1);
  grid_->setColumnStretch(1, 1);
  grid_->setColumnStretch(2, 1);
  warnings_ = add_wide_row("warnings", "Warnings", "What should be looked at before these numbers are believed.");
  warnings_.value->setWordWrap(true);
  warnings_.value->setTextFormat(Qt::PlainText);
  for (QLabel* label : {warnings_.title, warnings_.value}) set_text_color(label, error_color());
  derailed_ =
      add_wide_row("derailed", "Derailed cars",
                   "Cars whose centre of mass has passed the point of derailment; and cars of which a truck centre has "
                   "been sideways by more than outcome.off_track_threshold.");
  causes_ = add_wide_row(
      "causes", "First truck off",
      "Derailed cars by what took their first truck off the rails: the point of derailment, lateral force, "
      "track torn up by another truck.");
  speed_ = add_row("speed", "Speed, last car", "Of the last car of the train, now.");
  buff_ = add_row("buff", "Peak buff", "Largest compression of a coupler in this run, and which coupler.");
  draft_ = add_row("draft", "Peak draft", "Largest tension of a coupler in this run, and which coupler.");
  broken_ =
      add_wide_row("broken", "Couplers broken", "By draft force, swing angle or moment; ~events says which and when.");
  blockage_ = add_row("blockage", "Blockage force",
                      "Mean buff force on the foremost car on the rails behind the derailed ones.");
  closing_ = add_row("closing", "Closing speed", "Fastest first touch of two cars in this run, and which cars.");
  impacts_ = add_row("impacts", "Impacts",
                     "Of car bodies, at 1 mph and more: how many, and the fastest, at right angles to the surface; "
                     "~impacts lists them.");
  impact_force_ = add_row("impact_force", "Impact force", "Largest of all impacts.");
  pile_up_ = add_row("pile_up", "Pile-up", "Length along the track and width of the cars derailed or off the track.");
  site_ = add_wide_row("site", "Site",
                       "Convex hull of the cars derailed or off the track; of them those at more than 60 degrees to "
                       "the track, and groups of neighbours in the train.");
  spent_ = add_wide_row("spent", "Energy spent",
                        "Of the energy at the start, in per cent: on the ground and by brakes, by couplers "
                        "(damping and breaking), by crushing and friction of bodies.");
  residual_ = add_row("residual", "Energy residual",
                      "What is missing in the energy balance of this run, over the energy at its start.");
  show_accident(nullptr);
}

OutcomeTable::Row OutcomeTable::add_row(const char* name, const char* title, const char* meaning) {
  const int line = grid_->rowCount();
  auto* label = new QLabel(tr(title), this);
  label->setToolTip(tr(meaning));
  const Row row{label, new QLabel(kNothing, this), new QLabel(this)};
  row.value->setObjectName(QString("outcome:") + name);
  row.value->setToolTip(tr(meaning));
  row.value->setTextInteractionFlags(Qt::TextSelectableByMouse);
  make_secondary(row.si);
  grid_->addWidget(label, line, 0);
  grid_->addWidget(row.value, line, 1);
  grid_->addWidget(row.si, line, 2);
  return row;
}

OutcomeTable::Row OutcomeTable::add_wide_row(const char* name, const char* title, const char* meaning) {
  const Row row = add_row(name, title, meaning);
  grid_->removeWidget(row.si);
  grid_->removeWidget(row.value);
  row.si->hide();
  grid_->addWidget(row.value, grid_->rowCount() - 1, 1, 1, 2);
  return row;
}

void OutcomeTable::show_accident(const Outcome* outcome) {
  const Outcome& o = outcome != nullptr ? *outcome : Outcome();
  const auto set = [](const Row& row, bool shown, const QString& value, const QString& si = {}) {
    row.title->setVisible(shown);
    row.value->setVisible(shown);
    row.si->setVisible(shown && !si.isEmpty());
    row.value->setText(value);
    row.si->setText(si);
  };
  QStringList warnings;
  for (const std::string& warning : o.warnings) warnings << QString::fromStdString(warning);
  set(warnings_, !warnings.isEmpty(), warnings.join('\n'));
  const std::uint32_t by_cause = o.derailed_by_pod + o.derailed_by_lateral + o.derailed_by_torn_track;
  set(causes_, by_cause > 0,
      tr("%1 point, %2 lateral, %3 torn track")
          .arg(o.derailed_by_pod)
          .arg(o.derailed_by_lateral)
          .arg(o.derailed_by_torn_track));
  set(broken_, o.couplers_broken > 0, QString::number(o.couplers_broken));
  set(blockage_, o.blockage_force > 0.0, tr("%1 kip").arg(fixed(o.blockage_force / inputs::kKip, 0)),
      tr("%1 kN").arg(fixed(o.blockage_force / 1000.0, 0)));
  set(impacts_, o.impacts > 0, tr("%1, to %2 mph").arg(o.impacts).arg(fixed(o.impact_speed_max / inputs::kMph, 1)),
      tr("%1 m/s").arg(fixed(o.impact_speed_max, 2)));
  set(impact_force_, o.impacts > 0, tr("%1 kip").arg(fixed(o.impact_force_peak / inputs::kKip, 0)),
      tr("%1 kN").arg(fixed(o.impact_force_peak / 1000.0, 0)));
  set(site_, by_cause > 0,
      tr("%1 ft\u00b2 (%2 m\u00b2), across %3, groups %4")
          .arg(fixed(o.pile_up_area / (inputs::kFoot * inputs::kFoot), 0), fixed(o.pile_up_area, 0))
          .arg(o.cars_across)
          .arg(o.groups));
  const double impacts = o.work_impact_normal + o.work_impact_friction;
  const double couplers = o.work_coupler_damping + o.work_coupler_break;
  const auto share = [&](double work) { return fixed(100.0 * work / o.energy_initial, 1); };
  set(spent_, o.energy_initial > 0.0 && (impacts > 0.0 || couplers > 0.0),
      tr("ground %1, brakes %2, couplers %3, impacts %4 %")
          .arg(share(o.work_off_track), share(o.work_on_track), share(couplers), share(impacts)));
}

void OutcomeTable::show_outcome(const NodeView& view) {
  const auto set = [](const Row& row, const QString& value, const QString& si) {
    row.value->setText(value);
    row.si->setText(si);
  };
  const TrainNow& train = view.train;
  if (train.run_id == 0) {
    set(derailed_, kNothing, {});
    set(speed_, kNothing, {});
  } else {
    set(derailed_,
        tr("%1 past the point, %2 off the track, of %3").arg(train.past_pod).arg(train.off_track).arg(train.cars), {});
    set(speed_, tr("%1 mph").arg(fixed(train.speed_last / inputs::kMph, 1)),
        tr("%1 m/s").arg(fixed(train.speed_last, 2)));
  }
  show_accident(view.outcome.get());
  if (!view.outcome) {
    for (const Row& row : {buff_, draft_, closing_, pile_up_, residual_}) set(row, kNothing, {});
    return;
  }
  const Outcome& o = *view.outcome;
  // The outcome comes seldom; between two of them the stream may already have a larger force.
  const auto peak = [&](double known, std::uint32_t coupler, const std::vector<double>& seen) {
    if (o.run_id == view.forces.run_id && !seen.empty()) {
      const auto largest = std::max_element(seen.begin(), seen.end());
      if (*largest > known) {
        known = *largest;
        coupler = static_cast<std::uint32_t>(largest - seen.begin()) + 1;
      }
    }
    const QString where = coupler > 0 ? tr(" at %1").arg(coupler) : QString();
    return std::pair(tr("%1 kip").arg(fixed(known / inputs::kKip, 0)) + where,
                     tr("%1 kN").arg(fixed(known / 1000.0, 0)));
  };
  const auto buff = peak(o.coupler_buff_peak, o.coupler_buff_peak_coupler, view.forces.buff_peak);
  const auto draft = peak(o.coupler_draft_peak, o.coupler_draft_peak_coupler, view.forces.draft_peak);
  set(buff_, buff.first, buff.second);
  set(draft_, draft.first, draft.second);
  if (o.touches == 0) {
    set(closing_, tr("no contact"), {});
  } else {
    set(closing_,
        tr("%1 mph, %2\u2013%3")
            .arg(fixed(o.closing_speed_max / inputs::kMph, 1))
            .arg(o.closing_car_a)
            .arg(o.closing_car_b),
        tr("%1 m/s").arg(fixed(o.closing_speed_max, 2)));
  }
  const auto size = [](double length, double width) {
    return QString("%1 \u00d7 %2 ").arg(fixed(length, 0), fixed(width, 0));
  };
  set(pile_up_, size(o.pile_up_length / inputs::kFoot, o.pile_up_width / inputs::kFoot) + "ft",
      size(o.pile_up_length, o.pile_up_width) + "m");
  set(residual_, o.energy_residual == 0.0 ? QString("0") : QString::number(o.energy_residual, 'e', 1), {});
}

}  // namespace train_derail::rviz_panel
