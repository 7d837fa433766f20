#include <filesystem>

#include <fmt/core.h>

#include "cli/calibration_sheet.h"
#include "cli/calibration_start.h"
#include "cli/command.h"
#include "lib/adjust/calibration_review.h"
#include "lib/camera/camera_file.h"
#include "lib/camera/camera_yaml.h"
#include "lib/camera/opencv_camera.h"
#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "node/capture/image_file.h"
#include "node/detect/detect_config.h"

namespace imprint {
namespace {

namespace fs = std::filesystem;

struct CalibrateOptions {
  fs::path library, field, dots, out;
  std::string id;
  double pixel_pitch_um = 0.0, focal_length_mm = 0.0;
  bool export_yaml = false;
  std::vector<fs::path> images;
};

// The camera as its maker states it: no distortion, the principal point in the middle.
CameraModel nominal_camera(const CalibrateOptions& options, const cv::Size& size) {
  CameraModel camera;
  camera.id = options.id;
  camera.width_px = size.width;
  camera.height_px = size.height;
  camera.pixel_pitch_um = options.pixel_pitch_um;
  camera.focal_length_px = 1000.0 * options.focal_length_mm / options.pixel_pitch_um;
  camera.principal_point = {0.5 * (size.width - 1), 0.5 * (size.height - 1)};
  return camera;
}

struct Loaded {
  CameraModel camera;
  std::vector<CalibrationImage> images;
};

Result<Loaded> load(const CalibrateOptions& options, const TargetLibrary& library, const TargetField& field) {
  Loaded loaded;
  for (const fs::path& path : options.images) {
    std::vector<std::string> warnings;
    const auto frame = read_image(path, &warnings);
    if (!frame) return pass_on(frame.error());
    for (const std::string& warning : warnings) std::cerr << "imprint: warning: " << warning << '\n';
    const cv::Size size = frame->image.size();
    if (loaded.images.empty()) {
      loaded.camera = nominal_camera(options, size);
    } else if (size.width != loaded.camera.width_px || size.height != loaded.camera.height_px) {
      return invalid_input("{}: is {} x {} px, but {} is {} x {}; all images must be of one camera", path.string(),
                           size.width, size.height, options.images.front().string(), loaded.camera.width_px,
                           loaded.camera.height_px);
    }
    const auto targets = detect_targets(frame->image, library, DetectConfig{});
    const auto pose = calibration_start(loaded.camera, targets, field);
    if (!pose) return pass_on(Error{pose.error().kind, fmt::format("{}: {}", path.string(), pose.error().message)});
    CalibrationImage image{path.string(), *pose, {}};
    for (const DetectedTarget& target : targets) image.points.push_back({target.id, target.center, target.sigma_px});
    loaded.images.push_back(std::move(image));
  }
  return loaded;
}

// Root mean square and number of the targets used in one image.
std::pair<double, int> image_fit(const Calibration& calibration, std::size_t image) {
  double squares = 0.0;
  int used = 0;
  for (const CalibrationResidual& r : calibration.residuals) {
    if (r.image != image || !r.used) continue;
    squares += r.dx_px * r.dx_px + r.dy_px * r.dy_px;
    ++used;
  }
  return {used > 0 ? std::sqrt(squares / used) : 0.0, used};
}

nlohmann::json describe(const Calibration& calibration, const std::vector<CalibrationImage>& images) {
  const CameraModel& camera = calibration.camera;
  const BalancedDistortion& d = camera.distortion;
  nlohmann::json json;
  json["camera"] = {{"camera",
                     {{"id", camera.id},
                      {"width_px", camera.width_px},
                      {"height_px", camera.height_px},
                      {"pixel_pitch_um", camera.pixel_pitch_um},
                      {"focal_length_px", camera.focal_length_px},
                      {"principal_point_px", {camera.principal_point.x_px, camera.principal_point.y_px}}}},
                    {"distortion",
                     {{"model", "balanced"},
                      {"r0", d.r0},
                      {"radial", d.radial},
                      {"tangential", d.tangential},
                      {"affine", d.affine}}}};
  json["reprojection_rms_px"] = calibration.reprojection_rms_px;
  json["target_sigma_mm"] = calibration.target_sigma_mm;
  json["observations"] = calibration.observations;
  for (int i = 0; i < kInteriorTerms; ++i)
    json["ci95"][std::string(kInteriorNames[static_cast<std::size_t>(i)])] = calibration.ci95(i);
  json["images"] = nlohmann::json::array();
  json["rejected"] = nlohmann::json::array();
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto [rms, used] = image_fit(calibration, i);
    json["images"].push_back({{"image", images[i].name}, {"rms_px", rms}, {"targets", used}});
  }
  for (const CalibrationResidual& r : calibration.residuals)
    if (!r.used)
      json["rejected"].push_back(
          {{"image", images[r.image].name}, {"id", r.id}, {"reason", rejection_reason(calibration, r)}});
  for (const UnknownTarget& u : calibration.unknown)
    json["rejected"].push_back({{"image", images[u.image].name}, {"id", u.id}, {"reason", "not in the field"}});
  json["warnings"] = calibration.warnings;
  return json;
}

void print(const Calibration& calibration, const std::vector<CalibrationImage>& images) {
  const auto terms = calibration.camera.distortion.terms();
  fmt::print("camera \"{}\": reprojection RMS {:.4f} px over {} targets in {} images\n", calibration.camera.id,
             calibration.reprojection_rms_px, calibration.observations, images.size());
  const std::array<double, 3> first{calibration.camera.focal_length_px, calibration.camera.principal_point.x_px,
                                    calibration.camera.principal_point.y_px};
  for (std::size_t i = 0; i < kInteriorNames.size(); ++i) {
    const double value = i < 3 ? first[i] : terms[i - 3];
    const double half_width = calibration.ci95(static_cast<int>(i));
    if (i < 3) {
      fmt::print("  {:<22} {:>13.3f} +- {:.3f}\n", kInteriorNames[i], value, half_width);
    } else {
      fmt::print("  {:<22} {:>13.4e} +- {:.1e}\n", kInteriorNames[i], value, half_width);
    }
  }
  if (calibration.target_sigma_mm > 0.0)
    fmt::print("  targets are seen {:.4f} mm (sigma, a coordinate) off the field's coordinates, alike in all images\n",
               calibration.target_sigma_mm);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto [rms, used] = image_fit(calibration, i);
    fmt::print("  {}: {} targets, RMS {:.4f} px\n", images[i].name, used, rms);
  }
  for (const CalibrationResidual& r : calibration.residuals)
    if (!r.used)
      fmt::print("  left out: {} target {}: {}\n", images[r.image].name, r.id, rejection_reason(calibration, r));
  for (const UnknownTarget& u : calibration.unknown)
    fmt::print("  left out: {} target {}: not in the field\n", images[u.image].name, u.id);
}

