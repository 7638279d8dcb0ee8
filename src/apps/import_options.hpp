// What the import of a track and that of a terrain read alike.
#pragma once

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::apps {

/// A length of at least `least` [m]. Throws inputs::InputError.
inline double length_of(const char* option, const std::string& text, double least) {
  double length = 0.0;
  try {
    length = inputs::to_si(text, "m");
  } catch (const std::invalid_argument& e) {
    throw inputs::InputError("command line", option, text, e.what(), "a length, as in \"5 km\"");
  }
  if (!(length >= least && length <= 1e5))
    throw inputs::InputError("command line", option, text, "out of range", fmt::format("[{}, 100000] m", least));
  return length;
}

/// Longitude and latitude, if a text is a place. Throws inputs::InputError.
inline std::optional<std::pair<double, double>> place_of(const std::string& text) {
  const auto comma = text.find(',');
  if (comma == std::string::npos) return std::nullopt;
  const std::string_view all(text);
  const auto longitude = files::number<double>(files::trimmed(all.substr(0, comma))),
             latitude = files::number<double>(files::trimmed(all.substr(comma + 1)));
  if (!longitude || !latitude || !(std::abs(*longitude) <= 180.0) || !(std::abs(*latitude) <= 85.0)) {
    throw inputs::InputError("command line", "--derail-at", text, "not a place",
                             "longitude,latitude in degrees, [-180, 180] and [-85, 85], as in \"-80.52,40.83\"");
  }
  return std::pair(*longitude, *latitude);
}

}  // namespace train_derail::apps
