// A train list.
#include "train_derail/inputs/train_list.hpp"
#include "fuzz.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

using namespace train_derail;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path path = fuzz::folder() / "train.csv";
  fuzz::write(path, fuzz::text_of(data, size));
  fuzz::may_refuse<inputs::InputError>([&] {
    inputs::TrainList train = inputs::read_train_list(path.string(), inputs::car_types(), inputs::Coupler{}.length);
    for (const std::string& a : train.assumptions) fuzz::expect_readable(files::printable(a));
    const std::string text = inputs::to_scenario(train, "train.csv", "");
    const inputs::Scenario s = inputs::read_scenario(inputs::load_text(text, "written"), "written");
    fuzz::expect(s.consist.size() == train.blocks.size(), "another train is read than was written:\n" + text);
  });
  return 0;
}
