#include "fusion/combine/rod_surface.h"

#include <cmath>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr double kStep = 4.0;
constexpr int kNodes = 200;

std::vector<NodeVector> straight_rod(double radius) {
  std::vector<NodeVector> nodes(kNodes, NodeVector::Zero());
  for (NodeVector& node : nodes) node(kRadius) = radius;
  return nodes;
}

/// A ray from `center` through `point`.
Eigen::Vector3d towards(const Eigen::Vector3d& center, const Eigen::Vector3d& point) {
  return (point - center).normalized();
}

/// A ray that touches the surface at `point`, from 7 m away, `aslant` along x per unit of travel.
Eigen::Vector3d origin_of_tangent(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double aslant) {
  Eigen::Vector3d direction = normal.cross(Eigen::Vector3d::UnitX()).normalized();
  // Within the tangent plane: leave out what would leave it.
  direction +=
      aslant * (Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitX().dot(normal.normalized()) * normal.normalized());
  return point - 7000.0 * direction.normalized();
}

}  // namespace

TEST_CASE("rod_surface: on a cylinder a ray touches where it is nearest to the axis") {
  const std::vector<NodeVector> nodes = straight_rod(100.0);
  const RodSurface rod(nodes, kStep);
  const Eigen::Vector3d point(401.0, 0.0, 100.0);
  const Eigen::Vector3d origin = origin_of_tangent(point, Eigen::Vector3d::UnitZ(), 0.08);
  const auto contact = rod.touch(origin, towards(origin, point), 300.0);
  REQUIRE(contact.has_value());
  CHECK((contact->point_mm - point).norm() < 1e-6);
  CHECK(contact->value_mm == Approx(100.0).margin(1e-9));
  CHECK((contact->surface_normal - Eigen::Vector3d::UnitZ()).norm() < 1e-9);
}

TEST_CASE("rod_surface: on a cone the contact moves along and the value is still the radius there") {
  std::vector<NodeVector> nodes = straight_rod(100.0);
  const double slope = 0.3;
  for (int i = 0; i < kNodes; ++i) nodes[static_cast<std::size_t>(i)](kRadius) = 60.0 + slope * i * kStep;
  const RodSurface rod(nodes, kStep);
  // A surface point with its cone normal (-slope, n), and a ray in the plane that touches it, 6 deg aslant.
  const double x = 333.0;
  const double radius = 60.0 + slope * x;
  const Eigen::Vector3d point(x, 0.0, radius);
  const Eigen::Vector3d normal = Eigen::Vector3d(-slope, 0.0, 1.0);
  const Eigen::Vector3d origin = origin_of_tangent(point, normal, 0.1);
  const auto contact = rod.touch(origin, towards(origin, point), 500.0);
  REQUIRE(contact.has_value());
  // Without the cone rule the contact would be millimetres off along x.
  CHECK((contact->point_mm - point).norm() < 0.05);
  CHECK(contact->value_mm == Approx(radius).margin(0.02));
}

TEST_CASE("rod_surface: the near edge of a thick part hides the thin part behind it") {
  std::vector<NodeVector> nodes = straight_rod(150.0);
  for (int i = 100; i < kNodes; ++i) nodes[static_cast<std::size_t>(i)](kRadius) = 100.0;
  const RodSurface rod(nodes, kStep);
  // The thick part ends at x = 396. From the thick side, 8 deg aslant, a ray over its edge, 30 deg before its top.
  const double edge = 396.0;
  const double theta = 60.0 * M_PI / 180.0;
  const Eigen::Vector3d point(edge, -150.0 * std::cos(theta), 150.0 * std::sin(theta));
  const Eigen::Vector3d direction = Eigen::Vector3d(0.14, 1.0, 0.0).normalized();
  const auto contact = rod.touch(point - 7000.0 * direction, direction, 400.0);
  REQUIRE(contact.has_value());
  CHECK(contact->x_mm == Approx(edge).margin(1.0));
  CHECK(contact->value_mm == Approx(150.0).margin(0.5));
  CHECK(contact->nearest_x_mm > edge + 5.0);  // taken as a tangent of the thin part it would make that too thick
}

TEST_CASE("rod_surface: out-of-round moves the contact round the section, to where the ray lies in the surface") {
  std::vector<NodeVector> nodes = straight_rod(100.0);
  for (NodeVector& node : nodes) node(sine_of(3)) = 2.0;
  const RodSurface rod(nodes, kStep);
  const double theta = 0.7;
  const double h = 100.0 + 2.0 * std::sin(3.0 * theta);
  const double turning = 6.0 * std::cos(3.0 * theta);
  const Eigen::Vector3d normal(0.0, std::cos(theta), std::sin(theta));
  const Eigen::Vector3d turned(0.0, -std::sin(theta), std::cos(theta));
  const Eigen::Vector3d point = Eigen::Vector3d(400.0, 0.0, 0.0) + h * normal + turning * turned;
  const Eigen::Vector3d origin = origin_of_tangent(point, normal, 0.1);
  const auto contact = rod.touch(origin, towards(origin, point), 380.0);
  REQUIRE(contact.has_value());
  CHECK((contact->point_mm - point).norm() < 1e-6);
  CHECK(contact->value_mm == Approx(h).margin(1e-9));
}

TEST_CASE("rod_surface: a ray along the axis, or from a camera on it, touches nowhere") {
  const std::vector<NodeVector> nodes = straight_rod(100.0);
  const RodSurface rod(nodes, kStep);
  CHECK_FALSE(rod.touch({-5000.0, 10.0, 0.0}, Eigen::Vector3d::UnitX(), 0.0).has_value());
  CHECK_FALSE(rod.touch({400.0, 0.0, 0.0}, Eigen::Vector3d::UnitZ(), 400.0).has_value());
}

}  // namespace imprint
