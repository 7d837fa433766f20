#include "tests/unit/fusion/triangulate/forging_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace imprint::test {
namespace {

constexpr double kDegree = M_PI / 180.0;

struct ImagePoint {
  double station;
  double offset;
};

/// The rod before one camera, in the coordinates of the camera's station line.
struct Scene {
  const Rod& rod;
  const Lying& lying;
  const Pinhole& camera;
  StationGrid grid;

  [[nodiscard]] IdealPoint project(const Eigen::Vector3d& p_rod) const {
    const Eigen::Vector3d cam = camera.pose.cam_from_world(lying.R * p_rod + lying.origin_mm);
    return {camera.focal_length_px * cam.x() / cam.z(), camera.focal_length_px * cam.y() / cam.z()};
  }
  [[nodiscard]] ImagePoint at(double x, double theta) const {
    const IdealPoint p = project(rod.surface(x, theta));
    const double dx = p.x_px - grid.origin.x_px;
    const double dy = p.y_px - grid.origin.y_px;
    return {dx * grid.direction_x + dy * grid.direction_y, -dx * grid.direction_y + dy * grid.direction_x};
  }
  /// Signed offset of the surface line `theta` at a station; nothing where the line does not reach it.
  [[nodiscard]] double offset_at(double station, double theta, double sign) const {
    double low = 0.0;
    double high = rod.length_mm;
    double at_low = at(low, theta).station - station;
    double at_high = at(high, theta).station - station;
    if (at_low * at_high > 0.0) return -std::numeric_limits<double>::infinity();
    ImagePoint p{};
    for (int i = 0; i < 60; ++i) {
      // Regula falsi guarded by halving: the station grows steadily along x.
      double middle = low - at_low * (high - low) / (at_high - at_low);
      if (i % 3 == 2) middle = 0.5 * (low + high);
      p = at(middle, theta);
      const double value = p.station - station;
      if (std::abs(value) < 1e-9) break;
      if (value * at_low > 0.0) {
        low = middle;
        at_low = value;
      } else {
        high = middle;
        at_high = value;
      }
    }
    return sign * p.offset;
  }
  /// Largest signed offset of the outline at a station, searched about `guess`.
  [[nodiscard]] double rim(double station, double guess, double sign) const {
    constexpr int kScan = 28;
    constexpr double kReach = 70.0 * kDegree;
    double best = -std::numeric_limits<double>::infinity();
    double best_theta = guess;
    const double pitch = 2.0 * kReach / kScan;
    for (int i = 0; i <= kScan; ++i) {
      const double theta = guess - kReach + i * pitch;
      const double value = offset_at(station, theta, sign);
      if (value > best) {
        best = value;
        best_theta = theta;
      }
    }
    if (!std::isfinite(best)) return best;
    double low = best_theta - pitch;
    double high = best_theta + pitch;
    for (int i = 0; i < 45; ++i) {
      const double a = low + 0.381966 * (high - low);
      const double b = high - 0.381966 * (high - low);
      const double at_a = offset_at(station, a, sign);
      const double at_b = offset_at(station, b, sign);
      best = std::max({best, at_a, at_b});
      // Where the outline's line does not reach the station, go back to where it does.
      if (!std::isfinite(at_a) && !std::isfinite(at_b)) {
        (best_theta < a ? high : low) = best_theta < a ? a : b;
        continue;
      }
      if (at_a > at_b)
        high = b;
      else
        low = a;
    }
    return best;
  }
};

}  // namespace

double Rod::support(double x_mm, double theta) const {
  double h = radius(x_mm);
  for (int k = 2; k <= 5; ++k) {
    const Eigen::Vector2d a = harmonic(k, x_mm);
    h += a.x() * std::cos(k * theta) + a.y() * std::sin(k * theta);
  }
  return h;
}

