#include "simulation/forging_body.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

#include "simulation/random.h"

namespace imprint {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int width_directions = 360;  // over half a turn: 0.5 deg, an error of a width below 1e-4 of its variation

// Quintic step from 0 to 1 over [0, 1] and its derivative: no jump in slope or curvature at either end.
double step_value(double t) { return t * t * t * (10.0 + t * (6.0 * t - 15.0)); }
double step_slope(double t) { return 30.0 * t * t * (1.0 - t) * (1.0 - t); }

Eigen::Vector2d direction(double phi) { return {std::cos(phi), std::sin(phi)}; }

double width_at(const SectionShape& section, double phi) {
  return section.support(phi).h + section.support(phi + pi).h;
}

double circularity(const SectionShape& section) {
  double smallest = 1e30, largest = -1e30;
  for (int i = 0; i < width_directions; ++i) {
    const double width = width_at(section, pi * i / width_directions);
    smallest = std::min(smallest, width);
    largest = std::max(largest, width);
  }
  return 0.5 * (largest - smallest);
}

/// Points all over a section's boundary, each with the length of boundary that it stands for.
struct BoundaryPoints {
  std::vector<Eigen::Vector2d> at;
  std::vector<double> length;
};

/// A face is passed within a hundredth of a degree: of sections with faces the boundary is walked in chords, each cut
/// into pieces.
BoundaryPoints walk(const SectionShape& section) {
  constexpr double piece_mm = 2.0;
  constexpr int count = 2 * width_directions;
  BoundaryPoints points;
  Eigen::Vector2d from = section.boundary(0.0);
  for (int i = 1; i <= count; ++i) {
    const Eigen::Vector2d to = section.boundary(2.0 * pi * i / count);
    const double length = (to - from).norm();
    const int pieces = 1 + static_cast<int>(length / piece_mm);
    for (int k = 0; k < pieces; ++k) {
      points.at.emplace_back(from + (to - from) * (k + 0.5) / pieces);
      points.length.push_back(length / pieces);
    }
    from = to;
  }
  return points;
}

}  // namespace

SectionShape::Support SectionShape::support(double phi) const {
  Support s{radius, 0.0, 0.0, radius_dx, 0.0};
  if (polygon.faces() > 0) {
    const PolygonSection::Support p = polygon.support(phi);
    s = {p.h, p.h_phi, p.h_phiphi, p.h_x, p.h_xphi};
  }
  const double c1 = std::cos(phi), s1 = std::sin(phi);
  double cn = c1, sn = s1;
  for (int i = 0; i < harmonics; ++i) {
    const double next = cn * c1 - sn * s1;
    sn = sn * c1 + cn * s1;
    cn = next;
    const double n = first_harmonic + i;
    const double value = cosine[i] * cn + sine[i] * sn;
    s.h += value;
    s.h_phi += n * (sine[i] * cn - cosine[i] * sn);
    s.h_phiphi -= n * n * value;
    s.h_x += cosine_dx[i] * cn + sine_dx[i] * sn;
    s.h_xphi += n * (sine_dx[i] * cn - cosine_dx[i] * sn);
  }
  for (const Mark& mark : marks) {
    const double sine_d = std::sin(phi - mark.phi), cosine_d = std::cos(phi - mark.phi), k = mark.inverse_width2;
    const double bump = std::exp((cosine_d - 1.0) * k);
    s.h -= mark.depth * bump;
    s.h_phi += mark.depth * bump * k * sine_d;
    s.h_phiphi -= mark.depth * bump * k * (k * sine_d * sine_d - cosine_d);
    s.h_x -= mark.depth_dx * bump;
    s.h_xphi += mark.depth_dx * bump * k * sine_d;
  }
  return s;
}

Eigen::Vector2d SectionShape::boundary(double phi) const {
  const Support s = support(phi);
  return center + s.h * direction(phi) + s.h_phi * Eigen::Vector2d(-std::sin(phi), std::cos(phi));
}

