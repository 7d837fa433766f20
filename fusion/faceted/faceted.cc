#include "fusion/faceted/faceted.h"

#include <algorithm>
#include <cmath>

#include "fusion/faceted/faceted_estimate.h"
#include "fusion/faceted/section_evidence.h"

namespace imprint {
namespace {

constexpr double kDegree = M_PI / 180.0;

std::vector<CornerModel> first_sections(const FoundSection& found, const PooledSection& pooled, const AxisCurve& axis) {
  std::vector<CornerModel> sections;
  for (std::size_t i = 0; i < pooled.size_mm.size(); ++i) {
    CornerModel section = found.fit.section;
    section.corners_mm *= pooled.size_mm[i];
    section.corners_mm.colwise() += axis.yz_mm[i];
    section.radius_mm *= pooled.size_mm[i];
    sections.push_back(std::move(section));
  }
  return sections;
}

/// Measures of a node and how uncertain they are, by differences.
struct Measured {
  Eigen::VectorXd value;
  Eigen::VectorXd sigma;
};

Measured measured(const CornerModel& node, const Eigen::MatrixXd& covariance, SectionKind kind) {
  Measured result{measures_of(node, kind), {}};
  const int n = node.size();
  const double step = 1e-4 * result.value(kMeanWidth);
  Eigen::MatrixXd gradient(result.value.size(), 2 * n + 1);
  for (int j = 0; j <= 2 * n; ++j) {
    const auto moved = [&](double by) {
      CornerModel other = node;
      (j < 2 * n ? other.corners_mm(j % 2, j / 2) : other.radius_mm) += by;
      return measures_of(other, kind);
    };
    gradient.col(j) = (moved(step) - moved(-step)) / (2.0 * step);
  }
  result.sigma = (gradient * covariance * gradient.transpose()).diagonal().cwiseMax(0.0).cwiseSqrt();
  return result;
}

/// The outermost point of an end is the one nearest to the camera, or the furthest where the camera sees the end's
/// face: it lies as deep as the section reaches that way.
EndOutline faceted_ends(const FacetedEstimate& estimate, double end_section_mm) {
  const auto into =
      std::min(static_cast<std::size_t>(0.5 * end_section_mm / estimate.step_mm), estimate.nodes.size() / 2);
  const auto centered = [](CornerModel node) {
    node.corners_mm.colwise() -= node.center();
    return node;
  };
  return [first = centered(estimate.nodes[into]), final = centered(estimate.nodes[estimate.nodes.size() - 1 - into])](
             const AxisCurve& axis, const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& ray, bool last,
             double x_mm) -> std::optional<Eigen::Vector3d> {
    const Eigen::Vector2d middle = axis.at(x_mm).point_mm.tail<2>();
    const bool sees_face = last ? eye_mm.x() > x_mm : eye_mm.x() < x_mm;
    const Eigen::Vector2d to_eye = (eye_mm.tail<2>() - middle).normalized();
    const Eigen::Vector2d outwards = sees_face ? Eigen::Vector2d(-to_eye) : to_eye;
    const double approach = ray.tail<2>().dot(outwards);
    if (std::abs(approach) < 1e-6) return std::nullopt;
    const double depth = (last ? final : first).support(outwards);
    const double travel = (depth - (eye_mm.tail<2>() - middle).dot(outwards)) / approach;
    if (!(travel > 0.0)) return std::nullopt;
    return Eigen::Vector3d(eye_mm + travel * ray);
  };
}

/// What a second estimate starts from: the first one, laid over the length between the ends that are seen with the
/// forging's true depth. A first length, found as if the ends were round, may be off by centimetres.
void start_anew(const FacetedEstimate& estimate, const EndPlanes& ends, JointStart& start,
                std::vector<CornerModel>& sections) {
  const AxisCurve axis = estimate.axis();
  start.placements = estimate.placements;
  for (Placement& placement : start.placements) placement.shift_mm.x() -= ends.first.x_mm;
  start.shift_sigma_mm = std::max(ends.length_sigma_mm(), 0.1 * estimate.step_mm);
  const std::size_t n = sections.size();
  start.axis.x_step_mm = (ends.last.x_mm - ends.first.x_mm) / static_cast<double>(n - 1);
  constexpr double kOutermost = 5.0;  // nodes at either end that few tangents tell
  for (std::size_t i = 0; i < n; ++i) {
    const double x = ends.first.x_mm + static_cast<double>(i) * start.axis.x_step_mm;
    start.axis.yz_mm[i] = axis.at(x).point_mm.tail<2>();
    const double known = std::clamp(x / estimate.step_mm, kOutermost, static_cast<double>(n) - 1.0 - kOutermost);
    const auto& from = estimate.nodes[static_cast<std::size_t>(std::lround(known))];
    sections[i].corners_mm = from.corners_mm.colwise() + (start.axis.yz_mm[i] - from.center());
    sections[i].radius_mm = from.radius_mm;
  }
  start.axis.set_slopes();
}

/// The middles of the corners as sums of the unknowns, weighted along the forging: y and z of the ideal axis' place and
/// slope.
Eigen::MatrixXd line_sums(const FacetedEstimate& estimate, const IdealAxis& line) {
  const int corners = estimate.nodes.front().size();
  const Eigen::Index size = 2 * corners + 1;
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(size * static_cast<Eigen::Index>(estimate.nodes.size()), 4);
  for (std::size_t i = 0; i < estimate.nodes.size(); ++i)
    for (int c = 0; c < corners; ++c)
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Index row = size * static_cast<Eigen::Index>(i) + 2 * c + axis;
        sums(row, 2 * axis) = line.level_weight[i] / corners;
        sums(row, 2 * axis + 1) = line.slope_weight[i] / corners;
      }
  return sums;
}

void fill_sections(const FacetedEstimate& estimate, const EndPlanes& ends, SectionKind kind, double end_section_mm,
                   const CombineConfig& config, double common_mm, CombinedForging& combined) {
  const AxisCurve axis = estimate.axis();
  std::vector<double> x;
  for (std::size_t i = 0; i < estimate.nodes.size(); ++i) x.push_back(static_cast<double>(i) * estimate.step_mm);
  const IdealAxis line = ideal_axis(x, axis.yz_mm, ends.first.x_mm, ends.last.x_mm, end_section_mm);
  const Placement& world = estimate.placements.front();
  const Eigen::Vector3d direction(1.0, line.slope.x(), line.slope.y());
  combined.R_forging_world = forging_axes(world.R.transpose() * direction);
  combined.origin_world_mm = world.R.transpose() * (line.at(ends.first.x_mm) - world.shift_mm);
  combined.length_mm = (ends.last.x_mm - ends.first.x_mm) * direction.norm();
  combined.length_sigma_mm = ends.length_sigma_mm();
  const Eigen::Matrix3d R = combined.R_forging_world * world.R.transpose();
  const Eigen::Vector3d origin = line.at(ends.first.x_mm);
  const Eigen::MatrixXd sums = line_sums(estimate, line);
  const Eigen::MatrixXd with_sums = estimate.covariance_with(sums);
  const Eigen::Matrix4d of_sums = sums.transpose() * with_sums;
  const int corners = estimate.nodes.front().size();
  const Eigen::Index size = 2 * corners + 1;

  SectionFacets::Value first_direction;
  for (int s = 0; s < config.sections; ++s) {
    const double s_mm = combined.length_mm * s / (config.sections - 1);
    const double at = std::clamp((origin.x() + s_mm / direction.norm()) / estimate.step_mm, 0.0,
                                 static_cast<double>(estimate.nodes.size()) - 1.001);
    const auto k = static_cast<std::size_t>(at);
    const double u = at - static_cast<double>(k);
    CornerModel node = estimate.nodes[k];
    node.corners_mm = (1.0 - u) * node.corners_mm + u * estimate.nodes[k + 1].corners_mm;
    node.radius_mm = (1.0 - u) * node.radius_mm + u * estimate.nodes[k + 1].radius_mm;
    const std::size_t near = u < 0.5 ? k : k + 1;
    const Eigen::MatrixXd& covariance = estimate.covariance[near];
    const Measured m = measured(node, covariance, kind);
    const auto value = [&](int i, double unit) {
      return SectionFacets::Value{m.value(i) / unit, config.interval_widening * m.sigma(i) / unit};
    };
    const auto length_value = [&](int i) {
      return SectionFacets::Value{m.value(i), config.interval_widening * std::hypot(m.sigma(i), common_mm)};
    };

    CombinedSection section;
    section.s_mm = s_mm;
    const Eigen::Vector2d middle = node.center();
    section.axis_mm = R * (Eigen::Vector3d(at * estimate.step_mm, middle.x(), middle.y()) - origin);
    section.axis_mm.x() = s_mm;
    section.diameter_mm = m.value(kMeanWidth);
    section.diameter_sigma_mm = length_value(kMeanWidth).sigma;
    section.circularity_mm = m.value(kCircularity);
    section.circularity_sigma_mm = value(kCircularity, 1.0).sigma;

    // The middle against the ideal axis, which is made of the same corners.
    const double lever = x[near] - line.x_mean_mm;
    Eigen::Matrix<double, 2, 4> line_effect;
    line_effect << 1.0, lever, 0.0, 0.0, 0.0, 0.0, 1.0, lever;
    Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(2, size);
    for (int c = 0; c < corners; ++c) mean.block<2, 2>(0, 2 * c).diagonal().setConstant(1.0 / corners);
    const Eigen::Matrix2d own = mean * covariance * mean.transpose();
    const Eigen::Matrix2d shared =
        mean * with_sums.middleRows(size * static_cast<Eigen::Index>(near), size) * line_effect.transpose();
    section.axis_covariance_mm2 = config.interval_widening * config.interval_widening *
                                  (own - shared - shared.transpose() + line_effect * of_sums * line_effect.transpose());
    combined.sections.push_back(section);

    SectionFacets facets;
    for (int i = kWidths; i < m.value.size(); ++i) facets.widths_mm.push_back(length_value(i));
    facets.squareness_deg = value(kSquareness, kDegree);
    facets.twist_deg = value(kDirection, kDegree);
    if (s == 0) first_direction = facets.twist_deg;
    facets.twist_deg.value = std::remainder(facets.twist_deg.value - first_direction.value, 360.0);
    facets.twist_deg.sigma = s == 0 ? 0.0 : std::hypot(facets.twist_deg.sigma, first_direction.sigma);
    facets.corner_radius_mm = value(kCornerRadius, 1.0);
    for (int c = 0; c < corners; ++c)
      facets.corners_mm.emplace_back(
          (R * (Eigen::Vector3d(at * estimate.step_mm, node.corners_mm(0, c), node.corners_mm(1, c)) - origin))
              .tail<2>());
    combined.facets.push_back(std::move(facets));
  }
}

}  // namespace

