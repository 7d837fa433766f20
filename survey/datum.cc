#include "survey/datum.h"

#include <cmath>

#include <fmt/core.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace imprint {
namespace {

constexpr double kOnALine = 0.01;  // second extent over the first, below which points leave a turn open

Eigen::Vector3d middle_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

struct Extents {
  Eigen::Vector3d size;  // ascending
  Eigen::Matrix3d axes;
};

Extents extents_of(const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d middle = middle_of(points);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& p : points) sum += (p - middle) * (p - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum);
  return {solver.eigenvalues().cwiseMax(0.0).cwiseSqrt(), solver.eigenvectors()};
}

Result<Eigen::Vector3d> find(const std::map<int, Eigen::Vector3d>& points, int id, const char* option) {
  const auto it = points.find(id);
  if (it == points.end()) return invalid_input("{} {}: the photographs do not show target {}", option, id, id);
  return it->second;
}

Result<Datum> by_three(const std::map<int, Eigen::Vector3d>& points, const DatumChoice& choice) {
  if (!choice.origin || !choice.x_axis || !choice.plane)
    return invalid_input("--origin, --x-axis and --plane: expected all three or none");
  const auto origin = find(points, *choice.origin, "--origin");
  if (!origin) return pass_on(origin.error());
  const auto along = find(points, *choice.x_axis, "--x-axis");
  if (!along) return pass_on(along.error());
  const auto plane = find(points, *choice.plane, "--plane");
  if (!plane) return pass_on(plane.error());
  const Eigen::Vector3d a = *along - *origin, b = *plane - *origin;
  if (!(a.cross(b).norm() > kOnALine * a.norm() * b.norm()))
    return invalid_input("--origin {} --x-axis {} --plane {}: the three targets are on a line", *choice.origin,
                         *choice.x_axis, *choice.plane);
  const Eigen::Vector3d x = a.normalized(), z = a.cross(b).normalized();
  Datum datum;
  datum.R << x.transpose(), z.cross(x).transpose(), z.transpose();
  datum.origin = *origin;
  datum.description =
      fmt::format("origin target {}, x towards {}, {} in the xy plane", *choice.origin, *choice.x_axis, *choice.plane);
  return datum;
}

Result<Datum> by_alignment(const std::map<int, Eigen::Vector3d>& points, const TargetField& nominal) {
  std::vector<Eigen::Vector3d> from, to;
  for (const auto& [id, p] : points) {
    const auto it = nominal.targets.find(id);
    if (it == nominal.targets.end()) continue;
    from.push_back(p);
    to.push_back(it->second.p_world_mm);
  }
  const Extents extents = from.empty() ? Extents{} : extents_of(to);
  if (from.size() < 3 || extents.size[1] < kOnALine * extents.size[2])
    return invalid_input("--align: {} of its targets are measured, expected at least 3 that are not on a line",
                         from.size());
  const Similarity fit = fit_points(from, to, false);
  Datum datum;
  datum.R = fit.R;
  datum.origin = -fit.R.transpose() * fit.shift;
  datum.description = fmt::format("best fit onto {} given targets", from.size());
  datum.align_rms_mm = fit.rms;
  datum.aligned = static_cast<int>(from.size());
  return datum;
}

}  // namespace

Similarity fit_points(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to,
                      bool with_scale) {
  Similarity fit;
  if (from.empty()) return fit;
  const Eigen::Vector3d middle_from = middle_of(from), middle_to = middle_of(to);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  double squares = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    sum += (to[i] - middle_to) * (from[i] - middle_from).transpose();
    squares += (from[i] - middle_from).squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d signs(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? 1.0 : -1.0);
  fit.R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  if (with_scale && squares > 0.0) fit.scale = svd.singularValues().dot(signs) / squares;
  fit.shift = middle_to - fit.scale * (fit.R * middle_from);
  double left = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) left += (fit(from[i]) - to[i]).squaredNorm();
  fit.rms = std::sqrt(left / static_cast<double>(from.size()));
  return fit;
}

Result<Datum> choose_datum(const std::map<int, Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& cameras,
                           const DatumChoice& choice) {
  if (choice.align) return by_alignment(points, *choice.align);
  if (choice.origin || choice.x_axis || choice.plane) return by_three(points, choice);
  std::vector<Eigen::Vector3d> all;
  for (const auto& [id, p] : points) all.push_back(p);
  const Extents extents = extents_of(all);
  Datum datum;
  datum.origin = middle_of(all);
  Eigen::Vector3d z = extents.axes.col(0), x = extents.axes.col(2);
  if (z.dot(middle_of(cameras) - datum.origin) < 0.0) z = -z;
  Eigen::Index largest = 0;
  x.cwiseAbs().maxCoeff(&largest);
  datum.R << x.transpose(), z.cross(x).transpose(), z.transpose();
  datum.description =
      "origin in the middle, z normal to the best plane towards the cameras, x along the longest extent";
  return datum;
}

}  // namespace imprint
