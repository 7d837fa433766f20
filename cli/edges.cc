#include <cmath>
#include <filesystem>

#include <fmt/core.h>
#include <opencv2/imgcodecs.hpp>

#include "cli/command.h"
#include "cli/silhouette_picture.h"
#include "lib/config/atomic_file.h"
#include "node/capture/image_file.h"
#include "node/node_pipeline.h"

namespace imprint {
namespace {

struct EdgesOptions {
  std::filesystem::path rig, image, debug_image;
  std::string camera_id;
  std::string method = "best";
};

ObservedPoint observed(const Segmentation& frame, double station_px, double offset_px) {
  return {frame.origin.x_px + station_px * frame.direction_x - offset_px * frame.direction_y,
          frame.origin.y_px + station_px * frame.direction_y + offset_px * frame.direction_x};
}

nlohmann::json curve_json(const Segmentation& frame, const std::vector<FilteredPoint>& curve) {
  auto json = nlohmann::json::array();
  for (const FilteredPoint& point : curve) {
    const ObservedPoint p = observed(frame, point.station_px, point.offset_px);
    json.push_back({p.x_px, p.y_px, point.weight});
  }
  return json;
}

nlohmann::json end_json(const Segmentation& frame, const LocatedEnd& end) {
  const ObservedPoint p = observed(frame, end.station_px, end.offset_px);
  return {{"x_px", p.x_px}, {"y_px", p.y_px}, {"sigma_px", end.sigma_px}, {"visible", end.visible}};
}

Result<void> write_picture(const cv::Mat& image, const ProcessedFrame& processed, const std::filesystem::path& path) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", draw_silhouette_picture(image, processed), bytes);
  return write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

nlohmann::json quality_json(const FrameQuality& quality) {
  return {{"edge_points", quality.edge_points},
          {"edge_coverage", quality.edge_coverage},
          {"contrast", quality.contrast},
          {"saturated_fraction", quality.saturated_fraction},
          {"frame_saturated_fraction", quality.frame_saturated_fraction},
          {"body_level", quality.body_level},
          {"blur_px", quality.blur_px},
          {"haze_px", quality.haze_px}};
}

int run_edges(const EdgesOptions& options, bool as_json) {
  const auto method = edge_method_from_name(options.method);
  if (!method) return fail(method.error());
  const auto rig = read_rig(options.rig);
  if (!rig) return fail(rig.error());
  const CameraModel* camera = rig->find_camera(options.camera_id);
  if (camera == nullptr) {
    std::string ids;
    for (const CameraModel& known : rig->cameras) ids += (ids.empty() ? "" : ", ") + known.id;
    return fail({ErrorKind::invalid_input,
                 fmt::format("{}: has no camera \"{}\", only {}", options.rig.string(), options.camera_id, ids)});
  }
  std::vector<std::string> warnings = rig->warnings;
  const auto frame = read_image(options.image, &warnings);
  if (!frame) return fail(frame.error());
  const ProcessedFrame processed = process_frame(*frame, *camera, *rig, *method);
  warnings.insert(warnings.end(), processed.imprint.warnings.begin(), processed.imprint.warnings.end());
  for (const std::string& warning : warnings) std::cerr << "imprint: warning: " << warning << '\n';
  if (!options.debug_image.empty()) {
    if (auto drawn = write_picture(frame->image, processed, options.debug_image); !drawn) return fail(drawn.error());
  }
  if (processed.error) return fail(*processed.error);
  const FilteredSilhouette& silhouette = *processed.silhouette;
  const FrameQuality& quality = processed.imprint.quality;
  if (as_json) {
    return print_json({{"camera", camera->id},
                       {"quality", quality_json(quality)},
                       {"upper", curve_json(silhouette.frame, silhouette.upper)},
                       {"lower", curve_json(silhouette.frame, silhouette.lower)},
                       {"axis", curve_json(silhouette.frame, silhouette.axis)},
                       {"start", end_json(silhouette.frame, silhouette.start)},
                       {"end", end_json(silhouette.frame, silhouette.end)}});
  }
  fmt::print(
      "camera \"{}\": {} edge points, both rims trusted over {:.0f} % of the length, contrast {:.0f} % of full scale, "
      "{:.1f} % saturated, blur {:.2f} px, haze {:.2f} px\n",
      camera->id, quality.edge_points, 100 * quality.edge_coverage, 100 * quality.contrast,
      100 * quality.saturated_fraction, quality.blur_px, quality.haze_px);
  for (const auto& [name, end] : {std::pair{"start", silhouette.start}, {"end", silhouette.end}}) {
    const ObservedPoint p = observed(silhouette.frame, end.station_px, end.offset_px);
    if (end.visible) fmt::print("  {:<5} at ({:.2f}, {:.2f}) px +-{:.2f}\n", name, p.x_px, p.y_px, 1.96 * end.sigma_px);
    if (!end.visible) fmt::print("  {:<5} not visible\n", name);
  }
  return 0;
}

}  // namespace

void add_edges_command(Cli& cli) {
  auto options = std::make_shared<EdgesOptions>();
  auto* command = cli.command(cli.app, "edges", "the forging's silhouettes and axis imprint in one image",
                              [options, &cli] { return run_edges(*options, cli.json); });
  command->add_option("--rig", options->rig, "rig.toml")->required();
  command->add_option("--camera-id", options->camera_id, "the camera of the rig that took the image")->required();
  command->add_option("--method", options->method, "best, orientation, magnitude, combined, uniform, none or pixel")
      ->capture_default_str();
  command->add_option("--debug-image", options->debug_image,
                      "PNG to write: the image, brightened, with the rims (green: trusted, red: hardly), rejected "
                      "edges, the axis, the ends");
  command->add_option("image", options->image, "PNG or TIFF")->required();
}

}  // namespace imprint
