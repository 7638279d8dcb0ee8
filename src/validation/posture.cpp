#include "train_derail/validation/posture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/study/statistics.hpp"

namespace train_derail::validation {

namespace {

constexpr std::array<double, 6> kEdges{0.0, 10.0, 20.0, 30.0, 40.0, inputs::kInfinity};  // mph

std::vector<PostureCount> between(const std::vector<PostureCount>& all, double from, double to) {
  std::vector<PostureCount> some;
  std::copy_if(all.begin(), all.end(), std::back_inserter(some),
               [&](const PostureCount& c) { return c.speed_mph > from && c.speed_mph <= to; });
  return some;
}

}  // namespace

PostureShares shares(const std::vector<PostureCount>& counts) {
  PostureShares s;
  double cars = 0.0, over = 0.0, none = 0.0, all = 0.0;
  std::vector<double> each;
  for (const PostureCount& c : counts) {
    if (c.cars < kPostureCarsMin) continue;
    cars += c.cars;
    over += c.over;
    none += c.over == 0 ? 1.0 : 0.0;
    all += c.over == c.cars ? 1.0 : 0.0;
    each.push_back(static_cast<double>(c.over) / c.cars);
  }
  s.count = each.size();
  const auto n = static_cast<double>(s.count);
  s.over = over / cars;
  s.none_over = none / n;
  s.all_over = all / n;
  s.sd = study::spread(std::move(each)).sd;
  return s;
}

std::vector<PostureBand> by_band(const std::vector<PostureCount>& real, const std::vector<PostureCount>& predicted) {
  std::vector<PostureBand> bands;
  const auto add = [&](double from, double to) {
    const PostureBand b{from, to, shares(between(real, from, to)), shares(between(predicted, from, to))};
    if (b.real.count > 0) bands.push_back(b);
  };
  for (std::size_t i = 0; i + 1 < kEdges.size(); ++i) add(kEdges[i], kEdges[i + 1]);
  add(kEdges.front(), kEdges.back());
  return bands;
}

std::string to_table(const std::vector<PostureBand>& bands) {
  std::string text = fmt::format(
      "\nCars on their side or over, of the derailed; accidents and members with {} derailed cars or more\n"
      "    {:>10}{:>11}{:>8}{:>6}{:>8}{:>7}{:>11}{:>6}{:>8}{:>7}\n",
      kPostureCarsMin, "mph", "accidents", "share", "sd", "none", "all", "predicted", "sd", "none", "all");
  const auto percent = [](double share) { return std::isnan(share) ? "-" : fmt::format("{:.0f} %", 100.0 * share); };
  const auto plain = [](double share) { return std::isnan(share) ? "-" : fmt::format("{:.2f}", share); };
  for (const PostureBand& b : bands) {
    const bool open = std::isinf(b.to);
    const std::string mph = open && b.from == 0.0 ? "all"
                            : open                ? fmt::format("> {:.0f}", b.from)
                                                  : fmt::format("{:.0f}-{:.0f}", b.from + 1.0, b.to);
    text += fmt::format("    {:>10}{:>11}{:>8}{:>6}{:>8}{:>7}{:>11}{:>6}{:>8}{:>7}\n", mph, b.real.count,
                        plain(b.real.over), plain(b.real.sd), percent(b.real.none_over), percent(b.real.all_over),
                        plain(b.predicted.over), plain(b.predicted.sd), percent(b.predicted.none_over),
                        percent(b.predicted.all_over));
  }
  return text;
}

}  // namespace train_derail::validation
