#include "simulation/polygon_section.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace imprint {

PolygonSection::Support PolygonSection::support(double phi) const {
  const Eigen::Vector2d n(std::cos(phi), std::sin(phi)), t(-n.y(), n.x());
  double farthest = -1e300;
  for (const Eigen::Vector2d& c : corners) farthest = std::max(farthest, c.dot(n));
  double sum = 0.0, along = 0.0, across = 0.0, across2 = 0.0, along_dx = 0.0, across_dx = 0.0, mixed = 0.0;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const double weight = std::exp(sharpness * (corners[k].dot(n) - farthest));
    const double cn = corners[k].dot(n), ct = corners[k].dot(t), dn = corners_dx[k].dot(n);
    sum += weight;
    along += weight * cn;
    across += weight * ct;
    across2 += weight * ct * ct;
    along_dx += weight * dn;
    across_dx += weight * corners_dx[k].dot(t);
    mixed += weight * dn * ct;
  }
  for (double* mean : {&along, &across, &across2, &along_dx, &across_dx, &mixed}) *mean /= sum;
  return {corner_radius + farthest + std::log(sum) / sharpness, across,
          -along + sharpness * (across2 - across * across), along_dx,
          across_dx + sharpness * (mixed - along_dx * across)};
}

PolygonSection::Hit PolygonSection::meet(const Eigen::Vector2d& from, const Eigen::Vector2d& direction) const {
  const double half_angle = std::numbers::pi / faces();
  const double half_width = corners.front().norm() * std::cos(half_angle) + corner_radius;
  double entered = -1e300, face_angle = 0.0;
  for (int k = 0; k < faces(); ++k) {
    const double angle = first_face_rad + 2.0 * k * half_angle;
    const Eigen::Vector2d n(std::cos(angle), std::sin(angle));
    const double towards = n.dot(direction);
    if (towards >= 0.0) continue;
    if (const double at = (half_width - n.dot(from)) / towards; at > entered) entered = at, face_angle = angle;
  }
  const Eigen::Vector2d at = from + entered * direction;
  const double beside = at.dot(Eigen::Vector2d(-std::sin(face_angle), std::cos(face_angle)));
  const double arc = corner_radius * std::tan(half_angle), edge = half_width * std::tan(half_angle);
  const double turned = std::clamp((std::abs(beside) - (edge - arc)) / arc, 0.0, 1.0) * half_angle;
  const double angle = face_angle + std::copysign(turned, beside);
  return {at, {std::cos(angle), std::sin(angle)}};
}

PolygonSection polygon_section(int faces, double half_width, double half_width_dx, double corner_radius,
                               double face_bulge, double first_face_rad) {
  PolygonSection section;
  section.corner_radius = corner_radius;
  section.sharpness = std::numbers::ln2 / face_bulge;  // two corners alike far out: log(2) / sharpness beyond them
  section.first_face_rad = first_face_rad;
  const double half_angle = std::numbers::pi / faces;
  for (int k = 0; k < faces; ++k) {
    const double angle = first_face_rad + (2.0 * k + 1.0) * half_angle;
    const Eigen::Vector2d outward = Eigen::Vector2d(std::cos(angle), std::sin(angle)) / std::cos(half_angle);
    section.corners.push_back((half_width - corner_radius - face_bulge) * outward);
    section.corners_dx.push_back(half_width_dx * outward);
  }
  return section;
}

}  // namespace imprint
