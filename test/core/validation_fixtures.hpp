// A folder with a small study and table of accidents.
#pragma once

#include <string>

#include "command_line.hpp"
#include "folder.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/validation/validation.hpp"

namespace train_derail::test {

/// Short, quick trains; no run of them lasts longer than 1.5 s of simulated time.
class Validate : public Folder {
 protected:
  void SetUp() override {
    write("scenario.yaml",
          "consist:\n"
          "  - {name: locomotive, count: 1, length: 73 ft, weight: 420 kip}\n"
          "  - {name: hopper, count: 1, length: 55 ft, weight: 286 kip}\n"
          "  - {name: hopper, count: 1, length: 55 ft, weight: 286 kip, brake_source: remote}\n"
          "ground: {on_track_law: rails, off_track_law: by_slip}\n"
          "contact: {law: elastic}\n"
          "initial: {speed: 1, yaw_rate: 0.1}\n"
          "stop: {time_max: 1.5}\n"
          "solver: {method: semi_implicit, fixed_step: 0.002}\n");
    write("study.yaml", kStudy);
    write("table.csv", kTable);
  }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    Folder::write(name, text);
    return folder_ / name;
  }
  study::Study study(const std::string& text = kStudy) {
    return study::read_study_file(write("study.yaml", text).string());
  }
  validation::AccidentTable table(const std::string& text = kTable) {
    return validation::read_accidents(write("table.csv", text).string());
  }
  std::string refusal(const std::string& text) {
    try {
      table(text);
    } catch (const inputs::InputError& e) {
      return e.what();
    }
    return "";
  }

  Result derail(const std::string& arguments) const { return derail_in(folder_, arguments); }

  static const std::string kStudy, kTable;
  int runs_ = 0;
};

inline const std::string Validate::kStudy =
    "title: two inputs\n"
    "scenario: scenario.yaml\n"
    "plan: latin_hypercube\n"
    "samples: 3\n"
    "factors:\n"
    "  - {key: rails.derail_ratio, low: 0.8, high: 1.1}\n"
    "  - {key: ground.in_line_friction, low: 0.15, high: 0.4}\n"
    "perturbation: {kick: 1 ft/s, alignment: 0.02 ft}\n"
    "seed: 7\n";

inline const std::string Validate::kTable =
    "station,speed_mph,n_cars,tons_per_car,head_end_locos,mid_locos,rear_locos,first_car_position,cars_from_pod_to_"
    "rear,cars_derailed\n"
    "ONE,31,6,140.5,2,0,0,2,5,3\n"
    "\"TWO, NORTH\",12.5,5,130,1,0,1,1,5,2\n"
    "THREE,45,8,135,2,1,0,3,6,5\n";

}  // namespace train_derail::test
