#pragma once

#include <optional>

namespace imprint {

/// A blurred step fitted to grey values along a line.
struct StepFit {
  double position = 0.0;    ///< in samples from the first value
  double blur = 0.0;        ///< standard deviation of the blur, pixel area included, in samples
  double outside = 0.0;     ///< level before the step
  double step = 0.0;        ///< level after it less that before
  double residual = 0.0;    ///< standard deviation of the values about the fit
  double sigma_unit = 0.0;  ///< standard deviation of the position for a noise of 1
};

/// Least-squares fit of outside + step Phi((i - position)/blur) to `count` values: the most likely position under white
/// noise. `blur` is fitted too when `free_blur`, else kept. Nothing when it does not settle near `start`.
std::optional<StepFit> fit_step(const float* values, int count, double start, double blur, bool free_blur);

/// The position, in samples, at which the second central derivative of `values` passes zero near `start`, from a line
/// fitted to its slope between its two extremes ([C] 2.3.2 and [38] there). `lag`: samples in a central difference's
/// arm.
std::optional<double> zero_crossing(const float* values, int count, double start, int lag);

}  // namespace imprint
