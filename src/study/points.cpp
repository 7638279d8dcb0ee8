#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <fmt/format.h>
#include <boost/math/distributions/normal.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/sobol.hpp>
#include <boost/random/uniform_01.hpp>
#include <boost/random/uniform_int_distribution.hpp>

#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

namespace {

/// Mixes the bits of a number, so that consecutive numbers give unrelated results (SplitMix64 by Sebastiano Vigna).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// Returns the value of a factor for the share `u` in (0, 1) of its distribution.
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

void look_at(const std::atomic<bool>* stop) {
  if (stop != nullptr && *stop) throw Stopped();
}

bool by_value(Plan plan) { return plan == Plan::one_at_a_time || plan == Plan::grid; }

/// Points of a Latin hypercube: in each dimension there is one point in each of n strata, in random order.
std::vector<double> latin_hypercube_places(const Study& s, const std::atomic<bool>* stop) {
  boost::random::mt19937_64 generator(mix(static_cast<std::uint64_t>(s.seed)));
  boost::random::uniform_01<double> uniform;
  const auto n = static_cast<std::size_t>(s.samples);
  const std::size_t d = s.factors.size();
  std::vector<double> places(n * d);
  for (std::size_t i = 0; i < d; ++i) {
    look_at(stop);
    std::vector<std::size_t> strata(n);
    std::iota(strata.begin(), strata.end(), std::size_t{0});
    for (std::size_t j = n; j > 1; --j) {  // not std::shuffle, which differs between standard libraries
      std::swap(strata[j - 1], strata[boost::random::uniform_int_distribution<std::size_t>(0, j - 1)(generator)]);
    }
    for (std::size_t j = 0; j < n; ++j) {
      places[j * d + i] = (static_cast<double>(strata[j]) + uniform(generator)) / static_cast<double>(n);
    }
  }
  return places;
}

/// Points of the Sobol sequence in (0, 1)^dimension, shifted by half a cell so that none lies on the border.
std::vector<double> sobol_places(std::size_t count, std::size_t dimension, const std::atomic<bool>* stop) {
  boost::random::sobol generator(dimension);
  constexpr double kCells = 18446744073709551616.0;
  std::vector<double> places(count * dimension);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (i % 65536 == 0) look_at(stop);
    places[i] = std::min((static_cast<double>(generator()) + 0.5) / kCells, 1.0 - 1e-16);
  }
  return places;
}

/// Returns a count as text; it may be too large for an integer.
std::string count_text(long double count) {
  return count < 1e18L ? fmt::format("{}", static_cast<std::int64_t>(count))
                       : fmt::format("{:.3g}", static_cast<double>(count));
}

long double point_count(const Study& s) {
  const auto samples = static_cast<long double>(s.samples);
  switch (s.plan) {
    case Plan::one_at_a_time: {
      long double sum = 1.0L;  // values equal to the base's are left out later
      for (const Factor& f : s.factors) sum += static_cast<long double>(f.values.size());
      return sum;
    }
    case Plan::grid: {
      long double product = 1.0L;
      for (const Factor& f : s.factors) product *= static_cast<long double>(f.values.size());
      return product;
    }
    case Plan::saltelli: return samples * static_cast<long double>(s.factors.size() + 2);
    case Plan::latin_hypercube:
    case Plan::sobol: break;
  }
  return samples;
}

void require_countable(const Study& s) {
  const long double points = point_count(s), runs = points * static_cast<long double>(s.replicates);
  if (runs > static_cast<long double>(kRunsMax)) {
    throw inputs::InputError(
        s.source, s.replicates > 1 && points <= static_cast<long double>(kRunsMax) ? "replicates" : "plan", "",
        fmt::format("{} points with {} runs each are {} runs", count_text(points), s.replicates, count_text(runs)),
        fmt::format("at most {} runs", kRunsMax));
  }
  if (by_value(s.plan)) return;
  const long double numbers = static_cast<long double>(s.samples) * static_cast<long double>(s.factors.size());
  if (numbers > static_cast<long double>(kSampledMax)) {
    throw inputs::InputError(
        s.source, "samples", fmt::format("{}", s.samples),
        fmt::format("{} samples of {} inputs are {} numbers", s.samples, s.factors.size(), count_text(numbers)),
        fmt::format("at most {} numbers", kSampledMax));
  }
}

}  // namespace

