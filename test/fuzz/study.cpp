// A study's file; its scenario lies beside it.
#include "train_derail/study/study.hpp"
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::may_refuse<inputs::InputError>([&] {
    const study::Study study =
        study::read_study_text(fuzz::text_of(data, size), FUZZ_SOURCE_DIR "/../../config/studies/input.yaml");
    study::to_json(study);
    const study::Points points(study);
    fuzz::expect(points.size() > 0, "no points");
    for (const std::int64_t i : {std::int64_t{0}, points.size() - 1}) {
      points.name(i);
      fuzz::may_refuse<inputs::InputError>(
          [&] { study::scenario_of(study, points[i], study::run_of(study, i * study.replicates)); });
    }
  });
  return 0;
}
