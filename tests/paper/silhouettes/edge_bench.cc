// Edge points of clean straight rims against their true places: the spread beside the Cramer-Rao bound, the bias at
// every subpixel phase and slope, and whether the stated standard deviations agree with the spread. Built and run by
// `./dev bench edges`; exit status 1 when `best` misses what it is to reach.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include "node/edge/edge_config.h"
#include "node/edge/step_edges.h"
#include "tests/unit/node/edge/straight_edge.h"
#include "tests/unit/node/segment/drawn_forging.h"

namespace {

using namespace imprint;
using drawn::StraightBand;
using drawn::Unknown;

constexpr double kLargestRatio = 1.15, kLargestBiasPx = 0.005, kLeastFound = 0.98;
constexpr std::size_t kPhaseBins = 10;

struct Options {
  double contrast = 100.0;
  double noise = 3.0;
  std::vector<double> blurs_px{0.5, 0.8, 1.0, 1.5, 2.0};
  std::vector<double> slopes{0.0, 0.003, 0.05, -0.15, 0.3, -0.45, 0.6};
  std::vector<std::string> methods{"best", "orientation", "magnitude", "combined", "uniform", "none", "pixel"};
  int phases = 10;
  int repetitions = 1;
  bool every_slope = false;
  unsigned seed = 1;
};

/// Mean error at every subpixel phase.
struct PhaseMeans {
  std::array<double, kPhaseBins> sum{}, count{};

  void add(double position_px, double error) {
    const auto bin =
        std::min(static_cast<std::size_t>((position_px - std::floor(position_px)) * kPhaseBins), kPhaseBins - 1);
    sum[bin] += error, count[bin] += 1.0;
  }
  [[nodiscard]] double largest() const {
    double most = 0.0;
    for (std::size_t k = 0; k < kPhaseBins; ++k)
      if (count[k] > 0) most = std::max(most, std::abs(sum[k] / count[k]));
    return most;
  }
};

/// Errors of single points, px along the scan line.
struct Spread {
  double squares = 0.0, stated_squares = 0.0, inward = 0.0, count = 0.0, expected = 0.0;
  PhaseMeans upper, lower;