SectionTruth section_truth(const SectionShape& section) {
  constexpr int count = 2 * width_directions;
  Eigen::Matrix<double, count, 1> h;
  BoundaryPoints boundary;
  for (int i = 0; i < count; ++i) {
    const double phi = 2.0 * pi * i / count;
    const SectionShape::Support s = section.support(phi);
    h[i] = s.h;
    boundary.at.emplace_back(section.center + s.h * direction(phi) + s.h_phi * direction(phi + 0.5 * pi));
    boundary.length.push_back(s.h + s.h_phiphi);
  }
  const auto widths = (h.head<width_directions>() + h.tail<width_directions>()).eval();
  SectionTruth truth;
  truth.diameter_mm = widths.mean();
  double narrowest = widths.minCoeff();
  const int faces = section.polygon.faces();
  for (int k = 0; k < faces / 2; ++k) {
    truth.widths_mm.push_back(width_at(section, section.polygon.first_face_rad + 2.0 * pi * k / faces));
    narrowest = std::min(narrowest, truth.widths_mm.back());  // half a degree beside it is a millimetre too wide
  }
  truth.circularity_mm = 0.5 * (widths.maxCoeff() - narrowest);
  if (faces > 0) boundary = walk(section);

  // Gauss-Newton on the distance from a circle: centre and radius.
  Eigen::Vector3d circle(section.center.x(), section.center.y(), 0.5 * truth.diameter_mm);
  for (int iteration = 0; iteration < 4; ++iteration) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < boundary.at.size(); ++i) {
      const Eigen::Vector2d from_center = boundary.at[i] - circle.head<2>();
      const double distance = from_center.norm();
      const Eigen::Vector3d gradient(-from_center.x() / distance, -from_center.y() / distance, -1.0);
      normal += boundary.length[i] * gradient * gradient.transpose();
      right -= boundary.length[i] * (distance - circle.z()) * gradient;
    }
    circle += normal.ldlt().solve(right);
  }
  truth.center_mm = circle.head<2>();
  return truth;
}

Result<ForgingBody> ForgingBody::make(const ForgingScene& scene, double end_section_mm, std::uint64_t seed) {
  ForgingBody body;
  body.length_mm_ = scene.length_mm;
  body.add_stations(scene, seed);
  body.add_bow(scene, seed);
  body.add_harmonics(scene, seed);
  body.add_press_marks(scene, seed);
  body.add_faces(scene, seed);  // once the harmonics have been scaled to the circularity asked for
  body.put_ideal_axis_on_x(end_section_mm);
  constexpr int probes = 400;
  for (int i = 0; i <= probes; ++i) {
    const double x = scene.length_mm * i / probes;
    const SectionShape section = body.section(x);
    for (int k = 0; k < width_directions; ++k) {
      const SectionShape::Support s = section.support(2.0 * pi * k / width_directions);
      if (s.h + s.h_phiphi < 0.05 * section.radius) {
        return invalid_input(
            "forging: the section at {:.0f} mm is not convex (radius {:.1f} mm); make circularity_mm ({}) or "
            "press_mark_depth_mm ({}) smaller{}",
            x, section.radius, scene.circularity_mm, scene.press_mark_depth_mm,
            scene.faces > 0 ? ", or corner_radius_mm larger: marks and waves of its size do not fit on a corner" : "");
      }
    }
  }
  return body;
}

void ForgingBody::add_stations(const ForgingScene& scene, std::uint64_t seed) {
  Random random(stream_seed(seed, "stations"));
  const auto offset = [&] {
    return Eigen::Vector2d(random.uniform(0.0, scene.eccentricity_mm) * direction(random.angle_rad()));
  };
  radius_ = 0.5 * scene.stations.front().diameter_mm;
  center_ = offset();
  double radius = radius_;
  Eigen::Vector2d center = center_;
  for (std::size_t i = 1; i < scene.stations.size(); ++i) {
    const double next_radius = 0.5 * scene.stations[i].diameter_mm;
    const Eigen::Vector2d next_center = offset();
    // The steepest slope of the quintic is 1.875 height / length: at most 1.5 here, which no camera looks behind.
    const double length = std::max(scene.transition_mm, 1.25 * std::abs(next_radius - radius));
    const double middle = scene.stations[i].start_mm;
    steps_.push_back({middle - 0.5 * length, middle + 0.5 * length, next_radius - radius, next_center - center});
    radius = next_radius;
    center = next_center;
  }
}

void ForgingBody::add_bow(const ForgingScene& scene, std::uint64_t seed) {
  Random random(stream_seed(seed, "bow"));
  const double angle = random.angle_rad();
  bow_ = scene.bow_mm * direction(angle);
  second_bow_ = 0.2 * scene.bow_mm * direction(angle + random.uniform(0.5, 2.6));
  kink_at_ = length_mm_ * random.uniform(0.3, 0.7);
  kink_softness_ = 0.01 * length_mm_;
  // Two straight halves that meet at kink_at_ rise kink_mm over the chord.
  kink_ = scene.kink_mm * length_mm_ / (2.0 * kink_at_ * (length_mm_ - kink_at_)) * direction(random.angle_rad());
}

void ForgingBody::add_harmonics(const ForgingScene& scene, std::uint64_t seed) {
  Random random(stream_seed(seed, "harmonics"));
  constexpr std::array<double, SectionShape::harmonics> strength{1.0, 0.45, 0.25, 0.1, 0.07};
  for (int i = 0; i < SectionShape::harmonics; ++i) {
    harmonics_[i] = {strength[i] * random.uniform(0.7, 1.3), length_mm_ * random.uniform(0.4, 1.1), random.angle_rad(),
                     random.uniform(-0.6, 0.6) / length_mm_, random.angle_rad()};
  }
  double worst = 0.0;
  for (int i = 0; i <= 200; ++i) worst = std::max(worst, circularity(section(length_mm_ * i / 200)));
  for (Harmonic& harmonic : harmonics_) harmonic.amplitude *= scene.circularity_mm / worst;
}

