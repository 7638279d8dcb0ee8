// How well predicted counts of cars match real ones. NaN where a sample is too small to say.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace train_derail::validation {

struct Score {
  std::size_t count = 0;
  double mean_absolute_error = 0.0;
  double bias = 0.0;  // mean of predicted - real
  double root_mean_square_error = 0.0;
  double r2 = 0.0;  // 1 - sum of squared errors / sum of squares about the mean of the real ones
};
/// Rows whose prediction is NaN do not count.
Score score(const std::vector<double>& real, const std::vector<double>& predicted);

/// Of intervals [low, high].
struct Coverage {
  double share = 0.0;       // of the real counts that lie in theirs, ends included
  double mean_width = 0.0;  // cars
};
Coverage coverage(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& high);

/// Continuous ranked probability score of an ensemble: mean |member - real| - mean |member - other member| / 2, in cars
/// (Gneiting and Raftery 2007; over pairs of different members, so that it does not depend on their number, Ferro
/// 2014). It is least for the distribution that the real counts are drawn from. NaN members do not count; one alone:
/// its absolute error; none: NaN.
double crps(double real, const std::vector<double>& members);

/// Intervals that hold what a model lacks as well: stretched about their median by the factor that the share `wanted`
/// of other real counts would have needed (conformal prediction, Vovk et al. 2005; one car is added to either half:
/// counts are whole).
struct Stretched {
  double factor = 0.0;            // from all rows
  std::vector<double> low, high;  // with that factor; not below 0
  Coverage held_out;              // five folds, row i in fold i mod 5, each stretched by the factor of the other four
};
Stretched stretch(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& median,
                  const std::vector<double>& high, double wanted);

/// Mean of some speeds. Edges every 5 mph; from 10 mph on they belong to the band below, as in published tables (10-15,
/// 16-20, ...).
struct SpeedBand {
  double from = 0.0, to = 0.0;  // mph
  std::size_t count = 0;
  double speed = 0.0;  // mean [mph]
  double real = 0.0, real_sd = 0.0, predicted = 0.0;
  double error = 0.0;  // predicted / real - 1
};
std::vector<SpeedBand> by_speed(const std::vector<double>& mph, const std::vector<double>& real,
                                const std::vector<double>& predicted);

/// b of count ~ a speed^b by least squares of the logarithms; counts that are not positive do not count.
double speed_exponent(const std::vector<double>& mph, const std::vector<double>& count);

/// What the rows alone can say.
enum class FitKind {
  straight_line,  // count ~ 1, speed
  linear,         // count ~ 1, speed, tail, tons
  log_log,        // log count ~ 1, log speed, log tail, log tons
};
inline constexpr FitKind kFitKinds[]{FitKind::straight_line, FitKind::linear, FitKind::log_log};

/// How a fit is called.
struct FitText {
  std::string_view name;   ///< in files
  std::string_view title;  ///< in tables
  std::string_view terms;  ///< its equation
};
/// By the value of FitKind.
inline constexpr std::array<FitText, 3> kFitTexts{
    {{"straight_line", "straight line in speed", "cars = c0 + c1 mph"},
     {"linear", "linear in speed, tail, tons", "cars = c0 + c1 mph + c2 tail + c3 tons"},
     {"log_log", "log-log in speed, tail, tons", "ln cars = c0 + c1 ln mph + c2 ln tail + c3 ln tons"}}};
inline const FitText& text_of(FitKind kind) { return kFitTexts[static_cast<std::size_t>(kind)]; }
inline std::string to_string(FitKind kind) { return std::string(text_of(kind).name); }

/// The inputs of a fit, row by row: mph, cars from the first derailed one to the rear, short tons a car.
struct FitInputs {
  std::vector<double> speed, tail, tons;
};

struct Fit {
  FitKind kind;
  std::vector<double> coefficients;  // in the order above; empty if the rows do not determine them
  std::vector<double> fitted;        // at the rows it was made from [cars]
  std::vector<double> left_out;      // at each row, made from all the others [cars]
};
/// Ordinary least squares.
Fit fit(FitKind kind, const FitInputs& inputs, const std::vector<double>& real);

}  // namespace train_derail::validation
