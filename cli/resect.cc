#include <filesystem>

#include <fmt/core.h>

#include "cli/command.h"
#include "lib/camera/camera_file.h"
#include "node/capture/image_file.h"
#include "node/detect/detect_config.h"
#include "node/resect/resect.h"

namespace imprint {
namespace {

struct ResectOptions {
  std::filesystem::path camera, library, field, dots, image;
};

nlohmann::json describe(const std::string& camera, const Resection& resection) {
  const CameraPose& pose = resection.pose;
  nlohmann::json json;
  json["camera"] = camera;
  json["center_mm"] = std::vector<double>(pose.center_world_mm.data(), pose.center_world_mm.data() + 3);
  json["R_cam_world"] = nlohmann::json::array();
  for (int i = 0; i < 9; ++i) json["R_cam_world"].push_back(pose.R_cam_world(i / 3, i % 3));
  // [B] equation 1 multiplies by the transpose of R, so its angles are those of the world-from-camera rotation.
  const Eigen::Vector3d angles = omega_phi_kappa_from_rotation(pose.R_cam_world.transpose());
  json["omega_phi_kappa_rad"] = std::vector<double>(angles.data(), angles.data() + 3);
  json["covariance"] = std::vector<double>(pose.covariance.data(), pose.covariance.data() + 36);
  json["reprojection_rms_px"] = resection.reprojection_rms_px;
  json["targets"] = nlohmann::json::array();
  for (const ResectedTarget& target : resection.targets) {
    json["targets"].push_back(
        {{"id", target.id}, {"dx_px", target.dx_px}, {"dy_px", target.dy_px}, {"used", target.used}});
  }
  json["unknown_ids"] = resection.unknown_ids;
  return json;
}

void print(const std::string& camera, const Resection& resection) {
  const CameraPose& pose = resection.pose;
  const Vector6d sigma = pose.covariance.diagonal().cwiseSqrt();
  fmt::print(
      "camera \"{}\": centre {:.3f} {:.3f} {:.3f} mm (+-{:.3f} {:.3f} {:.3f}, 95 %), reprojection RMS {:.4f} px\n",
      camera, pose.center_world_mm.x(), pose.center_world_mm.y(), pose.center_world_mm.z(), 1.96 * sigma(0),
      1.96 * sigma(1), 1.96 * sigma(2), resection.reprojection_rms_px);
  for (const ResectedTarget& target : resection.targets) {
    fmt::print("  target {:>4}  dx {:>+8.3f} px  dy {:>+8.3f} px{}\n", target.id, target.dx_px, target.dy_px,
               target.used ? "" : "  left out");
  }
}

int run_resect(const ResectOptions& options, bool as_json) {
  std::vector<std::string> warnings;
  const auto camera = read_camera_file(options.camera, &warnings);
  if (!camera) return fail(camera.error());
  const auto library = read_target_library(options.library);
  if (!library) return fail(library.error());
  const auto field = read_target_field(options.field);
  if (!field) return fail(field.error());
  const auto dots = options.dots.empty() ? Result<DotDiscs>{} : read_dot_discs(options.dots);
  if (!dots) return fail(dots.error());
  const auto frame = read_image(options.image, &warnings);
  if (!frame) return fail(frame.error());
  for (const std::string& warning : warnings) std::cerr << "imprint: warning: " << warning << '\n';
  if (frame->image.cols != camera->width_px || frame->image.rows != camera->height_px) {
    return fail(
        {ErrorKind::invalid_input, fmt::format("{}: is {} x {} px, but {} is the calibration of a camera of {} x {} px",
                                               options.image.string(), frame->image.cols, frame->image.rows,
                                               options.camera.string(), camera->width_px, camera->height_px)});
  }
  const auto resection =
      resect(*camera, detect_targets(frame->image, *library, DetectConfig{}), *field, ResectConfig{}, *dots);
  if (!resection)
    return fail({resection.error().kind, fmt::format("{}: {}", options.image.string(), resection.error().message)});
  for (const int id : resection->unknown_ids) {
    std::cerr << fmt::format("imprint: warning: {}: target {} is not in {}\n", options.image.string(), id,
                             options.field.string());
  }
  if (as_json) return print_json(describe(camera->id, *resection));
  print(camera->id, *resection);
  return 0;
}

}  // namespace

void add_resect_command(Cli& cli) {
  auto options = std::make_shared<ResectOptions>();
  auto* command = cli.command(cli.app, "resect", "the camera's pose from one image",
                              [options, &cli] { return run_resect(*options, cli.json); });
  command->add_option("--camera", options->camera, "camN.toml, the calibration")->required();
  command->add_option("--library", options->library, "library.json, the coded targets")->required();
  command->add_option("--field", options->field, "field.csv, where they stand")->required();
  command->add_option("--dots", options->dots, "dots.csv, size and normal of the dots, as `survey --dots` writes it");
  command->add_option("image", options->image, "PNG or TIFF")->required();
}

}  // namespace imprint
