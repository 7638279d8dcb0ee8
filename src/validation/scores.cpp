#include "train_derail/validation/scores.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Dense>

#include "train_derail/study/statistics.hpp"

namespace train_derail::validation {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Eigen::MatrixXd design(FitKind kind, const FitInputs& in) {
  const auto column = [](const std::vector<double>& v) {
    return Eigen::Map<const Eigen::ArrayXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const auto rows = static_cast<Eigen::Index>(in.speed.size());
  Eigen::MatrixXd x = Eigen::MatrixXd::Ones(rows, kind == FitKind::straight_line ? 2 : 4);
  x.col(1) = column(in.speed);
  if (kind != FitKind::straight_line) {
    x.col(2) = column(in.tail);
    x.col(3) = column(in.tons);
  }
  if (kind == FitKind::log_log) x.rightCols(3) = x.rightCols(3).array().log().matrix().eval();
  return x;
}

/// Sum of the distances of all pairs, each pair once.
double sum_over_pairs(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) sum += (2.0 * static_cast<double>(i) + 1.0 - n) * values[i];
  return sum;
}

}  // namespace

Score score(const std::vector<double>& real, const std::vector<double>& predicted) {
  Score s{0, kNone, kNone, kNone, kNone};
  double absolute = 0.0, sum = 0.0, squares = 0.0, mean = 0.0, about = 0.0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (std::isnan(predicted[i])) continue;
    const double error = predicted[i] - real[i];
    ++s.count;
    absolute += std::abs(error);
    sum += error;
    squares += error * error;
    const double from_mean = real[i] - mean;  // mean and sum of squares by Welford's method
    mean += from_mean / static_cast<double>(s.count);
    about += from_mean * (real[i] - mean);
  }
  if (s.count == 0) return s;
  const auto n = static_cast<double>(s.count);
  s.mean_absolute_error = absolute / n;
  s.bias = sum / n;
  s.root_mean_square_error = std::sqrt(squares / n);
  if (about > 0.0) s.r2 = 1.0 - squares / about;
  return s;
}

Coverage coverage(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& high) {
  double inside = 0.0, width = 0.0, n = 0.0;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (std::isnan(low[i]) || std::isnan(high[i])) continue;
    n += 1.0;
    width += high[i] - low[i];
    if (low[i] <= real[i] && real[i] <= high[i]) inside += 1.0;
  }
  return n > 0.0 ? Coverage{inside / n, width / n} : Coverage{kNone, kNone};
}

double crps(double real, const std::vector<double>& members, const std::vector<std::string>& strata) {
  std::vector<double> all;
  std::map<std::string, std::vector<double>> of;
  double away = 0.0;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (std::isnan(members[i])) continue;
    all.push_back(members[i]);
    of[strata.empty() ? "" : strata[i]].push_back(members[i]);
    away += std::abs(members[i] - real);
  }
  if (all.empty()) return kNone;
  const auto n = static_cast<double>(all.size());
  double apart = sum_over_pairs(std::move(all));
  for (auto& [stratum, some] : of) {
    const auto m = static_cast<double>(some.size());
    if (m > 1.0) apart += sum_over_pairs(std::move(some)) / (m - 1.0);
  }
  return away / n - apart / (n * n);
}

namespace {

constexpr std::size_t kFolds = 5;

/// Returns the factor by which the interval must be stretched so that it just holds the count.
double factor_needed(double real, double low, double median, double high) {
  return real >= median ? (real - median) / (high - median + 1.0) : (median - real) / (median - low + 1.0);
}

}  // namespace

