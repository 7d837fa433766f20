#include "lib/adjust/own_focal_length.h"

#include <algorithm>
#include <cmath>

#include <ceres/ceres.h>

namespace imprint {

std::optional<OwnFocalLength> own_focal_length(std::array<double, kInteriorTerms> interior, std::array<double, 3> turn,
                                               std::array<double, 3> center, const std::vector<CentreSeen>& centres) {
  const int freedom = 2 * static_cast<int>(centres.size()) - 7;
  if (freedom < 5) return std::nullopt;
  std::vector<CentreSeen> seen = centres;  // Ceres wants places of its own for the targets
  ceres::Problem problem;
  for (CentreSeen& centre : seen) {
    auto* cost = new ceres::AutoDiffCostFunction<CollinearityError, 2, kInteriorTerms, 3, 3, 3>(
        new CollinearityError(centre.error));
    auto* loss = new ceres::CauchyLoss(std::max(3.0, 0.3 / centre.error.sigma_px));
    problem.AddResidualBlock(cost, loss, interior.data(), turn.data(), center.data(), centre.p_world_mm.data());
    problem.SetParameterBlockConstant(centre.p_world_mm.data());
  }
  problem.SetManifold(interior.data(), new ceres::SubsetManifold(kInteriorTerms, {1, 2, 3, 4, 5, 6, 7, 8, 9}));
  ceres::Solver::Options how;
  how.max_num_iterations = 100;
  how.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  ceres::Covariance::Options exact;
  exact.algorithm_type = ceres::DENSE_SVD;
  exact.min_reciprocal_condition_number = 1e-20;
  ceres::Covariance covariance(exact);
  const std::vector<std::pair<const double*, const double*>> wanted{{interior.data(), interior.data()}};
  double variance = 0.0;
  if (!summary.IsSolutionUsable() || !covariance.Compute(wanted, &problem) ||
      !covariance.GetCovarianceBlockInTangentSpace(interior.data(), interior.data(), &variance))
    return std::nullopt;
  const double scale = std::max(1.0, 2.0 * summary.final_cost / freedom);
  return OwnFocalLength{interior[0], std::sqrt(variance * scale)};
}

}  // namespace imprint
