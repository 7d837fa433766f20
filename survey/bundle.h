#pragma once

#include <vector>

#include <Eigen/Core>

#include "lib/adjust/calibrate.h"
#include "lib/result/result.h"
#include "survey/network.h"
#include "survey/scale_bar.h"

namespace imprint {

/// What of the camera an adjustment may change.
enum class FreeInterior { none, focal_and_radial, all };

struct BundleOptions {
  FreeInterior interior = FreeInterior::all;
  double cauchy_px = 0.0;  ///< scale of the robust loss; 0: least squares over the sights that are `used`
  int max_iterations = 100;
};

/// Adjusts camera, poses and points together by the reprojection error, [B] equation 1 with the points unknown too, and
/// finds the residuals of all sights that the network holds. The frame stays free, and without bars the scale; bars
/// whose targets the network holds count as observations. Weak expectations (a principal point near the middle, square
/// pixels, see bundle.cc) keep those constants bounded that the photographs leave open.
/// Fails (job_failed) when the adjustment comes to no solution.
Result<void> adjust_network(Network& network, std::vector<Sight>& sights, const std::vector<ScaleBar>& bars,
                            const BundleOptions& options);

/// Residuals of the sights that the network holds; 1e6 px behind a camera.
void find_residuals(const Network& network, std::vector<Sight>& sights);

/// Covariances of an adjusted network.
struct NetworkPrecision {
  std::map<int, Eigen::Index> first_row;  ///< of each target's 3 rows in `points`
  Eigen::MatrixXd points;                 ///< of all target coordinates jointly
  InteriorMatrix interior = InteriorMatrix::Zero();
  double redundancy = 0.0;        ///< observations less unknowns that the observations determine
  double weighted_squares = 0.0;  ///< of all residuals

  [[nodiscard]] Eigen::Matrix3d of_point(int id) const;
  /// Variance of the distance between two targets.
  [[nodiscard]] double distance_variance(const Network& network, int a, int b) const;
};

/// The covariance of the free network: inner constraints on the points (no shift and no turn of all of them, without
/// bars no change of scale either), so that no arbitrary choice of a frame enters. Sigmas are taken as they stand.
/// Fails (job_failed) when the sights leave something open.
Result<NetworkPrecision> network_precision(const Network& network, const std::vector<Sight>& sights,
                                           const std::vector<ScaleBar>& bars);

}  // namespace imprint
