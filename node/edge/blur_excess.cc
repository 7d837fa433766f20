#include "node/edge/blur_excess.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace imprint {
namespace {

struct Evidence {
  double information = 0.0, right = 0.0;
};

Evidence evidence_of(const FittedLine& line) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mixed = Eigen::Vector3d::Zero(), right = Eigen::Vector3d::Zero();
  Evidence evidence;
  for (int i = 0; i < line.count; ++i) {
    const double z = (i - line.fit.position) / line.shape.blur;
    const EdgeProfile at = edge_profile(z, line.shape);
    const double by_position = -line.fit.step * at.by_z / line.shape.blur, by_blur = -line.fit.step * at.by_z * z;
    const Eigen::Vector3d g(1.0, at.value, by_position);
    const double residual = line.values[i] - line.fit.outside - line.fit.step * at.value;
    normal.noalias() += g * g.transpose();
    mixed += by_blur * g;
    right += residual * g;
    evidence.information += by_blur * by_blur;
    evidence.right += by_blur * residual;
  }
  const Eigen::Vector3d leverage = normal.ldlt().solve(mixed);
  evidence.information -= mixed.dot(leverage);
  evidence.right -= leverage.dot(right);
  return evidence;
}

}  // namespace

std::vector<double> blur_excess(std::span<const FittedLine> lines, int half_lines) {
  std::vector<Evidence> evidence;
  for (const FittedLine& line : lines) evidence.push_back(evidence_of(line));
  std::vector<double> excess;
  for (std::size_t i = 0, first = 0, last = 0; i < lines.size(); ++i) {
    while (lines[first].index < lines[i].index - half_lines) ++first;
    while (last < lines.size() && lines[last].index <= lines[i].index + half_lines) ++last;
    Evidence sum;
    for (std::size_t k = first; k < last; ++k)
      sum.information += evidence[k].information, sum.right += evidence[k].right;
    excess.push_back(sum.information > 0.0 ? sum.right / sum.information : 0.0);
  }
  return excess;
}

}  // namespace imprint
