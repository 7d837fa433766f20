#include "fusion/combine/aligned_estimate.h"

#include <cmath>
#include <random>

#include <Eigen/Dense>

#include "fusion/combine/circularity.h"

namespace imprint {
namespace {

constexpr int kDraws = 32;  // in pairs of opposite sign

/// Standard normal values, always the same, the second half the first with its sign turned.
Eigen::MatrixXd normal_values(Eigen::Index rows, int columns, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd values(rows, columns);
  for (int j = 0; j < columns / 2; ++j)
    for (Eigen::Index i = 0; i < rows; ++i) values(i, j) = normal(generator);
  values.rightCols(columns / 2) = -values.leftCols(columns / 2);
  return values;
}

/// Draws of the whole chain of nodes, each seen from the ideal axis it has itself.
class ChainDraws {
 public:
  ChainDraws(const JointEstimate& joint, const IdealAxis& line)
      : line_(line),
        deviations_(joint.system.deviations(
            normal_values(joint.system.nodes() * kNodeUnknowns + joint.system.border_size(), kDraws, 20230415))) {
    for (int d = 0; d < kDraws; ++d) {
      Eigen::Vector2d mean = Eigen::Vector2d::Zero(), slope = Eigen::Vector2d::Zero();
      for (std::size_t i = 0; i < joint.nodes.size(); ++i) {
        const Eigen::Vector2d off = yz(i, d);
        mean += line.level_weight[i] * off;
        slope += line.slope_weight[i] * off;
      }
      mean_.push_back(mean);
      slope_.push_back(slope);
    }
  }

  /// Draw `d` of the section between node k and the next, at share u of it; x in the nodes' frame.
  [[nodiscard]] SectionShape at(const SectionShape& estimate, std::size_t k, double u, double x_mm, int d) const {
    const auto line = static_cast<std::size_t>(d);
    const NodeVector off = (1.0 - u) * node(k, d) + u * node(k + 1, d);
    SectionShape drawn = estimate;
    drawn.axis_mm += Eigen::Vector2d(off(kY), off(kZ)) - mean_[line] - slope_[line] * (x_mm - line_.x_mean_mm);
    drawn.radius_mm += off(kRadius);
    drawn.harmonics_mm += off.tail<2 * kHarmonics>();
    return drawn;
  }

 private:
  [[nodiscard]] NodeVector node(std::size_t i, int d) const {
    return deviations_.col(d).segment<kNodeUnknowns>(static_cast<Eigen::Index>(i) * kNodeUnknowns);
  }
  [[nodiscard]] Eigen::Vector2d yz(std::size_t i, int d) const {
    const NodeVector off = node(i, d);
    return {off(kY), off(kZ)};
  }

