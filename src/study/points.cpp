#include <algorithm>
#include <cmath>
#include <numeric>

#include <boost/math/distributions/normal.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/sobol.hpp>
#include <boost/random/uniform_01.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

namespace {

/// Sebastiano Vigna's SplitMix64: decorrelates consecutive numbers.
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// A place in (0, 1) of a factor's distribution as its value.
std::string value_at(const Factor& f, double u) {
  switch (f.distribution) {
    case Distribution::uniform: return fmt::format("{}", f.low + u * (f.high - f.low));
    case Distribution::log_uniform: return fmt::format("{}", f.low * std::pow(f.high / f.low, u));
    case Distribution::normal: {
      const double z95 = boost::math::quantile(boost::math::normal(), 0.95);
      const boost::math::normal n(0.5 * (f.low + f.high), 0.5 * (f.high - f.low) / z95);
      return fmt::format("{}", boost::math::quantile(n, u));
    }
  }
  return {};
}

Point point_at(const Study& s, const std::vector<double>& place) {
  Point p;
  for (std::size_t i = 0; i < s.factors.size(); ++i) p.values.push_back(value_at(s.factors[i], place[i]));
  return p;
}

std::vector<Point> one_at_a_time(const Study& s) {
  Point base;
  for (const Factor& f : s.factors) base.values.push_back(inputs::key_value(s.base, f.key).value);
  std::vector<Point> points{base};
  for (std::size_t i = 0; i < s.factors.size(); ++i) {
    for (const std::string& value : s.factors[i].values) {
      if (value == base.values[i]) continue;  // the base stands for it
      Point p = base;
      p.values[i] = value;
      p.factor = static_cast<int>(i);
      points.push_back(p);
    }
  }
  return points;
}

std::vector<Point> grid(const Study& s) {
  std::vector<Point> points{Point{}};
  for (const Factor& f : s.factors) {
    std::vector<Point> longer;
    for (const Point& p : points) {
      for (const std::string& value : f.values) {
        longer.push_back(p);
        longer.back().values.push_back(value);
      }
    }
    points.swap(longer);
  }
  return points;
}

std::vector<Point> latin_hypercube(const Study& s) {
  boost::random::mt19937_64 generator(mix(static_cast<std::uint64_t>(s.seed)));
  boost::random::uniform_01<double> uniform;
  const auto n = static_cast<std::size_t>(s.samples);
  std::vector<std::vector<double>> places(n, std::vector<double>(s.factors.size()));
  for (std::size_t i = 0; i < s.factors.size(); ++i) {
    std::vector<std::size_t> strata(n);
    std::iota(strata.begin(), strata.end(), std::size_t{0});
    for (std::size_t j = n; j > 1; --j) {  // std::shuffle differs between libraries
      std::swap(strata[j - 1], strata[boost::random::uniform_int_distribution<std::size_t>(0, j - 1)(generator)]);
    }
    for (std::size_t j = 0; j < n; ++j) {
      places[j][i] = (static_cast<double>(strata[j]) + uniform(generator)) / static_cast<double>(n);
    }
  }
  std::vector<Point> points;
  for (const auto& place : places) points.push_back(point_at(s, place));
  return points;
}

/// Sobol points in (0, 1)^dimension, shifted by half a cell so that none lies on the border.
std::vector<std::vector<double>> sobol_places(std::size_t count, std::size_t dimension) {
  boost::random::sobol generator(dimension);
  constexpr double kCells = 18446744073709551616.0;
  std::vector<std::vector<double>> places(count, std::vector<double>(dimension));
  for (auto& place : places) {
    for (double& u : place) u = std::min((static_cast<double>(generator()) + 0.5) / kCells, 1.0 - 1e-16);
  }
  return places;
}

std::vector<Point> sobol(const Study& s) {
  std::vector<Point> points;
  for (const auto& place : sobol_places(static_cast<std::size_t>(s.samples), s.factors.size())) {
    points.push_back(point_at(s, place));
  }
  return points;
}

/// For each sample A, B, then A with one factor after the other taken from B.
std::vector<Point> saltelli(const Study& s) {
  const std::size_t d = s.factors.size();
  std::vector<Point> points;
  for (const auto& place : sobol_places(static_cast<std::size_t>(s.samples), 2 * d)) {
    const Point a = point_at(s, {place.begin(), place.begin() + static_cast<std::ptrdiff_t>(d)});
    const Point b = point_at(s, {place.begin() + static_cast<std::ptrdiff_t>(d), place.end()});
    points.push_back(a);
    points.push_back(b);
    for (std::size_t i = 0; i < d; ++i) {
      points.push_back(a);
      points.back().values[i] = b.values[i];
    }
  }
  return points;
}

}  // namespace

std::vector<Point> points(const Study& s) {
  std::vector<Point> all;
  switch (s.plan) {
    case Plan::one_at_a_time: all = one_at_a_time(s); break;
    case Plan::grid: all = grid(s); break;
    case Plan::latin_hypercube: all = latin_hypercube(s); break;
    case Plan::sobol: all = sobol(s); break;
    case Plan::saltelli: all = saltelli(s); break;
  }
  if (s.plan == Plan::one_at_a_time || s.plan == Plan::grid) return all;
  for (std::size_t i = 0; i < s.factors.size(); ++i) {  // counts of cars have nothing in between
    if (!inputs::key_value(s.base, s.factors[i].key).whole) continue;
    for (Point& p : all) p.values[i] = fmt::format("{}", std::llround(std::stod(p.values[i])));
  }
  return all;
}

Run run_of(const Study& s, std::int64_t index) {
  const std::uint64_t seed = mix(mix(static_cast<std::uint64_t>(s.seed)) ^ static_cast<std::uint64_t>(index));
  return {index, index / s.replicates, static_cast<int>(index % s.replicates),
          static_cast<std::int64_t>(seed >> 11)};  // exact as a double too
}

inputs::Scenario scenario_of(const Study& s, const Point& point, const Run& run) {
  std::vector<inputs::Override> overrides;
  for (std::size_t i = 0; i < s.factors.size(); ++i) overrides.push_back({s.factors[i].key, point.values[i]});
  inputs::Scenario base = s.base;
  base.initial.perturbation = s.perturbation;
  base.initial.perturbation.seed = run.seed;
  return inputs::with_values(base, overrides);
}

}  // namespace train_derail::study
