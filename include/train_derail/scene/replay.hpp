/// \file
/// A run as it will be shown again in a page: a document in JSON that holds all that the page needs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/scene/event_detector.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::scene {

/// Most numbers of one kind that a Replay keeps, cars times moments. A longer run is thinned: every second moment goes.
inline constexpr std::size_t kReplayValuesMax = 250'000;

/// What a run is called.
struct ReplayNames {
  std::string title;    ///< stands for a scenario without a title
  std::string caption;  ///< one of several runs in a page, "run 2"; may be empty if there is one run
};

/// Keeps a run, moment by moment, as whole numbers of small steps. Memory does not grow beyond kReplayValuesMax
/// numbers of each kind, however long the run is and however many cars it has.
class Replay {
 public:
  /// `cars` are those of `scenario`.
  Replay(const inputs::Scenario& scenario, const std::vector<model::Car>& cars);

  /// Adds a moment, later than all before, and what has happened since the last one.
  void add(const simulation::Snapshot& now, const std::vector<Occurrence>& events);

  /// Returns the document of the run: one object of JSON with `title`, `caption`, `inputs` (YAML), `outcome` (rows of
  /// the table), `fields` (names, units, titles, meanings of what is in `channels`), `cars`, `shapes` and `track`
  /// (triangles), `looks`, `lies`, `forces`, `lines`, `marks`, `event_colours` (colours and sizes), `times` [s],
  /// `channels` (whole numbers of `step` for each moment and car or coupler; for each car its Look, then its Lie; for
  /// each moment the Heap), `events`, `touches`.
  std::string document(const ReplayNames& names, const outcome::Outcome& outcome,
                       const std::vector<outcome::FirstTouch>& touches) const;

 private:
  void append(const simulation::Snapshot& now);
  void thin();

  const inputs::Scenario scenario_;
  const std::vector<model::Car> cars_;
  std::vector<double> times_;
  std::vector<std::vector<std::int32_t>> channels_;  // each moment by moment, car by car
  std::size_t stride_ = 1, skipped_ = 0;             // moments from one that is kept to the next
  simulation::Snapshot last_;                        // with the largest forces since the last moment that is kept
  bool pending_ = false;                             // last_ is not kept yet
  std::vector<Occurrence> events_;
};

/// What a page says above its runs.
struct ReplayPage {
  std::string title;               ///< of several runs
  std::vector<std::string> notes;  ///< paragraphs: what the runs are, how they were chosen
};
/// Returns what the template `replay` takes: the documents of one run or of several, in their order.
std::string page_document(const ReplayPage& page, const std::vector<std::string>& runs);

}  // namespace train_derail::scene
