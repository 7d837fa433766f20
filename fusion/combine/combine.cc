#include "fusion/combine/combine.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "fusion/combine/aligned_estimate.h"
#include "fusion/combine/combine_config.h"
#include "fusion/combine/joint_estimate.h"
#include "fusion/combine/joint_start.h"
#include "lib/geometry/median.h"

namespace imprint {
namespace {

/// Where no tangent tells the radius, such as on a shoulder that no camera sees sharply, it lies on the line between
/// the nearest sections that are known, at an end it is that of the nearest; the intervals there stay as wide as they
/// are.
void bridge_unknown_radii(JointEstimate& joint) {
  constexpr double kTimesUsual = 8.0, kLeastShare = 0.002;  // of the usual sigma; of the radius
  constexpr std::size_t kBeside = 2;
  constexpr double kOutside = 0.01;  // of the radius
  std::vector<double> sigmas;
  for (const NodeMatrix& covariance : joint.covariance) sigmas.push_back(std::sqrt(covariance(kRadius, kRadius)));
  const double usual = median(sigmas);
  const auto sharp = [&](std::size_t i) {
    return sigmas[i] <= std::max(kTimesUsual * usual, kLeastShare * std::abs(joint.nodes[i](kRadius)));
  };
  // Beside a stretch nobody sees a section may hang on one tangent, and that one on something else: it has to lie
  // between its neighbours that do not.
  std::vector<char> firm(sigmas.size(), 1), known_at(sigmas.size(), 0);
  for (std::size_t i = 0; i < firm.size(); ++i)
    for (std::size_t k = i < kBeside ? 0 : i - kBeside; k <= std::min(i + kBeside, sigmas.size() - 1); ++k)
      if (!sharp(k)) firm[i] = 0;
  for (std::size_t i = 0; i < firm.size(); ++i) {
    if (!sharp(i)) continue;
    const auto next = std::find(firm.begin() + static_cast<std::ptrdiff_t>(i), firm.end(), 1);
    const auto last = std::find(firm.rend() - static_cast<std::ptrdiff_t>(i) - 1, firm.rend(), 1);
    double low = joint.nodes[i](kRadius), high = low;
    if (next != firm.end() && last != firm.rend()) {
      const double a = joint.nodes[static_cast<std::size_t>(next - firm.begin())](kRadius);
      const double b = joint.nodes[static_cast<std::size_t>(firm.rend() - last) - 1](kRadius);
      low = std::min(a, b) - kOutside * a, high = std::max(a, b) + kOutside * a;
    }
    known_at[i] = joint.nodes[i](kRadius) >= low && joint.nodes[i](kRadius) <= high;
  }
  const auto known = [&](std::size_t i) { return known_at[i] != 0; };
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < joint.nodes.size(); ++i) {
    if (!known(i)) continue;
    for (std::size_t k = before ? *before + 1 : 0; k < i; ++k) {
      const std::size_t from = before.value_or(i);  // up to the first known section: its own radius
      const double t = before ? static_cast<double>(k - from) / static_cast<double>(i - from) : 1.0;
      joint.nodes[k](kRadius) = (1.0 - t) * joint.nodes[from](kRadius) + t * joint.nodes[i](kRadius);
    }
    before = i;
  }
  for (std::size_t k = before ? *before + 1 : joint.nodes.size(); k < joint.nodes.size(); ++k)
    joint.nodes[k](kRadius) = joint.nodes[*before](kRadius);
}

/// Names the stretches, longer than a shoulder is, over which no rim tells the diameter.
void warn_of_unseen(CombinedForging& combined) {
  constexpr double kUnknown = 0.025;  // sigma, of the diameter
  constexpr double kLong = 0.03;      // of the length
  const auto& sections = combined.sections;
  const auto is_unknown = [&](std::size_t i) {
    return sections[i].diameter_sigma_mm > kUnknown * sections[i].diameter_mm;
  };
  for (std::size_t from = 0; from < sections.size(); ++from) {
    std::size_t to = from;
    while (to < sections.size() && is_unknown(to)) ++to;
    if (to > from && sections[to - 1].s_mm - sections[from].s_mm > kLong * combined.length_mm)
      combined.warnings.push_back(fmt::format(
          "no camera sees the rims between {:.0f} and {:.0f} mm: the diameters there are only what lies beside them",
          sections[from].s_mm, sections[to - 1].s_mm));
    from = to;
  }
}

}  // namespace

Result<void> CombineConfig::validate() const {
  if (sections < 10) return invalid_input("combine.sections: at least 10 expected, found {}", sections);
  if (iterations < 2) return invalid_input("combine.iterations: at least 2 expected, found {}", iterations);
  if (!(rotation_tolerance_deg > 0.0) || !(placing_sigma_mm > 0.0) || !(end_tilt_sigma_deg > 0.0))
    return invalid_input("combine: rotation_tolerance_deg, placing_sigma_mm and end_tilt_sigma_deg above 0 expected");
  if (!(interval_widening >= 1.0))
    return invalid_input("combine.interval_widening: at least 1 expected, found {}", interval_widening);
  if (!(out_of_round_share > 0.0) || !(out_of_round_length_share > 0.0))
    return invalid_input("combine: out_of_round_share and out_of_round_length_share above 0 expected");
  return {};
}

Result<CombinedForging> combine(std::span<const ObservedForging> observations, std::span<const double> rotations_deg,
                                const ForgingSpec& forging, const CombineConfig& config) {
  auto start = start_of(observations, rotations_deg, forging, config);
  if (!start) return pass_on(start.error());
  CombinedForging combined;
  auto joint =
      estimate_jointly(observations, start->placements, start->axis, start->radius_mm, start->shift_sigma_mm, config);
  if (!joint) return job_failed("the tangents of the observations do not determine a forging");
  bridge_unknown_radii(*joint);

  std::vector<double> radii;
  for (const NodeVector& node : joint->nodes) radii.push_back(node(kRadius));
  const auto ends = final_ends(observations, joint->placements, joint->axis(),
                               round_ends(joint->axis(), radii, forging.end_section_mm), joint->shift_sigma_mm, config);
  if (!ends) return pass_on(ends.error());
  align(*joint, *ends, forging.end_section_mm, config.sections, combined);
  combined.length_sigma_mm = ends->length_sigma_mm();
  // No number of tangents takes away what moves all rims outwards or inwards alike.
  const double common = 2.0 * config.common_edge_sigma_px * mm_per_px(observations);
  for (CombinedSection& section : combined.sections) {
    section.diameter_sigma_mm = std::hypot(section.diameter_sigma_mm, common);
    section.axis_covariance_mm2 *= config.interval_widening * config.interval_widening;
    section.diameter_sigma_mm *= config.interval_widening;
    section.circularity_sigma_mm *= config.interval_widening;
  }
  widen_draws(combined, config.interval_widening, 0.5 * common);
  if (auto believable = within_rig(observations, forging, combined); !believable) return pass_on(believable.error());
  warn_of_unseen(combined);
  warn_of_lengths(observations, config, combined);
  return combined;
}

}  // namespace imprint
