#include "lib/camera/camera_yaml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>

#include <fmt/ranges.h>

#include "lib/camera/camera_file.h"
#include "lib/camera/opencv_camera.h"
#include "lib/config/atomic_file.h"
#include "lib/config/yaml_file.h"

namespace imprint {
namespace {

constexpr double kWorthSaying_px = 0.001;
constexpr std::size_t kLargestFile_bytes = 1 << 20;

std::string as_matrix(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += fmt::format("{}{:#}", text.empty() ? "" : ", ", value);
  return "[" + text + "]";
}

std::string how_exact(double max_error_px) {
  return max_error_px < kWorthSaying_px
             ? fmt::format("# The same camera as the balanced model to {:.1e} px.\n", max_error_px)
             : fmt::format(
                   "# Fitted to the balanced model, which has a shear that OpenCV's lacks:\n"
                   "# the two differ by up to {:.3f} px within the image.\n",
                   max_error_px);
}

std::vector<double> matrix_of(const OpenCvCamera& c) {
  return {c.fx_px, 0.0, c.cx_px, 0.0, c.fy_px, c.cy_px, 0.0, 0.0, 1.0};
}

std::vector<double> plumb_bob_of(const OpenCvCamera& c) { return {c.distortion.begin(), c.distortion.begin() + 5}; }

// The first of some names by which programs write the same thing.
std::string first_of(const YamlFile& yaml, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (yaml.has(name)) return name;
  return *names.begin();
}

struct YamlCameraReader {
  const YamlFile& yaml;
  const std::string& name;

  Result<int> side(std::initializer_list<const char*> names) const {
    const std::string key = first_of(yaml, names);
    const auto value = yaml.number(key);
    if (!value || *value != std::floor(*value) || *value < 1 || *value > kLargestSide_px)
      return invalid_input("{}: {}: expected a whole number from 1 to {}, found {}", name, key, kLargestSide_px,
                           yaml.scalar(key).value_or("none"));
    return static_cast<int>(*value);
  }

  // A matrix: {rows, cols, data} or a bare list.
  Result<std::vector<double>> matrix(std::initializer_list<const char*> names,
                                     std::initializer_list<std::size_t> sizes) const {
    const std::string key = first_of(yaml, names);
    const auto values = yaml.numbers(yaml.has(key + ".data") ? key + ".data" : key);
    if (!values) return invalid_input("{}: {}: expected a list of finite numbers, found none", name, key);
    if (std::ranges::find(sizes, values->size()) == sizes.end())
      return invalid_input("{}: {}: expected {} numbers, found {}", name, key, fmt::join(sizes, " or "),
                           values->size());
    return *values;
  }

