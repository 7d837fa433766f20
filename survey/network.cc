#include "survey/network.h"

namespace imprint {

void scale_network(Network& network, double factor) {
  for (auto& [id, p] : network.points) p *= factor;
  for (auto& pose : network.poses)
    if (pose) pose->center_world_mm *= factor;
}

void move_network(Network& network, const Eigen::Matrix3d& R, const Eigen::Vector3d& origin) {
  for (auto& [id, p] : network.points) p = R * (p - origin);
  for (auto& pose : network.poses) {
    if (!pose) continue;
    pose->center_world_mm = R * (pose->center_world_mm - origin);
    pose->R_cam_world = pose->R_cam_world * R.transpose();
  }
}

}  // namespace imprint
