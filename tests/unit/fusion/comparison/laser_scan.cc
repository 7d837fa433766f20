#include "tests/unit/fusion/comparison/laser_scan.h"

#include <cmath>
#include <random>

namespace imprint::test {

std::vector<Eigen::Vector3d> scanned(const Rod& rod, const Lying& lying, const LaserScan& scan, unsigned seed) {
  constexpr double kFirst = 0.093 * M_PI, kSecond = M_PI - kFirst;  // scanners, about the axis
  constexpr double kSeen = 0.42 * M_PI;                             // to either side; further round it is too grazing
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const Eigen::Vector3d second_is_off =
      scan.registration_mm * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
  std::vector<Eigen::Vector3d> points;
  for (double x = 0.0; x <= rod.length_mm; x += scan.spacing_mm) {
    const double pitch = scan.spacing_mm / rod.radius(x);
    for (const double side : {kFirst, kSecond}) {
      const Eigen::Vector3d sight(0.0, std::cos(side), std::sin(side));
      const Eigen::Vector3d off = side == kSecond ? second_is_off : Eigen::Vector3d::Zero();
      for (double theta = side - kSeen; theta < side + kSeen; theta += pitch)
        points.emplace_back(lying.R * (rod.surface(x, theta) + scan.noise_mm * normal(generator) * sight + off) +
                            lying.origin_mm);
    }
  }
  return points;
}

}  // namespace imprint::test