// What a reader of the camera does not need but an auditor asks for.
std::string calibration_record(const Calibration& calibration, std::size_t images, const std::string& made_at) {
  std::string text = fmt::format(
      "[calibration]\ndate = {}\nreprojection_rms_px = {:.5f}\ntarget_sigma_mm = {:.6f}\nobservations = {}\nimages = "
      "{}\n"
      "[calibration.ci95]\n",
      made_at, calibration.reprojection_rms_px, calibration.target_sigma_mm, calibration.observations, images);
  for (int i = 0; i < kInteriorTerms; ++i)
    text += fmt::format("{} = {:.6e}\n", kInteriorNames[static_cast<std::size_t>(i)], calibration.ci95(i));
  return text;
}

// The files beside camN.toml: plot, record and, where asked for, the camera for other programs.
Result<std::vector<fs::path>> write_beside(const CalibrateOptions& options, const CalibrationSheet& sheet) {
  const fs::path stem = fs::path(options.out).replace_extension();
  std::vector<fs::path> written;
  const auto write = [&](const std::string& ending, const std::string& bytes) {
    written.push_back(stem.string() + ending);
    return write_file_atomically(written.back(), bytes);
  };
  const auto plot = draw_residuals_png(sheet);
  if (!plot) return pass_on(plot.error());
  const auto record = draw_record_pdf(sheet);
  if (!record) return pass_on(record.error());
  if (auto done = write("_residuals.png", *plot); !done) return pass_on(done.error());
  if (auto done = write("_record.pdf", *record); !done) return pass_on(done.error());
  if (!options.export_yaml) return written;
  const CameraModel& camera = sheet.calibration.camera;
  if (auto done = write("_opencv.yaml", camera_as_opencv_yaml(camera)); !done) return pass_on(done.error());
  if (auto done = write("_ros.yaml", camera_as_ros_yaml(camera)); !done) return pass_on(done.error());
  if (const double error_px = to_opencv(camera).max_error_px; error_px > 0.001)
    std::cerr << fmt::format(
        "imprint: warning: OpenCV's model has no shear (C2): the exported cameras differ from {} by up to {:.3f} px\n",
        options.out.string(), error_px);
  return written;
}

