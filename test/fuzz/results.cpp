// A folder of results that is read back, one of its files being another than was written. The first byte chooses the
// file.
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/report.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/summary.hpp"

using namespace train_derail;
namespace fs = std::filesystem;

namespace {

struct Results {
  Results()
      : study(study::read_study_text(
            "scenario: baseline.yaml\nplan: grid\n"
            "factors: [{key: initial.speed, values: [5, 8]}, {key: title, values: [a, 'b, \"c\"']}]\n"
            "outcomes: [cars_off_track, stop_time]\nreplicates: 2\nperturbation: {spacing: 3 mm}\n",
            FUZZ_SOURCE_DIR "/../../config/input.yaml")) {
    for (auto& block : study.base.consist) block.count = 2;
    study.base.stop.time_max = 0.5;
    const std::atomic<bool> stop{false};
    study::run_study(
        study, {written.string(), 1, false, {}}, [](const study::Progress&) {}, stop);
    study::write_results(written.string(), study, 0.0);
  }
  study::Study study;
  fs::path written = fuzz::folder() / "written";
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Results results;
  static const char* const files[] = {"journal.csv", "about.json", "study.json", "summary.csv", "runs.csv"};
  if (size == 0) return 0;
  const fs::path folder = fuzz::folder() / "changed";
  fs::remove_all(folder);
  fs::copy(results.written, folder);
  const auto refusable = [](auto call) { fuzz::may_refuse<std::runtime_error>(call); };
  fuzz::write(folder / files[data[0] % 5], fuzz::text_of(data + 1, size - 1));
  refusable([&] { study::report_document(folder.string()); });
  refusable([&] { study::claim_folder(folder.string(), study::to_json(results.study)); });
  refusable([&] { study::to_table(folder.string(), results.study); });
  refusable([&] {
    const study::Journal journal(folder.string(), study::journal_format(results.study), {}, true,
                                 [](const study::JournalRow&) {});
    for (const std::string& problem : journal.problems()) fuzz::expect_readable(problem);
  });
  refusable([&] { study::gather(folder.string(), {results.written.string()}, results.study); });
  refusable([&] { study::write_results(folder.string(), results.study, 0.0); });
  refusable([&] { study::report_document(folder.string()); });
  return 0;
}
