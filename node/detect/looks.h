#pragma once

#include <vector>

#include "node/detect/detect_config.h"
#include "node/detect/find_blobs.h"
#include "node/detect/image_pyramid.h"

namespace imprint {

/// An image that dots are looked for in: a level of the pyramid, the image doubled, or a level with blur taken out.
struct Look {
  GreyImage grey;
  int level = 0;
  double noise = 0.0;            ///< of its grey values
  double removed_blur_px = 0.0;  ///< px of the image
  BlobSize blobs = BlobSize::small;

  [[nodiscard]] bool is_sharpened() const { return removed_blur_px > 0.0; }

  /// Looks of one rank see the same: the level, or for each blur taken out a rank of its own below all levels.
  [[nodiscard]] int rank() const { return is_sharpened() ? -100 - cvRound(8.0 * removed_blur_px) : level; }
};

/// Least rank of a look that shows the image as it is.
inline constexpr int plain_rank = -1;

/// Levels that a pyramid needs for dots up to this diameter.
int levels_for(double max_dot_px);

/// The looks that find all dots of the configured sizes. `noise`: of the image, in grey values.
std::vector<Look> choose_looks(const ImagePyramid& pyramid, double noise, const DetectConfig& config);

}  // namespace imprint