  const IdealAxis& line_;
  Eigen::MatrixXd deviations_;
  std::vector<Eigen::Vector2d> mean_, slope_;
};

}  // namespace

void align(const JointEstimate& joint, const EndPlanes& ends, double end_section_mm, int sections,
           CombinedForging& combined) {
  const std::size_t n = joint.nodes.size();
  std::vector<double> x(n);
  std::vector<Eigen::Vector2d> yz(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = static_cast<double>(i) * joint.step_mm;
    yz[i] = {joint.nodes[i](kY), joint.nodes[i](kZ)};
  }
  const IdealAxis line = ideal_axis(x, yz, ends.first.x_mm, ends.last.x_mm, end_section_mm);
  const Placement& world = joint.placements.front();
  const Eigen::Vector3d direction(1.0, line.slope.x(), line.slope.y());
  combined.R_forging_world = forging_axes(world.R.transpose() * direction);
  combined.origin_world_mm = world.R.transpose() * (line.at(ends.first.x_mm) - world.shift_mm);
  combined.length_mm = (ends.last.x_mm - ends.first.x_mm) * direction.norm();
  const Eigen::Matrix3d R = combined.R_forging_world * world.R.transpose();  // aligned from working frame
  const Eigen::Vector3d origin = line.at(ends.first.x_mm);

  // The ideal axis is made of the same uncertain points: its sums go along.
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n) * kNodeUnknowns, 4);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i) * kNodeUnknowns;
    sums(row + kY, 0) = sums(row + kZ, 2) = line.level_weight[i];
    sums(row + kY, 1) = sums(row + kZ, 3) = line.slope_weight[i];
  }
  const Eigen::MatrixXd with_sums = joint.system.covariance_with(sums);
  const Eigen::Matrix4d of_sums = sums.transpose() * with_sums;
  const double place_variance = ends.covariance_mm2(0, 0);

  const ChainDraws draws(joint, line);
  combined.draws.resize(kDraws);
  const double step = combined.length_mm / (sections - 1);
  std::size_t k = 0;
  std::vector<Eigen::Vector3d> aligned(n);
  for (std::size_t i = 0; i < n; ++i) aligned[i] = R * (Eigen::Vector3d(x[i], yz[i].x(), yz[i].y()) - origin);
  for (int s = 0; s < sections; ++s) {
    CombinedSection section;
    section.s_mm = s * step;
    while (k + 2 < n && aligned[k + 1].x() < section.s_mm) ++k;
    const double u = (section.s_mm - aligned[k].x()) / (aligned[k + 1].x() - aligned[k].x());
    section.axis_mm = (1.0 - u) * aligned[k] + u * aligned[k + 1];
    const std::size_t i = u < 0.5 ? k : k + 1;
    const NodeVector& node = joint.nodes[i];
    const NodeMatrix& covariance = joint.covariance[i];
    const auto row = static_cast<Eigen::Index>(i) * kNodeUnknowns;
    const double lever = x[i] - line.x_mean_mm;
    Eigen::Matrix<double, 2, 4> line_effect;
    line_effect << 1.0, lever, 0.0, 0.0, 0.0, 0.0, 1.0, lever;
    Eigen::Matrix<double, 2, 4> cross;
    cross.row(0) = with_sums.row(row + kY);
    cross.row(1) = with_sums.row(row + kZ);
    Eigen::Matrix2d own;
    own << covariance(kY, kY), covariance(kY, kZ), covariance(kZ, kY), covariance(kZ, kZ);
    const Eigen::Matrix2d shared = cross * line_effect.transpose();
    section.axis_covariance_mm2 = own - shared - shared.transpose() + line_effect * of_sums * line_effect.transpose();

    const double radius = (1.0 - u) * joint.nodes[k](kRadius) + u * joint.nodes[k + 1](kRadius);
    // At a shoulder the section's place along the axis counts too.
    const double gradient = (joint.nodes[k + 1](kRadius) - joint.nodes[k](kRadius)) / joint.step_mm;
    const double from_place = gradient * gradient * (place_variance + joint.step_mm * joint.step_mm / 12.0);
    section.diameter_mm = 2.0 * radius;
    section.diameter_sigma_mm = 2.0 * std::sqrt(covariance(kRadius, kRadius) + from_place);
    const Circularity circle = circularity(node, covariance);
    combined.shape.push_back(
        {section.axis_mm.tail<2>(), radius,
         (1.0 - u) * joint.nodes[k].tail<2 * kHarmonics>() + u * joint.nodes[k + 1].tail<2 * kHarmonics>()});
    for (int d = 0; d < kDraws; ++d)
      combined.draws[static_cast<std::size_t>(d)].push_back(
          draws.at(combined.shape.back(), k, u, (1.0 - u) * x[k] + u * x[k + 1], d));
    section.circularity_mm = circle.value_mm;
    section.circularity_sigma_mm = circle.sigma_mm;
    combined.sections.push_back(section);
  }
}

void widen_draws(CombinedForging& combined, double factor, double common_radius_sigma_mm) {
  const Eigen::MatrixXd common = normal_values(1, static_cast<int>(combined.draws.size()), 20230416);
  for (std::size_t d = 0; d < combined.draws.size(); ++d) {
    const double outwards = common_radius_sigma_mm * common(0, static_cast<Eigen::Index>(d));
    for (std::size_t i = 0; i < combined.shape.size(); ++i) {
      const SectionShape& shape = combined.shape[i];
      SectionShape& drawn = combined.draws[d][i];
      drawn.axis_mm = shape.axis_mm + factor * (drawn.axis_mm - shape.axis_mm);
      drawn.radius_mm = shape.radius_mm + factor * (drawn.radius_mm - shape.radius_mm + outwards);
      drawn.harmonics_mm = shape.harmonics_mm + factor * (drawn.harmonics_mm - shape.harmonics_mm);
    }
  }
}

}  // namespace imprint
