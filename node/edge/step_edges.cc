#include "node/edge/step_edges.h"

#include <algorithm>
#include <cmath>

#include "lib/geometry/median.h"
#include "node/edge/blur_excess.h"
#include "node/edge/level_slopes.h"

namespace imprint {
namespace {

// What is read beyond the reach of the blur, since noise is the greater evil there.
double spare_px(double noise_share) {
  constexpr double kLittleNoise = 0.02, kMuchNoise = 0.028, kMostSpare = 3.0;
  return kMostSpare * std::clamp((noise_share - kLittleNoise) / (kMuchNoise - kLittleNoise), 0.0, 1.0);
}

// The samples a step is fitted to: about the edge, out to where the blur has died away, and nothing of its neighbours.
struct Window {
  int from = 0, count = 0;
};
Window fit_window(const ScanLine& line, const TracedEdge& traced, double blur, double noise_share) {
  const int reach = fit_reach_px(blur, noise_share);
  const int middle = static_cast<int>(std::lround(traced.edge.position_px - line.first_px));
  const int from = std::max({0, middle - reach, std::min(traced.edge.from_sample, middle - 2)});
  const int to = std::min({line.count - 1, middle + reach, std::max(traced.edge.to_sample, middle + 2)});
  return {from, to - from + 1};
}

std::optional<StepFit> fit_at(const ScanLines& scan, const TracedEdge& traced, double blur, bool free_blur,
                              Window& window) {
  const ScanLine& line = scan.lines[traced.line];
  window = fit_window(line, traced, blur, 0.0);
  return fit_step(scan.samples(line) + window.from, window.count, traced.edge.position_px - line.first_px - window.from,
                  blur, free_blur);
}

// The blur of every region of the rim: medians of free fits.
std::vector<double> regional_blur(const ScanLines& scan, const std::vector<TracedEdge>& traced,
                                  std::size_t region_lines) {
  constexpr double kStartBlur = 1.0;
  constexpr std::size_t kEvery = 8;
  std::vector<std::vector<double>> regions((traced.size() + region_lines - 1) / region_lines);
  std::vector<double> blur(regions.size(), kStartBlur), all;
  for (std::size_t i = 0; i < traced.size(); i += kEvery) {
    Window window;
    auto fit = fit_at(scan, traced[i], 2.0, true, window);
    if (!fit) fit = fit_at(scan, traced[i], kStartBlur, true, window);
    if (!fit || fit->blur > 6) continue;
    regions[i / region_lines].push_back(fit->blur);
    all.push_back(fit->blur);
  }
  if (all.empty()) return blur;
  const double overall = median(all);
  for (std::size_t r = 0; r < regions.size(); ++r) blur[r] = regions[r].size() >= 8 ? median(regions[r]) : overall;
  return blur;
}

// The shape of the edge over the traced lines [first, last): their profiles laid on each other by their own fits of a
// plain step, finer than the pixels since every line meets them elsewhere; medians, so that neither scale nor sparks
// count.
EdgeShape shape_of(const ScanLines& scan, const std::vector<TracedEdge>& traced, std::size_t first, std::size_t last,
                   double blur) {
  constexpr double kBinsPerPx = 4.0;
  constexpr int kOutwardPx = 6, kInwardPx = 8;
  constexpr std::size_t kLeastLines = 40, kLeastInBin = 8;
  const double outward = kOutwardPx + blur, inward = kInwardPx + blur;
  std::vector<std::vector<double>> bins(static_cast<std::size_t>((outward + inward) * kBinsPerPx) + 1);
  std::size_t lines = 0;
  for (std::size_t i = first; i < last; ++i) {
    Window window;
    const auto fit = fit_at(scan, traced[i], blur, false, window);
    if (!fit) continue;
    ++lines;
    const ScanLine& line = scan.lines[traced[i].line];
    const float* values = scan.samples(line);
    const double position = window.from + fit->position;
    for (int k = std::max(0, traced[i].edge.from_sample); k <= std::min(line.count - 1, traced[i].edge.to_sample);
         ++k) {
      const double x = k - position;
      if (x < -outward || x >= inward) continue;
      bins[static_cast<std::size_t>((x + outward) * kBinsPerPx)].push_back((values[k] - fit->outside) / fit->step);
    }
  }
  if (lines < kLeastLines) return {blur, 0.0};
  std::vector<ProfilePoint> profile;
  for (std::size_t b = 0; b < bins.size(); ++b) {
    if (bins[b].size() < kLeastInBin) continue;
    const auto count = static_cast<double>(bins[b].size());
    profile.push_back({(static_cast<double>(b) + 0.5) / kBinsPerPx - outward, median(bins[b]), count});
  }
  return fit_shape(profile, blur).value_or(EdgeShape{blur, 0.0});
}

// The shape at every traced edge: that of its region, on the line between the regions' middles, so that no step comes
// from where they meet.
std::vector<EdgeShape> shapes_at_edges(const std::vector<EdgeShape>& regions, std::size_t edges,
                                       std::size_t region_lines) {
  std::vector<EdgeShape> shapes(edges);
  for (std::size_t i = 0; i < edges; ++i) {
    const double place = std::clamp((static_cast<double>(i) + 0.5) / static_cast<double>(region_lines) - 0.5, 0.0,
                                    static_cast<double>(regions.size() - 1));
    const auto r = std::min(static_cast<std::size_t>(place), regions.size() - 1);
    const EdgeShape &a = regions[r], &b = regions[std::min(r + 1, regions.size() - 1)];
    const double t = place - static_cast<double>(r);
    shapes[i] = {(1 - t) * a.blur + t * b.blur, (1 - t) * a.rise + t * b.rise};
  }
  return shapes;
}

}  // namespace

int fit_reach_px(double blur_px, double noise_share) {
  return std::clamp(static_cast<int>(std::ceil(2.5 * blur_px + 1.5 + spare_px(noise_share))), 3, 12);
}

std::vector<EdgeShape> region_shapes(const ScanLines& scan, const std::vector<TracedEdge>& traced,
                                     std::size_t region_lines) {
  const std::vector<double> blur = regional_blur(scan, traced, region_lines);
  std::vector<EdgeShape> regions;
  for (std::size_t r = 0; r < blur.size(); ++r)
    regions.push_back(
        shape_of(scan, traced, r * region_lines, std::min(traced.size(), (r + 1) * region_lines), blur[r]));
  return regions;
}

namespace {

struct StepFits {
  std::vector<StepEdge> edges;
  std::vector<FittedLine> lines;  // of the edges, in their order
};

// Steps of known shapes fitted in windows for that noise.
StepFits fit_shapes(const ScanLines& scan, const std::vector<TracedEdge>& traced, const std::vector<EdgeShape>& shapes,
                    double noise_share) {
  StepFits fits;
  for (std::size_t i = 0; i < traced.size(); ++i) {
    const ScanLine& line = scan.lines[traced[i].line];
    const Window window = fit_window(line, traced[i], shapes[i].blur, noise_share);
    const auto fit = fit_step(scan.samples(line) + window.from, window.count,
                              traced[i].edge.position_px - line.first_px - window.from, shapes[i]);
    if (!fit) continue;
    fits.edges.push_back(
        {traced[i].line, line.first_px + window.from + fit->position, 0.0, fit->step, shapes[i].blur, 0.0});
    fits.lines.push_back({line.index, scan.samples(line) + window.from, window.count, *fit, shapes[i]});
  }
  return fits;
}

// The usual noise of a grey value, share of the step.
double usual_noise(const std::vector<FittedLine>& lines) {
  std::vector<double> shares;
  for (const FittedLine& line : lines) shares.push_back(line.fit.residual / line.fit.step);
  return shares.empty() ? 0.0 : median(shares);
}

}  // namespace

std::vector<StepEdge> fit_step_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced, int region_lines) {
  constexpr int kSlopeLines = 14, kBlurLines = 8;
  if (traced.empty()) return {};
  const auto lines = static_cast<std::size_t>(std::max(16, region_lines));
  const std::vector<EdgeShape> shapes = shapes_at_edges(region_shapes(scan, traced, lines), traced.size(), lines);
  StepFits fits = fit_shapes(scan, traced, shapes, 0.0);
  if (const double noise = usual_noise(fits.lines); spare_px(noise) > 0.0)
    fits = fit_shapes(scan, traced, shapes, noise);
  std::vector<StepEdge>& edges = fits.edges;
  if (edges.empty()) return {};
  const std::vector<double> shifts = shifts_by_slopes(fits.lines, kSlopeLines);
  const std::vector<double> excess = blur_excess(fits.lines, kBlurLines);
  // A handful of samples tells little about the noise: the rim's common noise is the floor.
  std::vector<double> residuals;
  for (const FittedLine& line : fits.lines) residuals.push_back(line.fit.residual);
  const double common = median(residuals);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    edges[i].position_px += shifts[i];
    edges[i].blur_excess = excess[i];
    edges[i].sigma_px = fits.lines[i].fit.sigma_unit * std::max(common, fits.lines[i].fit.residual);
  }
  return std::move(edges);
}

