#include "node/segment/body_path.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace imprint {
namespace {

struct Node {
  RimPair pair;
  double gain = 0.0;
  int from_x = -1;
  int from_index = -1;
};

// Cost of going from one pair to the next, in units of a fully seen column.
double jump_cost(const RimPair& a, const RimPair& b, int columns_apart, double slope) {
  const double apart = columns_apart;
  const double shift = std::abs(b.middle_px() - a.middle_px() - slope * apart);
  const double widening = 0.5 * std::abs((b.lower_px - b.upper_px) - (a.lower_px - a.upper_px));
  const double free = 0.15 * apart;  // taper and rounding
  return std::min(4.0, 0.5 * std::max(0.0, shift - free)) + std::min(1.5, 0.2 * std::max(0.0, widening - free));
}

// Is the body still there between two columns, about as bright as at both ends?
bool inside_goes_on(const cv::Mat_<float>& image, const RimPair& a, int ax, const RimPair& b, int bx) {
  // The upper quartile: scale may darken most of a section.
  const auto body_level = [&](int x, const RimPair& pair) {
    const int from = std::clamp(static_cast<int>(pair.upper_px) + 2, 0, image.rows - 1);
    const int to = std::clamp(static_cast<int>(pair.lower_px) - 2, from, image.rows - 1);
    std::vector<float> values;
    for (int y = from; y <= to; y += 2) values.push_back(image(y, x));
    const auto quartile = values.begin() + static_cast<std::ptrdiff_t>(3 * values.size() / 4);
    std::nth_element(values.begin(), quartile, values.end());
    return *quartile;
  };
  // The second darkest of the four sides: a lamp or plate may touch the body anywhere.
  const auto row = [&](double y) { return std::clamp(static_cast<int>(y), 0, image.rows - 1); };
  std::array<float, 4> outside{image(row(a.upper_px - 4), ax), image(row(a.lower_px + 4), ax),
                               image(row(b.upper_px - 4), bx), image(row(b.lower_px + 4), bx)};
  std::sort(outside.begin(), outside.end());
  const double body = std::min(body_level(ax, a), body_level(bx, b));
  const double threshold = 0.5 * (body + outside[1]);
  int there = 0, count = 0;
  for (int x = ax + 1; x < bx; ++x, ++count) {
    const double t = static_cast<double>(x - ax) / (bx - ax);
    const RimPair between{static_cast<float>(a.upper_px + t * (b.upper_px - a.upper_px)),
                          static_cast<float>(a.lower_px + t * (b.lower_px - a.lower_px)), 0};
    there += body_level(x, between) > threshold;
  }
  return count == 0 || there >= 0.5 * count;
}

}  // namespace

double BodyPath::median_width_px() const {
  if (columns.empty()) return 0.0;
  std::vector<float> widths;
  widths.reserve(columns.size());
  for (const Column& c : columns) widths.push_back(c.pair.lower_px - c.pair.upper_px);
  const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::nth_element(widths.begin(), middle, widths.end());
  return *middle;
}

BodyPath follow_body(const RimPairs& rim_pairs, const WorkingImage& working, const AxisLine& line, double max_offset_px,
                     double max_gap_widths) {
  const auto& pairs = rim_pairs.columns;
  std::vector<int> reach{1, 2, 3, 4};
  double widest = 0;
  for (const auto& column : pairs)
    for (const RimPair& pair : column) widest = std::max(widest, static_cast<double>(pair.width_px()));
  for (int r = 6; r <= max_gap_widths * widest; r = r * 5 / 4 + 1) reach.push_back(r);

  std::vector<std::vector<Node>> nodes(pairs.size());
  int best_x = -1, best_index = -1;
  double best_gain = 0.0;
  for (int x = 0; x < static_cast<int>(pairs.size()); ++x) {
    auto& here = nodes[static_cast<std::size_t>(x)];
    for (const RimPair& pair : pairs[static_cast<std::size_t>(x)])
      if (std::abs(pair.middle_px() - line.y_px(x)) <= max_offset_px) here.push_back({pair});
    for (std::size_t n = 0; n < here.size(); ++n) {
      Node& node = here[n];
      double inherited = 0.0;
      for (const int r : reach) {
        if (r > x || (r > 8 && r > max_gap_widths * node.pair.width_px())) break;
        const auto& before = nodes[static_cast<std::size_t>(x - r)];
        for (std::size_t m = 0; m < before.size(); ++m) {
          const double gain = before[m].gain - 0.05 * (r - 1) - jump_cost(before[m].pair, node.pair, r, line.slope);
          if (gain <= inherited) continue;
          if (r > 8 && !inside_goes_on(working.intensity, before[m].pair, x - r, node.pair, x)) continue;
          inherited = gain, node.from_x = x - r, node.from_index = static_cast<int>(m);
        }
      }
      node.gain = node.pair.weight + inherited;
      if (node.gain > best_gain) best_gain = node.gain, best_x = x, best_index = static_cast<int>(n);
    }
  }

  BodyPath path;
  path.evidence = best_gain;
  for (int x = best_x, index = best_index; x >= 0;) {
    const Node& node = nodes[static_cast<std::size_t>(x)][static_cast<std::size_t>(index)];
    path.columns.push_back({x, node.pair});
    x = node.from_x, index = node.from_index;
  }
  std::reverse(path.columns.begin(), path.columns.end());
  return path;
}

}  // namespace imprint
