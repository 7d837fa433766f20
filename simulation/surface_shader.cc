#include "simulation/surface_shader.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "simulation/random.h"
#include "simulation/texture.h"

namespace imprint {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double second_radiation_constant_m_k = 1.438777e-2;
constexpr double wavelength_m = 680e-9;  // centre of the cameras' bandpass filter
constexpr double kelvin = 273.15;

double smooth_step(double from, double to, double value) {
  const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

double relative_radiance(double temperature_c, double reference_c) {
  const double exponent = second_radiation_constant_m_k / wavelength_m;
  return std::exp(-exponent * (1.0 / (temperature_c + kelvin) - 1.0 / (reference_c + kelvin)));
}

SurfaceShader::SurfaceShader(const Scene& scene, const Layout& layout)
    : kind_(scene.kind),
      surface_(scene.surface),
      length_mm_(layout.body.length_mm()),
      size_mm_(2.0 * layout.body.largest_radius_mm()),
      wall_level_(scene.backdrop.level),
      seed_(stream_seed(scene.seed, "surface")),
      section_step_mm_(0.002 * length_mm_) {
  surface_.scale_coverage = std::clamp(scene.corruption * surface_.scale_coverage, 0.0, 0.9);
  Random random(seed_);
  hot_at_ = random.uniform(0.3, 0.7);
  light_phi_ = random.uniform(0.6, 2.4);
  for (double x = 0.0; x <= length_mm_ + section_step_mm_; x += section_step_mm_) {
    const SectionShape section = layout.body.section(std::min(x, length_mm_));
    sections_.push_back({section.radius, section.radius_dx, section.center, section.polygon});
  }
  // The threshold that leaves the asked share of the surface under scale.
  std::vector<double> samples(4000);
  for (double& sample : samples) {
    const double phi = random.angle_rad(), r = 0.5 * size_mm_;
    sample = scale_noise({random.uniform(0.0, length_mm_), r * std::cos(phi), r * std::sin(phi)});
  }
  std::sort(samples.begin(), samples.end());
  const double rank = (1.0 - surface_.scale_coverage) * static_cast<double>(samples.size());
  if (surface_.scale_coverage > 0.0)
    scale_threshold_ = samples[std::min(samples.size() - 1, static_cast<std::size_t>(rank))];
}

// Large plates and small flakes.
double SurfaceShader::scale_noise(const Eigen::Vector3d& p) const {
  return fractal_noise(seed_ + 1, p / (0.4 * size_mm_), 6, 0.62);
}

const SurfaceShader::NominalSection& SurfaceShader::nominal(double x_mm) const {
  const double index = std::clamp(x_mm / section_step_mm_, 0.0, static_cast<double>(sections_.size() - 1));
  return sections_[static_cast<std::size_t>(index)];
}

double SurfaceShader::level(double x_mm, double phi, double radius_mm, double facing) const {
  const Eigen::Vector3d p(x_mm, radius_mm * std::cos(phi), radius_mm * std::sin(phi));
  return kind_ == SceneKind::forge ? glowing(x_mm, p, facing) : dark(phi, p, facing);
}

double SurfaceShader::glowing(double x_mm, const Eigen::Vector3d& p, double facing) const {
  // Hottest inside, colder towards the ends; the flanks cool a little unevenly.
  const double from_hot = x_mm / length_mm_ - hot_at_;
  double temperature = surface_.temperature_c - surface_.temperature_drop_c * std::min(1.0, 4.0 * from_hot * from_hot) -
                       0.12 * surface_.temperature_drop_c * (1.0 + value_noise(seed_ + 50, p / (0.7 * size_mm_)));
  if (surface_.scale_coverage > 0.0) {
    const double above = scale_noise(p) - scale_threshold_;
    const double scale = smooth_step(-0.012, 0.02, above);
    if (scale > 0.0) {
      // Thin at its border, thicker inside and blistered; seen aslant it hides all of the glow behind it.
      const double thickness =
          0.5 + 0.7 * std::clamp(3.0 * above, 0.0, 1.0) + 0.3 * value_noise(seed_ + 60, p / (0.05 * size_mm_));
      temperature -= scale * thickness * surface_.scale_drop_c * (1.0 + 0.7 * (1.0 - facing));
    }
    // A grey film, uneven, with cracks and tool marks.
    const double film = fractal_noise(seed_ + 70, p / (0.12 * size_mm_), 5, 0.75);
    temperature -= 0.14 * surface_.scale_drop_c * (1.0 + film);
  }
  const double limb = 1.0 - surface_.limb_darkening * (1.0 - facing);
  const double lit = surface_.scale_coverage > 0.0 ? 0.4 * wall_level_ * facing : 0.0;  // by the hall's lamps
  return surface_.level * limb * relative_radiance(temperature, surface_.temperature_c) + lit;
}

double SurfaceShader::dark(double phi, const Eigen::Vector3d& p, double facing) const {
  // A matt black tube under a lamp: a faint bright line, and the wall mirrored at grazing angles.
  const double from_lamp = std::remainder(phi - light_phi_, 2.0 * pi);
  const double shine = 0.6 * std::exp(-0.5 * from_lamp * from_lamp / 0.03);
  const double grazing = std::pow(1.0 - facing, 6.0) * surface_.limb_darkening;
  double level = surface_.level * (1.0 + shine) + 0.25 * grazing * wall_level_;
  if (surface_.scale_coverage > 0.0) {  // bare spots and scratches
    const double bare = smooth_step(0.0, 0.03, scale_noise(p) - scale_threshold_);
    level += 1.5 * bare * surface_.level * (0.5 + 0.5 * facing);
    level *= 1.0 + 0.15 * fractal_noise(seed_ + 70, p / (0.05 * size_mm_), 3, 0.7);
  }
  return level;
}

SurfaceHit meet_surface(const SurfaceShader& shader, double length_mm, const Eigen::Vector3d& center,
                        const Eigen::Vector3d& direction) {
  const Eigen::Vector2d d = direction.tail<2>();
  const double dd = d.squaredNorm();
  double x = center.x() - direction.x() * center.tail<2>().dot(d) / dd;  // nearest to the axis
  Eigen::Vector2d from_axis = Eigen::Vector2d::UnitX();
  std::optional<Eigen::Vector2d> of_face;  // normal of a section with faces
  double radius = 1.0, radius_dx = 0.0;
  for (int iteration = 0; iteration < 3; ++iteration) {
    const auto& section = shader.nominal(std::clamp(x, 0.0, length_mm));
    const Eigen::Vector2d o = center.tail<2>() - section.center;
    radius_dx = section.radius_dx;
    if (section.polygon.faces() > 0) {
      const PolygonSection::Hit hit = section.polygon.meet(o, d);
      x = center.x() + (hit.at - o).dot(d) / dd * direction.x();
      from_axis = hit.at;
      radius = from_axis.norm();
      of_face = hit.normal;
      continue;
    }
    const double along = -o.dot(d) / dd;
    const double beside2 = (o + along * d).squaredNorm();
    const double k = along - std::sqrt(std::max(0.0, section.radius * section.radius - beside2) / dd);
    x = center.x() + k * direction.x();
    from_axis = o + k * d;
    radius = section.radius;
  }
  const Eigen::Vector2d outward = from_axis.normalized();
  const Eigen::Vector2d across = of_face.value_or(outward);
  const Eigen::Vector3d normal = Eigen::Vector3d(-radius_dx, across.x(), across.y()).normalized();
  const double facing = std::clamp(-normal.dot(direction) / direction.norm(), 0.0, 1.0);
  return {std::clamp(x, 0.0, length_mm), std::atan2(outward.y(), outward.x()), radius, facing};
}

}  // namespace imprint
