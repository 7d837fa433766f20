#include "tests/unit/fusion/triangulate/forging_sessions.h"

#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <Eigen/Geometry>

namespace imprint::test {

Rod bent_rod(double scale, double bow_mm) {
  Rod rod;
  rod.length_mm = 1900.0 * scale;
  rod.radius = [scale](double) { return 130.0 * scale; };
  rod.axis = [scale, bow_mm](double x) {
    const double t = x / (1900.0 * scale);
    return Eigen::Vector2d(bow_mm * std::sin(M_PI * t), 0.4 * bow_mm * std::sin(2.0 * M_PI * t));
  };
  return rod;
}

Rod stepped_rod() {
  Rod rod = bent_rod();
  rod.radius = [](double x) {
    const auto ramp = [x](double at, double from, double to) {
      return from + (to - from) * std::clamp((x - at) / (std::abs(to - from) / 1.5), 0.0, 1.0);
    };
    if (x < 1100.0) return ramp(400.0, 110.0, 150.0);
    return x < 1500.0 ? ramp(1100.0, 150.0, 130.0) : ramp(1500.0, 130.0, 100.0);
  };
  return rod;
}

bool near_shoulder(double x) {
  return (x > 390.0 && x < 437.0) || (x > 1090.0 && x < 1124.0) || (x > 1490.0 && x < 1530.0);
}

Session observe(const Rod& rod, const Views& views) { return observe_hull(std::span(&rod, 1), views); }

std::vector<Rod> edges_of(const FacetedBar& bar) {
  const Rod spine = bent_rod(1.0, bar.bow_mm);
  const double half = 0.5 * bar.width_mm - bar.corner_radius_mm;
  const double reach = half / std::cos(M_PI / bar.corners);
  std::vector<Rod> edges;
  for (int i = 0; i < bar.corners; ++i) {
    const double angle = 2.0 * M_PI * (i + 0.5) / bar.corners;
    const Eigen::Vector2d corner =
        Eigen::Vector2d(reach * std::cos(angle), reach * std::sin(angle) + (bar.stretch - 1.0) * 0.5 * bar.width_mm *
                                                                               (std::sin(angle) > 0.0 ? 1.0 : -1.0));
    Rod edge = spine;
    edge.radius = [bar](double) { return bar.corner_radius_mm; };
    edge.axis = [spine, corner, bar](double x) {
      const double turn = (bar.turn_deg + bar.twist_deg * x / spine.length_mm) * M_PI / 180.0;
      return Eigen::Vector2d(spine.axis(x) + Eigen::Rotation2Dd(turn) * corner);
    };
    edges.push_back(std::move(edge));
  }
  return edges;
}

Session observe_hull(std::span<const Rod> rods, const Views& views) {
  std::mt19937 generator(views.seed);
  std::normal_distribution<double> normal;
  Session session;
  session.spec.diameter_min_mm *= views.scale;
  session.spec.diameter_max_mm *= views.scale;
  session.spec.end_section_mm = views.scale < 1.0 ? 15.0 : 80.0;
  Lying base;
  base.origin_mm *= views.scale;
  for (int k = 0; k < views.observations; ++k) {
    const double rotation = views.step_deg * k;
    // The manipulator: 1 mm, 0.3 deg of tilt, 0.3 deg of turn.
    Lying lying = turned(base, rotation + (k == 0 ? 0.0 : 0.3 * normal(generator)));
    if (views.observations > 1) lying = displaced(lying, generator, views.scale, 0.3);
    if (k == 0) session.first = lying;
    session.rotations_deg.push_back(rotation);
    std::vector<Imprint> imprints;
    for (const Pinhole& camera : forge_cameras(views.scale)) {
      if (imprints.size() == views.cameras) break;
      Imprint imprint = view_hull(rods, lying, camera);
      if (views.noise_px > 0.0) add_noise(imprint, views.noise_px, generator);
      if (views.pose_sigma_mm > 0.0) {
        const double turn = views.pose_sigma_mm / 7400.0 / views.scale;
        const auto three = [&] { return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)); };
        imprint.pose.center_world_mm += views.pose_sigma_mm * three();
        imprint.pose.R_cam_world = rotation_from_vector(turn * three()) * imprint.pose.R_cam_world;
        imprint.pose.covariance.diagonal().head<3>().setConstant(std::pow(views.pose_sigma_mm, 2));
        imprint.pose.covariance.diagonal().tail<3>().setConstant(turn * turn);
      }
      imprints.push_back(std::move(imprint));
    }
    session.imprints.push_back(std::move(imprints));
  }
  return session;
}

