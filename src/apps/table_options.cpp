#include "table_options.hpp"

#include <cmath>
#include <stdexcept>
#include <string_view>

#include <fmt/ranges.h>

#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::apps {

namespace {

using inputs::InputError;

std::vector<int> car_numbers(const std::string& text, int count) {
  const auto refuse = [&](const std::string& problem) {
    throw InputError("command line", "--cars", text, problem,
                     fmt::format("numbers and ranges from 1 to {}, as in \"1-20,50\"", count));
  };
  std::vector<int> cars;
  for (std::string_view rest = text; !rest.empty();) {
    const auto comma = rest.find(',');
    const std::string_view item = rest.substr(0, comma);
    rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
    const auto dash = item.find('-');
    const auto from = files::number<int>(files::trimmed(item.substr(0, dash)));
    const auto to = dash == std::string_view::npos ? from : files::number<int>(files::trimmed(item.substr(dash + 1)));
    if (!from || !to) refuse(fmt::format("'{}' is not a number or range", item));
    if (*from < 1 || *to > count || *from > *to) refuse(fmt::format("'{}': the train has {} cars", item, count));
    for (int car = *from; car <= *to; ++car) cars.push_back(car);
  }
  if (cars.empty()) refuse("no car");
  return cars;
}

}  // namespace

void TableOptions::add_to(CLI::App* command) {
  command->add_option("--every", every,
                      "With --csv: one state in this time, as in \"0.1 s\", a multiple of output.interval; peaks are "
                      "those of the whole time");
  command->add_option("--cars", cars, "With --csv: only these cars, as in \"1-20,50\"");
  command
      ->add_option("--columns", columns,
                   "With --csv: only these columns, as in x_m,y_m,buff_peak_N (derail fields); time_s and car are "
                   "always there")
      ->delimiter(',');
}

simulation::TableChoice TableOptions::choice(const inputs::Scenario& scenario) const {
  int count = 0;
  for (const inputs::CarBlock& block : scenario.consist) count += block.count;
  const std::vector<int> chosen = cars ? car_numbers(*cars, count) : std::vector<int>();
  try {
    return simulation::TableChoice(columns, chosen);
  } catch (const std::invalid_argument& e) {
    throw InputError("command line", "--columns", fmt::format("{}", fmt::join(columns, ",")), e.what(),
                     "names of docs/outcomes.md with their units (derail fields)");
  }
}

std::int64_t TableOptions::steps(const inputs::Scenario& scenario) const {
  if (!every) return 1;
  const double interval = scenario.output.interval;
  const auto refuse = [&](const std::string& problem, const std::string& allowed) {
    throw InputError("command line", "--every", *every, problem, allowed);
  };
  double time = 0.0;
  try {
    time = inputs::to_si(*every, "s");
  } catch (const std::invalid_argument& e) {
    refuse(e.what(), "a time, as in \"0.1 s\"");
  }
  const double steps = std::round(time / interval);
  constexpr double kRounding = 1e-6, kMost = 1e9;
  if (!(steps >= 1.0 && steps <= kMost) || std::abs(time / interval - steps) > kRounding * steps) {
    const double below = std::max(1.0, std::floor(std::min(time / interval, kMost)));
    refuse(fmt::format("not a multiple of output.interval, {} s", interval),
           fmt::format("{:.6g} s, {:.6g} s, ... or another output.interval (--set)", below * interval,
                       (below + 1.0) * interval));
  }
  return static_cast<std::int64_t>(steps);
}

}  // namespace train_derail::apps
