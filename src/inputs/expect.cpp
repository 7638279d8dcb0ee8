#include "train_derail/inputs/expect.hpp"

#include "train_derail/inputs/error.hpp"

namespace train_derail::inputs {

using files::FileKind;

namespace {

const char* name_of(FileKind kind) {
  switch (kind) {
    case FileKind::scenario: return "a scenario (YAML; derail keys)";
    case FileKind::study: return "a study (YAML; examples: config/studies)";
    case FileKind::accidents: return "a table of accidents (CSV; docs/validation.md)";
    case FileKind::study_results: return "a folder with the results of derail study";
    case FileKind::validation_results: return "a folder with the results of derail validate";
    case FileKind::verification_results: return "a folder with the results of derail verify";
    case FileKind::unknown:
    case FileKind::other: break;
  }
  return "something else";
}

}  // namespace

void expect(FileKind wanted, const std::string& path) {
  const files::Recognised r = files::recognise(path);
  if (r.kind == wanted || r.kind == FileKind::unknown) return;
  if (wanted == FileKind::accidents && r.what == files::kTable) return;
  throw InputError(path, "", "", "is " + r.what + (r.hint.empty() ? "" : " (" + r.hint + ")"), name_of(wanted));
}

}  // namespace train_derail::inputs
