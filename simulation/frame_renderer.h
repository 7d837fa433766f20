#pragma once

#include <opencv2/core.hpp>

#include "lib/result/result.h"
#include "simulation/layout.h"
#include "simulation/scene.h"

namespace imprint {

/// One frame of a scene laid out, 8 or 16 bit as the scene says. `backdrop` is paint_backdrop of this camera, so that
/// it is painted once for all observations. Fails as body_outline does.
Result<cv::Mat> render_frame_on(const cv::Mat& backdrop, const Scene& scene, const Layout& layout, int observation,
                                int camera);

/// The same without forging and hot air: plates before the backdrop, painted in the layout's order.
cv::Mat render_targets_on(const cv::Mat& backdrop, const Scene& scene, const Layout& layout, int camera);

}  // namespace imprint