  Result<OpenCvCamera> read() const {
    OpenCvCamera camera;
    const auto width = side({"image_width", "image_Width", "width"});
    if (!width) return pass_on(width.error());
    const auto height = side({"image_height", "image_Height", "height"});
    if (!height) return pass_on(height.error());
    camera.width_px = *width;
    camera.height_px = *height;
    const auto matrix_values = matrix({"camera_matrix", "Camera_Matrix", "cameraMatrix", "K"}, {9});
    if (!matrix_values) return pass_on(matrix_values.error());
    const auto& k = *matrix_values;
    if (!(k[0] > 0.0 && k[4] > 0.0) || k[1] != 0.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
      return invalid_input("{}: camera_matrix: expected [fx, 0, cx, 0, fy, cy, 0, 0, 1] with fx, fy > 0, found [{}]",
                           name, fmt::join(k, ", "));
    camera.fx_px = k[0], camera.cx_px = k[2], camera.fy_px = k[4], camera.cy_px = k[5];
    const std::string model = yaml.scalar("distortion_model").value_or("plumb_bob");
    if (model != "plumb_bob" && model != "rational_polynomial" && model != "thin_prism")
      return invalid_input("{}: distortion_model: expected plumb_bob, rational_polynomial or thin_prism, found \"{}\"",
                           name, model);
    const auto coefficients = matrix(
        {"distortion_coefficients", "Distortion_Coefficients", "dist_coeffs", "distCoeffs", "D"}, {4, 5, 8, 12, 14});
    if (!coefficients) return pass_on(coefficients.error());
    for (std::size_t i = camera.distortion.size(); i < coefficients->size(); ++i)
      if ((*coefficients)[i] != 0.0)
        return invalid_input("{}: distortion_coefficients: a tilted sensor (tauX, tauY) is not supported", name);
    std::copy_n(coefficients->begin(), std::min(coefficients->size(), camera.distortion.size()),
                camera.distortion.begin());
    return camera;
  }
};

std::string name_of(const YamlFile& yaml, const std::filesystem::path& path) {
  const std::string key = first_of(yaml, {"camera_name", "camera_id", "id"});
  return yaml.scalar(key).value_or(path.stem().stem().string());
}

}  // namespace

std::string camera_as_opencv_yaml(const CameraModel& camera) {
  const auto [c, max_error_px] = to_opencv(camera);
  return fmt::format(
      "%YAML:1.0\n---\n{}"
      "camera_name: \"{}\"\n"
      "pixel_pitch_um: {:#}\n"
      "image_width: {}\n"
      "image_height: {}\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {}\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: {}\n",
      how_exact(max_error_px), camera.id, camera.pixel_pitch_um, c.width_px, c.height_px, as_matrix(matrix_of(c)),
      as_matrix(plumb_bob_of(c)));
}

std::string camera_as_ros_yaml(const CameraModel& camera) {
  const auto [c, max_error_px] = to_opencv(camera);
  return fmt::format(
      "{}"
      "image_width: {}\n"
      "image_height: {}\n"
      "camera_name: {}\n"
      "pixel_pitch_um: {:#}\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: {}\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: {}\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: {}\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n  data: {}\n",
      how_exact(max_error_px), c.width_px, c.height_px, camera.id, camera.pixel_pitch_um, as_matrix(matrix_of(c)),
      as_matrix(plumb_bob_of(c)), as_matrix({1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}),
      as_matrix({c.fx_px, 0.0, c.cx_px, 0.0, 0.0, c.fy_px, c.cy_px, 0.0, 0.0, 0.0, 1.0, 0.0}));
}

bool is_yaml_name(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".yaml" || extension == ".yml";
}

Result<CameraModel> read_camera_yaml(const std::filesystem::path& path, std::vector<std::string>* warnings) {
  const std::string name = path.string();
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  if (text->size() > kLargestFile_bytes)
    return invalid_input("{}: expected a camera's calibration, found a file of {} bytes", name, text->size());
  const auto yaml = YamlFile::parse(*text, name);
  if (!yaml) return pass_on(yaml.error());
  const auto seen = YamlCameraReader{*yaml, name}.read();
  if (!seen) return pass_on(seen.error());
  auto converted = from_opencv(*seen);
  if (!converted) return invalid_input("{}: {}", name, converted.error().message);
  constexpr double kNotAPinhole_px = 1.0;
  if (converted->max_error_px > kNotAPinhole_px)
    return invalid_input(
        "{}: this distortion differs from the balanced model by up to {:.2f} px, at most {} px expected; calibrate "
        "with `imprint calibrate`",
        name, converted->max_error_px, kNotAPinhole_px);
  if (warnings != nullptr && converted->max_error_px > kWorthSaying_px)
    warnings->push_back(
        fmt::format("{}: this camera is not exactly one of the balanced model: fitted, it differs by up to {:.3f} px",
                    name, converted->max_error_px));
  CameraModel camera = converted->camera;
  camera.id = name_of(*yaml, path);
  camera.pixel_pitch_um = yaml->number("pixel_pitch_um").value_or(0.0);
  if (!is_camera_name(camera.id))
    return invalid_input("{}: camera_name: expected a name of letters, digits, _ and -, found \"{}\"", name, camera.id);
  return camera;
}

}  // namespace imprint
