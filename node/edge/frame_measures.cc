#include "node/edge/frame_measures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/edge/rim_haze.h"
#include "node/edge/scan_lines.h"
#include "node/edge/silhouette_frame.h"
#include "node/edge/step_edges.h"

namespace imprint {
namespace {

double full_scale(const cv::Mat& image) { return image.depth() == CV_16U ? 65535.0 : 255.0; }

// ---- blur

// Change of the offset per station about point i, over the points within 10 stations of it.
double local_slope(const std::vector<EdgePoint>& rim, std::size_t i) {
  constexpr int kReach = 10;
  std::size_t a = i, b = i;
  while (a > 0 && rim[i].station_px - rim[a - 1].station_px <= kReach) --a;
  while (b + 1 < rim.size() && rim[b + 1].station_px - rim[i].station_px <= kReach) ++b;
  if (a == b) return 0.0;
  return (rim[b].offset_px - rim[a].offset_px) / (rim[b].station_px - rim[a].station_px);
}

// Blur of every region of one rim, from pixels along columns (rows, where the axis runs more down than across), which
// no interpolation blurs.
void add_blur(const cv::Mat& image, const SilhouetteFrame& frame, const std::vector<EdgePoint>& rim, bool upper,
              bool invert, std::vector<double>& out) {
  constexpr std::size_t kEnough = 600;  // lines of a rim
  constexpr int kRegionLines = 90;
  constexpr double kReachPx = 13.0;
  const bool columns = std::abs(frame.direction_x) >= std::abs(frame.direction_y);
  const double along_normal = columns ? frame.direction_x : -frame.direction_y;
  const double sign = (upper ? 1.0 : -1.0) * (along_normal >= 0 ? 1.0 : -1.0);
  std::vector<ScanRequest> requests;
  std::vector<double> foreshortening;
  for (std::size_t i = 0; i < rim.size(); i += std::max<std::size_t>(1, rim.size() / kEnough)) {
    const ObservedPoint p = frame.at(rim[i].station_px, rim[i].offset_px);
    const double slope = local_slope(rim, i);
    const double normal_x = -frame.direction_y - slope * frame.direction_x;
    const double normal_y = frame.direction_x - slope * frame.direction_y;
    const double index = std::round(columns ? p.x_px : p.y_px);
    const double moved = index - (columns ? p.x_px : p.y_px);
    // Along the rim from the point to the whole column: its tangent is the normal turned.
    const double across = columns ? p.y_px - moved * normal_x / normal_y : p.x_px - moved * normal_y / normal_x;
    if (!(std::abs(columns ? normal_y : normal_x) > 0.5 * std::hypot(1.0, slope))) continue;
    const double position = sign * across;
    requests.push_back({static_cast<int>(index), columns ? ObservedPoint{index, 0} : ObservedPoint{0, index},
                        position - kReachPx, position + kReachPx, position, 0.0});
    foreshortening.push_back(std::abs(columns ? normal_y : normal_x) / std::hypot(1.0, slope));
  }
  if (requests.empty()) return;
  const ScanLines scan =
      read_scan_lines(image, requests, columns ? cv::Vec2d(0, sign) : cv::Vec2d(sign, 0), 1.0, invert);
  std::vector<TracedEdge> traced;
  for (std::size_t n = 0; n < scan.lines.size(); ++n) {
    EdgeCandidate edge;
    edge.position_px = scan.lines[n].expected_px;
    edge.from_sample = 0, edge.to_sample = scan.lines[n].count - 1;
    traced.push_back({n, edge});
  }
  const double to_normal = median(foreshortening);
  for (const EdgeShape& shape : region_shapes(scan, traced, kRegionLines)) out.push_back(shape.blur * to_normal);
}

double rim_blur_px(const cv::Mat& image, const Silhouette& silhouette, Polarity polarity) {
  const SilhouetteFrame frame(silhouette.frame);
  std::vector<double> blur;
  add_blur(image, frame, silhouette.upper, true, polarity == Polarity::dark, blur);
  add_blur(image, frame, silhouette.lower, false, polarity == Polarity::dark, blur);
  if (blur.empty()) return 0.0;
  const double of_rims = median(std::move(blur));
  constexpr double kPixelVariance = 1.0 / 12;
  return std::sqrt(std::max(0.0, of_rims * of_rims - kPixelVariance));
}

// ---- level

double body_level(const cv::Mat& image, const Segmentation& s, Polarity polarity) {
  constexpr std::size_t kEveryStation = 4;
  constexpr double kEveryPx = 3.0, kInsidePx = 2.0, kPercentile = 0.995;
  constexpr std::size_t kLevels = 1024;
  const SilhouetteFrame frame(s);
  const double to_level = (kLevels - 1) / full_scale(image);
  std::array<std::size_t, kLevels> histogram{};
  std::size_t count = 0;
  const auto add = [&](double station, double from, double to) {
    for (double offset = from; offset <= to; offset += kEveryPx) {
      const ObservedPoint p = frame.at(station, offset);
      const int x = static_cast<int>(std::lround(p.x_px)), y = static_cast<int>(std::lround(p.y_px));
      if (x < 0 || y < 0 || x >= image.cols || y >= image.rows) continue;
      const double value = image.depth() == CV_16U ? image.at<unsigned short>(y, x) : image.at<unsigned char>(y, x);
      ++histogram[static_cast<std::size_t>(value * to_level)];
      ++count;
    }
  };
  for (std::size_t i = 0; i < s.upper_offset_px.size(); i += kEveryStation) {
    const double station = s.first_station_px + static_cast<double>(i);
    const double upper = s.upper_offset_px[i], lower = s.lower_offset_px[i];
    if (std::isnan(upper) || std::isnan(lower)) continue;
    if (polarity == Polarity::bright) {
      add(station, upper + kInsidePx, lower - kInsidePx);
    } else {  // what must not saturate is what the forging is seen against
      const double beside = 0.25 * (lower - upper);
      add(station, upper - beside, upper - kInsidePx);
      add(station, lower + kInsidePx, lower + beside);
    }
  }
  std::size_t above = 0;
  for (std::size_t level = kLevels; level-- > 0;) {
    above += histogram[level];
    if (count > 0 && static_cast<double>(above) > (1.0 - kPercentile) * static_cast<double>(count))
      return static_cast<double>(level) / (kLevels - 1);
  }
  return 0.0;
}

}  // namespace

FrameMeasures measure_frame(const cv::Mat& image, const Silhouette& silhouette, Polarity polarity) {
  FrameMeasures measures;
  if (image.empty()) return measures;
  measures.blur_px = rim_blur_px(image, silhouette, polarity);
  measures.haze_px = rim_haze_px(silhouette);
  measures.body_level = body_level(image, silhouette.frame, polarity);
  measures.frame_saturated_fraction =
      static_cast<double>(cv::countNonZero(image >= full_scale(image))) / static_cast<double>(image.total());
  return measures;
}

}  // namespace imprint
