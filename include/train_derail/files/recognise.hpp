/// \file
/// Finds out what kind of file or folder a path is, so that an error can name it ("is a study, not a scenario").
#pragma once

#include <string>

namespace train_derail::files {

/// What a file or folder seems to be.
enum class FileKind {
  unknown,  ///< some other text, or a path that does not exist: its reader decides
  scenario,
  study,
  accidents,  ///< a table of accidents, for `derail validate`
  study_results,
  validation_results,
  verification_results,
  other,  ///< something that no command takes
};

/// The answer of recognise().
struct Recognised {
  FileKind kind = FileKind::unknown;  ///< what it is
  std::string what;                   ///< the same in words, "a study", "a bag of messages"; empty if unknown
  std::string hint;                   ///< which command takes it, "derail study takes it"; empty if none does
};

/// Recognised::what of a page that `derail report` has written.
inline constexpr char kReport[] = "a report of derail";
/// Recognised::what of a table whose columns are none of those that this program knows.
inline constexpr char kTable[] = "a table (CSV)";
/// Text in the head of such a page, by which it is recognised.
inline constexpr char kReportMark[] = "<meta name=\"generator\" content=\"train_derail\" />";

/// Judges a file by its first 64 KiB and a folder by the names of the files in it. Pipes and devices are not opened,
/// since that could wait for ever.
Recognised recognise(const std::string& path);

}  // namespace train_derail::files