Eigen::Vector3d Rod::surface(double x_mm, double theta) const {
  double h = radius(x_mm);
  double dh = 0.0;
  for (int k = 2; k <= 5; ++k) {
    const Eigen::Vector2d a = harmonic(k, x_mm);
    const double c = std::cos(k * theta);
    const double s = std::sin(k * theta);
    h += a.x() * c + a.y() * s;
    dh += k * (a.y() * c - a.x() * s);
  }
  const Eigen::Vector2d center = axis(x_mm);
  return {x_mm, center.x() + h * std::cos(theta) - dh * std::sin(theta),
          center.y() + h * std::sin(theta) + dh * std::cos(theta)};
}

double Rod::circularity(double x_mm) const {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (int i = 0; i < 180; ++i) {
    const double theta = i * kDegree;
    const double width = support(x_mm, theta) + support(x_mm, theta + M_PI);
    low = std::min(low, width);
    high = std::max(high, width);
  }
  return 0.5 * (high - low);
}

void make_out_of_round(Rod& rod, double circularity_mm, double wave_mm, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  constexpr int kWaves = 6;
  struct Wave {
    double amplitude, wave_number, phase;
  };
  using Waves = std::array<Wave, kWaves>;
  std::array<std::array<Waves, 2>, 4> table{};
  for (std::size_t k = 0; k < table.size(); ++k)
    for (Waves& waves : table[k])
      for (Wave& wave : waves)
        wave = {uniform(generator) / static_cast<double>(k + 2),
                2.0 * M_PI / (wave_mm * (0.5 + 2.5 * uniform(generator))), 2.0 * M_PI * uniform(generator)};
  const auto function = [table](double scale) {
    return [table, scale](int k, double x) {
      Eigen::Vector2d a = Eigen::Vector2d::Zero();
      for (int part = 0; part < 2; ++part)
        for (const Wave& wave : table[static_cast<std::size_t>(k - 2)][static_cast<std::size_t>(part)])
          a(part) += scale * wave.amplitude * std::cos(wave.wave_number * x + wave.phase);
      return a;
    };
  };
  rod.harmonic = function(1.0);
  double mean = 0.0;
  constexpr int kSamples = 100;
  for (int i = 0; i < kSamples; ++i) mean += rod.circularity(rod.length_mm * i / (kSamples - 1)) / kSamples;
  // Tabulated: the sums of cosines are the costly part of a view.
  const auto exact = function(circularity_mm / mean);
  const double pitch = wave_mm / 200.0;
  const auto count = static_cast<std::size_t>(rod.length_mm / pitch) + 3;
  std::vector<std::array<Eigen::Vector2d, 4>> sampled(count);
  for (std::size_t i = 0; i < count; ++i)
    for (int k = 2; k <= 5; ++k) sampled[i][static_cast<std::size_t>(k - 2)] = exact(k, pitch * static_cast<double>(i));
  rod.harmonic = [sampled, pitch, count](int k, double x) -> Eigen::Vector2d {
    const double position = std::clamp(x / pitch, 0.0, static_cast<double>(count) - 1.001);
    const auto i = static_cast<std::size_t>(position);
    const double u = position - static_cast<double>(i);
    const auto j = static_cast<std::size_t>(k - 2);
    return (1.0 - u) * sampled[i][j] + u * sampled[i + 1][j];
  };
}

Pinhole pinhole(std::string id, double angle_deg, double distance_mm, double along_mm, const Eigen::Vector3d& target_mm,
                double focal_length_px, double roll_deg) {
  Pinhole camera;
  camera.id = std::move(id);
  camera.focal_length_px = focal_length_px;
  const double angle = angle_deg * kDegree;
  camera.pose.center_world_mm =
      target_mm + Eigen::Vector3d(along_mm, distance_mm * std::cos(angle), distance_mm * std::sin(angle));
  const Eigen::Vector3d forward = (target_mm - camera.pose.center_world_mm).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d R;
  R.row(0) = right;
  R.row(1) = forward.cross(right);
  R.row(2) = forward;
  camera.pose.R_cam_world = rotation_from_vector({0.0, 0.0, roll_deg * kDegree}) * R;
  return camera;
}

