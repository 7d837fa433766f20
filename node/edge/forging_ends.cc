#include "node/edge/forging_ends.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "node/edge/edge_path.h"
#include "node/edge/scan_lines.h"
#include "node/edge/step_edges.h"

namespace imprint {
namespace {

double grey_at(const cv::Mat& image, const ObservedPoint& p, bool invert) {
  const int x = static_cast<int>(std::lround(p.x_px)), y = static_cast<int>(std::lround(p.y_px));
  if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) return -1.0;
  const double value =
      image.depth() == CV_16U ? image.at<unsigned short>(y, x) / 65535.0 : image.at<unsigned char>(y, x) / 255.0;
  return invert ? 1.0 - value : value;
}

// Upper quartile over a broad band about the axis at one station, so that scale on a part of it does not hide the body;
// negative when the axis has left the image.
double band_level(const cv::Mat& image, const SilhouetteFrame& frame, double station, const EndSearch& search,
                  bool invert) {
  if (grey_at(image, frame.at(station, search.axis_offset_px), invert) < 0) return -1.0;
  std::vector<double> values;
  for (int k = -10; k <= 10; ++k) {
    const double value =
        grey_at(image, frame.at(station, search.axis_offset_px + 0.035 * k * search.diameter_px), invert);
    if (value >= 0) values.push_back(value);
  }
  const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(3 * values.size() / 4);
  std::nth_element(values.begin(), quartile, values.end());
  return *quartile;
}

struct ArcPoint {
  double offset_px, station_px, sigma_px;
};

// Robust parabola station(offset) about `at`: value and standard deviation there.
bool fit_arc(const std::vector<ArcPoint>& points, double at, double half_band, LocatedEnd& end) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal;
  double scale = 1e9, mean_square = 0, used = 0;
  for (int pass = 0; pass < 6; ++pass) {
    normal.setZero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const ArcPoint& point : points) {
      const double x = (point.offset_px - at) / half_band;
      const Eigen::Vector3d g(1.0, x, x * x);
      const double r = point.station_px - g.dot(p);
      const double w = pass == 0 ? 1.0 : std::pow(std::max(0.0, 1 - (r / scale) * (r / scale)), 2);
      normal += w * g * g.transpose();
      right += w * point.station_px * g;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    if (solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-6)) return false;
    p = solver.solve(right);
    std::vector<double> residuals;
    for (const ArcPoint& point : points) {
      const double x = (point.offset_px - at) / half_band;
      residuals.push_back(std::abs(point.station_px - p[0] - p[1] * x - p[2] * x * x));
    }
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::nth_element(residuals.begin(), middle, residuals.end());
    scale = std::max(0.05, 4.685 * 1.4826 * *middle);
    mean_square = used = 0;
    for (const double r : residuals)
      if (r < scale) mean_square += r * r, used += 1;
  }
  if (used < 5 || used < 0.5 * static_cast<double>(points.size())) return false;
  end.station_px = p[0];
  end.offset_px = at;
  end.sigma_px = std::max(
      0.01, std::sqrt(mean_square / std::max(1.0, used - 3) * normal.ldlt().solve(Eigen::Vector3d::UnitX())[0]));
  return true;
}

}  // namespace

std::optional<double> walk_to_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search,
                                  Polarity polarity) {
  const bool invert = polarity == Polarity::dark;
  const double outward = search.at_start ? -1.0 : 1.0;
  const int inside_px = static_cast<int>(0.5 * search.diameter_px),
            outside_px = static_cast<int>(1.2 * search.diameter_px);
  std::vector<double> body;
  for (int k = -2 * inside_px; k < -inside_px / 2; ++k) {
    const double level = band_level(image, frame, search.station_px + outward * k, search, invert);
    if (level >= 0) body.push_back(level);
  }
  if (body.size() < 8) return std::nullopt;
  const auto middle = body.begin() + static_cast<std::ptrdiff_t>(body.size() / 2);
  std::nth_element(body.begin(), middle, body.end());
  double darkest = *middle;
  for (int k = -inside_px; k <= outside_px; ++k) {
    const double level = band_level(image, frame, search.station_px + outward * k, search, invert);
    if (level >= 0) darkest = std::min(darkest, level);
  }
  // Scale on the surface is a dark stretch too, but the body comes back behind it.
  const double threshold = 0.5 * (*middle + darkest);
  const int longest_dark = std::max(8, static_cast<int>(0.4 * search.diameter_px));
  int dark = 0;
  for (int k = -inside_px; k <= outside_px; ++k) {
    const double level = band_level(image, frame, search.station_px + outward * k, search, invert);
    if (level < 0) return dark > 4 ? std::optional(search.station_px + outward * (k - dark)) : std::nullopt;
    dark = level < threshold ? dark + 1 : 0;
    if (dark >= longest_dark) return search.station_px + outward * (k - dark + 1);
  }
  return std::nullopt;
}

LocatedEnd locate_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search, Polarity polarity,
                      const EdgeConfig& config) {
  LocatedEnd end;
  end.station_px = search.station_px;
  end.offset_px = search.axis_offset_px;
  // Pixel rows when the axis runs more across than down, else columns; inward is towards the body.
  const bool rows = std::abs(frame.direction_x) >= std::abs(frame.direction_y);
  const double along = rows ? frame.direction_x : frame.direction_y;
  const double sign = (search.at_start ? 1.0 : -1.0) * (along >= 0 ? 1.0 : -1.0);
  const ObservedPoint middle = frame.at(search.station_px, search.axis_offset_px);
  const double half_band = std::max(6.0, config.end_half_band * search.diameter_px);
  // The end face stands normal to the axis: how far its trace moves along a row from one row to the next.
  const double lean = rows ? -frame.direction_y / frame.direction_x : -frame.direction_x / frame.direction_y;
  const int centre = static_cast<int>(std::lround(rows ? middle.y_px : middle.x_px));
  const int reach = static_cast<int>(half_band * std::abs(along));
  std::vector<ScanRequest> requests;
  for (int k = -reach; k <= reach; ++k) {
    const int index = centre + k;
    if (index < 0 || index >= (rows ? image.rows : image.cols)) continue;
    const double expected = sign * ((rows ? middle.x_px : middle.y_px) + lean * k);
    const ObservedPoint foot =
        rows ? ObservedPoint{0, static_cast<double>(index)} : ObservedPoint{static_cast<double>(index), 0};
    requests.push_back(
        {index, foot, expected - config.end_search_px, expected + config.end_search_px, expected, sign * lean});
  }
  const ScanLines scan =
      read_scan_lines(image, requests, rows ? cv::Vec2d(sign, 0) : cv::Vec2d(0, sign), 1.0, polarity == Polarity::dark);
  std::vector<ArcPoint> points;
  for (const StepEdge& edge : fit_step_edges(scan, trace_rim(scan, true, config), config.blur_region_stations)) {
    const ObservedPoint p = scan.at(scan.lines[edge.line], edge.position_px);
    points.push_back({frame.offset_px(p), frame.station_px(p), edge.sigma_px});
  }
  if (points.size() < 7 || points.size() < static_cast<std::size_t>(reach)) return end;
  end.visible = fit_arc(points, search.axis_offset_px, half_band, end);
  return end;
}

}  // namespace imprint
