#include "node/edge/scan_lines.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

template <class Pixel>
float bilinear(const cv::Mat& image, double x, double y) {
  const int x0 = std::min(static_cast<int>(x), image.cols - 2), y0 = std::min(static_cast<int>(y), image.rows - 2);
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  const Pixel* top = image.ptr<Pixel>(y0) + x0;
  const Pixel* bottom = image.ptr<Pixel>(y0 + 1) + x0;
  const float a = static_cast<float>(top[0]) + fx * static_cast<float>(top[1] - top[0]);
  const float b = static_cast<float>(bottom[0]) + fx * static_cast<float>(bottom[1] - bottom[0]);
  return a + fy * (b - a);
}

// The part of [from, to] in which origin + t step stays within [0, limit].
void clip(double origin, double step, double limit, double& from, double& to) {
  if (std::abs(step) < 1e-12) {
    if (origin < 0 || origin > limit) to = from - 1;
    return;
  }
  const double a = -origin / step, b = (limit - origin) / step;
  from = std::max(from, std::min(a, b));
  to = std::min(to, std::max(a, b));
}

template <class Pixel>
void read(const cv::Mat& image, const std::vector<ScanRequest>& requests, bool invert, double full_scale,
          ScanLines& out) {
  const auto scale = static_cast<float>((invert ? -1.0 : 1.0) / full_scale);
  const float zero = invert ? 1.0F : 0.0F;
  for (const ScanRequest& request : requests) {
    double from = request.from_px, to = request.to_px;
    clip(request.foot.x_px, out.inward[0], image.cols - 1, from, to);
    clip(request.foot.y_px, out.inward[1], image.rows - 1, from, to);
    // Samples at whole multiples of the spacing, so that lines along pixel columns hit the pixels.
    const double first = std::ceil(from / out.spacing_px - 1e-9) * out.spacing_px;
    const int count = static_cast<int>(std::floor((to - first) / out.spacing_px + 1e-9)) + 1;
    if (to < first || count < 8) continue;
    out.lines.push_back(
        {request.index, request.foot, first, request.expected_px, request.slope, out.values.size(), count});
    for (int i = 0; i < count; ++i) {
      const double t = first + i * out.spacing_px;
      const double x = std::clamp(request.foot.x_px + t * out.inward[0], 0.0, image.cols - 1.0);
      const double y = std::clamp(request.foot.y_px + t * out.inward[1], 0.0, image.rows - 1.0);
      out.values.push_back(zero + scale * bilinear<Pixel>(image, x, y));
    }
  }
}

}  // namespace

ScanLines read_scan_lines(const cv::Mat& image, const std::vector<ScanRequest>& requests, cv::Vec2d inward,
                          double spacing_px, bool invert) {
  ScanLines out;
  out.inward = inward;
  out.spacing_px = spacing_px;
  out.lines.reserve(requests.size());
  if (image.depth() == CV_16U) {
    read<unsigned short>(image, requests, invert, 65535.0, out);
  } else {
    read<unsigned char>(image, requests, invert, 255.0, out);
  }
  return out;
}

}  // namespace imprint
