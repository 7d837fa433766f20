#include "fusion/results/evaluation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/results/roundness.h"
#include "fusion/results/straightness.h"
#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kCi95 = 1.959964;
constexpr int kProfilePoints = 72;

/// `value` of the estimate, and how far it lies from that of the draws.
template <typename Value>
Length with_interval(double of_estimate, const std::vector<ForgingShape>& draws, const Value& value) {
  double squares = 0.0;
  for (const ForgingShape& draw : draws) squares += std::pow(value(draw) - of_estimate, 2);
  return {of_estimate, draws.empty() ? 0.0 : kCi95 * std::sqrt(squares / static_cast<double>(draws.size()))};
}

std::vector<Eigen::Vector2d> axis_of(const ForgingShape& shape) {
  std::vector<Eigen::Vector2d> axis;
  for (const SectionShape& section : shape) axis.push_back(section.axis_mm);
  return axis;
}

double largest_deflection(const ForgingShape& shape) {
  double largest = 0.0;
  for (const SectionShape& section : shape) largest = std::max(largest, section.axis_mm.norm());
  return largest;
}

using Profile = std::array<Eigen::Vector2d, kProfilePoints>;

/// Points of the surface about the section's axis, which are linear in the coefficients of its support function p:
/// where the normal n points to theta stands p n + p' n', by theta.
Profile profile_of(const SectionShape& section) {
  using Coefficients = Eigen::Vector<double, 1 + 2 * kHarmonics>;
  using Surface = Eigen::Matrix<double, 2 * kProfilePoints, 1 + 2 * kHarmonics>;
  static const Surface surface = [] {
    Surface rows;
    for (int i = 0; i < kProfilePoints; ++i) {
      const double theta = 2.0 * M_PI * i / kProfilePoints;
      const Eigen::Vector2d normal(std::cos(theta), std::sin(theta)), along(-normal.y(), normal.x());
      rows.col(0).segment<2>(2 * i) = normal;
      for (int k = kFirstHarmonic; k <= kLastHarmonic; ++k) {
        const double c = std::cos(k * theta), s = std::sin(k * theta);
        rows.col(1 + 2 * (k - kFirstHarmonic)).segment<2>(2 * i) = c * normal - k * s * along;
        rows.col(2 + 2 * (k - kFirstHarmonic)).segment<2>(2 * i) = s * normal + k * c * along;
      }
    }
    return rows;
  }();
  Coefficients coefficients;
  coefficients << section.radius_mm, section.harmonics_mm;
  Profile profile;
  Eigen::Map<Eigen::Matrix2Xd> points(profile.front().data(), 2, kProfilePoints);
  points.reshaped() = surface * coefficients;
  points.colwise() += section.axis_mm;
  return profile;
}

/// Largest less smallest distance of the surface from the ideal axis, in any one section.
double total_indicator(const ForgingShape& shape) {
  double most = 0.0;
  for (const SectionShape& section : shape) {
    double nearest = 1e300, furthest = 0.0;
    for (const Eigen::Vector2d& point : profile_of(section)) {
      const double square = point.squaredNorm();
      nearest = std::min(nearest, square), furthest = std::max(furthest, square);
    }
    most = std::max(most, std::sqrt(furthest) - std::sqrt(nearest));
  }
  return most;
}

/// Sections whose diameter is known as well as the others': a few that no camera sees would make the mean unknown too.
std::vector<std::size_t> well_known(const CombinedForging& forging) {
  constexpr double kTimesUsual = 4.0;
  std::vector<double> sigmas;
  for (const CombinedSection& section : forging.sections) sigmas.push_back(section.diameter_sigma_mm);
  const double usual = median(std::move(sigmas));
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < forging.sections.size(); ++i)
    if (forging.sections[i].diameter_sigma_mm <= kTimesUsual * usual) known.push_back(i);
  return known;
}

}  // namespace

