#include "lib/camera/camera_yaml.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <unistd.h>

#include <catch2/catch.hpp>
#include <opencv2/calib3d.hpp>

#include "lib/camera/camera_file.h"
#include "lib/camera/opencv_camera.h"
#include "tests/unit/paper_camera.h"

using namespace imprint;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

struct Folder {
  fs::path path = fs::temp_directory_path() / fs::path("camera_yaml_test_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return path / name;
  }
};

// Largest distance between two of our cameras over directions that fill the image.
double largest_difference_px(const CameraModel& a, const CameraModel& b) {
  double largest = 0.0;
  for (double x = -0.4; x <= 0.4; x += 0.05) {
    for (double y = -0.3; y <= 0.3; y += 0.05) {
      const ObservedPoint p = project(a, {x, y, 1.0}), q = project(b, {x, y, 1.0});
      largest = std::max(largest, std::hypot(p.x_px - q.x_px, p.y_px - q.y_px));
    }
  }
  return largest;
}

std::string ros_yaml(const std::string& replace = "", const std::string& by = "") {
  std::string text = camera_as_ros_yaml(paper_camera_without_affine());
  if (!replace.empty()) text.replace(text.find(replace), replace.size(), by);
  return text;
}

}  // namespace

TEST_CASE("opencv camera: cv::projectPoints shows a point where ours says") {
  const CameraModel camera = paper_camera_without_affine();
  const auto [converted, max_error_px] = to_opencv(camera);
  CHECK(max_error_px < 1e-6);  // without affine terms only the notation differs
  const cv::Matx33d matrix(converted.fx_px, 0, converted.cx_px, 0, converted.fy_px, converted.cy_px, 0, 0, 1);
  const std::vector<double> coefficients(converted.distortion.begin(), converted.distortion.end());
  const std::vector<cv::Point3d> points{{0.1, -0.2, 1.0}, {-700.0, 500.0, 2000.0}, {0.35, 0.25, 1.0}};
  std::vector<cv::Point2d> seen;
  cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix, coefficients, seen);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const ObservedPoint mine = project(camera, Eigen::Vector3d(points[i].x, points[i].y, points[i].z));
    CHECK(mine.x_px == Approx(seen[i].x).margin(1e-6));
    CHECK(mine.y_px == Approx(seen[i].y).margin(1e-6));
  }
}

TEST_CASE("opencv camera: a shear is fitted, and the error stated is the error there is") {
  CameraModel camera = paper_camera_without_affine();
  camera.distortion.affine = {1.231e-4, 1.216e-4};
  const auto [converted, max_error_px] = to_opencv(camera);
  CHECK(max_error_px > 0.01);
  CHECK(max_error_px < 0.3);  // C2 v n at the upper rim: 0.21 px
  const auto back = from_opencv(converted);
  REQUIRE(back);
  const double difference = largest_difference_px(camera, back->camera);
  CHECK(difference < 1.1 * max_error_px + 0.001);
  CHECK(difference > 0.7 * max_error_px);
}

TEST_CASE("camera yaml: what is exported comes back, from both formats, through the reader of camN.toml") {
  const Folder folder;
  const CameraModel camera = paper_camera_without_affine();
  for (const auto& [name, text] : {std::pair{"cam1.opencv.yaml", camera_as_opencv_yaml(camera)},
                                   std::pair{"cam1.ros.yml", camera_as_ros_yaml(camera)}}) {
    std::vector<std::string> warnings;
    const auto read = read_camera_file(folder.write(name, text), &warnings);
    REQUIRE(read);
    CHECK(read->id == "cam1");
    CHECK(read->pixel_pitch_um == 3.8);
    CHECK(read->focal_length_px == Approx(camera.focal_length_px).epsilon(1e-9));
    CHECK(largest_difference_px(camera, *read) < 1e-6);
    CHECK(warnings.empty());
  }
}

