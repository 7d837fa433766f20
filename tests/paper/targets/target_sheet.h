#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include <opencv2/aruco/dictionary.hpp>
#include <opencv2/core.hpp>

#include "lib/targets/target_library.h"

namespace imprint::paper {

enum class Background { plain, cluttered };

/// An image with targets whose ids and centres are known. Grey values 0 to 1 in 32-bit floats.
struct Sheet {
  cv::Mat image;
  std::map<int, cv::Point2d> centers;  ///< px, (0, 0) the middle of the first pixel
};

/// A patch over part of each target: a sector of the ring, at a random place, of a random grey value.
struct Patch {
  double bits = 0.0;  ///< its extent in bits of the ring
  std::uint64_t seed = 1;
};

/// Side of a target, [A] 2.4.
inline constexpr int target_side_px = 110;
/// Radius of the dot: at 15 px of side a dot is 3 px wide, [A] 3.1.2 (rounded down).
inline constexpr double dot_radius_px = 10.0;

/// Ring-coded targets of a library in a grid of black squares, ten to a row.
Sheet draw_rings(const TargetLibrary& library, Background background);

/// ArUco markers of a dictionary in the same grid, each with a white border one module wide within its 110 px.
Sheet draw_aruco(const cv::aruco::Dictionary& dictionary, Background background);

/// The same patches over either kind of sheet, between 1.5 and 3.5 dot radii round each centre.
Sheet with_patches(const Sheet& sheet, const Patch& patch, int bits);

enum class LookAlikes { with, without };

/// A scene without targets: folds of light, texture at all scales, boards, bars, discs, rings, letters. Look-alikes are
/// dots in rings that are broken anywhere, in the proportions of a target: targets of no library, in all but name.
cv::Mat draw_clutter(int width, int height, std::uint64_t seed, LookAlikes look_alikes = LookAlikes::with);

}  // namespace imprint::paper
