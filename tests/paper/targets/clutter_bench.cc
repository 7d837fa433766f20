// What our detection claims to see in frames that have no coded target: goal of the issue, nothing in 200 frames.
#include <chrono>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/targets/library_generator.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "tests/paper/targets/clutter_frames.h"
#include "tests/paper/targets/greedy_library.h"

namespace {

using namespace imprint;
using namespace imprint::paper;

struct Options {
  int frames = 200;
  int first = 0;
  int width_px = 2400;
  int height_px = 1700;
  std::string only;
  std::string library;
  std::string save;
  std::string photographs = IMPRINT_TEST_DATA "/cern_panel";
};

struct Tally {
  int frames = 0;
  int frames_with_claims = 0;
  int claims = 0;
  double seconds = 0.0;
};

Tally look_through(const TargetLibrary& library, Clutter kind, std::string_view name, const Options& options,
                   const PhotographPieces& pieces) {
  Tally tally;
  constexpr int kinds = static_cast<int>(counted_clutter.size());
  for (int i = options.first; i < options.first + options.frames; ++i) {
    if (options.only.empty() && i % kinds != static_cast<int>(kind)) continue;
    const cv::Mat frame =
        draw_clutter_frame(kind, options.width_px, options.height_px, static_cast<std::uint64_t>(i) + 1, pieces);
    const auto begin = std::chrono::steady_clock::now();
    const std::vector<DetectedTarget> claims = detect_targets(frame, library, DetectConfig{});
    tally.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    ++tally.frames;
    tally.claims += static_cast<int>(claims.size());
    if (!claims.empty()) ++tally.frames_with_claims;
    for (const DetectedTarget& claim : claims) {
      fmt::print("  {} {}: id {} at {:.1f}, {:.1f}, dot {:.1f} px, distance {:.2f}\n", name, i, claim.id,
                 claim.center.x_px, claim.center.y_px, claim.dot_diameter_px, claim.distance);
    }
    if (!options.save.empty() && (!claims.empty() || options.frames <= kinds))
      cv::imwrite(fmt::format("{}/{}_{:03}.png", options.save, name, i), frame);
  }
  return tally;
}

/// Claims in all frames.
int count_claims(const TargetLibrary& library, const Options& options, const PhotographPieces& pieces) {
  fmt::print("library of {} codes of {} bits at distance {}, frames of {:.1f} megapixels\n", library.codes.size(),
             library.bits, library.min_distance, options.width_px * options.height_px / 1e6);
  Tally all;
  std::vector<NamedClutter> kinds(counted_clutter.begin(), counted_clutter.end());
  if (options.only == look_alikes.name) kinds = {look_alikes};
  for (const auto& [kind, name] : kinds) {
    if (!options.only.empty() && options.only != name) continue;
    if (kind == Clutter::photographs && pieces.pieces.empty()) {
      fmt::print("{:<10} left out: no photographs in {}\n", name, options.photographs);
      continue;
    }
    const Tally tally = look_through(library, kind, name, options, pieces);
    if (tally.frames == 0) continue;
    fmt::print("{:<10} {:>4} frames, {:>3} targets claimed in {:>3}, {:>6.0f} ms a frame\n", name, tally.frames,
               tally.claims, tally.frames_with_claims, 1000.0 * tally.seconds / tally.frames);
    std::fflush(stdout);
    all.frames += tally.frames;
    all.claims += tally.claims;
    all.frames_with_claims += tally.frames_with_claims;
    all.seconds += tally.seconds;
  }
  fmt::print("all        {:>4} frames, {:>3} targets claimed in {:>3}, {:>6.0f} ms a frame\n", all.frames, all.claims,
             all.frames_with_claims, 1000.0 * all.seconds / std::max(1, all.frames));
  return all.claims;
}

std::vector<std::string> known_kinds() {
  std::vector<std::string> names{std::string(look_alikes.name)};
  for (const NamedClutter& clutter : counted_clutter) names.emplace_back(clutter.name);
  return names;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Frames without coded targets; exit status 1 if any is claimed");
  app.add_option("--frames", options.frames, "how many, of all kinds in turn")->check(CLI::PositiveNumber);
  app.add_option("--first", options.first, "number of the first frame, which decides what is drawn")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--width", options.width_px, "px")->check(CLI::Range(64, 20000));
  app.add_option("--height", options.height_px, "px")->check(CLI::Range(64, 20000));
  app.add_option("--only", options.only, "one kind; lookalikes are not among the others")
      ->check(CLI::IsMember(known_kinds()));
  app.add_option("--library", options.library, "own: 60 codes at distance 4; greedy: 60 at 3; default: both")
      ->check(CLI::IsMember({"own", "greedy"}));
  app.add_option("--save", options.save, "folder for the frames in which something is claimed")
      ->check(CLI::ExistingDirectory);
  app.add_option("--photographs", options.photographs, "folder with photographs and visible.csv");
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  constexpr int bits = 15;
  constexpr int codes = 60;
  const PhotographPieces pieces = cut_photographs(options.photographs);
  int claims = 0;
  if (options.library != "greedy") {
    const auto own = generate_library(bits, codes);
    if (!own) {
      fmt::print(stderr, "{}\n", own.error().message);
      return 2;
    }
    claims += count_claims(own->library, options, pieces);
  }
  if (options.library != "own") claims += count_claims(greedy_library(bits, codes), options, pieces);
  return claims == 0 ? 0 : 1;
}