TEST_CASE("camera yaml: OpenCV itself reads the export") {
  const Folder folder;
  const auto path = folder.write("cam1.yaml", camera_as_opencv_yaml(paper_camera_without_affine()));
  cv::FileStorage storage(path.string(), cv::FileStorage::READ);
  REQUIRE(storage.isOpened());
  cv::Mat matrix, coefficients;
  storage["camera_matrix"] >> matrix;
  storage["distortion_coefficients"] >> coefficients;
  CHECK(static_cast<int>(storage["image_width"]) == 4656);
  CHECK(matrix.at<double>(0, 2) == Approx(2367.8));
  CHECK(coefficients.total() == 5);
}

TEST_CASE("camera yaml: a file that OpenCV wrote is read, its name taken from the file") {
  const Folder folder;
  const fs::path path = folder.path / "left.yaml";
  {
    cv::FileStorage storage(path.string(), cv::FileStorage::WRITE);
    storage << "image_width" << 1280 << "image_height" << 960;
    storage << "camera_matrix" << cv::Mat(cv::Matx33d(1100.5, 0, 640.25, 0, 1100.5, 479.5, 0, 0, 1));
    storage << "distortion_coefficients" << cv::Mat(cv::Matx<double, 1, 5>(-0.21, 0.11, 3e-4, -2e-4, 0.01));
  }
  std::vector<std::string> warnings;
  const auto read = read_camera_file(path, &warnings);
  REQUIRE(read);
  CHECK(read->id == "left");
  CHECK(warnings.empty());  // fx = fy: the same but for notation
  OpenCvCamera camera{1280, 960, 1100.5, 1100.5, 640.25, 479.5, {-0.21, 0.11, 3e-4, -2e-4, 0.01}};
  const ObservedPoint theirs = project(camera, -0.3, 0.2), ours = project(*read, {-0.3, 0.2, 1.0});
  CHECK(ours.x_px == Approx(theirs.x_px).margin(1e-5));
  CHECK(ours.y_px == Approx(theirs.y_px).margin(1e-5));
}

TEST_CASE("camera yaml: a rational model is fitted and the difference is said") {
  const Folder folder;
  const std::string text =
      "image_width: 1280\nimage_height: 960\ncamera_name: wide\ndistortion_model: rational_polynomial\n"
      "camera_matrix:\n  data: [700.0, 0., 640., 0., 702.0, 480., 0., 0., 1.]\n"
      "distortion_coefficients:\n  data:\n  - 0.9\n  - 0.2\n  - 1e-4\n  - 2e-4\n  - 0.01\n  - 1.1\n  - 0.35\n"
      "  - 0.02\n";
  std::vector<std::string> warnings;
  const auto read = read_camera_file(folder.write("cam1.yaml", text), &warnings);
  REQUIRE(read);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("differs by up to"));
}

TEST_CASE("camera yaml: what is wrong is named, with the file") {
  const Folder folder;
  const auto refusal = [&](const std::string& text) {
    const auto read = read_camera_file(folder.write("bad.yaml", text));
    REQUIRE(!read);
    CHECK(read.error().exit_status() == 2);
    CHECK_THAT(read.error().message, Contains("bad.yaml"));
    CHECK(read.error().message.find('\n') == std::string::npos);
    return read.error().message;
  };
  CHECK_THAT(refusal(""), Contains("image_width"));
  CHECK_THAT(refusal("\x01\x02 nothing like it"), Contains("key: value"));
  CHECK_THAT(refusal(ros_yaml("image_height: 3520", "image_height: -3")), Contains("image_height"));
  CHECK_THAT(refusal(ros_yaml("plumb_bob", "equidistant")), Contains("equidistant"));
  CHECK_THAT(refusal(ros_yaml("camera_name: cam1", "camera_name: \"a b\"")), Contains("camera_name"));
  CHECK_THAT(refusal("image_width: 4\nimage_height: 4\ncamera_matrix: [1, 2, 3"), Contains("no end"));
  CHECK_THAT(refusal("image_width: 4\nimage_height: 4\ncamera_matrix: [1, 2, 3]"), Contains("expected 9 numbers"));
  CHECK_THAT(refusal("image_width: 1280\nimage_height: 960\ncamera_matrix: [900, 0, 640, 0, 900, 480, 0, 0, 1]\n"
                     "distortion_coefficients: [-2.5, 0, 0, 0]"),
             Contains("fold"));
}
