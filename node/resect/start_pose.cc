#include "node/resect/start_pose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include <opencv2/calib3d.hpp>

namespace imprint {
namespace {

constexpr int kTriples = 400;  // 30 % wrong ids leave 0.34 of the triples good: missing all is below 1e-70

constexpr int kFewestTriples = 60;  // a good start wants a well spread triple, not only one of right ids

// Triples after which a right one has been among them but for one case in 1e12, `share` of the ids being right.
int triples_needed(double share) {
  const double right = share * share * share;
  if (right >= 1.0) return kFewestTriples;
  if (right <= 0.0) return kTriples;
  const double triples = std::ceil(std::log(1e-12) / std::log1p(-right));
  return static_cast<int>(std::clamp<double>(triples, kFewestTriples, kTriples));
}

struct Consensus {
  int agreeing = 0;
  double cost = 0.0;  // truncated squared distances: decides among equal counts
};

Consensus count_agreeing(const std::vector<Correspondence>& all, const CameraPose& pose, double tolerance) {
  Consensus consensus;
  for (const Correspondence& c : all) {
    const Eigen::Vector3d p = pose.cam_from_world(c.p_world_mm);
    const double limit = tolerance * tolerance;
    const double distance = p.z() > 0 ? (p.head<2>() / p.z() - c.direction_cam).squaredNorm() : 2 * limit;
    if (distance < limit) ++consensus.agreeing;
    consensus.cost += std::min(distance, limit);
  }
  return consensus;
}

// Up to four poses that put three points on their rays; none for a degenerate triple.
std::vector<CameraPose> poses_from_three(const std::array<const Correspondence*, 3>& triple) {
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> image;
  for (const Correspondence* c : triple) {
    world.emplace_back(c->p_world_mm.x(), c->p_world_mm.y(), c->p_world_mm.z());
    image.emplace_back(c->direction_cam.x(), c->direction_cam.y());
  }
  std::vector<cv::Mat> rotations, translations;
  try {
    cv::solveP3P(world, image, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
  } catch (const cv::Exception&) {  // collinear points
    return {};
  }
  std::vector<CameraPose> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Eigen::Map<const Eigen::Vector3d> rotation(rotations[i].ptr<double>()),
        translation(translations[i].ptr<double>());
    if (!rotation.allFinite() || !translation.allFinite()) continue;
    CameraPose pose;
    pose.R_cam_world = rotation_from_vector(rotation);
    pose.center_world_mm = -pose.R_cam_world.transpose() * translation;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace

std::optional<CameraPose> start_pose(const std::vector<Correspondence>& all, double tolerance, int min_agreeing) {
  if (all.size() < 3) return std::nullopt;
  std::mt19937 random(1);  // the same image gives the same pose
  std::vector<std::size_t> order(all.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::optional<CameraPose> best;
  Consensus best_consensus;
  int needed = kTriples;
  for (int i = 0; i < needed; ++i) {
    for (std::size_t k = 0; k < 3; ++k) std::swap(order[k], order[k + random() % (order.size() - k)]);
    for (const CameraPose& pose : poses_from_three({&all[order[0]], &all[order[1]], &all[order[2]]})) {
      const Consensus consensus = count_agreeing(all, pose, tolerance);
      if (!best || consensus.agreeing > best_consensus.agreeing ||
          (consensus.agreeing == best_consensus.agreeing && consensus.cost < best_consensus.cost)) {
        best = pose;
        best_consensus = consensus;
        needed = triples_needed(consensus.agreeing / static_cast<double>(all.size()));
      }
    }
  }
  if (best_consensus.agreeing < min_agreeing) return std::nullopt;
  return best;
}

}  // namespace imprint
