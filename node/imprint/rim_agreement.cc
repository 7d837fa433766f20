#include "node/imprint/rim_agreement.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/imprint/rim_steps.h"

namespace imprint {
namespace {

constexpr double kEitherPx = 1.5;   // further off, either rim may be the wrong one
constexpr double kLeastSay = 0.04;  // trust of either rim, below which the pair says nothing of the other
constexpr double kFarOffPx = 5.0;   // of the middle from its parabola over the whole length

double bisquare(double residual, double cutoff) {
  const double r = residual / cutoff;
  return std::abs(r) < 1 ? (1 - r * r) * (1 - r * r) : 0.0;
}

double median_size(std::vector<double> values) {
  for (double& v : values) v = std::abs(v);
  return median(std::move(values));
}

// How far the middle lies off its parabola over the whole length, and where that is too far for a body that is bent.
struct Bow {
  LocalParabola parabola;
  std::vector<double> off_px;
  double scatter_px = 0.0;  // robust standard deviation of these
  double cutoff_px = kFarOffPx;

  [[nodiscard]] double slope_at(double station_px) const {
    return parabola.c1 + 2 * parabola.c2 * (station_px - parabola.station_px);
  }
};

Bow whole_bow(const RimCurve& middle) {
  const double centre = 0.5 * (middle.front().station_px + middle.back().station_px);
  Bow bow;
  bow.off_px.assign(middle.size(), 0.0);
  RimCurve course = middle;
  for (int pass = 0; pass < 8; ++pass) {
    const auto fit = fit_parabola(course.data(), course.data() + course.size(), centre, 2);
    if (!fit) break;
    bow.parabola = *fit;
    std::vector<double> trusted;
    for (std::size_t i = 0; i < middle.size(); ++i) {
      bow.off_px[i] = middle[i].offset_px - fit->at(middle[i].station_px);
      if (middle[i].weight > 0) trusted.push_back(bow.off_px[i]);
    }
    // A body bent otherwise than a parabola leaves it on most of its length.
    bow.scatter_px = trusted.empty() ? 0.0 : 1.4826 * median_size(std::move(trusted));
    bow.cutoff_px = std::max(kFarOffPx, 6 * bow.scatter_px);
    for (std::size_t i = 0; i < middle.size(); ++i)
      course[i].weight = middle[i].weight * bisquare(bow.off_px[i], bow.cutoff_px);
  }
  return bow;
}

// The smooth course of the middle; nothing where too little of it is trusted to tell.
std::optional<double> course_at(const RimCurve& middle, double station_px, const FilterConfig& config) {
  constexpr double kLeastTrust = 8.0;  // stations
  const SampleRange range = samples_near(middle, station_px, 0.5 * config.agreement_window);
  double trust = 0;
  for (std::size_t i = range.first; i < range.last; ++i) trust += middle[i].weight;
  return trust < kLeastTrust ? std::nullopt : fit_at_station(middle, range, station_px, 2);
}

// Of the middle from its smooth course, or from the bow where that is out of reach of any trusted middle.
std::vector<double> residuals_of(const RimCurve& middle, const Bow& bow, double noise_px, const FilterConfig& config) {
  // The start decides which course is found: what lies on the bow, as far as there is any within reach.
  const double start_cutoff = std::max(config.min_disagreement_px, 6 * bow.scatter_px);
  RimCurve course = middle;
  for (std::size_t i = 0; i < middle.size(); ++i) course[i].weight *= bisquare(bow.off_px[i], start_cutoff);
  std::vector<double> residual(middle.size(), 0.0);
  for (int pass = 0; pass < 5; ++pass) {
    // A coarse grid will do: the course is smooth by intent.
    constexpr double kEvery = 10;
    const double first = middle.front().station_px, last = middle.back().station_px;
    std::vector<double> grid;
    for (double s = first; s <= last + kEvery; s += kEvery)
      grid.push_back(course_at(course, std::min(s, last), config).value_or(std::nan("")));
    const double cutoff = 4.685 * std::max(noise_px, 0.25 * config.min_disagreement_px);
    for (std::size_t i = 0; i < middle.size(); ++i) {
      const double at = (middle[i].station_px - first) / kEvery;
      const auto g = std::min(static_cast<std::size_t>(at), grid.size() - 2);
      const double t = at - static_cast<double>(g);
      const double smooth = (1 - t) * grid[g] + t * grid[g + 1];
      const bool reached = !std::isnan(smooth);
      const bool far_off = std::abs(bow.off_px[i]) > bow.cutoff_px;
      residual[i] = reached ? middle[i].offset_px - smooth : far_off ? bow.off_px[i] : 0.0;
      course[i].weight = far_off ? 0.0 : middle[i].weight * bisquare(reached ? residual[i] : 0.0, cutoff);
    }
  }
  return residual;
}

// What the other rim says of a rim at one station: a factor of its trust.
struct Judgement {
  double station_px, factor;
};

// Where the other rim was not seen, the nearest judgement on the same stretch of rim counts.
void apply(const std::vector<Judgement>& judgements, RimCurve& rim, const FilterConfig& config) {
  constexpr double kReachPx = 30;
  std::vector<double> factor(rim.size(), 1.0), distance(rim.size(), kReachPx);
  const auto spread = [&](std::size_t i, std::size_t from) {
    const double step = std::abs(rim[i].station_px - rim[from].station_px);
    const bool parted =
        step > config.max_region_gap || std::abs(rim[i].offset_px - rim[from].offset_px) > config.max_region_jump_px;
    if (!parted && distance[from] + step < distance[i]) distance[i] = distance[from] + step, factor[i] = factor[from];
  };
  for (const Judgement& judgement : judgements) {
    const SampleRange range = samples_near(rim, judgement.station_px, 0.25);
    for (std::size_t k = range.first; k < range.last; ++k) factor[k] = judgement.factor, distance[k] = 0;
  }
  for (std::size_t i = 1; i < rim.size(); ++i) spread(i, i - 1);
  for (std::size_t i = rim.size(); i-- > 1;) spread(i - 1, i);
  for (std::size_t i = 0; i < rim.size(); ++i) rim[i].weight *= factor[i];
}

// A rim that leans on the body's course is that of a shoulder, which both rims have; alone it is the edge of something
// else, such as a beam behind the forging.
void reject_lone_slopes(RimCurve& rim, const RimCurve& other, const Bow& bow) {
  constexpr double kReachPx = 10, kMostSlope = 0.1;
  std::vector<double> factor(rim.size(), 1.0);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    if (!(rim[i].weight > 0)) continue;
    const double station = rim[i].station_px;
    const SampleRange partners = samples_near(other, station, kReachPx);
    bool alone = true;
    for (std::size_t k = partners.first; k < partners.last && alone; ++k) alone = !(other[k].weight > 0);
    const SampleRange near = samples_near(rim, station, kReachPx);
    const auto line = alone ? fit_parabola(rim.data() + near.first, rim.data() + near.last, station, 1) : std::nullopt;
    if (line && std::abs(line->c1 - bow.slope_at(station)) > kMostSlope) factor[i] = 0.0;
  }
  for (std::size_t i = 0; i < rim.size(); ++i) rim[i].weight *= factor[i];
}

}  // namespace

void reject_disagreement(RimCurve& upper, RimCurve& lower, const FilterConfig& config) {
  const RimCurve middle = middle_of(upper, lower);
  if (middle.size() < 20) return;
  const double noise = std::max(0.05, rim_noise_px(middle));
  const Bow bow = whole_bow(middle);
  const std::vector<double> residual = residuals_of(middle, bow, noise, config);
  const double limit = std::max(config.min_disagreement_px, 5 * noise);
  std::vector<Judgement> of_upper, of_lower;
  for (std::size_t i = 0; i < middle.size(); ++i) {
    if (middle[i].weight < kLeastSay) continue;
    const double factor = std::clamp(2 * (1 - std::abs(residual[i]) / limit), 0.0, 1.0);
    const bool either = std::abs(residual[i]) > kEitherPx;
    of_upper.push_back({middle[i].station_px, residual[i] > 0 || either ? factor : 1.0});
    of_lower.push_back({middle[i].station_px, residual[i] < 0 || either ? factor : 1.0});
  }
  apply(of_upper, upper, config), apply(of_lower, lower, config);
  reject_lone_slopes(upper, lower, bow), reject_lone_slopes(lower, upper, bow);
}

}  // namespace imprint
