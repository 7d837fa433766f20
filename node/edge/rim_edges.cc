#include "node/edge/rim_edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "node/edge/body_brightness.h"
#include "node/edge/edge_path.h"
#include "node/edge/outside_level.h"
#include "node/edge/scan_lines.h"
#include "node/edge/step_edges.h"

namespace imprint {
namespace {

constexpr int kStepReach = 10;  // stations: how well the segmentation knows where a step stands

// Expected position, its local slope and the stretch to scan, so that near a step both of its sides are looked at.
struct Expectation {
  double position = 0, slope = 0, lowest = 0, highest = 0;
};

// `expected`: positions along the scan lines by index, NaN where unknown.
Expectation expectation(const std::vector<double>& expected, std::size_t i) {
  Expectation e{expected[i], 0.0, expected[i], expected[i]};
  const std::size_t a = i >= kStepReach ? i - kStepReach : 0, b = std::min(i + kStepReach, expected.size() - 1);
  for (std::size_t k = a; k <= b; ++k) {
    if (std::isnan(expected[k])) continue;
    e.lowest = std::min(e.lowest, expected[k]), e.highest = std::max(e.highest, expected[k]);
  }
  if (b > a && !std::isnan(expected[a]) && !std::isnan(expected[b])) {
    const double slope = (expected[b] - expected[a]) / static_cast<double>(b - a);
    if (std::abs(slope) < 0.8) e.slope = slope;
  }
  return e;
}

ScanRequest request(int index, ObservedPoint foot, const Expectation& e, const EdgeConfig& config) {
  return {index, foot, e.lowest - config.search_outward_px, e.highest + config.search_inward_px, e.position, e.slope};
}

double inward_sign(RimSide side) { return side == RimSide::upper ? 1.0 : -1.0; }

// Scan lines normal to the axis, one a station.
ScanLines scan_stations(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& rim, double spacing_px,
                        bool invert, const EdgeConfig& config) {
  const double sign = inward_sign(rim.side);
  std::vector<double> expected(rim.offset_px);
  for (double& e : expected) e *= sign;
  std::vector<ScanRequest> requests;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) continue;
    const int station = rim.first_station_px + static_cast<int>(i);
    requests.push_back(request(station, frame.at(station, 0), expectation(expected, i), config));
  }
  return read_scan_lines(image, requests, {-sign * frame.direction_y, sign * frame.direction_x}, spacing_px, invert);
}

// Scan lines along the pixel columns (rows, when the axis runs more down than across).
ScanLines scan_pixel_lines(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& rim, bool invert,
                           const EdgeConfig& config) {
  const bool columns = std::abs(frame.direction_x) >= std::abs(frame.direction_y);
  const double along_normal = columns ? frame.direction_x : -frame.direction_y;  // of the scanned image axis
  const double sign = inward_sign(rim.side) * (along_normal >= 0 ? 1.0 : -1.0);
  struct Point {
    double index, position;
  };
  std::vector<Point> points;
  for (std::size_t i = 0; i < rim.offset_px.size(); ++i) {
    const ObservedPoint p = frame.at(rim.first_station_px + static_cast<double>(i), rim.offset_px[i]);
    points.push_back(columns ? Point{p.x_px, sign * p.y_px} : Point{p.y_px, sign * p.x_px});
  }
  if ((columns ? frame.direction_x : frame.direction_y) < 0) std::reverse(points.begin(), points.end());

  // Positions at whole indices; where the rim turns back on itself (a step seen aslant) the later piece wins.
  double low = 1e18, high = -1e18;
  for (const Point& p : points)
    if (!std::isnan(p.index)) low = std::min(low, p.index), high = std::max(high, p.index);
  if (!(high > low)) return {};
  const int first = static_cast<int>(std::ceil(low)), last = static_cast<int>(std::floor(high));
  std::vector<double> expected(static_cast<std::size_t>(std::max(0, last - first + 1)), std::nan(""));
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const Point &a = points[k], &b = points[k + 1];
    if (std::isnan(a.position) || std::isnan(b.position) || b.index <= a.index) continue;
    for (int n = static_cast<int>(std::ceil(a.index)); n <= std::floor(b.index); ++n)
      if (n >= first && n <= last)
        expected[static_cast<std::size_t>(n - first)] =
            a.position + (b.position - a.position) * (n - a.index) / (b.index - a.index);
  }
  std::vector<ScanRequest> requests;
  const int limit = columns ? image.cols : image.rows;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const int index = first + static_cast<int>(i);
    if (std::isnan(expected[i]) || index < 0 || index >= limit) continue;
    const ObservedPoint foot =
        columns ? ObservedPoint{static_cast<double>(index), 0} : ObservedPoint{0, static_cast<double>(index)};
    requests.push_back(request(index, foot, expectation(expected, i), config));
  }
  const cv::Vec2d inward = columns ? cv::Vec2d(0, sign) : cv::Vec2d(sign, 0);
  return read_scan_lines(image, requests, inward, 1.0, invert);
}

struct SobelGradient {
  double x = 0, y = 0;  // share of full scale per px
};

template <class Pixel>
SobelGradient sobel_at(const cv::Mat& image, const ObservedPoint& p, double full_scale) {
  const int x = std::clamp(static_cast<int>(std::lround(p.x_px)), 1, image.cols - 2);
  const int y = std::clamp(static_cast<int>(std::lround(p.y_px)), 1, image.rows - 2);
  const Pixel *a = image.ptr<Pixel>(y - 1) + x, *b = image.ptr<Pixel>(y) + x, *c = image.ptr<Pixel>(y + 1) + x;
  const double gx = (a[1] - a[-1]) + 2.0 * (b[1] - b[-1]) + (c[1] - c[-1]);
  const double gy = (c[-1] - a[-1]) + 2.0 * (c[0] - a[0]) + (c[1] - a[1]);
  return {gx / (8 * full_scale), gy / (8 * full_scale)};
}

