#include "node/segment/body_proof.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

// Mean of a column between two heights; NaN where the camera saw nothing.
float mean_between(const WorkingImage& working, int x, double a, double b) {
  const int from = static_cast<int>(std::lround(std::min(a, b))), to = static_cast<int>(std::lround(std::max(a, b)));
  float sum = 0;
  int count = 0;
  for (int y = std::max(0, from); y <= std::min(working.intensity.rows - 1, to); ++y)
    if (working.valid(y, x)) sum += working.intensity(y, x), ++count;
  return count > 0 ? sum / static_cast<float>(count) : std::nanf("");
}

}  // namespace

BodyProof prove_body(BodyPath& path, const WorkingImage& working, const BodyLevels& levels) {
  constexpr float kSame = 0.4F, kOther = 0.4F;  // of the contrast
  constexpr double kScaled = 0.6;               // worth of a rim under scale: the body ends there, but does not show it
  BodyProof proof;
  std::vector<float> bodies, contrasts;
  int columns = 0, both = 0;
  double filled = 0, sides = 0;
  for (auto& [x, pair] : path.columns) {
    const float body = levels.body[static_cast<std::size_t>(x)], ground = levels.ground[static_cast<std::size_t>(x)];
    const float contrast = body - ground;
    bodies.push_back(body), contrasts.push_back(contrast);
    ++columns;
    pair.both = false;
    proof.columns.push_back(0.0F);
    if (contrast <= 0 || !(pair.weight > 0)) continue;
    const double band = std::max(2.0, 0.08 * static_cast<double>(pair.width_px()));
    int ends = 0;
    double credit = 0;
    for (const bool upper : {true, false}) {
      const double rim = upper ? pair.upper_px : pair.lower_px, inward = upper ? 1.0 : -1.0;
      const float inner = mean_between(working, x, rim + inward * 1.5, rim + inward * (1.5 + band));
      const float outer = mean_between(working, x, rim - inward * 1.5, rim - inward * (1.5 + band));
      const bool ends_here = std::abs(outer - body) > kOther * contrast;
      if (!ends_here) continue;
      if (std::abs(inner - body) < kSame * contrast) {
        ++ends;
        credit += 0.5;
      } else if (inner < body) {
        credit += 0.5 * kScaled;
      }
    }
    pair.both = ends == 2;
    both += ends == 2, sides += credit;
    int same = 0, count = 0;
    for (int y = static_cast<int>(pair.upper_px) + 2; y <= static_cast<int>(pair.lower_px) - 2; y += 2, ++count)
      same += y >= 0 && y < working.intensity.rows && std::abs(working.intensity(y, x) - body) < kSame * contrast;
    const double inside = count > 0 ? static_cast<double>(same) / count : 0.0;
    filled += inside;
    proof.columns.back() = static_cast<float>(0.5 * (credit + inside));
  }
  if (columns == 0) return proof;
  proof.both = static_cast<double>(both) / columns, proof.sides = sides / columns;
  proof.filled = filled / columns;
  const auto median = [](std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  proof.level = median(bodies), proof.contrast = median(contrasts);
  return proof;
}

}  // namespace imprint
