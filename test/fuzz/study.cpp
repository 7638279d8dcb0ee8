// A study's file; its scenario lies beside it.
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/study/study.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::may_refuse<inputs::InputError>([&] {
    const study::Study study = study::read_study_text(fuzz::text_of(data, size), FUZZ_SOURCE_DIR "/../../config/studies/input.yaml");
    study::to_json(study);
    const std::vector<study::Point> points = study::points(study);
    fuzz::expect(!points.empty(), "no points");
    for (const study::Point* p : {&points.front(), &points.back()}) {
      const std::int64_t index = (p - points.data()) * study.replicates;
      fuzz::may_refuse<inputs::InputError>([&] { study::scenario_of(study, *p, study::run_of(study, index)); });
    }
  });
  return 0;
}