std::vector<Pinhole> forge_cameras(double scale) {
  const Eigen::Vector3d target = scale * Eigen::Vector3d(0.0, 30.0, 800.0);
  return {pinhole("cam1", 50.0, 7400.0 * scale, 300.0 * scale, target, 5722.0, 1.5),
          pinhole("cam2", 130.0, 7400.0 * scale, -450.0 * scale, target, 5730.0, -2.0),
          pinhole("cam3", 3.0, 11900.0 * scale, 150.0 * scale, target, 5715.0, 0.7)};
}

Imprint view_rod(const Rod& rod, const Lying& lying, const Pinhole& camera) {
  return view_hull(std::span(&rod, 1), lying, camera);
}

Imprint view_hull(std::span<const Rod> rods, const Lying& lying, const Pinhole& camera) {
  const double length_mm = rods.front().length_mm;
  Imprint imprint;
  imprint.camera_id = camera.id;
  imprint.focal_length_px = camera.focal_length_px;
  imprint.pose = camera.pose;
  imprint.quality.targets_used = 20;
  imprint.quality.reprojection_rms_px = 0.06;
  imprint.quality.edge_points = 2000;
  imprint.method = "best";

  std::vector<Scene> scenes;
  for (const Rod& rod : rods) scenes.push_back({rod, lying, camera, {}});
  const auto axis_point = [&](double x) {
    Eigen::Vector2d yz = Eigen::Vector2d::Zero();
    for (const Rod& rod : rods) yz += rod.axis(x) / static_cast<double>(rods.size());
    return scenes.front().project({x, yz.x(), yz.y()});
  };
  const IdealPoint a = axis_point(0.0);
  const IdealPoint b = axis_point(length_mm);
  const double length = std::hypot(b.x_px - a.x_px, b.y_px - a.y_px);
  // Stations run to the right in the image, whichever way the rod lies.
  const double direction = b.x_px > a.x_px ? 1.0 : -1.0;
  StationGrid grid;
  grid.origin = {0.5 * (a.x_px + b.x_px), 0.5 * (a.y_px + b.y_px)};
  grid.direction_x = direction * (b.x_px - a.x_px) / length;
  grid.direction_y = direction * (b.y_px - a.y_px) / length;
  for (Scene& scene : scenes) scene.grid = grid;

  std::array<ImprintEnd, 2> ends;
  for (int end = 0; end < 2; ++end) {
    const double sign = end == 0 ? -1.0 : 1.0;
    const double x = (end == 1) == (direction > 0.0) ? length_mm : 0.0;
    double best = -std::numeric_limits<double>::infinity();
    for (const Scene& scene : scenes) {
      for (int i = 0; i < 3600; ++i) {
        const ImagePoint p = scene.at(x, i * 0.1 * kDegree);
        if (sign * p.station <= best) continue;
        best = sign * p.station;
        ends[static_cast<std::size_t>(end)] = {
            .station_px = p.station, .offset_px = p.offset, .sigma_px = 0.1, .visible = true};
      }
    }
  }
  imprint.start = ends[0];
  imprint.end = ends[1];
  grid.start_px = ends[0].station_px + 0.5;
  grid.step_px = (ends[1].station_px - ends[0].station_px - 1.0) / (kImprintStations - 1);
  imprint.grid = grid;

  // Normals square to the view: where offsets are largest and smallest.
  struct Outer {
    double upper, lower;
  };
  std::vector<Outer> normals;
  for (const Scene& scene : scenes) {
    Outer outer{0.0, 0.0};
    double largest = -std::numeric_limits<double>::infinity();
    double smallest = -largest;
    for (int i = 0; i < 360; ++i) {
      const double offset = scene.at(0.5 * length_mm, i * kDegree).offset;
      if (offset > largest) {
        largest = offset;
        outer.lower = i * kDegree;
      }
      if (offset < smallest) {
        smallest = offset;
        outer.upper = i * kDegree;
      }
    }
    normals.push_back(outer);
  }
  for (std::size_t i = 0; i < kImprintStations; ++i) {
    const double station = grid.station_px(i);
    double lower = -std::numeric_limits<double>::infinity(), above = lower;
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      lower = std::max(lower, scenes[k].rim(station, normals[k].lower, 1.0));
      above = std::max(above, scenes[k].rim(station, normals[k].upper, -1.0));
    }
    const double upper = -above;
    const double weight = std::isfinite(lower) && std::isfinite(upper) ? 1.0 : 0.0;
    imprint.upper.offset_px.push_back(weight > 0.0 ? upper : 0.0);
    imprint.lower.offset_px.push_back(weight > 0.0 ? lower : 0.0);
    imprint.axis.offset_px.push_back(weight > 0.0 ? 0.5 * (upper + lower) : 0.0);
    imprint.upper.weight.push_back(weight);
    imprint.lower.weight.push_back(weight);
    imprint.axis.weight.push_back(weight);
  }
  return imprint;
}