  void add(const Silhouette& found, const StraightBand& band) {
    expected += 2.0 * band.length_px;
    add_rim(found.upper, band, -0.5 * band.width_px, 1.0, upper);
    add_rim(found.lower, band, 0.5 * band.width_px, -1.0, lower);
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
  [[nodiscard]] double stated() const { return std::sqrt(stated_squares / count); }

 private:
  void add_rim(const std::vector<EdgePoint>& points, const StraightBand& band, double from_middle, double inward_sign,
               PhaseMeans& means) {
    for (const EdgePoint& point : points) {
      const double truth = band.upper_offset_px(point.station_px) + from_middle;
      const double error = point.offset_px - truth;
      squares += error * error, stated_squares += point.sigma_px * point.sigma_px;
      inward += inward_sign * error, count += 1.0;
      means.add(truth, error);
    }
  }
};

/// What one method reaches on rims of one blur and slope.
struct Outcome {
  double slope = 0.0;
  Spread noisy;
  double bias_px = 0.0;       ///< of points without noise, at the worst subpixel phase and rim
  double bound_px = 0.0;      ///< level, contrast and blur unknown
  double all_known_px = 0.0;  ///< the bound with everything known
};

Outcome outcome_of(EdgeMethod method, double blur_px, double slope, const Options& options) {
  Outcome out;
  out.slope = slope;
  const double along_scan = std::sqrt(blur_px * blur_px + 1.0 / 12) * std::hypot(1.0, slope);
  const double noise = options.noise / options.contrast;
  out.bound_px = noise * drawn::bound_px(blur_px, slope, fit_reach_px(along_scan, noise), Unknown::levels_and_blur);
  out.all_known_px = noise * drawn::bound_px(blur_px, slope, 20, Unknown::position);
  unsigned seed = options.seed;
  for (const bool columns : {true, false}) {
    const int phases = std::abs(slope) < 0.02 ? options.phases : 2;  // others meet every phase along the rim
    for (int k = 0; k < phases; ++k) {
      StraightBand band;
      band.slope = slope, band.blur_px = blur_px, band.contrast = options.contrast, band.columns = columns;
      band.phase_px = static_cast<double>(k) / phases + 0.01;
      band.width_px = 100.0 + 0.37 * k;
      const cv::Mat_<float> clean = drawn::draw(band);
      const auto locate = [&](const cv::Mat& image) {
        return locate_edges(image, band.segmentation(), Polarity::bright, method, EdgeConfig{});
      };
      Spread exact;
      exact.add(locate(drawn::expose(clean, 0.0, 0, CV_16U)), band);
      out.bias_px = std::max({out.bias_px, exact.upper.largest(), exact.lower.largest()});
      for (int r = 0; r < options.repetitions * options.phases / phases; ++r)
        out.noisy.add(locate(drawn::expose(clean, options.noise, ++seed)), band);
    }
  }
  return out;
}

void print_head(const Options& options) {
  fmt::print("straight rims, contrast {:g} and noise {:g} grey levels, 8 bit; slopes", options.contrast, options.noise);
  for (const double slope : options.slopes) fmt::print(" {:g}", slope);
  fmt::print(", scanned down columns and along rows\n");
  fmt::print(
      "RMS: of a single point, px along its scan line. Bound: Cramer-Rao for unknown level, contrast and blur in "
      "the window that `best` uses;\nknown: the same with all of them known. `best` takes the blur from the rim's "
      "surroundings. Bias: without noise, at the worst phase;\nwith noise, mean of all points at the worst "
      "slope.\n");
  fmt::print("{:>7} {:<12} {:>7} {:>7} {:>12} {:>12} {:>9} {:>12} {:>9} {:>11} {:>8}\n", "blur px", "method", "RMS",
             "bound", "RMS/bound", "worst slope", "RMS/known", "bias px", "noisy px", "stated/true", "found");
}

void print_row(double blur_px, const std::string& name, const std::vector<const Outcome*>& of) {
  double squares = 0, bound_squares = 0, known_squares = 0, stated_squares = 0, count = 0, expected = 0;
  double worst_ratio = 0, bias = 0, noisy_bias = 0;
  for (const Outcome* o : of) {
    squares += o->noisy.squares, stated_squares += o->noisy.stated_squares;
    bound_squares += o->noisy.count * o->bound_px * o->bound_px;
    known_squares += o->noisy.count * o->all_known_px * o->all_known_px;
    count += o->noisy.count, expected += o->noisy.expected;
    worst_ratio = std::max(worst_ratio, o->noisy.rms() / o->bound_px);
    bias = std::max(bias, o->bias_px);
    noisy_bias = std::max(noisy_bias, std::abs(o->noisy.inward / o->noisy.count));
  }
  fmt::print("{:7.1f} {:<12} {:7.4f} {:7.4f} {:12.3f} {:12.3f} {:9.3f} {:12.4f} {:9.4f} {:>11} {:7.1f}%\n", blur_px,
             name, std::sqrt(squares / count), std::sqrt(bound_squares / count), std::sqrt(squares / bound_squares),
             worst_ratio, std::sqrt(squares / known_squares), bias, noisy_bias,
             stated_squares > 0 ? fmt::format("{:.3f}", std::sqrt(stated_squares / squares)) : "-",
             100 * count / expected);
  std::fflush(stdout);
}

bool reached(const Outcome& o) {
  return o.noisy.rms() <= kLargestRatio * o.bound_px && o.bias_px < kLargestBiasPx &&
         std::abs(o.noisy.inward / o.noisy.count) < kLargestBiasPx && o.noisy.count >= kLeastFound * o.noisy.expected;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Edge points of straight rims: spread beside the bound, bias and stated standard deviation"};
  Options options;
  app.add_option("--contrast", options.contrast, "grey levels");
  app.add_option("--noise", options.noise, "grey levels");
  app.add_option("--blurs", options.blurs_px, "px")->delimiter(',');
  app.add_option("--slopes", options.slopes)->delimiter(',');
  app.add_option("--methods", options.methods)->delimiter(',');
  app.add_option("--phases", options.phases, "subpixel phases of rims along the pixels")->check(CLI::PositiveNumber);
  app.add_option("--repetitions", options.repetitions, "noisy images of each")->check(CLI::PositiveNumber);
  app.add_flag("--every-slope", options.every_slope, "a row for every slope");
  app.add_option("--seed", options.seed);
  CLI11_PARSE(app, argc, argv);
  print_head(options);
  int missed = 0;
  for (const double blur_px : options.blurs_px) {
    for (const std::string& name : options.methods) {
      const auto method = edge_method_from_name(name);
      if (!method) {
        fmt::print(stderr, "{}\n", method.error().message);
        return 2;
      }
      std::vector<Outcome> outcomes;
      for (const double slope : options.slopes) outcomes.push_back(outcome_of(*method, blur_px, slope, options));
      std::vector<const Outcome*> all;
      for (const Outcome& o : outcomes) {
        all.push_back(&o);
        if (options.every_slope) print_row(blur_px, fmt::format("{} {:g}", name, o.slope), {&o});
        if (*method == EdgeMethod::best && !reached(o)) {
          ++missed;
          fmt::print("missed: blur {:g} px, slope {:g}: {:.3f} x the bound, bias {:.4f} px\n", blur_px, o.slope,
                     o.noisy.rms() / o.bound_px, std::max(o.bias_px, std::abs(o.noisy.inward / o.noisy.count)));
        }
      }
      print_row(blur_px, name, all);
    }
  }
  fmt::print("best: at most {:g} x the bound and {:g} px of bias {}\n", kLargestRatio, kLargestBiasPx,
             missed == 0 ? "at every blur and slope" : fmt::format("missed {} times", missed));
  return missed == 0 ? 0 : 1;
}
