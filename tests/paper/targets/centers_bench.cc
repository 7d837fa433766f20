// Centres of rendered targets against their true places: the spread beside the bound, the bias, and whether the stated
// standard deviations agree with the spread. Built and run by `./dev bench centers`.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include "lib/targets/library_generator.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "tests/unit/node/detect/draw_target.h"

namespace {

using namespace imprint;
using imprint::test::DrawnTarget;

struct Options {
  int repetitions = 40;
  double contrast = 100.0;
  double noise = 3.0;
  double blur_px = 0.8;
  std::vector<double> diameters_px{8.0, 10.0, 12.0, 16.0, 20.0, 28.0, 40.0};
  std::vector<double> tilts_deg{0.0, 45.0};
  std::uint32_t seed = 1;
};

/// Errors of the centres of one kind of dot, both coordinates taken together but for the bias.
struct Spread {
  int missed = 0;
  int wrong = 0;
  int count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0.0;
  double normalized_squares = 0.0;
  double largest_mean = 0.0;  // of one dot over its repetitions

  [[nodiscard]] double rms() const { return std::sqrt(squares / (2.0 * count)); }
  [[nodiscard]] double bias() const { return (sum / count).cwiseAbs().maxCoeff(); }
};

constexpr int columns = 5;
constexpr int rows = 4;

int cell_px(double diameter_px) { return static_cast<int>(std::ceil(4.0 * diameter_px)) + 8; }

std::vector<DrawnTarget> place_targets(const TargetLibrary& library, double diameter_px, double tilt_deg,
                                       double contrast, std::mt19937& random) {
  const int cell = cell_px(diameter_px);
  std::uniform_real_distribution<double> phase(-0.5, 0.5);
  std::uniform_real_distribution<double> angle(0.0, 360.0);
  std::vector<DrawnTarget> targets;
  for (int i = 0; i < rows * columns; ++i) {
    const Eigen::Vector2d center((i % columns + 0.5) * cell + phase(random),
                                 (i / columns + 0.5) * cell + phase(random));
    const std::uint32_t code = library.codes[static_cast<std::size_t>(i)].code;
    targets.push_back(DrawnTarget::seen(code, center, 0.5 * diameter_px, angle(random), tilt_deg, angle(random)));
    targets.back().white = targets.back().black + contrast;
  }
  return targets;
}

Spread spread_of(const TargetLibrary& library, double diameter_px, double tilt_deg, const Options& options) {
  std::mt19937 random(options.seed);
  const auto targets = place_targets(library, diameter_px, tilt_deg, options.contrast, random);
  const int cell = cell_px(diameter_px);
  const cv::Mat canvas = test::draw_through_lens(targets, {columns * cell, rows * cell}, options.blur_px);
  Spread spread;
  std::vector<Eigen::Vector2d> of_dot(targets.size(), Eigen::Vector2d::Zero());
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    const cv::Mat image = test::expose(canvas, 0.0, options.noise, CV_8U, static_cast<unsigned>(random()));
    const auto found = detect_targets(image, library, DetectConfig{});
    spread.missed += static_cast<int>(targets.size());
    for (const DetectedTarget& target : found) {
      const auto code = std::find_if(library.codes.begin(), library.codes.end(),
                                     [&](const TargetCode& c) { return c.id == target.id; });
      const auto at = static_cast<std::size_t>(code - library.codes.begin());
      const Eigen::Vector2d place(target.center.x_px, target.center.y_px);
      if (at >= targets.size() || (place - targets[at].center).norm() > 2.0) {
        ++spread.wrong;
        continue;
      }
      const Eigen::Vector2d error = place - targets[at].center;
      --spread.missed;
      ++spread.count;
      spread.sum += error;
      of_dot[at] += error / options.repetitions;
      spread.squares += error.squaredNorm();
      spread.normalized_squares += error.squaredNorm() / (target.sigma_px * target.sigma_px);
    }
  }
  for (const Eigen::Vector2d& mean : of_dot)
    spread.largest_mean = std::max(spread.largest_mean, mean.cwiseAbs().maxCoeff());
  return spread;
}

void print_table(const TargetLibrary& library, const Options& options) {
  fmt::print("contrast {:g}, noise {:g}, blur {:g} px; {} places, {} images each\n", options.contrast, options.noise,
             options.blur_px, rows * columns, options.repetitions);
  fmt::print("{:>9} {:>7} {:>10} {:>10} {:>9} {:>10} {:>14} {:>14} {:>7}\n", "dot px", "tilt", "rms px", "bound px",
             "ratio", "bias px", "worst dot px", "error/stated", "missed");
  for (const double tilt_deg : options.tilts_deg) {
    for (const double diameter_px : options.diameters_px) {
      const Spread spread = spread_of(library, diameter_px, tilt_deg, options);
      const double edge_px = std::sqrt(options.blur_px * options.blur_px + 1.0 / 12.0);
      const double bound = 1.06 * options.noise / options.contrast * std::sqrt(edge_px / (0.5 * diameter_px));
      fmt::print("{:9.0f} {:6.0f}° {:10.4f} {:>10} {:>9} {:10.4f} {:14.4f} {:14.3f} {:>4} + {}\n", diameter_px,
                 tilt_deg, spread.rms(), tilt_deg > 0.0 ? "-" : fmt::format("{:.4f}", bound),
                 tilt_deg > 0.0 ? "-" : fmt::format("{:.2f}", spread.rms() / bound), spread.bias(), spread.largest_mean,
                 std::sqrt(spread.normalized_squares / (2.0 * spread.count)), spread.missed, spread.wrong);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Centres of rendered targets: spread, bias and stated standard deviation"};
  Options options;
  app.add_option("--repetitions", options.repetitions, "images of each kind")->check(CLI::PositiveNumber);
  app.add_option("--contrast", options.contrast);
  app.add_option("--noise", options.noise);
  app.add_option("--blur", options.blur_px, "px");
  app.add_option("--diameters", options.diameters_px, "px")->delimiter(',');
  app.add_option("--tilts", options.tilts_deg, "degrees")->delimiter(',');
  app.add_option("--seed", options.seed);
  CLI11_PARSE(app, argc, argv);
  const auto made = generate_library(15, 60);
  if (!made) {
    fmt::print(stderr, "{}\n", made.error().message);
    return 2;
  }
  print_table(made->library, options);
  return 0;
}
