#include "simulation/coverage.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

// Accumulates, edge by edge, the signed area between the edge and the right border of the region. A pixel of
// `area` holds the part that its own column adds; the running sum along the row adds what lies left of it.
class AreaAccumulator {
 public:
  AreaAccumulator(cv::Size size) : size_(size), area_(size.height, size.width + 2, CV_64F, cv::Scalar(0.0)) {}

  // Corners in pixel-border coordinates of the region: pixel (i, j) is [i, i + 1) x [j, j + 1).
  void add_edge(double x0, double y0, double x1, double y1) {
    if (y0 == y1) return;
    const double sign = y0 < y1 ? 1.0 : -1.0;
    if (y0 > y1) {
      std::swap(x0, x1);
      std::swap(y0, y1);
    }
    const double slope = (x1 - x0) / (y1 - y0);
    const double top = std::max(y0, 0.0), bottom = std::min(y1, static_cast<double>(size_.height));
    for (int row = static_cast<int>(std::floor(top)); row < bottom; ++row) {
      const double from = std::max(top, static_cast<double>(row)), to = std::min(bottom, row + 1.0);
      if (to <= from) continue;
      add_in_row(row, x0 + (from - y0) * slope, x0 + (to - y0) * slope, sign * (to - from));
    }
  }

  cv::Mat shares() const {
    cv::Mat result(size_, CV_64F);
    for (int j = 0; j < size_.height; ++j) {
      double sum = 0.0;
      for (int i = 0; i < size_.width; ++i) {
        sum += area_.at<double>(j, i);
        result.at<double>(j, i) = std::clamp(std::abs(sum), 0.0, 1.0);
      }
    }
    return result;
  }

 private:
  // An edge piece inside one row, from x = a to x = b, of signed height `height`.
  void add_in_row(int row, double a, double b, double height) {
    const double width = size_.width;
    if (a > b) std::swap(a, b);
    double* cells = area_.ptr<double>(row);
    if (b <= 0.0) {
      cells[0] += height;
      return;
    }
    if (a >= width) return;
    if (a < 0.0 || b > width) {  // cut at the region's border
      const double inside_from = std::max(a, 0.0), inside_to = std::min(b, width);
      if (a < 0.0) cells[0] += height * (-a) / (b - a);
      add_in_row(row, inside_from, inside_to, height * (inside_to - inside_from) / (b - a));
      return;
    }
    const int first = std::min(static_cast<int>(a), size_.width - 1),
              last = std::min(static_cast<int>(b), size_.width - 1);
    for (int column = first; column <= last; ++column) {
      const double from = std::max(a, static_cast<double>(column)), to = std::min(b, column + 1.0);
      const double part = first == last ? height : height * (to - from) / (b - a);
      const double right = part * (column + 1.0 - 0.5 * (from + to));  // area right of the piece in this pixel
      cells[column] += right;
      cells[column + 1] += part - right;
    }
  }

  cv::Size size_;
  cv::Mat area_;
};

}  // namespace

Coverage polygon_coverage(const std::vector<ObservedPoint>& polygon, cv::Size image) {
  Coverage result;
  if (polygon.size() < 3) return result;
  double left = polygon[0].x_px, right = left, top = polygon[0].y_px, bottom = top;
  for (const ObservedPoint& p : polygon) {
    left = std::min(left, p.x_px);
    right = std::max(right, p.x_px);
    top = std::min(top, p.y_px);
    bottom = std::max(bottom, p.y_px);
  }
  const auto clip = [](double value, int limit) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
  };
  const int x0 = clip(std::floor(left + 0.5), image.width), x1 = clip(std::ceil(right + 0.5), image.width);
  const int y0 = clip(std::floor(top + 0.5), image.height), y1 = clip(std::ceil(bottom + 0.5), image.height);
  if (x1 <= x0 || y1 <= y0) return result;
  result.region = {x0, y0, x1 - x0, y1 - y0};
  AreaAccumulator accumulator(result.region.size());
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const ObservedPoint& a = polygon[i];
    const ObservedPoint& b = polygon[(i + 1) % polygon.size()];
    accumulator.add_edge(a.x_px + 0.5 - x0, a.y_px + 0.5 - y0, b.x_px + 0.5 - x0, b.y_px + 0.5 - y0);
  }
  result.share = accumulator.shares();
  return result;
}

}  // namespace imprint
