#include "lib/camera/camera_file.h"

#include <algorithm>

#include "lib/camera/camera_yaml.h"
#include "lib/config/atomic_file.h"
#include "lib/config/toml_file.h"

namespace imprint {
namespace {

void check(const CameraModel& camera, TomlReader& read) {
  for (const auto& [key, value] :
       {std::pair{"camera.width_px", camera.width_px}, {"camera.height_px", camera.height_px}}) {
    if (value < 1 || value > kLargestSide_px) {
      read.fault(key, fmt::format("expected 1 to {}, found {}", kLargestSide_px, value));
    }
  }
  if (!is_camera_name(camera.id)) {
    read.fault("camera.id", fmt::format("expected a name of letters, digits, _ and -, found \"{}\"", camera.id));
  }
  if (!(camera.pixel_pitch_um > 0)) {
    read.fault("camera.pixel_pitch_um", fmt::format("expected a positive number, found {}", camera.pixel_pitch_um));
  }
  if (!(camera.focal_length_px > 0)) {
    read.fault("camera.focal_length_px", fmt::format("expected a positive number, found {}", camera.focal_length_px));
  }
}

}  // namespace

bool is_camera_name(std::string_view id) {
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
  return !id.empty() && id.find_first_not_of(kAllowed) == std::string_view::npos;
}

Result<CameraModel> read_camera_file(const std::filesystem::path& path, std::vector<std::string>* warnings) {
  if (is_yaml_name(path)) return read_camera_yaml(path, warnings);
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  TomlReader read(path, *table);
  CameraModel camera;
  camera.id = read.string("camera.id");
  camera.width_px = static_cast<int>(std::clamp<std::int64_t>(read.integer("camera.width_px"), 0, kLargestSide_px + 1));
  camera.height_px =
      static_cast<int>(std::clamp<std::int64_t>(read.integer("camera.height_px"), 0, kLargestSide_px + 1));
  camera.pixel_pitch_um = read.number("camera.pixel_pitch_um");
  camera.focal_length_px = read.number("camera.focal_length_px");
  const auto point = read.numbers("camera.principal_point_px", 2);
  camera.principal_point = {point[0], point[1]};
  if (read.string("distortion.model", "balanced") != "balanced") {
    read.fault("distortion.model", "expected \"balanced\"");
  }
  camera.distortion.r0 = read.number("distortion.r0", camera.distortion.r0);
  const auto radial = read.numbers("distortion.radial", 3, std::vector<double>(3, 0.0));
  const auto tangential = read.numbers("distortion.tangential", 2, std::vector<double>(2, 0.0));
  const auto affine = read.numbers("distortion.affine", 2, std::vector<double>(2, 0.0));
  std::copy_n(radial.begin(), 3, camera.distortion.radial.begin());
  std::copy_n(tangential.begin(), 2, camera.distortion.tangential.begin());
  std::copy_n(affine.begin(), 2, camera.distortion.affine.begin());
  check(camera, read);
  if (read.error()) return pass_on(*read.error());
  return camera;
}

Result<void> write_camera_file(const CameraModel& camera, const std::filesystem::path& path,
                               const std::string& record) {
  const auto& d = camera.distortion;
  return write_file_atomically(
      path, fmt::format("[camera]\n"
                        "id = \"{}\"\n"
                        "width_px = {}\n"
                        "height_px = {}\n"
                        "pixel_pitch_um = {:#}\n"
                        "focal_length_px = {:#}\n"
                        "principal_point_px = [{:#}, {:#}]\n"
                        "[distortion]\n"
                        "model = \"balanced\"\n"
                        "r0 = {:#}\n"
                        "radial = [{:#}, {:#}, {:#}]\n"
                        "tangential = [{:#}, {:#}]\n"
                        "affine = [{:#}, {:#}]\n{}",
                        camera.id, camera.width_px, camera.height_px, camera.pixel_pitch_um, camera.focal_length_px,
                        camera.principal_point.x_px, camera.principal_point.y_px, d.r0, d.radial[0], d.radial[1],
                        d.radial[2], d.tangential[0], d.tangential[1], d.affine[0], d.affine[1], record));
}

}  // namespace imprint
