#include "node/edge/forging_ends.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>

#include "node/edge/body_brightness.h"
#include "node/edge/edge_path.h"
#include "node/edge/outside_level.h"
#include "node/edge/scan_lines.h"
#include "node/edge/step_edges.h"

namespace imprint {
namespace {

// Upper quartile over a broad band about the axis at one station, so that scale on a part of it does not hide the body;
// negative when the axis has left the image.
double band_level(const cv::Mat& image, const SilhouetteFrame& frame, double station, const EndSearch& search,
                  Polarity polarity) {
  if (grey_at(image, frame.at(station, search.axis_offset_px), polarity) < 0) return -1.0;
  std::vector<double> values;
  for (int k = -10; k <= 10; ++k) {
    const double value =
        grey_at(image, frame.at(station, search.axis_offset_px + 0.035 * k * search.diameter_px), polarity);
    if (value >= 0) values.push_back(value);
  }
  const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(3 * values.size() / 4);
  std::nth_element(values.begin(), quartile, values.end());
  return *quartile;
}

struct ArcPoint {
  double across;  ///< offset from the axis in half diameters
  double station_px;
};

// The outline of an end face: half an ellipse about the axis, and a lean. Linear in its coefficients.
Eigen::Vector3d arc_terms(double across) {
  return {1.0, across, 1.0 - std::sqrt(std::max(0.0, 1.0 - across * across))};
}

struct ArcFit {
  Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();
  double apex_variance = 0.0;  ///< for points with a variance of 1
  double rms = 0.0;
  double shared_variance = 0.0;  ///< covariance of residuals some rows apart: what haze moves together
  int count = 0;
};

// Least squares through the points that lie within `reach` of the arc given.
std::optional<ArcFit> refit_arc(const std::vector<ArcPoint>& points, const Eigen::Vector3d& from, double reach) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  ArcFit fit;
  double least = 1, most = -1;
  for (const ArcPoint& p : points) {
    const Eigen::Vector3d g = arc_terms(p.across);
    if (std::abs(p.station_px - g.dot(from)) > reach) continue;
    normal += g * g.transpose(), right += p.station_px * g;
    least = std::min(least, p.across), most = std::max(most, p.across);
    ++fit.count;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  if (fit.count < 6 || solver.info() != Eigen::Success || !(solver.vectorD().minCoeff() > 1e-7)) return std::nullopt;
  fit.coefficients = solver.solve(right);
  fit.apex_variance = solver.solve(Eigen::Vector3d::UnitX())[0];
  constexpr std::size_t kApart = 4;  // beyond what blur and noise share
  std::vector<double> residuals;
  double squares = 0, products = 0;
  for (const ArcPoint& p : points) {
    if (std::abs(p.station_px - arc_terms(p.across).dot(from)) > reach) continue;
    residuals.push_back(p.station_px - arc_terms(p.across).dot(fit.coefficients));
    squares += residuals.back() * residuals.back();
    if (residuals.size() > kApart) products += residuals.back() * residuals[residuals.size() - 1 - kApart];
  }
  fit.rms = std::sqrt(squares / std::max(1, fit.count - 3));
  fit.shared_variance = std::max(0.0, products / std::max(1, fit.count - 3));
  return fit;
}

// The arc that most points agree with (consensus of threes); of arcs with about as many, the outermost: scale on the
// end moves its points inwards.
std::optional<ArcFit> consensus_arc(const std::vector<ArcPoint>& points, double outward) {
  constexpr double kAgreePx = 0.5;
  const std::size_t n = points.size(), third = n / 3;
  if (third < 2) return std::nullopt;
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  double best_score = 0;
  const std::size_t every = std::max<std::size_t>(1, third / 8);
  for (std::size_t i = 0; i < third; i += every) {
    for (std::size_t k = third; k < 2 * third; k += every) {
      for (std::size_t m = 2 * third; m < n; m += every) {
        Eigen::Matrix3d a;
        a << arc_terms(points[i].across).transpose(), arc_terms(points[k].across).transpose(),
            arc_terms(points[m].across).transpose();
        if (std::abs(a.determinant()) < 1e-6) continue;
        const Eigen::Vector3d arc =
            a.inverse() * Eigen::Vector3d(points[i].station_px, points[k].station_px, points[m].station_px);
        if (outward * arc[2] > 3.0) continue;  // an end face bulges outwards or, square to the view, not at all
        double score = 0;
        for (const ArcPoint& p : points) {
          const double out = outward * (p.station_px - arc_terms(p.across).dot(arc));
          score += std::abs(out) < kAgreePx ? 1.0 - std::abs(out) / kAgreePx : out > kAgreePx ? -0.5 : 0.0;
        }
        if (score > best_score) best_score = score, best = arc;
      }
    }
  }
  if (!(best_score > 0)) return std::nullopt;
  auto fit = refit_arc(points, best, 2 * kAgreePx);
  if (fit) fit = refit_arc(points, fit->coefficients, 2 * kAgreePx);
  return fit;
}

}  // namespace

std::optional<double> walk_to_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search,
                                  Polarity polarity) {
  const double outward = search.at_start ? -1.0 : 1.0;
  const int inside_px = static_cast<int>(0.5 * search.diameter_px),
            outside_px = static_cast<int>(0.5 * search.diameter_px);
  std::vector<double> body;
  for (int k = -2 * inside_px; k < -inside_px / 2; ++k) {
    const double level = band_level(image, frame, search.station_px + outward * k, search, polarity);
    if (level >= 0) body.push_back(level);
  }
  if (body.size() < 8) return std::nullopt;
  const auto middle = body.begin() + static_cast<std::ptrdiff_t>(body.size() / 2);
  std::nth_element(body.begin(), middle, body.end());
  // Where it falls off most: from the levels over a fifth of a diameter before to those behind.
  const int half = std::max(6, static_cast<int>(0.2 * search.diameter_px));
  std::vector<double> levels;
  for (int k = -inside_px - half; k <= outside_px + half; ++k)
    levels.push_back(band_level(image, frame, search.station_px + outward * k, search, polarity));
  const auto usable = static_cast<std::size_t>(
      std::find_if(levels.begin() + inside_px + half, levels.end(), [](double v) { return v < 0; }) - levels.begin());
  const auto mean = [&](std::size_t from, std::size_t to) {
    double sum = 0;
    for (std::size_t i = from; i < to; ++i) sum += levels[i];
    return sum / static_cast<double>(to - from);
  };
  double deepest = 0;
  std::size_t at = 0;
  const auto width = static_cast<std::size_t>(half);
  for (std::size_t i = width; i + 4 <= usable; ++i) {
    const double fall = mean(i - width, i) - mean(i, std::min(usable, i + width));
    if (fall > deepest) deepest = fall, at = i;
  }
  if (!(deepest > 0.2 * *middle)) return std::nullopt;
  return search.station_px + outward * (static_cast<double>(at) - inside_px - half - 0.5);
}

