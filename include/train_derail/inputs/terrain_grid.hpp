/// \file
/// The heights of a TerrainGrid as numbers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string_view>

#include "train_derail/files/number.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// Calls `take(word, number)` for each word of a row, from right to left across the track; `number` is empty if it is
/// none.
template <class Take>
void each_height(std::string_view row, Take take) {
  constexpr std::string_view kBlanks = " \t\n";
  for (std::size_t begin = 0; (begin = row.find_first_not_of(kBlanks, begin)) != std::string_view::npos;) {
    const std::size_t end = std::min(row.find_first_of(kBlanks, begin), row.size());
    const std::string_view word = row.substr(begin, end - begin);
    take(word, files::number<double>(word));
    begin = end;
  }
}

}  // namespace train_derail::inputs
