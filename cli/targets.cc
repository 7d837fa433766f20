#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "cli/command.h"
#include "cli/detection_picture.h"
#include "cli/targets_sheet.h"
#include "lib/config/atomic_file.h"
#include "lib/targets/library_generator.h"
#include "lib/targets/lookup_table.h"
#include "lib/targets/target_library.h"
#include "node/capture/image_file.h"
#include "node/detect/detect_config.h"
#include "node/detect/detection_trace.h"

namespace imprint {
namespace {

namespace fs = std::filesystem;

void add_generate(Cli& cli, CLI::App& targets) {
  struct Options {
    int bits = 15;
    int count = 60;
    fs::path out;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = cli.command(
      targets, "generate", "a library of the largest inter-code distance that can be found", [&cli, options] {
        const auto generated = generate_library(options->bits, options->count);
        if (!generated) return fail(generated.error());
        if (const auto written = write_target_library(generated->library, options->out); !written)
          return fail(written.error());
        const TargetLibrary& library = generated->library;
        if (cli.json) {
          return print_json({{"out", options->out.string()},
                             {"bits", library.bits},
                             {"count", library.codes.size()},
                             {"min_distance", library.min_distance},
                             {"least_transitions", generated->least_transitions}});
        }
        fmt::print("{}: {} codes of {} bits, distance {}, at least {} transitions\n", options->out.string(),
                   library.codes.size(), library.bits, library.min_distance, generated->least_transitions);
        return 0;
      });
  command->add_option("--bits", options->bits, "bits of a code, 8 to 20")->capture_default_str();
  command->add_option("--count", options->count, "codes in the library")->capture_default_str();
  command->add_option("--out", options->out, "library.json to write")->required();
}

void add_import(Cli& cli, CLI::App& targets) {
  struct Options {
    int bits = 0;
    TargetGeometry geometry;
    fs::path table;
    fs::path out;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = cli.command(targets, "import", "a library from rows `id decimal-code`", [&cli, options] {
    const TargetGeometry& geometry = options->geometry;
    if (!(geometry.ring_inner_radius > geometry.dot_radius &&
          geometry.ring_outer_radius > geometry.ring_inner_radius)) {
      return fail(
          invalid_input("expected 1 < --ring-inner-radius < --ring-outer-radius (in dot radii), found {} and {}",
                        geometry.ring_inner_radius, geometry.ring_outer_radius)
              .value());
    }
    const auto library = read_lookup_table(options->table, options->bits, geometry);
    if (!library) return fail(library.error());
    if (const auto written = write_target_library(*library, options->out); !written) return fail(written.error());
    if (cli.json) {
      return print_json({{"out", options->out.string()},
                         {"bits", library->bits},
                         {"count", library->codes.size()},
                         {"min_distance", library->min_distance}});
    }
    fmt::print("{}: {} codes of {} bits, distance {}\n", options->out.string(), library->codes.size(), library->bits,
               library->min_distance);
    return 0;
  });
  command->add_option("--bits", options->bits, "bits of a code, 8 to 20")->required();
  command->add_option("--ring-inner-radius", options->geometry.ring_inner_radius, "in dot radii")
      ->capture_default_str();
  command->add_option("--ring-outer-radius", options->geometry.ring_outer_radius, "in dot radii")
      ->capture_default_str();
  command->add_option("LOOKUP", options->table, "rows `id decimal-code`")->required();
  command->add_option("--out", options->out, "library.json to write")->required();
}

/// One image as the contract's JSON has it.
struct ImageDetections {
  std::string image;
  int width_px = 0;
  int height_px = 0;
  double elapsed_ms = 0.0;
  std::vector<DetectedTarget> targets;
};

nlohmann::json to_json(const ImageDetections& detections) {
  nlohmann::json targets = nlohmann::json::array();
  for (const DetectedTarget& target : detections.targets) {
    targets.push_back({{"id", target.id},
                       {"x_px", target.center.x_px},
                       {"y_px", target.center.y_px},
                       {"sigma_px", target.sigma_px},
                       {"dot_diameter_px", target.dot_diameter_px},
                       {"distance", target.distance}});
  }
  return {{"image", detections.image},
          {"width_px", detections.width_px},
          {"height_px", detections.height_px},
          {"elapsed_ms", detections.elapsed_ms},
          {"targets", targets}};
}

void print_table(const ImageDetections& detections) {
  fmt::print("{}: {} x {} px, {} targets, {:.0f} ms\n", detections.image, detections.width_px, detections.height_px,
             detections.targets.size(), detections.elapsed_ms);
  if (detections.targets.empty()) return;
  fmt::print("{:>6} {:>11} {:>11} {:>9} {:>8} {:>8}\n", "id", "x px", "y px", "sigma px", "dot px", "distance");
  for (const DetectedTarget& target : detections.targets) {
    fmt::print("{:>6} {:>11.3f} {:>11.3f} {:>9.4f} {:>8.2f} {:>8.1f}\n", target.id, target.center.x_px,
               target.center.y_px, target.sigma_px, target.dot_diameter_px, target.distance);
  }
}

Result<void> write_png(const cv::Mat& image, const fs::path& path) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", image, bytes)) return job_failed("{}: the picture could not be made", path.string());
  return write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

struct DetectOptions {
  fs::path library;
  DetectConfig config;
  std::vector<fs::path> images;
  fs::path debug_image;

  [[nodiscard]] fs::path debug_image_of(const fs::path& image) const {
    return fs::is_directory(debug_image) ? debug_image / image.stem().concat(".png") : debug_image;
  }
};

/// One picture an image, none written over another or over an image.
Result<void> check_debug_images(const DetectOptions& options) {
  if (options.debug_image.empty()) return {};
  if (options.images.size() > 1 && !fs::is_directory(options.debug_image)) {
    return invalid_input("--debug-image: expected a folder that exists, for {} images, found {}", options.images.size(),
                         options.debug_image.string());
  }
  std::map<fs::path, fs::path> image_of;
  for (const fs::path& image : options.images) {
    const fs::path picture = options.debug_image_of(image);
    const auto [other, added] = image_of.emplace(picture, image);
    if (!added && other->second != image) {
      return invalid_input("--debug-image: expected images of different names, found {} and {}, both for {}",
                           other->second.string(), image.string(), picture.string());
    }
    std::error_code unknown;
    if (fs::equivalent(picture, image, unknown))
      return invalid_input("--debug-image: expected another file than the image {}", image.string());
  }
  return {};
}

Result<ImageDetections> detect_in_file(const fs::path& path, const TargetLibrary& library,
                                       const DetectOptions& options) {
  std::vector<std::string> warnings;
  const auto frame = read_image(path, &warnings);
  if (!frame) return pass_on(frame.error());
  for (const std::string& warning : warnings) std::cerr << "imprint: " << warning << '\n';
  DetectionTrace trace;
  const auto begin = std::chrono::steady_clock::now();
  ImageDetections detections{path.string(), frame->image.cols, frame->image.rows, 0.0, {}};
  detections.targets =
      detect_targets(frame->image, library, options.config, options.debug_image.empty() ? nullptr : &trace);
  detections.elapsed_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  if (!options.debug_image.empty()) {
    const cv::Mat picture = draw_detection_picture(frame->image, detections.targets, trace);
    if (const auto written = write_png(picture, options.debug_image_of(path)); !written)
      return pass_on(written.error());
  }
  return detections;
}

int run_detect(const Cli& cli, const DetectOptions& options) {
  if (const auto valid = options.config.validate(); !valid) return fail(valid.error());
  if (const auto valid = check_debug_images(options); !valid) return fail(valid.error());
  const auto library = read_target_library(options.library);
  if (!library) return fail(library.error());
  nlohmann::json images = nlohmann::json::array();
  for (const fs::path& path : options.images) {
    const auto detections = detect_in_file(path, *library, options);
    if (!detections) return fail(detections.error());
    if (cli.json)
      images.push_back(to_json(*detections));
    else
      print_table(*detections);
  }
  return cli.json ? print_json({{"images", images}}) : 0;
}

void add_detect(Cli& cli, CLI::App& targets) {
  const auto options = std::make_shared<DetectOptions>();
  CLI::App* command = cli.command(targets, "detect", "ids and subpixel centres of the coded targets in images",
                                  [&cli, options] { return run_detect(cli, *options); });
  command->add_option("--library", options->library, "library.json")->required();
  command->add_option("--min-dot-px", options->config.min_dot_px, "least mean diameter of a dot")
      ->capture_default_str();
  command->add_option("--max-dot-px", options->config.max_dot_px, "largest mean diameter of a dot")
      ->capture_default_str();
  const std::map<std::string, Decoder> decoders{{"likelihood", Decoder::likelihood}, {"plain", Decoder::plain}};
  command
      ->add_option("--decoder", options->config.decoder,
                   "likelihood, or plain: thresholds and no error correction, for comparison")
      ->transform(CLI::CheckedTransformer(decoders).description(""))
      ->type_name("NAME");
  command->add_option(
      "--debug-image", options->debug_image,
      "PNG to write: what was found, and what was rejected and why; a folder takes one PNG for each image");
  command->add_option("IMAGE", options->images, "PNG or TIFF, 8 or 16 bit")->required();
}

}  // namespace

void add_targets_command(Cli& cli) {
  CLI::App* targets = cli.app.add_subcommand("targets", "coded targets: libraries, sheets to print and detection");
  targets->require_subcommand(1);
  add_generate(cli, *targets);
  add_import(cli, *targets);
  add_detect(cli, *targets);
  add_targets_sheet(cli, *targets);
}

}  // namespace imprint