void add_noise(Imprint& imprint, double sigma_px, std::mt19937& generator) {
  std::normal_distribution<double> normal(0.0, sigma_px);
  for (std::size_t i = 0; i < kImprintStations; ++i) {
    imprint.upper.offset_px[i] += normal(generator);
    imprint.lower.offset_px[i] += normal(generator);
    imprint.axis.offset_px[i] = 0.5 * (imprint.upper.offset_px[i] + imprint.lower.offset_px[i]);
  }
  imprint.start.station_px += normal(generator);
  imprint.end.station_px += normal(generator);
  imprint.start.sigma_px = imprint.end.sigma_px = sigma_px;
}

AlignedRod::AlignedRod(const Rod& rod, double end_section_mm) : rod_(rod) {
  // A fine least-squares line through the axis points of both end sections.
  constexpr int kSamples = 2000;
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d right = Eigen::Matrix2d::Zero();
  x_mean_ = 0.5 * rod.length_mm;
  for (int i = 0; i <= kSamples; ++i) {
    for (const double x : {end_section_mm * i / kSamples, rod.length_mm - end_section_mm * i / kSamples}) {
      const Eigen::Vector2d row(1.0, x - x_mean_);
      normal += row * row.transpose();
      right += row * rod.axis(x).transpose();
    }
  }
  const Eigen::Matrix2d solution = normal.inverse() * right;
  mean_ = solution.row(0);
  slope_ = solution.row(1);
}

Eigen::Vector2d AlignedRod::axis(double s_mm) const { return rod_.axis(s_mm) - mean_ - slope_ * (s_mm - x_mean_); }

ForgingSpec forge_spec() {
  ForgingSpec spec;
  spec.diameter_min_mm = 150.0;
  spec.diameter_max_mm = 340.0;
  return spec;
}

Lying turned(const Lying& lying, double angle_deg) {
  Lying result = lying;
  result.R = lying.R * rotation_from_vector({angle_deg * kDegree, 0.0, 0.0});
  return result;
}

Lying displaced(const Lying& lying, std::mt19937& generator, double shift_mm, double tilt_deg) {
  std::normal_distribution<double> normal;
  Lying result = lying;
  const Eigen::Vector3d tilt =
      tilt_deg * kDegree * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
  const Eigen::Vector3d middle = lying.origin_mm + lying.R.col(0) * 950.0;
  const Eigen::Matrix3d R = rotation_from_vector(tilt);
  result.R = R * lying.R;
  result.origin_mm = middle + R * (lying.origin_mm - middle) +
                     shift_mm * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
  return result;
}

}  // namespace imprint::test