std::vector<StepEdge> zero_crossing_edges(const ScanLines& scan, const std::vector<TracedEdge>& traced) {
  constexpr double kHalfWidthPx =
      1.5;  // the slope of the second derivative is about straight over this, for blurs from 0.5 px
  const int arm = std::max(1, static_cast<int>(std::lround(1 / scan.spacing_px)));
  std::vector<StepEdge> edges;
  for (const TracedEdge& t : traced) {
    const ScanLine& line = scan.lines[t.line];
    const float* values = scan.samples(line);
    const double start = (t.edge.position_px - line.first_px) / scan.spacing_px;
    const auto crossing = zero_crossing(values, line.count, start, arm, kHalfWidthPx / scan.spacing_px);
    if (!crossing) continue;
    const int reach = static_cast<int>(std::lround(3 / scan.spacing_px)), middle = static_cast<int>(std::lround(start));
    const double step = values[std::min(line.count - 1, middle + reach)] - values[std::max(0, middle - reach)];
    edges.push_back({t.line, line.first_px + *crossing * scan.spacing_px, 0.0, step});
  }
  return edges;
}

std::vector<StepEdge> highest_gradient_edges(const ScanLines& scan) {
  const int lag = std::max(1, static_cast<int>(std::lround(1 / scan.spacing_px)));
  std::vector<StepEdge> edges;
  for (std::size_t n = 0; n < scan.lines.size(); ++n) {
    const ScanLine& line = scan.lines[n];
    const float* values = scan.samples(line);
    int best = -1;
    float highest = 0;
    for (int i = lag; i + lag < line.count; ++i)
      if (const float slope = values[i + lag] - values[i - lag]; slope > highest) highest = slope, best = i;
    if (best >= 0) edges.push_back({n, line.first_px + best * scan.spacing_px, 0.0, highest});
  }
  return edges;
}

}  // namespace imprint