Deviation deviation(const Measurement& measured, const Rod& rod, const Session& session, bool skip_shoulders) {
  Deviation d;
  const AlignedRod truth(rod, session.spec.end_section_mm);
  // The forging's z is the world's: the rod's own y and z are turned against it by how it was first laid down.
  const Eigen::Matrix2d turn = (measured.R_forging_world * session.first.R).bottomRightCorner<2, 2>();
  std::vector<double> diameter2;
  double circularity2 = 0.0;
  double count = 0.0;
  for (const Measurement::Section& section : measured.sections) {
    if (skip_shoulders && near_shoulder(section.s_mm)) continue;
    const double x = std::clamp(section.s_mm, 0.0, rod.length_mm);
    const double axis = (Eigen::Vector2d(section.axis_mm[1], section.axis_mm[2]) - turn * truth.axis(x)).norm();
    const double diameter = section.diameter_mm - truth.diameter(x);
    const double circularity = section.circularity_mm - truth.circularity(x);
    d.axis_rms += axis * axis;
    d.axis_max = std::max(d.axis_max, axis);
    diameter2.push_back(diameter * diameter);
    d.circularity_mean += circularity;
    circularity2 += circularity * circularity;
    d.axis_covered += axis <= section.axis_ci95_mm ? 1.0 : 0.0;
    d.diameter_covered += std::abs(diameter) <= section.diameter_ci95_mm ? 1.0 : 0.0;
    d.circularity_covered += std::abs(circularity) <= section.circularity_ci95_mm ? 1.0 : 0.0;
    d.axis_ci95 += section.axis_ci95_mm;
    d.axis_in_ci += std::pow(axis / section.axis_ci95_mm, 2);
    d.diameter_in_ci += std::pow(diameter / section.diameter_ci95_mm, 2);
    d.circularity_in_ci += std::pow(circularity / section.circularity_ci95_mm, 2);
    count += 1.0;
  }
  const auto rms = [](auto first, auto last) {
    double sum = 0.0;
    for (auto i = first; i != last; ++i) sum += *i;
    return std::sqrt(sum / static_cast<double>(last - first));
  };
  std::sort(diameter2.begin(), diameter2.end());
  d.axis_rms = std::sqrt(d.axis_rms / count);
  d.diameter_rms = rms(diameter2.begin(), diameter2.end());
  d.diameter_best90_rms = rms(diameter2.begin(), diameter2.begin() + static_cast<std::ptrdiff_t>(0.9 * count));
  d.circularity_mean /= count;
  d.circularity_sigma = std::sqrt(std::max(0.0, circularity2 / count - d.circularity_mean * d.circularity_mean));
  d.length = measured.length_mm - rod.length_mm;
  d.length_in_ci = std::abs(d.length) <= measured.length_ci95_mm ? 1.0 : 0.0;
  d.axis_covered /= count;
  d.diameter_covered /= count;
  d.circularity_covered /= count;
  for (double* sum : {&d.axis_ci95, &d.axis_in_ci, &d.diameter_in_ci, &d.circularity_in_ci}) *sum /= count;
  return d;
}

std::string text(const Deviation& d) {
  return fmt::format(
      "axis rms {:.4f} max {:.3f} (ci {:.3f}) | diameter rms {:.4f} best 90 % {:.4f} | circularity mean {:+.3f} sigma "
      "{:.3f} | length {:+.3f} | covered axis {:.3f} diameter {:.3f} circularity {:.3f}",
      d.axis_rms, d.axis_max, d.axis_ci95, d.diameter_rms, d.diameter_best90_rms, d.circularity_mean,
      d.circularity_sigma, d.length, d.axis_covered, d.diameter_covered, d.circularity_covered);
}

}  // namespace imprint::test
