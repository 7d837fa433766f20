#include "tests/paper/multiview/corruption.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/rotation.h"

namespace imprint::test {
namespace {

/// Smooth noise along a rim: normal values at knots, between them by half a cosine, scaled back to their sigma.
void add_haze(ImprintCurve& rim, double sigma_px, double knots_apart, std::mt19937& generator) {
  constexpr double kLost = 0.866;  // RMS of what lies between two knots, of a knot's sigma
  std::normal_distribution<double> normal(0.0, sigma_px / kLost);
  std::vector<double> knots;
  for (std::size_t i = 0; i < rim.offset_px.size(); ++i) {
    const double place = static_cast<double>(i) / knots_apart;
    const auto before = static_cast<std::size_t>(place);
    while (knots.size() < before + 2) knots.push_back(normal(generator));
    const double u = 0.5 - 0.5 * std::cos(M_PI * (place - static_cast<double>(before)));
    rim.offset_px[i] += (1.0 - u) * knots[before] + u * knots[before + 1];
  }
}

}  // namespace

Session corrupted(const Session& session, const Corruption& corruption, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  const auto three = [&] { return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)); };
  Session result = session;
  for (std::vector<Imprint>& imprints : result.imprints) {
    for (Imprint& imprint : imprints) {
      const double apart = std::max(1.0, corruption.haze_px / std::abs(imprint.grid.step_px));
      add_haze(imprint.upper, corruption.haze_sigma_px, apart, generator);
      add_haze(imprint.lower, corruption.haze_sigma_px, apart, generator);
      add_noise(imprint, corruption.edge_sigma_px, generator);
      const double distance_mm = imprint.pose.center_world_mm.norm();
      const double place = corruption.pose_sigma_mm, turn = place / distance_mm;
      imprint.pose.center_world_mm += place * three();
      imprint.pose.R_cam_world = rotation_from_vector(turn * three()) * imprint.pose.R_cam_world;
      imprint.pose.covariance.diagonal().head<3>().setConstant(place * place);
      imprint.pose.covariance.diagonal().tail<3>().setConstant(turn * turn);
    }
  }
  return result;
}

Session of_cameras(const Session& session, std::size_t cameras) {
  Session result = session;
  for (std::vector<Imprint>& imprints : result.imprints) imprints.resize(std::min(imprints.size(), cameras));
  return result;
}

}  // namespace imprint::test
