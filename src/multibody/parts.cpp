/// \file
/// Which scenarios the multibody engine computes.
#include <vector>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/multibody/engine.hpp"

namespace train_derail::multibody {

namespace {

/// A key that asks for a part which the engine has not.
struct Missing {
  std::string key, value, allowed;
};

std::vector<Missing> missing_in_the_plane(const inputs::Scenario& s) {
  std::vector<Missing> missing;
  for (const inputs::PartOn& part : inputs::parts_beyond_the_paper(s))
    missing.push_back({part.key, part.value, "the paper's model alone: leave it out"});
  return missing;
}

class MissingInSpace {
 public:
  explicit MissingInSpace(const inputs::Scenario& s) : scenario_(s) {
    consist();
    forces();
    ground_and_track();
    start();
  }
  const std::vector<Missing>& list() const { return list_; }

 private:
  /// If it acts at all in this scenario.
  void refuse_if(bool has, const std::string& key, const char* allowed) {
    if (!has) return;
    const inputs::KeyValue found = inputs::key_value(scenario_, key);
    if (found.acts_with.empty()) list_.push_back({key, found.value, allowed});
  }
  void refuse_items(std::size_t count, const char* key) {
    if (count > 0) list_.push_back({key, fmt::format("{} item{}", count, count == 1 ? "" : "s"), "[]"});
  }

  void consist() {
    for (std::size_t i = 0; i < scenario_.consist.size(); ++i)
      refuse_if(scenario_.consist[i].shape != inputs::BodyShape::box, fmt::format("consist[{}].shape", i), "box");
  }
  void forces() {
    const inputs::Scenario& s = scenario_;
    refuse_if(s.brakes.law != inputs::BrakeLaw::air, "brakes.law", "air");
    refuse_if(s.traction.law != inputs::TractionLaw::none, "traction.law", "none");
    refuse_if(s.ties.law != inputs::TieLaw::none, "ties.law", "none");
    refuse_if(s.rails.load_exponent != 1.0, "rails.load_exponent", "1");
    refuse_if(s.ground.load_exponent != 1.0, "ground.load_exponent", "1");
  }
  void ground_and_track() {
    const inputs::Scenario& s = scenario_;
    refuse_items(s.track.curves.size(), "track.curves");
    refuse_items(s.track.grades.size(), "track.grades");
    refuse_items(s.terrain.sections.size(), "terrain.sections");
    refuse_items(s.terrain.grid.rows.size(), "terrain.grid.rows");
    refuse_items(s.ground.patches.size(), "ground.patches");
  }
  void start() {
    const inputs::InitialMotion& start = scenario_.initial;
    refuse_if(start.mechanism != inputs::Mechanism::broken_rail, "initial.mechanism", "broken_rail");
  }

  const inputs::Scenario& scenario_;
  std::vector<Missing> list_;
};

}  // namespace

void require_parts(const inputs::Scenario& scenario, const std::string& where) {
  const std::vector<Missing> missing = inputs::model_of(scenario) == inputs::Model::spatial
                                           ? MissingInSpace(scenario).list()
                                           : missing_in_the_plane(scenario);
  if (missing.empty()) return;
  constexpr char kProblem[] = "the multibody engine has no such part";
  std::vector<inputs::InputError> each;
  for (const Missing& m : missing) each.emplace_back(where, m.key, m.value, kProblem, m.allowed);
  if (each.size() == 1) throw inputs::InputError(each.front());
  throw inputs::InputError(where, fmt::format("the multibody engine lacks {} parts of it", each.size()), each);
}

}  // namespace train_derail::multibody
