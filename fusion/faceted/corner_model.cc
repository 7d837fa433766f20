#include "fusion/faceted/corner_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

Eigen::Vector2d towards(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }

double robust_scatter(const CornerModel& section, std::span<const SupportSample> samples) {
  std::vector<double> off;
  for (const SupportSample& sample : samples) off.push_back(std::abs(sample.distance - section.support(sample.normal)));
  return 1.4826 * median(std::move(off));
}

/// Counter-clockwise again: on their way corners may pass each other.
void put_in_order(CornerModel& section) {
  const Eigen::Vector2d middle = section.center();
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < section.size(); ++i) corners.emplace_back(section.corners_mm.col(i) - middle);
  std::ranges::sort(corners, {}, [](const Eigen::Vector2d& corner) { return std::atan2(corner.y(), corner.x()); });
  for (int i = 0; i < section.size(); ++i) section.corners_mm.col(i) = middle + corners[static_cast<std::size_t>(i)];
}

/// Gauss-Newton with Cauchy weights; which corner a tangent touches is decided anew in every round.
CornerFit improve(CornerModel section, std::span<const SupportSample> samples, bool regular) {
  constexpr int kRounds = 12;
  constexpr double kRegular = 0.02;
  constexpr double kFamily = 0.3, kRadius = 0.15;  // sigma of the departure from the family and of the corners' radius
  const int n = section.size();
  const int unknowns = 2 * n + 1;
  const double usual_radius = section.radius_mm;
  const FamilyProjections projections = family_projections(n);
  Eigen::MatrixXd family = projections.not_affine / (kFamily * kFamily);
  // Against the samples' weights, each of which is that of its own scatter.
  const double strong = 0.1 * static_cast<double>(samples.size()) / (kRegular * kRegular);
  if (regular) family += strong * (projections.affine_not_similar + projections.not_affine);
  double scale = 0.1;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    normal.topLeftCorner(2 * n, 2 * n) = family;
    normal(2 * n, 2 * n) = 1.0 / (kRadius * kRadius);
    right(2 * n) = usual_radius / (kRadius * kRadius);
    for (const SupportSample& sample : samples) {
      const int corner = section.touched(sample.normal);
      const double residual = sample.distance - section.corners_mm.col(corner).dot(sample.normal) - section.radius_mm;
      const double w = 1.0 / (scale * scale + residual * residual);
      Eigen::Vector3d g;
      g << sample.normal, 1.0;
      const std::array<int, 3> at{2 * corner, 2 * corner + 1, 2 * n};
      for (int a = 0; a < 3; ++a) {
        right(at[static_cast<std::size_t>(a)]) += w * g(a) * sample.distance;
        for (int b = 0; b < 3; ++b)
          normal(at[static_cast<std::size_t>(a)], at[static_cast<std::size_t>(b)]) += w * g(a) * g(b);
      }
    }
    normal.diagonal().array() += 1e-6;
    const Eigen::VectorXd solution = normal.ldlt().solve(right);
    if (!solution.allFinite()) break;
    for (int i = 0; i < n; ++i) section.corners_mm.col(i) = solution.segment<2>(2 * i);
    section.radius_mm = std::max(solution(2 * n), 0.0);
    scale = std::clamp(robust_scatter(section, samples), 1e-4, scale);
  }
  put_in_order(section);
  return {section, robust_scatter(section, samples)};
}

}  // namespace

int CornerModel::touched(const Eigen::Vector2d& normal) const {
  Eigen::Index best = 0;
  (normal.transpose() * corners_mm).maxCoeff(&best);
  return static_cast<int>(best);
}

double CornerModel::support(const Eigen::Vector2d& normal) const {
  return (normal.transpose() * corners_mm).maxCoeff() + radius_mm;
}

double CornerModel::direction() const {
  const Eigen::Vector2d middle = center();
  std::complex<double> sum;
  for (int i = 0; i < size(); ++i) {
    const Eigen::Vector2d d = corners_mm.col(i) - middle;
    sum += std::complex<double>(d.x(), d.y()) * std::polar(1.0, -2.0 * M_PI * i / size());
  }
  return std::arg(sum);
}

