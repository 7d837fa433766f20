#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "lib/geometry/points.h"
#include "simulation/layout.h"
#include "simulation/polygon_section.h"
#include "simulation/scene.h"

namespace imprint {

/// Radiance of a black body at 680 nm against that at the reference temperature (Wien's law).
double relative_radiance(double temperature_c, double reference_c);

/// How bright the body looks where a camera sees it. Only brightness: the outline is not its business.
class SurfaceShader {
 public:
  SurfaceShader(const Scene& scene, const Layout& layout);

  /// Share of full scale at a point of the nominal surface; `phi` rad in the body's y-z plane, `facing` the cosine
  /// between normal and line of sight, 0 at the rim.
  [[nodiscard]] double level(double x_mm, double phi, double radius_mm, double facing) const;

  /// Nominal radius and centre of the section nearest to x, from a table.
  struct NominalSection {
    double radius, radius_dx;
    Eigen::Vector2d center;
    PolygonSection polygon;
  };
  [[nodiscard]] const NominalSection& nominal(double x_mm) const;

 private:
  [[nodiscard]] double glowing(double x_mm, const Eigen::Vector3d& p, double facing) const;
  [[nodiscard]] double dark(double phi, const Eigen::Vector3d& p, double facing) const;
  [[nodiscard]] double scale_noise(const Eigen::Vector3d& p) const;

  SceneKind kind_;
  SurfaceScene surface_;
  double length_mm_, size_mm_;
  double wall_level_;
  double scale_threshold_ = 2.0;
  double hot_at_ = 0.5;
  double light_phi_ = 1.2;
  std::uint64_t seed_;
  std::vector<NominalSection> sections_;
  double section_step_mm_;
};

/// A camera's line of sight meeting the nominal body (body frame).
struct SurfaceHit {
  double x_mm, phi, radius_mm, facing;
};

/// Where the ray from `center` along `direction` meets the nominal surface, or comes nearest to it.
SurfaceHit meet_surface(const SurfaceShader& shader, double length_mm, const Eigen::Vector3d& center,
                        const Eigen::Vector3d& direction);

}  // namespace imprint
