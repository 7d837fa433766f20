#include "node/edge/edge_path.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

// Scan lines averaged along the rim and smoothed across it, and their first derivative per px.
struct SmoothLines {
  std::vector<float> level, slope;
  double slope_noise = 0.0;
};

void average_along_rim(const ScanLines& scan, int half, std::vector<float>& out) {
  out.assign(scan.values.size(), 0.0F);
  std::vector<float> weight;
  for (std::size_t n = 0; n < scan.lines.size(); ++n) {
    const ScanLine& line = scan.lines[n];
    float* sum = out.data() + line.begin;
    weight.assign(static_cast<std::size_t>(line.count), 0.0F);
    const std::size_t first = n >= static_cast<std::size_t>(half) ? n - static_cast<std::size_t>(half) : 0;
    const std::size_t last = std::min(n + static_cast<std::size_t>(half), scan.lines.size() - 1);
    for (std::size_t m = first; m <= last; ++m) {
      const ScanLine& other = scan.lines[m];
      const int apart = other.index - line.index;
      if (std::abs(apart) > half) continue;
      const int shift =
          static_cast<int>(std::lround((line.first_px + line.slope * apart - other.first_px) / scan.spacing_px));
      const float* from = scan.samples(other);
      const int a = std::max(0, -shift), b = std::min(line.count, other.count - shift);
      for (int i = a; i < b; ++i) sum[i] += from[i + shift], weight[static_cast<std::size_t>(i)] += 1.0F;
    }
    for (int i = 0; i < line.count; ++i) sum[i] /= std::max(1.0F, weight[static_cast<std::size_t>(i)]);
  }
}

SmoothLines smooth_lines(const ScanLines& scan, const EdgeConfig& config) {
  SmoothLines smooth;
  std::vector<float> averaged;
  average_along_rim(scan, config.smoothing_stations / 2, averaged);
  const double sigma = config.smoothing_sigma_px / scan.spacing_px;
  const int radius = std::max(1, static_cast<int>(std::ceil(2.5 * sigma)));
  std::vector<float> kernel(static_cast<std::size_t>(2 * radius + 1));
  float sum = 0;
  for (int k = -radius; k <= radius; ++k)
    sum += kernel[static_cast<std::size_t>(k + radius)] = static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma)));
  for (float& k : kernel) k /= sum;

  smooth.level.assign(averaged.size(), 0.0F);
  smooth.slope.assign(averaged.size(), 0.0F);
  std::vector<float> magnitudes;
  magnitudes.reserve(averaged.size());
  for (const ScanLine& line : scan.lines) {
    const float* from = averaged.data() + line.begin;
    float* level = smooth.level.data() + line.begin;
    float* slope = smooth.slope.data() + line.begin;
    for (int i = 0; i < line.count; ++i) {
      float value = 0;
      for (int k = -radius; k <= radius; ++k)
        value += kernel[static_cast<std::size_t>(k + radius)] * from[std::clamp(i + k, 0, line.count - 1)];
      level[i] = value;
    }
    const auto per_px = static_cast<float>(0.5 / scan.spacing_px);
    for (int i = 1; i + 1 < line.count; ++i) {
      slope[i] = per_px * (level[i + 1] - level[i - 1]);
      magnitudes.push_back(std::abs(slope[i]));
    }
  }
  if (!magnitudes.empty()) {
    // Most of a scan line is plain, yet the edge itself takes its share: the lower third speaks for the noise.
    const auto third = magnitudes.begin() + static_cast<std::ptrdiff_t>(magnitudes.size() / 3);
    std::nth_element(magnitudes.begin(), third, magnitudes.end());
    smooth.slope_noise = std::max(*third / 0.4307, 1e-5);
  }
  return smooth;
}

// Peaks of the first derivative, wide and high enough.
std::vector<EdgeCandidate> find_peaks(const ScanLines& scan, const ScanLine& line, const SmoothLines& smooth,
                                      const EdgeConfig& config) {
  std::vector<EdgeCandidate> peaks;
  const float* slope = smooth.slope.data() + line.begin;
  const double threshold = config.peak_noise_factor * smooth.slope_noise;
  for (int i = 2; i + 2 < line.count; ++i) {
    if (!(slope[i] > threshold && slope[i] > slope[i - 1] && slope[i] >= slope[i + 1])) continue;
    int a = i, b = i;
    while (a > 1 && slope[a - 1] > 0.5F * slope[i]) --a;
    while (b + 2 < line.count && slope[b + 1] > 0.5F * slope[i]) ++b;
    if ((b - a + 1) * scan.spacing_px < config.min_peak_width_px) continue;
    const float bend = slope[i - 1] - 2 * slope[i] + slope[i + 1];
    const double shift = bend < 0 ? std::clamp(0.5 * (slope[i - 1] - slope[i + 1]) / bend, -0.5, 0.5) : 0.0;
    peaks.push_back({line.first_px + (i + shift) * scan.spacing_px, slope[i], slope[i] / (slope[i] + threshold), i, i});
  }
  if (peaks.size() > static_cast<std::size_t>(config.max_candidates)) {
    std::nth_element(peaks.begin(), peaks.begin() + config.max_candidates, peaks.end(),
                     [](const EdgeCandidate& p, const EdgeCandidate& q) { return p.slope > q.slope; });
    peaks.resize(static_cast<std::size_t>(config.max_candidates));
    std::sort(peaks.begin(), peaks.end(),
              [](const EdgeCandidate& p, const EdgeCandidate& q) { return p.position_px < q.position_px; });
  }
  for (std::size_t k = 0; k < peaks.size(); ++k) {  // from_sample still holds the peak's sample
    const int here = peaks[k].to_sample;
    peaks[k].from_sample = k == 0 ? 0 : (peaks[k - 1].to_sample + here) / 2;
    if (k > 0) peaks[k - 1].to_sample = peaks[k].from_sample;
    if (k + 1 == peaks.size())
      peaks[k].to_sample = line.count - 1;
    else
      peaks[k].to_sample = here;
  }
  return peaks;
}

