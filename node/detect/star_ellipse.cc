#include "node/detect/star_ellipse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/LU>

namespace imprint {
namespace {

constexpr int rays = 24;
constexpr int max_failed_rays = 6;  // a quarter of the edge may be hidden

struct Directions {
  std::array<Eigen::Vector2d, rays> unit;
  Directions() {
    for (int i = 0; i < rays; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / rays;
      unit[static_cast<std::size_t>(i)] = {std::cos(angle), std::sin(angle)};
    }
  }
};
const Directions directions;

struct EdgePoints {
  std::array<Eigen::Vector2d, rays> points;  // in the frame the rays were cast in
  std::array<double, rays> weights;
  std::size_t count = 0;

  void add(const Eigen::Vector2d& p) {
    points[count] = p;
    weights[count++] = 1.0;
  }
};

/// Walks from `start` until the valley behind the first fall has been seen; the distance in px at which the grey level
/// passes half-way down, or a negative number; lowers `lowest_seen` to the lowest level met. Steps are half a px,
/// farther out one: a long edge is a blunt one.
double first_fall_px(const GreyImage& level, const Eigen::Vector2d& start, const Eigen::Vector2d& direction, double top,
                     double min_contrast, double* lowest_seen) {
  constexpr int fine_steps = 12;
  constexpr int max_steps = 40;  // 34 px: an ellipse with the largest minor axis of a level and a ratio of six
  const auto distance_px = [](int n) { return n <= fine_steps ? 0.5 * n : n - 0.5 * fine_steps; };
  std::array<double, max_steps> values;  // those before n are set
  double lowest = top;
  int half_at = 0;
  int n = 0;
  for (; n < max_steps; ++n) {
    const Eigen::Vector2d p = start + distance_px(n) * direction;
    if (!level.contains(p)) break;
    const double value = level.at(p);
    values[static_cast<std::size_t>(n)] = value;
    lowest = std::min(lowest, value);
    const double depth = top - lowest;
    if (depth < min_contrast) continue;
    while (half_at < n && values[static_cast<std::size_t>(half_at)] > top - 0.5 * depth) ++half_at;
    // The valley is as wide as the dot's radius: past it the ring begins.
    const bool past_valley = n >= half_at + 3 && distance_px(n) >= 2.0 * distance_px(half_at);
    if (value > lowest + 0.4 * depth || past_valley) break;
  }
  *lowest_seen = std::min(*lowest_seen, lowest);
  if (top - lowest < min_contrast || half_at == 0) return -1.0;
  const double half = 0.5 * (top + lowest);
  while (half_at < n && values[static_cast<std::size_t>(half_at)] > half) ++half_at;
  if (half_at >= n) return -1.0;
  const double above = values[static_cast<std::size_t>(half_at) - 1];
  const double below = values[static_cast<std::size_t>(half_at)];
  const double share = above > below ? std::clamp((above - half) / (above - below), 0.0, 1.0) : 0.5;
  return distance_px(half_at - 1) + share * (distance_px(half_at) - distance_px(half_at - 1));
}

bool has_allowed_axes(const Ellipse& ellipse, const DetectConfig& config) {
  const EllipseAxes axes = axes_of(ellipse);
  return axes.semi_minor_px >= min_level_semi_minor_px && axes.semi_minor_px <= max_level_semi_minor_px &&
         axes.semi_major_px <= config.max_axis_ratio * axes.semi_minor_px;
}

/// What the first round's rays saw from a place inside.
struct FirstRays {
  EdgePoints edge;  // px from the start
  double mean_px = 0.0;
  double shortest_px = std::numeric_limits<double>::max();
  double longest_px = 0.0;
  double lowest = 0.0;  // of the grey levels seen
};

/// Nothing when too many rays meet no edge.
std::optional<FirstRays> cast_first_rays(const GreyImage& level, const Eigen::Vector2d& start, double top,
                                         double min_contrast) {
  FirstRays first;
  first.lowest = top;
  constexpr int rough_rays = rays / 2;
  for (int i = 0; i < rough_rays; ++i) {
    // Round the clock in steps of 150 degrees: what is no ellipse fails on the first few.
    const auto ray = static_cast<std::size_t>(2 * (i * 5 % rough_rays));
    const double r = first_fall_px(level, start, directions.unit[ray], top, min_contrast, &first.lowest);
    if (r > 0.0) {
      first.edge.add(r * directions.unit[ray]);
      first.mean_px += r;
      first.shortest_px = std::min(first.shortest_px, r);
      first.longest_px = std::max(first.longest_px, r);
    } else if (i + 1 - static_cast<int>(first.edge.count) > max_failed_rays / 2) {
      return std::nullopt;
    }
    // Some ray must be as short as the minor axis allows, wherever in the ellipse it starts.
    if (i + 1 == rough_rays / 2 && first.shortest_px > 1.3 * max_level_semi_minor_px) return std::nullopt;
  }
  first.mean_px /= static_cast<double>(first.edge.count);
  return first;
}

/// The ellipse through the ends of the rays; nothing when they are nowhere near one, as those of most spots of a
/// texture, or those of a long ellipse, whose far ends few rays meet.
std::optional<Ellipse> ellipse_through(const FirstRays& first, const Eigen::Vector2d& start) {
  EdgePoints edge = first.edge;
  for (std::size_t i = 0; i < edge.count; ++i) edge.points[i] /= first.mean_px;
  const auto ellipse = fit_ellipse({edge.points.data(), edge.count}, {edge.weights.data(), edge.count},
                                   Ellipse::circle(start, first.mean_px));
  if (!ellipse) return std::nullopt;
  constexpr double near = 0.3;  // radii
  std::size_t far_points = 0;
  for (std::size_t i = 0; i < edge.count; ++i) {
    if (std::abs(ellipse->radius_of(start + first.edge.points[i]) - 1.0) > near) ++far_points;
  }
  return far_points > edge.count / 4 ? std::nullopt : ellipse;
}

/// The ellipse with the second moments of the pixels round `start` that hang together and are brighter than `half`;
/// nothing when they are more than an ellipse of a level can have.
std::optional<Ellipse> ellipse_of_spot(const GreyImage& level, const Eigen::Vector2d& start, double half,
                                       double max_axis_ratio) {
  const auto most = static_cast<std::size_t>(std::numbers::pi * max_level_semi_minor_px * max_level_semi_minor_px *
                                             std::min(4.0, max_axis_ratio));
  std::vector<cv::Point> spot{{cvRound(start.x()), cvRound(start.y())}};
  const int reach = static_cast<int>(max_level_semi_minor_px * max_axis_ratio);
  const cv::Rect window =
      cv::Rect(spot[0].x - reach, spot[0].y - reach, 2 * reach + 1, 2 * reach + 1) & cv::Rect({}, level.mat().size());
  std::vector<bool> seen(static_cast<std::size_t>(window.area()), false);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (std::size_t next = 0; next < spot.size(); ++next) {
    const cv::Point p = spot[next];
    const Eigen::Vector2d d(p.x - spot[0].x, p.y - spot[0].y);
    sum += d;
    squares += d * d.transpose();
    for (const cv::Point& q : {p + cv::Point(1, 0), p - cv::Point(1, 0), p + cv::Point(0, 1), p - cv::Point(0, 1)}) {
      if (!window.contains(q) || level.pixel(q.x, q.y) <= half) continue;
      const auto at = static_cast<std::size_t>((q.y - window.y) * window.width + q.x - window.x);
      if (seen[at]) continue;
      seen[at] = true;
      spot.push_back(q);
    }
    if (spot.size() > most) return std::nullopt;
  }
  const auto n = static_cast<double>(spot.size());
  const Eigen::Vector2d mean = sum / n;
  constexpr double pixel_variance = 1.0 / 12.0;
  const Eigen::Matrix2d covariance =
      squares / n - mean * mean.transpose() + pixel_variance * Eigen::Matrix2d::Identity();
  return Ellipse{Eigen::Vector2d(spot[0].x, spot[0].y) + mean, (4.0 * covariance).inverse()};
}

/// Later rounds: rays in the frame of the ellipse so far, which is the unit circle there.
class FramedStar {
 public:
  FramedStar(const GreyImage& level, const Ellipse& guess) : level_(level), guess_(guess), frame_(frame_of(guess)) {}

