#pragma once

#include <optional>
#include <vector>

#include "lib/targets/target_library.h"
#include "node/detect/fit_dot.h"
#include "node/detect/image_pyramid.h"

namespace imprint {

/// How a blurred, unevenly lit ring shows at one bit: reading = floor + light (own bit * own + its neighbours' *
/// beside). Without blur floor = 0, own = 1, beside = 0; where the light is even, light = 1.
struct BitResponse {
  double floor = 0.0;  ///< light of the dot that reaches the ring
  double own = 1.0;
  double beside = 0.0;         ///< share of each of the two next bits
  double radial = 1.0;         ///< share of a white arc's light that the scanned rows see
  double angular_sigma = 0.0;  ///< blur along the ring, in bits
  double step = 0.0;           ///< light of the dot on the outer rows less that on the inner ones
  double inside = 0.0;         ///< what a white arc, and the dot, show a little inside of the ring
  double outside = 0.0;        ///< what a white arc shows a little outside of the ring
  double light = 1.0;          ///< light at the bit in units of that at the dot's centre

  [[nodiscard]] double reading(int before, int bit, int after) const {
    return floor + light * (own * bit + beside * (before + after));
  }
  /// The reading of one column, `offset` bits (-0.5 to 0.5) from the bit's middle.
  [[nodiscard]] double column_reading(double offset, int before, int bit, int after) const;
};

inline constexpr int columns_per_bit = 24;

/// What is read off a code ring, one value a bit, clockwise as seen from an arbitrary bit.
struct RingScan {
  std::vector<double> reading;  ///< 0: as black as the ground of the dot; 1: as white as the dot; NaN: outside
  std::vector<BitResponse> response;
  std::vector<Eigen::Vector2d> place;  ///< middle of each bit in the frame of the dot, where that is the unit circle
  int first_column = 0;                ///< where the first bit begins, in columns of the frame of the dot
  double first_angle = 0.0;            ///< where the first bit begins, in the frame of the dot
  double noise = 0.0;                  ///< standard deviation of a reading from the noise of the image
  std::vector<double> columns;         ///< mean reading of each column from the first bit's beginning on
  std::vector<double> inside;          ///< reading of each column a little inside of the ring
  std::vector<double> outside;         ///< reading of each column a little outside of the ring
  std::vector<double> steps;           ///< by how much each column is brighter in its outer rows than in its inner ones
  double deviation = 0.0;              ///< mean deviation within the bits at the rotation taken, [A] 2.3.5
};

/// Scans the ring of a dot densely (24 columns a bit, 7 rows; [A] 2.3.5 has 24 and 12) in the frame of its ellipse and
/// turns the columns so that the sum of the mean deviations within the bits is least. `dot` is in px of level 0;
/// `image` is of pyramid level `level`, best one whose pixels fit the dot's size, so that in large rings noise is
/// averaged out. `noise` is the whole image's, per px of level 0. Nothing when more than `max_unknown` of the ring lies
/// outside the image.
std::optional<RingScan> scan_ring(const GreyImage& image, int level, const FittedDot& dot, int bits,
                                  const TargetGeometry& geometry, double noise, double max_unknown,
                                  std::optional<int> first_column = std::nullopt);

/// The scan with its first bit some columns, fewer than a bit has, later.
RingScan turned(const RingScan& scan, int columns);

/// Has the responses of a scan be those under the blur of `dot`.
void set_blur(RingScan& scan, const FittedDot& dot, const TargetGeometry& geometry);

/// Light of the ring of `code` (its first bit where the scan's is) at a place of the image, in grey levels: what blur
/// carries of it over the edge of the dot.
double ring_light_at(const Eigen::Vector2d& place, const FittedDot& dot, const RingScan& scan, std::uint32_t code,
                     const TargetGeometry& geometry);

/// The light's slope in the frame of the dot (logarithm per dot radius), as the shading over the dot tells it.
Eigen::Vector2d light_slope(const FittedDot& dot);

/// Takes the light to change by exp(slope . place) over the ring, within a factor of five.
void set_light(RingScan& scan, const Eigen::Vector2d& slope, double level);

/// Quick look at a dot found on one level: the share of places round it that are dark in the valley between dot and
/// ring, and the share that are white on the ring.
struct RingGlance {
  double dark_valley = 0.0;
  double white_ring = 0.0;
};
/// `least_light`: share of the dot's light from which on a place of the ring counts as white.
RingGlance glance_at_ring(const GreyImage& level, const Ellipse& dot, double white, double black, double least_light,
                          const TargetGeometry& geometry);

}  // namespace imprint