// The means some px off the edge, clear of its blur, against the body's brightness.
double body_share(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& rim, const EdgePoint& point,
                  Polarity polarity) {
  constexpr int kNear = 3, kFar = 6;
  const auto index = static_cast<std::size_t>(point.station_px - rim.first_station_px);
  const float body = index < rim.body.size() ? rim.body[index] : std::numeric_limits<float>::quiet_NaN();
  if (std::isnan(body)) return 1.0;
  float inside = 0, outside = 0;
  for (int k = kNear; k <= kFar; ++k) {
    const double inward = inward_sign(rim.side) * k;
    inside += grey_at(image, frame.at(point.station_px, point.offset_px + inward), polarity);
    outside += grey_at(image, frame.at(point.station_px, point.offset_px - inward), polarity);
  }
  constexpr float kCount = kFar - kNear + 1;
  return share_of_body(outside / kCount, inside / kCount, body);
}

struct PlacedEdge {
  double station_px, offset_px, sigma_px;
  float step;
  double blur_excess;
  OutsideLevel outside;
};

// Edges at whole stations: between two neighbours on the same stretch of rim, by linear interpolation.
void place_at_stations(std::vector<PlacedEdge> placed, RimEdges& out) {
  constexpr double kMaxApartPx = 1.8, kMaxJumpPx = 3.0;
  std::sort(placed.begin(), placed.end(),
            [](const PlacedEdge& a, const PlacedEdge& b) { return a.station_px < b.station_px; });
  const auto add = [&](int station, const PlacedEdge& edge) {
    if (!out.points.empty() && out.points.back().station_px >= station) return;
    EdgePoint point;
    point.station_px = station, point.offset_px = edge.offset_px, point.sigma_px = edge.sigma_px;
    point.outside_dip = edge.outside.dip, point.outside_bump = edge.outside.bump;
    point.inside_ledge = edge.outside.ledge, point.blur_excess = edge.blur_excess;
    out.points.push_back(point);
    out.step.push_back(edge.step);
  };
  for (std::size_t k = 0; k < placed.size(); ++k) {
    const PlacedEdge& a = placed[k];
    const double whole = std::round(a.station_px);
    if (std::abs(a.station_px - whole) < 1e-6) {
      add(static_cast<int>(whole), a);
      continue;
    }
    if (k + 1 == placed.size()) break;
    const PlacedEdge& b = placed[k + 1];
    const double apart = b.station_px - a.station_px;
    if (apart > kMaxApartPx || std::abs(b.offset_px - a.offset_px) > kMaxJumpPx) continue;
    for (int s = static_cast<int>(std::ceil(a.station_px)); s < b.station_px - 1e-6; ++s) {
      const double t = (s - a.station_px) / apart;
      PlacedEdge between = t < 0.5 ? a : b;
      between.offset_px = a.offset_px + t * (b.offset_px - a.offset_px);
      between.sigma_px = std::hypot((1 - t) * a.sigma_px, t * b.sigma_px);
      between.step = static_cast<float>((1 - t) * a.step + t * b.step);
      add(s, between);
    }
  }
}

}  // namespace

RimEdges find_rim_edges(const cv::Mat& image, const SilhouetteFrame& frame, const ExpectedRim& rim, Polarity polarity,
                        EdgeMethod method, const EdgeConfig& config) {
  const bool invert = polarity == Polarity::dark;
  ScanLines scan;
  std::vector<StepEdge> edges;
  if (method == EdgeMethod::best) {
    scan = scan_pixel_lines(image, frame, rim, invert, config);
    edges = fit_step_edges(scan, trace_rim(scan, true, config), config.blur_region_stations);
  } else if (method == EdgeMethod::pixel) {
    scan = scan_stations(image, frame, rim, 1.0, invert, config);
    edges = highest_gradient_edges(scan);
  } else {
    scan = scan_stations(image, frame, rim, config.scan_spacing_px, invert, config);
    edges = zero_crossing_edges(scan, trace_rim(scan, false, config));
  }

  std::vector<PlacedEdge> placed;
  placed.reserve(edges.size());
  const std::vector<OutsideLevel> outside =
      method == EdgeMethod::best ? outside_levels(scan, edges) : std::vector<OutsideLevel>(edges.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const StepEdge& edge = edges[i];
    const ObservedPoint p = scan.at(scan.lines[edge.line], edge.position_px);
    placed.push_back({frame.station_px(p), frame.offset_px(p), edge.sigma_px, static_cast<float>(edge.step),
                      edge.blur_excess, outside[i]});
  }
  RimEdges out;
  place_at_stations(std::move(placed), out);

  const double full_scale = image.depth() == CV_16U ? 65535.0 : 255.0;
  const double sign = inward_sign(rim.side) * (invert ? -1.0 : 1.0);  // towards the brighter side
  for (EdgePoint& point : out.points) {
    const ObservedPoint p = frame.at(point.station_px, point.offset_px);
    const SobelGradient g = image.depth() == CV_16U ? sobel_at<unsigned short>(image, p, full_scale)
                                                    : sobel_at<unsigned char>(image, p, full_scale);
    const double along = g.x * frame.direction_x + g.y * frame.direction_y;
    const double across = sign * (g.y * frame.direction_x - g.x * frame.direction_y);
    point.magnitude = std::hypot(g.x, g.y);
    point.direction_deg = std::atan2(across, along) * 180 / std::numbers::pi;
    point.body_share = body_share(image, frame, rim, point, polarity);
  }
  return out;
}

}  // namespace imprint
