#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>

#include "node/detect/scan_ring.h"

namespace imprint {

/// The light on a ring, level * exp(slope . place), in units of the light at the dot.
struct RingLight {
  double level = 1.0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< logarithm per dot radius, in the frame of the dot
  double slope_sigma =
      0.0;  ///< standard deviation of each coordinate of the slope; infinite when too few bits are white
};

/// By least squares of the logarithm of the readings of the bits that `code` has white, drawn towards even light.
/// `code`: its first bit where the scan's is. Nothing when fewer than two bits are white.
std::optional<RingLight> light_on_ring(const RingScan& scan, std::uint32_t code);

}  // namespace imprint