Eigen::VectorXd measures_of(const CornerModel& section, SectionKind kind) {
  constexpr int kDirections = 180;  // over half a turn
  const int n = section.size();
  double sum = 0.0, least = std::numeric_limits<double>::infinity(), most = 0.0;
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector2d normal = towards(M_PI * i / kDirections);
    const double width = section.support(normal) + section.support(-normal);
    sum += width, least = std::min(least, width), most = std::max(most, width);
  }
  const auto face_normal = [&](int face) {
    const Eigen::Vector2d along = section.corners_mm.col((face + 1) % n) - section.corners_mm.col(face);
    return Eigen::Vector2d(along.y(), -along.x()).normalized();
  };
  const auto face_middle = [&](int face) {
    return Eigen::Vector2d(0.5 * (section.corners_mm.col((face + 1) % n) + section.corners_mm.col(face)));
  };
  std::vector<double> widths;
  std::vector<Eigen::Vector2d> across;
  for (int face = 0; face < n / 2; ++face) {
    across.push_back((face_normal(face) - face_normal(face + n / 2)).normalized());
    widths.push_back(across.back().dot(face_middle(face) - face_middle(face + n / 2)) + 2.0 * section.radius_mm);
  }
  double squareness = 0.0;
  if (n == 4)
    squareness = std::atan2(across[0].x() * across[1].y() - across[0].y() * across[1].x(), across[0].dot(across[1])) -
                 0.5 * M_PI;
  if (kind == SectionKind::convex) widths = {least, most};
  Eigen::VectorXd measures(kWidths + static_cast<int>(widths.size()));
  measures(kMeanWidth) = sum / kDirections;
  measures(kCircularity) = 0.5 * (most - least);
  measures(kCornerRadius) = section.radius_mm;
  measures(kDirection) = section.direction();
  measures(kSquareness) = squareness;
  for (std::size_t i = 0; i < widths.size(); ++i) measures(kWidths + static_cast<int>(i)) = widths[i];
  return measures;
}

CornerFit fit_corners(std::span<const SupportSample> samples, int corners, bool regular) {
  constexpr int kStarts = 6;
  constexpr double kStretches[] = {1.0, 1.15, 1.0 / 1.15};
  constexpr double kUsualRadius = 0.15;
  // A regular polygon whose mean distance is that of the samples.
  double mean = 0.0;
  for (const SupportSample& sample : samples) mean += sample.distance / static_cast<double>(samples.size());
  const double reach = (mean - kUsualRadius) * (M_PI / corners) / std::sin(M_PI / corners);
  CornerFit best;
  best.scatter = std::numeric_limits<double>::infinity();
  for (int start = 0; start < kStarts * static_cast<int>(std::size(kStretches)); ++start) {
    CornerModel section;
    section.radius_mm = kUsualRadius;
    section.corners_mm.resize(2, corners);
    const double stretch = kStretches[start / kStarts], turn = static_cast<double>(start % kStarts) / kStarts;
    const Eigen::Rotation2Dd turned(2.0 * M_PI * turn / corners);
    for (int i = 0; i < corners; ++i) {
      const Eigen::Vector2d corner = reach * towards(2.0 * M_PI * (i + 0.5) / corners);
      section.corners_mm.col(i) = turned * Eigen::Vector2d(stretch * corner.x(), corner.y() / stretch);
    }
    CornerFit fit = improve(std::move(section), samples, regular);
    if (fit.scatter < best.scatter) best = std::move(fit);
  }
  return best;
}

double harmonic_scatter(std::span<const SupportSample> samples) {
  constexpr int kTerms = 2 * 6 + 1;
  Eigen::Matrix<double, kTerms, kTerms> normal = 1e-9 * Eigen::Matrix<double, kTerms, kTerms>::Identity();
  Eigen::Matrix<double, kTerms, 1> right = Eigen::Matrix<double, kTerms, 1>::Zero();
  const auto row_of = [](const SupportSample& sample) {
    Eigen::Matrix<double, kTerms, 1> row;
    row(0) = 1.0;
    const double theta = std::atan2(sample.normal.y(), sample.normal.x());
    for (int k = 1; 2 * k < kTerms; ++k) {
      row(2 * k - 1) = std::cos(k * theta);
      row(2 * k) = std::sin(k * theta);
    }
    return row;
  };
  for (const SupportSample& sample : samples) {
    const auto row = row_of(sample);
    normal += row * row.transpose();
    right += sample.distance * row;
  }
  const Eigen::Matrix<double, kTerms, 1> solution = normal.ldlt().solve(right);
  std::vector<double> off;
  for (const SupportSample& sample : samples) off.push_back(std::abs(sample.distance - row_of(sample).dot(solution)));
  return 1.4826 * median(std::move(off));
}

FamilyProjections family_projections(int corners) {
  // Images of the regular polygon: each corner's y and z are any linear function of where it stands, and a shift.
  Eigen::MatrixXd affine = Eigen::MatrixXd::Zero(2 * corners, 6), similar = Eigen::MatrixXd::Zero(2 * corners, 4);
  for (int i = 0; i < corners; ++i) {
    const Eigen::Vector2d at = towards(2.0 * M_PI * i / corners);
    for (int axis = 0; axis < 2; ++axis) {
      affine(2 * i + axis, axis) = similar(2 * i + axis, axis) = 1.0;
      affine.block<1, 2>(2 * i + axis, 2 + 2 * axis) = at.transpose();
    }
    similar.block<2, 1>(2 * i, 2) = at;
    similar.block<2, 1>(2 * i, 3) = Eigen::Vector2d(-at.y(), at.x());
  }
  const auto onto = [](const Eigen::MatrixXd& basis) {
    return Eigen::MatrixXd(basis * (basis.transpose() * basis).inverse() * basis.transpose());
  };
  const Eigen::MatrixXd on_affine = onto(affine);
  return {Eigen::MatrixXd::Identity(2 * corners, 2 * corners) - on_affine, on_affine - onto(similar)};
}

}  // namespace imprint