LocatedEnd locate_end(const cv::Mat& image, const SilhouetteFrame& frame, const EndSearch& search, Polarity polarity,
                      const EdgeConfig& config) {
  constexpr double kMostDip = 0.06, kMostBump = 0.18;  // of the step: beyond lies scale, colder or glowing faintly
  constexpr double kLeastRows = 0.35;                  // that must have seen it: less may be any straight border nearby
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
  const double radius_px = 0.5 * search.diameter_px;
  const std::vector<StepEdge> edges = fit_step_edges(scan, trace_rim(scan, true, config), config.blur_region_stations);
  const std::vector<OutsideLevel> outside = outside_levels(scan, edges);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const StepEdge& edge = edges[i];
    if (outside[i].dip > kMostDip || outside[i].bump > kMostBump) continue;
    const ObservedPoint p = scan.at(scan.lines[edge.line], edge.position_px);
    points.push_back({(frame.offset_px(p) - search.axis_offset_px) / radius_px, frame.station_px(p)});
  }
  const auto arc = consensus_arc(points, search.at_start ? -1.0 : 1.0);
  if (!arc || arc->count < kLeastRows * 2.0 * reach) return end;
  end.visible = true;
  end.station_px = arc->coefficients[0];
  // One independent point in five rows. Haze moves the end as a whole too, which no residual about the arc shows: by
  // about three times of what it bends it.
  constexpr double kRowsTogether = 5.0, kAsAWhole = 3.0;
  end.sigma_px = std::max(0.01, std::sqrt(kRowsTogether * arc->apex_variance * arc->rms * arc->rms +
                                          kAsAWhole * kAsAWhole * arc->shared_variance));
  return end;
}

}  // namespace imprint
