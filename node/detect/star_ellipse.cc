#include "node/detect/star_ellipse.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

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
/// passes half-way down, or a negative number. Steps are half a px, farther out one: a long edge is a blunt one.
double first_fall_px(const GreyImage& level, const Eigen::Vector2d& start, const Eigen::Vector2d& direction, double top,
                     double min_contrast) {
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
    const double value = level.bilinear(p);
    values[static_cast<std::size_t>(n)] = value;
    lowest = std::min(lowest, value);
    const double depth = top - lowest;
    if (depth < min_contrast) continue;
    while (half_at < n && values[static_cast<std::size_t>(half_at)] > top - 0.5 * depth) ++half_at;
    // The valley is as wide as the dot's radius: past it the ring begins.
    const bool past_valley = n >= half_at + 3 && distance_px(n) >= 2.0 * distance_px(half_at);
    if (value > lowest + 0.4 * depth || past_valley) break;
  }
  if (top - lowest < min_contrast || half_at == 0) return -1.0;
  const double half = 0.5 * (top + lowest);
  while (half_at < n && values[static_cast<std::size_t>(half_at)] > half) ++half_at;
  if (half_at >= n) return -1.0;
  const double above = values[static_cast<std::size_t>(half_at) - 1];
  const double below = values[static_cast<std::size_t>(half_at)];
  const double share = above > below ? std::clamp((above - half) / (above - below), 0.0, 1.0) : 0.5;
  return distance_px(half_at - 1) + share * (distance_px(half_at) - distance_px(half_at - 1));
}

/// First round: nothing is known but a place inside.
std::optional<Ellipse> rough_ellipse(const GreyImage& level, const Eigen::Vector2d& start, double min_contrast) {
  const double top = level.bilinear(start);
  EdgePoints edge;
  double mean = 0.0;
  double smallest = std::numeric_limits<double>::max();
  constexpr int rough_rays = rays / 2;
  for (int i = 0; i < rough_rays; ++i) {
    // Round the clock in steps of 150 degrees: what is no ellipse fails on the first few.
    const auto ray = static_cast<std::size_t>(2 * (i * 5 % rough_rays));
    const double r = first_fall_px(level, start, directions.unit[ray], top, min_contrast);
    if (r > 0.0) {
      edge.add(r * directions.unit[ray]);
      mean += r;
      smallest = std::min(smallest, r);
    } else if (i + 1 - static_cast<int>(edge.count) > max_failed_rays / 2) {
      return std::nullopt;
    }
    // Some ray must be as short as the minor axis allows, wherever in the ellipse it starts.
    if (i + 1 == rough_rays / 2 && smallest > 1.3 * max_level_semi_minor_px) return std::nullopt;
  }
  mean /= static_cast<double>(edge.count);
  for (std::size_t i = 0; i < edge.count; ++i) edge.points[i] /= mean;
  const auto ellipse =
      fit_ellipse({edge.points.data(), edge.count}, {edge.weights.data(), edge.count}, Ellipse::circle(start, mean));
  if (!ellipse) return std::nullopt;
  // Most spots of a texture end here: their outline is nowhere near an ellipse.
  constexpr double near = 0.3;  // radii
  std::size_t far_points = 0;
  for (std::size_t i = 0; i < edge.count; ++i) {
    if (std::abs(ellipse->radius_of(start + mean * edge.points[i]) - 1.0) > near) ++far_points;
  }
  return far_points > edge.count / 4 ? std::nullopt : ellipse;
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
        if (level_.contains(p)) inside[n++] = level_.bilinear(p);
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
      if (valley_[i] >= 0.0) sorted[seen++] = valley_[i];
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
      if (valley_[i] < 0.0 || white_ - valley_[i] < 0.5 * (white_ - black_)) continue;
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

  [[nodiscard]] double valley(std::size_t ray) const {
    double sum = 0.0;
    for (const double radius : {1.4, 1.5, 1.6}) {
      const Eigen::Vector2d p = place(radius, ray);
      if (!level_.contains(p)) return -1.0;
      sum += level_.bilinear(p);
    }
    return sum / 3.0;
  }

  /// Where the ray falls through `half`, nearest to 1, in radii; negative when it does not.
  [[nodiscard]] double crossing(std::size_t ray, double half) const {
    constexpr double first = 0.4;
    constexpr double step = 0.08;
    constexpr int steps = 14;
    double best = -1.0;
    double last = level_.bilinear(place(first, ray));
    for (int k = 1; k <= steps; ++k) {
      const double value = level_.bilinear(place(first + k * step, ray));
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

bool has_allowed_axes(const Ellipse& ellipse, const DetectConfig& config) {
  const EllipseAxes axes = axes_of(ellipse);
  return axes.semi_minor_px >= min_level_semi_minor_px && axes.semi_minor_px <= max_level_semi_minor_px &&
         axes.semi_major_px <= config.max_axis_ratio * axes.semi_minor_px;
}

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

}  // namespace

std::optional<StarEllipse> find_star_ellipse(const GreyImage& level, const Eigen::Vector2d& start,
                                             const DetectConfig& config) {
  if (!level.contains(start)) return std::nullopt;
  auto ellipse = rough_ellipse(level, start, config.min_contrast);
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

}  // namespace imprint
