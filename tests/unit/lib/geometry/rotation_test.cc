#include "lib/geometry/rotation.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

using namespace imprint;

TEST_CASE("rotation: the matrix of [B] equation 4, element by element") {
  const double w = 0.3, p = -0.7, k = 1.9;
  const Eigen::Matrix3d R = rotation_from_omega_phi_kappa({w, p, k});
  CHECK(R(0, 0) == Approx(std::cos(p) * std::cos(k)));
  CHECK(R(0, 1) == Approx(-std::cos(p) * std::sin(k)));
  CHECK(R(0, 2) == Approx(std::sin(p)));
  CHECK(R(1, 0) == Approx(std::cos(w) * std::sin(k) + std::sin(w) * std::sin(p) * std::cos(k)));
  CHECK(R(1, 2) == Approx(-std::sin(w) * std::cos(p)));
  CHECK(R(2, 1) == Approx(std::sin(w) * std::cos(k) + std::cos(w) * std::sin(p) * std::sin(k)));
}

TEST_CASE("rotation: angles come back from their matrix") {
  for (double w = -3.0; w <= 3.0; w += 0.7) {
    for (double p = -1.5; p <= 1.5; p += 0.5) {
      for (double k = -3.0; k <= 3.0; k += 0.9) {
        const Eigen::Vector3d back = omega_phi_kappa_from_rotation(rotation_from_omega_phi_kappa({w, p, k}));
        CHECK((back - Eigen::Vector3d(w, p, k)).norm() < 1e-9);  // rounding only
      }
    }
  }
}

TEST_CASE("rotation: a rotation vector turns by its length about itself") {
  const Eigen::Vector3d w(0.2, -0.4, 0.1);
  const Eigen::Matrix3d R = rotation_from_vector(w);
  CHECK((R * w - w).norm() < 1e-14);
  CHECK((R.trace() - 1.0) / 2.0 == Approx(std::cos(w.norm())));
  const Eigen::Vector3d tiny = 1e-13 * w;
  CHECK((rotation_from_vector(tiny) - Eigen::Matrix3d::Identity() - cross_matrix(tiny)).norm() < 1e-20);
}