// The outermost edge from which the body goes on without a fall back to the background is worth nearly as much as the
// strongest: where scale shows the rim weakly, the chain then stays on it, since leaving it costs two jumps. A beam or
// a plate behind the rim looks the same, but the rim beside it is worth more in the long run.
void reward_outermost(const ScanLine& line, const SmoothLines& smooth, double spacing_px, const EdgeConfig& config,
                      std::vector<EdgeCandidate>& peaks) {
  double highest = 0;
  for (const EdgeCandidate& peak : peaks) highest = std::max(highest, peak.reward);
  const float* level = smooth.level.data() + line.begin;
  const auto sample = [&](double position_px) {
    return std::clamp(static_cast<int>(std::lround((position_px - line.first_px) / spacing_px)), 0, line.count - 1);
  };
  bool found = false;
  for (EdgeCandidate& peak : peaks) {
    const int before = sample(peak.position_px - 3), after = sample(peak.position_px + 3);
    const float background = level[before], body = level[after];
    const float fallen = background + 0.35F * (body - background);
    bool goes_on = true;
    for (int i = after; i < line.count && goes_on; ++i) goes_on = level[i] > fallen;
    if (!goes_on) {
      peak.reward *= config.detached_share;
    } else if (!found) {
      peak.reward = std::max(peak.reward, config.outermost_share * highest);
      found = true;
    }
  }
}

// Edges as strong as the rim usually is count full, weak ones less: most of the rim is seen against the background.
void reward_usual_strength(std::vector<std::vector<EdgeCandidate>>& peaks) {
  std::vector<double> strongest;
  for (const auto& line : peaks) {
    double most = 0;
    for (const EdgeCandidate& peak : line) most = std::max(most, peak.slope);
    if (most > 0) strongest.push_back(most);
  }
  if (strongest.empty()) return;
  const auto middle = strongest.begin() + static_cast<std::ptrdiff_t>(strongest.size() / 2);
  std::nth_element(strongest.begin(), middle, strongest.end());
  for (auto& line : peaks)
    for (EdgeCandidate& peak : line) peak.reward *= 0.35 + 0.65 * std::min(1.0, peak.slope / (0.7 * *middle));
}

struct Node {
  EdgeCandidate edge;
  double gain = 0.0;
  int from_line = -1;
  int from_index = -1;
};

}  // namespace

std::vector<TracedEdge> trace_rim(const ScanLines& scan, bool prefer_outermost, const EdgeConfig& config) {
  if (scan.lines.empty()) return {};
  const SmoothLines smooth = smooth_lines(scan, config);
  std::vector<int> reach{1, 2, 3, 4};
  for (int r = 6; r <= config.max_gap_stations; r = r * 4 / 3 + 1) reach.push_back(r);

  std::vector<std::vector<EdgeCandidate>> peaks(scan.lines.size());
  for (std::size_t n = 0; n < scan.lines.size(); ++n) peaks[n] = find_peaks(scan, scan.lines[n], smooth, config);
  reward_usual_strength(peaks);
  std::vector<std::vector<Node>> nodes(scan.lines.size());
  int best_line = -1, best_index = -1;
  double best_gain = 0.0;
  for (std::size_t n = 0; n < scan.lines.size(); ++n) {
    const ScanLine& line = scan.lines[n];
    if (prefer_outermost) reward_outermost(line, smooth, scan.spacing_px, config, peaks[n]);
    for (const EdgeCandidate& peak : peaks[n]) {
      Node node{peak};
      double inherited = 0.0;
      for (const int r : reach) {
        if (static_cast<std::size_t>(r) > n) break;
        const std::size_t m = n - static_cast<std::size_t>(r);
        const double apart = line.index - scan.lines[m].index;
        for (std::size_t k = 0; k < nodes[m].size(); ++k) {
          const double shift = std::abs(peak.position_px - nodes[m][k].edge.position_px - line.slope * apart);
          const double jump = std::max(0.0, shift - 0.4 - 0.25 * (apart - 1));
          const double gain = nodes[m][k].gain - std::min(config.jump_cost, 0.8 * jump) - 0.02 * (apart - 1);
          if (gain > inherited)
            inherited = gain, node.from_line = static_cast<int>(m), node.from_index = static_cast<int>(k);
        }
      }
      node.gain = peak.reward + inherited;
      if (node.gain > best_gain)
        best_gain = node.gain, best_line = static_cast<int>(n), best_index = static_cast<int>(nodes[n].size());
      nodes[n].push_back(node);
    }
  }

  std::vector<TracedEdge> path;
  for (int n = best_line, k = best_index; n >= 0;) {
    const Node& node = nodes[static_cast<std::size_t>(n)][static_cast<std::size_t>(k)];
    path.push_back({static_cast<std::size_t>(n), node.edge});
    n = node.from_line, k = node.from_index;
  }
  std::reverse(path.begin(), path.end());
  return path;
}

}  // namespace imprint
