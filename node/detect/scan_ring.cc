#include "node/detect/scan_ring.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/LU>

#include "lib/targets/code_distance.h"

namespace imprint {
namespace {

constexpr int rows = 7;
constexpr int middle_row = rows / 2;  // as many rows lie on either side of it
constexpr int neglected = 4;          // columns at each end of a bit, "Neg" of [A] 2.3.5
constexpr double two_pi = 2.0 * std::numbers::pi;

double normal_cdf(double z) { return 0.5 * std::erfc(-z * std::numbers::sqrt2 / 2.0); }

/// Middle of a scan row, in dot radii: the rows cover the middle 70 % of the ring.
double row_radius(const TargetGeometry& geometry, int row) {
  const double share = 0.15 + 0.7 * (row + 0.5) / rows;
  return (geometry.ring_inner_radius + share * (geometry.ring_outer_radius - geometry.ring_inner_radius)) /
         geometry.dot_radius;
}

/// Where a target's ground is looked for on either side of its ring, in dot radii.
constexpr double from_ring = 0.25;
double inside_radius(const TargetGeometry& geometry) {
  return geometry.ring_inner_radius / geometry.dot_radius - from_ring;
}
double outside_radius(const TargetGeometry& geometry) {
  return geometry.ring_outer_radius / geometry.dot_radius + from_ring;
}

struct Columns {
  std::vector<double> means;  // NaN where the ring leaves the image
  std::vector<double> inside;
  std::vector<double> outside;  // NaN where that is outside the image
  std::vector<double> steps;    // outer rows less inner rows; NaN where the outer ones leave the image
};

Columns scan_columns(const GreyImage& level, int l, const FittedDot& dot, int columns, const TargetGeometry& geometry) {
  const Eigen::Vector2d center = ImagePyramid::to_level(dot.ellipse.center, l);
  const Eigen::Matrix2d frame = frame_of(dot.ellipse) / ImagePyramid::scale(l);
  constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
  Columns scanned;
  for (int i = 0; i < columns; ++i) {
    const double angle = two_pi * (i + 0.5) / columns;
    const Eigen::Vector2d direction = frame * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    double sum = 0.0;
    double step = 0.0;
    int inside = 0;
    for (int row = 0; row < rows; ++row) {
      const Eigen::Vector2d p = center + row_radius(geometry, row) * direction;
      if (!level.contains(p)) continue;
      const double grey = level.at(p);
      sum += grey;
      if (row != middle_row) step += row > middle_row ? grey : -grey;
      ++inside;
    }
    const auto reading_at = [&](double radius) {
      const Eigen::Vector2d p = center + radius * direction;
      return level.contains(p) ? (level.at(p) - dot.black) / dot.contrast : nowhere;
    };
    scanned.inside.push_back(reading_at(inside_radius(geometry)));
    scanned.outside.push_back(reading_at(outside_radius(geometry)));
    // At the border of the image the inner rows may still tell.
    scanned.means.push_back(inside == 0 ? nowhere : (sum / inside - dot.black) / dot.contrast);
    scanned.steps.push_back(inside < rows ? nowhere : step / middle_row / dot.contrast);
  }
  return scanned;
}

struct BitReading {
  double mean = 0.0;
  double deviation = 0.0;
};

BitReading read_bit(const std::vector<double>& columns, std::size_t first, int left_out = neglected) {
  BitReading reading;
  const int used = columns_per_bit - 2 * left_out;
  const auto column = [&](int i) { return columns[(first + static_cast<std::size_t>(left_out + i)) % columns.size()]; };
  for (int i = 0; i < used; ++i) reading.mean += column(i) / used;
  for (int i = 0; i < used; ++i) reading.deviation += std::abs(column(i) - reading.mean) / used;
  return reading;
}

/// Column at which a bit begins. A bit's deviation counts up to a limit, so that dirt does not turn the ring.
std::size_t first_column(const std::vector<double>& columns, int bits, double* deviation) {
  constexpr double most = 0.3;
  std::size_t best = 0;
  *deviation = std::numeric_limits<double>::max();
  for (std::size_t phase = 0; phase < columns_per_bit; ++phase) {
    double sum = 0.0;
    for (int bit = 0; bit < bits; ++bit) {
      const std::size_t begin = phase + static_cast<std::size_t>(bit) * columns_per_bit;
      const double d = read_bit(columns, begin).deviation;
      sum += std::isnan(d) ? 0.0 : std::min(d, most);
      // What is neglected must not be free, or the end of a cover over one bit moves all the others.
      const double whole = read_bit(columns, begin, 1).deviation;
      sum += std::isnan(whole) ? 0.0 : 0.5 * std::min(whole, most);
    }
    if (sum / bits < *deviation) {
      *deviation = sum / bits;
      best = phase;
    }
  }
  return best;
}

/// The response of the bit centred at `angle`: blur is a Gaussian in px, its width in radii and in angle follows from
/// the frame of the ellipse there.
BitResponse response_at(const FittedDot& dot, int bits, const TargetGeometry& geometry, double angle) {
  const Eigen::Matrix2d to_frame = frame_of(dot.ellipse).inverse();
  const Eigen::Vector2d outward(std::cos(angle), std::sin(angle));
  const Eigen::Vector2d along(-outward.y(), outward.x());
  const double radial_sigma = dot.blur_px * (to_frame.transpose() * outward).norm();
  const double along_sigma = dot.blur_px * (to_frame.transpose() * along).norm();
  const double inner = geometry.ring_inner_radius / geometry.dot_radius;
  const double outer = geometry.ring_outer_radius / geometry.dot_radius;
  const double bit_angle = two_pi / bits;
  constexpr double half_used = 0.5 - static_cast<double>(neglected) / columns_per_bit;
  BitResponse response;
  response.radial = 0.0;
  for (int row = 0; row < rows; ++row) {
    const double r = row_radius(geometry, row);
    response.radial += (normal_cdf((outer - r) / radial_sigma) - normal_cdf((inner - r) / radial_sigma)) / rows;
    const double from_dot = normal_cdf((1.0 - r) / radial_sigma);
    response.floor += from_dot / rows;
    if (row != middle_row) response.step += (row > middle_row ? from_dot : -from_dot) / middle_row;
  }
  response.inside = normal_cdf(-from_ring / radial_sigma) + normal_cdf((1.0 - inside_radius(geometry)) / radial_sigma);
  response.outside = normal_cdf(-from_ring / radial_sigma);
  response.own = 0.0;
  response.angular_sigma = along_sigma / row_radius(geometry, middle_row) / bit_angle;
  constexpr int steps = 5;
  for (int i = 0; i < steps; ++i) {
    const double at = half_used * (2.0 * (i + 0.5) / steps - 1.0);
    const double left = normal_cdf((-0.5 - at) / response.angular_sigma);
    const double right = normal_cdf((at - 0.5) / response.angular_sigma);
    response.own += (1.0 - left - right) / steps;
    response.beside += 0.5 * (left + right) / steps;
  }
  response.own *= response.radial;
  response.beside *= response.radial;
  return response;
}

/// What the scan sees is blurred by its own sampling too: by the pixels of its level and the interpolation between
/// them.
FittedDot as_scanned(const FittedDot& dot, int level) {
  const double scale = ImagePyramid::scale(level);
  constexpr double pixel = 1.0 / 12.0;
  constexpr double interpolation = 1.0 / 6.0;
  FittedDot scanned = dot;
  scanned.blur_px = std::sqrt(dot.blur_px * dot.blur_px + std::max(0.0, scale * scale - 1.0) * pixel +
                              (level < 0 ? 0.0 : scale * scale * interpolation));
  return scanned;
}

}  // namespace

double BitResponse::column_reading(double offset, int before, int bit, int after) const {
  const double left = normal_cdf((-0.5 - offset) / angular_sigma);
  const double right = normal_cdf((offset - 0.5) / angular_sigma);
  return floor + light * radial * (left * before + (1.0 - left - right) * bit + right * after);
}

std::optional<RingScan> scan_ring(const GreyImage& image, int level, const FittedDot& dot, int bits,
                                  const TargetGeometry& geometry, double noise, double max_unknown,
                                  std::optional<int> first_column_given) {
  const int count = bits * columns_per_bit;
  const Columns seen = scan_columns(image, level, dot, count, geometry);
  const std::vector<double>& columns = seen.means;
  const auto outside = std::count_if(columns.begin(), columns.end(), [](double v) { return std::isnan(v); });
  if (static_cast<double>(outside) > max_unknown * count) return std::nullopt;
  const FittedDot scanned = as_scanned(dot, level);
  RingScan scan;
  std::size_t first = first_column(columns, bits, &scan.deviation);
  if (first_column_given) first = static_cast<std::size_t>(*first_column_given % count);
  scan.first_column = static_cast<int>(first);
  scan.columns = seen.means;
  scan.inside = seen.inside;
  scan.outside = seen.outside;
  scan.steps = seen.steps;
  for (auto* row : {&scan.columns, &scan.inside, &scan.outside, &scan.steps})
    std::rotate(row->begin(), row->begin() + static_cast<std::ptrdiff_t>(first), row->end());
  scan.first_angle = two_pi * static_cast<double>(first) / count;
  for (int bit = 0; bit < bits; ++bit) {
    const std::size_t begin = first + static_cast<std::size_t>(bit) * columns_per_bit;
    scan.reading.push_back(read_bit(columns, begin).mean);
    const double angle = two_pi * (static_cast<double>(begin) + 0.5 * columns_per_bit) / count;
    scan.place.push_back(row_radius(geometry, middle_row) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    scan.response.push_back(response_at(scanned, bits, geometry, angle));
  }
  set_light(scan, light_slope(dot), 1.0);
  // Pixels that one reading averages: the scanned part of a bit's area, at least one.
  const EllipseAxes axes = axes_of(dot.ellipse);
  const double inner = row_radius(geometry, 0);
  const double outer = row_radius(geometry, rows - 1);
  const double area =
      std::numbers::pi * axes.semi_major_px * axes.semi_minor_px * (outer * outer - inner * inner) / bits * 0.67;
  // In dots of few px no interpolation knows what lies between the pixels.
  constexpr double between_pixels = 0.12;  // of the contrast, at a radius of a px, ours
  scan.noise = std::hypot(noise / dot.contrast / std::sqrt(std::max(1.0, area)),
                          between_pixels / (axes.semi_minor_px * axes.semi_major_px));
  return scan;
}

RingScan turned(const RingScan& scan, int columns) {
  RingScan result = scan;
  const int count = static_cast<int>(scan.columns.size());
  const int by = (columns % count + count) % count;
  for (auto* row : {&result.columns, &result.inside, &result.outside, &result.steps})
    std::rotate(row->begin(), row->begin() + by, row->end());
  result.first_column = (scan.first_column + by) % count;
  result.first_angle = two_pi * result.first_column / count;
  for (std::size_t bit = 0; bit < result.reading.size(); ++bit)
    result.reading[bit] = read_bit(result.columns, bit * columns_per_bit).mean;
  return result;
}

void set_blur(RingScan& scan, const FittedDot& dot, const TargetGeometry& geometry) {
  const int bits = static_cast<int>(scan.response.size());
  for (std::size_t i = 0; i < scan.response.size(); ++i) {
    const double light = scan.response[i].light;
    scan.response[i] = response_at(dot, bits, geometry, std::atan2(scan.place[i].y(), scan.place[i].x()));
    scan.response[i].light = light;
  }
}

double ring_light_at(const Eigen::Vector2d& place, const FittedDot& dot, const RingScan& scan, std::uint32_t code,
                     const TargetGeometry& geometry) {
  const Eigen::Vector2d in_frame = frame_of(dot.ellipse).inverse() * (place - dot.ellipse.center);
  const double radius = in_frame.norm();
  if (radius < 1e-6) return 0.0;
  const int bits = static_cast<int>(scan.response.size());
  const double turn = (std::atan2(in_frame.y(), in_frame.x()) - scan.first_angle) / two_pi;
  const double at = (turn - std::floor(turn)) * bits;  // in bits from the first one's beginning
  const int bit = std::min(bits - 1, static_cast<int>(at));
  BitResponse response = scan.response[static_cast<std::size_t>(bit)];
  const double radial_sigma = dot.blur_px * (dot.ellipse.shape * (place - dot.ellipse.center)).norm() / radius;
  const double inner = geometry.ring_inner_radius / geometry.dot_radius;
  const double outer = geometry.ring_outer_radius / geometry.dot_radius;
  response.floor = 0.0;
  response.radial = normal_cdf((outer - radius) / radial_sigma) - normal_cdf((inner - radius) / radial_sigma);
  response.angular_sigma *= 0.5 * (inner + outer) / std::max(radius, 0.5);
  return dot.contrast * response.column_reading(at - bit - 0.5, bit_at(code, bits, bit - 1), bit_at(code, bits, bit),
                                                bit_at(code, bits, bit + 1));
}

Eigen::Vector2d light_slope(const FittedDot& dot) { return frame_of(dot.ellipse) * dot.shading; }

void set_light(RingScan& scan, const Eigen::Vector2d& slope, double level) {
  constexpr double most = 5.0;
  for (std::size_t i = 0; i < scan.response.size(); ++i) {
    scan.response[i].light = std::clamp(level * std::exp(slope.dot(scan.place[i])), 1.0 / most, most);
  }
}

RingGlance glance_at_ring(const GreyImage& level, const Ellipse& dot, double white, double black, double least_light,
                          const TargetGeometry& geometry) {
  constexpr int places = 36;
  const Eigen::Matrix2d frame = frame_of(dot);
  const double inner = geometry.ring_inner_radius / geometry.dot_radius;
  const double outer = geometry.ring_outer_radius / geometry.dot_radius;
  const double half = 0.5 * (white + black);
  int dark = 0;
  int bright = 0;
  for (int i = 0; i < places; ++i) {
    const double angle = two_pi * i / places;
    const Eigen::Vector2d direction = frame * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d in_valley = dot.center + 0.5 * (1.0 + inner) * direction;
    const Eigen::Vector2d on_ring = dot.center + 0.5 * (inner + outer) * direction;
    if (level.contains(in_valley) && level.at(in_valley) < half) ++dark;
    if (level.contains(on_ring) && level.at(on_ring) > black + least_light * (white - black)) ++bright;
  }
  return {static_cast<double>(dark) / places, static_cast<double>(bright) / places};
}

}  // namespace imprint
