#pragma once

#include <functional>
#include <limits>
#include <optional>

#include "node/detect/ellipse.h"
#include "node/detect/image_pyramid.h"

namespace imprint {

/// A dot as fitted to the grey values themselves.
struct FittedDot {
  Ellipse ellipse;
  double blur_px = 0.0;   ///< standard deviation of the edge's blur, the pixel's own width (1/12 px^2) included
  double black = 0.0;     ///< grey level of the ground
  double contrast = 0.0;  ///< white minus black at the centre
  double residual = 0.0;  ///< rms of the grey values about the model: the noise, and what is no dot
  double sigma_px = 0.0;  ///< standard deviation of each coordinate of the centre
  Eigen::Vector2d shading =
      Eigen::Vector2d::Zero();  ///< relative change of the light per px; zero where not significant
};

/// What is known of the shading over a dot beforehand, which in a small dot is hardly told from a shift of its centre:
/// frame_of(ellipse) * shading is normal about `slope` (per dot radius).
struct ShadingPrior {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double sigma = std::numeric_limits<double>::infinity();  ///< of each coordinate
};

/// What a fit begins with.
struct DotGuess {
  Ellipse ellipse;
  double black = 0.0;
  double contrast = 0.0;
  double blur_px = 0.8;
  ShadingPrior shading = {};
};

/// The dot near `guess` (in px of `image`) by least squares of all grey values within 1.5 radii against a blurred
/// ellipse: black + contrast (1 + g.(x - c)) Phi(-d / blur), d the distance to the ellipse, g a shading. Ellipse, blur,
/// grey levels and shading are fitted together, pixels that do not fit (dirt, a cover) weigh less. The centre of a
/// symmetric dot has no bias whatever the blur's shape is, and its standard deviation comes from the normal equations.
/// Nothing when it does not converge near the guess. In place of the edge points of [A] 2.3.4.
/// `other_light`, where given, is light at a place that is not the dot's (its ring's, as blur spreads it), and is taken
/// off first.
/// `FitFreedom::place` holds the guess's shape and blur, which a heavily blurred dot alone does not tell apart.
using LightAt = std::function<double(const Eigen::Vector2d&)>;
enum class FitFreedom { all, place };
std::optional<FittedDot> fit_dot(const GreyImage& image, const DotGuess& guess, const LightAt& other_light = {},
                                 FitFreedom freedom = FitFreedom::all);

/// The same dot in the px of level 0, from px of `level`.
FittedDot from_level(const FittedDot& dot, int level);
FittedDot to_level(const FittedDot& dot, int level);

}  // namespace imprint