  /// Grey levels inside and in the valley; false when the image ends too near.
  bool measure_levels() {
    std::array<double, 13> inside{};
    std::size_t n = 0;
    for (const double radius : {0.0, 0.3, 0.55}) {
      for (std::size_t i = 0; i < rays; i += radius == 0.0 ? rays : rays / 6) {
        const Eigen::Vector2d p = place(radius, i);
        if (level_.contains(p)) inside[n++] = level_.at(p);
      }
    }
    if (n < 5) return false;
    std::nth_element(inside.begin(), inside.begin() + static_cast<std::ptrdiff_t>(n / 2),
                     inside.begin() + static_cast<std::ptrdiff_t>(n));
    white_ = inside[n / 2];
    std::size_t seen = 0;
    std::array<double, rays> sorted{};
    for (std::size_t i = 0; i < rays; ++i) {
      valley_[i] = valley(i);
      if (!std::isnan(valley_[i])) sorted[seen++] = valley_[i];
    }
    if (seen + max_failed_rays < rays) return false;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(seen / 2),
                     sorted.begin() + static_cast<std::ptrdiff_t>(seen));
    black_ = sorted[seen / 2];
    return true;
  }

  [[nodiscard]] EdgePoints edge_points() const {
    EdgePoints edge;
    for (std::size_t i = 0; i < rays; ++i) {
      // A ray whose valley is as bright as the dot shows something that covers the edge.
      if (std::isnan(valley_[i]) || white_ - valley_[i] < 0.5 * (white_ - black_)) continue;
      const double r = crossing(i, 0.5 * (white_ + valley_[i]));
      if (r > 0.0) edge.add(r * directions.unit[i]);
    }
    return edge;
  }

