#include "simulation/sensor.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "simulation/random.h"

namespace imprint {
namespace {

constexpr int quantile_bits = 12;  // four numbers from 64 bits; the table ends at 3.7 standard deviations

// Normal quantiles at the middles of equal shares, scaled to variance 1.
std::vector<float> normal_quantiles() {
  constexpr int count = 1 << quantile_bits;
  std::vector<float> table(count);
  double squares = 0.0;
  std::vector<double> values(count);
  for (int i = 0; i < count; ++i) {
    const double share = (i + 0.5) / count;
    double z = 0.0;  // Newton on the distribution function, from the middle outwards
    for (int iteration = 0; iteration < 60; ++iteration) {
      const double error = 0.5 * std::erfc(-z * 0.7071067811865476) - share;
      const double density = 0.3989422804014327 * std::exp(-0.5 * z * z);
      const double step = std::clamp(error / density, -0.5, 0.5);
      z -= step;
      if (std::abs(step) < 1e-12) break;
    }
    values[static_cast<std::size_t>(i)] = z;
    squares += z * z / count;
  }
  for (int i = 0; i < count; ++i)
    table[static_cast<std::size_t>(i)] = static_cast<float>(values[static_cast<std::size_t>(i)] / std::sqrt(squares));
  return table;
}

void normal_row(std::uint64_t seed, std::vector<float>& row) {
  static const std::vector<float> table = normal_quantiles();
  Random random(seed);
  constexpr std::uint64_t mask = (1U << quantile_bits) - 1U;
  for (std::size_t i = 0; i < row.size(); i += 4) {
    const std::uint64_t bits = random.bits();
    const std::size_t count = std::min<std::size_t>(4, row.size() - i);
    for (std::size_t k = 0; k < count; ++k) row[i + k] = table[bits >> (16 * k) & mask];
  }
}

template <class Pixel>
void expose_rows(const ImagingScene& imaging, std::uint64_t seed, const cv::Mat& light, cv::Mat& image,
                 float full_scale) {
  std::vector<float> normal(static_cast<std::size_t>(light.cols), 0.0F), across(normal.size());
  const double half_diagonal2 =
      0.25 * (static_cast<double>(light.cols) * light.cols + static_cast<double>(light.rows) * light.rows);
  for (int x = 0; x < light.cols; ++x) {
    const double from_center = x - 0.5 * (light.cols - 1);
    across[static_cast<std::size_t>(x)] =
        static_cast<float>(imaging.vignetting * from_center * from_center / half_diagonal2);
  }
  const auto read2 =
      static_cast<float>(imaging.read_noise_e * imaging.read_noise_e / (imaging.full_well_e * imaging.full_well_e));
  const auto exposure = static_cast<float>(imaging.exposure);
  const auto shot = static_cast<float>(1.0 / imaging.full_well_e), strength = static_cast<float>(imaging.noise);
  for (int y = 0; y < light.rows; ++y) {
    const double from_center = y - 0.5 * (light.rows - 1);
    const auto base = static_cast<float>(1.0 - imaging.vignetting * from_center * from_center / half_diagonal2);
    if (strength > 0.0F) normal_row(stream_seed(seed, "row", static_cast<std::uint64_t>(y)), normal);
    const float* in = light.ptr<float>(y);
    auto* out = image.ptr<Pixel>(y);
    for (int x = 0; x < light.cols; ++x) {
      const float mean = std::max(0.0F, exposure * in[x] * (base - across[static_cast<std::size_t>(x)]));
      const float value = mean + strength * std::sqrt(mean * shot + read2) * normal[static_cast<std::size_t>(x)];
      out[x] = static_cast<Pixel>(std::min(std::max(value, 0.0F), 1.0F) * full_scale + 0.5F);
    }
  }
}

}  // namespace

cv::Mat expose(const ImagingScene& imaging, std::uint64_t seed, const cv::Mat& light) {
  cv::Mat image(light.size(), imaging.bits == 8 ? CV_8U : CV_16U);
  if (imaging.bits == 8) {
    expose_rows<std::uint8_t>(imaging, seed, light, image, 255.0F);
  } else {
    expose_rows<std::uint16_t>(imaging, seed, light, image, 65535.0F);
  }
  return image;
}

}  // namespace imprint
