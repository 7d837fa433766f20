#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "lib/result/result.h"
#include "simulation/polygon_section.h"
#include "simulation/scene.h"

namespace imprint {

/// One section x = const of the body: a convex curve given by its support function h(phi), the distance of the
/// tangent with outward normal (cos phi, sin phi) in (y, z) from the section's centre. phi in rad, lengths in mm.
struct SectionShape {
  struct Mark {
    double phi, inverse_width2, depth, depth_dx;
  };
  static constexpr int first_harmonic = 2;
  static constexpr int harmonics = 5;  // 2 .. 6

  Eigen::Vector2d center = Eigen::Vector2d::Zero();     ///< y, z
  Eigen::Vector2d center_dx = Eigen::Vector2d::Zero();  ///< its derivative along x
  double radius = 0.0, radius_dx = 0.0;                 ///< with faces: half of the width across them
  PolygonSection polygon;                               ///< without faces: the section is round
  std::array<double, harmonics> cosine{}, sine{}, cosine_dx{}, sine_dx{};
  std::vector<Mark> marks;

  struct Support {
    double h, h_phi, h_phiphi, h_x, h_xphi;
  };
  [[nodiscard]] Support support(double phi) const;
  /// The boundary point (y, z) with outward normal direction phi, from the body's x axis.
  [[nodiscard]] Eigen::Vector2d boundary(double phi) const;
};

/// What a measurement should say of one section, body frame.
struct SectionTruth {
  Eigen::Vector2d center_mm = Eigen::Vector2d::Zero();  ///< of the least-squares circle of the boundary
  double diameter_mm = 0.0;                             ///< mean width over all directions
  double circularity_mm = 0.0;                          ///< (largest - smallest width) / 2
  std::vector<double> widths_mm;                        ///< across opposite faces, from the first face on
};

SectionTruth section_truth(const SectionShape& section);

/// A forging as a generalised cylinder: convex sections x = const along the body's x axis from x = 0 to its length,
/// closed by two plane faces. The body's x axis is its ideal axis: the least-squares line through the centres of all
/// sections of the two end sections.
class ForgingBody {
 public:
  /// Random shape within the scene's limits. Fails (invalid_input) when a section would not be convex.
  static Result<ForgingBody> make(const ForgingScene& scene, double end_section_mm, std::uint64_t seed);

  [[nodiscard]] double length_mm() const { return length_mm_; }
  [[nodiscard]] SectionShape section(double x_mm) const;
  [[nodiscard]] double largest_radius_mm() const;

 private:
  struct Step {
    double start, end;       // x range of the transition
    double radius;           // change
    Eigen::Vector2d center;  // change
  };
  struct Harmonic {
    double amplitude, wavelength, phase, twist, angle;
  };
  struct PressMark {
    double x, length, phi, inverse_width2, depth;
  };

  void add_stations(const ForgingScene& scene, std::uint64_t seed);
  void add_bow(const ForgingScene& scene, std::uint64_t seed);
  void add_harmonics(const ForgingScene& scene, std::uint64_t seed);
  void add_press_marks(const ForgingScene& scene, std::uint64_t seed);
  void add_faces(const ForgingScene& scene, std::uint64_t seed);
  void put_ideal_axis_on_x(double end_section_mm);
  void add_curve(double x, Eigen::Vector2d& center, Eigen::Vector2d& center_dx) const;

  double length_mm_ = 0.0;
  double radius_ = 0.0;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  int faces_ = 0;
  double first_face_rad_ = 0.0, corner_radius_ = 0.0, face_bulge_ = 0.0;
  std::vector<Step> steps_;
  Eigen::Vector2d bow_ = Eigen::Vector2d::Zero(), second_bow_ = Eigen::Vector2d::Zero(),
                  kink_ = Eigen::Vector2d::Zero();
  double kink_at_ = 0.0, kink_softness_ = 1.0;
  Eigen::Vector2d line_offset_ = Eigen::Vector2d::Zero(), line_slope_ = Eigen::Vector2d::Zero();
  std::array<Harmonic, SectionShape::harmonics> harmonics_{};
  std::vector<PressMark> marks_;
};

}  // namespace imprint
