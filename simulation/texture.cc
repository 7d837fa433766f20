#include "simulation/texture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "simulation/random.h"

namespace imprint {
namespace {

double lattice_value(std::uint64_t seed, std::int64_t i, std::int64_t j, std::int64_t k) {
  const std::uint64_t key = seed ^ (static_cast<std::uint64_t>(i) * 0x9e3779b97f4a7c15ULL) ^
                            (static_cast<std::uint64_t>(j) * 0xc2b2ae3d27d4eb4fULL) ^
                            (static_cast<std::uint64_t>(k) * 0x165667b19e3779f9ULL);
  return static_cast<double>(mix_bits(key) >> 11) * 0x1.0p-52 - 1.0;
}

double fade(double t) { return t * t * (3.0 - 2.0 * t); }

double lerp(double a, double b, double t) { return a + (b - a) * t; }

// The four weights of a uniform cubic B-spline at t in [0, 1).
std::array<double, 4> spline_weights(double t) {
  const double s = 1.0 - t;
  return {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
          t * t * t / 6.0};
}

}  // namespace

double value_noise(std::uint64_t seed, const Eigen::Vector3d& p) {
  const double fx = std::floor(p.x()), fy = std::floor(p.y()), fz = std::floor(p.z());
  const auto i = static_cast<std::int64_t>(fx), j = static_cast<std::int64_t>(fy), k = static_cast<std::int64_t>(fz);
  const double u = fade(p.x() - fx), v = fade(p.y() - fy), w = fade(p.z() - fz);
  const auto row = [&](std::int64_t dj, std::int64_t dk) {
    return lerp(lattice_value(seed, i, j + dj, k + dk), lattice_value(seed, i + 1, j + dj, k + dk), u);
  };
  return lerp(lerp(row(0, 0), row(1, 0), v), lerp(row(0, 1), row(1, 1), v), w);
}

double fractal_noise(std::uint64_t seed, const Eigen::Vector3d& p, int octaves, double gain) {
  double sum = 0.0, strength = 1.0, total = 0.0, scale = 1.0;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += strength * value_noise(seed + static_cast<std::uint64_t>(octave), p * scale);
    total += strength;
    strength *= gain;
    scale *= 2.0;
  }
  return sum / total;
}

cv::Mat noise_tile(std::uint64_t seed, int size_px, double gain) {
  cv::Mat tile(size_px, size_px, CV_32F, cv::Scalar(0.0));
  Random random(seed);
  double strength = 1.0, total = 0.0;
  for (int nodes = 4; nodes <= size_px; nodes *= 2) {
    // One node more on every side, taken from the far side: the interpolated square then repeats without a seam.
    cv::Mat grid(nodes, nodes, CV_32F), bordered, octave;
    for (int i = 0; i < nodes * nodes; ++i)
      grid.at<float>(i / nodes, i % nodes) = static_cast<float>(random.uniform(-1, 1));
    cv::copyMakeBorder(grid, bordered, 2, 2, 2, 2, cv::BORDER_WRAP);
    const int step = size_px / nodes;
    cv::resize(bordered, octave, {}, step, step, cv::INTER_CUBIC);
    tile += strength * octave(cv::Rect(2 * step, 2 * step, size_px, size_px));
    total += strength * strength;
    strength *= gain;
  }
  return tile / std::sqrt(total);
}

SmoothField::SmoothField(std::uint64_t seed, double grid_px, cv::Size image)
    : grid_px_(grid_px),
      nodes_(static_cast<int>(image.height / grid_px) + 5, static_cast<int>(image.width / grid_px) + 5, CV_64F) {
  Random random(seed);
  for (int j = 0; j < nodes_.rows; ++j) {
    // The sum of four uniform numbers: near enough to normal, of variance 1, and never far out.
    for (int i = 0; i < nodes_.cols; ++i) {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k) sum += random.uniform(-1.0, 1.0);
      nodes_.at<double>(j, i) = sum * 0.8660254037844386;
    }
  }
}

double SmoothField::at(double x_px, double y_px) const {
  const double gx = std::clamp(x_px / grid_px_ + 1.0, 0.0, nodes_.cols - 4.001);
  const double gy = std::clamp(y_px / grid_px_ + 1.0, 0.0, nodes_.rows - 4.001);
  const int i = static_cast<int>(gx), j = static_cast<int>(gy);
  const auto wx = spline_weights(gx - i), wy = spline_weights(gy - j);
  double sum = 0.0;
  for (int b = 0; b < 4; ++b) {
    const double* row = nodes_.ptr<double>(j + b) + i;
    sum += wy[b] * (wx[0] * row[0] + wx[1] * row[1] + wx[2] * row[2] + wx[3] * row[3]);
  }
  return sum / 0.479365;  // the spline averages: its mean squared weight in each direction
}

}  // namespace imprint