Result<CombinedForging> combine_faceted(std::span<const ObservedForging> observations,
                                        std::span<const double> rotations_deg, const ForgingSpec& forging,
                                        SectionKind told, const CombineConfig& config) {
  auto start = start_of(observations, rotations_deg, forging, config);
  if (!start) return pass_on(start.error());
  const PooledSection pooled = pooled_section(observations, *start);
  const FoundSection found = find_section(pooled.samples, told);
  CombinedForging combined;
  combined.section_kind = found.kind;
  if (found.kind == SectionKind::round) return combined;
  std::vector<CornerModel> sections = first_sections(found, pooled, start->axis);
  std::optional<FacetedEstimate> estimate;
  Result<EndPlanes> ends = EndPlanes{};
  for (int pass = 0; pass < 2; ++pass) {
    if (pass > 0) start_anew(*estimate, *ends, *start, sections);
    estimate = estimate_faceted(observations, *start, sections, found.kind, config);
    if (!estimate) return job_failed("the tangents of the observations do not determine a forging with faces");
    ends = final_ends(observations, estimate->placements, estimate->axis(),
                      faceted_ends(*estimate, forging.end_section_mm), estimate->shift_sigma_mm, config);
    if (!ends) return pass_on(ends.error());
  }
  const double common = 2.0 * config.common_edge_sigma_px * mm_per_px(observations);
  fill_sections(*estimate, *ends, found.kind, forging.end_section_mm, config, common, combined);
  if (auto believable = within_rig(observations, forging, combined); !believable) return pass_on(believable.error());
  warn_of_lengths(observations, config, combined);
  return combined;
}

}  // namespace imprint