Points::Points(const Study& s, const std::atomic<bool>* stop) : plan_(s.plan), factors_(s.factors) {
  require_countable(s);
  for (const Factor& f : factors_) {
    const inputs::KeyValue now = inputs::key_value(s.base, f.key);
    base_.push_back(now.value);
    whole_.push_back(now.whole);
  }
  if (plan_ == Plan::one_at_a_time) {
    for (std::size_t i = 0; i < factors_.size(); ++i) {
      for (std::size_t v = 0; v < factors_[i].values.size(); ++v) {
        // A value equal to the base's would repeat the base.
        if (factors_[i].values[v] != base_[i]) alone_.emplace_back(static_cast<int>(i), static_cast<int>(v));
      }
    }
    size_ = 1 + static_cast<std::int64_t>(alone_.size());
    return;
  }
  size_ = static_cast<std::int64_t>(point_count(s));
  if (plan_ == Plan::grid) return;
  const auto samples = static_cast<std::size_t>(s.samples);
  dimension_ = factors_.size() * (plan_ == Plan::saltelli ? 2 : 1);
  places_ = plan_ == Plan::latin_hypercube ? latin_hypercube_places(s, stop) : sobol_places(samples, dimension_, stop);
}

std::vector<int> Points::choice(std::int64_t i) const {
  std::vector<int> values(factors_.size(), -1);
  if (plan_ == Plan::one_at_a_time) {
    if (i > 0)
      values[static_cast<std::size_t>(alone_[static_cast<std::size_t>(i - 1)].first)] =
          alone_[static_cast<std::size_t>(i - 1)].second;
    return values;
  }
  for (std::size_t f = factors_.size(); f-- > 0;) {  // the last factor changes fastest
    const auto count = static_cast<std::int64_t>(factors_[f].values.size());
    values[f] = static_cast<int>(i % count);
    i /= count;
  }
  return values;
}

Point Points::operator[](std::int64_t i) const {
  Point p;
  const std::size_t d = factors_.size();
  if (by_value(plan_)) {
    const std::vector<int> values = choice(i);
    for (std::size_t f = 0; f < d; ++f)
      p.values.push_back(values[f] < 0 ? base_[f] : factors_[f].values[static_cast<std::size_t>(values[f])]);
    if (plan_ == Plan::one_at_a_time && i > 0) p.factor = alone_[static_cast<std::size_t>(i - 1)].first;
    return p;
  }
  // Plan saltelli: for each sample the points A and B, then A with one factor after the other taken from B.
  const std::size_t stride = plan_ == Plan::saltelli ? d + 2 : 1;
  const std::size_t sample = static_cast<std::size_t>(i) / stride, kind = static_cast<std::size_t>(i) % stride;
  for (std::size_t f = 0; f < d; ++f) {
    const bool of_b = plan_ == Plan::saltelli && (kind == 1 || kind == f + 2);
    std::string value = value_at(factors_[f], places_[sample * dimension_ + f + (of_b ? d : 0)]);
    if (whole_[f]) value = fmt::format("{}", std::llround(files::number<double>(value).value()));  // whole numbers only
    p.values.push_back(std::move(value));
  }
  return p;
}

std::string Points::name(std::int64_t i) const {
  if (!by_value(plan_)) return fmt::format("point {}", i);
  std::string name;
  const std::vector<int> values = choice(i);
  for (std::size_t f = 0; f < factors_.size(); ++f) {
    if (values[f] < 0) continue;
    name += (name.empty() ? "" : "; ") + factors_[f].key + "=" + factors_[f].shown[static_cast<std::size_t>(values[f])];
  }
  return name.empty() ? "base" : name;
}

std::vector<Point> points(const Study& s) {
  const Points made(s);
  std::vector<Point> all;
  for (std::int64_t i = 0; i < made.size(); ++i) all.push_back(made[i]);
  return all;
}

std::int64_t run_count(const Study& s) {
  require_countable(s);
  if (s.plan == Plan::one_at_a_time) return Points(s).size() * s.replicates;
  return static_cast<std::int64_t>(point_count(s)) * s.replicates;
}

