#pragma once

#include <map>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "lib/result/result.h"
#include "lib/targets/target_field.h"

namespace imprint {

/// p_to = scale R p_from + shift.
struct Similarity {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double scale = 1.0;
  double rms = 0.0;  ///< root mean square of the distances left, in units of `to`

  [[nodiscard]] Eigen::Vector3d operator()(const Eigen::Vector3d& p) const { return scale * (R * p) + shift; }
};

/// Least-squares fit of one set of points onto another, all of one weight; `with_scale` false holds the scale at 1.
/// At least three points that are not on a line make it unique.
Similarity fit_points(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to,
                      bool with_scale);

/// How the frame of a measured field is chosen.
struct DatumChoice {
  std::optional<int> origin, x_axis, plane;  ///< 3-2-1: x from `origin` to `x_axis`, `plane` in the xy plane at y > 0
  std::optional<TargetField> align;          ///< or the best fit, without scale, onto these coordinates
};

/// The rotation and origin of the chosen frame: p_world = R (p - origin).
struct Datum {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::string description;             ///< for the report
  std::optional<double> align_rms_mm;  ///< of the best fit onto given coordinates
  int aligned = 0;                     ///< targets it used
};

/// Without a choice: origin at the middle of the targets, z along the normal of their best plane towards the cameras,
/// x along their longest extent in that plane. Fails (invalid_input) when a named target is not among the points, the
/// three are on a line, or fewer than three are common with the coordinates given.
Result<Datum> choose_datum(const std::map<int, Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& cameras,
                           const DatumChoice& choice);

}  // namespace imprint