int run_calibrate(const CalibrateOptions& options, bool as_json) {
  if (!(options.pixel_pitch_um > 0.0) || !(options.focal_length_mm > 0.0))
    return fail({ErrorKind::invalid_input,
                 fmt::format("expected --pixel-pitch-um and --focal-length-mm above 0, found {} and {}",
                             options.pixel_pitch_um, options.focal_length_mm)});
  const auto library = read_target_library(options.library);
  if (!library) return fail(library.error());
  const auto field = read_target_field(options.field);
  if (!field) return fail(field.error());
  const auto dots = options.dots.empty() ? Result<DotDiscs>{} : read_dot_discs(options.dots);
  if (!dots) return fail(dots.error());
  const auto loaded = load(options, *library, *field);
  if (!loaded) return fail(loaded.error());
  const auto calibration = calibrate_camera(loaded->camera, loaded->images, *field, CalibrateConfig{}, *dots);
  if (!calibration) return fail(calibration.error());
  for (const std::string& warning : calibration->warnings) std::cerr << "imprint: warning: " << warning << '\n';
  const std::string made_at = utc_text(wall_clock_ns());
  const auto written = write_camera_file(calibration->camera, options.out,
                                         calibration_record(*calibration, loaded->images.size(), made_at));
  if (!written) return fail(written.error());
  const auto beside = write_beside(options, {*calibration, loaded->images, *field, options.field.string(), made_at});
  if (!beside) return fail(beside.error());
  if (as_json) {
    auto json = describe(*calibration, loaded->images);
    for (const fs::path& path : *beside) json["files"].push_back(path.string());
    return print_json(json);
  }
  print(*calibration, loaded->images);
  for (const fs::path& path : *beside) fmt::print("  {}\n", path.string());
  return 0;
}

}  // namespace

void add_calibrate_command(Cli& cli) {
  auto options = std::make_shared<CalibrateOptions>();
  auto* command = cli.command(cli.app, "calibrate", "the camera's interior orientation from images of a known field",
                              [options, &cli] { return run_calibrate(*options, cli.json); });
  command->add_option("--library", options->library, "library.json, the coded targets")->required();
  command->add_option("--field", options->field, "field.csv, where they stand")->required();
  command->add_option("--dots", options->dots, "dots.csv, size and normal of the dots, as `survey --dots` writes it");
  command->add_option("--pixel-pitch-um", options->pixel_pitch_um, "side of a pixel")->required();
  command->add_option("--focal-length-mm", options->focal_length_mm, "as engraved on the lens")->required();
  command->add_option("--id", options->id, "name of the camera, part of its keys on the network")->required();
  command->add_option("--out", options->out, "camN.toml to write")->required();
  command->add_flag("--export", options->export_yaml, "write the camera as OpenCV and ROS YAML too, beside it");
  command->add_option("images", options->images, "PNG or TIFF, all of one camera at one focus")->required();
}

}  // namespace imprint
