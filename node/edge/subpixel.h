#pragma once

#include <optional>
#include <span>

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

/// How a body's brightness goes on behind its rim: a blurred step, and a rise with the square root of the depth, which
/// is how any law of limb darkening begins on a round body (the cosine of the angle of view grows as that root).
struct EdgeShape {
  double blur = 1.0;  ///< standard deviation of the blur, pixel area included, in samples
  double rise = 0.0;  ///< share of the step, per root of a sample
};

/// An edge's grey values at z = (i - position)/blur, for a step of 1: the step with its rise, its slope along z, and a
/// change by 1 per blur of the level inside and of the level outside, blurred like the step.
struct EdgeProfile {
  double value, by_z;
  double ramp_inside, ramp_outside;
};
EdgeProfile edge_profile(double z, const EdgeShape& shape);

/// Least-squares fit of outside + step Phi((i - position)/blur) to `count` values: the most likely position under white
/// noise. `blur` is fitted too when `free_blur`, else kept. Nothing when it does not settle near `start`.
std::optional<StepFit> fit_step(const float* values, int count, double start, double blur, bool free_blur);
/// The same for a step of known shape, its rise included.
std::optional<StepFit> fit_step(const float* values, int count, double start, const EdgeShape& shape);

/// One place of a profile across an edge, averaged over many lines.
struct ProfilePoint {
  double x = 0.0;  ///< samples from where the lines' own fits put the edge, inwards
  double value = 0.0;
  double weight = 0.0;
};

/// Blur and rise of an averaged profile, level, step and place being free; nothing when it does not settle. A rise that
/// is less than three times its uncertainty is taken for none.
std::optional<EdgeShape> fit_shape(std::span<const ProfilePoint> profile, double start_blur);

/// The position, in samples, at which the second derivative of a rising step near `start` passes zero: the zero of a
/// line fitted to it over +-`half_width` samples, where it is about straight ([C] 2.3.2 and [38] there). The derivative
/// is the central difference of the central difference, each with arms of `arm` samples.
std::optional<double> zero_crossing(const float* values, int count, double start, int arm, double half_width);

}  // namespace imprint
