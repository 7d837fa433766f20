#include "node/edge/level_slopes.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

// How much of the step a level usually changes by within a pixel: what keeps lines without contrast in bounds.
constexpr double usual_slope_per_px = 0.03;

// What one line says about both slopes (inside, outside; shares of its step per px), its own step, level and position
// eliminated.
struct SlopeEvidence {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  Eigen::RowVector2d shift = Eigen::RowVector2d::Zero();  // of the fitted position, for a slope of 1
};

SlopeEvidence evidence_of(const FittedLine& line) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> mixed = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  SlopeEvidence evidence;
  for (int i = 0; i < line.count; ++i) {
    const EdgeProfile at = edge_profile((i - line.fit.position) / line.shape.blur, line.shape);
    const Eigen::Vector3d g(1.0, at.value, -line.fit.step * at.by_z / line.shape.blur);
    const Eigen::Vector2d ramps = line.fit.step * line.shape.blur * Eigen::Vector2d(at.ramp_inside, at.ramp_outside);
    const double residual = line.values[i] - line.fit.outside - line.fit.step * at.value;
    normal.noalias() += g * g.transpose();
    mixed.noalias() += g * ramps.transpose();
    right.noalias() += residual * g;
    evidence.information.noalias() += ramps * ramps.transpose();
    evidence.right.noalias() += residual * ramps;
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  const Eigen::Matrix<double, 3, 2> leverage = solver.solve(mixed);
  evidence.information -= mixed.transpose() * leverage;
  evidence.right -= leverage.transpose() * right;
  evidence.shift = leverage.row(2);
  return evidence;
}

double median_residual(std::span<const FittedLine> lines) {
  std::vector<double> residuals;
  for (const FittedLine& line : lines) residuals.push_back(line.fit.residual);
  return median(std::move(residuals));
}

}  // namespace

std::vector<double> shifts_by_slopes(std::span<const FittedLine> lines, int half_lines) {
  if (lines.empty()) return {};
  const double common = std::max(1e-6, median_residual(lines));
  const Eigen::Matrix2d prior = std::pow(common / usual_slope_per_px, 2) * Eigen::Matrix2d::Identity();
  std::vector<SlopeEvidence> evidence;
  std::vector<double> trust;
  for (const FittedLine& line : lines) {
    evidence.push_back(evidence_of(line));
    trust.push_back(std::min(1.0, std::pow(2.0 * common / std::max(line.fit.residual, 1e-9), 4)));
  }
  std::vector<double> shifts;
  for (std::size_t i = 0, first = 0, last = 0; i < lines.size(); ++i) {
    while (lines[first].index < lines[i].index - half_lines) ++first;
    while (last < lines.size() && lines[last].index <= lines[i].index + half_lines) ++last;
    Eigen::Matrix2d information = prior;
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t k = first; k < last; ++k) {
      information += trust[k] * evidence[k].information;
      right += trust[k] * evidence[k].right;
    }
    const Eigen::Vector2d slopes = information.ldlt().solve(right);
    shifts.push_back(std::clamp(-evidence[i].shift.dot(slopes), -1.0, 1.0));
  }
  return shifts;
}

}  // namespace imprint