Straightness evaluate_straightness(const CombinedForging& forging) {
  Straightness result;
  if (forging.sections.empty()) return result;
  std::vector<double> s;
  std::vector<Eigen::Vector2d> axis;
  for (const CombinedSection& section : forging.sections) {
    s.push_back(section.s_mm);
    axis.emplace_back(section.axis_mm.tail<2>());
  }
  const auto worst = std::ranges::max_element(axis, {}, [](const Eigen::Vector2d& yz) { return yz.norm(); });
  result.max_deflection_at_mm = s[static_cast<std::size_t>(worst - axis.begin())];
  result.max_deflection_direction_deg = std::atan2(worst->y(), worst->x()) * 180.0 / M_PI;
  result.max_deflection = with_interval(worst->norm(), forging.draws, largest_deflection);
  result.total_indicator = forging.shape.empty()
                               ? Length{2.0 * worst->norm(), 0.0}
                               : with_interval(total_indicator(forging.shape), forging.draws, total_indicator);
  constexpr double kMetre = 1000.0;
  result.per_metre = with_interval(bow_over_mm(s, axis, kMetre), forging.draws,
                                   [&](const ForgingShape& shape) { return bow_over_mm(s, axis_of(shape), kMetre); });
  result.minimum_zone = with_interval(minimum_zone_mm(s, axis), forging.draws,
                                      [&](const ForgingShape& shape) { return minimum_zone_mm(s, axis_of(shape)); });
  return result;
}

Diameters evaluate_diameters(const CombinedForging& forging) {
  Diameters result;
  if (forging.sections.empty()) return result;
  const auto [thin, thick] = std::ranges::minmax_element(forging.sections, {}, &CombinedSection::diameter_mm);
  result.smallest = {thin->diameter_mm, kCi95 * thin->diameter_sigma_mm};
  result.largest = {thick->diameter_mm, kCi95 * thick->diameter_sigma_mm};
  result.smallest_at_mm = thin->s_mm;
  result.largest_at_mm = thick->s_mm;
  double mean = 0.0;
  for (const CombinedSection& section : forging.sections)
    mean += section.diameter_mm / static_cast<double>(forging.sections.size());
  const std::vector<std::size_t> known = well_known(forging);
  const auto mean_of_known = [&](const ForgingShape& shape) {
    double sum = 0.0;
    for (const std::size_t i : known) sum += 2.0 * shape[i].radius_mm / static_cast<double>(known.size());
    return sum;
  };
  if (!forging.shape.empty())
    result.mean.ci95_mm = with_interval(mean_of_known(forging.shape), forging.draws, mean_of_known).ci95_mm;
  result.mean.mm = mean;
  return result;
}

std::vector<SectionRoundness> evaluate_roundness(const CombinedForging& forging) {
  // The spread changes slowly along the forging, and its draws are the costly part.
  constexpr std::size_t kSpreadEvery = 10;
  constexpr std::size_t kDrawsUsed = 16;
  constexpr std::array kKinds{&Roundness::least_squares_mm, &Roundness::minimum_zone_mm,
                              &Roundness::minimum_circumscribed_mm};
  constexpr std::array kPlaces{&SectionRoundness::least_squares, &SectionRoundness::minimum_zone,
                               &SectionRoundness::minimum_circumscribed};
  std::vector<SectionRoundness> result(forging.shape.size());
  const std::size_t half = forging.draws.size() / 2;
  std::array<double, 3> excess{}, ci95{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Roundness estimate = roundness(profile_of(forging.shape[i]));
    if (i % kSpreadEvery == 0 && half > 0) {
      std::array<double, 3> sum{}, squares{};
      double count = 0.0;
      for (std::size_t d = 0; d < std::min(kDrawsUsed / 2, half); ++d) {
        for (const ForgingShape* draw : {&forging.draws[d], &forging.draws[half + d]}) {  // of opposite sign
          const Roundness drawn = roundness(profile_of((*draw)[i]));
          for (std::size_t k = 0; k < 3; ++k) {
            const double off = drawn.*kKinds[k] - estimate.*kKinds[k];
            sum[k] += off, squares[k] += off * off;
          }
          count += 1.0;
        }
      }
      for (std::size_t k = 0; k < 3; ++k) {
        excess[k] = sum[k] / count;
        ci95[k] = kCi95 * std::sqrt(std::max(0.0, squares[k] / count - excess[k] * excess[k]));
      }
    }
    // An average section understates its extremes: the mean of what it may be does not.
    for (std::size_t k = 0; k < 3; ++k) result[i].*kPlaces[k] = {estimate.*kKinds[k] + excess[k], ci95[k]};
  }
  return result;
}

}  // namespace imprint