std::string why_equal(const inputs::Scenario& s, EngineChoice engine) {
  const inputs::Perturbation& p = s.initial.perturbation;
  int cars = 0;
  for (const inputs::CarBlock& block : s.consist) cars += block.count;
  const bool rails = engine == EngineChoice::purpose_built && s.ground.on_track_law == inputs::OnTrackLaw::rails;
  if ((p.spacing > 0.0 && cars > 1) || (p.yaw_rate > 0.0 && s.initial.yaw_rate != 0.0) ||
      (rails && (p.kick > 0.0 || p.alignment > 0.0))) {
    return "";
  }
  std::string why;
  const auto add = [&](bool given, const char* text) {
    if (given) why += (why.empty() ? "" : ", ") + std::string(text);
  };
  add(p.spacing > 0.0, "spacing needs two cars or more");
  add(p.yaw_rate > 0.0, "yaw_rate multiplies initial.yaw_rate, which is 0");
  add(p.kick > 0.0, "kick needs rails");
  add(p.alignment > 0.0, "alignment needs rails");
  return why.empty() ? "there is no perturbation, neither of the study nor of its scenario" : "perturbation: " + why;
}

std::vector<std::string> check(const Study& s, const std::atomic<bool>* stop) {
  if (s.replicates > 1 && std::any_of(s.factors.begin(), s.factors.end(),
                                      [](const Factor& f) { return f.key == "initial.perturbation.seed"; })) {
    throw inputs::InputError(s.source, "replicates", fmt::format("{}", s.replicates),
                             "the runs of a point cannot differ: initial.perturbation.seed is one of the factors", "1");
  }
  const Points points(s, stop);
  constexpr std::int64_t kLookedAt = 500;
  const std::int64_t stride = std::max<std::int64_t>(1, points.size() / kLookedAt);
  std::int64_t looked_at = 0, equal = 0;
  std::string why, equal_name, refused_name, refusal;
  std::vector<inputs::InputError> refused;
  for (std::int64_t i = 0; i < points.size(); i += stride) {
    look_at(stop);
    ++looked_at;
    try {
      const inputs::Scenario scenario = scenario_of(s, points[i], run_of(s, i * s.replicates));
      if (s.engine == EngineChoice::multibody) multibody::require_parts(scenario, s.source);
      const std::string now = s.replicates > 1 ? why_equal(scenario, s.engine) : "";
      if (!now.empty() && equal++ == 0) {
        why = now;
        equal_name = points.name(i);
      }
    } catch (const inputs::InputError& e) {
      if (refused.empty()) {
        refused_name = points.name(i);
        refusal = e.what();
      }
      refused.push_back(e);
    }
  }
  const auto refused_count = static_cast<std::int64_t>(refused.size());
  if (refused_count == looked_at) {
    const inputs::InputError& e = refused.front();
    if (e.key().empty()) throw inputs::InputError(s.source, "no point of the study can be run", {e});
    throw inputs::InputError(s.source, e.key(), e.value(), "no point of the study can be run: " + e.problem(),
                             e.allowed());
  }
  if (equal > 0 && equal + refused_count == looked_at) {
    throw inputs::InputError(s.source, "replicates", fmt::format("{}", s.replicates),
                             "the runs of a point cannot differ: " + why, "1, or a perturbation that acts");
  }
  std::vector<std::string> warnings;
  const std::string of = fmt::format("of {} points{}", looked_at, stride > 1 ? " looked at" : "");
  if (refused_count > 0)
    warnings.push_back(fmt::format("{} {} will fail: {}: {}", refused_count, of, refused_name, refusal));
  if (equal > 0)
    warnings.push_back(fmt::format("{} {} have runs that cannot differ: {}: {}", equal, of, equal_name, why));
  return warnings;
}

Run run_of(const Study& s, std::int64_t index) {
  const std::uint64_t seed = mix(mix(static_cast<std::uint64_t>(s.seed)) ^ static_cast<std::uint64_t>(index));
  return {index, index / s.replicates, static_cast<int>(index % s.replicates),
          static_cast<std::int64_t>(seed >> 11)};  // 53 bits, so that it is exact as a double too
}

inputs::Scenario scenario_of(const Study& s, const Point& point, const Run& run) {
  std::vector<inputs::Override> overrides;
  for (std::size_t i = 0; i < s.factors.size(); ++i) overrides.push_back({s.factors[i].key, point.values[i]});
  inputs::Scenario base = s.base;
  base.initial.perturbation = s.perturbation;
  base.initial.perturbation.seed = run.seed;
  inputs::Scenario scenario = inputs::with_values(base, overrides);
  inputs::Perturbation& p = scenario.initial.perturbation;
  // Without any perturbation the seed has no effect, and every run would warn of that.
  if (p.seed == run.seed && p.spacing == 0.0 && p.yaw_rate == 0.0 && p.kick == 0.0 && p.alignment == 0.0) p.seed = 0;
  return scenario;
}

}  // namespace train_derail::study