Stretched stretch(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& median,
                  const std::vector<double>& high, double wanted) {
  const auto factor_of = [&](const auto& counts) {
    std::vector<double> needed;
    for (std::size_t i = 0; i < real.size(); ++i) {
      if (counts(i) && !std::isnan(median[i])) needed.push_back(factor_needed(real[i], low[i], median[i], high[i]));
    }
    if (needed.empty()) return kNone;
    std::sort(needed.begin(), needed.end());
    // The row to be predicted is one more than there are; hence the share of n + 1.
    return study::quantile(needed, std::min(wanted * (1.0 + 1.0 / static_cast<double>(needed.size())), 1.0));
  };
  const auto apply = [&](double factor, std::size_t i, double& from, double& to) {
    from = std::max(median[i] - factor * (median[i] - low[i] + 1.0), 0.0);
    to = median[i] + factor * (high[i] - median[i] + 1.0);
  };
  Stretched s;
  s.factor = factor_of([](std::size_t) { return true; });
  s.low.resize(real.size());
  s.high.resize(real.size());
  std::vector<double> from(real.size()), to(real.size());
  for (std::size_t fold = 0; fold < kFolds; ++fold) {
    const double factor = factor_of([fold](std::size_t i) { return i % kFolds != fold; });
    for (std::size_t i = fold; i < real.size(); i += kFolds) apply(factor, i, from[i], to[i]);
  }
  for (std::size_t i = 0; i < real.size(); ++i) apply(s.factor, i, s.low[i], s.high[i]);
  s.held_out = coverage(real, from, to);
  return s;
}

std::vector<SpeedBand> by_speed(const std::vector<double>& mph, const std::vector<double>& real,
                                const std::vector<double>& predicted) {
  constexpr double kStep = 5.0, kFirstClosed = 10.0;
  std::map<double, std::vector<std::size_t>> bands;
  for (std::size_t i = 0; i < mph.size(); ++i) {
    if (std::isnan(predicted[i])) continue;
    const double band = mph[i] <= kFirstClosed ? std::floor(mph[i] / kStep) : std::ceil(mph[i] / kStep) - 1.0;
    bands[kStep * band].push_back(i);
  }
  std::vector<SpeedBand> out;
  for (const auto& [from, rows] : bands) {
    std::vector<double> speeds, reals, predictions;
    for (const std::size_t i : rows) {
      speeds.push_back(mph[i]);
      reals.push_back(real[i]);
      predictions.push_back(predicted[i]);
    }
    const study::Spread r = study::spread(reals);
    const double p = study::spread(predictions).mean;
    out.push_back({from, from + kStep, rows.size(), study::spread(speeds).mean, r.mean, r.sd, p, p / r.mean - 1.0});
  }
  return out;
}

double speed_exponent(const std::vector<double>& mph, const std::vector<double>& count) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < mph.size(); ++i) {
    if (!(count[i] > 0.0)) continue;
    const double u = std::log(mph[i]), v = std::log(count[i]);
    n += 1.0;
    const double du = u - x;  // running means and sums about them
    x += du / n;
    xx += du * (u - x);
    y += (v - y) / n;
    xy += du * (v - y);
  }
  return xx > 1e-12 * n ? xy / xx : kNone;
}

Fit fit(FitKind kind, const FitInputs& inputs, const std::vector<double>& real) {
  Fit f{kind, {}, std::vector<double>(real.size(), kNone), std::vector<double>(real.size(), kNone)};
  const Eigen::MatrixXd x = design(kind, inputs);
  if (x.rows() < x.cols()) return f;
  const auto rows = static_cast<Eigen::Index>(real.size());
  Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(real.data(), rows);
  const bool logarithms = kind == FitKind::log_log;
  if (logarithms) y = y.array().log().matrix().eval();

  // Columns are scaled to the same size, so that the units do not influence the rank.
  const Eigen::RowVectorXd size = x.colwise().norm();
  if (size.minCoeff() == 0.0) return f;
  const Eigen::MatrixXd scaled = x.array().rowwise() / size.array();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  if (qr.rank() < x.cols()) return f;
  const Eigen::VectorXd b = qr.solve(y).cwiseQuotient(size.transpose());
  f.coefficients.assign(b.data(), b.data() + b.size());

  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(x.rows(), x.cols());
  const Eigen::VectorXd at = x * b;
  for (Eigen::Index i = 0; i < rows; ++i) {
    // If row i is left out, its residual grows by 1 / (1 - leverage). A row that alone determines a coefficient has
    // leverage 1.
    const double leverage = q.row(i).squaredNorm();
    const double out = leverage < 1.0 - 1e-9 ? y[i] - (y[i] - at[i]) / (1.0 - leverage) : kNone;
    f.fitted[static_cast<std::size_t>(i)] = logarithms ? std::exp(at[i]) : at[i];
    f.left_out[static_cast<std::size_t>(i)] = logarithms ? std::exp(out) : out;
  }
  return f;
}

}  // namespace train_derail::validation
