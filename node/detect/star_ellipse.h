#pragma once

#include <optional>

#include "node/detect/detect_config.h"
#include "node/detect/ellipse.h"
#include "node/detect/image_pyramid.h"

namespace imprint {

/// A bright ellipse on dark ground, as the star operator sees it on one pyramid level.
struct StarEllipse {
  Ellipse ellipse;        ///< in px of the level
  double white = 0.0;     ///< grey level inside
  double black = 0.0;     ///< grey level of the ground just outside
  double residual = 0.0;  ///< rms of the edge points' distance to the ellipse, in dot radii
};

/// The ellipse round `start` (px of `level`) whose edge rays from it meet first; nothing when there is none that meets
/// the criteria of [A] 2.3.2 and 2.3.3 (size, axis ratio, residual, contrast). Rays find their edge half-way between
/// the grey levels inside and in the valley behind the edge, so that each ray brings its own threshold; the second and
/// later rounds cast their rays in the frame of the ellipse found so far. After [A] 2.3.4.
std::optional<StarEllipse> find_star_ellipse(const GreyImage& level, const Eigen::Vector2d& start,
                                             const DetectConfig& config);

/// Semi-minor axes, in px of a level, that `find_star_ellipse` answers for; the next levels take the larger ones.
inline constexpr double min_level_semi_minor_px = 0.9;
inline constexpr double max_level_semi_minor_px = 5.5;

}  // namespace imprint
