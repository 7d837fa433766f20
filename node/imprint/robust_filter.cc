#include "node/imprint/robust_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "node/imprint/rim_steps.h"

namespace imprint {
namespace {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

// How restless the gradient's direction is about each point, deg: root mean square off the rim's usual direction. A rim
// against the background is straight over a few px; the border of scale is ragged.
std::vector<double> direction_unrest(const std::vector<EdgePoint>& points, double usual_deg) {
  constexpr int kHalf = 7;  // stations
  std::vector<double> unrest(points.size());
  std::size_t first = 0, last = 0;
  double squares = 0;
  const auto square = [&](std::size_t i) { return std::pow(points[i].direction_deg - usual_deg, 2); };
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (; last < points.size() && points[last].station_px <= points[i].station_px + kHalf; ++last)
      squares += square(last);
    for (; points[first].station_px < points[i].station_px - kHalf; ++first) squares -= square(first);
    unrest[i] = std::sqrt(std::max(0.0, squares) / static_cast<double>(last - first));
  }
  return unrest;
}

// What the point's own looks say: a weak edge, one that lies among restless directions or a bad fit counts less.
RimCurve rated_curve(const std::vector<EdgePoint>& points) {
  constexpr double kDarkShare = 0.25, kBrightShare = 0.5;  // of the body's brightness: beams behind it, and its own rim
  constexpr double kDip = 0.025, kBump = 0.07;             // of the step: half the trust is gone
  RimCurve curve;
  if (points.empty()) return curve;
  curve.reserve(points.size());
  std::vector<double> magnitudes, directions, sigmas;
  for (const EdgePoint& p : points) {
    magnitudes.push_back(p.magnitude), directions.push_back(p.direction_deg), sigmas.push_back(p.sigma_px);
  }
  const double magnitude = median(magnitudes), direction = median(directions), sigma = std::max(1e-4, median(sigmas));
  const std::vector<double> unrest = direction_unrest(points, direction);
  // Of the calmer part of the rim: scale may border more than half of it.
  const double calm_deg = std::max(1.0, quantile(unrest, 0.3));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const EdgePoint& p = points[i];
    const double by_body = std::clamp((p.body_share - kDarkShare) / (kBrightShare - kDarkShare), 0.0, 1.0);
    const double by_magnitude = std::min(1.0, p.magnitude / (0.7 * magnitude + 1e-9));
    const double by_direction = std::pow(std::min(1.0, 2.5 * calm_deg / std::max(1e-3, unrest[i])), 2);
    const double excess = std::max(1.0, p.sigma_px / (1.5 * sigma));
    // Scale that is colder than what is behind it, or glows faintly itself, lies between this edge and the true rim.
    const double by_outside =
        1.0 / (1.0 + std::pow(p.outside_dip / kDip, 2)) / (1.0 + std::pow(p.outside_bump / kBump, 2));
    curve.push_back({static_cast<double>(p.station_px), p.offset_px,
                     by_body * by_magnitude * by_direction * by_outside / (excess * excess)});
  }
  return curve;
}

// Robust (bisquare) local fit at every whole station; never across the cuts. Weight: the mean trust in its samples,
// less where they lie to one side or are few.
RimCurve local_regression(const RimCurve& curve, const std::vector<double>& cuts, int window, double noise_px) {
  RimCurve out;
  if (curve.empty()) return out;
  const double half = 0.5 * window;
  constexpr double kLeastTrust = 0.2;
  const double scale = 4.685 * std::max(noise_px, 0.02);
  double kernel = 0;  // the sum of the weights of a full window
  for (int k = -static_cast<int>(half); k <= static_cast<int>(half); ++k)
    kernel += std::pow(1 - std::pow(std::abs(k) / (half + 1), 3), 3);
  RimCurve near;
  std::vector<double> prior;
  for (double station = curve.front().station_px; station <= curve.back().station_px + 0.5; station += 1.0) {
    const auto next = std::lower_bound(cuts.begin(), cuts.end(), station);
    const double low = std::max(station - half, next == cuts.begin() ? -1e18 : *(next - 1));
    const double high = std::min(station + half, next == cuts.end() ? 1e18 : *next);
    const SampleRange range = samples_near(curve, 0.5 * (low + high), 0.5 * (high - low));
    near.assign(curve.begin() + static_cast<std::ptrdiff_t>(range.first),
                curve.begin() + static_cast<std::ptrdiff_t>(range.last));
    double trust = 0;
    for (CurveSample& s : near) {
      const double z = (s.station_px - station) / (half + 1);
      s.weight *= std::pow(1 - std::abs(z * z * z), 3);
    }
    auto fit = fit_parabola(near.data(), near.data() + near.size(), station, 2);
    if (near.size() > 4) {
      prior.clear();
      for (const CurveSample& s : near) prior.push_back(s.weight);
      for (int pass = 0; pass < 2 && fit; ++pass) {
        const LocalParabola current = *fit;
        for (std::size_t i = 0; i < near.size(); ++i) {
          const double r = (near[i].offset_px - current.at(near[i].station_px)) / scale;
          near[i].weight = prior[i] * (std::abs(r) < 1 ? (1 - r * r) * (1 - r * r) : 0.0);
        }
        fit = fit_parabola(near.data(), near.data() + near.size(), station, 2);
      }
    }
    for (const CurveSample& s : near) trust += s.weight;
    // A cut takes away one half of the window at most: that is no reason for distrust.
    const double share = fit ? std::clamp(2 * trust / kernel, 0.0, 1.0) : 0.0;
    out.push_back({station, fit ? fit->c0 : 0.0, share < kLeastTrust ? 0.0 : share});
  }
  return out;
}

