#include "model/part.hpp"

#include <string>

namespace train_derail::model {

namespace {

void walk_peak(files::Archive& archive, const char* name, Peak& peak) {
  archive.group(name, [&] {
    archive.value("force", peak.force);
    archive.value("coupler", peak.coupler);
    archive.value("time", peak.time);
  });
}

}  // namespace

void Record::walk(files::Archive& archive) {
  for (const EnergyTerm& term : kEnergyTerms) archive.value(term.name, spent.*term.term);
  archive.list("derailments", incidents.derailments, [&](Derailment& d) {
    archive.value("time", d.time);
    archive.value("car", d.car);
    archive.value("front", d.front);
    archive.value("cause", d.cause);
    archive.value("x", d.x);
    archive.value("y", d.y);
  });
  archive.list("tie_runs", incidents.tie_runs, [&](TieRun& r) {
    archive.value("car", r.car);
    archive.value("front", r.front);
    archive.value("time", r.time);
    archive.value("distance", r.distance);
    archive.value("obstacles", r.obstacles);
    archive.value("end_time", r.end_time);
    archive.value("end", r.end);
  });
  archive.list("broken", incidents.broken, [&](BrokenCoupler& b) {
    archive.value("time", b.time);
    archive.value("coupler", b.coupler);
    archive.value("by", b.by);
    archive.value("axial_force", b.axial_force);
  });
  archive.list("impacts", incidents.impacts, [&](Impact& i) {
    archive.value("time", i.time);
    archive.value("end", i.end);
    archive.value("car_a", i.car_a);
    archive.value("car_b", i.car_b);
    archive.value("face_a", i.face_a);
    archive.value("face_b", i.face_b);
    archive.value("along_a", i.along_a);
    archive.value("along_b", i.along_b);
    archive.value("x", i.x);
    archive.value("y", i.y);
    archive.value("z", i.z);
    archive.value("closing_speed", i.closing_speed);
    archive.value("closing_speed_normal", i.closing_speed_normal);
    archive.value("impulse", i.impulse);
    archive.value("peak_force", i.peak_force);
  });
  walk_peak(archive, "buff", incidents.buff);
  walk_peak(archive, "draft", incidents.draft);
  archive.value("blockage_impulse", incidents.blockage_impulse);
  archive.value("blockage_peak", incidents.blockage_peak);
  archive.value("blockage_time", incidents.blockage_time);
  archive.value("overlap_max", incidents.overlap_max);
}

}  // namespace train_derail::model
