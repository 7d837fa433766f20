#include "node/segment/working_image.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace imprint {

ReducedImage reduce_image(const cv::Mat& image, const SegmentPrior& prior, const SegmentConfig& config) {
  ReducedImage reduced;
  const double full_scale = image.depth() == CV_16U ? 65535.0 : 255.0;
  reduced.quantum = 1.0 / full_scale;
  const int by_width = static_cast<int>(prior.diameter_min_px / config.min_reduced_diameter_px);
  const int r = reduced.reduction =
      std::clamp(std::min({by_width, image.cols / 64, image.rows / 64}), 1, config.max_reduction);
  const cv::Size size(image.cols / r, image.rows / r);
  cv::Mat shrunk;
  cv::resize(image(cv::Rect(0, 0, size.width * r, size.height * r)), shrunk, size, 0, 0, cv::INTER_AREA);
  const bool dark = prior.polarity == Polarity::dark;
  shrunk.convertTo(reduced.intensity, CV_32F, dark ? -1.0 / full_scale : 1.0 / full_scale, dark ? 1.0 : 0.0);
  return reduced;
}

ReducedImage halve(const ReducedImage& reduced) {
  ReducedImage half{{}, 2 * reduced.reduction, reduced.quantum};
  const cv::Size size(reduced.intensity.cols / 2, reduced.intensity.rows / 2);
  cv::resize(reduced.intensity(cv::Rect(0, 0, size.width * 2, size.height * 2)), half.intensity, size, 0, 0,
             cv::INTER_AREA);
  return half;
}

WorkingImage turn_image(const ReducedImage& reduced, double direction_x, double direction_y) {
  WorkingImage working;
  const int r = working.reduction = reduced.reduction;
  const cv::Size reduced_size = reduced.intensity.size();
  working.quantum = reduced.quantum;
  working.shorter_side_px = std::min(reduced_size.width, reduced_size.height);

  // A canvas that holds the whole turned image, its middle on the image's middle.
  const double c = direction_x, s = direction_y;
  const double w = reduced_size.width - 1, h = reduced_size.height - 1;
  const cv::Size canvas(static_cast<int>(std::ceil(std::abs(c) * w + std::abs(s) * h)) + 1,
                        static_cast<int>(std::ceil(std::abs(s) * w + std::abs(c) * h)) + 1);
  const double cx = 0.5 * (canvas.width - 1), cy = 0.5 * (canvas.height - 1);
  const cv::Matx23d reduced_from_working(c, -s, 0.5 * w - c * cx + s * cy, s, c, 0.5 * h - s * cx - c * cy);
  cv::warpAffine(reduced.intensity, working.intensity, reduced_from_working, canvas,
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
  const cv::Mat seen(reduced_size, CV_8U, cv::Scalar(255));
  cv::warpAffine(seen, working.valid, reduced_from_working, canvas, cv::INTER_NEAREST | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT, cv::Scalar(0));

  // A reduced px is the mean of r x r px, so its centre lies (r - 1)/2 further.
  for (int i = 0; i < 2; ++i) {
    working.source_from_working(i, 0) = r * reduced_from_working(i, 0);
    working.source_from_working(i, 1) = r * reduced_from_working(i, 1);
    working.source_from_working(i, 2) = r * reduced_from_working(i, 2) + 0.5 * (r - 1);
  }
  return working;
}

}  // namespace imprint