  [[nodiscard]] double white() const { return white_; }
  [[nodiscard]] double black() const { return black_; }

 private:
  [[nodiscard]] Eigen::Vector2d place(double radius, std::size_t ray) const {
    return guess_.center + frame_ * (radius * directions.unit[ray]);
  }

  /// Not a number where the image ends.
  [[nodiscard]] double valley(std::size_t ray) const {
    double sum = 0.0;
    for (const double radius : {1.4, 1.5, 1.6}) {
      const Eigen::Vector2d p = place(radius, ray);
      if (!level_.contains(p)) return std::numeric_limits<double>::quiet_NaN();
      sum += level_.at(p);
    }
    return sum / 3.0;
  }

  /// Where the ray falls through `half`, nearest to 1, in radii; negative when it does not.
  [[nodiscard]] double crossing(std::size_t ray, double half) const {
    constexpr double first = 0.4;
    constexpr double step = 0.08;
    constexpr int steps = 14;
    double best = -1.0;
    double last = level_.at(place(first, ray));
    for (int k = 1; k <= steps; ++k) {
      const double value = level_.at(place(first + k * step, ray));
      if (last > half && value <= half) {
        const double r = first + step * (k - 1 + (last - half) / (last - value));
        if (best < 0.0 || std::abs(r - 1.0) < std::abs(best - 1.0)) best = r;
      }
      last = value;
    }
    return best;
  }

  const GreyImage& level_;
  Ellipse guess_;
  Eigen::Matrix2d frame_;
  double white_ = 0.0;
  double black_ = 0.0;
  std::array<double, rays> valley_{};
};

/// Fits, then fits again without the points that lie far off the first fit (a hidden or frayed part of the edge).
std::optional<Ellipse> fit_without_outliers(EdgePoints& edge, const Ellipse& guess, double* residual) {
  const std::span<const Eigen::Vector2d> points(edge.points.data(), edge.count);
  const std::span<const double> weights(edge.weights.data(), edge.count);
  auto ellipse = fit_ellipse(points, weights, guess);
  for (int round = 0; ellipse && round < 2; ++round) {
    const Eigen::Matrix2d frame = frame_of(guess);
    double sum = 0.0;
    double total = 0.0;
    for (std::size_t i = 0; i < edge.count; ++i) {
      const double off = ellipse->radius_of(guess.center + frame * points[i]) - 1.0;
      constexpr double scale = 0.1;  // dot radii; beyond it a point counts less and less
      edge.weights[i] = 1.0 / (1.0 + (off / scale) * (off / scale) * (off / scale) * (off / scale));
      sum += edge.weights[i] * off * off;
      total += edge.weights[i];
    }
    *residual = total < 0.7 * rays ? 1.0 : std::sqrt(sum / total);
    if (round == 0) ellipse = fit_ellipse(points, weights, guess);
  }
  return ellipse;
}

/// The later rounds, from a rough ellipse on.
std::optional<StarEllipse> refine(const GreyImage& level, std::optional<Ellipse> ellipse, const DetectConfig& config) {
  StarEllipse star;
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    if (!ellipse || !has_allowed_axes(*ellipse, config) || !level.contains(ellipse->center)) return std::nullopt;
    FramedStar framed(level, *ellipse);
    if (!framed.measure_levels() || framed.white() - framed.black() < config.min_contrast) return std::nullopt;
    EdgePoints edge = framed.edge_points();
    if (edge.count + max_failed_rays < rays) return std::nullopt;
    star.white = framed.white();
    star.black = framed.black();
    ellipse = fit_without_outliers(edge, *ellipse, &star.residual);
    if (star.residual > 2.0 * config.max_residual) return std::nullopt;
  }
  if (!ellipse || !has_allowed_axes(*ellipse, config) || star.residual > config.max_residual) return std::nullopt;
  star.ellipse = *ellipse;
  return star;
}

}  // namespace

std::optional<StarEllipse> find_star_ellipse(const GreyImage& level, const Eigen::Vector2d& start,
                                             const DetectConfig& config) {
  if (!level.contains(start)) return std::nullopt;
  const double top = level.at(start);
  const auto first = cast_first_rays(level, start, top, config.min_contrast);
  if (!first) return std::nullopt;
  if (auto star = refine(level, ellipse_through(*first, start), config)) return star;
  // From the end of a long dot rays see little of it: some of them pass along it.
  constexpr double long_dot = 2.5;
  constexpr double seen_by_rays = 6.0;
  if (config.max_axis_ratio <= seen_by_rays || first->longest_px < long_dot * first->shortest_px) return std::nullopt;
  const double half = 0.5 * (top + first->lowest);
  return refine(level, ellipse_of_spot(level, start, half, config.max_axis_ratio), config);
}

}  // namespace imprint
