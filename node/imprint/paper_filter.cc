#include "node/imprint/paper_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace imprint {
namespace {

// w(x) of [C] equation 1 with a = 1, hw = 0.5: the exponent reduces to ln(1/2) ((x - mu)/(mean - mu))^2.
double gaussian_weight(double x, double mu, double mean) {
  const double width = mean - mu;
  if (std::abs(width) < 1e-12) return 1.0;
  const double z = (x - mu) / width;
  return std::exp(-std::log(2.0) * z * z);
}

// Every sample replaced by the fit through its `window` neighbours of the same region.
RimCurve smooth(const RimCurve& curve, int window, int degree, const FilterConfig& config) {
  RimCurve out(curve);
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= curve.size(); ++i) {
    const bool parted = i == curve.size() || curve[i].station_px - curve[i - 1].station_px > config.max_region_gap ||
                        std::abs(curve[i].offset_px - curve[i - 1].offset_px) > config.max_region_jump_px;
    if (!parted) continue;
    for (std::size_t k = begin; k < i; ++k) {
      const auto half = static_cast<std::size_t>(window / 2);
      const SampleRange range{k >= begin + half ? k - half : begin, std::min(i, k + half + 1)};
      if (const auto value = fit_at_station(curve, range, curve[k].station_px, degree)) out[k].offset_px = *value;
    }
    begin = i;
  }
  return out;
}

RimCurve weighted_curve(const std::vector<EdgePoint>& points, EdgeMethod method) {
  const std::vector<double> weights = edge_weights(points, method);
  RimCurve curve;
  curve.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    curve.push_back({static_cast<double>(points[i].station_px), points[i].offset_px, weights[i]});
  return curve;
}

}  // namespace

std::vector<EdgePoint> validate_regions(const std::vector<EdgePoint>& points, const FilterConfig& config) {
  if (points.empty()) return {};
  const double whole = std::accumulate(points.begin(), points.end(), 0.0,
                                       [](double sum, const EdgePoint& p) { return sum + p.magnitude; }) /
                       static_cast<double>(points.size());
  std::vector<EdgePoint> valid;
  std::size_t begin = 0;
  double strength = points.front().magnitude;
  for (std::size_t i = 1; i <= points.size(); ++i) {
    const bool parted = i == points.size() || points[i].station_px - points[i - 1].station_px > config.max_region_gap ||
                        std::abs(points[i].offset_px - points[i - 1].offset_px) > config.max_region_jump_px;
    if (parted) {
      const auto length = static_cast<double>(i - begin);
      if (length >= config.min_region_length && strength / length >= config.min_region_strength * whole)
        valid.insert(valid.end(), points.begin() + static_cast<std::ptrdiff_t>(begin),
                     points.begin() + static_cast<std::ptrdiff_t>(i));
      begin = i, strength = 0;
    }
    if (i < points.size()) strength += points[i].magnitude;
  }
  return valid;
}

std::vector<double> edge_weights(const std::vector<EdgePoint>& points, EdgeMethod method) {
  std::vector<double> weights(points.size(), 1.0);
  const bool by_direction = method == EdgeMethod::orientation || method == EdgeMethod::combined;
  const bool by_magnitude = method == EdgeMethod::magnitude || method == EdgeMethod::combined;
  if (points.empty() || (!by_direction && !by_magnitude)) return weights;

  double highest = 0, mean_magnitude = 0, mean_deviation = 0;
  for (const EdgePoint& p : points) {
    highest = std::max(highest, p.magnitude);
    mean_magnitude += p.magnitude;
    mean_deviation +=
        std::abs(p.direction_deg - 90);  // both sides alike: the mean of the signed angle would be near 90 itself
  }
  mean_magnitude /= static_cast<double>(points.size()), mean_deviation /= static_cast<double>(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double direction = gaussian_weight(std::abs(points[i].direction_deg - 90), 0.0, mean_deviation);
    const double magnitude = gaussian_weight(points[i].magnitude, highest, mean_magnitude);
    weights[i] = by_direction && by_magnitude ? 0.5 * (direction + magnitude) : by_direction ? direction : magnitude;
  }
  return weights;
}

FilteredCurves paper_filter(const Silhouette& silhouette, EdgeMethod method, const FilterConfig& config) {
  FilteredCurves out;
  const RimCurve upper = weighted_curve(validate_regions(silhouette.upper, config), method);
  const RimCurve lower = weighted_curve(validate_regions(silhouette.lower, config), method);
  const RimCurve axis = middle_of(upper, lower);
  if (method == EdgeMethod::none) return {upper, lower, axis};
  const int rim_degree = method == EdgeMethod::pixel ? 0 : 2;
  out.upper = smooth(upper, config.rim_window, rim_degree, config);
  out.lower = smooth(lower, config.rim_window, rim_degree, config);
  out.axis = smooth(axis, config.axis_window, 2, config);
  return out;
}

}  // namespace imprint
