// The benchmark of [A] 2.4: 60 targets of 110 x 110 px under occlusion, scale, observation angle, blur and noise, on
// plain and cluttered ground; our detection, the same with plain decoding, and OpenCV's ArUco beside each other.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/targets/library_generator.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "tests/paper/targets/degrade.h"
#include "tests/paper/targets/greedy_library.h"
#include "tests/paper/targets/scores.h"
#include "tests/paper/targets/target_sheet.h"

namespace {

using namespace imprint;
using namespace imprint::paper;

constexpr int code_bits = 15;
constexpr int targets_on_sheet = 60;
constexpr double usual_scale = 0.9;  // of all data sets but scale

/// One kind of harm, over its extent.
struct DataSet {
  std::string name;
  double from;
  double to;
  std::function<Sheet(const Sheet&, double, std::uint64_t)> apply;
};

std::vector<DataSet> data_sets() {
  const auto small = [](const Sheet& sheet) { return scaled(sheet, usual_scale, usual_scale); };
  return {
      {"occlusion", 0.0, 7.5,
       [small](const Sheet& s, double bits, std::uint64_t seed) {
         return small(with_patches(s, {bits, seed}, code_bits));
       }},
      {"scale", 0.05, 1.0, [](const Sheet& s, double scale, std::uint64_t) { return scaled(s, scale, scale); }},
      {"angle", 2.0, 90.0,
       [](const Sheet& s, double deg, std::uint64_t) {
         return scaled(s, usual_scale, usual_scale * std::sin(deg * std::numbers::pi / 180.0));
       }},
      {"blur", 0.0, 8.0, [small](const Sheet& s, double sigma, std::uint64_t) { return blurred(small(s), sigma); }},
      {"noise", 0.0, 0.4,
       [small](const Sheet& s, double sigma, std::uint64_t seed) { return with_noise(small(s), sigma, seed); }},
  };
}

/// One way to find targets, with the sheet that it reads.
struct System {
  std::string name;
  std::function<Sheet(Background)> draw;
  std::function<std::vector<Claim>(const cv::Mat&)> find;
};

System ring_system(const std::string& name, const TargetLibrary& library, const DetectConfig& config) {
  return {name, [&library](Background background) { return draw_rings(library, background); },
          [&library, config](const cv::Mat& image) {
            std::vector<Claim> claims;
            for (const DetectedTarget& t : detect_targets(image, library, config))
              claims.push_back({t.id, {t.center.x_px, t.center.y_px}});
            return claims;
          }};
}

System aruco_system() {
  const auto dictionary = cv::aruco::generateCustomDictionary(targets_on_sheet, 6, 1);
  return {"ArUco (OpenCV)", [dictionary](Background background) { return draw_aruco(*dictionary, background); },
          [dictionary](const cv::Mat& image) {
            std::vector<std::vector<cv::Point2f>> corners;
            std::vector<int> ids;
            cv::aruco::detectMarkers(image, dictionary, corners, ids);
            std::vector<Claim> claims;
            for (std::size_t i = 0; i < ids.size(); ++i) {
              const cv::Point2f sum = corners[i][0] + corners[i][1] + corners[i][2] + corners[i][3];
              claims.push_back({ids[i], cv::Point2d(sum) / 4.0});
            }
            return claims;
          }};
}

struct Options {
  int every = 1;
  int first_step = 0;
  int clutter_frames = 0;
  std::string images;
  bool by_step = false;
  bool without_peers = false;
  std::string only;
  std::string ground;
};

/// Scores of one system on one data set; `light` holds those of up to two bits of occlusion.
struct Outcome {
  Scores all;
  Scores light;
  double seconds = 0.0;
  std::vector<double> recall_by_step;
};

void print_wrong(const std::string& what, double value, const Sheet& truth, const std::vector<Claim>& claims) {
  for (const Claim& claim : claims) {
    Scores one;
    one.add(truth.centers, {claim});
    if (one.wrong() == 0) continue;
    fmt::print("  {} {:.2f}: id {} claimed at {:.1f}, {:.1f}\n", what, value, claim.id, claim.center.x, claim.center.y);
  }
}

Outcome run(const System& system, const DataSet& set, const Sheet& sheet, const Options& options) {
  constexpr int steps = 100;
  Outcome outcome;
  for (int i = options.first_step; i < steps; i += options.every) {
    const double value = set.from + (set.to - set.from) * i / (steps - 1);
    const Sheet harmed = set.apply(sheet, value, static_cast<std::uint64_t>(i) + 1);
    const cv::Mat image = to_8_bit(harmed);
    if (!options.images.empty())
      cv::imwrite(fmt::format("{}/{}_{}_{:02}.png", options.images, system.name, set.name, i), image);
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<Claim> claims = system.find(image);
    outcome.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    Scores step;
    step.add(harmed.centers, claims);
    if (options.by_step) print_wrong(system.name + ", " + set.name, value, harmed, claims);
    outcome.all.add(step);
    if (value <= 2.0) outcome.light.add(step);
    outcome.recall_by_step.push_back(step.recall());
  }
  return outcome;
}

/// What the paper's table 3 says: recall of its system and the best recall of the others, on synthetic and complex
/// ground; and what we want to reach.
struct PaperRow {
  const char* set;
  std::array<double, 2> own;
  std::array<double, 2> best_other;
  std::array<double, 2> goal;
};
constexpr std::array paper_rows{
    PaperRow{"occlusion to 2 bits", {0.870, 0.799}, {0.767, 0.540}, {0.99, 0.97}},
    PaperRow{"occlusion", {0.259, 0.227}, {0.450, 0.207}, {0.45, 0.40}},
    PaperRow{"scale", {0.876, 0.849}, {0.865, 0.710}, {0.92, 0.90}},
    PaperRow{"angle", {0.885, 0.843}, {0.926, 0.600}, {0.935, 0.91}},
    PaperRow{"blur", {0.450, 0.362}, {0.629, 0.613}, {0.85, 0.75}},
    PaperRow{"noise", {0.723, 0.429}, {0.487, 0.303}, {0.97, 0.90}},
};

void print_paper(const std::string& set, std::size_t ground) {
  for (const PaperRow& row : paper_rows) {
    if (set != row.set) continue;
    fmt::print("  {:<22} {:>7.3f}\n", "[A], its system", row.own[ground]);
    fmt::print("  {:<22} {:>7.3f}\n", "[A], best of others", row.best_other[ground]);
    fmt::print("  {:<22} {:>7.3f}\n", "goal", row.goal[ground]);
  }
}

void print_outcome(const std::string& system, const Scores& scores, double seconds_an_image) {
  fmt::print("  {:<22} {:>7.3f}  precision {:.4f} ({} wrong)  {:.0f} ms an image\n", system, scores.recall(),
             scores.precision(), scores.wrong(), 1000.0 * seconds_an_image);
}

void compare(const std::vector<System>& systems, Background background, const Options& options) {
  const bool plain = background == Background::plain;
  std::vector<Sheet> sheets;
  for (const System& system : systems) sheets.push_back(system.draw(background));
  for (const DataSet& set : data_sets()) {
    if (!options.only.empty() && options.only != set.name) continue;
    std::vector<Outcome> outcomes;
    for (std::size_t s = 0; s < systems.size(); ++s) outcomes.push_back(run(systems[s], set, sheets[s], options));
    const auto print = [&](const std::string& name, bool light) {
      fmt::print("{}, {} ({} to {}): recall\n", name, plain ? "plain" : "cluttered", set.from, light ? 2.0 : set.to);
      print_paper(name, plain ? 0 : 1);
      for (std::size_t s = 0; s < systems.size(); ++s) {
        const Outcome& outcome = outcomes[s];
        print_outcome(systems[s].name, light ? outcome.light : outcome.all,
                      outcome.seconds / static_cast<double>(outcome.recall_by_step.size()));
        if (!options.by_step || light) continue;
        for (const double recall : outcome.recall_by_step) fmt::print(" {:.2f}", recall);
        fmt::print("\n");
      }
    };
    if (set.name == "occlusion") print("occlusion to 2 bits", true);
    print(set.name, false);
    std::fflush(stdout);
  }
}

/// Targets claimed in frames that have none.
int count_false_alarms(const TargetLibrary& library, int frames) {
  int claims = 0;
  double seconds = 0.0;
  for (int i = 0; i < frames; ++i) {
    const cv::Mat image = to_8_bit({draw_clutter(2400, 1700, 1000U + static_cast<std::uint64_t>(i)), {}});
    const auto begin = std::chrono::steady_clock::now();
    for (const DetectedTarget& t : detect_targets(image, library, DetectConfig{})) {
      ++claims;
      fmt::print("  frame {}: id {} at {:.1f}, {:.1f}, dot {:.1f} px, distance {}\n", i, t.id, t.center.x_px,
                 t.center.y_px, t.dot_diameter_px, t.distance);
    }
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  fmt::print("clutter without targets: {} claimed in {} frames of 4 megapixels, {:.0f} ms a frame\n", claims, frames,
             1000.0 * seconds / frames);
  return claims;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("The target benchmark of paper A, section 2.4");
  app.add_option("--every", options.every, "only every n-th of the 100 steps")->check(CLI::Range(1, 100));
  app.add_option("--first-step", options.first_step, "begin with this step")->check(CLI::Range(0, 99));
  app.add_option("--clutter-frames", options.clutter_frames, "frames without targets to look through afterwards");
  app.add_option("--only", options.only, "one data set: occlusion, scale, angle, blur or noise");
  app.add_option("--ground", options.ground, "one ground: plain or cluttered");
  app.add_option("--images", options.images, "folder to write the images to")->check(CLI::ExistingDirectory);
  app.add_flag("--by-step", options.by_step, "print the recall of every step");
  app.add_flag("--without-peers", options.without_peers, "only our detection with its default decoder");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);

  const auto generated = generate_library(code_bits, targets_on_sheet);
  if (!generated) {
    fmt::print(stderr, "{}\n", generated.error().message);
    return 1;
  }
  const TargetLibrary& own = generated->library;
  const TargetLibrary greedy = greedy_library(code_bits, targets_on_sheet);
  DetectConfig plain_decoder;
  plain_decoder.decoder = Decoder::plain;
  std::vector<System> systems{ring_system(fmt::format("ours, distance {}", own.min_distance), own, {}),
                              ring_system(fmt::format("ours, distance {}", greedy.min_distance), greedy, {})};
  if (!options.without_peers) {
    systems.push_back(ring_system("ours, decoder plain", own, plain_decoder));
    systems.push_back(aruco_system());
  }
  if (options.ground != "cluttered") compare(systems, Background::plain, options);
  if (options.ground != "plain") compare(systems, Background::cluttered, options);
  if (options.clutter_frames > 0) count_false_alarms(own, options.clutter_frames);
  return 0;
}
