// What a path given to a command seems to be, so that a wrong one is told by name.
#pragma once

#include <string>

namespace train_derail::files {

enum class Kind {
  unknown,  // text of some kind, or a name that does not exist: for its reader to judge
  scenario,
  study,
  accidents,  // a table for `derail validate`
  study_results,
  validation_results,
  verification_results,
  other,  // something that no command takes
};

struct Recognised {
  Kind kind = Kind::unknown;
  std::string what;  ///< "a study", "a bag of messages"; empty if unknown
  std::string hint;  ///< what takes it, as in "derail study takes it"; empty if nothing does
};

/// `what` of a page that `derail report` has written.
inline constexpr char kReport[] = "a report of derail";
/// In the head of such a page.
inline constexpr char kReportMark[] = "<meta name=\"generator\" content=\"train_derail\" />";

/// By its first 64 kB or, if it is a folder, by the names in it. Waits for nothing: pipes and devices are not opened.
Recognised recognise(const std::string& path);

}  // namespace train_derail::files
