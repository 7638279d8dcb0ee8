/// \file
/// Scores: how well predicted counts of derailed cars match the real ones. A value is NaN if there are too few rows for
/// it. Vectors have one element for each row, in the same order, if nothing else is said.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace train_derail::validation {

/// Errors of predicted counts.
struct Score {
  std::size_t count = 0;                ///< rows that were compared
  double mean_absolute_error = 0.0;     ///< [cars]
  double bias = 0.0;                    ///< mean of predicted - real [cars]
  double root_mean_square_error = 0.0;  ///< [cars]
  double r2 = 0.0;                      ///< 1 - sum of squared errors / sum of squares about the real mean [-]
};
/// Scores predicted counts against real ones. Rows whose prediction is NaN are left out.
Score score(const std::vector<double>& real, const std::vector<double>& predicted);

/// How intervals for the counts performed.
struct Coverage {
  double share = 0.0;       ///< share of the real counts that lie in their interval, ends included [-]
  double mean_width = 0.0;  ///< mean of high - low [cars]
};
/// Compares real counts with their intervals [low, high]. Rows with a NaN end are left out.
Coverage coverage(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& high);

/// Returns the continuous ranked probability score of an ensemble [cars]: mean |member - real| less half the mean of
/// |member - other member| (Gneiting and Raftery 2007). The second mean is over pairs of different members, so that the
/// score does not depend on their number (Ferro 2014). On average it is least if the members come from the same
/// distribution as the real counts. NaN members are left out. With one member it is the absolute error, with none NaN.
/// `strata`: name of the distribution that each member is a draw of, such as a way in which accidents begin, each
/// with a share of the members that is not left to chance: then only of the same one must two be different. A stratum
/// of one member counts as if all of it were alike. Empty: all are draws of one.
double crps(double real, const std::vector<double>& members, const std::vector<std::string>& strata = {});

/// Intervals that were made wider, or narrower, so that they hold the wanted share of the real counts. In this way they
/// also cover what the model does not know (conformal prediction, Vovk et al. 2005).
struct Stretched {
  double factor = 0.0;      ///< factor from all rows
  std::vector<double> low,  ///< lower ends with that factor, at least 0 [cars]
      high;                 ///< upper ends with that factor [cars]
  Coverage held_out;        ///< five folds, row i in fold i mod 5: each is stretched by the factor of the other four
};
/// Stretches intervals [low, high] about their medians. Each half is made one car longer, since counts are whole
/// numbers, and then multiplied by the factor that the share `wanted` of the real counts needs at least.
Stretched stretch(const std::vector<double>& real, const std::vector<double>& low, const std::vector<double>& median,
                  const std::vector<double>& high, double wanted);

/// Means over the rows of one range of speeds. The edges are 5 mph apart. An edge above 10 mph belongs to the band
/// below it, as in published tables (10-15, 16-20, ...).
struct SpeedBand {
  double from = 0.0,      ///< lower edge [mph]
      to = 0.0;           ///< upper edge [mph]
  std::size_t count = 0;  ///< number of rows
  double speed = 0.0;     ///< mean speed [mph]
  double real = 0.0,      ///< mean of the real counts [cars]
      real_sd = 0.0,      ///< standard deviation of the real counts [cars]
      predicted = 0.0;    ///< mean of the predicted counts [cars]
  double error = 0.0;     ///< predicted / real - 1 [-]
};
/// Returns the bands that have rows, by rising speed. Rows whose prediction is NaN are left out.
std::vector<SpeedBand> by_speed(const std::vector<double>& mph, const std::vector<double>& real,
                                const std::vector<double>& predicted);

/// Returns the exponent b of count = a speed^b, by least squares of the logarithms. Counts that are not positive are
/// left out.
double speed_exponent(const std::vector<double>& mph, const std::vector<double>& count);

/// Statistical models that are fitted to the rows, to compare the simulation with.
enum class FitKind {
  straight_line,  ///< count = a + b speed
  linear,         ///< count = a + b speed + c tail + d tons
  log_log,        ///< log count = a + b log speed + c log tail + d log tons
};
/// All models.
inline constexpr FitKind kFitKinds[]{FitKind::straight_line, FitKind::linear, FitKind::log_log};

/// The texts of a model.
struct FitText {
  std::string_view name;   ///< name in files
  std::string_view title;  ///< name in tables
  std::string_view terms;  ///< its equation
};
/// The texts of all models, by the value of FitKind.
inline constexpr std::array<FitText, 3> kFitTexts{
    {{"straight_line", "straight line in speed", "cars = c0 + c1 mph"},
     {"linear", "linear in speed, tail, tons", "cars = c0 + c1 mph + c2 tail + c3 tons"},
     {"log_log", "log-log in speed, tail, tons", "ln cars = c0 + c1 ln mph + c2 ln tail + c3 ln tons"}}};
/// Returns the texts of a model.
inline const FitText& text_of(FitKind kind) { return kFitTexts[static_cast<std::size_t>(kind)]; }
/// Returns the name of a model in files.
inline std::string to_string(FitKind kind) { return std::string(text_of(kind).name); }

/// The inputs of a fit, one element for each row.
struct FitInputs {
  std::vector<double> speed,  ///< speed of the train [mph]
      tail,                   ///< cars from the first derailed one to the rear
      tons;                   ///< weight of a car [short tons]
};

/// A statistical model that was fitted to the rows.
struct Fit {
  FitKind kind;                      ///< which model
  std::vector<double> coefficients;  ///< a, b, c, d of FitKind; empty if the rows do not determine them
  std::vector<double> fitted;        ///< its counts at the rows it was fitted to [cars]
  std::vector<double> left_out;      ///< count at each row, of the model fitted to all other rows [cars]
};
/// Fits a model by ordinary least squares.
Fit fit(FitKind kind, const FitInputs& inputs, const std::vector<double>& real);

}  // namespace train_derail::validation
