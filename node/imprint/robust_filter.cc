#include "node/imprint/robust_filter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "node/imprint/rim_agreement.h"
#include "node/imprint/rim_steps.h"
#include "node/imprint/trusted_runs.h"

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

// How much wider the edge is than its region's: at the widest place that is near and that only wider points lie
// between, for a strip beside the rim begins and ends too thin to show.
std::vector<double> widest_near(const std::vector<EdgePoint>& points) {
  constexpr double kWider = 0.05, kReach = 0.012;  // of the blur; of the rim's length
  std::vector<double> excess(points.size());
  if (points.empty()) return excess;
  const double reach = kReach * (points.back().station_px - points.front().station_px);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto is_one_with = [&](std::size_t k) {
      return points[k].blur_excess > kWider && std::abs(points[k].station_px - points[i].station_px) <= reach;
    };
    excess[i] = std::max(0.0, points[i].blur_excess);
    for (std::size_t k = i; is_one_with(k); --k) {
      excess[i] = std::max(excess[i], points[k].blur_excess);
      if (k == 0) break;
    }
    for (std::size_t k = i; k < points.size() && is_one_with(k); ++k)
      excess[i] = std::max(excess[i], points[k].blur_excess);
  }
  return excess;
}

// What the point's own looks say: a weak edge, one that lies among restless directions or a bad fit counts less.
RimCurve rated_curve(const std::vector<EdgePoint>& points) {
  constexpr double kDarkShare = 0.25, kBrightShare = 0.5;  // of the body's brightness: beams behind it, and its own rim
  constexpr double kDip = 0.03, kBump = 0.09, kLedge = 0.4;  // of the step: half the trust is gone
  constexpr double kBlurExcess = 0.35;                       // of the blur, likewise
  constexpr double kNoiseTurnDeg = 60, kMostSigma = 0.2, kFairSigma = 0.2;
  RimCurve curve;
  if (points.empty()) return curve;
  curve.reserve(points.size());
  std::vector<double> magnitudes, directions, sigmas;
  for (const EdgePoint& p : points) {
    magnitudes.push_back(p.magnitude), directions.push_back(p.direction_deg), sigmas.push_back(p.sigma_px);
  }
  const double magnitude = median(magnitudes), direction = median(directions), sigma = std::max(1e-4, median(sigmas));
  const std::vector<double> unrest = direction_unrest(points, direction), wider = widest_near(points);
  // Of the calmer part of the rim: scale may border more than half of it.
  const double calm_deg = std::max(1.0, quantile(unrest, 0.3));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const EdgePoint& p = points[i];
    const double by_body = std::clamp((p.body_share - kDarkShare) / (kBrightShare - kDarkShare), 0.0, 1.0);
    const double by_magnitude = std::min(1.0, p.magnitude / (0.4 * magnitude + 1e-9));
    // Where the contrast is low, noise alone turns the gradient: by about 30 deg for a pixel of the edge's own sigma.
    const double allowed_deg = std::hypot(2.5 * calm_deg, kNoiseTurnDeg * std::min(p.sigma_px, kMostSigma));
    const double by_direction = std::pow(std::min(1.0, allowed_deg / std::max(1e-3, unrest[i])), 2);
    const double excess = std::max(1.0, p.sigma_px / std::max(1.5 * sigma, kFairSigma));
    // Scale that is colder than what is behind it, or glows faintly itself, lies between this edge and the true rim.
    const double by_outside =
        1.0 / (1.0 + std::pow(p.outside_dip / kDip, 2)) / (1.0 + std::pow(p.outside_bump / kBump, 2));
    // Something between the levels of the body and the background: a beam that hugs the rim.
    const double by_inside = 1.0 / (1.0 + std::pow(p.inside_ledge / kLedge, 4));
    // Two steps close together pass for a wider one.
    const double by_blur = 1.0 / (1.0 + std::pow(wider[i] / kBlurExcess, 4));
    curve.push_back({static_cast<double>(p.station_px), p.offset_px,
                     by_blur * by_inside * by_body * by_magnitude * by_direction * by_outside / (excess * excess)});
  }
  return curve;
}

// Whether the samples lie to one side of the station: there a parabola runs away.
bool lopsided(const RimCurve& near, double station_px, double half) {
  double sum = 0, moment = 0;
  for (const CurveSample& s : near) sum += s.weight, moment += s.weight * (s.station_px - station_px);
  return std::abs(moment) > 0.2 * half * sum;
}

// Robust (bisquare) local fit at every whole station; never across the cuts. Weight: the mean trust in its samples,
// less where they lie to one side or are few.
RimCurve local_regression(const RimCurve& curve, const std::vector<double>& cuts, int window, double noise_px,
                          double least_trust) {
  RimCurve out;
  if (curve.empty()) return out;
  const double half = 0.5 * window;
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
    const int degree = lopsided(near, station, half) ? 1 : 2;
    auto fit = fit_parabola(near.data(), near.data() + near.size(), station, degree);
    if (near.size() > 4) {
      prior.clear();
      for (const CurveSample& s : near) prior.push_back(s.weight);
      for (int pass = 0; pass < 2 && fit; ++pass) {
        const LocalParabola current = *fit;
        for (std::size_t i = 0; i < near.size(); ++i) {
          const double r = (near[i].offset_px - current.at(near[i].station_px)) / scale;
          near[i].weight = prior[i] * (std::abs(r) < 1 ? (1 - r * r) * (1 - r * r) : 0.0);
        }
        fit = fit_parabola(near.data(), near.data() + near.size(), station, degree);
      }
    }
    for (const CurveSample& s : near) trust += s.weight;
    // A cut takes away one half of the window at most: that is no reason for distrust.
    const double share = fit ? std::clamp(2 * trust / kernel, 0.0, 1.0) : 0.0;
    out.push_back({station, fit ? fit->c0 : 0.0, share < least_trust ? 0.0 : share});
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

}  // namespace

FilteredCurves robust_filter(const Silhouette& silhouette, const FilterConfig& config) {
  RimCurve upper = rated_curve(validate_regions(silhouette.upper, config));
  RimCurve lower = rated_curve(validate_regions(silhouette.lower, config));
  drop_spikes(upper), drop_spikes(lower);
  const double noise_upper = rim_noise_px(upper), noise_lower = rim_noise_px(lower);
  const std::vector<double> upper_cuts = find_cuts(upper, noise_upper, config),
                            lower_cuts = find_cuts(lower, noise_lower, config);
  reject_disagreement(upper, lower, config);

  // A rim is held against the others' in the fusion, an axis is not.
  constexpr double kLeastRimTrust = 0.2, kLeastAxisTrust = 0.35;
  FilteredCurves out;
  out.upper = local_regression(upper, upper_cuts, config.best_rim_window, noise_upper, kLeastRimTrust);
  out.lower = local_regression(lower, lower_cuts, config.best_rim_window, noise_lower, kLeastRimTrust);
  const auto least_run = static_cast<std::size_t>(config.min_trusted_run);
  drop_short_runs(out.upper, least_run), drop_short_runs(out.lower, least_run);
  drop_islands(out.upper, 1.0, upper), drop_islands(out.lower, -1.0, lower);
  const RimCurve axis = middle_of(upper, lower);
  out.axis = local_regression(axis, {}, config.best_axis_window, rim_noise_px(axis), kLeastAxisTrust);
  bridge_untrusted(out.upper), bridge_untrusted(out.lower), bridge_untrusted(out.axis);
  return out;
}

}  // namespace imprint
