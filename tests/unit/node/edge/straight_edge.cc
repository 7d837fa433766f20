#include "tests/unit/node/edge/straight_edge.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace imprint::drawn {
namespace {

double density(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2 * std::numbers::pi); }
double distribution(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

// A blurred step at signed distance d, integrated once and twice over d.
double once(double d, double blur) { return d * distribution(d / blur) + blur * density(d / blur); }
double twice(double d, double blur) {
  return 0.5 * ((d * d + blur * blur) * distribution(d / blur) + d * blur * density(d / blur));
}

// Mean over a pixel whose middle is d inside of a straight edge, the edge's normal at (c, s) to the pixel's sides.
double pixel_mean(double d, double c, double s, double blur) {
  if (d > 6 * blur + 1) return 1.0;
  if (d < -6 * blur - 1) return 0.0;
  c = std::abs(c), s = std::abs(s);
  if (c < s) std::swap(c, s);
  if (s < 1e-4) return (once(d + 0.5 * c, blur) - once(d - 0.5 * c, blur)) / c;
  const double far = 0.5 * (c + s), near = 0.5 * (c - s);
  return (twice(d + far, blur) - twice(d + near, blur) - twice(d - near, blur) + twice(d - far, blur)) / (c * s);
}

constexpr double kMarginPx = 60.0;

}  // namespace

cv::Size StraightBand::size() const {
  const int across = static_cast<int>(std::ceil(width_px + 2 * kMarginPx + std::abs(slope) * length_px));
  return columns ? cv::Size(length_px, across) : cv::Size(across, length_px);
}

Segmentation StraightBand::segmentation(double error_px) const {
  // The normal is the direction turned from x to y: down the columns offsets grow with y, along the rows they fall with
  // x.
  Segmentation s;
  const double middle = std::round(0.5 * (columns ? size().height : size().width));
  const int half = length_px / 2;
  s.origin =
      columns ? ObservedPoint{static_cast<double>(half), middle} : ObservedPoint{middle, static_cast<double>(half)};
  s.direction_x = columns ? 1.0 : 0.0, s.direction_y = columns ? 0.0 : 1.0;
  s.first_station_px = -half;
  for (int station = -half; station < half; ++station) {
    const double upper = upper_offset_px(station) - 0.5 * width_px + error_px;
    s.upper_offset_px.push_back(static_cast<float>(upper));
    s.lower_offset_px.push_back(static_cast<float>(upper + width_px));
  }
  return s;
}

cv::Mat_<float> draw(const StraightBand& band) {
  const cv::Size size = band.size();
  const Segmentation s = band.segmentation(0.0);
  const double norm = std::hypot(1.0, band.slope), c = 1.0 / norm, sine = band.slope / norm;
  cv::Mat_<float> image(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double dx = x - s.origin.x_px, dy = y - s.origin.y_px;
      const double station = dx * s.direction_x + dy * s.direction_y;
      const double offset = dy * s.direction_x - dx * s.direction_y;
      const double below_upper = offset - (band.upper_offset_px(station) - 0.5 * band.width_px);
      const double share = pixel_mean(below_upper * c, c, sine, band.blur_px) -
                           pixel_mean((below_upper - band.width_px) * c, c, sine, band.blur_px);
      image(y, x) = static_cast<float>(band.background + band.contrast * share);
    }
  }
  return image;
}

double bound_px(double blur_px, double slope, int reach_px, Unknown unknown) {
  const double blur = std::sqrt(blur_px * blur_px + 1.0 / 12) * std::hypot(1.0, slope);
  constexpr int kPhases = 20;
  const int unknowns = unknown == Unknown::position ? 1 : unknown == Unknown::levels ? 3 : 4;
  double variance = 0.0;
  for (int k = 0; k < kPhases; ++k) {
    const double phase = (k + 0.5) / kPhases - 0.5;
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (int i = -reach_px; i <= reach_px; ++i) {
      const double z = (i - phase) / blur;
      const Eigen::Vector4d slopes(-density(z) / blur, 1.0, distribution(z), -z * density(z) / blur);
      information += slopes * slopes.transpose();
    }
    const Eigen::MatrixXd of_unknown = information.topLeftCorner(unknowns, unknowns);
    variance += of_unknown.ldlt().solve(Eigen::VectorXd::Unit(unknowns, 0))[0] / kPhases;
  }
  return std::sqrt(variance);
}

}  // namespace imprint::drawn