void ForgingBody::add_press_marks(const ForgingScene& scene, std::uint64_t seed) {
  Random random(stream_seed(seed, "press marks"));
  for (int i = 0; i < scene.press_marks; ++i) {
    const double width = random.uniform(0.22, 0.4);  // rad
    marks_.push_back({length_mm_ * random.uniform(0.03, 0.97), length_mm_ * random.uniform(0.012, 0.04),
                      random.angle_rad(), 1.0 / (width * width), scene.press_mark_depth_mm * random.uniform(0.3, 1.0)});
  }
}

void ForgingBody::add_faces(const ForgingScene& scene, std::uint64_t seed) {
  faces_ = scene.faces;
  corner_radius_ = scene.corner_radius_mm;
  face_bulge_ = scene.face_bulge_mm;
  first_face_rad_ = Random(stream_seed(seed, "faces")).angle_rad();
}

void ForgingBody::put_ideal_axis_on_x(double end_section_mm) {
  const int count = 1 + 2 * static_cast<int>(std::ceil(end_section_mm));  // every 0.5 mm or so
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d right = Eigen::Matrix2d::Zero();
  for (int end = 0; end < 2; ++end) {
    for (int i = 0; i < count; ++i) {
      const double from_end = end_section_mm * i / (count - 1);
      const double x = end == 0 ? from_end : length_mm_ - from_end;
      const Eigen::Vector2d basis(1.0, x);
      normal += basis * basis.transpose();
      right += basis * section_truth(section(x)).center_mm.transpose();
    }
  }
  const Eigen::Matrix2d line = normal.ldlt().solve(right);
  // A shear along x keeps the sections: the centres move by exactly the line.
  line_offset_ = line.row(0).transpose();
  line_slope_ = line.row(1).transpose();
}

void ForgingBody::add_curve(double x, Eigen::Vector2d& center, Eigen::Vector2d& center_dx) const {
  const double a = pi * x / length_mm_;
  center += bow_ * std::sin(a) + second_bow_ * std::sin(2.0 * a);
  center_dx += (pi / length_mm_) * (bow_ * std::cos(a) + 2.0 * second_bow_ * std::cos(2.0 * a));
  const double from_kink = x - kink_at_;
  const double bend = std::hypot(from_kink, kink_softness_);
  center -= kink_ * bend;
  center_dx -= kink_ * (from_kink / bend);
  center -= line_offset_ + line_slope_ * x;
  center_dx -= line_slope_;
}

SectionShape ForgingBody::section(double x_mm) const {
  SectionShape s;
  s.radius = radius_;
  s.center = center_;
  for (const Step& step : steps_) {
    if (x_mm <= step.start) continue;
    const double t = std::min((x_mm - step.start) / (step.end - step.start), 1.0);
    const double slope = t < 1.0 ? step_slope(t) / (step.end - step.start) : 0.0;
    s.radius += step.radius * step_value(t);
    s.radius_dx += step.radius * slope;
    s.center += step.center * step_value(t);
    s.center_dx += step.center * slope;
  }
  add_curve(x_mm, s.center, s.center_dx);
  if (faces_ > 0)
    s.polygon = polygon_section(faces_, s.radius, s.radius_dx, corner_radius_, face_bulge_, first_face_rad_);
  for (int i = 0; i < SectionShape::harmonics; ++i) {
    const Harmonic& harmonic = harmonics_[i];
    const double k = 2.0 * pi / harmonic.wavelength, wave = k * x_mm + harmonic.phase;
    const double strength = harmonic.amplitude * (0.7 + 0.3 * std::cos(wave));
    const double strength_dx = -harmonic.amplitude * 0.3 * k * std::sin(wave);
    const double angle = harmonic.angle + harmonic.twist * x_mm;
    s.cosine[i] = strength * std::cos(angle);
    s.sine[i] = strength * std::sin(angle);
    s.cosine_dx[i] = strength_dx * std::cos(angle) - harmonic.twist * s.sine[i];
    s.sine_dx[i] = strength_dx * std::sin(angle) + harmonic.twist * s.cosine[i];
  }
  for (const PressMark& mark : marks_) {
    const double t = (x_mm - mark.x) / mark.length;
    if (std::abs(t) > 6.5) continue;  // below 1e-9 of its depth
    const double depth = mark.depth * std::exp(-0.5 * t * t);
    s.marks.push_back({mark.phi, mark.inverse_width2, depth, -depth * t / mark.length});
  }
  return s;
}

double ForgingBody::largest_radius_mm() const {
  double radius = radius_, largest = radius_;
  for (const Step& step : steps_) {
    radius += step.radius;
    largest = std::max(largest, radius);
  }
  return faces_ > 0 ? largest / std::cos(pi / faces_) : largest;
}

}  // namespace imprint
