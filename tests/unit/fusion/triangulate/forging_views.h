#pragma once

#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "lib/imprint/imprint.h"
#include "lib/rig/rig.h"

namespace imprint::test {

/// A bent, stepped, out-of-round rod with exactly known shape. Sections stand square to x; (y, z) of its axis and the
/// support function of its sections (radius and harmonics 2 to 5) are given along x, in mm.
struct Rod {
  double length_mm = 1900.0;
  std::function<Eigen::Vector2d(double)> axis = [](double) { return Eigen::Vector2d::Zero(); };
  std::function<double(double)> radius = [](double) { return 130.0; };
  /// harmonic(k, x) = (cosine, sine), k from 2 to 5
  std::function<Eigen::Vector2d(int, double)> harmonic = [](int, double) { return Eigen::Vector2d::Zero(); };

  [[nodiscard]] double support(double x_mm, double theta) const;
  [[nodiscard]] Eigen::Vector3d surface(double x_mm, double theta) const;  ///< where the normal points to theta
  [[nodiscard]] double circularity(double x_mm) const;                     ///< (largest - smallest width) / 2
};

/// Random smooth out-of-round of the given mean circularity; `wave_mm`: how quickly it changes along x.
void make_out_of_round(Rod& rod, double circularity_mm, double wave_mm, unsigned seed);

/// Where the rod lies in the world: X_world = R X_rod + origin.
struct Lying {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm{-950.0, 30.0, 800.0};
};

/// A pinhole camera, `angle_deg` around the x axis from y towards z, looking at `target_mm`.
struct Pinhole {
  std::string id;
  double focal_length_px = 5722.0;
  CameraPose pose;
};
Pinhole pinhole(std::string id, double angle_deg, double distance_mm, double along_mm = 0.0,
                const Eigen::Vector3d& target_mm = {0.0, 30.0, 800.0}, double focal_length_px = 5722.0,
                double roll_deg = 0.0);

/// The forge's three cameras: 50, 130 and 3 degrees around the axis at 7.4, 7.4 and 11.9 m.
std::vector<Pinhole> forge_cameras(double scale = 1.0);

/// Exact imprint: rims by maximising over the surface, arcs of the end circles included, 500 stations.
Imprint view_rod(const Rod& rod, const Lying& lying, const Pinhole& camera);
/// The same of the hull of several rods of one length, each of which is touched where it stands furthest out: of a
/// forging with faces, one rod at each of its rounded edges.
Imprint view_hull(std::span<const Rod> rods, const Lying& lying, const Pinhole& camera);

/// Normal noise on the curves and ends, the same for axis and rims as an edge finder would give.
void add_noise(Imprint& imprint, double sigma_px, std::mt19937& generator);

/// The rod's axis and sections aligned by its end sections: what a measurement should find at s.
class AlignedRod {
 public:
  AlignedRod(const Rod& rod, double end_section_mm);
  [[nodiscard]] Eigen::Vector2d axis(double s_mm) const;
  [[nodiscard]] double diameter(double s_mm) const { return 2.0 * rod_.radius(s_mm); }
  [[nodiscard]] double circularity(double s_mm) const { return rod_.circularity(s_mm); }

 private:
  const Rod& rod_;
  Eigen::Vector2d mean_, slope_;
  double x_mean_ = 0.0;
};

ForgingSpec forge_spec();

/// Turn by `angle_deg` about the rod's own x.
Lying turned(const Lying& lying, double angle_deg);

/// Moved by up to about a millimetre and turned by up to about half a degree, as a manipulator places it.
Lying displaced(const Lying& lying, std::mt19937& generator, double shift_mm = 1.0, double tilt_deg = 0.3);

}  // namespace imprint::test
