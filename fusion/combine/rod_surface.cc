#include "fusion/combine/rod_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace imprint {

Eigen::Matrix<double, 2 * kHarmonics, 1> harmonics_of(const Eigen::Vector2d& normal) {
  static_assert(kFirstHarmonic == 2);
  Eigen::Matrix<double, 2 * kHarmonics, 1> values;
  double cosine = normal.x();
  double sine = normal.y();
  for (int k = 0; k < kHarmonics; ++k) {
    const double next = cosine * normal.x() - sine * normal.y();
    sine = sine * normal.x() + cosine * normal.y();
    cosine = next;
    values(2 * k) = cosine;
    values(2 * k + 1) = sine;
  }
  return values;
}

RodSurface::RodSurface(std::span<const NodeVector> nodes, double step_mm) : nodes_(nodes), step_mm_(step_mm) {
  for (const NodeVector& node : nodes_) largest_radius_mm_ = std::max(largest_radius_mm_, node(kRadius));
}

RodSurface::Place RodSurface::place(double x_mm) const {
  const double last = static_cast<double>(nodes_.size()) - 2.0;
  const double position = x_mm / step_mm_;
  const double node = std::clamp(std::floor(position), 0.0, last);
  return {static_cast<std::size_t>(node), std::clamp(position - node, 0.0, 1.0)};
}

double RodSurface::support(std::size_t node, const Eigen::Matrix<double, 2 * kHarmonics, 1>& harmonics) const {
  return nodes_[node](kRadius) + nodes_[node].tail<2 * kHarmonics>().dot(harmonics);
}

double RodSurface::deepest(double x_mm, double distance_mm, double steepness,
                           const Eigen::Matrix<double, 2 * kHarmonics, 1>& harmonics) const {
  // How far along x a thicker part could still reach the ray.
  const double thicker = largest_radius_mm_ * largest_radius_mm_ - distance_mm * distance_mm;
  const double reach = std::sqrt(std::max(thicker, 0.0)) / steepness + step_mm_;
  const std::size_t first = place(x_mm - reach).node;
  const std::size_t last = place(x_mm + reach).node;
  double best_depth = -std::numeric_limits<double>::infinity();
  double best = 0.0;
  double here = support(first, harmonics);
  for (std::size_t i = first; i <= last; ++i) {
    const double next = support(i + 1, harmonics);
    const double slope = (next - here) / step_mm_;
    const double low = static_cast<double>(i) * step_mm_ - x_mm;
    const double high = low + step_mm_;
    // Depth is support - hypot(distance, steepness dx): its only peak on a straight piece, or the piece's end.
    double along = slope > 0.0 ? high : low;
    if (std::abs(slope) < steepness)
      along =
          std::clamp(slope * distance_mm / (steepness * std::sqrt(steepness * steepness - slope * slope)), low, high);
    const double depth =
        here + slope * (along - low) - std::sqrt(distance_mm * distance_mm + steepness * steepness * along * along);
    if (depth > best_depth) {
      best_depth = depth;
      best = along;
    }
    here = next;
  }
  return best;
}

std::optional<RodSurface::Contact> RodSurface::touch(const Eigen::Vector3d& center_mm, const Eigen::Vector3d& ray,
                                                     double x_guess_mm) const {
  // Closest to the axis, each section for itself.
  double x = x_guess_mm;
  double travel = 0.0;
  Eigen::Vector2d outward;
  Eigen::Vector2d sight;  // the ray as a section sees it that moves with the axis
  for (int iteration = 0; iteration < 4; ++iteration) {
    const Place at = place(x);
    const NodeVector& a = nodes_[at.node];
    const NodeVector& b = nodes_[at.node + 1];
    const Eigen::Vector2d slope(a(kYSlope) + at.share * (b(kYSlope) - a(kYSlope)),
                                a(kZSlope) + at.share * (b(kZSlope) - a(kZSlope)));
    const double beyond = x - (static_cast<double>(at.node) + at.share) * step_mm_;
    const Eigen::Vector2d axis =
        Eigen::Vector2d(a(kY) + at.share * (b(kY) - a(kY)), a(kZ) + at.share * (b(kZ) - a(kZ))) + beyond * slope;
    sight = ray.tail<2>() - ray.x() * slope;
    const double length2 = sight.squaredNorm();
    if (length2 < 1e-6) return std::nullopt;
    // The axis runs on straight from x: its point where the ray is at `travel`.
    const Eigen::Vector2d from_axis = center_mm.tail<2>() - axis - (center_mm.x() - x) * slope;
    travel = -from_axis.dot(sight) / length2;
    outward = from_axis + travel * sight;
    const double step = center_mm.x() + travel * ray.x() - x;
    x += step;
    if (!std::isfinite(x)) return std::nullopt;
    if (std::abs(step) < 1e-7 * step_mm_) break;
  }
  const double distance = outward.norm();
  if (travel <= 0.0 || distance < 1e-9) return std::nullopt;

  const double sight_length = sight.norm();
  const Eigen::Vector2d forward = sight / sight_length;
  const Eigen::Vector2d square = outward / distance;
  Contact contact;
  contact.nearest_x_mm = x;
  contact.x_per_mm = ray.x() / sight_length;
  contact.normal = square;
  contact.harmonics = harmonics_of(square);
  // In the section, forward of the closest point: to the shoulder first, then by the out-of-round.
  double advance = 0.0;
  if (std::abs(ray.x()) > 1e-9) {
    const double steepness = sight_length / std::abs(ray.x());
    advance = deepest(x, distance, steepness, contact.harmonics) * sight_length / ray.x();
    contact.normal = (distance * square + advance * forward).normalized();
    contact.harmonics = harmonics_of(contact.normal);
  }
  const Place near = place(x + advance * ray.x() / sight_length);
  const NodeVector node = (1.0 - near.share) * nodes_[near.node] + near.share * nodes_[near.node + 1];
  double turning = 0.0;  // d support / d theta
  for (int k = kFirstHarmonic; k <= kLastHarmonic; ++k) {
    const int j = 2 * (k - kFirstHarmonic);
    turning += k * (node(sine_of(k)) * contact.harmonics(j) - node(cosine_of(k)) * contact.harmonics(j + 1));
  }
  const Eigen::Vector2d turned(-contact.normal.y(), contact.normal.x());
  advance += turning * turned.dot(forward);

  contact.point_mm = center_mm + (travel + advance / sight_length) * ray;
  contact.x_mm = contact.point_mm.x();
  const Place at = place(contact.x_mm);
  contact.node = at.node;
  contact.share = at.share;
  contact.value_mm = contact.normal.dot(contact.point_mm.tail<2>());
  // The ray lies in the surface.
  contact.surface_normal.tail<2>() = contact.normal;
  contact.surface_normal.x() = std::abs(ray.x()) > 1e-9
                                   ? -contact.normal.dot(ray.tail<2>()) / ray.x()
                                   : -contact.normal.dot(Eigen::Vector2d(node(kYSlope), node(kZSlope)));
  return contact;
}

}  // namespace imprint