// Finite offsets where nothing is trusted: on the line between the trusted neighbours.
void bridge_untrusted(RimCurve& curve) {
  std::size_t before = curve.size();
  for (std::size_t i = 0; i <= curve.size(); ++i) {
    if (i < curve.size() && !(curve[i].weight > 0)) continue;
    const std::size_t from = before == curve.size() ? 0 : before + 1;
    for (std::size_t k = from; k < i && i - from < curve.size(); ++k) {
      if (before == curve.size()) {
        curve[k].offset_px = i < curve.size() ? curve[i].offset_px : 0.0;
      } else if (i == curve.size()) {
        curve[k].offset_px = curve[before].offset_px;
      } else {
        const double t =
            (curve[k].station_px - curve[before].station_px) / (curve[i].station_px - curve[before].station_px);
        curve[k].offset_px = (1 - t) * curve[before].offset_px + t * curve[i].offset_px;
      }
    }
    before = i;
  }
}

// Where the middle of the rims leaves its smooth course, one of them is wrong: scale moves an edge inwards, so the
// one that lies further in is not believed.
void reject_disagreement(RimCurve& upper, RimCurve& lower, const FilterConfig& config) {
  const RimCurve middle = middle_of(upper, lower);
  if (middle.size() < 20) return;
  const double noise = std::max(0.05, rim_noise_px(middle));
  RimCurve course = middle;
  std::vector<double> residual(middle.size(), 0.0);
  std::vector<char> reached(middle.size(), 0);
  for (int pass = 0; pass < 5; ++pass) {
    // A coarse grid will do: the course is smooth by intent.
    constexpr double kEvery = 10;
    const double first = middle.front().station_px, last = middle.back().station_px;
    std::vector<double> grid;
    for (double s = first; s <= last + kEvery; s += kEvery)
      grid.push_back(fit_at_station(course, samples_near(course, std::min(s, last), 0.5 * config.agreement_window),
                                    std::min(s, last), 2)
                         .value_or(std::nan("")));
    for (std::size_t i = 0; i < middle.size(); ++i) {
      const double at = (middle[i].station_px - first) / kEvery;
      const auto g = std::min(static_cast<std::size_t>(at), grid.size() - 2);
      const double t = at - static_cast<double>(g);
      const double smooth = (1 - t) * grid[g] + t * grid[g + 1];
      reached[i] = !std::isnan(smooth);
      residual[i] = reached[i] ? middle[i].offset_px - smooth : 0.0;
    }
    const double scale = 4.685 * std::max(noise, 0.25 * config.min_disagreement_px);
    for (std::size_t i = 0; i < middle.size(); ++i) {
      const double r = residual[i] / scale;
      course[i].weight = middle[i].weight * (std::abs(r) < 1 ? (1 - r * r) * (1 - r * r) : 0.0);
    }
  }
  // Out of reach of any trusted middle, its parabola over the whole length still tells a rim that is far off.
  constexpr double kEitherPx = 1.5, kFarOffPx = 5.0;
  const double centre = 0.5 * (middle.front().station_px + middle.back().station_px);
  if (const auto whole = fit_parabola(course.data(), course.data() + course.size(), centre, 2)) {
    for (std::size_t i = 0; i < middle.size(); ++i) {
      const double off = middle[i].offset_px - whole->at(middle[i].station_px);
      if (!reached[i] && std::abs(off) > kFarOffPx) residual[i] = off;
    }
  }
  const double limit = std::max(config.min_disagreement_px, 5 * noise);
  const auto distrust = [](RimCurve& rim, double station, double factor) {
    const SampleRange range = samples_near(rim, station, 0.25);
    for (std::size_t k = range.first; k < range.last; ++k) rim[k].weight *= factor;
  };
  for (std::size_t i = 0; i < middle.size(); ++i) {
    const double excess = std::abs(residual[i]) / limit;
    if (excess <= 0.5) continue;
    const double factor = excess > 1 ? 0.0 : 2 * (1 - excess);
    // Far off it may as well be the other rim, taken for the edge of something behind the forging.
    const bool either = std::abs(residual[i]) > kEitherPx;
    if (residual[i] > 0 || either) distrust(upper, middle[i].station_px, factor);
    if (residual[i] < 0 || either) distrust(lower, middle[i].station_px, factor);
  }
}

}  // namespace

FilteredCurves robust_filter(const Silhouette& silhouette, const FilterConfig& config) {
  RimCurve upper = rated_curve(validate_regions(silhouette.upper, config));
  RimCurve lower = rated_curve(validate_regions(silhouette.lower, config));
  drop_spikes(upper), drop_spikes(lower);
  const double noise_upper = rim_noise_px(upper), noise_lower = rim_noise_px(lower);
  const std::vector<double> upper_cuts = find_cuts(upper, noise_upper, config),
                            lower_cuts = find_cuts(lower, noise_lower, config);
  reject_disagreement(upper, lower, config);

  FilteredCurves out;
  const RimCurve axis = middle_of(upper, lower);
  out.upper = local_regression(upper, upper_cuts, config.best_rim_window, noise_upper);
  out.lower = local_regression(lower, lower_cuts, config.best_rim_window, noise_lower);
  out.axis = local_regression(axis, {}, config.best_axis_window, rim_noise_px(axis));
  bridge_untrusted(out.upper), bridge_untrusted(out.lower), bridge_untrusted(out.axis);
  return out;
}

}  // namespace imprint
